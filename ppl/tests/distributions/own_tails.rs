//! User-defined families without methods for probabilities: probabilities of intervals and their derivatives are
//! computed by quadrature.

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::{
    Accumulator, Datum, DomainError, Dual, Univariate, UnivariateDensity, transform::Support,
};

use crate::numerics::assert_close;

/// Laplace distribution, whose density has a kink at the location.
#[derive(Clone, Copy, Debug)]
struct Laplace<M, S>(M, S);

ppl::univariate!([M: Parameter, S: Parameter] Laplace<M, S>);

impl<M: Parameter, S: Parameter> Laplace<M, S> {
    fn standardise(&self, x: f64) -> f64 {
        (x - self.0.number()) / self.1.number()
    }

    fn below(z: f64) -> f64 {
        if z < 0.0 { 0.5 * z.exp() } else { 1.0 - 0.5 * (-z).exp() }
    }

    fn distance(p: f64) -> f64 {
        if p < 0.5 { (2.0 * p).ln() } else { -(2.0 * (1.0 - p)).ln() }
    }
}

impl<M: Parameter, S: Parameter> Univariate for Laplace<M, S> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Laplace", "scale", self.1.number())
    }
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }
    fn mean(&self) -> f64 {
        self.0.number()
    }
    fn variance(&self) -> f64 {
        2.0 * self.1.number().powi(2)
    }
    fn cdf(&self, x: f64) -> f64 {
        Self::below(self.standardise(x))
    }
    fn sf(&self, x: f64) -> f64 {
        Self::below(-self.standardise(x))
    }
    fn quantile(&self, p: f64) -> f64 {
        self.0.number() + self.1.number() * Self::distance(p)
    }
    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() - self.1.number() * Self::distance(q)
    }
}

impl<R, M, S> UnivariateDensity<R> for Laplace<M, S>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    S: Parameter + Datum<R>,
{
    fn support(&self) -> Support<R> {
        Support::Real
    }
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (z, scale) = (self.standardise(x.value()), self.1.number());
        let slope = z.signum() / scale;
        terms.add(
            -z.abs() - (2.0 * scale).ln(),
            ((x, -slope), (self.0, slope), (self.1, (z.abs() - 1.0) / scale)),
        );
    }
}

/// Pareto distribution with unknown minimum, so that the support depends on an unknown.
#[derive(Clone, Copy, Debug)]
struct Pareto<M, A>(M, A);

ppl::univariate!([M: Parameter, A: Parameter] Pareto<M, A>);

impl<M: Parameter, A: Parameter> Univariate for Pareto<M, A> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Pareto", "minimum", self.0.number())
    }
    fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
        self.quantile(rng.random())
    }
    fn mean(&self) -> f64 {
        let (least, a) = (self.0.number(), self.1.number());
        if a > 1.0 { a * least / (a - 1.0) } else { f64::INFINITY }
    }
    fn variance(&self) -> f64 {
        let (least, a) = (self.0.number(), self.1.number());
        if a > 2.0 { least.powi(2) * a / ((a - 1.0).powi(2) * (a - 2.0)) } else { f64::INFINITY }
    }
    fn cdf(&self, x: f64) -> f64 {
        -(-self.1.number() * (x / self.0.number()).max(1.0).ln()).exp_m1()
    }
    fn sf(&self, x: f64) -> f64 {
        (x / self.0.number()).max(1.0).powf(-self.1.number())
    }
    fn quantile(&self, p: f64) -> f64 {
        self.0.number() * (-(-p).ln_1p() / self.1.number()).exp()
    }
    fn upper_quantile(&self, q: f64) -> f64 {
        self.0.number() * q.powf(-self.1.number().recip())
    }
}

impl<R, M, A> UnivariateDensity<R> for Pareto<M, A>
where
    R: Scalar,
    M: Parameter + Datum<R>,
    A: Parameter + Datum<R>,
{
    fn support(&self) -> Support<R> {
        Support::Above(self.0.lift())
    }
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let (least, a, x_value) = (self.0.number(), self.1.number(), x.value());
        let ratio = (least / x_value).ln();
        terms.add(
            a.ln() - x_value.ln() + a * ratio,
            ((x, -(a + 1.0) / x_value), (self.0, a / least), (self.1, a.recip() + ratio)),
        );
    }
}

/// User-defined family with the density of a family of the library, but without its methods with derivatives.
macro_rules! copy_of {
    ($Own:ident, $Family:ident, $support:expr) => {
        #[derive(Clone, Copy, Debug)]
        struct $Own<A, B>(A, B);

        ppl::univariate!([A: Parameter, B: Parameter] $Own<A, B>);

        impl<A: Parameter, B: Parameter> $Own<A, B> {
            fn plain(&self) -> $Family<f64, f64> {
                $Family(self.0.number(), self.1.number())
            }
        }

        impl<A: Parameter, B: Parameter> Univariate for $Own<A, B> {
            fn validate(&self) -> Result<(), DomainError> {
                Univariate::validate(&self.plain())
            }
            fn sample<G: Rng + ?Sized>(&self, rng: &mut G) -> f64 {
                self.plain().sample(rng)
            }
            fn mean(&self) -> f64 {
                self.plain().mean()
            }
            fn variance(&self) -> f64 {
                self.plain().variance()
            }
            fn cdf(&self, x: f64) -> f64 {
                self.plain().cdf(x)
            }
            fn sf(&self, x: f64) -> f64 {
                self.plain().sf(x)
            }
            fn quantile(&self, p: f64) -> f64 {
                self.plain().quantile(p)
            }
            fn upper_quantile(&self, q: f64) -> f64 {
                self.plain().upper_quantile(q)
            }
        }

        impl<R, A, B> UnivariateDensity<R> for $Own<A, B>
        where
            R: Scalar,
            A: Parameter + Datum<R>,
            B: Parameter + Datum<R>,
        {
            fn support(&self) -> Support<R> {
                $support
            }
            fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
                $Family(self.0, self.1).add_ln_pdf(x, terms);
            }
        }
    };
}
copy_of!(OwnGamma, Gamma, Support::Above(R::from(0.0)));
copy_of!(OwnBeta, Beta, Support::Between(R::from(0.0), R::from(1.0)));

#[test]
fn correct_families_are_accepted() {
    ppl::check::assert_distribution!(
        [m, s] Laplace(m, s), [0.3, 2.0], [-1.0, 0.5, 6.0], corner 0.3);
    ppl::check::assert_distribution!([m, a] Pareto(m, a), [1.5, 0.7], [2.0, 30.0]);
    ppl::check::assert_distribution!([m, a] Pareto(m, a), [1.5, 3.5], [2.0, 3.0]);
    ppl::check::assert_distribution!([a, b] OwnGamma(a, b), [0.3, 2.0], [0.1, 0.8]);
    ppl::check::assert_distribution!([a, b] OwnGamma(a, b), [30.0, 1.0], [22.0, 31.5]);
    ppl::check::assert_distribution!([a, b] OwnBeta(a, b), [0.4, 3.0], [0.05, 0.3]);
}

type D = Dual<2>;

#[track_caller]
fn assert_mass(got: D, value: f64, slopes: [f64; 2], what: &str) {
    assert_close(got.value(), value, 1e-13, 1e-15, what);
    for (i, expected) in slopes.into_iter().enumerate() {
        assert_close(got.gradient()[i], expected, 1e-7, 1e-14, &format!("∂{i} of {what}"));
    }
}

/// Three cases: `sf` has underflowed, a kink lies inside the interval, and the lower end of the support depends on an
/// unknown.
#[test]
fn masses_of_own_families_are_those_of_closed_forms() {
    let [m, s] = D::variables([0.3, 2.0]);
    for x in [40.0, 4000.0] {
        let z = (x - 0.3) / 2.0;
        let tail: D = Laplace(m, s).ln_sf(x);
        assert_mass(tail, -z - 2f64.ln(), [0.5, 0.5 * z], &format!("Laplace beyond {x}"));
    }
    let (z, tail) = (0.35f64, 0.5 * (-0.35f64).exp());
    let below: D = Laplace(m, s).ln_cdf(1.0);
    let slope = -0.5 * tail / (1.0 - tail);
    assert_mass(below, (-tail).ln_1p(), [slope, z * slope], "Laplace below 1");

    let [least, a] = D::variables([1.5, 0.1]);
    let ln_ratio = (1.5f64 / 1e9).ln();
    let above: D = Pareto(least, a).ln_sf(1e9);
    assert_mass(above, 0.1 * ln_ratio, [0.1 / 1.5, ln_ratio], "Pareto beyond 1e9");
    let tail = (0.1 * ln_ratio).exp();
    let odds = tail / (1.0 - tail);
    let below: D = Pareto(least, a).ln_cdf(1e9);
    assert_mass(below, (-tail).ln_1p(), [-odds * 0.1 / 1.5, -odds * ln_ratio], "Pareto below 1e9");
}

/// Compares the quadrature with the series and continued fractions of the library's families.
#[test]
fn quadrature_agrees_with_the_incomplete_functions() {
    for (a, b, lower, upper) in [
        (3.0, 1.0, 2000.0, f64::INFINITY),
        (3.0, 1.0, 0.0, 5.0),
        (0.2, 2.0, 0.0, 0.3),
        (400.0, 0.5, 700.0, 790.0),
        (3.0, 0.2, 1.0, 1.0001),
    ] {
        let [a, b] = D::variables([a, b]);
        let expected: D = Gamma(a, b).ln_mass(lower, upper);
        let got: D = OwnGamma(a, b).ln_mass(lower, upper);
        assert_mass(got, expected.value(), expected.gradient(), "Gamma");
    }
    for (a, b, lower, upper) in
        [(2.0, 3.0, 0.2, 0.9), (0.3, 40.0, 0.0, 1e-3), (5.0, 0.8, 0.4, 0.99)]
    {
        let [a, b] = D::variables([a, b]);
        let expected: D = Beta(a, b).ln_mass(lower, upper);
        let got: D = OwnBeta(a, b).ln_mass(lower, upper);
        assert_mass(got, expected.value(), expected.gradient(), "Beta");
    }
}

/// Standard logistic distribution. The formula of the density is ∞ − ∞ at x = −∞.
#[derive(Clone, Copy, Debug)]
struct Logistic;

ppl::univariate!([] Logistic);

impl Univariate for Logistic {
    fn validate(&self) -> Result<(), DomainError> {
        Ok(())
    }
    fn mean(&self) -> f64 {
        0.0
    }
    fn variance(&self) -> f64 {
        std::f64::consts::PI.powi(2) / 3.0
    }
    fn cdf(&self, x: f64) -> f64 {
        (1.0 + (-x).exp()).recip()
    }
    fn sf(&self, x: f64) -> f64 {
        (1.0 + x.exp()).recip()
    }
    fn quantile(&self, p: f64) -> f64 {
        (p / (1.0 - p)).ln()
    }
    fn upper_quantile(&self, q: f64) -> f64 {
        ((1.0 - q) / q).ln()
    }
}

impl<R: Scalar> UnivariateDensity<R> for Logistic {
    fn support(&self) -> Support<R> {
        Support::Real
    }
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        let z = x.value();
        let power = (-z).exp();
        terms.add(-z - 2.0 * power.ln_1p(), ((x, 2.0 * power / (1.0 + power) - 1.0),));
    }
}

#[test]
#[should_panic(expected = "log density at -inf")]
fn a_density_that_is_nan_at_infinity_is_found() {
    ppl::check::assert_distribution!([] Logistic, [0.0; 0], [-1.0, 0.5]);
}
