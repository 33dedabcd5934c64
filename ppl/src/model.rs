//! Traits behind the code that `model!` generates: one model body, many evaluation contexts.
//!
//! A [`Model`] runs its statements in a [`Context`]. The context determines the effect of a statement. The density
//! context ([`density`](crate::Bound)) reads an unknown from unconstrained coordinates and adds its density. Other
//! contexts draw the unknown from the prior, record it under its name, or predict.

use crate::accumulator::Settled;
use crate::datum::{Datum, Incomplete, Recordable};
use crate::density::Rejection;
use crate::distribution::{Distribution, Unknown};
use crate::real::Real;
use crate::scalar::Scalar;
use crate::site::Site;

/// A probabilistic model: data and statements about the data.
///
/// `model!` implements this trait; a manual implementation looks the same.
///
/// # Example
/// ```
/// use ppl::prelude::*;
/// use ppl::{Bound, Context, Model, Rejection, Site};
///
/// struct Coin<'a> {
///     heads: &'a [bool],
/// }
///
/// impl Model for Coin<'_> {
///     fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
///         static P: Site = Site::new("p");
///         static FLIP: Site = Site::new("flip").in_loop();
///         let p = cx.unknown(&P, Uniform(0.0, 1.0))?;
///         for flip in self.heads {
///             cx.observe(&FLIP, *flip, Bernoulli(p))?;
///         }
///         Ok(())
///     }
/// }
///
/// let model = Bound::new(Coin { heads: &[true, true, false] });
/// assert_eq!(model.layout()?.dim, 1);
/// # Ok::<(), ppl::ModelError>(())
/// ```
pub trait Model: Sync {
    /// Whether every point executes the same statements with the same data. Then the terms that depend only on data are
    /// constant, and the data can be summarised when they are bound. `model!` sets this value; a manual implementation
    /// can keep the default `false`.
    const STATIC: bool = false;

    /// Executes every statement in order in the context `cx`.
    ///
    /// # Errors
    /// [`Rejection`] of the first statement that rejects the point.
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection>;
}

/// Evaluation context in which the statements of a model are executed.
///
/// The crate contains all implementations: density and gradient, prior draws, records, predictions.
pub trait Context: ContextHooks {
    /// Scalar type of the computation.
    type Number: Scalar;

    /// Whether `#[predict]` statements are executed.
    fn predicts(&self) -> bool {
        false
    }

    /// Executes `let x ~ D`: declares an unknown.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    fn unknown<D: Unknown<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection>;

    /// Executes `place ~ D`: conditions on a datum. [`Datum`](crate::Datum) converts the datum to the value type of the
    /// distribution.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    fn observe<D: Distribution<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection>;

    /// Version of [`observe`](Context::observe) for data that are not yet converted.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline(always)]
    fn condition<D: Distribution<Real<Self::Number>>, T: Datum<D::Value> + ?Sized>(
        &mut self,
        site: &'static Site,
        distribution: D,
        datum: &T,
    ) -> Result<(), Rejection> {
        if self.observe_summarised(site, &distribution)? {
            return Ok(());
        }
        self.observe(site, datum.lift(), distribution)
    }

    /// Executes `place.impute() ~ D`. If `datum` is present, conditions on it and returns it; if it is missing,
    /// declares an unknown and returns its value.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline]
    fn impute<D: Unknown<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        datum: Option<D::Value>,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        match datum {
            Some(x) => {
                self.observe(site, x.clone(), distribution)?;
                Ok(x)
            }
            None => self.unknown(site, distribution),
        }
    }

    /// Version of [`impute`](Context::impute) for data that are not yet converted.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline]
    fn complete<D: Unknown<Real<Self::Number>>, T: Incomplete<D::Value> + ?Sized>(
        &mut self,
        site: &'static Site,
        distribution: D,
        datum: &T,
    ) -> Result<D::Value, Rejection> {
        self.impute(site, datum.known(), distribution)
    }

    /// Executes `factor(w)`: adds w to the log density.
    ///
    /// # Errors
    /// A rejection if w is not finite.
    fn factor(&mut self, site: &'static Site, weight: Real<Self::Number>) -> Result<(), Rejection>;

    /// Executes `#[track] let x = …`: records a deterministic quantity.
    ///
    /// # Errors
    /// A fatal error if the name is already in use.
    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        let _ = (site, value);
        Ok(())
    }

    /// Executes `#[predict] let x = …`: records a deterministic quantity with the predictions.
    ///
    /// # Errors
    /// A fatal error if the name is already in use.
    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        let _ = (site, value);
        Ok(())
    }

    /// Executes `#[predict] let x ~ D`: draws a prediction. Called only after sampling, at the kept draws.
    ///
    /// # Errors
    /// A rejection if a parameter of `distribution` is outside its domain.
    fn predict<D: Distribution<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection>;

    /// Executes `#[dims(name = labels)]`: sets the labels of the entries along a dimension, for exports.
    #[inline]
    fn coordinates<L: IntoIterator<Item: ToString>>(
        &mut self,
        dimension: &'static str,
        labels: impl FnOnce() -> L,
    ) {
        let _ = (dimension, labels);
    }
}

/// Methods that generated code calls besides those of [`Context`]; users need not call or implement them.
pub trait ContextHooks {
    /// Adds the terms of an observation that was summarised when the data were bound. Returns false if it was not
    /// summarised; the data must then be read.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline(always)]
    fn observe_summarised<D: Distribution<NumberOf<Self>>>(
        &mut self,
        site: &'static Site,
        distribution: &D,
    ) -> Result<bool, Rejection>
    where
        Self: Context,
    {
        let _ = (site, distribution);
        Ok(false)
    }

    /// Version of [`condition`](Context::condition) in a loop, see [`observe_in_loop`](Self::observe_in_loop).
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline(always)]
    fn condition_in_loop<D: Distribution<NumberOf<Self>>, T: Datum<D::Value> + ?Sized>(
        &mut self,
        site: &'static Site,
        distribution: D,
        datum: &T,
        total: &mut Settled,
    ) -> Result<(), Rejection>
    where
        Self: Context,
    {
        if self.observe_summarised(site, &distribution)? {
            return Ok(());
        }
        self.observe_in_loop(site, datum.lift(), distribution, total)
    }

    /// Version of [`observe`](Context::observe) in a loop. A context can sum the terms in `total`, which the compiler
    /// can keep in registers; [`add_total`](Self::add_total) adds the sum to the density.
    ///
    /// # Errors
    /// A rejection if the density is not finite. A context that sums the terms reports it only in `add_total`.
    #[inline(always)]
    fn observe_in_loop<D: Distribution<NumberOf<Self>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
        total: &mut Settled,
    ) -> Result<(), Rejection>
    where
        Self: Context,
    {
        let _ = total;
        self.observe(site, datum, distribution)
    }

    /// Empty sum for the terms of a loop, created before the loop.
    #[inline(always)]
    fn total(&mut self) -> Settled {
        Settled::new()
    }

    /// Adds the sum of the terms of a loop to the density, after the loop.
    ///
    /// # Errors
    /// A rejection if the sum is not finite.
    #[inline(always)]
    fn add_total(&mut self, site: &'static Site, total: Settled) -> Result<(), Rejection> {
        let _ = (site, total);
        Ok(())
    }

    /// Executes `for y in data { y ~ D }`, where `D` is the same for all data.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline(always)]
    fn condition_all<D: Distribution<NumberOf<Self>>, T: Datum<D::Value>>(
        &mut self,
        site: &'static Site,
        distribution: D,
        data: impl IntoIterator<Item = T>,
    ) -> Result<(), Rejection>
    where
        Self: Context,
    {
        self.observe_all(site, data.into_iter().map(|datum| datum.lift()), distribution)
    }

    /// Version of [`observe`](Context::observe) for many data with the same distribution.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    #[inline(always)]
    fn observe_all<D, I>(
        &mut self,
        site: &'static Site,
        data: I,
        distribution: D,
    ) -> Result<(), Rejection>
    where
        Self: Context,
        D: Distribution<NumberOf<Self>, Value = I::Item>,
        I: Iterator,
    {
        for datum in data {
            self.observe(site, datum, distribution.clone())?;
        }
        Ok(())
    }

    /// Current position, as an argument of [`unwind`](Self::unwind).
    #[inline(always)]
    fn mark(&self) -> usize {
        0
    }

    /// Releases all intermediate values computed since `mark`, at the end of an iteration.
    #[inline(always)]
    fn unwind(&mut self, mark: usize) {
        let _ = mark;
    }

    /// Begins a submodel: the name of `site` and a dot precede the names of its statements.
    #[inline]
    fn enter(&mut self, site: &'static Site) {
        let _ = site;
    }

    /// Ends the most recently entered submodel.
    #[inline]
    fn leave(&mut self) {}
}

/// Scalar type in the body of a model that runs in the context `C`.
pub(crate) type NumberOf<C> = Real<<C as Context>::Number>;
