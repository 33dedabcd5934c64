//! Grains that the mesh does not resolve: the volume fraction of grains in each tetrahedron and the normal of the grain
//! surface inside the tetrahedron.

use rayon::prelude::*;

use super::samples::{SAMPLES, Sampled};
use crate::mesh::vector::{Point, add, norm, scale};
use crate::mesh::{Mixture, TetMesh};
use crate::specimen::grains::{GrainField, Phases};

/// Number of Newton steps that determine the offset of each grain surface. The offset corrects the volume of the grain.
const CORRECTIONS: usize = 3;
/// Largest offset of a grain surface, relative to the width of a sample (edge length of a cube with the volume of a
/// sample).
const LARGEST_OFFSET: f64 = 0.5;
/// A tetrahedron with a grain fraction above this value becomes grain. A tetrahedron with a grain fraction below one
/// minus this value becomes matrix.
const WHOLE: f64 = 0.999;
/// Step of the finite differences that give the gradients of signed distances, relative to the width of a sample.
const STEP: f64 = 0.05;
/// Smallest length of the mean of the unit normals in a tetrahedron. If the mean is shorter, the normals have no common
/// direction, and the interface gets no normal.
const DIRECTED: f64 = 0.3;
/// Number of rounds in which the factors of the grain fractions are corrected in a mesh with several phases.
const ROUNDS: usize = 6;
/// Bounds of the number by which one round multiplies the factor of a grain fraction.
const FACTORS: [f64; 2] = [0.5, 2.0];

/// Mixtures of matrix and grain in the tetrahedra of a mesh that does not resolve the grains.
pub(super) struct Mixed {
    /// Mixture of each tetrahedron; here, `region` is the index of a phase.
    pub(super) mixture: Vec<Mixture>,
    /// Volume of each grain in mixtures and in tetrahedra that became entirely grain (mm³).
    pub(super) volumes_mm3: Vec<f64>,
    /// Number of tetrahedra that contain grains of several phases; each of these tetrahedra stores only its largest
    /// phase.
    pub(super) multiphase_tets: usize,
}

/// Volume fraction of one grain in a tetrahedron.
struct Share {
    grain: u32,
    fraction: f64,
    /// Derivative of the fraction with respect to the offset of the grain surface (1/mm).
    slope: f64,
}

/// Adds the grains marked in `mixes` to the matrix tetrahedra of a labelled mesh, as mixtures. A tetrahedron entirely
/// inside a grain gets the grain's label. A tetrahedron that contains several phases besides the matrix gets the
/// largest of these phases.
///
/// Each sample point represents an interval across the grain surface, and contributes the fraction of this interval
/// that lies inside the grain. The volume of each grain is preserved by an offset of its surface, and finally by a
/// factor of its fractions.
pub(super) fn mix(
    mesh: &TetMesh,
    field: &dyn GrainField,
    phases: &Phases,
    mixes: &[bool],
    labels: &mut [u32],
) -> Mixed {
    let volumes = mesh.volumes();
    let width = |tet: usize| (volumes[tet] / SAMPLES as f64).cbrt();
    let sampled: Vec<(usize, Sampled)> = (0..mesh.tets.len())
        .into_par_iter()
        .filter(|&tet| labels[tet] == 0)
        .filter_map(|tet| {
            let mut sampled = Sampled::new(field, &mesh.corners(tet), 2.0 * width(tet));
            sampled.grains.retain(|&grain| mixes[grain as usize - 1]);
            (!sampled.grains.is_empty()).then_some((tet, sampled))
        })
        .collect();

    let grains = field.grains();
    let mut offsets = vec![0.0; grains];
    let mut spread = vec![1.0; grains];
    let mut shares = Vec::new();
    let mut collected = Vec::new();
    for round in 0..=CORRECTIONS {
        let of_tet = |(tet, sampled): &(usize, Sampled)| {
            shares_of(field, sampled, width(*tet), &offsets, &spread)
        };
        shares = sampled.par_iter().map(of_tet).collect::<Vec<_>>();
        collected = vec![0.0; grains];
        let (mut slopes, mut widest) = (vec![0.0; grains], vec![0.0_f64; grains]);
        for ((tet, _), shares) in sampled.iter().zip(&shares) {
            for share in shares {
                let grain = share.grain as usize - 1;
                collected[grain] += share.fraction * volumes[*tet];
                slopes[grain] += share.slope * volumes[*tet];
                widest[grain] = widest[grain].max(width(*tet));
            }
        }
        if round == CORRECTIONS {
            break;
        }
        for grain in (0..grains).filter(|&grain| mixes[grain]) {
            if collected[grain] == 0.0 {
                // the grain is so small that no sample lies inside the grain: use wider samples
                spread[grain] = 4.0;
            } else if slopes[grain] > 0.0 {
                let missing = field.volume_mm3(grain as u32 + 1) - collected[grain];
                let most = LARGEST_OFFSET * widest[grain];
                offsets[grain] = (offsets[grain] + missing / slopes[grain]).clamp(-most, most);
            }
        }
    }

    let factor = |grain: usize| {
        let collected: f64 = collected[grain];
        if collected > 0.0 { field.volume_mm3(grain as u32 + 1) / collected } else { 0.0 }
    };
    let mut factors: Vec<f64> = (0..grains).map(factor).collect();
    if phases.solid() > 1 {
        factors = corrected(field, phases, &shares, factors, |n| volumes[sampled[n].0]);
    }
    let of_tet = |((tet, sampled), shares): (&(usize, Sampled), &Vec<Share>)| {
        let filling = Filling::new(shares, &factors, phases);
        let is_of_phase = |grain: u32| phases.of_grain(grain) == filling.phase;
        let normal = normal(field, sampled, width(*tet), &offsets, is_of_phase);
        (filling, normal)
    };
    let filled: Vec<_> = sampled.par_iter().zip(&shares).map(of_tet).collect();
    let mut mixed = Mixed {
        mixture: vec![Mixture::default(); mesh.tets.len()],
        volumes_mm3: vec![0.0; grains],
        multiphase_tets: 0,
    };
    for ((tet, _), (filling, normal)) in sampled.iter().zip(filled) {
        let Filling { grains, total, phase, has_several } = filling;
        if total < 1.0 - WHOLE {
            continue;
        }
        if total > WHOLE {
            let largest = grains.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            labels[*tet] = largest.map_or(0, |&(grain, _)| grain);
        } else {
            let normal = normal.map(|x| x as f32);
            mixed.mixture[*tet] = Mixture { fraction: total as f32, normal, region: phase as u16 };
        }
        mixed.multiphase_tets += usize::from(has_several);
        for (grain, fraction) in grains {
            mixed.volumes_mm3[grain as usize - 1] += fraction * volumes[*tet];
        }
    }
    mixed
}

/// Content of a tetrahedron: matrix and one other phase.
struct Filling {
    /// Numbers of the grains of the phase, with their volume fractions.
    grains: Vec<(u32, f64)>,
    /// Sum of the volume fractions of `grains`.
    total: f64,
    /// Index of the phase.
    phase: usize,
    /// Whether the tetrahedron also contains grains of other phases.
    has_several: bool,
}

impl Filling {
    /// Creates the content of a tetrahedron. The fractions of all phases are assigned to the phase with the largest
    /// fraction, so that the fraction of the matrix is correct.
    fn new(shares: &[Share], factors: &[f64], phases: &Phases) -> Filling {
        let mut grains: Vec<(u32, f64)> = shares
            .iter()
            .map(|share| (share.grain, share.fraction * factors[share.grain as usize - 1]))
            .collect();
        let total: f64 = grains.iter().map(|(_, fraction)| fraction).sum();
        if total > 1.0 {
            grains.iter_mut().for_each(|(_, fraction)| *fraction /= total);
        }
        let total = total.min(1.0);
        let mut of_phase = vec![0.0; phases.names.len()];
        for &(grain, fraction) in &grains {
            of_phase[phases.of_grain(grain)] += fraction;
        }
        // in reverse order, so that the first of several phases with equal fractions is chosen
        let phases_by_share = (0..of_phase.len()).rev();
        let phase =
            phases_by_share.max_by(|&a, &b| of_phase[a].total_cmp(&of_phase[b])).unwrap_or(0);
        let has_several = of_phase.iter().filter(|share| **share > 1.0 - WHOLE).count() > 1;
        if of_phase[phase] < total {
            let stretch = total / of_phase[phase];
            grains.retain(|&(grain, _)| phases.of_grain(grain) == phase);
            if grains.len() < shares.len() {
                grains.iter_mut().for_each(|(_, fraction)| *fraction *= stretch);
            }
        }
        Filling { grains, total, phase, has_several }
    }
}

/// Returns, for each grain, a factor by which the fractions of the grain are multiplied. The factors preserve the
/// volumes of grains, although each tetrahedron stores only one phase besides the matrix. The returned factors are the
/// factors of the round with the smallest error of the phase volumes.
fn corrected(
    field: &dyn GrainField,
    phases: &Phases,
    shares: &[Vec<Share>],
    mut factors: Vec<f64>,
    volume_of: impl Fn(usize) -> f64,
) -> Vec<f64> {
    let mut best = (f64::INFINITY, factors.clone());
    for _ in 0..ROUNDS {
        let fillings: Vec<Filling> =
            shares.par_iter().map(|shares| Filling::new(shares, &factors, phases)).collect();
        let mut achieved = vec![0.0; factors.len()];
        for (n, filling) in fillings.iter().enumerate() {
            for &(grain, fraction) in &filling.grains {
                achieved[grain as usize - 1] += fraction * volume_of(n);
            }
        }
        let mut missing = vec![0.0; phases.names.len()];
        for (k, &achieved) in achieved.iter().enumerate().filter(|&(k, _)| factors[k] > 0.0) {
            let grain = k as u32 + 1;
            missing[phases.of_grain(grain)] += field.volume_mm3(grain) - achieved;
        }
        let error: f64 = missing.iter().map(|missing| missing.abs()).sum();
        if error < best.0 {
            best = (error, factors.clone());
        }
        for (k, factor) in factors.iter_mut().enumerate().filter(|(_, factor)| **factor > 0.0) {
            let [least, most] = FACTORS;
            // the factor of a grain that is the largest phase in no tetrahedron increases in each round, until the
            // grain has a tetrahedron
            *factor *= (field.volume_mm3(k as u32 + 1) / achieved[k]).clamp(least, most);
        }
    }
    best.1
}

/// Returns the volume fraction of each grain in a tetrahedron, from the signed distances of the samples.
fn shares_of(
    field: &dyn GrainField,
    sampled: &Sampled,
    width: f64,
    offsets: &[f64],
    spread: &[f64],
) -> Vec<Share> {
    let mut shares = Vec::new();
    for &grain in &sampled.grains {
        let width = width * spread[grain as usize - 1];
        let offset = offsets[grain as usize - 1];
        let (mut inside, mut cut) = (0.0, 0.0);
        for &point in &sampled.positions {
            let limit = offset + 0.5 * width;
            if let Some(distance) = field.distance_below(grain, point, limit) {
                let share = 0.5 - (distance - offset) / width;
                inside += share.min(1.0);
                cut += f64::from(share < 1.0);
            }
        }
        if inside > 0.0 {
            let samples = SAMPLES as f64;
            shares.push(Share {
                grain,
                fraction: inside / samples,
                slope: cut / (samples * width),
            });
        }
    }
    shares
}

/// Returns the mean unit normal of the grain surfaces near the samples, pointing towards the matrix; zero if the
/// normals have no common direction. Only grains for which `counts` returns `true` contribute.
fn normal(
    field: &dyn GrainField,
    sampled: &Sampled,
    width: f64,
    offsets: &[f64],
    counts: impl Fn(u32) -> bool,
) -> Point {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for &grain in sampled.grains.iter().filter(|grain| counts(**grain)) {
        let offset = offsets[grain as usize - 1];
        for &point in &sampled.positions {
            let limit = offset + 0.5 * width;
            let distance = field.distance_below(grain, point, limit);
            if distance.is_some_and(|distance| distance > offset - 0.5 * width) {
                sum = add(sum, field.distance_and_gradient(grain, point, STEP * width).1);
                count += 1.0;
            }
        }
    }
    let length = norm(sum);
    if length > DIRECTED * count && count > 0.0 { scale(sum, 1.0 / length) } else { [0.0; 3] }
}
