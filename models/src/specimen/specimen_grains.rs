//! A specimen with its grains: segmented from grey values, or labelled by the user.

use fem::{
    Cylinder, GrainField, LabelledSpecimen, Region, Segmented, SpecimenStatistics, VOID, Volume,
    VoxelGrains,
};

/// Result of a segmentation or of reading labels: a specimen with its grains.
pub(crate) enum SpecimenGrains {
    /// Segmented from grey values.
    Grey(Segmented),
    /// Labelled by the user.
    Labels(LabelledSpecimen),
}

/// Phases of the grains: the names of the phases, and number and phase of each grain. The phase is an index into the
/// names.
#[derive(Clone, Debug)]
pub(crate) struct GrainPhases {
    pub(crate) names: Vec<String>,
    pub(crate) of_grains: Vec<(u32, usize)>,
}

impl Default for GrainPhases {
    /// A single phase, `grain`, for all grains.
    fn default() -> Self {
        Self { names: vec!["grain".to_owned()], of_grains: Vec::new() }
    }
}

impl SpecimenGrains {
    /// Grain number of each voxel, from 1; 0 is not a grain.
    pub(crate) fn labels(&self) -> &Volume<u32> {
        match self {
            Self::Grey(grains) => &grains.labels,
            Self::Labels(grains) => &grains.labels,
        }
    }

    /// Grain fraction of each voxel; `None` for labels of the user, which have no grey values.
    pub(crate) fn solid(&self) -> Option<&Volume<f32>> {
        match self {
            Self::Grey(grains) => Some(&grains.solid),
            Self::Labels(_) => None,
        }
    }

    pub(crate) fn cylinder(&self) -> &Cylinder {
        match self {
            Self::Grey(grains) => &grains.cylinder,
            Self::Labels(grains) => &grains.cylinder,
        }
    }

    pub(crate) fn cylinder_mut(&mut self) -> &mut Cylinder {
        match self {
            Self::Grey(grains) => &mut grains.cylinder,
            Self::Labels(grains) => &mut grains.cylinder,
        }
    }

    /// All grains, including voids.
    pub(crate) fn regions(&self) -> &[Region] {
        match self {
            Self::Grey(grains) => &grains.regions,
            Self::Labels(grains) => &grains.regions,
        }
    }

    pub(crate) fn statistics(&self) -> &SpecimenStatistics {
        match self {
            Self::Grey(grains) => &grains.statistics,
            Self::Labels(grains) => &grains.statistics,
        }
    }

    pub(crate) fn warnings(&self) -> &[String] {
        match self {
            Self::Grey(grains) => &grains.warnings,
            Self::Labels(grains) => &grains.warnings,
        }
    }

    /// Whether the image shows only a part of a specimen.
    pub(crate) fn is_block(&self) -> bool {
        match self {
            Self::Grey(grains) => grains.block,
            Self::Labels(grains) => grains.block,
        }
    }

    pub(crate) fn phases(&self) -> GrainPhases {
        match self {
            Self::Grey(_) => GrainPhases::default(),
            Self::Labels(grains) => GrainPhases {
                names: grains.phases.clone(),
                of_grains: (1..).zip(grains.phase_of.iter().copied()).collect(),
            },
        }
    }

    /// Returns the phase of a grain and the grain's label in the user's image. For a specimen from grey values, the
    /// label is the number of the grain.
    pub(crate) fn phase_and_label(&self, grain: &Region) -> (&str, i64) {
        match self {
            Self::Grey(_) => ("grain", i64::from(grain.id)),
            Self::Labels(grains) => {
                let index = grain.id as usize - 1;
                (&grains.phases[grains.phase_of[index]], grains.label_of[index])
            }
        }
    }

    /// Returns number and volume (mm³) of each grain, measured from grey values; the list is empty for
    /// labels of the user.
    pub(crate) fn volumes_mm3(&self) -> Vec<(u32, f64)> {
        match self {
            Self::Grey(grains) => {
                grains.regions.iter().map(|grain| (grain.id, grain.volume_mm3)).collect()
            }
            Self::Labels(_) => Vec::new(),
        }
    }

    /// The grains that are not voids.
    pub(crate) fn solid_grains(&self) -> impl Iterator<Item = &Region> {
        self.regions().iter().filter(|grain| self.phase_and_label(grain).0 != VOID)
    }

    /// Volume fraction of each phase in the meshed cylinder, computed with the method of the mesher.
    pub(crate) fn fractions(&self) -> Vec<(String, f64)> {
        let GrainPhases { names, of_grains } = self.phases();
        let grains = VoxelGrains::new(self.labels(), self.solid(), self.cylinder())
            .with_volumes(self.volumes_mm3())
            .with_phases(names.clone(), of_grains);
        let mut volumes = vec![0.0; names.len()];
        for grain in (1..).take(grains.grains()) {
            volumes[grains.phase_of(grain)] += grains.volume_mm3(grain);
        }
        let whole = self.cylinder().volume_mm3();
        names.into_iter().zip(volumes).map(|(name, volume)| (name, volume / whole)).collect()
    }
}
