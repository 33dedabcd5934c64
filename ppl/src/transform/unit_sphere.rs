//! Directions.

use super::VectorMap;
use crate::scalar::Scalar;
use crate::special::ln_gamma;

/// Vectors of n numbers and length 1, from n coordinates.
///
/// x = y/|y|. A sphere has no smooth global coordinates, so the length r = |y| comes along as an
/// auxiliary unknown: y is standard normal where x is uniform. In place of a log-Jacobian stands
/// the log density of y against the uniform density of x,
/// −½ r² + ln 2 − (n/2) ln 2 − ln Γ(n/2). The point y = 0 has no direction: NaN, a rejection.
/// A direction goes back to the most probable length, √(n − 1).
///
/// # References
/// Marsaglia (1972), *Choosing a Point from the Surface of a Sphere*,
/// doi:10.1214/aoms/1177692644.
#[derive(Clone, Copy, Debug)]
pub struct UnitSphere;

impl UnitSphere {
    /// ln of the area of the unit sphere in ℝⁿ, 2 π^(n/2)/Γ(n/2).
    pub fn ln_area(n: usize) -> f64 {
        let half = 0.5 * n as f64;
        std::f64::consts::LN_2 + half * std::f64::consts::PI.ln() - ln_gamma(half)
    }

    /// Directions, and the length of y.
    pub(crate) fn direct<R: Scalar>(next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        x.iter_mut().for_each(|x| *x = next());
        let length = x.iter().map(|x| x.value().powi(2)).sum::<f64>().sqrt();
        let radius = R::fuse_iter(length, x.iter().map(|&x| (x, x.value() / length)));
        x.iter_mut().for_each(|x| *x /= radius);
        radius
    }
}

impl<R: Scalar> VectorMap<R> for UnitSphere {
    fn dim(&self, n: usize) -> usize {
        n
    }

    fn constrain(&self, next: &mut impl FnMut() -> R, x: &mut [R]) -> R {
        let half = 0.5 * x.len() as f64;
        let radius = Self::direct(next, x);
        let constant = (1.0 - half) * std::f64::consts::LN_2 - ln_gamma(half);
        radius.square() * -0.5 + constant
    }

    fn unconstrain(&self, x: &[R], out: &mut Vec<f64>) {
        let length = (x.len().max(2) as f64 - 1.0).sqrt();
        out.extend(x.iter().map(|x| length * x.value()));
    }
}
