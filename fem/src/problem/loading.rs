//! How the specimen is loaded, and when the test ends.

use crate::error::FemError;

/// Load steps.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Stepping {
    /// So many equal steps; one that finds no equilibrium is done in parts, and the curve keeps the
    /// points asked for.
    Fixed(u32),
    /// Steps that grow while they converge and are cut where they do not, as shares of the whole
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
        /// Largest step of the platen, as a share of the full displacement.
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
    /// Stop once the force of the curve is this share below its peak: 0.1 for 10 %.
    pub stop_below_peak: Option<f64>,
}

/// The motion of the upper platen: constant speed up to `displacement_mm` at `duration_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Loading {
    /// Full displacement, mm, downwards.
    pub displacement_mm: f64,
    /// Its time, s.
    pub duration_s: f64,
    /// Load steps.
    pub stepping: Stepping,
    /// Stop once the force is this share below its peak: 0.1 for 10 %.
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

impl Loading {
    pub(crate) fn validate(&self, height_mm: f64) -> Result<(), FemError> {
        check(
            self.displacement_mm > 0.0 && self.displacement_mm < height_mm,
            "displacement_mm",
            self.displacement_mm,
            "positive (downwards) and less than the specimen's height",
        )
    }

    pub(crate) fn schedule(&self) -> Schedule {
        Schedule {
            duration_s: self.duration_s,
            stepping: self.stepping,
            stop_below_peak: self.stop_below_peak,
        }
    }
}

impl Schedule {
    pub(crate) fn validate(&self) -> Result<(), FemError> {
        check(
            self.duration_s > 0.0 && self.duration_s.is_finite(),
            "duration_s",
            self.duration_s,
            "a positive time in s",
        )?;
        if let Some(share) = self.stop_below_peak {
            check(
                share > 0.0 && share < 1.0,
                "stop_below_peak",
                share,
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
                    "a share of the displacement, in (0, 1]",
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
                    "a share of the displacement, in (0, 1]",
                )?;
                check(
                    largest >= first && largest <= 1.0,
                    "largest",
                    largest,
                    "a share of the displacement, not below the first step",
                )
            }
        }
    }
}
