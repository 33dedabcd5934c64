//! Priors against closed forms, quadrature and the uniform distribution of `ppl`.

use ppl::check::{assert_distribution, gradient};
use ppl::{Nuts, Workspace};
use surrogate::DynPce;

use super::*;
use crate::fracture::{Evidence, calibrate};

/// A prior of each family, with a range that cuts off a part of both tails.
fn priors() -> [Prior; 10] {
    use PriorFamily::*;
    [
        Prior::uniform(250.0, 300.0),
        Prior::new(Normal, &[0.3, 0.1]).within(0.1, 0.45),
        Prior::new(LogNormal, &[280.0, 1.1]).within(200.0, 400.0),
        Prior::new(Gamma, &[4.0, 10.0]).within(0.05, 1.5),
        Prior::new(Beta, &[2.0, 6.0]).within(0.05, 0.8),
        Prior::new(StudentT, &[4.0, 280.0, 10.0]).within(220.0, 330.0),
        Prior::new(Exponential, &[0.5]).within(0.1, 8.0),
        Prior::new(Weibull, &[12.0, 340.0]).within(200.0, 400.0),
        Prior::new(InverseGamma, &[3.0, 4.0]).within(0.3, 9.0),
        Prior::new(Triangular, &[250.0, 270.0, 300.0]).within(252.0, 298.0),
    ]
}

/// Sampled parameters of a prior: none.
const NONE: [f64; 0] = [];

/// Priors integrate to 1 over their range, and moments, distribution functions, draws, transform and derivatives agree.
#[test]
fn truncated_priors_are_distributions() {
    for prior in priors() {
        let [lower, upper] = prior.range();
        let points = [0.1, 0.25, 0.8].map(|p| lower + p * (upper - lower));
        match prior.family() {
            PriorFamily::Triangular => assert_distribution!([] prior, NONE, points, corner 270.0),
            _ => assert_distribution!([] prior, NONE, points),
        }
        assert_eq!((prior.cdf(lower), prior.sf(upper)), (0.0, 0.0), "{prior}");
        assert_eq!(Unknown::<f64>::bounds(&prior), Some((lower, upper)));
    }
}

/// The default range excludes a probability of 0.002. ln 1.1 is the standard deviation of the logarithm, and 3.0902 is
/// the 99.9 % quantile of the standard normal distribution.
#[test]
fn the_range_that_is_left_out_has_all_but_two_thousandths_of_the_probability() {
    let [lower, upper] = Prior::new(PriorFamily::LogNormal, &[280.0, 1.1]).range();
    approx::assert_relative_eq!(lower, 280.0 * 1.1f64.powf(-3.090_232_306), max_relative = 1e-8);
    approx::assert_relative_eq!(upper, 280.0 * 1.1f64.powf(3.090_232_306), max_relative = 1e-8);
}

#[test]
fn wrong_parameters_and_ranges_are_refused() {
    use PriorFamily::*;
    for (prior, part) in [
        (Prior::new(LogNormal, &[280.0, 0.9]), "factor must be above 1"),
        (Prior::new(Normal, &[280.0, -1.0]), "sd must be positive"),
        (Prior::new(Normal, &[280.0]), "sd must be positive"),
        (Prior::new(Beta, &[2.0, 6.0]).within(-0.1, 0.5), "at least 0"),
        (Prior::new(Triangular, &[1.0, 2.0, 3.0]).within(1.5, 4.0), "at most 3"),
        (Prior::new(Normal, &[0.0, 1.0]).within(2.0, 1.0), "below the upper end"),
        (Prior::uniform(3.0, f64::INFINITY), "finite"),
    ] {
        let message = Univariate::validate(&prior).unwrap_err().to_string();
        assert!(message.contains(part), "{message}");
    }
    priors().iter().for_each(|prior| Univariate::validate(prior).unwrap());
}

#[test]
fn priors_are_read_as_they_are_written() {
    type Table = std::collections::BTreeMap<String, Prior>;
    for prior in priors() {
        let text = toml::to_string(&Table::from([("x".to_owned(), prior)])).unwrap();
        let read = toml::from_str::<Table>(&text).unwrap()["x"];
        // compares as text, because unused values are NaN
        assert_eq!((read.to_string(), read.range()), (prior.to_string(), prior.range()), "{text}");
    }
    let uniform = toml::from_str::<Table>("x = [250.0, 300.0]").unwrap()["x"];
    assert_eq!((uniform.to_string(), uniform.range()), (priors()[0].to_string(), [250.0, 300.0]));
}

#[test]
fn a_design_has_the_distribution_of_the_priors() {
    let all = [priors()[2], priors()[4]];
    let design = Prior::sample_design(&all, DesignMethod::LatinHypercube, 200, 1).unwrap();
    for (i, prior) in all.iter().enumerate() {
        let mut ranks: Vec<f64> = design.iter().map(|point| prior.cdf(point[i])).collect();
        ranks.sort_by(f64::total_cmp);
        // one point in each of 200 intervals of equal probability
        assert!(
            ranks.iter().enumerate().all(|(k, rank)| (rank * 200.0 - k as f64 - 0.5).abs() < 0.501)
        );
    }
    let uniform = [priors()[0]];
    let by_box = DesignMethod::Sobol.sample(&[uniform[0].input("x").unwrap()], 16, 3).unwrap();
    assert_eq!(Prior::sample_design(&uniform, DesignMethod::Sobol, 16, 3).unwrap(), by_box);
}

ppl::model! {
    /// Three parameters with uniform priors that are written in the model.
    fn with_uniform(bounds: &[[f64; 2]; 3], y: &[f64]) {
        let mut sum = Real::from(0.0);
        for bounds in bounds {
            let theta ~ Uniform(bounds[0], bounds[1]);
            sum = sum + theta.ln();
        }
        let sd ~ HalfNormal(1.0);
        for y in y {
            y ~ Normal(sum, sd);
        }
    }

    /// Three parameters with priors of type [`Prior`], as read from a case.
    fn with_priors(priors: &[Prior], y: &[f64]) {
        let mut sum = Real::from(0.0);
        for prior in priors {
            let theta ~ *prior;
            sum = sum + theta.ln();
        }
        let sd ~ HalfNormal(1.0);
        for y in y {
            y ~ Normal(sum, sd);
        }
    }
}

const BOUNDS: [[f64; 2]; 3] = [[250.0, 300.0], [1e-5, 5e-3], [0.05, 0.55]];
const Y: [f64; 4] = [-1.8, -2.1, -1.2, -1.6];

/// Draws, density and derivatives have the same bits as with `ppl::Uniform`.
#[test]
fn uniform_priors_change_no_bit() {
    let priors = BOUNDS.map(|[a, b]| Prior::uniform(a, b));
    let (uniform, prior) = (with_uniform(&BOUNDS, &Y), with_priors(&priors, &Y));
    let (mut a, mut b) = ([0.0; 4], [0.0; 4]);
    for y in [[0.1, -2.0, 3.0, 0.3], [-8.0, 40.0, 0.0, -3.0]] {
        let value = uniform.gradient(&y, &mut a, &mut Workspace::default()).unwrap();
        let other = prior.gradient(&y, &mut b, &mut Workspace::default()).unwrap();
        assert_eq!((value.to_bits(), a.map(f64::to_bits)), (other.to_bits(), b.map(f64::to_bits)));
    }
    let sampler = Nuts::default().chains(2).warmup(200).draws(100).seed(3);
    let (a, b) = (sampler.sample(&uniform).unwrap(), sampler.sample(&prior).unwrap());
    assert_eq!(a.posterior.variables[0].data, b.posterior.variables[0].data);
    let drawn =
        |posterior: &ppl::Posterior| posterior.prior.as_ref().unwrap().variables[0].data.clone();
    assert_eq!(drawn(&a), drawn(&b));
}

#[test]
fn gradients_are_derivatives() {
    // the model takes logarithms, so that parameters must be positive
    gradient(&with_priors(&priors(), &Y), 1);
}

/// Compares the posterior with sums over a grid, in which the prior is written out: exp(−½ (ln(x/280)/ln 1.05)²)/x on
/// 200 < x < 400.
#[test]
fn the_posterior_of_a_lognormal_prior_is_that_of_quadrature() {
    // peak force of 0.5 N per MPa
    let x = Input::new("matrix.young_mpa", 200.0, 400.0).unwrap();
    let terms = [(vec![0], vec![150.0]), (vec![1], vec![50.0 / 3f64.sqrt()])];
    let pce = DynPce::from_terms(vec![x], vec!["peak_force_N".into()], terms).unwrap();
    let forces = [172.0, 150.0, 166.0];
    let evidence = Evidence { qois: forces.map(|f| vec![f]).to_vec(), ..Evidence::default() };
    let prior = Prior::new(PriorFamily::LogNormal, &[280.0, 1.05]).within(200.0, 400.0);
    let sampler = Nuts::default().chains(4).draws(4000).seed(4);
    let posterior = calibrate(&pce, &[prior], &evidence, &sampler, 4).unwrap().posterior;

    let mean_force = forces.iter().sum::<f64>() / 3.0;
    let moments = |ln_prior: &dyn Fn(f64) -> f64| {
        let (mut mass, mut first, mut second) = (0.0, 0.0, 0.0);
        for i in 0..400 {
            let young = 200.0 + 0.5 * (f64::from(i) + 0.5);
            for j in 0..600 {
                let sd = 1.5 * (f64::from(j) + 0.5) / 600.0;
                let gaps = forces.iter().map(|force| (force - 0.5 * young) / mean_force / sd);
                let misfit = gaps.map(|gap| gap * gap).sum::<f64>();
                let ln_sd = -0.5 * ((sd - 0.15) / 0.25_f64).powi(2);
                let p = (ln_prior(young) + ln_sd - 0.5 * misfit - 3.0 * sd.ln()).exp();
                (mass, first, second) = (mass + p, first + p * young, second + p * young * young);
            }
        }
        let mean = first / mass;
        [mean, (second / mass - mean * mean).sqrt()]
    };
    let [mean, sd] = moments(&|x: f64| -0.5 * ((x / 280.0).ln() / 1.05f64.ln()).powi(2) - x.ln());
    ppl::check::mean(&posterior, "theta[matrix.young_mpa]", mean).within_mcse(4.0);
    ppl::check::sd(&posterior, "theta[matrix.young_mpa]", sd).within_mcse(4.0);
    // a uniform prior gives another posterior
    let flat = moments(&|_| 0.0);
    assert!(flat[0] - mean > 0.5 * sd && flat[1] > 1.2 * sd, "{flat:?}, {mean}, {sd}");
    let missing = calibrate(&pce, &[prior.within(210.0, 400.0)], &evidence, &sampler, 4);
    assert!(missing.unwrap_err().to_string().contains("box of the surrogate"));
}
