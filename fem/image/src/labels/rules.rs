//! Meaning of the labels of an image.

use std::collections::BTreeMap;

use crate::listing::listed;
use crate::{ImageError, SpecimenForm, SpecimenRegion};

/// Name of the phase that surrounds the grains.
pub const MATRIX: &str = "matrix";
/// Name of the phase of voids: pores, cracks.
pub const VOID: &str = "void";
/// Name of the phase of grains if the user gives no phases.
const GRAIN: &str = "grain";

/// Labels of one phase.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LabelPhase {
    /// First label of the phase.
    pub first: i64,
    /// Last label of the phase; it is at least the first label.
    pub last: i64,
    /// Name of the phase: `matrix`, `void`, or a phase of grains.
    pub name: String,
}

impl LabelPhase {
    /// Returns whether each label of the phase is one grain, which is the case for a phase with several labels. In a
    /// phase with one label, each connected part is a grain.
    pub fn has_instances(&self) -> bool {
        self.last > self.first
    }
}

/// Meaning of the labels of an image, and the form of the specimen in the image.
///
/// # Example
/// ```
/// use fem_image::{LabelPhase, LabelRules, Volume};
///
/// // two grains of label 1 and one of label 2, in a row
/// let image = Volume::new([7, 1, 1], 0.1, vec![1, 1, 0, 1, 2, 2, 0])?;
/// let phase = |label, name: &str| LabelPhase { first: label, last: label, name: name.into() };
/// let phases = vec![phase(1, "grain"), phase(2, "inclusion")];
/// let found = LabelRules { phases, ..LabelRules::default() }.run(&image, &mut |_| ())?;
/// assert_eq!(found.labels.values, [1, 1, 0, 2, 3, 3, 0]);
/// assert_eq!(found.phases, ["grain", "inclusion"]);
/// assert_eq!(found.phase_of, [0, 0, 1]);
/// # Ok::<(), fem_image::ImageError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct LabelRules {
    /// Label of the surroundings of the specimen; `None` if the image contains only the specimen.
    pub background: Option<i64>,
    /// The phases. If empty, each label other than 0 and the background is a grain.
    pub phases: Vec<LabelPhase>,
    /// Form of the specimen. `Auto` selects a cylinder if the image contains background, otherwise a block.
    pub specimen: SpecimenForm,
    /// Whether a tilted cylinder is fitted with its tilt; otherwise the fitted cylinder is upright.
    pub follow_lean: bool,
    /// Position of the specimen as given by the user. Voxels outside this region count as background. A `mask` is not
    /// supported.
    pub region: SpecimenRegion,
    /// Grains with fewer voxels than this number are reported in a warning.
    pub small_grain_voxels: usize,
}

impl Default for LabelRules {
    fn default() -> Self {
        LabelRules {
            background: None,
            phases: Vec::new(),
            specimen: SpecimenForm::Auto,
            follow_lean: true,
            region: SpecimenRegion::default(),
            small_grain_voxels: 30,
        }
    }
}

/// Meaning of the voxels of a label.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Role {
    Outside,
    Matrix,
    /// Grains: index of the phase in `grain_phases`, and whether all voxels of the label form one grain.
    Grain {
        phase: usize,
        is_one: bool,
    },
}

impl LabelRules {
    /// Returns the names of all phases except the matrix (also `void`), in the order of `phases`.
    pub fn grain_phases(&self) -> Vec<String> {
        if self.phases.is_empty() {
            return vec![GRAIN.into()];
        }
        let mut names: Vec<String> = Vec::new();
        for phase in self.phases.iter().filter(|phase| phase.name != MATRIX) {
            if !names.contains(&phase.name) {
                names.push(phase.name.clone());
            }
        }
        names
    }

    /// Checks that the rules are consistent, in particular that no label has two meanings.
    ///
    /// # Errors
    /// [`ImageError::Labels`].
    pub fn check(&self) -> Result<(), ImageError> {
        let refuse = |what: String, help| Err(ImageError::Labels { what, help });
        self.region.check()?;
        if self.region.mask.is_some() {
            let help =
                "give voxels outside the mask the label of the background in the image of labels";
            return refuse("region.mask is for grey values".into(), help);
        }
        if self.specimen == SpecimenForm::Block && !self.region.is_empty() {
            let help = "remove region, or set specimen = \"cylinder\"";
            return refuse("region describes a cylinder, but specimen is \"block\"".into(), help);
        }
        for (index, phase) in self.phases.iter().enumerate() {
            let LabelPhase { first, last, name } = phase;
            if last < first {
                let help = "write the smaller label first";
                return refuse(
                    format!("the range of labels {first} to {last} of {name} is empty"),
                    help,
                );
            }
            if self.background.is_some_and(|label| (*first..=*last).contains(&label)) {
                let help = "use different labels for the phase and the background (the surroundings of the specimen)";
                return refuse(format!("the background is also a label of {name}"), help);
            }
            let other = self.phases[..index].iter().find(|o| o.first <= *last && *first <= o.last);
            if let Some(other) = other {
                let label = other.first.max(*first);
                let what = format!("the label {label} belongs to {} and to {name}", other.name);
                return refuse(what, "assign each label to one phase");
            }
        }
        if !self.phases.is_empty() && self.grain_phases().is_empty() {
            let help = "name a phase of grains, such as \"grain\"";
            return refuse("all labels are matrix".into(), help);
        }
        let has_outside = self.background.is_some() || !self.region.is_empty();
        if self.specimen == SpecimenForm::Cylinder && !has_outside {
            return refuse(
                "a cylinder is required, but no label is the background".into(),
                "give background (the label of the surroundings of the specimen) or region, or set specimen = \"block\"",
            );
        }
        Ok(())
    }

    /// Returns the meaning of each label of an image. `counts` contains the number of voxels of each label.
    pub(super) fn roles(
        &self,
        counts: &BTreeMap<i64, usize>,
    ) -> Result<BTreeMap<i64, Role>, ImageError> {
        let names = self.grain_phases();
        let mut unknown = Vec::new();
        let mut roles = BTreeMap::new();
        for (&label, &count) in counts {
            let phase = self.phases.iter().find(|p| (p.first..=p.last).contains(&label));
            let role = match phase {
                _ if self.background == Some(label) => Role::Outside,
                Some(phase) if phase.name == MATRIX => Role::Matrix,
                Some(phase) => Role::Grain {
                    phase: names.iter().position(|name| *name == phase.name).unwrap_or(0),
                    is_one: phase.has_instances(),
                },
                None if label == 0 => Role::Matrix,
                None if self.phases.is_empty() => Role::Grain { phase: 0, is_one: true },
                None => {
                    unknown.push(format!("{label} ({count} voxels)"));
                    continue;
                }
            };
            roles.insert(label, role);
        }
        if unknown.is_empty() {
            return Ok(roles);
        }
        Err(ImageError::Labels {
            what: format!("the image has labels without a phase: {}", listed(&unknown, ", ")),
            help: "list these labels in label_phases, or give the label of the surroundings of the specimen as background",
        })
    }
}
