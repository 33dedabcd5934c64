//! The von Mises distribution.

use std::f64::consts::PI;

use rand::Rng;

use super::{Parameter, Univariate, UnivariateDensity, lift};
use crate::density::DomainError;
use crate::record::Datum;
use crate::scalar::{Scalar, logistic};
use crate::special::{
    HALF_LN_2PI, Tail, integral_from_zero, ln_bessel_i0_scaled, one_minus_bessel_ratio,
    tail_quantile,
};
use crate::terms::{Joined, Terms};
use crate::transform::Support;

/// Von Mises distribution of an angle in (−π, π), with mean direction μ and concentration κ.
///
/// ln p(x) = κ cos(x − μ) − ln 2π − ln I₀(κ), for −π ≤ x ≤ π and κ > 0. Mean and variance are
/// those of the number x, not of the direction; they and the distribution functions are computed
/// by quadrature. Bring angles into the interval before you observe them.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let heading = VonMises(0.5, 4.0);
/// let (at_mode, opposite): (f64, f64) =
///     (heading.ln_density(&0.5), heading.ln_density(&(0.5 - std::f64::consts::PI)));
/// assert!((at_mode - opposite - 8.0).abs() < 1e-14);
/// ```
///
/// # References
/// Mardia & Jupp (2000), *Directional Statistics*, section 3.5.4; draws: Best & Fisher (1979),
/// doi:10.2307/2346732.
#[derive(Clone, Copy, Debug)]
pub struct VonMises<M, K>(pub M, pub K);

crate::univariate!([M: Parameter, K: Parameter] VonMises<M, K>);

/// The angle in [−π, π] of the same direction.
fn wrap(angle: f64) -> f64 {
    if (-PI..=PI).contains(&angle) {
        angle
    } else {
        angle - 2.0 * PI * (angle / (2.0 * PI)).round()
    }
}

/// ln p at the angle θ from the mean direction; κ (cos θ − 1) keeps its digits as −2κ sin²(θ/2).
#[inline]
fn standard(angle: f64, concentration: f64) -> f64 {
    let sine = (0.5 * angle).sin();
    -2.0 * concentration * sine * sine - 2.0 * HALF_LN_2PI - ln_bessel_i0_scaled(concentration)
}

impl<M: Parameter, K: Parameter> VonMises<M, K> {
    /// ∫ g p over a part of (−π, π), piece by piece between mode and antimode, where p is
    /// monotone.
    fn integral(&self, lower: f64, upper: f64, g: impl Fn(f64) -> f64) -> f64 {
        let (mode, concentration) = (wrap(self.0.number()), self.1.number());
        let antimode = if mode > 0.0 { mode - PI } else { mode + PI };
        let normaliser = standard(0.0, concentration);
        let mut ends = [lower, mode.clamp(lower, upper), antimode.clamp(lower, upper), upper];
        ends.sort_by(f64::total_cmp);
        let piece = |a: f64, b: f64| {
            // measured from the end where the density is larger
            let from_a = (a - mode).cos() > (b - mode).cos();
            let (near, direction) = if from_a { (a, 1.0) } else { (b, -1.0) };
            let density = |d: f64| {
                let x = near + direction * d;
                let sine = (0.5 * (x - mode)).sin();
                (-2.0 * concentration * sine * sine + normaliser).exp() * g(x)
            };
            if b > a { integral_from_zero(density, b - a, 1.0) } else { 0.0 }
        };
        ends.windows(2).map(|pair| piece(pair[0], pair[1])).sum()
    }

    /// P(X ≤ x) and P(X > x), the smaller one without cancellation.
    fn tails(&self, x: f64) -> (f64, f64) {
        let x = x.clamp(-PI, PI);
        let below = self.integral(-PI, x, |_| 1.0);
        if below <= 0.5 {
            return (below, 1.0 - below);
        }
        let above = self.integral(x, PI, |_| 1.0);
        (1.0 - above, above)
    }

    fn invert(&self, p: f64, tail: Tail) -> f64 {
        let (mode, concentration) = (wrap(self.0.number()), self.1.number());
        let angle = |y: f64| {
            let (p, q) = logistic(y);
            if y < 0.0 { -PI + 2.0 * PI * p } else { PI - 2.0 * PI * q }
        };
        let start = ((PI + mode) / (PI - mode)).ln().clamp(-30.0, 30.0);
        let y = tail_quantile(start, p, tail, |y| {
            let x = angle(y);
            let (below, above) = self.tails(x);
            let (p, q) = logistic(y);
            (below, above, standard(x - mode, concentration).exp() * 2.0 * PI * p * q)
        });
        angle(y)
    }
}

impl<M: Parameter, K: Parameter> Univariate for VonMises<M, K> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_finite("VonMises", "mean direction", self.0.number())?;
        DomainError::require_positive("VonMises", "concentration", self.1.number())
    }

    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        let k = self.1.number();
        // the wrapped Cauchy envelope whose parameter is ρ; s = (1 + ρ²)/2ρ
        let tau = 1.0 + (1.0 + 4.0 * k * k).sqrt();
        let rho = (tau - (2.0 * tau).sqrt()) / (2.0 * k);
        let s = if k < 1e-5 { k.recip() + k } else { (1.0 + rho * rho) / (2.0 * rho) };
        loop {
            let z = (PI * rng.random::<f64>()).cos();
            let cosine = (1.0 + s * z) / (s + z);
            let c = k * (s - cosine);
            // u is 0 with probability 2⁻⁵³, and is then accepted
            let u: f64 = rng.random();
            if c * (2.0 - c) > u || (c / u).ln() + 1.0 >= c {
                let angle = cosine.clamp(-1.0, 1.0).acos();
                let sign = if rng.random() { 1.0 } else { -1.0 };
                return wrap(self.0.number() + sign * angle);
            }
            if c.is_nan() {
                return f64::NAN;
            }
        }
    }

    fn mean(&self) -> f64 {
        self.integral(-PI, PI, |x| x)
    }

    fn variance(&self) -> f64 {
        let mean = self.mean();
        self.integral(-PI, PI, |x| (x - mean).powi(2))
    }

    fn cdf(&self, x: f64) -> f64 {
        self.tails(x).0
    }

    fn sf(&self, x: f64) -> f64 {
        self.tails(x).1
    }

    fn quantile(&self, p: f64) -> f64 {
        self.invert(p, Tail::Lower)
    }

    fn upper_quantile(&self, q: f64) -> f64 {
        self.invert(q, Tail::Upper)
    }
}

impl<R, M, K> UnivariateDensity<R> for VonMises<M, K>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    K: Parameter + Datum<R>,
{
    const NATURAL_ENDS: bool = true;

    #[inline]
    fn support(&self) -> Support<R> {
        Support::Between(R::from(-PI), R::from(PI))
    }

    #[inline]
    fn ln_pdf(&self, x: R) -> R {
        Joined::of(|terms| self.add_ln_pdf(x, terms))
    }

    #[inline(always)]
    fn add_ln_pdf(&self, x: R, terms: &mut impl Terms<R>) {
        let concentration = self.1.number();
        let angle = x.value() - self.0.number();
        let in_x = -concentration * angle.sin();
        let unknown = lift::<R>(self.1);
        let in_concentration = if unknown.is_constant() {
            0.0
        } else {
            let sine = (0.5 * angle).sin();
            one_minus_bessel_ratio(concentration) - 2.0 * sine * sine
        };
        terms.add(
            standard(angle, concentration),
            ((x, in_x), (self.0, -in_x), (unknown, in_concentration)),
        );
    }
}
