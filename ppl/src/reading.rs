//! The reading of a model as a log density, over any kind of number.

use std::cell::Cell;

use crate::density::Rejection;
use crate::distribution::{Distribution, Unknown};
use crate::lean::Lean;
use crate::model::{Context, Model, Site};
use crate::real::Real;
use crate::scalar::Scalar;
use crate::tape::{Tape, Var};

/// Where unknowns come from and where density terms go.
pub(crate) trait Ledger {
    type Number: Scalar;

    /// The next unconstrained coordinate, `None` past the last.
    fn next(&mut self) -> Option<Self::Number>;

    /// Instead of a coordinate past the last.
    #[inline(always)]
    fn absent(&self) -> Self::Number {
        Self::Number::from(f64::NAN)
    }

    fn add(&mut self, term: Self::Number);

    /// Whether the value of a term may be summed up elsewhere.
    const APART: bool;

    /// Adds a term but for its value.
    fn add_derivative(&mut self, term: Self::Number);

    /// Adds values that were summed up elsewhere.
    fn add_value(&mut self, total: f64);

    /// The value of the sum so far.
    fn total(&self) -> f64;

    /// Whether the terms from now on are summands of the total.
    #[inline(always)]
    fn take_terms(&self, take: bool) {
        let _ = take;
    }

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

/// A ledger of lean numbers over one of full ones.
pub(crate) struct WithoutConstants<L>(pub(crate) L);

impl<L: Ledger> Ledger for WithoutConstants<L> {
    type Number = Lean<L::Number>;

    #[inline(always)]
    fn next(&mut self) -> Option<Lean<L::Number>> {
        self.0.next().map(Lean)
    }

    #[inline(always)]
    fn absent(&self) -> Lean<L::Number> {
        Lean(self.0.absent())
    }

    #[inline(always)]
    fn add(&mut self, term: Lean<L::Number>) {
        self.0.add(term.0);
    }

    const APART: bool = L::APART;

    #[inline(always)]
    fn add_derivative(&mut self, term: Lean<L::Number>) {
        self.0.add_derivative(term.0);
    }

    #[inline(always)]
    fn add_value(&mut self, total: f64) {
        self.0.add_value(total);
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.0.total()
    }

    #[inline(always)]
    fn take_terms(&self, take: bool) {
        self.0.take_terms(take);
    }

    #[inline(always)]
    fn mark(&self) -> usize {
        self.0.mark()
    }

    #[inline(always)]
    fn unwind(&self, mark: usize) {
        self.0.unwind(mark);
    }
}

/// Values or duals: terms add up as they come.
pub(crate) struct Sum<'y, R> {
    pub(crate) coordinates: std::slice::Iter<'y, R>,
    pub(crate) total: R,
}

impl<'y, R: Scalar> Sum<'y, R> {
    pub(crate) fn new(y: &'y [R]) -> Self {
        Self { coordinates: y.iter(), total: R::from(0.0) }
    }
}

impl<R: Scalar> Ledger for Sum<'_, R> {
    type Number = R;

    #[inline(always)]
    fn next(&mut self) -> Option<R> {
        self.coordinates.next().copied()
    }

    #[inline(always)]
    fn add(&mut self, term: R) {
        self.total += term;
    }

    const APART: bool = !R::DIFFERENTIABLE;

    #[inline(always)]
    fn add_derivative(&mut self, _: R) {}

    #[inline(always)]
    fn add_value(&mut self, total: f64) {
        self.total += total;
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total.value()
    }
}

/// A tape: every term is a root of the backward sweep.
pub(crate) struct Roots<'t, 'y> {
    coordinates: std::iter::Zip<std::slice::Iter<'y, f64>, std::slice::Iter<'t, Cell<f64>>>,
    tape: &'t Tape,
    total: f64,
}

impl<'t, 'y> Roots<'t, 'y> {
    /// Puts all coordinates on the cleared tape, so that they come first there; none if the tape
    /// is too short for them.
    pub(crate) fn new(tape: &'t Tape, y: &'y [f64]) -> Self {
        Self { coordinates: y.iter().zip(tape.inputs(y.len())), tape, total: 0.0 }
    }
}

impl<'t> Ledger for Roots<'t, '_> {
    type Number = Var<'t>;

    #[inline(always)]
    fn next(&mut self) -> Option<Var<'t>> {
        self.coordinates.next().map(|(&value, adjoint)| self.tape.number(value, adjoint))
    }

    #[inline(always)]
    fn absent(&self) -> Var<'t> {
        self.tape.nowhere(f64::NAN)
    }

    #[inline(always)]
    fn add(&mut self, term: Var<'t>) {
        self.total += term.value();
        self.tape.seed(term);
    }

    const APART: bool = true;

    #[inline(always)]
    fn add_derivative(&mut self, term: Var<'t>) {
        self.tape.seed(term);
    }

    #[inline(always)]
    fn add_value(&mut self, total: f64) {
        self.total += total;
    }

    #[inline(always)]
    fn total(&self) -> f64 {
        self.total
    }

    #[inline(always)]
    fn take_terms(&self, take: bool) {
        self.tape.take_terms(take);
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

/// A tape that keeps every operation to the end, whatever the model says about them.
pub(crate) struct Plain<'t, 'y>(pub(crate) Roots<'t, 'y>);

impl<'t> Ledger for Plain<'t, '_> {
    type Number = Var<'t>;

    fn next(&mut self) -> Option<Var<'t>> {
        self.0.next()
    }

    fn add(&mut self, term: Var<'t>) {
        self.0.add(term);
    }

    const APART: bool = true;

    fn add_derivative(&mut self, term: Var<'t>) {
        self.0.add_derivative(term);
    }

    fn add_value(&mut self, total: f64) {
        self.0.add_value(total);
    }

    fn total(&self) -> f64 {
        self.0.total()
    }
}

/// What suffices of data that share their parameters, a pool each, in the order in which the model
/// comes to them.
pub(crate) type Sums = Vec<Box<[f64]>>;

/// Where the sums of pools come from.
pub(crate) enum Pools<'p> {
    /// The data were bound: every point runs the same statements.
    Found(std::slice::Iter<'p, Box<[f64]>>),
    /// To be found at every point, in this memory.
    Anew(&'p mut Vec<f64>),
}

/// The log density reading. Without `JACOBIAN` it is the density over constrained values.
pub(crate) struct Density<'p, L, const JACOBIAN: bool> {
    pub(crate) ledger: L,
    pub(crate) pools: Pools<'p>,
}

impl<L: Ledger, const JACOBIAN: bool> Density<'_, L, JACOBIAN> {
    /// Runs the model over all coordinates: one that it left unread would have a flat density.
    #[inline(always)]
    pub(crate) fn read(&mut self, model: &impl Model) -> Result<(), Rejection> {
        model.run(self)?;
        if self.ledger.next().is_some() {
            return Err(varying_dimension("the model stops asking before the last coordinate"));
        }
        Ok(())
    }

    #[inline(always)]
    fn add(&mut self, site: &Site, term: L::Number) -> Result<(), Rejection> {
        let value = term.value();
        if !value.is_finite() {
            return Err(not_finite(site, value));
        }
        self.ledger.add(term);
        Ok(())
    }
}

impl<L: Ledger, const JACOBIAN: bool> Context for Density<'_, L, JACOBIAN> {
    type Number = L::Number;

    #[inline(always)]
    fn unknown<D: Unknown<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        let mut missing = false;
        self.ledger.take_terms(D::SUMMANDS);
        let ledger = &mut self.ledger;
        let mut next = || {
            Real(ledger.next().unwrap_or_else(|| {
                missing = true;
                ledger.absent()
            }))
        };
        let (value, term) = distribution.constrain(&mut next, JACOBIAN);
        self.ledger.take_terms(false);
        if missing {
            return Err(too_few_coordinates(site));
        }
        self.add(site, term.0)?;
        Ok(value)
    }

    #[inline(always)]
    fn observe<D: Distribution<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        self.ledger.take_terms(D::SUMMANDS);
        let term = distribution.ln_density(&datum);
        self.ledger.take_terms(false);
        self.add(site, term.0)
    }

    #[inline(always)]
    fn observe_in_loop<D: Distribution<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
        total: &mut f64,
    ) -> Result<(), Rejection> {
        if !L::APART {
            return self.observe(site, datum, distribution);
        }
        self.ledger.take_terms(D::SUMMANDS);
        let term = distribution.ln_density(&datum).0;
        self.ledger.take_terms(false);
        *total += term.value();
        self.ledger.add_derivative(term);
        Ok(())
    }

    #[inline(always)]
    fn add_total(&mut self, site: &'static Site, total: f64) -> Result<(), Rejection> {
        if !total.is_finite() {
            return Err(not_finite(site, total));
        }
        self.ledger.add_value(total);
        Ok(())
    }

    #[inline(always)]
    fn observe_all<D, I>(
        &mut self,
        site: &'static Site,
        data: I,
        distribution: D,
    ) -> Result<(), Rejection>
    where
        D: Distribution<Real<L::Number>, Value = I::Item>,
        I: Iterator,
    {
        if !D::POOLS {
            let mut total = 0.0;
            for datum in data {
                self.observe_in_loop(site, datum, distribution.clone(), &mut total)?;
            }
            return self.add_total(site, total);
        }
        let sums = match &mut self.pools {
            Pools::Found(pools) => pools.next().ok_or_else(|| one_pool_more(site))?,
            Pools::Anew(sums) => {
                sums.clear();
                D::sum_up(data, sums);
                sums.as_slice()
            }
        };
        self.ledger.take_terms(D::SUMMANDS);
        let term = distribution.ln_density_of(sums);
        self.ledger.take_terms(false);
        self.add(site, term.0)
    }

    #[inline(always)]
    fn factor(&mut self, site: &'static Site, weight: Real<L::Number>) -> Result<(), Rejection> {
        self.add(site, weight.0)
    }

    #[inline(always)]
    fn mark(&self) -> usize {
        self.ledger.mark()
    }

    #[inline(always)]
    fn unwind(&mut self, mark: usize) {
        self.ledger.unwind(mark);
    }

    fn predict<D: Distribution<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        _: D,
    ) -> Result<D::Value, Rejection> {
        Err(Rejection::Fatal {
            message: format!("{}: predictions need `if cx.predicts()` around them", site.place),
        })
    }
}

#[cold]
fn not_finite(site: &Site, value: f64) -> Rejection {
    Rejection::NotFinite { place: site.place, value }
}

#[cold]
fn one_pool_more(site: &Site) -> Rejection {
    Rejection::Fatal {
        message: format!(
            "{}: the model observes more often than when its data were bound; make that a matter of \
             data",
            site.place
        ),
    }
}

#[cold]
pub(crate) fn too_few_coordinates(site: &Site) -> Rejection {
    varying_dimension(&format!("{} asks for more than the point has", site.place))
}

pub(crate) fn varying_dimension(found: &str) -> Rejection {
    Rejection::Fatal {
        message: format!(
            "the number of unknowns depends on the values of unknowns, or the point has another \
             length than `dim()`: {found}; make the size of the model a matter of data"
        ),
    }
}
