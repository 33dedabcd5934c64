//! Why a curve has no quantities of interest.

use super::quantity::Quantity;

/// Why a curve has no quantities of interest.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QoiError {
    /// Too short, or not one force for each displacement.
    #[error("the curve has {points} points: at least 5 are needed")]
    TooShort {
        /// Points of the curve.
        points: usize,
    },
    /// The highest point is the first or the last.
    #[error(
        "no peak: the force is highest at the {end} of the curve ({displacement_mm} mm); \
         a test must go on until the force falls"
    )]
    NoPeak {
        /// `start` or `end`.
        end: &'static str,
        /// Displacement of the highest point in mm.
        displacement_mm: f64,
    },
    /// The points around the highest one do not form a maximum.
    #[error(
        "the peak near {displacement_mm} mm is not resolved: its points form no downward parabola"
    )]
    Unresolved {
        /// Displacement of the highest point in mm.
        displacement_mm: f64,
    },
    /// Too few readings to take a slope from.
    #[error(
        "{readings} readings between {from_mm:.4} and {to_mm:.4} mm, where the slope is taken: it needs one \
         at least, and readings from the first half on; record more or choose another slope fraction"
    )]
    NoSlope {
        /// Readings in the window.
        readings: usize,
        /// Start of the window in mm.
        from_mm: f64,
        /// End of the window in mm.
        to_mm: f64,
    },
    /// The curve does not reach where a quantity is taken.
    #[error(
        "the curve goes from {from_mm:.4} to {to_mm:.4} mm and does not reach {place_mm:.4} mm{}; go farther \
         (test.stop_below_peak, test.displacement_mm), or change {}",
        of_the_peak(*.quantity),
        key(*.quantity)
    )]
    NotReached {
        /// What is taken there.
        quantity: Quantity,
        /// Where that is, in mm.
        place_mm: f64,
        /// First displacement in mm.
        from_mm: f64,
        /// Last displacement in mm.
        to_mm: f64,
    },
}

fn of_the_peak(quantity: Quantity) -> String {
    let part = match quantity {
        Quantity::RelativeForce(percent) => Some(percent.into()),
        other => other.reach().map(|reach| 100.0 * reach),
    };
    let words = |part: f64| format!(", {part:.0} % of its displacement at peak, for {quantity}");
    part.map_or_else(|| format!(" for {quantity}"), words)
}

fn key(quantity: Quantity) -> &'static str {
    match quantity {
        Quantity::RelativeForce(_) => "qoi.quantities or qoi.curve_percent",
        _ => "qoi.quantities",
    }
}
