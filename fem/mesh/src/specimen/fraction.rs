//! Grains that the mesh does not follow: how much of each tetrahedron they take, and how their
//! surface lies in it.

use rayon::prelude::*;

use super::GrainField;
use super::samples::{SAMPLES, Sampled};
use crate::mesh::vector::{Point, add, norm, scale};
use crate::mesh::{Mixture, TetMesh};

/// Newton steps for the offsets that keep the grains' volumes.
const CORRECTIONS: usize = 3;
/// The largest offset, over the width of a sample.
const LARGEST_OFFSET: f64 = 0.5;
/// Tetrahedra with more grain than this are grain, with less than its complement matrix.
const WHOLE: f64 = 0.999;
/// Distances are differenced over this share of a sample's width.
const STEP: f64 = 0.05;
/// The mean of the unit normals in a tetrahedron is at least so long where it has a direction.
const DIRECTED: f64 = 0.3;

/// What the grains do to a mesh that does not follow them.
pub(super) struct Mixed {
    pub(super) mixture: Vec<Mixture>,
    /// Volume that each grain has in mixtures and in tetrahedra that became wholly its own (mm³).
    pub(super) volumes_mm3: Vec<f64>,
}

/// The share of a tetrahedron that one grain takes.
struct Share {
    grain: u32,
    fraction: f64,
    /// Change of the fraction with the offset (1/mm).
    slope: f64,
}

/// Fills the matrix of a labelled mesh with those grains that it does not follow. Tetrahedra that
/// lie wholly in one get its label.
///
/// A sample counts with the share of its own width that lies inside; then one offset a grain, and at
/// last one factor, keep its volume.
pub(super) fn mix(
    mesh: &TetMesh,
    field: &dyn GrainField,
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
    let mut taken = Vec::new();
    for round in 0..=CORRECTIONS {
        let of_tet = |(tet, sampled): &(usize, Sampled)| {
            shares_of(field, sampled, width(*tet), &offsets, &spread)
        };
        shares = sampled.par_iter().map(of_tet).collect::<Vec<_>>();
        taken = vec![0.0; grains];
        let (mut slopes, mut widest) = (vec![0.0; grains], vec![0.0_f64; grains]);
        for ((tet, _), shares) in sampled.iter().zip(&shares) {
            for share in shares {
                let grain = share.grain as usize - 1;
                taken[grain] += share.fraction * volumes[*tet];
                slopes[grain] += share.slope * volumes[*tet];
                widest[grain] = widest[grain].max(width(*tet));
            }
        }
        if round == CORRECTIONS {
            break;
        }
        for grain in (0..grains).filter(|&grain| mixes[grain]) {
            if taken[grain] == 0.0 {
                // it fell between the samples: let them look farther
                spread[grain] = 4.0;
            } else if slopes[grain] > 0.0 {
                let missing = field.volume_mm3(grain as u32 + 1) - taken[grain];
                let most = LARGEST_OFFSET * widest[grain];
                offsets[grain] = (offsets[grain] + missing / slopes[grain]).clamp(-most, most);
            }
        }
    }

    let factor = |grain: u32| {
        let grain_volume = field.volume_mm3(grain);
        let taken: f64 = taken[grain as usize - 1];
        if taken > 0.0 { grain_volume / taken } else { 0.0 }
    };
    let of_tet = |((tet, sampled), shares): (&(usize, Sampled), &Vec<Share>)| {
        let mut own: Vec<(u32, f64)> = shares
            .iter()
            .map(|share| (share.grain, share.fraction * factor(share.grain)))
            .collect();
        let total: f64 = own.iter().map(|(_, fraction)| fraction).sum();
        if total > 1.0 {
            own.iter_mut().for_each(|(_, fraction)| *fraction /= total);
        }
        let normal = normal(field, sampled, width(*tet), &offsets);
        (own, total.min(1.0), normal)
    };
    let filled: Vec<_> = sampled.par_iter().zip(&shares).map(of_tet).collect();
    let mut mixed = Mixed {
        mixture: vec![Mixture::default(); mesh.tets.len()],
        volumes_mm3: vec![0.0; grains],
    };
    for ((tet, _), (own, total, normal)) in sampled.iter().zip(filled) {
        if total < 1.0 - WHOLE {
            continue;
        }
        if total > WHOLE {
            let largest = own.iter().max_by(|a, b| a.1.total_cmp(&b.1).then(b.0.cmp(&a.0)));
            labels[*tet] = largest.map_or(0, |&(grain, _)| grain);
        } else {
            mixed.mixture[*tet] =
                Mixture { fraction: total as f32, normal: normal.map(|x| x as f32) };
        }
        for (grain, fraction) in own {
            mixed.volumes_mm3[grain as usize - 1] += fraction * volumes[*tet];
        }
    }
    mixed
}

/// How much of a tetrahedron each grain takes, by the distances of its samples.
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
        for &point in &sampled.points {
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

/// Unit normal of the surfaces that pass the samples, towards the matrix; zero where they have no
/// common direction.
fn normal(field: &dyn GrainField, sampled: &Sampled, width: f64, offsets: &[f64]) -> Point {
    let (mut sum, mut count) = ([0.0; 3], 0.0);
    for &grain in &sampled.grains {
        let offset = offsets[grain as usize - 1];
        for &point in &sampled.points {
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
