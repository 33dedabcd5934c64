//! Non-centred parametrisation of unknowns.

use rand::Rng;

use crate::density::DomainError;
use crate::distribution::continuous::{LogNormal, Normal, StudentT};
use crate::distribution::family::{Array, Family, NonCentered};
use crate::distribution::multivariate::{CholeskyFactor, MatrixEntry, MvNormalCholesky};
use crate::distribution::traits::{Distribution, Unknown, lift};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::accumulator::{Accumulator, Joined};
use crate::term::parameter::Parameter;

/// Location-scale family: x = T(z), where the distribution of z has no unknown location or scale.
///
/// | distribution | z | x |
/// |---|---|---|
/// | `Normal(μ, σ)` | `Normal(0, 1)` | μ + σ z |
/// | `StudentT(ν, μ, σ)` | `StudentT(ν, 0, 1)` | μ + σ z |
/// | `LogNormal(μ, σ)` | `LogNormal(0, 1)` | e^μ z^σ |
/// | `MvNormalCholesky(μ, L)` | `Normal(0, 1).array()` | μ + L z |
#[diagnostic::on_unimplemented(
    message = "`{Self}` has no non-centred form",
    note = "`.non_centered()` is for distributions with a location or a scale, and comes before \
            `.iid(n)` and `.array::<N>()`"
)]
pub trait LocationScale<R: Scalar>: Unknown<R> {
    /// Type of the distribution of the standardised value z.
    type Standard: Unknown<R, Value = Self::Value>;

    /// Distribution of the standardised value z.
    fn standard(&self) -> Self::Standard;

    /// Map x = T(z).
    fn stretch(&self, z: &Self::Value) -> Self::Value;

    /// Inverse map z = T⁻¹(x).
    fn standardised(&self, x: &Self::Value) -> Self::Value;
}

impl<D: Family> Family for NonCentered<D> {}

impl<R: Scalar, D: LocationScale<R>> Distribution<R> for NonCentered<D> {
    type Value = D::Value;

    #[inline(always)]
    fn add_terms(&self, x: &D::Value, terms: &mut impl Accumulator<R>) {
        self.inner.add_terms(x, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.inner.validate()
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> D::Value {
        self.inner.draw(rng)
    }
}

impl<R: Scalar, D: LocationScale<R>> Unknown<R> for NonCentered<D> {
    fn dim(&self) -> usize {
        self.inner.dim()
    }

    #[inline]
    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> D::Value {
        let standard = self.inner.standard();
        if jacobian {
            return self.inner.stretch(&standard.constrain(next, jacobian, terms));
        }
        // if `jacobian` is false, the result is the density of x, so that the density terms of z are discarded
        let (z, _) = Joined::with(|terms| standard.constrain(next, jacobian, terms));
        let x = self.inner.stretch(&z);
        self.inner.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &D::Value, out: &mut Vec<f64>) {
        self.inner.standard().unconstrain(&self.inner.standardised(x), out);
    }
}

/// Implements `LocationScale` for a univariate family, from its standard distribution, the map T and the inverse of T.
macro_rules! impl_location_scale {
    ($([$($P:ident),*] $Name:ty => $Standard:ty {
        |$this:pat_param| $standard:expr, |$d:ident, $z:ident| $x:expr, |$v:ident| $back:expr
    })*) => {$(
        impl<R, $($P),*> LocationScale<R> for $Name
        where
            R: Scalar,
            $($P: Parameter + Datum<R>,)*
        {
            type Standard = $Standard;

            #[inline]
            fn standard(&self) -> $Standard {
                let $this = self;
                $standard
            }

            #[inline]
            fn stretch(&self, z: &R) -> R {
                let ($d, $z) = (self, *z);
                $x
            }

            fn standardised(&self, x: &R) -> R {
                let ($d, $v) = (self, *x);
                $back
            }
        }
    )*};
}

impl_location_scale! {
    [M, S] Normal<M, S> => Normal<f64, f64> {
        |_| Normal(0.0, 1.0),
        |d, z| lift(d.0) + lift::<R>(d.1) * z,
        |x| (x - lift::<R>(d.0)) / lift::<R>(d.1)
    }
    [N, M, S] StudentT<N, M, S> => StudentT<N, f64, f64> {
        |d| StudentT(d.0, 0.0, 1.0),
        |d, z| lift(d.1) + lift::<R>(d.2) * z,
        |x| (x - lift::<R>(d.1)) / lift::<R>(d.2)
    }
    [M, S] LogNormal<M, S> => LogNormal<f64, f64> {
        |_| LogNormal(0.0, 1.0),
        |d, z| (lift(d.0) + lift::<R>(d.1) * z.ln()).exp(),
        |x| ((x.ln() - lift::<R>(d.0)) / lift::<R>(d.1)).exp()
    }
}

impl<R, M, T, const K: usize> LocationScale<R> for MvNormalCholesky<M, CholeskyFactor<T, K>>
where
    R: Scalar,
    M: Datum<[R; K]> + Clone,
    T: Datum<R> + MatrixEntry,
{
    type Standard = Array<Normal<f64, f64>, K>;

    #[inline]
    fn standard(&self) -> Self::Standard {
        Normal(0.0, 1.0).array()
    }

    #[inline]
    fn stretch(&self, z: &[R; K]) -> [R; K] {
        let factor: CholeskyFactor<R, K> = self.1.lift();
        factor.times_and(z, &self.0.lift())
    }

    fn standardised(&self, x: &[R; K]) -> [R; K] {
        let factor: CholeskyFactor<R, K> = self.1.lift();
        let mean = self.0.lift();
        factor.solve_lower(std::array::from_fn::<R, K, _>(|k| x[k] - mean[k]))
    }
}
