//! Predictive checks and power scaling on models with closed forms.

use ppl::check::Estimate;
use ppl::prelude::*;
use ppl::special::normal_cdf;
use ppl::{Posterior, PowerScalingError, PredictiveError, Sensitivity, WarningKind};

ppl::model! {
    /// A normal mean with a normal prior, known scale.
    fn normal(y: &[f64], prior_mean: f64, prior_sd: f64) {
        let mu ~ Normal(prior_mean, prior_sd);
        #[track] let twice = 2.0 * mu;
        for y in y {
            y ~ Normal(mu, 1.0);
        }
    }

    /// A hierarchical mean with three groups, and a parameter `idle` that the data do not inform.
    fn groups(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let idle ~ Normal(0.0, 1.0);
        let theta ~ Normal(mu, 1.0).array::<3>();
        for i in 0..3 {
            y[i] ~ Normal(theta[i], 0.5);
        }
    }

    fn silent() {
        let x ~ Normal(0.0, 1.0);
    }
}

fn data(centre: f64) -> Vec<f64> {
    (0..50).map(|i| centre + (f64::from(i) * 0.7).sin()).collect()
}

fn posterior_of(y: &[f64], mean: f64, sd: f64) -> Posterior {
    Nuts::default().seed(4).sample(&normal(y, mean, sd)).expect("the model samples")
}

/// Posterior mean and variance.
fn conjugate(y: &[f64], mean: f64, sd: f64) -> (f64, f64) {
    let variance = 1.0 / (sd.powi(-2) + y.len() as f64);
    (variance * (mean / (sd * sd) + y.iter().sum::<f64>()), variance)
}

#[test]
fn p_values_of_the_mean_in_closed_form() {
    let y = data(0.3);
    let posterior = posterior_of(&y, 1.0, 0.2);
    let (m, v) = conjugate(&y, 1.0, 0.2);
    let observed = y.iter().sum::<f64>() / 50.0;
    let table = posterior.predictive_table("y").expect("observed");
    let check = table.check("mean").expect("the mean is in the table");
    assert!((check.observed - observed).abs() < 1e-12);
    // the mean of the n = 50 replicated data is normal with variance v + 1/n
    let p = normal_cdf((m - observed) / (v + 0.02).sqrt());
    let above: Vec<f64> =
        check.replicated.iter().map(|t| f64::from(u8::from(*t > observed))).collect();
    let chains: Vec<&[f64]> = above.chunks(1000).collect();
    Estimate::of_mean("p", &chains, p).within_mcse(4.0);
    assert!((check.p_value() - above.iter().sum::<f64>() / 4000.0).abs() < 1e-12);
    assert!((check.quantile(0.5) - m).abs() < 0.05);

    // replicates from the prior are independent, so the standard error is binomial
    let prior = posterior.prior_predictive_table("y").expect("prior draws");
    let check = prior.check("mean").expect("the mean is in the table");
    let p = normal_cdf((1.0 - observed) / (0.04f64 + 0.02).sqrt());
    let n = check.replicated.len() as f64;
    assert!((check.p_value() - p).abs() < 4.0 * (p * (1.0 - p) / n).sqrt());

    // a statistic chosen by the user: y[0] of a replicate is normal with variance 0.04 + 1
    let first = |y: &[f64]| y[0];
    let check = posterior.prior_predictive_check("y", "first", first).expect("prior draws");
    assert_eq!((check.name.as_str(), check.statistic.as_str()), ("y", "first"));
    assert_eq!(check.observed, posterior.observed.get("y").expect("observed").data[0]);
    let p = normal_cdf((1.0 - check.observed) / 1.04f64.sqrt());
    let n = check.replicated.len() as f64;
    assert!((check.p_value() - p).abs() < 4.0 * (p * (1.0 - p) / n).sqrt());
    // the mean of a statistic that equals the data in half of the replicates
    let sign = |y: &[f64]| f64::from(u8::from(y[0] > 1.0));
    let ties = posterior.prior_predictive_check("y", "sign", sign).expect("prior draws");
    let above = ties.replicated.iter().sum::<f64>() / n;
    let expected = if ties.observed == 1.0 { 0.5 * above } else { above + 0.5 * (1.0 - above) };
    assert!((ties.p_value() - expected).abs() < 1e-12);
    let error = posterior.prior_predictive_check("z", "first", first).expect_err("no such data");
    assert!(matches!(&error, PredictiveError::NotObserved { known, .. } if known == "y"));

    let printed = table.to_string();
    for part in ["observed", "smallest", "median", "largest", "sd"] {
        assert!(printed.contains(part), "{printed}");
    }
}

#[test]
fn a_bad_fit_shows_in_the_statistic_it_misses() {
    // data with three times the standard deviation of the model
    let y: Vec<f64> = data(0.0).iter().map(|y| 3.0 * y).collect();
    let posterior = posterior_of(&y, 0.0, 10.0);
    let table = posterior.predictive_table("y").expect("observed");
    let p = |name: &str| table.check(name).expect("in the table").p_value();
    assert!(p("sd") < 0.001);
    assert!((p("mean") - 0.5).abs() < 0.1);
    let ties = posterior.predictive_check("y", "count", |y| y.len() as f64).expect("observed");
    assert_eq!(ties.p_value(), 0.5);
}

#[test]
fn unknown_names_are_answered_with_known_ones() {
    let posterior = posterior_of(&data(0.0), 0.0, 1.0);
    let error = posterior.predictive_table("z").expect_err("no such data");
    assert!(matches!(&error, PredictiveError::NotObserved { known, .. } if known == "y"));
    let error = posterior.power_scaling_of(&["nu"]).expect_err("no such parameter");
    assert!(error.to_string().contains("the parameters are: mu"), "{error}");
    let silent = Nuts::default().warmup(100).draws(50).sample(&silent()).expect("runs");
    assert_eq!(silent.power_scaling(), Err(PowerScalingError::NoObservations));
}

/// As in the conjugate example of Kallioinen et al. (2024), the sensitivities to prior and likelihood grow with the
/// distance between prior and data.
#[test]
fn sensitivity_grows_with_the_conflict() {
    let y = data(0.0);
    let rows = [0.0, 5.0, 10.0].map(|mean| {
        let scaling = posterior_of(&y, mean, 1.0).power_scaling().expect("data");
        assert!(scaling.pareto_k.iter().all(|&k| k < 0.7), "{scaling}");
        // a linear function of mu has the sensitivity of mu
        let [a, b] = ["mu", "twice"].map(|name| scaling.row(name).expect("moves").prior);
        assert!((a - b).abs() < 1e-9);
        (scaling.row("mu").expect("a parameter").clone(), scaling)
    });
    assert!(rows[0].0.prior < 0.05 && rows[0].0.likelihood > 0.05);
    assert_eq!(rows[0].0.sensitivity(), Sensitivity::None);
    for k in 1..3 {
        assert!(rows[k].0.prior > rows[k - 1].0.prior);
        assert!(rows[k].0.likelihood > rows[k - 1].0.likelihood);
        assert_eq!(rows[k].0.sensitivity(), Sensitivity::PriorDataConflict);
    }
    assert!(rows[0].1.warnings().is_empty());
    let found = rows[2].1.warnings();
    assert_eq!(found[0].kind, WarningKind::PriorDataConflict);
    assert!(found[0].what.contains("mu"), "{}", found[0]);
    assert!(rows[2].1.to_string().contains("prior-data conflict"));
}

#[test]
fn a_parameter_without_data_has_a_strong_prior() {
    let posterior =
        Nuts::default().seed(6).sample(&groups(&[1.0, 2.0, 3.0])).expect("the model samples");
    // the log-prior is recorded once per statement, summed over the entries of an array
    let [mu, theta, recorded] = [
        posterior.posterior.get("mu"),
        posterior.posterior.get("theta"),
        posterior.log_prior.get("theta"),
    ]
    .map(|values| &values.expect("a parameter").data);
    for draw in [0, 7, 3999] {
        let squares: f64 =
            theta[3 * draw..3 * draw + 3].iter().map(|t| (t - mu[draw]).powi(2)).sum();
        let exact = -0.5 * squares - 1.5 * (2.0 * std::f64::consts::PI).ln();
        assert!((recorded[draw] - exact).abs() < 1e-12);
    }
    let scaling = posterior.power_scaling_of(&["mu", "idle"]).expect("data");
    let idle = scaling.row("idle").expect("a parameter");
    assert_eq!(idle.sensitivity(), Sensitivity::StrongPrior, "{scaling}");
    assert_eq!(scaling.warnings()[0].kind, WarningKind::StrongPrior);
    let theta = scaling.row("theta[1]").expect("a parameter");
    assert_eq!(theta.sensitivity(), Sensitivity::None, "{scaling}");
}
