//! Where the numbers of a density come from, and where they go.

use std::cell::Cell;

use crate::real::Real;
use crate::scalar::Scalar;
use crate::tape::{Tape, Var};
use crate::terms::{Joined, Settled, Statement};

/// Where unknowns come from and where density terms go.
pub(crate) trait Ledger {
    type Number: Scalar;

    /// What takes the terms of a statement.
    type Terms: Statement<Real<Self::Number>>;

    /// Whether that is a sum, of which nothing is asked but its value and what it leaves behind.
    const SETTLES: bool = false;

    /// The next unconstrained coordinate, `None` past the last.
    fn next(&mut self) -> Option<Self::Number>;

    /// Instead of a coordinate past the last.
    #[inline(always)]
    fn absent(&self) -> Self::Number {
        Self::Number::from(f64::NAN)
    }

    /// Adds all terms of a statement.
    fn add(&mut self, terms: Self::Terms);

    /// Adds what was summed up elsewhere.
    fn add_all(&mut self, terms: Settled);

    /// Whether what is the same at every point is left out.
    #[inline(always)]
    fn lean(&self) -> bool {
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

/// Values alone.
pub(crate) struct Values<'y> {
    coordinates: std::slice::Iter<'y, f64>,
    lean: bool,
    total: Settled,
}

impl<'y> Values<'y> {
    /// At `y`; lean without what is the same at every point.
    #[inline(always)]
    pub(crate) fn new(y: &'y [f64], lean: bool) -> Self {
        Self { coordinates: y.iter(), lean, total: Settled::new(1.0) }
    }
}

impl Ledger for Values<'_> {
    type Number = f64;
    type Terms = Settled;
    const SETTLES: bool = true;

    #[inline(always)]
    fn next(&mut self) -> Option<f64> {
        self.coordinates.next().copied()
    }

    #[inline(always)]
    fn lean(&self) -> bool {
        self.lean
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
pub(crate) struct Sum<'y, R> {
    coordinates: std::slice::Iter<'y, R>,
    pub(crate) total: R,
}

impl<'y, R: Scalar> Sum<'y, R> {
    pub(crate) fn new(y: &'y [R]) -> Self {
        Self { coordinates: y.iter(), total: R::from(0.0) }
    }
}

impl<R: Scalar> Ledger for Sum<'_, R> {
    type Number = R;
    type Terms = Joined<Real<R>>;

    #[inline(always)]
    fn next(&mut self) -> Option<R> {
        self.coordinates.next().copied()
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
pub(crate) struct Roots<'t, 'y> {
    coordinates: std::iter::Zip<std::slice::Iter<'y, f64>, std::slice::Iter<'t, Cell<f64>>>,
    tape: &'t Tape,
    lean: bool,
    total: Settled,
}

impl<'t, 'y> Roots<'t, 'y> {
    /// Puts all coordinates on the cleared tape, so that they come first there; none if the tape
    /// is too short for them. Lean without what is the same at every point.
    #[inline(always)]
    pub(crate) fn new(tape: &'t Tape, y: &'y [f64], lean: bool) -> Self {
        let coordinates = y.iter().zip(tape.inputs(y.len()));
        Self { coordinates, tape, lean, total: Settled::new(1.0) }
    }
}

impl<'t> Ledger for Roots<'t, '_> {
    type Number = Var<'t>;
    type Terms = Settled;
    const SETTLES: bool = true;

    #[inline(always)]
    fn next(&mut self) -> Option<Var<'t>> {
        self.coordinates.next().map(|(&value, adjoint)| self.tape.first(value, adjoint))
    }

    #[inline(always)]
    fn absent(&self) -> Var<'t> {
        self.tape.nowhere(f64::NAN)
    }

    #[inline(always)]
    fn lean(&self) -> bool {
        self.lean
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
pub(crate) struct Plain<'t, 'y> {
    roots: Roots<'t, 'y>,
    total: f64,
}

impl<'t, 'y> Plain<'t, 'y> {
    pub(crate) fn new(tape: &'t Tape, y: &'y [f64]) -> Self {
        Self { roots: Roots::new(tape, y, false), total: 0.0 }
    }
}

impl<'t> Ledger for Plain<'t, '_> {
    type Number = Var<'t>;
    type Terms = Joined<Real<Var<'t>>>;

    fn next(&mut self) -> Option<Var<'t>> {
        self.roots.next()
    }

    fn absent(&self) -> Var<'t> {
        self.roots.absent()
    }

    fn add(&mut self, terms: Joined<Real<Var<'t>>>) {
        let term = terms.number().0;
        self.roots.tape.seed(term);
        self.total += term.value();
    }

    fn add_all(&mut self, terms: Settled) {
        self.total += terms.total();
    }

    fn total(&self) -> f64 {
        self.total
    }
}
