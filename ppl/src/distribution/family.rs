//! Variations that are available for every distribution.

use super::interval::{Ends, Interval};

/// Variations that are available for every distribution.
pub trait Family: Sized + Clone {
    /// The distribution truncated to an interval: `Normal(0.0, 1.0).truncate(0.0..)`.
    ///
    /// The bounds must be data. Either bound can be omitted.
    fn truncate(self, range: impl Ends) -> Truncated<Self> {
        Truncated { inner: self, interval: Interval::new(range) }
    }

    /// The distribution of a measurement with a limited range: `Weibull(2.0, 50.0).censor(..100.0)` treats data at or
    /// beyond 100 as "at least 100".
    ///
    /// The bounds must be data.
    fn censor(self, range: impl Ends) -> Censored<Self> {
        Censored { inner: self, interval: Interval::new(range) }
    }

    /// The distribution in non-centred parametrisation, for unknowns whose location or scale is unknown:
    /// `Normal(mu, tau).non_centered()`; see [`NonCentered`].
    fn non_centered(self) -> NonCentered<Self> {
        NonCentered { inner: self }
    }

    /// The distribution of a vector of `n` independent values, for lengths known at run time.
    fn iid(self, n: usize) -> Iid<Self> {
        Iid { inner: self, n }
    }

    /// The distribution of an array of `N` independent values, for lengths known at compile time.
    fn array<const N: usize>(self) -> Array<Self, N> {
        Array { inner: self }
    }

    /// The distribution of independent values, sorted in ascending order: `Normal(0.0, 5.0).array::<4>().ordered()`.
    fn ordered(self) -> Ordered<Self> {
        Ordered { inner: self }
    }
}

/// A univariate distribution truncated to an interval; created by [`Family::truncate`].
///
/// ln p(x) = ln p₀(x) − ln P₀(X ∈ interval). The density includes the normalising constant and its derivatives with
/// respect to the parameters.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let sd = Normal(0.15, 0.25).truncate(0.0..);
/// assert!((sd.mean() - 0.2648).abs() < 1e-4);
/// assert_eq!(sd.ln_density(&-0.1), f64::NEG_INFINITY);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Truncated<D> {
    pub(super) inner: D,
    pub(super) interval: Interval,
}

/// A univariate distribution censored at the limits `lower` and `upper`; created by [`Family::censor`]. The
/// distribution is for observed data; it cannot be the prior of an unknown.
///
/// A datum between the limits contributes its log density. A datum at or below the lower limit contributes ln P(X ≤
/// lower), a datum at or above the upper limit ln P(X ≥ upper). This covers left censoring, right censoring and both at
/// once. A draw beyond a limit is replaced by the limit.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// // a test that ends after 100 hours: a part that still works at the end has a life of more than 100 hours
/// let life_h = Exponential(0.01).censor(..100.0);
/// let broke: f64 = life_h.ln_density(&40.0);
/// let survived: f64 = life_h.ln_density(&100.0);
/// assert!((broke - (0.01f64.ln() - 0.4)).abs() < 1e-14);
/// assert!((survived + 1.0).abs() < 1e-14);
/// ```
///
/// # References
/// Gelman et al. (2013), *Bayesian Data Analysis*, 3rd ed., section 8.7.
#[derive(Clone, Copy, Debug)]
pub struct Censored<D> {
    pub(super) inner: D,
    pub(super) interval: Interval,
}

/// A distribution in non-centred parametrisation; created by [`Family::non_centered`].
///
/// The distribution of x is unchanged. An unknown x = T(z) with this prior has the unconstrained coordinates of the
/// standardised value z, see [`LocationScale`](super::LocationScale). The prior density of these coordinates does not
/// depend on location and scale. If the scale is unknown and the data inform the elements weakly, the non-centred
/// parametrisation avoids the funnel-shaped posterior of the centred parametrisation, which samplers explore poorly.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     fn schools(effects: &[f64; 8], errors: &[f64; 8]) {
///         let mu ~ Normal(0.0, 5.0);
///         let tau ~ HalfCauchy(5.0);
///         let theta ~ Normal(mu, tau).non_centered().array::<8>();
///         for j in 0..8 {
///             effects[j] ~ Normal(theta[j], errors[j]);
///         }
///     }
/// }
/// let model = schools(&[28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0], &[10.0; 8]);
/// assert_eq!(model.layout()?.dim, 10);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// Papaspiliopoulos, Roberts & Sköld (2007), Statistical Science 22(1), 59–73,
/// doi:10.1214/088342307000000014.
#[derive(Clone, Copy, Debug)]
pub struct NonCentered<D> {
    pub(super) inner: D,
}

/// Distribution of a vector of `n` independent values with the same distribution; created by [`Family::iid`].
///
/// Observed data with another length have density zero.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let heads: f64 = Bernoulli(0.5).iid(3).ln_density(&vec![true, false, true]);
/// assert_eq!(heads, 3.0 * 0.5f64.ln());
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Iid<D> {
    pub(super) inner: D,
    pub(super) n: usize,
}

/// Distribution of an array of `N` independent values with the same distribution; created by [`Family::array`].
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let pair: f64 = Normal(0.0, 1.0).array::<2>().ln_density(&[0.5, -1.0]);
/// let [a, b]: [f64; 2] = [0.5, -1.0].map(|x| Normal(0.0, 1.0).ln_density(&x));
/// assert_eq!(pair, a + b);
/// ```
#[derive(Clone, Copy, Debug)]
pub struct Array<D, const N: usize> {
    pub(super) inner: D,
}

/// Distribution of N independent values, sorted in ascending order; created by [`Family::ordered`].
///
/// p(x) = N! Π p₀(xᵢ) for x₁ ≤ x₂ ≤ … ≤ x_N. This is the density of the order statistics, which integrates to 1 over
/// ordered vectors. The values are positive if the elements are positive. With elements `Uniform(a, b)`, the density is
/// uniform over the ordered vectors between a and b.
///
/// [`Ascending`](crate::transform::Ascending) documents the unconstrained coordinates.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let modes = Normal(0.0, 5.0).array::<2>().ordered();
/// let joint: f64 = modes.ln_density(&[-1.0, 2.0]);
/// let apart: f64 = Normal(0.0, 5.0).array::<2>().ln_density(&[-1.0, 2.0]);
/// assert!((joint - apart - 2.0f64.ln()).abs() < 1e-14);
/// assert_eq!(modes.ln_density(&[2.0, -1.0]), f64::NEG_INFINITY);
/// ```
///
/// # References
/// David & Nagaraja (2003), *Order Statistics*, ch. 2.
#[derive(Clone, Copy, Debug)]
pub struct Ordered<A> {
    pub(super) inner: A,
}
