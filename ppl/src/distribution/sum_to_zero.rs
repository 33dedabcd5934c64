//! Normal values that sum to zero.

use rand::Rng;
use rand_distr::StandardNormal;

use super::{Distribution, Family, Normal, Parameter, Repeated, Unknown, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;
use crate::terms::Terms;
use crate::transform::{VectorMap, ZeroSum};

/// N independent normal values under the condition that their sum is 0; made by
/// [`Family::sum_to_zero`]: effects that are identified beside an intercept.
///
/// ln p(x) = −½ |x|²/σ² − (N − 1)(ln σ + ½ ln 2π) for Σ xᵢ = 0, with respect to volume in that
/// hyperplane: a normal distribution with covariance σ² (I − 1/N), whose mean is 0 whatever that
/// of the elements. Note the N − 1: `Normal(0, σ)` written over all N entries, as is common
/// elsewhere, has one factor 1/σ too many.
///
/// The coordinates are those of [`ZeroSum`], N − 1 of them.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let contrast: f64 = Normal(0.0, 2.0).array::<2>().sum_to_zero().ln_density(&[3.0, -3.0]);
/// let difference: f64 = Normal(0.0, 2.0).ln_density(&(6.0 / 2.0f64.sqrt()));
/// assert!((contrast - difference).abs() < 1e-14);
/// ```
///
/// # References
/// Kaufman & Sain (2010), *Bayesian Functional ANOVA Modeling Using Gaussian Process Prior
/// Distributions*, doi:10.1214/10-BA605.
#[derive(Clone, Copy, Debug)]
pub struct SumToZero<A> {
    pub(super) inner: A,
}

impl<A: Family> Family for SumToZero<A> {}

/// How far from 0 the sum of data may be, against their largest.
const TOLERANCE: f64 = 1e-8;

impl<A> SumToZero<A> {
    /// The density of a vector that is known to sum to zero.
    fn total<R: Scalar>(x: &[R], sd: R) -> R {
        let s = sd.value();
        let square = x.iter().map(|x| x.value().powi(2)).sum::<f64>() / (s * s);
        let free = x.len().saturating_sub(1) as f64;
        let value = -0.5 * square - free * (s.ln() + HALF_LN_2PI);
        let in_x = x.iter().map(|&x| (x, -x.value() / (s * s)));
        R::fuse_iter(value, in_x.chain([(sd, (square - free) / s)]))
    }
}

impl<R, A, M, S> Distribution<R> for SumToZero<A>
where
    R: Scalar,
    M: Parameter,
    S: Parameter + Datum<R>,
    A: Repeated<R, Element = Normal<M, S>>,
{
    type Value = A::Values;

    fn ln_density(&self, x: &A::Values) -> R {
        let x = x.as_ref();
        let sum: f64 = x.iter().map(|x| x.value()).sum();
        let largest = x.iter().fold(0.0f64, |m, x| m.max(x.value().abs()));
        if x.len() != self.inner.size() || sum.abs() > TOLERANCE * largest {
            return R::from(f64::NEG_INFINITY);
        }
        Self::total(x, lift(self.inner.element().1))
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("sum_to_zero", "sd", self.inner.element().1.number())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> A::Values {
        let sd = self.inner.element().1.number();
        let mut values = self.inner.zeros();
        let mut next = || R::from(sd * rng.sample::<f64, _>(StandardNormal));
        ZeroSum.constrain(&mut next, values.as_mut());
        values
    }
}

impl<R, A, M, S> Unknown<R> for SumToZero<A>
where
    R: Scalar,
    M: Parameter,
    S: Parameter + Datum<R>,
    A: Repeated<R, Element = Normal<M, S>>,
{
    fn dim(&self) -> usize {
        VectorMap::<R>::dim(&ZeroSum, self.inner.size())
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Terms<R>,
    ) -> A::Values {
        let mut values = self.inner.zeros();
        ZeroSum.constrain(next, values.as_mut());
        terms.add_number(Self::total(values.as_ref(), lift(self.inner.element().1)));
        values
    }

    fn unconstrain(&self, x: &A::Values, out: &mut Vec<f64>) {
        ZeroSum.unconstrain(x.as_ref(), out);
    }
}
