//! Submodels: blocks of statements that several models share.

use crate::density::Rejection;
use crate::density::site::Site;
use crate::distribution::{Distribution, Unknown};
use crate::model::context::{Context, ContextHooks};
use crate::number::real::Real;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Recordable;

/// A block of statements with a result, which a model can run. In `model!`, a function with a return type becomes a
/// submodel.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// Offsets of groups around a level. The spread of the offsets is unknown.
///     fn offsets(level: Real, groups: usize) -> Vec<Real> {
///         let spread ~ HalfNormal(1.0);
///         let z ~ Normal(0.0, 1.0).iid(groups);
///         z.iter().map(|z| level + spread * *z).collect()
///     }
///
///     fn yields(field: &[usize], year: &[usize], y: &[f64]) {
///         let level ~ Normal(0.0, 5.0);
///         let by_field ~ offsets(level, 2);
///         let by_year ~ offsets(0.0, 3);
///         for ((f, t), y) in field.iter().zip(year).zip(y) {
///             y ~ Normal(by_field[*f] + by_year[*t], 1.0);
///         }
///     }
/// }
///
/// let model = yields(&[0, 1, 1], &[0, 1, 2], &[1.2, 0.4, 0.9]);
/// let names: Vec<_> = model.layout()?.variables.iter().map(|v| v.name.as_str()).collect();
/// assert_eq!(names, ["level", "by_field.spread", "by_field.z", "by_year.spread", "by_year.z", "y"]);
/// # Ok::<(), ppl::ModelError>(())
/// ```
#[diagnostic::on_unimplemented(message = "`{Self}` is not a submodel")]
pub trait Submodel<S: Scalar> {
    /// Type of the result.
    type Value;

    /// Whether the submodel executes the same statements with the same data at every point of the parameter space, for
    /// given data; see [`Model::STATIC`](crate::Model::STATIC). `model!` sets this value; a manual implementation can
    /// keep the default `false`.
    const STATIC: bool = false;

    /// Executes every statement in order in the context `cx`.
    ///
    /// # Errors
    /// [`Rejection`] of the first statement that rejects the point.
    fn run<C: Context<Number = S>>(&self, cx: &mut C) -> Result<Self::Value, Rejection>;
}

/// A submodel with its arguments: the right-hand side of `let name ~`.
#[derive(Clone, Copy, Debug)]
pub struct Part<M>(pub M);

/// Right-hand side of `let name ~` in the context `C`: a distribution, or a [`Part`], whose names get the prefix
/// `name.`.
pub trait Declaration<C: Context> {
    /// Type of the declared value.
    type Value;

    /// Executes the declaration.
    ///
    /// # Errors
    /// [`Rejection`] if a statement rejects the point.
    fn declare(self, site: &'static Site, cx: &mut C) -> Result<Self::Value, Rejection>;
}

impl<C: Context, D: Unknown<Real<C::Number>>> Declaration<C> for D {
    type Value = D::Value;

    #[inline(always)]
    fn declare(self, site: &'static Site, cx: &mut C) -> Result<D::Value, Rejection> {
        cx.unknown(site, self)
    }
}

impl<C: Context, M: Submodel<C::Number>> Declaration<C> for Part<M> {
    type Value = M::Value;

    #[inline(always)]
    fn declare(self, site: &'static Site, cx: &mut C) -> Result<M::Value, Rejection> {
        cx.enter(site, M::STATIC);
        let value = self.0.run(cx)?;
        cx.leave();
        Ok(value)
    }
}

/// Right-hand side of `#[predict] let name ~` in the context `C`: a distribution, including distributions of counts
/// and flags, or a [`Part`], whose names get the prefix `name.`.
pub trait Prediction<C: Context> {
    /// Type of the predicted value.
    type Value;

    /// Draws the prediction.
    ///
    /// # Errors
    /// [`Rejection`] if a parameter is invalid.
    fn predict(self, site: &'static Site, cx: &mut C) -> Result<Self::Value, Rejection>;
}

impl<C: Context, D: Distribution<Real<C::Number>>> Prediction<C> for D {
    type Value = D::Value;

    fn predict(self, site: &'static Site, cx: &mut C) -> Result<D::Value, Rejection> {
        cx.predict(site, self)
    }
}

impl<C: Context, M: Submodel<C::Number>> Prediction<C> for Part<M> {
    type Value = M::Value;

    fn predict(self, site: &'static Site, cx: &mut C) -> Result<M::Value, Rejection> {
        cx.enter(site, true);
        let value = self.0.run(&mut Predicting(&mut *cx))?;
        cx.leave();
        Ok(value)
    }
}

/// Context that predicts with a submodel: the unknowns and the observed quantities of the submodel are drawn from
/// their distributions.
struct Predicting<'c, C>(&'c mut C);

impl<C: Context> Context for Predicting<'_, C> {
    type Number = C::Number;

    fn predicts(&self) -> bool {
        true
    }

    fn unknown<D: Unknown<Real<C::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        self.0.predict(site, distribution)
    }

    fn observe<D: Distribution<Real<C::Number>>>(
        &mut self,
        site: &'static Site,
        _: D::Value,
        distribution: D,
    ) -> Result<(), Rejection> {
        self.0.predict(site, distribution).map(|_| ())
    }

    fn impute<D: Unknown<Real<C::Number>>>(
        &mut self,
        site: &'static Site,
        _: Option<D::Value>,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        self.0.predict(site, distribution)
    }

    // `factor` terms do not affect draws; prior draws ignore them too
    fn factor(&mut self, _: &'static Site, _: Real<C::Number>) -> Result<(), Rejection> {
        Ok(())
    }

    fn track<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.0.track_prediction(site, value)
    }

    fn track_prediction<T: Recordable + ?Sized>(
        &mut self,
        site: &'static Site,
        value: &T,
    ) -> Result<(), Rejection> {
        self.0.track_prediction(site, value)
    }

    fn predict<D: Distribution<Real<C::Number>>>(
        &mut self,
        site: &'static Site,
        distribution: D,
    ) -> Result<D::Value, Rejection> {
        self.0.predict(site, distribution)
    }

    fn coordinates<L: IntoIterator<Item: ToString>>(
        &mut self,
        dimension: &'static str,
        labels: impl FnOnce() -> L,
    ) {
        self.0.coordinates(dimension, labels);
    }
}

impl<C: Context> ContextHooks for Predicting<'_, C> {
    fn enter(&mut self, site: &'static Site, _: bool) {
        // the submodel counts as static, because predictions do not affect the density
        self.0.enter(site, true);
    }

    fn leave(&mut self) {
        self.0.leave();
    }
}
