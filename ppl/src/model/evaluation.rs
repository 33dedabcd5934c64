//! Evaluation context of the log density, for every backend.

use crate::density::site::Site;
use crate::density::{FatalError, Rejection};
use crate::distribution::{Distribution, Unknown};
use crate::model::backend::Backend;
use crate::model::context::{Context, ContextHooks, Model, NumberOf};
use crate::number::real::Real;
use crate::term::accumulator::{Accumulator, Settled, Statement};

/// Sufficient statistics of observations that share their parameters.
pub(crate) type SufficientStatistics = Box<[f64]>;

/// Source of sufficient statistics, in the order of the model's statements.
pub(crate) enum Statistics<'p> {
    /// Sufficient statistics that were precomputed when the data were bound. Every evaluation must execute the same
    /// statements.
    Precomputed(std::slice::Iter<'p, SufficientStatistics>),
    /// Scratch memory for statistics that are recomputed at every point.
    Recomputed(&'p mut Vec<f64>),
}

/// Context that evaluates the log density of a model. If `JACOBIAN` is false, the log-Jacobians are omitted, and the
/// result is the density over constrained values.
pub(crate) struct Density<'p, L, const JACOBIAN: bool> {
    pub(crate) backend: L,
    statistics: Statistics<'p>,
}

impl<'p, L: Backend, const JACOBIAN: bool> Density<'p, L, JACOBIAN> {
    #[inline(always)]
    pub(crate) fn new(backend: L, statistics: Statistics<'p>) -> Self {
        Self { backend, statistics }
    }

    /// Runs the model. Returns an error if the model does not use all coordinates, because the density would not
    /// depend on the unused coordinates.
    #[inline(always)]
    pub(crate) fn read(&mut self, model: &impl Model) -> Result<(), Rejection> {
        model.run(self)?;
        if self.backend.take(1).is_some() {
            return Err(fatal(|| FatalError::VaryingDimension { location: None }));
        }
        Ok(())
    }

    /// Creates an empty accumulator for the terms of a statement.
    #[inline(always)]
    fn terms(&self) -> L::Accumulator {
        L::Accumulator::empty(self.backend.drop_constants())
    }

    #[inline(always)]
    fn add(&mut self, site: &Site, terms: L::Accumulator) -> Result<(), Rejection> {
        if !terms.is_finite() {
            return Err(not_finite(site, || terms.total()));
        }
        self.backend.add(terms);
        Ok(())
    }
}

impl<L: Backend, const JACOBIAN: bool> Context for Density<'_, L, JACOBIAN> {
    type Number = L::Number;

    #[inline(always)]
    fn unknown<D: Unknown<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        let dim = distribution.dim();
        let Some(coordinates) = self.backend.take(dim) else {
            return Err(too_few_coordinates(site));
        };
        let (mut terms, mut taken) = (self.terms(), 0);
        let mut next = || {
            taken += 1;
            Real(self.backend.coordinate(&coordinates, taken - 1))
        };
        let value = distribution.constrain(&mut next, JACOBIAN, &mut terms);
        if taken != dim {
            return Err(fatal(|| FatalError::OtherDimension { location: site.location, dim }));
        }
        self.add(site, terms)?;
        Ok(value)
    }

    #[inline(always)]
    fn observe<D: Distribution<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        let mut terms = self.terms();
        distribution.add_terms(&datum, &mut terms);
        self.add(site, terms)
    }

    #[inline(always)]
    fn factor(&mut self, site: &'static Site, weight: Real<L::Number>) -> Result<(), Rejection> {
        let mut terms = self.terms();
        terms.add_number(weight);
        self.add(site, terms)
    }

    fn predict<D: Distribution<Real<L::Number>>>(
        &mut self,
        site: &'static Site,
        _: D,
    ) -> Result<D::Value, Rejection> {
        Err(fatal(|| FatalError::Prediction { location: site.location }))
    }
}

impl<L: Backend, const JACOBIAN: bool> ContextHooks for Density<'_, L, JACOBIAN> {
    #[inline(always)]
    fn observe_summarised<D: Distribution<NumberOf<Self>>>(
        &mut self,
        site: &'static Site,
        distribution: &D,
    ) -> Result<bool, Rejection> {
        let (true, Statistics::Precomputed(statistics)) = (D::SUMMARISES, &mut self.statistics)
        else {
            return Ok(false);
        };
        let Some(sums) = statistics.next() else { return Err(more_observations(site)) };
        let mut terms = self.terms();
        distribution.add_statistics_terms(sums, &mut terms);
        self.add(site, terms)?;
        Ok(true)
    }

    #[inline(always)]
    fn observe_in_loop<D: Distribution<NumberOf<Self>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
        total: &mut Settled,
    ) -> Result<(), Rejection> {
        if let Some(terms) = L::Accumulator::within(total) {
            distribution.add_terms(&datum, terms);
            return Ok(());
        }
        self.observe(site, datum, distribution)
    }

    #[inline(always)]
    fn total(&mut self) -> Settled {
        Statement::<Real<L::Number>>::empty(self.backend.drop_constants())
    }

    #[inline(always)]
    fn add_total(&mut self, site: &'static Site, total: Settled) -> Result<(), Rejection> {
        if !total.is_finite() {
            return Err(not_finite(site, || total.total()));
        }
        self.backend.add_all(total);
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
        D: Distribution<NumberOf<Self>, Value = I::Item>,
        I: Iterator,
    {
        if !D::HAS_STATISTICS {
            let mut total = self.total();
            for datum in data {
                self.observe_in_loop(site, datum, distribution.clone(), &mut total)?;
            }
            return self.add_total(site, total);
        }
        let mut terms = self.terms();
        let sums = match &mut self.statistics {
            Statistics::Precomputed(statistics) => match statistics.next() {
                Some(sums) => &**sums,
                None => return Err(more_observations(site)),
            },
            Statistics::Recomputed(sums) => {
                sums.clear();
                D::sufficient_statistics(data, sums);
                sums.as_slice()
            }
        };
        distribution.add_statistics_terms(sums, &mut terms);
        self.add(site, terms)
    }

    #[inline(always)]
    fn mark(&self) -> usize {
        self.backend.mark()
    }

    #[inline(always)]
    fn unwind(&mut self, mark: usize) {
        self.backend.unwind(mark);
    }
}

/// Constructs a fatal rejection. The error inside the rejection is constructed in a function that is not inlined.
///
/// Since the variant of `Rejection` is constructed inline, the compiler knows that all scalars in later statements
/// are on the same tape. If the rejection were constructed in a separate function, the compiled code would check the
/// tape of each scalar.
#[inline(always)]
pub(crate) fn fatal(error: impl FnOnce() -> FatalError) -> Rejection {
    Rejection::Fatal(elsewhere(|| Box::new(error())))
}

#[cold]
#[inline(never)]
fn elsewhere<T>(f: impl FnOnce() -> T) -> T {
    f()
}

#[inline(always)]
fn not_finite(site: &Site, value: impl FnOnce() -> f64) -> Rejection {
    Rejection::NotFinite { location: site.location, value: elsewhere(value) }
}

#[inline(always)]
fn more_observations(site: &Site) -> Rejection {
    fatal(|| FatalError::MoreObservations { location: site.location })
}

#[inline(always)]
pub(crate) fn too_few_coordinates(site: &Site) -> Rejection {
    fatal(|| FatalError::VaryingDimension { location: Some(site.location) })
}
