//! Variations that are available for every distribution.

use super::array::Array;
use super::censored::Censored;
use super::iid::Iid;
use super::non_centered::NonCentered;
use super::ordered::Ordered;
use super::truncated::Truncated;
use crate::distribution::family::Family;
use crate::distribution::interval::{Ends, Interval};

/// Variations that are available for every distribution.
pub trait Variations: Family {
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

impl<D: Family> Variations for D {}
