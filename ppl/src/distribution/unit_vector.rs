//! Directions.

use rand::Rng;
use rand_distr::StandardNormal;

use super::{Distribution, Family, Unknown};
use crate::density::DomainError;
use crate::scalar::Scalar;
use crate::special::{HALF_LN_2PI, ln_gamma};
use crate::terms::Terms;
use crate::transform::{UnitSphere, VectorMap};

/// The uniform distribution of directions: vectors of N ≥ 2 numbers with length 1.
///
/// p(x) = Γ(N/2)/(2 π^(N/2)), one over the area of the sphere.
///
/// The coordinates are those of [`UnitSphere`], N of them: a standard normal vector, whose
/// length is an auxiliary unknown with a chi distribution. Readings over constrained values
/// count that distribution too, since the length needs one.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let ln_density: f64 = UnitVector::<3>.ln_density(&[0.6, 0.0, -0.8]);
/// assert!((ln_density + (4.0 * std::f64::consts::PI).ln()).abs() < 1e-14);
/// ```
///
/// # References
/// Mardia & Jupp (2000), *Directional Statistics*, ch. 9.
#[derive(Clone, Copy, Debug)]
pub struct UnitVector<const N: usize>;

impl<const N: usize> Family for UnitVector<N> {}

/// How far from 1 the length of data may be.
const TOLERANCE: f64 = 1e-8;

impl<R: Scalar, const N: usize> Distribution<R> for UnitVector<N> {
    type Value = [R; N];

    fn ln_density(&self, x: &[R; N]) -> R {
        let square: f64 = x.iter().map(|x| x.value().powi(2)).sum();
        let on_sphere = (square - 1.0).abs() <= TOLERANCE;
        R::from(if on_sphere { -UnitSphere::ln_area(N) } else { f64::NEG_INFINITY })
    }

    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require(N >= 2, "UnitVector", "dimension", "at least 2", N)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> [R; N] {
        let mut x = [R::from(0.0); N];
        UnitSphere.constrain(&mut || R::from(rng.sample::<f64, _>(StandardNormal)), &mut x);
        x
    }
}

impl<R: Scalar, const N: usize> Unknown<R> for UnitVector<N> {
    fn dim(&self) -> usize {
        N
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Terms<R>,
    ) -> [R; N] {
        let mut x = [R::from(0.0); N];
        let radius = UnitSphere::direct(next, &mut x);
        let half = 0.5 * N as f64;
        terms.add_number(if jacobian {
            radius.square() * -0.5 - N as f64 * HALF_LN_2PI
        } else {
            // uniform direction, chi length
            let ln_chi = (1.0 - half) * std::f64::consts::LN_2 - ln_gamma(half);
            radius.square() * -0.5
                + radius.ln() * (N as f64 - 1.0)
                + (ln_chi - UnitSphere::ln_area(N))
        });
        x
    }

    fn unconstrain(&self, x: &[R; N], out: &mut Vec<f64>) {
        UnitSphere.unconstrain(x, out);
    }
}
