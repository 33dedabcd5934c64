//! The phases of grains and the corresponding regions of a mesh.

use super::field::GrainField;
use fem_image::VOID;

/// The phases of a [`GrainField`], and the phase of each grain.
pub(crate) struct Phases {
    pub(crate) names: Vec<String>,
    /// Phase of each grain as an index into `names`; the first entry belongs to grain number 1.
    of_grain: Vec<usize>,
}

impl Phases {
    pub(crate) fn of(field: &dyn GrainField) -> Phases {
        let of_grain = (1..=field.grains() as u32).map(|grain| field.phase_of(grain)).collect();
        Phases { names: field.phases(), of_grain }
    }

    /// Returns the phase of a grain, an index into `names`.
    pub(crate) fn of_grain(&self, grain: u32) -> usize {
        self.of_grain[grain as usize - 1]
    }

    /// Returns whether a grain is a void.
    pub(crate) fn is_void(&self, grain: u32) -> bool {
        self.names[self.of_grain(grain)] == VOID
    }

    /// Returns the number of phases that have grains, without the phase of voids.
    pub(crate) fn solid(&self) -> usize {
        let is_solid = |phase: &usize| self.names[*phase] != VOID && self.of_grain.contains(phase);
        (0..self.names.len()).filter(is_solid).count()
    }

    /// Returns the regions of a mesh whose tetrahedra have the given labels (grain numbers; 0 for the matrix). If the
    /// mesh has mixtures (`mixed`), a phase also becomes a region if no tetrahedron has the label of one of its grains.
    pub(crate) fn regions(&self, labels: &[u32], mixed: bool) -> Regions {
        let mut is_present = vec![false; self.names.len()];
        for &label in labels.iter().filter(|label| **label > 0) {
            is_present[self.of_grain(label)] = true;
        }
        if mixed {
            for &phase in self.of_grain.iter().filter(|phase| self.names[**phase] != VOID) {
                is_present[phase] = true;
            }
        }
        let mut regions = Regions { names: vec!["matrix".into()], of_phase: Vec::new() };
        for (name, is_present) in self.names.iter().zip(is_present) {
            regions.of_phase.push(regions.names.len() as u16);
            if is_present {
                regions.names.push(name.clone());
            }
        }
        regions
    }

    /// Returns the region of a label (grain number; 0 for the matrix).
    pub(crate) fn region_of(&self, label: u32, regions: &Regions) -> u16 {
        if label == 0 { 0 } else { regions.of_phase[self.of_grain(label)] }
    }
}

/// Regions of a mesh: the matrix, then the phases that occur in the mesh.
pub(crate) struct Regions {
    pub(crate) names: Vec<String>,
    /// Region of each phase; the entry of a phase without a region is not used.
    pub(crate) of_phase: Vec<u16>,
}
