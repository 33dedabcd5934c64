//! Backends for the evaluation of a density. A backend supplies the coordinates of the unknowns and receives the
//! terms of the log density.
//!
//! There are four backends: plain values (primal), values with derivatives (forward mode), a tape that stores no
//! density terms (reverse mode), and a tape that stores every operation (full tape).

use std::cell::Cell;

use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::number::tape::{Tape, Var};
use crate::term::accumulator::{Joined, Settled, Statement};

/// Supplies the coordinates of the unknowns and receives the terms of the log density.
pub(crate) trait Backend {
    type Number: Scalar;

    /// Accumulator of the terms of a statement.
    type Accumulator: Statement<Real<Self::Number>>;

    /// Unconstrained coordinates of one unknown.
    type Coordinates;

    /// Removes and returns the next `n` coordinates of the point; `None` if fewer than `n` coordinates are left.
    fn take(&mut self, n: usize) -> Option<Self::Coordinates>;

    /// Returns coordinate `i` of the unknown with the given coordinates; NaN if `i` is out of range.
    fn coordinate(&self, coordinates: &Self::Coordinates, i: usize) -> Self::Number;

    /// Adds all terms of one statement to the log density.
    fn add(&mut self, terms: Self::Accumulator);

    /// Adds the terms of an accumulator of type `Settled` to the log density.
    fn add_all(&mut self, terms: Settled);

    /// Whether terms that have the same value at every point of the parameter space are omitted.
    #[inline(always)]
    fn drop_constants(&self) -> bool {
        false
    }

    /// Sum of the terms added so far.
    fn total(&self) -> f64;

    /// Returns the current position on the tape. `unwind` with this position removes all later operations from the
    /// tape.
    #[inline(always)]
    fn mark(&self) -> usize {
        0
    }

    #[inline(always)]
    fn unwind(&self, mark: usize) {
        let _ = mark;
    }
}

/// Backend for plain values.
pub(crate) struct Primal<'y> {
    coordinates: &'y [f64],
    drop_constants: bool,
    total: Settled,
}

impl<'y> Primal<'y> {
    /// Creates a backend at the point `y`. With `drop_constants`, terms that have the same value at every point are
    /// omitted.
    #[inline(always)]
    pub(crate) fn new(y: &'y [f64], drop_constants: bool) -> Self {
        Self { coordinates: y, drop_constants, total: Settled::new() }
    }
}

impl<'y> Backend for Primal<'y> {
    type Number = f64;
    type Accumulator = Settled;
    type Coordinates = &'y [f64];

    #[inline(always)]
    fn take(&mut self, n: usize) -> Option<&'y [f64]> {
        self.coordinates.split_off(..n)
    }

    #[inline(always)]
    fn coordinate(&self, coordinates: &&'y [f64], i: usize) -> f64 {
        coordinates.get(i).copied().unwrap_or(f64::NAN)
    }

    #[inline(always)]
    fn drop_constants(&self) -> bool {
        self.drop_constants
    }

    #[inline(always)]
    fn add(&mut self, terms: Settled) {
        self.total.add_all(terms);
    }

    #[inline(always)]
    fn add_all(&mut self, terms: Settled) {
        self.total.add_all(terms);
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total.total()
    }
}

/// Backend for scalars that contain their derivatives.
pub(crate) struct Forward<'y, R> {
    coordinates: &'y [R],
    pub(crate) total: R,
}

impl<'y, R: Scalar> Forward<'y, R> {
    pub(crate) fn new(y: &'y [R]) -> Self {
        Self { coordinates: y, total: R::from(0.0) }
    }
}

impl<'y, R: Scalar> Backend for Forward<'y, R> {
    type Number = R;
    type Accumulator = Joined<Real<R>>;
    type Coordinates = &'y [R];

    #[inline(always)]
    fn take(&mut self, n: usize) -> Option<&'y [R]> {
        self.coordinates.split_off(..n)
    }

    #[inline(always)]
    fn coordinate(&self, coordinates: &&'y [R], i: usize) -> R {
        coordinates.get(i).copied().unwrap_or_else(|| R::from(f64::NAN))
    }

    #[inline(always)]
    fn add(&mut self, terms: Joined<Real<R>>) {
        self.total += terms.number().0;
    }

    #[inline(always)]
    fn add_all(&mut self, terms: Settled) {
        self.total += terms.total();
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total.value()
    }
}

/// Backend with a tape that stores no density terms.
pub(crate) struct Reverse<'t, 'y> {
    coordinates: &'y [f64],
    adjoints: &'t [Cell<f64>],
    tape: &'t Tape,
    drop_constants: bool,
    total: Settled,
}

impl<'t, 'y> Reverse<'t, 'y> {
    /// Makes all coordinates the first nodes of the cleared tape; if the tape is too short, adds no nodes. With
    /// `drop_constants`, terms that have the same value at every point are omitted.
    #[inline(always)]
    pub(crate) fn new(tape: &'t Tape, y: &'y [f64], drop_constants: bool) -> Self {
        let adjoints = tape.inputs(y.len());
        Self { coordinates: y, adjoints, tape, drop_constants, total: Settled::new() }
    }
}

impl<'t, 'y> Backend for Reverse<'t, 'y> {
    type Number = Var<'t>;
    type Accumulator = Settled;
    type Coordinates = (&'y [f64], &'t [Cell<f64>]);

    #[inline(always)]
    fn take(&mut self, n: usize) -> Option<Self::Coordinates> {
        Some((self.coordinates.split_off(..n)?, self.adjoints.split_off(..n)?))
    }

    #[inline(always)]
    fn coordinate(&self, (values, adjoints): &Self::Coordinates, i: usize) -> Var<'t> {
        match (values.get(i), adjoints.get(i)) {
            (Some(&value), Some(adjoint)) => self.tape.first(value, adjoint),
            _ => self.tape.nowhere(f64::NAN),
        }
    }

    #[inline(always)]
    fn drop_constants(&self) -> bool {
        self.drop_constants
    }

    #[inline(always)]
    fn add(&mut self, terms: Settled) {
        self.total.add_all(terms);
    }

    #[inline(always)]
    fn add_all(&mut self, terms: Settled) {
        self.total.add_all(terms);
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total.total()
    }

    #[inline(always)]
    fn mark(&self) -> usize {
        self.tape.mark()
    }

    #[inline(always)]
    fn unwind(&self, mark: usize) {
        self.tape.unwind(mark);
    }
}

/// Backend with a tape that stores every operation of the evaluation, including the density terms.
pub(crate) struct FullTape<'t, 'y> {
    reverse: Reverse<'t, 'y>,
    total: f64,
}

impl<'t, 'y> FullTape<'t, 'y> {
    pub(crate) fn new(tape: &'t Tape, y: &'y [f64]) -> Self {
        Self { reverse: Reverse::new(tape, y, false), total: 0.0 }
    }
}

impl<'t, 'y> Backend for FullTape<'t, 'y> {
    type Number = Var<'t>;
    type Accumulator = Joined<Real<Var<'t>>>;
    type Coordinates = (&'y [f64], &'t [Cell<f64>]);

    fn take(&mut self, n: usize) -> Option<Self::Coordinates> {
        self.reverse.take(n)
    }

    fn coordinate(&self, coordinates: &Self::Coordinates, i: usize) -> Var<'t> {
        self.reverse.coordinate(coordinates, i)
    }

    fn add(&mut self, terms: Joined<Real<Var<'t>>>) {
        let term = terms.number().0;
        self.reverse.tape.seed(term);
        self.total += term.value();
    }

    fn add_all(&mut self, terms: Settled) {
        self.total += terms.total();
    }

    fn total(&self) -> f64 {
        self.total
    }
}
