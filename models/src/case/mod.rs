//! The case file: all inputs that determine a result, in TOML, with the unit in each key.
//!
//! `breccia init` writes [`Case::TEMPLATE`], the shipped default case with every key explained.

mod between_tests;
mod block;
mod calibration;
mod changed;
mod conditions;
mod excerpt;
mod experiments;
mod fidelity;
mod free_parameters;
mod further;
#[cfg(test)]
mod fuzz;
mod geometry;
mod image;
mod interface;
mod labels;
mod machine;
mod material;
mod mistakes;
mod overlay;
mod own_data;
mod parameter;
mod paths;
mod plastic;
mod program;
mod read;
pub(crate) mod schema;
mod several_tests;
mod simulation;
mod simulator;
pub(crate) mod tables;
mod target;
mod template;
mod test_kind;
#[cfg(test)]
mod tests;
mod trend_values;
mod validate;
mod validation;

use std::collections::BTreeMap;
use std::path::PathBuf;

use fem::gmsh::PhysicalGroups;
use fem::{
    GrainMode, Homogenisation, Meshing, Order, Packing, PhaseField, Scanner, SolverOptions,
    SurfaceImport,
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::prior::PriorBounds;
use crate::qoi::Quantity;
pub use between_tests::{BetweenTestsCase, TrendCase, TrendVariable};
pub use block::NotchCase;
pub(crate) use calibration::QoiComparison;
pub use calibration::{
    CalibrationCase, ConfirmCase, DesignCase, DesignSample, DiscrepancyCase, ExtendCase,
    Likelihood, Microstructure, QoiCase, SequentialCase, SurrogateCase,
};
pub(crate) use changed::changed_keys;
pub use conditions::{
    ConditionsCase, ExtensometerCase, LineCase, MeasureCase, PrescribeCase, PressureCase,
    PressureKind, Similarity, TimeTable, TractionCase,
};
pub use experiments::{ExperimentsCase, NoiseCase, Toe, VirtualCase};
pub use fidelity::{FidelityCase, LevelCase};
pub use free_parameters::FreeParameterCase;
pub(crate) use further::PRESENT;
pub use further::{CandidateCase, FurtherTestsCase};
pub use geometry::SpecimenGeometry;
pub use image::ImageCase;
pub use interface::InterfaceCase;
pub use machine::MachineCase;
pub use material::MaterialCase;
pub(crate) use mistakes::Mistakes;
pub(crate) use overlay::{merge, remove};
pub use parameter::{BoundsCase, ByParameter, PriorCase};
#[cfg(test)]
pub(crate) use paths::FILES;
pub(crate) use paths::{
    PROGRAM, make_absolute, named_paths, validations_with_absolute_paths, visit_paths,
    with_absolute_paths,
};
pub use plastic::{HardeningCase, HardeningTable, PlasticCase, YieldRow};
pub use program::ProgramPointCase;
pub use read::CaseFile;
pub(crate) use schema::{changed_case, schema_of};
pub(crate) use several_tests::single_tests;
pub use several_tests::{SingleTest, TestEntry};
pub use simulation::{AdaptiveCase, ArcLengthCase, OutputCase, TestCase};
pub use simulator::SimulatorCase;
pub use target::{Parameter, SimulationParts, Target, TargetError};
pub(crate) use target::{Property, TargetRegistry};
pub(crate) use template::{Template, Value};
use test_kind::TestSetting;
pub use test_kind::{BrazilianDisc, ConfinedCompression, NotchedBeam, TestKindCase};
pub(crate) use trend_values::TrendValues;
pub use validation::ValidationCase;
pub(crate) use validation::{has_surrogate_for, validation_case};

/// A case: the simulations, the calibrated parameters, and the experiments.
///
/// # Example
/// ```
/// use models::CaseFile;
/// let case = CaseFile::default_case().case;
/// assert_eq!(case.material["matrix"].young_mpa, Some(275.0));
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Case {
    /// Geometry and mesh; absent if the runs come from outside this program.
    #[serde(default, skip_serializing_if = "SpecimenCase::is_absent")]
    pub specimen: SpecimenCase,
    /// Parameters of each region of the mesh.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub material: BTreeMap<String, MaterialCase>,
    /// Interfaces between regions, each with a separate toughness. The key of an interface consists of the
    /// names of its regions, as in `matrix-grain`.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub interface: BTreeMap<String, InterfaceCase>,
    /// Damage model; without it, every region is elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub phase_field: Option<PhaseField>,
    /// The test: its time and steps, and the platens. With `tests`, the keys that the tests share.
    #[serde(default, skip_serializing_if = "TestCase::is_absent")]
    pub test: TestCase,
    /// The testing machine.
    #[serde(default, skip_serializing_if = "MachineCase::is_empty")]
    pub machine: MachineCase,
    /// Several tests of the same material, which replace a single test.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub tests: Vec<TestEntry>,
    /// Boundary conditions that replace the platens. The conditions of `test.kind` are not part of the case file.
    #[serde(default, skip_serializing_if = "is_unwritten")]
    pub conditions: Option<ConditionsCase>,
    /// Options of the solver.
    #[serde(default)]
    pub solver: SolverOptions,
    /// Files that a single simulation writes.
    #[serde(default)]
    pub output: OutputCase,
    /// A program of the user that computes the runs instead of the built-in test.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub simulator: Option<SimulatorCase>,
    /// Calibrated parameters with names of the user's choice, for runs that come from outside this program.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub parameters: BTreeMap<String, FreeParameterCase>,
    /// Definitions of the quantities of interest of a curve.
    #[serde(default)]
    pub qoi: QoiCase,
    /// Calibrated parameters with their priors; not needed for a single simulation. Parameters that are declared in
    /// `[parameters]` are included.
    #[serde(
        default,
        skip_serializing_if = "free_parameters::is_unwritten",
        serialize_with = "free_parameters::write_prior"
    )]
    pub prior: Option<PriorCase>,
    /// Extensions of the prior. Each extension adds runs to the runs of `[design]`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub extend: Vec<ExtendCase>,
    /// The runs to which the surrogate is fitted.
    #[serde(default)]
    pub design: DesignCase,
    /// Additional runs in the region of high posterior density.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub sequential: Option<SequentialCase>,
    /// Cheaper meshes for the runs of the design.
    #[serde(default)]
    pub fidelity: FidelityCase,
    /// Settings of the surrogate: its order and terms.
    #[serde(default)]
    pub surrogate: SurrogateCase,
    /// Measured curves to calibrate against; not needed for a single simulation.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub experiments: Option<ExperimentsCase>,
    /// Settings of the likelihood and the sampler.
    #[serde(default)]
    pub calibration: CalibrationCase,
    /// The simulations that confirm the calibration.
    #[serde(default)]
    pub confirm: ConfirmCase,
    /// Comparisons of the posterior with specimens that the calibration does not use.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub validation: Vec<ValidationCase>,
    /// Candidates for the next tests.
    #[serde(default)]
    pub further_tests: FurtherTestsCase,
}

/// `[specimen]`: a cylinder with a packing, a block, an image of a specimen, surfaces of its grains, or a mesh file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SpecimenCase {
    /// Radius of the cylinder in mm. Default: the radius of the specimen in the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub radius_mm: Option<f64>,
    /// Height of the cylinder in mm. Default: the height of the specimen in the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-3, max = 1e3))]
    pub height_mm: Option<f64>,
    /// Edge in mm of the hexahedra that are split into tetrahedra.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1e-6, max = 1e3))]
    pub spacing_mm: Option<f64>,
    /// Length along x, width along y and depth along z in mm of a block, which replaces the cylinder.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1e-3, max = 1e4)))]
    pub block_mm: Option<[f64; 3]>,
    /// Notch of the block.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub notch: Option<NotchCase>,
    /// Element order, 1 or 2. The default is quadratic: linear elements are far too stiff on equal meshes, and less
    /// accurate at equal cost.
    #[serde(default = "order")]
    pub order: Order,
    /// Representation of grains in the mesh.
    #[serde(default)]
    pub grain_mode: GrainMode,
    /// Homogenisation rule for the moduli of tetrahedra that are partly grain.
    #[serde(default)]
    pub homogenisation: Homogenisation,
    /// With the grain mode `auto`, the mesh follows the surface of grains with more than this number of elements across
    /// their diameter.
    #[serde(default = "elements_across")]
    #[schemars(range(min = 0, max = 100))]
    pub elements_across: f64,
    /// Smallest dihedral angle in degrees that is allowed when the mesh is fitted to the surfaces of grains.
    #[serde(default = "min_dihedral")]
    #[schemars(range(min = 1, max = 25))]
    pub min_dihedral_deg: f64,
    /// A packing of grains; without it, the cylinder consists of matrix only.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub grains: Option<Packing>,
    /// A virtual scan of the packing; the mesh is then made from the image of this scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub scan: Option<Scanner>,
    /// An image of the specimen, or the segmentation settings for the virtual scan.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub image: Option<ImageCase>,
    /// Surfaces of grains in STL files, which replace a packing or an image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub stl: Option<SurfaceImport>,
    /// A Gmsh file that replaces lattice, packing and image.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mesh: Option<PathBuf>,
    /// Physical volume or volumes, by number or name, of each region in the mesh file.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub regions: BTreeMap<String, PhysicalGroups>,
    /// Physical surfaces of the mesh file: `bottom` and `top` for the platens, and any further
    /// surfaces.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub surfaces: BTreeMap<String, PhysicalGroups>,
}

impl SpecimenCase {
    /// Whether no key of the table is given.
    pub(crate) fn is_absent(&self) -> bool {
        *self == Self::default()
    }
}

impl Default for SpecimenCase {
    /// A table without keys.
    fn default() -> Self {
        Self {
            radius_mm: None,
            height_mm: None,
            spacing_mm: None,
            block_mm: None,
            notch: None,
            order: order(),
            grain_mode: GrainMode::default(),
            homogenisation: Homogenisation::default(),
            elements_across: elements_across(),
            min_dihedral_deg: min_dihedral(),
            grains: None,
            scan: None,
            image: None,
            stl: None,
            mesh: None,
            regions: BTreeMap::new(),
            surfaces: BTreeMap::new(),
        }
    }
}

impl Case {
    /// Whether the runs are tests that this program simulates: neither `[simulator]` nor `design.import` is given.
    pub(crate) fn is_built_in(&self) -> bool {
        self.simulator.is_none() && self.design.import.is_none()
    }

    /// Whether a surface has a pressure that follows the deformation.
    pub(crate) fn has_follower_pressure(&self) -> bool {
        let pressures = self.conditions.iter().flat_map(|conditions| &conditions.pressure);
        pressures.into_iter().any(|pressure| pressure.kind == PressureKind::Follower)
    }

    /// Adds the parameters of `[parameters]` to the calibrated parameters.
    fn add_free_parameters(&mut self) {
        if self.parameters.is_empty() {
            return;
        }
        let prior = self.prior.get_or_insert_default();
        for (name, declared) in &self.parameters {
            prior.insert(declared.parameter(name), declared.prior);
        }
    }

    /// Calibrated parameter with this path.
    pub(crate) fn parameter(&self, path: &str) -> Option<&Parameter> {
        let mut all = self.prior.iter().flat_map(|prior| prior.parameters());
        all.find(|parameter| parameter.to_string() == path)
    }

    /// Quantities that are compared between specimens and simulations.
    pub(crate) fn compared_quantities(&self) -> Vec<Quantity> {
        match self.calibration.likelihood {
            Likelihood::Quantities => self.qoi.quantities.clone(),
            Likelihood::Curve => Quantity::of_curve(&self.qoi.curve_percent),
        }
    }

    /// Definition of the compared quantities.
    pub(crate) fn qoi_comparison(&self) -> QoiComparison {
        let quantities = self.compared_quantities();
        QoiComparison { slope_fraction: self.qoi.slope_fraction, quantities }
    }

    /// Inserts the default values that depend on other keys.
    fn complete(&mut self) {
        self.add_free_parameters();
        self.test.complete();
        // conditions that the user wrote beside a kind are kept; the validation refuses them
        if let (Some(kind), None) = (self.test.kind, &self.conditions) {
            self.conditions = Some(kind.kind().conditions(&self.test_setting()));
        }
        if let Some(v) = self.experiments.as_mut().and_then(|e| e.virtual_specimens.as_mut()) {
            v.complete();
        }
    }

    /// Returns the keys on which the conditions of `test.kind` depend.
    fn test_setting(&self) -> TestSetting {
        TestSetting {
            displacement_mm: self.test.displacement_mm.unwrap_or(f64::NAN),
            duration_s: self.test.duration_s(),
            block_mm: self.specimen.block_mm,
            notch: self.specimen.notch,
        }
    }

    /// Returns the parts of the case that calibrated parameters can change.
    pub(crate) fn simulation_parts(&self) -> SimulationParts {
        let Self { material, interface, phase_field, test, machine, .. } = self.clone();
        SimulationParts { material, interface, phase_field, test, machine }
    }

    /// Returns the prior with the ranges of all extensions. These ranges are the bounds of the surrogate's inputs.
    pub fn whole_prior(&self) -> Option<PriorCase> {
        let prior = self.prior.as_ref()?;
        let mut bounds = prior.bounds();
        for (parameter, &PriorBounds([lower, upper])) in
            self.extend.iter().flat_map(|e| e.prior.iter())
        {
            let before = bounds.get(parameter).map_or([lower, upper], |bounds| bounds.0);
            let whole = PriorBounds([before[0].min(lower), before[1].max(upper)]);
            bounds.insert(parameter.clone(), whole);
        }
        Some(prior.within(&bounds))
    }

    /// The default case that is supplied with the program, with every key explained.
    pub const TEMPLATE: &str = include_str!("../../cases/default.toml");
}

fn is_unwritten(conditions: &Option<ConditionsCase>) -> bool {
    !conditions.as_ref().is_some_and(ConditionsCase::is_written)
}

fn order() -> Order {
    Order::Quadratic
}

fn elements_across() -> f64 {
    Meshing::new(1.0).elements_across
}

fn min_dihedral() -> f64 {
    Meshing::new(1.0).min_dihedral_deg
}
