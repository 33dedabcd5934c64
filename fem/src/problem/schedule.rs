//! The time that a problem covers, and the steps through it.

use crate::boundary::Conditions;
use crate::error::FemError;
use crate::material::{Material, PhaseField};

/// Load steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepping {
    /// So many equal steps; one that finds no equilibrium is done in parts, and the curve keeps the
    /// points asked for.
    Fixed(u32),
    /// Steps that grow while they converge and are cut where they do not, as fractions of the whole
    /// duration.
    Adaptive {
        /// First step.
        first: f64,
        /// Largest step: it bounds the error in time.
        largest: f64,
    },
    /// Follows the equilibrium through a snap-back of rate-independent damage: where a step of the
    /// platen would release too much, the platen moves, back if need be, by what releases so much.
    ///
    /// The time follows the displacement and turns back with it. It needs a phase field that makes
    /// an energy stationary, no viscosity, and `stop_below_peak`, since the platen may never reach
    /// the full displacement.
    ArcLength {
        /// Largest step of the platen, as a fraction of the full displacement.
        step: f64,
        /// Crack energy that a step may add, N mm.
        release_n_mm: f64,
    },
}

/// The time that a problem covers and the steps through it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Schedule {
    /// Time at the end, s.
    pub duration_s: f64,
    /// Load steps.
    pub stepping: Stepping,
    /// Stop once the force of the curve is this fraction below its peak: 0.1 for 10 %.
    pub stop_below_peak: Option<f64>,
}

impl Stepping {
    /// Adaptive steps between a hundredth and a fortieth of the displacement.
    pub fn adaptive() -> Self {
        Stepping::Adaptive { first: 0.01, largest: 0.025 }
    }
}

fn check(
    holds: bool,
    field: &'static str,
    value: f64,
    requirement: &'static str,
) -> Result<(), FemError> {
    if holds { Ok(()) } else { Err(FemError::parameter("test", field, value, requirement)) }
}

impl Schedule {
    /// So many equal steps over a duration.
    pub fn fixed(duration_s: f64, steps: u32) -> Self {
        Self { duration_s, stepping: Stepping::Fixed(steps), stop_below_peak: None }
    }

    /// [`Stepping::adaptive`] over a duration.
    pub fn adaptive(duration_s: f64) -> Self {
        Self { duration_s, stepping: Stepping::adaptive(), stop_below_peak: None }
    }

    /// Stops once the force of the curve is this fraction below its peak.
    pub fn stop_below_peak(self, fraction: f64) -> Self {
        Self { stop_below_peak: Some(fraction), ..self }
    }

    /// Refuses times and steps that no run can take.
    ///
    /// # Errors
    /// [`FemError::Parameter`].
    pub fn validate(&self) -> Result<(), FemError> {
        check(
            self.duration_s > 0.0 && self.duration_s.is_finite(),
            "duration_s",
            self.duration_s,
            "a positive time in s",
        )?;
        if let Some(fraction) = self.stop_below_peak {
            check(
                fraction > 0.0 && fraction < 1.0,
                "stop_below_peak",
                fraction,
                "between 0 and 1, as 0.1 for 10 %",
            )?;
        }
        match self.stepping {
            Stepping::Fixed(steps) => check(
                steps > 0,
                "steps",
                f64::from(steps),
                "at least 1; leave it out for adaptive steps",
            ),
            Stepping::ArcLength { step, release_n_mm } => {
                check(
                    step > 0.0 && step <= 1.0,
                    "step",
                    step,
                    "a fraction of the displacement, in (0, 1]",
                )?;
                check(
                    release_n_mm > 0.0 && release_n_mm.is_finite(),
                    "release_n_mm",
                    release_n_mm,
                    "a positive energy in N mm, such as a fiftieth of the toughness times the cross-section",
                )?;
                check(
                    self.stop_below_peak.is_some(),
                    "stop_below_peak",
                    0.0,
                    "given with arc-length steps, which may never reach the full displacement",
                )
            }
            Stepping::Adaptive { first, largest } => {
                check(
                    first > 0.0 && first <= 1.0,
                    "first",
                    first,
                    "a fraction of the displacement, in (0, 1]",
                )?;
                check(
                    largest >= first && largest <= 1.0,
                    "largest",
                    largest,
                    "a fraction of the displacement, not below the first step",
                )
            }
        }
    }
}

/// Refuses what arc-length steps cannot follow.
pub(crate) fn check_arc_length(
    stepping: Stepping,
    materials: &[Material],
    field: Option<&PhaseField>,
    conditions: &Conditions,
) -> Result<(), FemError> {
    if !matches!(stepping, Stepping::ArcLength { .. }) {
        return Ok(());
    }
    let refuse = |message: &str, help: &str| {
        Err(FemError::unsupported("test", format!("arc-length steps {message}"), help))
    };
    let damaged = || materials.iter().filter_map(|m| m.fracture);
    if !conditions.only_prescribe() {
        return refuse(
            "move prescribed displacements back and forth, which loads and platens do not follow",
            "prescribe the displacement of the ends, or take adaptive steps",
        );
    }
    if field.is_none() || damaged().next().is_none() {
        return refuse("control the crack energy, and nothing can break", "take adaptive steps");
    }
    if field.is_some_and(|f| !f.is_variational()) {
        return refuse(
            "need damage that makes an energy stationary",
            "take irreversibility = \"active-set\" or \"none\", and no hybrid split",
        );
    }
    if damaged().any(|m| m.viscosity_mpa_s > 0.0) {
        return refuse(
            "are for rate-independent damage",
            "set viscosity_mpa_s = 0, or take adaptive steps: viscous damage does not snap back",
        );
    }
    Ok(())
}
