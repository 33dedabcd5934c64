//! Models whose unknowns lie far from the uniform starts: starts at prior draws, starts given by name, first scales
//! from the prior.

use ppl::prelude::*;
use ppl::{Chains, RunError, SampleError, StartKind, diagnostics::mcse_mean};

ppl::model! {
    /// Specimens that broke or held at their loads, with a random threshold; far from the threshold the probability of
    /// the observations underflows to zero.
    fn thresholds(load_n: &[f64], broke: &[bool], unit: f64) {
        let threshold ~ Normal(1000.0 * unit, 100.0 * unit);
        let spread ~ LogNormal((30.0 * unit).ln(), 0.3);
        for (load, broke) in load_n.iter().zip(broke) {
            broke ~ Bernoulli(((*load - threshold) / spread).normal_cdf());
        }
    }

    fn modulus(young_pa: &[f64]) {
        let young ~ Normal(200e9, 20e9);
        for measured in young_pa {
            measured ~ Normal(young, 10e9);
        }
    }

    fn impossible(data: &[f64]) {
        let level ~ Normal(0.0, 1.0);
        for x in data {
            x ~ HalfNormal(level.exp());
        }
    }

    fn shapes(y: &[f64]) {
        let level ~ Normal(0.0, 1e5);
        let pair ~ Uniform(-10.0, 10.0).array::<2>();
        let list ~ Normal(pair[0], 1.0).iid(3);
        let order ~ Normal(0.0, 5.0).array::<2>().ordered();
        let factor ~ LkjCholesky::<2>(1.0);
        for y in y {
            let local ~ LogNormal(0.0, 1.0);
            y ~ Normal(level + local * list[0], 1.0 + order[1].exp());
        }
    }
}

const LOADS: [f64; 10] = [850.0, 880.0, 910.0, 940.0, 960.0, 980.0, 1000.0, 1030.0, 1060.0, 1100.0];
const BROKE: [bool; 10] = [false, false, false, false, true, false, true, false, true, true];

/// Mean and Monte Carlo standard error of an unknown.
fn mean(posterior: &ppl::Posterior, name: &str) -> (f64, f64) {
    let values = posterior.values(name).expect("an unknown");
    let chains: Vec<&[f64]> = values.data.chunks_exact(posterior.posterior.draws).collect();
    (values.data.iter().sum::<f64>() / values.data.len() as f64, mcse_mean(&chains))
}

fn kinds(chains: &Chains) -> Vec<StartKind> {
    chains.chains.iter().map(|chain| chain.warmup.start_kind).collect()
}

/// With loads in kilonewtons the uniform starts have a density above zero, with loads in newtons no uniform start has
/// a positive density; both runs have the same posterior.
#[test]
fn chains_start_at_prior_draws_where_uniform_starts_have_no_density() {
    let in_kn: Vec<f64> = LOADS.iter().map(|load| load / 1000.0).collect();
    let (small, large) = (thresholds(&in_kn, &BROKE, 1e-3), thresholds(&LOADS, &BROKE, 1.0));
    let nuts = Nuts::default().seed(3);
    let (near, far) = (nuts.sample(&small).expect("runs"), nuts.sample(&large).expect("runs"));
    assert_eq!(kinds(&near.chains), [StartKind::Uniform; 4]);
    assert_eq!(kinds(&far.chains), [StartKind::PriorDraw; 4]);
    for (name, unit) in [("threshold", 1000.0), ("spread", 1000.0)] {
        let ((expected, error), (got, own)) = (mean(&near, name), mean(&far, name));
        let allowed = 4.0 * (unit * error).hypot(own);
        assert!((got - unit * expected).abs() < allowed, "{name}: {got}, {expected}");
    }
    let summary = far.summary().to_string();
    let words = "Chains that started at a draw from the prior, because every uniform starting point was rejected: 0, 1, 2, 3";
    assert!(summary.contains(words), "{summary}");
    assert!(!near.summary().to_string().contains("Chains that started at"));

    let walk = Metropolis::default().seed(3).thin(3).sample(&large).expect("runs");
    assert_eq!(kinds(&walk.chains), [StartKind::PriorDraw; 4]);
    let ((expected, error), (got, own)) = (mean(&far, "threshold"), mean(&walk, "threshold"));
    assert!((got - expected).abs() < 4.0 * error.hypot(own), "{got}, {expected}");

    let [near, far] = [&small, &large].map(|model| Map::default().find(model).expect("a mode"));
    assert_eq!((near.prior_starts, far.prior_starts), (0, 10));
    assert!(far.converged && far.agreeing > 5, "{far:?}");
    assert!((far.point[0] - 1000.0 * near.point[0]).abs() < 0.1, "{far:?}, {near:?}");
}

#[test]
fn prior_starts_do_not_depend_on_the_number_of_threads() {
    let model = thresholds(&LOADS, &BROKE, 1.0);
    let nuts = Nuts::default().warmup(50).draws(20).seed(8);
    let one = nuts.clone().threads(1).run(&model).expect("runs");
    assert_eq!(nuts.clone().threads(3).run(&model).expect("runs"), one);
    let walk = Metropolis::default().warmup(50).draws(20).seed(8);
    let alone = walk.clone().threads(1).run(&model).expect("runs");
    assert_eq!(walk.threads(3).run(&model).expect("runs"), alone);
    // the file stores where a chain started
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("chains.json");
    one.save(&file).expect("written");
    assert_eq!(Chains::load(&file).expect("read"), one);
}

/// A conjugate model; the posterior precision is 1/20² + 3/10² in GPa⁻².
#[test]
fn random_walks_take_their_first_scales_from_the_prior() {
    let data = [210e9, 195e9, 203e9];
    let walk = Metropolis::default().seed(2).thin(3).sample(&modulus(&data)).expect("runs");
    let precision = 1.0 / 400.0 + 3.0 / 100.0;
    let expected = 1e9 * (200.0 / 400.0 + 608.0 / 100.0) / precision;
    let (got, error) = mean(&walk, "young");
    assert!((got - expected).abs() < 4.0 * error && error < 0.05e9, "{got} ± {error}, {expected}");
    let screened = DelayedAcceptance::default().seed(2).screening_steps(5);
    let screened = screened.sample(&modulus(&data), &modulus(&data)).expect("runs");
    let (got, error) = mean(&screened, "young");
    assert!((got - expected).abs() < 4.0 * error && error < 0.2e9, "{got} ± {error}, {expected}");
}

#[test]
fn what_cannot_start_says_what_was_tried_and_what_to_do() {
    let model = impossible(&[0.3, -1.0]);
    let error = Nuts::default().sample(&model).expect_err("no density").to_string();
    let tried = "all 100 uniform initial points and 100 draws from the prior were rejected";
    assert!(error.contains(tried) && error.contains("init_value"), "{error}");
    assert!(error.contains("`data[1]` = -1") || error.contains("`x[1]` = -1"), "{error}");
    let error = Map::default().find(&model).expect_err("no density").to_string();
    assert!(error.contains(tried) && error.contains("init_value"), "{error}");
}

#[test]
fn values_by_name_become_coordinates() {
    let model = shapes(&[0.3, 0.5]);
    let factor = [[1.0, 0.0], [0.6, 0.8]];
    let nuts = Nuts::default().chains(2).warmup(5).draws(1).seed(4);
    let nuts = nuts
        .init_value("level", 1e5)
        .init_value("pair", [5.0, -2.0])
        .init_value("list", vec![1.0, 2.0, 3.0])
        .init_value("order", [-1.0, 4.0])
        .init_value("factor", factor)
        .init_value("local", [0.5, 2.0]);
    let chains = nuts.run(&model).expect("runs");
    let mut rng = <rand_xoshiro::Xoshiro256PlusPlus as rand::SeedableRng>::seed_from_u64(0);
    for chain in &chains.chains {
        let record = model.constrain(&chain.warmup.start, &mut rng).expect("a point");
        for (name, expected) in [
            ("level", &[1e5][..]),
            ("pair", &[5.0, -2.0]),
            ("list", &[1.0, 2.0, 3.0]),
            ("order", &[-1.0, 4.0]),
            ("factor", &[1.0, 0.0, 0.6, 0.8]),
            ("local", &[0.5, 2.0]),
        ] {
            for (got, expected) in record.values(name).expect("an unknown").iter().zip(expected) {
                approx::assert_relative_eq!(got, expected, max_relative = 1e-12, epsilon = 1e-15);
            }
        }
    }
    // an unknown without a given value starts where it starts in a run without given values
    let without = Nuts::default().chains(2).warmup(5).draws(1).seed(4);
    let one = without.clone().init_value("level", -3.0).run(&model).expect("runs");
    let other = without.run(&model).expect("runs");
    for (one, other) in one.chains.iter().zip(&other.chains) {
        assert_eq!(one.warmup.start[0], -3.0);
        approx::assert_relative_eq!(
            one.warmup.start[1..],
            other.warmup.start[1..],
            epsilon = 1e-12
        );
    }
}

/// In pascals, the gradient is 1e-10 per Pa, below the tolerance of a search in these units.
#[test]
fn modes_do_not_depend_on_units() {
    let search = Map::default().starts(4);
    for search in [search.clone(), search.init_value("young", 190e9)] {
        let mode = search.find(&modulus(&[210e9])).expect("a mode");
        assert!(mode.converged && mode.agreeing == 4, "{mode:?}");
        assert!((mode.point[0] / 208e9 - 1.0).abs() < 1e-6, "{mode:?}");
    }
}

#[test]
fn values_that_do_not_fit_are_named() {
    let model = shapes(&[0.3, 0.5]);
    let nuts = || Nuts::default().warmup(5).draws(1);
    let cases = [
        (
            nuts().init_value("levle", 1.0),
            "`levle`: no unknown has this name; the unknowns are `level`",
        ),
        (nuts().init_value("pair", 1.0), "`pair`: 1 number(s) are given, and more are needed"),
        (nuts().init_value("pair", [1.0; 3]), "`pair`: 3 number(s) are given, and 2 are needed"),
        (nuts().init_value("pair", [1.0, 20.0]), "`pair`: the value lies outside the support"),
        (nuts().init_value("y", 1.0), "`y`: no unknown has this name"),
    ];
    for (nuts, words) in cases {
        let error = nuts.sample(&model).expect_err(words);
        assert!(matches!(error, SampleError::Run(RunError::Values(_))), "{error}");
        assert!(error.to_string().contains(words), "{error}");
    }
}
