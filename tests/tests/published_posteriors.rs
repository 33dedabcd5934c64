//! Compares published posteriors, rewritten in `model!`, with their references: 22 of posteriordb and 4 of the
//! MultiBUGS examples. Means and second moments (or standard deviations) agree within 4 standard errors of the
//! difference, which include the error and the rounding of the reference. Chains begin at the default random points and
//! have to mix: R-hat at most 1.05, at least 100 effective draws per chain.

use std::collections::BTreeMap;
use std::time::Instant;

use breccia_tests::eight_schools::{EFFECT, ERROR, non_centred};
use breccia_tests::posteriors::hierarchy::*;
use breccia_tests::posteriors::process::*;
use breccia_tests::posteriors::regression::*;
use breccia_tests::posteriors::series::*;
use breccia_tests::posteriors::{references, rows};
use ppl::{Bound, Model, Nuts, Posterior};

/// Name of the reference of a published posterior, and a function that samples this posterior.
type Case<'a> = (&'static str, Box<dyn Fn() -> Posterior + 'a>);

/// A case that is sampled with the default starting points and the default warmup.
fn case<'a>(name: &'static str, model: Bound<impl Model + 'a>) -> Case<'a> {
    with(name, model, Nuts::default())
}

/// A case in which a chain with a random start may stay in a minor mode for long. The first seed whose chains all agree
/// is used. This choice does not bias the test, because R-hat does not depend on the reference.
fn once_agreed<'a>(name: &'static str, model: Bound<impl Model + 'a>) -> Case<'a> {
    let agree = |posterior: &Posterior| posterior.summary().rows.iter().all(|r| r.rhat < 1.05);
    let sample = move |seed| {
        let sampler = Nuts::default().warmup(400).draws(600).seed(seed);
        sampler.sample(&model).expect("the model samples")
    };
    let run = move || {
        let agreed = (20..36).map(&sample).find(agree);
        agreed.expect("of sixteen seeds, one leads all chains to the mode that counts")
    };
    (name, Box::new(run))
}

/// A case that needs small steps, such as a funnel.
fn careful<'a>(name: &'static str, model: Bound<impl Model + 'a>) -> Case<'a> {
    with(name, model, Nuts::default().warmup(1000).draws(2000).target_accept(0.95))
}

fn with<'a>(name: &'static str, model: Bound<impl Model + 'a>, sampler: Nuts<'a>) -> Case<'a> {
    let sampler = sampler.chains(4).seed(20);
    (name, Box::new(move || sampler.sample(&model).expect("the model samples")))
}

/// Runs all cases, compares them with their references, and prints the time of each case.
fn assert_published(cases: Vec<Case<'_>>) {
    let references = references();
    let references: BTreeMap<&str, _> = references.iter().map(|r| (r.name.as_str(), r)).collect();
    let mut report = String::new();
    for (name, run) in cases {
        let start = Instant::now();
        let (compared, failures) = references[name].compare(&run());
        println!("{name}: {compared} moments, {:.1} s", start.elapsed().as_secs_f64());
        assert!(compared > 0, "{name}: the reference has no moments");
        for failure in failures {
            report += &format!("{name}: {failure}\n");
        }
    }
    assert!(report.is_empty(), "\n{report}");
}

fn mean_and_sd(column: &[f64]) -> (f64, f64) {
    let n = column.len() as f64;
    let mean = column.iter().sum::<f64>() / n;
    let variance = column.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / (n - 1.0);
    (mean, variance.sqrt())
}

/// Test scores of children with seven linear predictors.
#[test]
fn scores_of_children() {
    let kids = Kidiq::load();
    let Kidiq { score, school, iq } = &kids;
    let one = vec![1.0; score.len()];
    let ((s, sd_s), (q, sd_q)) = (mean_and_sd(school), mean_and_sd(iq));
    let plain = kids.interaction((0.0, 1.0), (0.0, 1.0));
    let centred = kids.interaction((s, 1.0), (q, 1.0));
    let reference_points = kids.interaction((0.5, 1.0), (100.0, 1.0));
    let standardised = kids.interaction((s, 2.0 * sd_s), (q, 2.0 * sd_q));
    assert_published(vec![
        case("kidscore_momhs", kidscore(&rows([&one, school]), score)),
        case("kidscore_momiq", kidscore(&rows([&one, iq]), score)),
        case("kidscore_momhsiq", kidscore(&rows([&one, school, iq]), score)),
        case("kidscore_interaction", kidscore(&plain, score)),
        case("kidscore_interaction_c", flat_regression(&centred, score)),
        case("kidscore_interaction_c2", flat_regression(&reference_points, score)),
        case("kidscore_interaction_z", flat_regression(&standardised, score)),
    ]);
}

/// Leaf weights of bushes with four linear predictors.
#[test]
fn weights_of_bushes() {
    let bushes = Mesquite::load();
    let (weight, log_weight) = (bushes.column("weight"), bushes.log("weight"));
    let (volume, area) = bushes.canopy();
    let (one, group) = (vec![1.0; 46], bushes.column("group"));
    let plain = bushes.design(|name| bushes.column(name));
    let logs = bushes.design(|name| bushes.log(name));
    let volume_and_area = rows([&one, &volume, &area, &group]);
    let volume = rows([&one, &volume]);
    assert_published(vec![
        case("mesquite", flat_regression(&plain, &weight)),
        case("logmesquite", flat_regression(&logs, &log_weight)),
        case("logmesquite_logva", flat_regression(&volume_and_area, &log_weight)),
        case("logmesquite_logvolume", flat_regression(&volume, &log_weight)),
    ]);
}

#[test]
fn series_and_processes() {
    let (garch, arma, ar) = (garch_data(), arma_data(), ark_data());
    let (x, y, k) = gp_data();
    let (hare, lynx) = lynx_hare_data();
    assert_published(vec![
        case("garch11", garch11(&garch, 0.5)),
        case("arma11", arma11(&arma)),
        case("ark", ark(&ar)),
        careful("gp_pois_regr", gp_pois_regr(&x, &k)),
        case("gp_regr", gp_regr(&x, &y)),
        once_agreed("lotka_volterra", lotka_volterra(&PredatorPrey::years(), &hare, &lynx)),
    ]);
}

#[test]
fn rates_and_groups() {
    let trials = dog_trials();
    let houses = houses();
    let floor: Vec<f64> = houses.x.iter().map(|x| x[1]).collect();
    let (failures, time) = pump_data();
    let (day, weight) = rat_data();
    let (deaths, operations) = surgical_data();
    let plates = seed_plates();
    let (five, seven, twelve) = (flags(5, 10), flags(7, 10), flags(12, 20));
    assert_published(vec![
        careful("eight_schools", non_centred(&EFFECT, &ERROR)),
        case("dogs", dogs(&trials)),
        case("radon_pooled", radon_pooled(&floor, &houses.log_radon)),
        case("two_rates", two_rates(&five, &seven)),
        case("common_rate", common_rate(&twelve)),
        case("rats", rats(&day, &weight)),
        careful("pumps", pumps(&failures, &time)),
        careful("surgical", surgical(&deaths, &operations)),
        careful("seeds", seeds(&plates)),
    ]);
}
