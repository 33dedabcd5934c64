//! The tension test of a round bar as a boundary-value problem.

use super::control::{AdaptiveSteps, Schedule};
use super::curve::{CurvePoint, End, Outcome};
use super::problem::{Problem, ProblemBuilder};
use crate::boundary::{Axis, Conditions};
use crate::error::FemError;
use fem_mesh::{RoundBar, TetMesh};

/// Distance of the extensometer's points from the axis, relative to the radius. A point on the wall itself could lie
/// outside the mesh because of a rounding error.
const ON_WALL: f64 = 0.99;

/// Tension of a round bar with an extensometer in the middle. Creates a [`Problem`] on an eighth of the bar
/// ([`RoundBar::eighth`]).
///
/// Three planes of symmetry hold the eighth; the end of the gauge section moves along the axis at constant speed and can
/// contract. The curve has the force on the eighth and the elongation of half the extensometer;
/// [`engineering`](Self::engineering) converts them.
///
/// # Example
/// An elastic bar has Young's modulus as its slope:
/// ```
/// use fem::{Material, Order, RoundBar, TensionTest};
///
/// let bar = RoundBar {
///     radius_mm: 3.0,
///     taper_mm: 0.0,
///     length_mm: 30.0,
///     necking_mm: 6.0,
///     spacing_mm: 1.5,
/// };
/// let test = TensionTest::new(bar, 20.0, 1e-3, 1e-2);
/// let problem = test
///     .builder(bar.eighth()?)?
///     .order(Order::Quadratic)
///     .materials([Material::hencky(200_000.0, 0.3)])
///     .build()?;
/// let outcome = test.pull(&problem, 5e-6, 0.0);
/// let (strain, stress_mpa) = test.engineering(&outcome.curve[0]);
/// assert!((stress_mpa / strain / 200_000.0 - 1.0).abs() < 5e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TensionTest {
    /// The bar.
    pub bar: RoundBar,
    /// Gauge length of the extensometer, mm; its middle is the middle of the bar.
    pub extensometer_mm: f64,
    /// Engineering strain rate of the gauge section, 1/s: its elongation per time and length.
    pub rate_per_s: f64,
    /// Engineering strain of the gauge section at the end of the test.
    pub strain: f64,
    /// The load steps, as fractions of the duration.
    pub steps: AdaptiveSteps,
}

impl TensionTest {
    /// Creates a test with steps that begin at 0.1 % and grow to 2 % of the duration.
    pub fn new(bar: RoundBar, extensometer_mm: f64, rate_per_s: f64, strain: f64) -> Self {
        let steps = AdaptiveSteps { first: 1e-3, largest: 2e-2 };
        Self { bar, extensometer_mm, rate_per_s, strain, steps }
    }

    /// Creates the builder of the problem on the mesh of the eighth of the bar. The caller must then set the materials,
    /// and quadratic elements for materials that flow at constant volume.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] for an extensometer that is longer than the gauge section, and for a strain or rate that is
    /// not positive.
    pub fn builder(&self, mesh: TetMesh) -> Result<ProblemBuilder, FemError> {
        let &Self { bar, extensometer_mm, rate_per_s, strain, steps } = self;
        let check = |holds: bool, field: &'static str, value: f64, requirement: &'static str| {
            let error = || FemError::parameter("tension test", field, value, requirement);
            if holds { Ok(()) } else { Err(error()) }
        };
        let is_positive = |value: f64| value > 0.0 && value.is_finite();
        let is_inside = is_positive(extensometer_mm) && extensometer_mm <= bar.length_mm;
        let requirement = "positive and at most the length of the gauge section";
        check(is_inside, "extensometer_mm", extensometer_mm, requirement)?;
        check(is_positive(rate_per_s), "rate_per_s", rate_per_s, "positive (tension)")?;
        check(is_positive(strain), "strain", strain, "positive (tension)")?;
        let gauge = [0.0, 0.5 * extensometer_mm].map(|z| [ON_WALL * bar.radius_mm, 0.0, z]);
        let half_mm = 0.5 * bar.length_mm;
        let pulled = move |time_s: f64| half_mm * rate_per_s * time_s;
        let conditions = Conditions::new()
            .described_as(format!("{self:?}"))
            .symmetry("bottom")
            .symmetry("left")
            .symmetry("front")
            .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, pulled(time_s)])
            .measure_between("top", [0.0, 0.0, 1.0], gauge);
        let schedule = Schedule::new(strain / rate_per_s, steps);
        Ok(Problem::builder(mesh).conditions(conditions).schedule(schedule))
    }

    /// Returns engineering strain (of the extensometer) and engineering stress in MPa (force over the initial
    /// cross-section in the middle) of a point of the curve.
    pub fn engineering(&self, point: &CurvePoint) -> (f64, f64) {
        let area = std::f64::consts::PI * self.bar.radius_mm.powi(2);
        (point.displacement_mm / (0.5 * self.extensometer_mm), 4.0 * point.force_n / area)
    }

    /// Returns engineering strains and engineering stresses of a curve, as [`engineering`](Self::engineering), with the
    /// unloaded bar first.
    pub fn engineering_curve(&self, curve: &[CurvePoint]) -> Vec<(f64, f64)> {
        let readings = curve.iter().map(|point| self.engineering(point));
        std::iter::once((0.0, 0.0)).chain(readings).collect()
    }

    /// Runs the problem until the engineering strain of the extensometer is at least `strain`, and the force has fallen
    /// below its largest value by the fraction `below_peak` (0: the force has no influence). A run that meets both
    /// conditions ends with [`End::Displacement`]; other runs continue to their end.
    pub fn pull(&self, problem: &Problem, strain: f64, below_peak: f64) -> Outcome {
        let mut run = problem.start();
        let mut largest = 0.0_f64;
        while let Some(point) = run.step() {
            let (reached, stress) = self.engineering(&point);
            largest = largest.max(stress);
            if reached >= strain && stress <= (1.0 - below_peak) * largest {
                return Outcome { end: End::Displacement, ..run.finish() };
            }
        }
        run.finish()
    }
}
