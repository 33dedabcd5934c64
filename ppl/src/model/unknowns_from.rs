//! Source of the values of unknowns in a trace: the prior, a point, or named values.

use crate::number::real::Real;
use crate::quantity::value_reader::ValueReader;

/// Source of the values of unknowns in a trace.
pub(crate) enum UnknownsFrom<'y> {
    /// Draws from the prior.
    Prior,
    /// Unconstrained coordinates.
    Point(CoordinateReader<'y>),
    /// Unconstrained coordinates, except for the quantities with a named value.
    Values(CoordinateReader<'y>, ValueReader<'y>),
}

/// Reader of coordinates in order.
pub(crate) struct CoordinateReader<'y> {
    coordinates: std::slice::Iter<'y, f64>,
    /// Whether the model has requested more coordinates than the point contains.
    pub(crate) short: bool,
}

impl<'y> CoordinateReader<'y> {
    pub(crate) fn new(y: &'y [f64]) -> Self {
        Self { coordinates: y.iter(), short: false }
    }

    /// Returns the next coordinate; NaN after the last coordinate.
    pub(crate) fn next(&mut self) -> Real<f64> {
        Real(self.coordinates.next().copied().unwrap_or_else(|| {
            self.short = true;
            f64::NAN
        }))
    }
}
