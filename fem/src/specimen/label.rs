//! Which tetrahedra belong to which grain.

use std::collections::HashMap;
use std::fmt;

use rayon::prelude::*;

use super::adjacency::Adjacency;
use crate::mesh::TetMesh;
use crate::mesh::vector::{Point, mean, norm, sub};
use crate::specimen::Grain;

/// Barycentric coordinates of a sample near a corner (once) and those of the other corners.
const CORNER: [f64; 2] = [0.747_719_8, 0.084_093_4];
/// As [`CORNER`], near the middle of the opposite face.
const FACE: [f64; 2] = [0.04, 0.32];
/// Near the middle of an edge: both ends of it, and the two other corners.
const EDGE: [f64; 2] = [0.42, 0.08];
/// A tetrahedron belongs to grains if so many of its 15 samples do.
const MAJORITY: usize = 8;

/// Fifteen interior points of equal weight, as barycentric coordinates: the centroid, four near
/// the corners, four near the faces, six near the edges. Their first and second moments are
/// those of the tetrahedron, so that a plane cuts off the right fraction of them on average.
fn samples() -> [[f64; 4]; 15] {
    let mut points = [[0.25; 4]; 15];
    let mut next = 1;
    for [one, others] in [CORNER, FACE] {
        for corner in 0..4 {
            points[next] = [others; 4];
            points[next][corner] = one;
            next += 1;
        }
    }
    for a in 0..4 {
        for b in 0..a {
            points[next] = [EDGE[1]; 4];
            points[next][a] = EDGE[0];
            points[next][b] = EDGE[0];
            next += 1;
        }
    }
    points
}

/// What the labelled volume fraction should be.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FractionTarget {
    /// The exact volume of the grains over the volume of the mesh.
    #[default]
    GrainVolume,
    /// A given fraction of the mesh.
    Fraction(f64),
    /// Whatever the samples give.
    Uncorrected,
}

/// How tetrahedra are labelled.
///
/// A tetrahedron belongs to a grain if at least 8 of its 15 sample points lie in grains; it then
/// gets the one that most of these points lie in. Connected components of one or two tetrahedra
/// take the label around them.
///
/// On a coarse mesh the labelled fraction would wander by several percent from one
/// microstructure to the next, and with it the stiffness. So, unless told otherwise, all signed
/// distances are shifted by one common offset, found by bisection, that brings the labelled
/// fraction to the target; it never exceeds half the mean edge length, so that grains far
/// smaller than the tetrahedra cannot be blown up to them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labelling {
    /// The wanted fraction.
    pub target: FractionTarget,
    /// Connected components of fewer tetrahedra than this are dropped.
    pub smallest_component: usize,
    /// Whether grains that touch on the mesh are separated: no node belongs to two grains.
    ///
    /// A film of matrix thinner than a tetrahedron is lost otherwise, and grains that share nodes
    /// are welded together: on a coarse mesh they soon form a skeleton that carries the load.
    pub separate: bool,
}

impl Default for Labelling {
    fn default() -> Self {
        Labelling { target: FractionTarget::default(), smallest_component: 3, separate: true }
    }
}

/// What a labelling achieved.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelReport {
    /// The wanted volume fraction of all grains.
    pub asked_fraction: f64,
    /// The labelled fraction without the common offset.
    pub uncorrected_fraction: f64,
    /// The labelled fraction.
    pub achieved_fraction: f64,
    /// The common offset (mm): grains were grown by it.
    pub offset_mm: f64,
    /// For each grain, what was asked and achieved.
    pub grains: Vec<GrainVolume>,
    /// How many tetrahedra changed their label because they stood alone or joined two grains.
    pub relabelled_tets: usize,
    /// For each tetrahedron the fraction of its samples that lies in grains (without offset).
    pub grain_fraction: Vec<f64>,
}

/// Volume of one grain, as it is and as it is labelled.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrainVolume {
    /// Exact volume (mm³).
    pub exact_mm3: f64,
    /// Volume of its tetrahedra (mm³).
    pub labelled_mm3: f64,
    /// Number of its tetrahedra.
    pub tets: usize,
}

impl LabelReport {
    /// How many grains have no tetrahedron, being too small for the mesh.
    pub fn lost_grains(&self) -> usize {
        self.grains.iter().filter(|grain| grain.tets == 0).count()
    }
}

impl fmt::Display for LabelReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} grains, volume fraction {:.4} (asked {:.4}, before correction {:.4}), offset \
             {:+.4} mm",
            self.grains.len(),
            self.achieved_fraction,
            self.asked_fraction,
            self.uncorrected_fraction,
            self.offset_mm
        )?;
        match self.lost_grains() {
            0 => Ok(()),
            lost => write!(f, "; {lost} too small for the mesh and lost"),
        }
    }
}

/// Labels the tetrahedra with the default [`Labelling`].
///
/// Sets `regions` to `matrix` and `grain` (only `matrix` if no tetrahedron is grain), `region_of`
/// and `grain_of`.
///
/// # Example
/// ```
/// use fem::{CylinderLattice, Grain, label};
///
/// let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
/// let mut mesh = lattice.build()?;
/// let report = label(&mut mesh, &[Grain::sphere([0.0, 0.0, 2.2], 1.5)]);
/// assert!((report.achieved_fraction / report.asked_fraction - 1.0).abs() < 0.01);
/// # Ok::<(), fem::LatticeError>(())
/// ```
pub fn label(mesh: &mut TetMesh, grains: &[Grain]) -> LabelReport {
    Labelling::default().apply(mesh, grains)
}

/// The samples of one tetrahedron near or in grains: signed distance and grain number, by
/// increasing distance.
type Near = Vec<(f64, u32)>;

impl Labelling {
    /// Labels the tetrahedra; see [`label`].
    pub fn apply(&self, mesh: &mut TetMesh, grains: &[Grain]) -> LabelReport {
        let largest_offset = 0.5 * mesh.mean_edge();
        let near = distances(mesh, grains, largest_offset);
        let volumes: Vec<f64> = (0..mesh.tets.len()).map(|tet| mesh.tet_volume(tet)).collect();
        let total: f64 = volumes.iter().sum();
        let faces = mesh.neighbours();
        let around = Adjacency::new(mesh, &faces);
        let exact: Vec<f64> = grains.iter().map(Grain::volume_mm3).collect();

        let labels_at = |offset: f64| {
            let mut labels: Vec<u32> = near.par_iter().map(|near| majority(near, offset)).collect();
            let mut changed = around.drop_small_components(&mut labels, self.smallest_component);
            if self.separate {
                changed += around.separate_grains(&mut labels);
                changed += around.drop_small_components(&mut labels, self.smallest_component);
            }
            let grain = labels.iter().zip(&volumes).filter(|&(&label, _)| label > 0);
            let fraction = grain.map(|(_, volume)| volume).sum::<f64>() / total;
            (fraction, offset, labels, changed)
        };
        let mut best = labels_at(0.0);
        let uncorrected_fraction = best.0;
        let asked_fraction = match self.target {
            FractionTarget::GrainVolume | FractionTarget::Uncorrected => {
                exact.iter().sum::<f64>() / total
            }
            FractionTarget::Fraction(fraction) => fraction,
        };
        if self.target != FractionTarget::Uncorrected && !grains.is_empty() {
            let (mut low, mut high) = (-largest_offset, largest_offset);
            for _ in 0..30 {
                let tried = labels_at(0.5 * (low + high));
                if tried.0 < asked_fraction {
                    low = tried.1;
                } else {
                    high = tried.1;
                }
                // dropping components makes the fraction not quite monotonic: keep the best seen
                if (tried.0 - asked_fraction).abs() < (best.0 - asked_fraction).abs() {
                    best = tried;
                }
            }
        }

        let (achieved_fraction, offset_mm, labels, relabelled_tets) = best;
        let mut report: Vec<GrainVolume> = exact
            .into_iter()
            .map(|exact_mm3| GrainVolume { exact_mm3, labelled_mm3: 0.0, tets: 0 })
            .collect();
        for (&label, volume) in labels.iter().zip(&volumes) {
            if label > 0 {
                let grain = &mut report[label as usize - 1];
                grain.labelled_mm3 += volume;
                grain.tets += 1;
            }
        }
        mesh.regions = vec!["matrix".into()];
        if labels.iter().any(|&label| label > 0) {
            mesh.regions.push("grain".into());
        }
        mesh.region_of = labels.iter().map(|&label| (label > 0) as u16).collect();
        mesh.grain_of = Some(labels);
        let inside = |near: &Near| near.iter().filter(|&&(distance, _)| distance < 0.0).count();
        LabelReport {
            asked_fraction,
            uncorrected_fraction,
            achieved_fraction,
            offset_mm,
            grains: report,
            relabelled_tets,
            grain_fraction: near.iter().map(|near| inside(near) as f64 / 15.0).collect(),
        }
    }
}

/// The grain of a tetrahedron, or 0.
fn majority(near: &Near, offset: f64) -> u32 {
    let inside = near.partition_point(|&(distance, _)| distance < offset);
    if inside < MAJORITY {
        return 0;
    }
    let mut grains: Vec<u32> = near[..inside].iter().map(|&(_, grain)| grain).collect();
    grains.sort_unstable();
    let runs = grains.chunk_by(|a, b| a == b);
    // the longest run; of equal ones the first
    runs.rev().max_by_key(|run| run.len()).map_or(0, |run| run[0])
}

/// For every tetrahedron its samples that lie in a grain or less than `band` away from one.
fn distances(mesh: &TetMesh, grains: &[Grain], band: f64) -> Vec<Near> {
    let samples = samples();
    let reach: Vec<f64> = grains.iter().map(|grain| grain.bounding_radius_mm() + band).collect();
    let cells = Cells::new(grains, &reach);
    (0..mesh.tets.len())
        .into_par_iter()
        .map(|tet| {
            let corners = mesh.corners(tet);
            let centre = mean(corners.into_iter());
            let size = corners.iter().map(|&p| norm(sub(p, centre))).fold(0.0, f64::max);
            let close: Vec<usize> = cells
                .near(centre, size)
                .filter(|&k| norm(sub(grains[k].centre, centre)) < reach[k] + size)
                .collect();
            let mut near: Near = samples
                .iter()
                .filter_map(|weights| {
                    let point = combine(&corners, weights);
                    close
                        .iter()
                        .filter_map(|&k| {
                            Some((grains[k].distance_below_mm(point, band)?, k as u32 + 1))
                        })
                        .min_by(|a, b| a.0.total_cmp(&b.0))
                        .filter(|&(distance, _)| distance < band)
                })
                .collect();
            near.sort_by(|a, b| a.0.total_cmp(&b.0));
            near
        })
        .collect()
}

/// Grains by the cells of a grid that their centres lie in.
struct Cells {
    width: f64,
    /// The farthest that a grain reaches.
    reach: f64,
    /// Numbers of grains, increasing in each cell.
    grains: HashMap<[i64; 3], Vec<usize>>,
}

impl Cells {
    fn new(grains: &[Grain], reach: &[f64]) -> Self {
        let reach = reach.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        let mut cells = Self { width: reach, reach, grains: HashMap::new() };
        for (k, grain) in grains.iter().enumerate() {
            cells.grains.entry(cells.at(grain.centre)).or_default().push(k);
        }
        cells
    }

    fn at(&self, point: Point) -> [i64; 3] {
        point.map(|x| (x / self.width).floor() as i64)
    }

    /// The grains that may reach a ball, in the order of their numbers.
    fn near(&self, centre: Point, radius: f64) -> impl Iterator<Item = usize> {
        let mut found = Vec::new();
        if self.grains.is_empty() {
            return found.into_iter();
        }
        let far = self.reach + radius;
        let low = self.at(centre.map(|x| x - far));
        let high = self.at(centre.map(|x| x + far));
        for i in low[0]..=high[0] {
            for j in low[1]..=high[1] {
                for k in low[2]..=high[2] {
                    found.extend(self.grains.get(&[i, j, k]).into_iter().flatten().copied());
                }
            }
        }
        found.sort_unstable();
        found.into_iter()
    }
}

fn combine(corners: &[Point; 4], weights: &[f64; 4]) -> Point {
    std::array::from_fn(|k| corners.iter().zip(weights).map(|(p, w)| w * p[k]).sum())
}

#[cfg(test)]
mod tests {
    use super::samples;

    #[test]
    fn samples_have_the_moments_of_the_tetrahedron() {
        let samples = samples();
        let mean = |f: &dyn Fn(&[f64; 4]) -> f64| samples.iter().map(f).sum::<f64>() / 15.0;
        for i in 0..4 {
            assert!((mean(&|p| p[i]) - 0.25).abs() < 1e-7);
            for j in 0..4 {
                let exact = if i == j { 0.1 } else { 0.05 };
                assert!((mean(&|p| p[i] * p[j]) - exact).abs() < 1e-7);
            }
        }
        for point in samples {
            assert!(point.iter().all(|&x| x > 0.0), "{point:?} is not inside");
            assert!((point.iter().sum::<f64>() - 1.0).abs() < 1e-15);
        }
    }
}
