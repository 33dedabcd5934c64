//! Published posteriors rewritten in `model!`: means and second moments (or standard deviations)
//! within 4 standard errors of the difference, the reference's own error and rounding included.

use std::collections::BTreeMap;

use breccia_tests::eight_schools::{EFFECT, ERROR, non_centred};
use breccia_tests::posteriors::hierarchy::*;
use breccia_tests::posteriors::process::*;
use breccia_tests::posteriors::regression::*;
use breccia_tests::posteriors::series::*;
use breccia_tests::posteriors::{references, rows};
use ppl::{Bound, Model, Nuts, Posterior};

fn run(model: &Bound<impl Model>) -> Posterior {
    sample(model, Nuts::default().warmup(500).draws(500))
}

/// For funnels and other posteriors that need small steps.
fn run_carefully(model: &Bound<impl Model>) -> Posterior {
    sample(model, Nuts::default().warmup(1000).draws(1000).target_accept(0.95))
}

fn sample(model: &Bound<impl Model>, sampler: Nuts<'_>) -> Posterior {
    sampler.chains(4).seed(20).sample(model).expect("the model samples")
}

fn mean_and_sd(column: &[f64]) -> (f64, f64) {
    let n = column.len() as f64;
    let mean = column.iter().sum::<f64>() / n;
    let variance = column.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, variance.sqrt())
}

/// Children's scores under seven linear predictors.
fn kidscore_posteriors() -> Vec<(&'static str, Posterior)> {
    let kids = Kidiq::load();
    let Kidiq { score, school, iq } = &kids;
    let one = vec![1.0; score.len()];
    let ((s, sd_s), (q, sd_q)) = (mean_and_sd(school), mean_and_sd(iq));
    let centred = kids.interaction((s, 1.0), (q, 1.0));
    let reference_points = kids.interaction((0.5, 1.0), (100.0, 1.0));
    let standardised = kids.interaction((s, 2.0 * sd_s), (q, 2.0 * sd_q));
    vec![
        ("kidscore_momhs", run(&kidscore(&rows([&one, school]), score))),
        ("kidscore_momiq", run(&kidscore(&rows([&one, iq]), score))),
        ("kidscore_momhsiq", run(&kidscore(&rows([&one, school, iq]), score))),
        ("kidscore_interaction", run(&kidscore(&kids.interaction((0.0, 1.0), (0.0, 1.0)), score))),
        ("kidscore_interaction_c", run(&flat_regression(&centred, score))),
        ("kidscore_interaction_c2", run(&flat_regression(&reference_points, score))),
        ("kidscore_interaction_z", run(&flat_regression(&standardised, score))),
    ]
}

/// Leaf weights of bushes under four linear predictors.
fn mesquite_posteriors() -> Vec<(&'static str, Posterior)> {
    let bushes = Mesquite::load();
    let (weight, log_weight) = (bushes.column("weight"), bushes.log("weight"));
    let (volume, area) = bushes.canopy();
    let (one, group) = (vec![1.0; 46], bushes.column("group"));
    let plain = bushes.design(|name| bushes.column(name));
    let logs = bushes.design(|name| bushes.log(name));
    let volume_and_area = rows([&one, &volume, &area, &group]);
    vec![
        ("mesquite", run(&flat_regression(&plain, &weight))),
        ("logmesquite", run(&flat_regression(&logs, &log_weight))),
        ("logmesquite_logva", run(&flat_regression(&volume_and_area, &log_weight))),
        ("logmesquite_logvolume", run(&flat_regression(&rows([&one, &volume]), &log_weight))),
    ]
}

fn other_posteriors() -> Vec<(&'static str, Posterior)> {
    let trials = dog_trials();
    let houses = houses();
    let floor: Vec<f64> = houses.iter().map(|h| h.floor).collect();
    let log_radon: Vec<f64> = houses.iter().map(|h| h.log_radon).collect();
    let (x, y, k) = gp_data();
    let (hare, lynx) = lynx_hare_data();
    let (failures, time) = pump_data();
    let (day, weight) = rat_data();
    let (deaths, operations) = surgical_data();
    vec![
        ("eight_schools", run_carefully(&non_centred(&EFFECT, &ERROR))),
        ("garch11", run(&garch11(&garch_data(), 0.5))),
        ("arma11", run(&arma11(&arma_data()))),
        ("ark", run(&ark(&ark_data()))),
        ("gp_pois_regr", run(&gp_pois_regr(&x, &k))),
        ("gp_regr", run(&gp_regr(&x, &y))),
        ("lotka_volterra", run(&lotka_volterra(&hare, &lynx))),
        ("dogs", run(&dogs(&trials))),
        ("dogs_log", run(&dogs_log(&trials))),
        ("radon_pooled", run(&radon_pooled(&floor, &log_radon))),
        ("two_rates", run(&two_rates(&flags(5, 10), &flags(7, 10)))),
        ("common_rate", run(&common_rate(&flags(12, 20)))),
        ("rats", run(&rats(&day, &weight))),
        ("pumps", run_carefully(&pumps(&failures, &time))),
        ("surgical", run_carefully(&surgical(&deaths, &operations))),
        ("seeds", run_carefully(&seeds(&seed_plates()))),
    ]
}

fn assert_published(posteriors: Vec<(&str, Posterior)>) {
    let references = references();
    let references: BTreeMap<&str, _> = references.iter().map(|r| (r.name.as_str(), r)).collect();
    let mut report = String::new();
    for (name, posterior) in &posteriors {
        let (compared, failures) = references[name].compare(posterior);
        assert!(compared > 0, "{name}: the reference has no moments");
        for failure in failures {
            report += &format!("{name}: {failure}\n");
        }
    }
    assert!(report.is_empty(), "\n{report}");
}

#[test]
fn scores_of_children() {
    assert_published(kidscore_posteriors());
}

#[test]
fn weights_of_bushes() {
    assert_published(mesquite_posteriors());
}

#[test]
fn series_hierarchies_and_processes() {
    assert_published(other_posteriors());
}
