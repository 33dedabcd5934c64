//! Error of the computation of quantities of interest.

use super::extent::Extent;

/// Reason why quantities of interest of a curve cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QoiError {
    /// The numbers of values of a curve differ.
    #[error(
        "the curve has {displacements} displacements and {values} {name}: give one displacement and one value for every reading"
    )]
    UnequalLengths {
        /// Number of displacements.
        displacements: usize,
        /// The other values: `forces` or `derivatives of the force`.
        name: &'static str,
        /// Number of the other values.
        values: usize,
    },
    /// The curve has fewer than 5 points.
    #[error("the curve has {points} points: at least 5 are needed")]
    TooShort {
        /// Number of points of the curve.
        points: usize,
    },
    /// The highest point is the first or the last point of the curve.
    #[error(
        "no peak: the force is highest at the {end} of the curve ({displacement_mm} mm); \
         a test must continue until the force falls"
    )]
    NoPeak {
        /// `start` or `end`.
        end: &'static str,
        /// Displacement of the highest point in mm.
        displacement_mm: f64,
    },
    /// The points around the highest point do not form a maximum.
    #[error(
        "the peak near {displacement_mm} mm is not resolved: the readings around the peak do not form a parabola that opens downwards"
    )]
    Unresolved {
        /// Displacement of the highest point in mm.
        displacement_mm: f64,
    },
    /// The readings do not cover the window in which the slope is taken.
    #[error(
        "the window of the slope, from {from_mm:.4} to {to_mm:.4} mm, has {readings} readings: at least one reading is \
         needed, and the first one in the first half of the window; record more often, or change the slope fraction"
    )]
    NoSlope {
        /// Number of readings in the window.
        readings: usize,
        /// Start of the window in mm.
        from_mm: f64,
        /// End of the window in mm.
        to_mm: f64,
    },
    /// The curve does not include the displacement at which a quantity is taken.
    #[error(
        "the curve covers {from_mm:.4} to {to_mm:.4} mm and does not reach {needed_mm:.4} mm{} for {quantity}; \
         continue the test to a larger displacement (test.stop_below_peak, test.displacement_mm), or change qoi.quantities (with likelihood = \
         \"curve\": qoi.curve_percent)",
        of_the_peak(*.extent)
    )]
    NotReached {
        /// Name of the quantity.
        quantity: String,
        /// Part of the curve that the quantity is computed from.
        extent: Extent,
        /// Displacement at which the curve has no readings, in mm.
        needed_mm: f64,
        /// Smallest displacement of the curve in mm.
        from_mm: f64,
        /// Largest displacement of the curve in mm.
        to_mm: f64,
    },
    /// The curve has no times.
    #[error(
        "{quantity} needs the time of each reading: add a column time_s to the curve, or change qoi.quantities"
    )]
    NoTime {
        /// Name of the quantity.
        quantity: String,
    },
    /// The curve does not include the time at which a quantity is taken.
    #[error(
        "the curve covers {from_s} to {to_s} s and does not include {needed_s} s for {quantity}; record \
         longer (test.program, test.duration_s, test.stop_below_peak), or change qoi.quantities"
    )]
    TimeNotReached {
        /// Name of the quantity.
        quantity: String,
        /// Time at which the curve has no readings, in s.
        needed_s: f64,
        /// First time of the curve in s.
        from_s: f64,
        /// Last time of the curve in s.
        to_s: f64,
    },
    /// The curve has no branch of the kind that a quantity is computed from.
    #[error(
        "the curve has no {branch}, which {quantity} needs: add the {branch} to test.program and continue the test until \
         the {branch} has ended (test.stop_below_peak), or change qoi.quantities"
    )]
    NoBranch {
        /// Name of the quantity.
        quantity: String,
        /// `hold` or `unloading`.
        branch: &'static str,
    },
    /// A user-defined quantity cannot be computed; its code returned the reason.
    #[error("{quantity}: {reason}")]
    Undefined {
        /// Name of the quantity.
        quantity: String,
        reason: String,
    },
}

fn of_the_peak(extent: Extent) -> String {
    match extent {
        Extent::Fraction(fraction) => {
            format!(", {:.0} % of its displacement at peak,", 100.0 * fraction)
        }
        _ => String::new(),
    }
}
