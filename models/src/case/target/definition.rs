//! The interface of a calibrated parameter.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Debug;

use fem::PhaseField;

use super::super::{InterfaceCase, MachineCase, MaterialCase, TestCase};

/// Parts of a case that a calibrated parameter can change.
#[derive(Clone, Debug, PartialEq)]
pub struct SimulationParts {
    /// `[material]`, by region.
    pub material: BTreeMap<String, MaterialCase>,
    /// `[interface]`, by the names of its regions.
    pub interface: BTreeMap<String, InterfaceCase>,
    /// `[phase_field]`.
    pub phase_field: Option<PhaseField>,
    /// `[test]`.
    pub test: TestCase,
    /// `[machine]`: the machine that records the curve of a run. The simulation itself does not
    /// depend on the machine.
    pub machine: MachineCase,
}

/// Error if the case does not have the parameter: the reason, and the remedy.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{problem}")]
pub struct TargetError {
    /// The reason, such as `the case has no table [phase_field]`.
    pub problem: String,
    /// The remedy, such as `Add [phase_field], or leave the parameter out.`
    pub help: String,
}

/// A number that `[prior]` can name, so that it is calibrated.
///
/// # Example
/// A factor that multiplies Young's modulus of all regions, such as the factor of a load cell with
/// a wrong scale:
/// ```
/// use std::borrow::Cow;
/// use models::{SimulationParts, Target, TargetError};
///
/// #[derive(Debug)]
/// struct StiffnessFactor;
///
/// impl Target for StiffnessFactor {
///     fn path(&self) -> Cow<'_, str> { "sample.stiffness_factor".into() }
///     fn label(&self) -> Cow<'_, str> { "stiffness factor".into() }
///     fn unit(&self) -> Cow<'_, str> { "1".into() }
///     fn range(&self) -> [f64; 2] { [0.0, f64::INFINITY] }
///     fn set(&self, parts: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
///         let moduli = parts.material.values_mut().filter_map(|m| m.young_mpa.as_mut());
///         moduli.for_each(|young_mpa| *young_mpa *= value);
///         Ok(())
///     }
/// }
/// ```
pub trait Target: Debug + Send + Sync + 'static {
    /// Path in `[prior]`: a table and a key in lower case, as in `matrix.young_mpa`.
    fn path(&self) -> Cow<'_, str>;

    /// Symbol or name in figures and tables, without unit.
    fn label(&self) -> Cow<'_, str>;

    /// Unit, as in `N/mm`; `1` if the parameter is dimensionless.
    fn unit(&self) -> Cow<'_, str>;

    /// Sets the parameter in `parts` to `value`. The calibrated parameters that precede this parameter in the order of
    /// their paths are already set in `parts`; all other values of `parts` are values of the case.
    ///
    /// # Errors
    /// If the case has no such parameter.
    fn set(&self, simulation: &mut SimulationParts, value: f64) -> Result<(), TargetError>;

    /// Open interval of the allowed values. The checks of a case apply in addition.
    fn range(&self) -> [f64; 2] {
        [f64::NEG_INFINITY, f64::INFINITY]
    }

    /// Region of the mesh to which the parameter belongs, if there is one.
    fn region(&self) -> Option<&str> {
        None
    }

    /// Default standard deviation of the logarithm of the parameter between virtual specimens. The case can override
    /// it.
    fn usual_scatter(&self) -> f64 {
        0.0
    }
}
