//! Extensions that a program of the user can add to `breccia`.

use breccia_calibration::{Qoi, QoiRegistry};

use crate::case::{Target, TargetRegistry};

/// Registry of the quantities of interest and the parameters that a case can name. A program of the user can
/// add entries.
///
/// # Example
/// A program that is `breccia` with one more quantity of interest:
/// ```no_run
/// use std::borrow::Cow;
/// use std::process::ExitCode;
/// use models::{PeakedCurve, Qoi, QoiError, Registry, Unit};
///
/// /// Peak force divided by the displacement at peak.
/// #[derive(Debug)]
/// struct SecantStiffness;
///
/// impl Qoi for SecantStiffness {
///     fn name(&self) -> Cow<'static, str> { "secant-stiffness".into() }
///     fn column(&self) -> Cow<'static, str> { "secant_stiffness_N_per_mm".into() }
///     fn description(&self) -> Cow<'static, str> { "secant stiffness".into() }
///     fn unit(&self) -> Unit { Unit::N_PER_MM }
///     fn value(&self, curve: &PeakedCurve<'_>) -> Result<f64, QoiError> {
///         Ok(curve.peak_force_n() / curve.peak_mm())
///     }
/// }
///
/// fn main() -> ExitCode {
///     models::program(Registry::standard().with_qoi(SecantStiffness))
/// }
/// ```
#[derive(Debug)]
pub struct Registry {
    qois: QoiRegistry,
    targets: TargetRegistry,
}

impl Registry {
    /// Registry of the built-in quantities of interest and parameters.
    pub fn standard() -> Self {
        Self { qois: QoiRegistry::standard(), targets: TargetRegistry::standard() }
    }

    /// Adds a quantity of interest. If an earlier quantity has the same name, the earlier quantity is used.
    pub fn with_qoi(self, qoi: impl Qoi) -> Self {
        Self { qois: self.qois.with_qoi(qoi), ..self }
    }

    /// Adds a parameter that `[prior]` can name. If an earlier target has the same path, the earlier target is used.
    pub fn with_target(self, target: impl Target) -> Self {
        Self { targets: self.targets.with_target(target), ..self }
    }

    /// Makes this registry the registry of the process; must be called before the first case is read. Returns
    /// `false` if the process already has a registry. [`program`](crate::program) calls this method.
    pub fn install(self) -> bool {
        self.qois.install() && self.targets.install()
    }
}
