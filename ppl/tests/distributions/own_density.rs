//! Truncation and censoring of a user-defined `Density`: the log density is written once, for any scalar type, and the
//! distribution functions are added.

use ppl::prelude::*;
use ppl::rand::Rng;
use ppl::{
    Accumulator, Datum, DomainError, Dual, Univariate, UnivariateDensity, transform::Support,
};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::numerics::{KOLMOGOROV_SMIRNOV_LIMIT, assert_close, kolmogorov_smirnov};

/// Kumaraswamy distribution on (0, 1): p(x) = a b xᵃ⁻¹ (1 − xᵃ)ᵇ⁻¹, F(x) = 1 − (1 − xᵃ)ᵇ.
#[derive(Clone, Copy, Debug)]
struct Kumaraswamy<A, B>(A, B);

impl<R, A, B> ppl::Density<R> for Kumaraswamy<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    type Domain = Support<R>;

    fn domain(&self) -> Support<R> {
        Support::Between(R::from(0.0), R::from(1.0))
    }

    fn ln_density(&self, x: &R) -> R {
        let (a, b): (R, R) = (self.0.lift(), self.1.lift());
        let rest = (R::from(1.0) - x.pow(a)).ln();
        a.ln() + b.ln() + (a - 1.0) * x.ln() + (b - 1.0) * rest
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> R {
        R::from(self.sample(rng))
    }
}

impl<A: Parameter, B: Parameter> Univariate for Kumaraswamy<A, B> {
    fn validate(&self) -> Result<(), DomainError> {
        DomainError::require_positive("Kumaraswamy", "a", self.0.number())?;
        DomainError::require_positive("Kumaraswamy", "b", self.1.number())
    }
    fn cdf(&self, x: f64) -> f64 {
        -(self.1.number() * (-x.clamp(0.0, 1.0).powf(self.0.number())).ln_1p()).exp_m1()
    }
    fn sf(&self, x: f64) -> f64 {
        (1.0 - x.clamp(0.0, 1.0).powf(self.0.number())).powf(self.1.number())
    }
    fn quantile(&self, p: f64) -> f64 {
        (-((-p).ln_1p() / self.1.number()).exp_m1()).powf(self.0.number().recip())
    }
    fn upper_quantile(&self, q: f64) -> f64 {
        (-(q.ln() / self.1.number()).exp_m1()).powf(self.0.number().recip())
    }
}

impl<R, A, B> UnivariateDensity<R> for Kumaraswamy<A, B>
where
    R: Scalar,
    A: Parameter + Datum<R>,
    B: Parameter + Datum<R>,
{
    fn support(&self) -> Support<R> {
        ppl::Density::<R>::domain(self)
    }
    fn add_ln_pdf(&self, x: R, terms: &mut impl Accumulator<R>) {
        terms.add_number(ppl::Density::ln_density(self, &x));
    }
}

ppl::univariate!([A: Parameter, B: Parameter] Kumaraswamy<A, B>);

const LOW: f64 = 0.2;
const HIGH: f64 = 0.7;

#[test]
fn the_density_and_its_truncations_conform() {
    use ppl::check::assert_distribution;
    assert_distribution!([a, b] Kumaraswamy(a, b), [1.7, 2.5], [0.1, 0.4, 0.8]);
    assert_distribution!(
        [a, b] Kumaraswamy(a, b).truncate(LOW..HIGH), [1.7, 2.5], [0.25, 0.4, 0.65]);
    assert_distribution!([a, b] Kumaraswamy(a, b).truncate(LOW..), [1.7, 2.5], [0.25, 0.9]);
    assert_distribution!([a, b] Kumaraswamy(a, b).truncate(..HIGH), [0.8, 3.0], [0.05, 0.6]);
}

/// ln S(x) = b ln(1 − xᵃ) with its derivatives with respect to a and b.
fn ln_sf(a: f64, b: f64, x: f64) -> (f64, [f64; 2]) {
    let power = x.powf(a);
    let ln = (1.0 - power).ln();
    (b * ln, [-b * power * x.ln() / (1.0 - power), ln])
}

/// The truncated density is p(x)/(S(low) − S(high)), and the censored masses are F(low) and S(high).
#[test]
fn truncated_and_censored_densities_in_closed_form() {
    let (a, b) = (1.7, 2.5);
    let [first, second] = Dual::<2>::variables([a, b]);
    let own = Kumaraswamy(first, second);
    let [(below, in_below), (above, in_above)] = [ln_sf(a, b, LOW), ln_sf(a, b, HIGH)];
    let mass = below.exp() - above.exp();
    let x = Dual::<2>::from(0.45);
    let density: Dual<2> = own.ln_density(&x);
    let truncated: Dual<2> = own.truncate(LOW..HIGH).ln_density(&x);
    assert_close(truncated.value(), density.value() - mass.ln(), 1e-12, 0.0, "truncated");
    for i in 0..2 {
        let in_mass = (below.exp() * in_below[i] - above.exp() * in_above[i]) / mass;
        let expected = density.gradient()[i] - in_mass;
        assert_close(truncated.gradient()[i], expected, 1e-7, 1e-9, "slope, truncated");
    }
    let outside: f64 = Kumaraswamy(a, b).truncate(LOW..HIGH).ln_density(&0.71);
    assert_eq!(outside, f64::NEG_INFINITY);
    let censored = |x: f64| -> Dual<2> { own.censor(LOW..HIGH).ln_density(&Dual::from(x)) };
    let (low, high, inside) = (censored(LOW), censored(HIGH), censored(0.45));
    assert_close(low.value(), (-below.exp()).ln_1p(), 1e-11, 0.0, "censored below");
    assert_close(high.value(), above, 1e-11, 0.0, "censored above");
    assert_eq!(inside.value(), density.value());
    let odds = -below.exp() / (1.0 - below.exp());
    for i in 0..2 {
        assert_close(low.gradient()[i], odds * in_below[i], 1e-7, 1e-9, "slope, below");
        assert_close(high.gradient()[i], in_above[i], 1e-7, 1e-9, "slope, above");
    }
}

#[test]
fn draws_of_a_truncated_density_follow_its_distribution_function() {
    let truncated = Kumaraswamy(1.7, 2.5).truncate(LOW..HIGH);
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let mut draws: Vec<f64> =
        (0..20_000).map(|_| Distribution::<f64>::draw(&truncated, &mut rng)).collect();
    draws.sort_by(f64::total_cmp);
    assert!(LOW < draws[0] && draws[draws.len() - 1] < HIGH);
    let survival = |x: f64| ln_sf(1.7, 2.5, x).0.exp();
    let (below, above) = (survival(LOW), survival(HIGH));
    let statistic = kolmogorov_smirnov(&draws, |x| (below - survival(x)) / (below - above));
    assert!(statistic < KOLMOGOROV_SMIRNOV_LIMIT, "{statistic}");
}

ppl::model! {
    fn shares(whole: &[f64], cut: &[f64], read: &[f64]) {
        let a ~ LogNormal(0.5, 0.5);
        let b ~ Kumaraswamy(2.0, 2.0).truncate(0.1..0.9);
        for x in whole {
            x ~ Kumaraswamy(a, 3.0 * b);
        }
        for part in cut {
            part ~ Kumaraswamy(a, 3.0 * b).truncate(0.2..0.7);
        }
        for reading in read {
            reading ~ Kumaraswamy(a, 3.0 * b).censor(0.2..0.7);
        }
    }
}

#[test]
fn gradients_of_a_model_with_truncation_and_censoring() {
    let model = shares(&[0.3, 0.9], &[0.25, 0.5], &[0.4, 0.2, 0.7]);
    ppl::check::gradient(&model, 7);
    let bounds = Unknown::<f64>::bounds(&Kumaraswamy(2.0, 2.0).truncate(0.1..0.9));
    assert_eq!(bounds, Some((0.1, 0.9)));
}
