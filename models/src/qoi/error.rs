//! Why a curve has no quantities of interest.

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
    /// The curve does not reach where its shape is taken.
    #[error(
        "the curve goes from {from_mm:.4} to {to_mm:.4} mm and does not reach {percent} % of its \
         displacement at peak, {place_mm:.4} mm; take smaller percentages (qoi.curve_percent), or go \
         farther (test.stop_below_peak)"
    )]
    NotReached {
        /// Of the displacement at peak.
        percent: u8,
        /// Where that is, in mm.
        place_mm: f64,
        /// First displacement in mm.
        from_mm: f64,
        /// Last displacement in mm.
        to_mm: f64,
    },
}
