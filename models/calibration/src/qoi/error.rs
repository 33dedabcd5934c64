//! Error of the computation of quantities of interest.

use super::quantity::Quantity;

/// Reason why quantities of interest of a curve cannot be computed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum QoiError {
    /// The curve has fewer than 5 points, or the numbers of forces and displacements differ.
    #[error("the curve has {points} points: at least 5 are needed")]
    TooShort {
        /// Number of points of the curve.
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
    /// The readings do not cover the window in which the slope is taken.
    #[error(
        "{readings} readings between {from_mm:.4} and {to_mm:.4} mm, where the slope is taken: it needs one \
         at least, and readings from the first half on; record more or choose another slope fraction"
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
        "the curve goes from {from_mm:.4} to {to_mm:.4} mm and does not reach {place_mm:.4} mm{}; go farther \
         (test.stop_below_peak, test.displacement_mm), or change {}",
        of_the_peak(*.quantity),
        key(*.quantity)
    )]
    NotReached {
        /// Name of the quantity.
        quantity: Quantity,
        /// Displacement at which the quantity is taken, in mm.
        place_mm: f64,
        /// Smallest displacement of the curve in mm.
        from_mm: f64,
        /// Largest displacement of the curve in mm.
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
