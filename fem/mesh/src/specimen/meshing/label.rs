//! Labels of tetrahedra: the grain to which each tetrahedron belongs.

use std::fmt;

use rayon::prelude::*;

use super::adjacency::Adjacency;
use super::samples::{SAMPLES, Sampled, majority};
use crate::mesh::TetMesh;
use crate::specimen::grains::{Grain, GrainField, GrainList, Phases};

/// Target of the labelled volume fraction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum FractionTarget {
    /// The exact volume of the grains divided by the volume of the mesh.
    #[default]
    GrainVolume,
    /// A given fraction of the volume of the mesh.
    Fraction(f64),
    /// No target; the fraction results from the sample points.
    Uncorrected,
}

/// Settings of the labelling of tetrahedra.
///
/// A tetrahedron becomes grain if at least 8 of its 15 sample points lie in grains; it gets the label of the grain that
/// contains most of these points. A connected component of one or two tetrahedra with equal labels gets the label of an
/// adjacent component.
///
/// On a coarse mesh the labelled fraction, and therefore the stiffness, would vary by several percent between
/// microstructures. By default, all grain surfaces are shifted outwards by a common offset so that the labelled
/// fraction meets the target; a bisection determines the offset. The offset is at most half the mean edge length, so
/// that grains much smaller than the tetrahedra are not inflated to the size of a tetrahedron.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Labelling {
    /// Target of the labelled volume fraction.
    pub target: FractionTarget,
    /// Connected components of equal labels with fewer than this number of tetrahedra are relabelled.
    pub smallest_component: usize,
    /// Whether grains that share nodes are separated, so that no node belongs to two grains.
    ///
    /// Without separation, a film of matrix thinner than a tetrahedron disappears, and grains that share nodes are
    /// rigidly joined. On a coarse mesh these grains form a skeleton that carries the load.
    pub separate: bool,
}

impl Default for Labelling {
    fn default() -> Self {
        Labelling { target: FractionTarget::default(), smallest_component: 3, separate: true }
    }
}

/// Result of a labelling.
#[derive(Clone, Debug, PartialEq)]
pub struct LabelReport {
    /// Volume fraction of all grains that the labelling should reach.
    pub asked_fraction: f64,
    /// Volume fraction of the labelled tetrahedra if the grain surfaces are not shifted.
    pub uncorrected_fraction: f64,
    /// Volume fraction of the tetrahedra that are labelled as grain.
    pub achieved_fraction: f64,
    /// Distance by which all grain surfaces were shifted outwards, to reach the target (mm).
    pub offset_mm: f64,
    /// Exact and labelled volume of each grain.
    pub grains: Vec<GrainVolume>,
    /// Number of tetrahedra whose label changed because they belonged to a small component or joined two grains.
    pub relabelled_tets: usize,
    /// For each tetrahedron, the fraction of its sample points that lie in grains whose surfaces are not shifted.
    pub grain_fraction: Vec<f64>,
}

/// Exact volume of a grain, and volume of the tetrahedra with the label of the grain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GrainVolume {
    /// Exact volume (mm³).
    pub exact_mm3: f64,
    /// Volume of the grain's tetrahedra (mm³).
    pub labelled_mm3: f64,
    /// Number of the grain's tetrahedra.
    pub tets: usize,
}

impl LabelReport {
    /// Returns the number of grains without a tetrahedron because they are too small for the mesh.
    pub fn lost_grains(&self) -> usize {
        self.grains.iter().filter(|grain| grain.tets == 0).count()
    }
}

impl fmt::Display for LabelReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            f,
            "{} grains, volume fraction {:.4} (target {:.4}, before correction {:.4}), offset \
             {:+.4} mm",
            self.grains.len(),
            self.achieved_fraction,
            self.asked_fraction,
            self.uncorrected_fraction,
            self.offset_mm
        )?;
        match self.lost_grains() {
            0 => Ok(()),
            lost => write!(f, "; {lost} grains are too small for the mesh and were omitted"),
        }
    }
}

/// Labels the tetrahedra with the default [`Labelling`].
///
/// Sets `region_of`, `grain_of` and `regions` of the mesh. The regions are `matrix` and `grain`; if no tetrahedron
/// belongs to a grain, the only region is `matrix`.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Grain, label};
///
/// let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
/// let mut mesh = lattice.build()?;
/// let report = label(&mut mesh, &[Grain::sphere([0.0, 0.0, 2.2], 1.5)]);
/// assert!((report.achieved_fraction / report.asked_fraction - 1.0).abs() < 0.01);
/// # Ok::<(), fem_mesh::LatticeError>(())
/// ```
pub fn label(mesh: &mut TetMesh, grains: &[Grain]) -> LabelReport {
    Labelling::default().apply(mesh, grains)
}

impl Labelling {
    /// Labels the tetrahedra; see [`label`].
    pub fn apply(&self, mesh: &mut TetMesh, grains: &[Grain]) -> LabelReport {
        // with an infinite cylinder, the whole volume of each grain counts
        self.apply_field(mesh, &GrainList::new(grains.to_vec(), f64::INFINITY, f64::INFINITY))
    }

    /// Labels the tetrahedra like [`Labelling::apply`], for any [`GrainField`].
    pub fn apply_field(&self, mesh: &mut TetMesh, grains: &dyn GrainField) -> LabelReport {
        let largest_offset = 0.5 * mesh.mean_edge();
        let near: Vec<Vec<(f64, u32)>> = (0..mesh.tets.len())
            .into_par_iter()
            .map(|tet| {
                let sampled = Sampled::new(grains, &mesh.corners(tet), largest_offset);
                sampled.nearest(grains, largest_offset)
            })
            .collect();
        let volumes = mesh.volumes();
        let total: f64 = volumes.iter().sum();
        let faces = mesh.neighbours();
        let around = Adjacency::new(mesh, &faces);
        let exact: Vec<f64> = (1..=grains.grains() as u32).map(|k| grains.volume_mm3(k)).collect();

        let labels_at = |offset: f64| {
            let mut labels: Vec<u32> = near.par_iter().map(|near| majority(near, offset)).collect();
            let mut changed = around.drop_small_components(&mut labels, self.smallest_component);
            if self.separate {
                changed += around.separate_grains(&mut labels, |_, _| true);
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
        if self.target != FractionTarget::Uncorrected && grains.grains() > 0 {
            let (mut low, mut high) = (-largest_offset, largest_offset);
            for _ in 0..30 {
                let tried = labels_at(0.5 * (low + high));
                if tried.0 < asked_fraction {
                    low = tried.1;
                } else {
                    high = tried.1;
                }
                // because small components are relabelled, the fraction is not exactly monotonic in the offset: use the
                // best result so far
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
        let phases = Phases::of(grains);
        let regions = phases.regions(&labels, false);
        mesh.region_of = labels.iter().map(|&label| phases.region_of(label, &regions)).collect();
        mesh.regions = regions.names;
        mesh.grain_of = Some(labels);
        let inside =
            |near: &[(f64, u32)]| near.iter().filter(|&&(distance, _)| distance < 0.0).count();
        LabelReport {
            asked_fraction,
            uncorrected_fraction,
            achieved_fraction,
            offset_mm,
            grains: report,
            relabelled_tets,
            grain_fraction: near.iter().map(|near| inside(near) as f64 / SAMPLES as f64).collect(),
        }
    }
}
