//! What `model!` expands to: one body, many evaluation contexts.
//!
//! A [`Model`] runs its statements against a [`Context`]. The context decides what a statement
//! means: read an unknown from unconstrained coordinates and add its density
//! ([`density`](crate::Bound)), draw it from the prior, record it under its name, predict.

use crate::accumulator::Settled;
use crate::datum::{Datum, Incomplete, Recordable};
use crate::density::Rejection;
use crate::distribution::{Distribution, Unknown};
use crate::real::Real;
use crate::scalar::Scalar;
use crate::site::Site;

/// A probabilistic model: data and the statements about them.
///
/// `model!` writes this; by hand it reads the same.
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
    /// Whether every point runs the same statements, and none takes data from a point: what the
    /// density has of data alone is one constant then, and data are summed up when they are bound.
    /// `model!` knows; by hand it may stay `false`.
    const STATIC: bool = false;

    /// Runs every statement in order against `cx`.
    ///
    /// # Errors
    /// [`Rejection`] as soon as a statement rejects the point.
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection>;
}

/// An evaluation context: what the statements of a model are run against.
///
/// The crate has all there are: density and gradient, draw from the prior, record, prediction.
pub trait Context: ContextHooks {
    /// What the context computes with.
    type Number: Scalar;

    /// Whether `#[predict]` statements run.
    fn predicts(&self) -> bool {
        false
    }

    /// `let x ~ D`: declares an unknown.
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    fn unknown<D: Unknown<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection>;

    /// `place ~ D`: conditions on something in scope, lifted to the distribution's values by
    /// [`Datum`](crate::Datum).
    ///
    /// # Errors
    /// A rejection if the density is not finite.
    fn observe<D: Distribution<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        datum: D::Value,
        distribution: D,
    ) -> Result<(), Rejection>;

    /// [`observe`](Context::observe) of data as they are.
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

    /// `place.impute() ~ D`: conditions on `datum` where there is one, declares an unknown where it
    /// is missing, and returns the one or the other.
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

    /// [`impute`](Context::impute) of data as they are.
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

    /// `factor(w)`: adds w to the log density.
    ///
    /// # Errors
    /// A rejection if w is not finite.
    fn factor(&mut self, site: &'static Site, weight: Real<Self::Number>) -> Result<(), Rejection>;

    /// `#[track] let x = …`: records a deterministic quantity.
    ///
    /// # Errors
    /// A fatal one if the name is taken.
    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        let _ = (site, value);
        Ok(())
    }

    /// `#[predict] let x = …`: records a deterministic quantity with the predictions.
    ///
    /// # Errors
    /// A fatal one if the name is taken.
    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        let _ = (site, value);
        Ok(())
    }

    /// `#[predict] let x ~ D`: a new draw, on finished draws only.
    ///
    /// # Errors
    /// A rejection if the parameters of `distribution` lie outside their domain.
    fn predict<D: Distribution<Real<Self::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection>;

    /// `#[dims(name = labels)]`: labels of the entries along a dimension, for exports.
    #[inline]
    fn coordinates<L: IntoIterator<Item: ToString>>(
        &mut self,
        dimension: &'static str,
        labels: impl FnOnce() -> L,
    ) {
        let _ = (dimension, labels);
    }
}

/// What generated code asks of a context beside the statements themselves; nothing to call or implement.
pub trait ContextHooks {
    /// Adds the terms of an observation that was summarised when the data were bound, if it was, and
    /// says so: the data need not be read again.
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

    /// [`condition`](Context::condition) in a loop: see [`observe_in_loop`](Self::observe_in_loop).
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

    /// [`observe`](Context::observe) in a loop, whose terms may be summed up in `total`, which a
    /// register can hold, until [`add_total`](Self::add_total).
    ///
    /// # Errors
    /// A rejection if the density is not finite; a context that sums up says so at the end.
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

    /// An empty sum for the terms of a loop, which begins.
    #[inline(always)]
    fn total(&mut self) -> Settled {
        Settled::new()
    }

    /// What a loop has summed up, which has ended.
    ///
    /// # Errors
    /// A rejection if it is not finite.
    #[inline(always)]
    fn add_total(&mut self, site: &'static Site, total: Settled) -> Result<(), Rejection> {
        let _ = (site, total);
        Ok(())
    }

    /// `for y in data { y ~ D }` with one `D` for all.
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

    /// [`observe`](Context::observe) of many data.
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

    /// A position for [`unwind`](Self::unwind).
    #[inline(always)]
    fn mark(&self) -> usize {
        0
    }

    /// Nothing that was computed since `mark` is needed any more: the end of an iteration.
    #[inline(always)]
    fn unwind(&mut self, mark: usize) {
        let _ = mark;
    }

    /// Statements of a submodel follow: their names get that of `site` and a point in front.
    #[inline]
    fn enter(&mut self, site: &'static Site) {
        let _ = site;
    }

    /// The submodel entered last has ended.
    #[inline]
    fn leave(&mut self) {}
}

/// The numbers in the body of a model that runs against `C`.
pub(crate) type NumberOf<C> = Real<<C as Context>::Number>;
