//! Backends: where the numbers of a density come from, where its terms go, and so what a number is:
//! plain (primal), carrying its derivatives (forward), on a tape that keeps nothing of terms (reverse),
//! on one that keeps everything (full tape).

use std::cell::Cell;

use crate::accumulator::{Joined, Settled, Statement};
use crate::real::Real;
use crate::scalar::Scalar;
use crate::tape::{Tape, Var};

/// Where unknowns come from and where density terms go.
pub(crate) trait Backend {
    type Number: Scalar;

    /// What takes the terms of a statement.
    type Accumulator: Statement<Real<Self::Number>>;

    /// Unconstrained coordinates of one unknown.
    type Coordinates;

    /// The next `n` coordinates; `None` if there are fewer.
    fn take(&mut self, n: usize) -> Option<Self::Coordinates>;

    /// The `i`-th of them; not a number past the last.
    fn coordinate(&self, own: &Self::Coordinates, i: usize) -> Self::Number;

    /// Adds all terms of a statement.
    fn add(&mut self, terms: Self::Accumulator);

    /// Adds what was summed up elsewhere.
    fn add_all(&mut self, terms: Settled);

    /// Whether what is the same at every point is left out.
    #[inline(always)]
    fn drop_constants(&self) -> bool {
        false
    }

    /// The value of the sum so far.
    fn total(&self) -> f64;

    /// A position to go back to once nothing that came after it is needed.
    #[inline(always)]
    fn mark(&self) -> usize {
        0
    }

    #[inline(always)]
    fn unwind(&self, mark: usize) {
        let _ = mark;
    }
}

/// Plain values.
pub(crate) struct Primal<'y> {
    coordinates: &'y [f64],
    drop_constants: bool,
    total: Settled,
}

impl<'y> Primal<'y> {
    /// At `y`, with `drop_constants` without what is the same at every point.
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
    fn coordinate(&self, own: &&'y [f64], i: usize) -> f64 {
        own.get(i).copied().unwrap_or(f64::NAN)
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

/// Numbers that carry their derivatives with them.
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
    fn coordinate(&self, own: &&'y [R], i: usize) -> R {
        own.get(i).copied().unwrap_or_else(|| R::from(f64::NAN))
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

/// A tape on which nothing is kept of terms.
pub(crate) struct Reverse<'t, 'y> {
    coordinates: &'y [f64],
    adjoints: &'t [Cell<f64>],
    tape: &'t Tape,
    drop_constants: bool,
    total: Settled,
}

impl<'t, 'y> Reverse<'t, 'y> {
    /// Puts all coordinates on the cleared tape, so that they come first there; none if the tape
    /// is too short for them. With `drop_constants` without what is the same at every point.
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
    fn coordinate(&self, (own, adjoints): &Self::Coordinates, i: usize) -> Var<'t> {
        match (own.get(i), adjoints.get(i)) {
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

/// A tape that keeps every operation to the end, terms and whatever the model says about them.
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

    fn coordinate(&self, own: &Self::Coordinates, i: usize) -> Var<'t> {
        self.reverse.coordinate(own, i)
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
