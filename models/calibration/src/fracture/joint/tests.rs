//! Compares joint calibrations with single calibrations, with quadrature, and with the true parameters of emulated
//! laboratories.

use std::collections::BTreeMap;

use ppl::{Nuts, Posterior, check};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use surrogate::{DynPce, Input};

use super::*;
use crate::fracture::six_specimens::{CALIBRATED, QOIS, forward, priors, shared};
use crate::fracture::{Evidence, calibrate};
use crate::prior::{Prior, PriorFamily};

fn six_specimens(name: &str) -> JointTest {
    let qois = QOIS.map(Vec::from).to_vec();
    let evidence = Evidence { qois, shared: shared(), ..Evidence::default() };
    JointTest {
        name: name.to_owned(),
        forward: forward(),
        priors: priors(),
        own: Vec::new(),
        evidence,
    }
}

/// Returns a test with one quantity: the peak force is `slopes` · (parameters − centre of the box)
/// + 100 N.
fn linear(name: &str, slopes: &[f64], forces: &[f64], shared: f64) -> JointTest {
    let names = ["matrix.young_mpa", "test.friction"];
    let bounds = [[200.0, 400.0], [0.0, 0.4]];
    let inputs: Vec<Input> = slopes
        .iter()
        .enumerate()
        .map(|(i, _)| Input::new(names[i], bounds[i][0], bounds[i][1]).unwrap())
        .collect();
    let index = |i: usize| (0..slopes.len()).map(|j| u8::from(i == j)).collect::<Vec<u8>>();
    let mut terms = vec![(vec![0; slopes.len()], vec![100.0])];
    terms.extend(slopes.iter().enumerate().map(|(i, slope)| {
        let half_width = 0.5 * (bounds[i][1] - bounds[i][0]);
        (index(i), vec![slope * half_width / 3f64.sqrt()])
    }));
    let qois = forces.iter().map(|&force| vec![force]).collect();
    let evidence = Evidence { qois, shared: vec![vec![shared]], ..Evidence::default() };
    JointTest {
        name: name.to_owned(),
        priors: Prior::uniform_on(&inputs),
        forward: DynPce::from_terms(inputs, vec!["peak_force_N".into()], terms).unwrap(),
        own: Vec::new(),
        evidence,
    }
}

fn sampler(seed: u64) -> Nuts<'static> {
    Nuts::default().chains(4).draws(2000).seed(seed)
}

fn moments(posterior: &Posterior, name: &str) -> [(f64, f64); 2] {
    let trace = posterior.trace(name).unwrap_or_else(|| panic!("no {name}"));
    let chains: Vec<&[f64]> = trace.iter().map(Vec::as_slice).collect();
    let all = trace.concat();
    let mean = all.iter().sum::<f64>() / all.len() as f64;
    let sd = (all.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / all.len() as f64).sqrt();
    let [of_mean, of_sd] =
        [ppl::diagnostics::mcse_mean(&chains), ppl::diagnostics::mcse_sd(&chains)];
    [(mean, of_mean), (sd, of_sd)]
}

fn assert_equal(a: (&Posterior, &str), b: (&Posterior, &str)) {
    for (ours, theirs) in moments(a.0, a.1).into_iter().zip(moments(b.0, b.1)) {
        let error = ours.1.hypot(theirs.1);
        assert!((ours.0 - theirs.0).abs() < 4.0 * error, "{} {}: {ours:?} {theirs:?}", a.1, b.1);
    }
}

const YOUNG: &str = "matrix.young_mpa";

#[test]
fn one_test_gives_the_posterior_of_the_single_calibration() {
    let tests = [six_specimens("only")];
    let joint = calibrate_tests(&tests, &BTreeMap::new(), &sampler(5), 0, 5).unwrap();
    for (ours, theirs) in [
        ("theta[matrix.young_mpa]", "theta[matrix.young_mpa]"),
        ("sd[slope (only)]", "sd[0]"),
        ("sd[peak-force (only)]", "sd[1]"),
        ("correlation[peak-force slope (only)]", "correlation[peak-force,slope]"),
    ] {
        assert_equal((&joint.posterior, ours), (&CALIBRATED.posterior, theirs));
    }
    assert_eq!(joint.names, [YOUNG]);
    let width = 50.0;
    assert!((joint.map[0] - CALIBRATED.map[0]).abs() < 0.02 * width, "{:?}", joint.map);
}

/// Tests without a common parameter have the same posteriors as separate calibrations, even if the tests have
/// different numbers of quantities.
#[test]
fn tests_that_share_nothing_do_not_inform_each_other() {
    let tests = [six_specimens("two"), linear("one", &[0.5], &[108.0, 96.0, 103.0, 99.0], 4e-4)];
    let own = BTreeMap::from([(YOUNG.to_owned(), BetweenTests::Own)]);
    check::gradient(&calibration_over_tests(&JointTests::new(&tests, &own).unwrap()), 3);
    let joint = calibrate_tests(&tests, &own, &sampler(6), 0, 6).unwrap();
    assert_eq!(joint.names, ["matrix.young_mpa (two)", "matrix.young_mpa (one)"]);
    let one = &tests[1];
    let one = calibrate(&one.forward, &one.priors, &one.evidence, &sampler(7), 7).unwrap();
    let (joint, theta) = (&joint.posterior, "theta[matrix.young_mpa]");
    assert_equal((joint, "theta[matrix.young_mpa (two)]"), (&CALIBRATED.posterior, theta));
    assert_equal((joint, "theta[matrix.young_mpa (one)]"), (&one.posterior, theta));
    assert_equal((joint, "sd[peak-force (one)]"), (&one.posterior, "sd[0]"));
}

/// Returns the midpoints of `n` intervals between `a` and `b`.
fn midpoints(a: f64, b: f64, n: usize) -> Vec<f64> {
    (0..n).map(|i| a + (b - a) * (i as f64 + 0.5) / n as f64).collect()
}

/// Likelihood of the specimens of a test with one quantity at given parameters, integrated over the scatter with its
/// prior. All specimens are one normal vector, whose covariance sd² I + S 1 1ᵀ has a known inverse.
fn likelihood(test: &JointTest, parameters: &[f64]) -> f64 {
    let forces: Vec<f64> = test.evidence.qois.concat();
    let n = forces.len() as f64;
    let unit = forces.iter().sum::<f64>() / n;
    let response = test.forward.value(parameters).unwrap()[0];
    let gaps: Vec<f64> = forces.iter().map(|force| (force - response) / unit).collect();
    let (sum, squares) = gaps.iter().fold((0.0, 0.0), |(a, b), gap| (a + gap, b + gap * gap));
    let shared = test.evidence.shared[0][0];
    let at = |sd: f64| {
        let own = sd * sd;
        let all = own + n * shared;
        let quadratic = (squares - shared * sum * sum / all) / own;
        let prior = ((sd - 0.15) / 0.25).powi(2);
        (-0.5 * ((n - 1.0) * own.ln() + all.ln() + quadratic + prior)).exp()
    };
    midpoints(0.0, 1.2, 600).into_iter().map(at).sum()
}

/// Weighted mean and standard deviation.
#[derive(Default)]
struct Moments([f64; 3]);

impl Moments {
    fn add(&mut self, weight: f64, x: f64) {
        let terms = [weight, weight * x, weight * x * x];
        self.0.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
    }

    fn check(&self, posterior: &Posterior, name: &str) {
        let [mass, first, second] = self.0;
        let mean = first / mass;
        check::mean(posterior, name, mean).within_mcse(4.0);
        check::sd(posterior, name, (second / mass - mean * mean).sqrt()).within_mcse(4.0);
    }
}

/// E is shared, and only the second test has friction. E and friction can be identified only from both
/// tests together.
#[test]
fn a_shared_parameter_and_one_of_a_single_test_are_those_of_quadrature() {
    let tests = [
        linear("fast", &[0.3], &[104.0, 111.0, 108.0], 4e-4),
        linear("slow", &[0.2, 60.0], &[113.0, 106.0], 9e-4),
    ];
    let joint = calibrate_tests(&tests, &BTreeMap::new(), &sampler(8), 0, 8).unwrap();
    assert_eq!(joint.names, [YOUNG, "test.friction"]);
    let dependences = [vec![vec![(0, 1.0)]], vec![vec![(0, 1.0)], vec![(1, 1.0)]]];
    assert_eq!(joint.dependences, dependences);
    let (mut young, mut friction) = (Moments::default(), Moments::default());
    for e in midpoints(200.0, 400.0, 60) {
        let fast = likelihood(&tests[0], &[e]);
        for f in midpoints(0.0, 0.4, 40) {
            let weight = fast * likelihood(&tests[1], &[e, f]);
            young.add(weight, e);
            friction.add(weight, f);
        }
    }
    young.check(&joint.posterior, "theta[0]");
    friction.check(&joint.posterior, "theta[1]");
}

fn trend(at: &[(&str, f64)], is_logarithmic: bool, deviation: f64) -> BetweenTests {
    let at = at.iter().map(|&(name, x)| (name.to_owned(), x)).collect();
    BetweenTests::Trend(TrendOverTests { at, is_logarithmic, unit: "°C".to_owned(), deviation })
}

/// Likelihood of each test on a grid of its E, which is interpolated linearly.
struct Tables([Vec<f64>; 3]);

impl Tables {
    fn of(tests: &[JointTest; 3]) -> Self {
        let grid = midpoints(200.0, 400.0, 400);
        Self(tests.each_ref().map(|test| grid.iter().map(|&e| likelihood(test, &[e])).collect()))
    }

    fn at(&self, test: usize, e: f64) -> f64 {
        let place = ((e - 200.25) / 0.5).clamp(0.0, 398.999);
        let (low, part) = (place as usize, place.fract());
        self.0[test][low] * (1.0 - part) + self.0[test][low + 1] * part
    }
}

fn three_temperatures() -> ([JointTest; 3], [(&'static str, f64); 3]) {
    let tests = [
        linear("cold", &[0.3], &[116.0, 121.0, 118.0], 1e-4),
        linear("warm", &[0.3], &[104.0, 99.0, 103.0, 101.0], 4e-4),
        linear("hot", &[0.25], &[90.0, 87.0], 1e-4),
    ];
    (tests, [("cold", 20.0), ("warm", 35.0), ("hot", 60.0)])
}

/// The logarithm of E is linear in the temperature: compares the values at the lowest and highest temperature with
/// quadrature. The middle temperature is 0.375 of the way.
#[test]
fn a_trend_is_that_of_quadrature() {
    let (tests, at) = three_temperatures();
    let between = BTreeMap::from([(YOUNG.to_owned(), trend(&at, false, 0.0))]);
    check::gradient(&calibration_over_tests(&JointTests::new(&tests, &between).unwrap()), 3);
    let joint = calibrate_tests(&tests, &between, &sampler(8), 0, 8).unwrap();
    assert_eq!(joint.names, ["matrix.young_mpa (at 20 °C)", "matrix.young_mpa (at 60 °C)"]);
    let tables = Tables::of(&tests);
    let mut found: [Moments; 2] = Default::default();
    for cold in midpoints(200.0, 400.0, 160) {
        for hot in midpoints(200.0, 400.0, 160) {
            let warm = cold.powf(0.625) * hot.powf(0.375);
            let weight = tables.at(0, cold) * tables.at(1, warm) * tables.at(2, hot);
            found[0].add(weight, cold);
            found[1].add(weight, hot);
        }
    }
    found[0].check(&joint.posterior, "theta[0]");
    found[1].check(&joint.posterior, "theta[1]");
    assert!(joint.variances_between.concat().iter().all(|variance| *variance == 0.0));
    // derivatives of E in the middle test with respect to its values at the ends
    let [cold, hot] = ["theta[0]", "theta[1]"].map(|name| moments(&joint.posterior, name)[0].0);
    let warm = |cold: f64, hot: f64| cold.powf(0.625) * hot.powf(0.375);
    let slopes = [
        (warm(cold + 0.01, hot) - warm(cold - 0.01, hot)) / 0.02,
        (warm(cold, hot + 0.01) - warm(cold, hot - 0.01)) / 0.02,
    ];
    for ((index, slope), (place, expected)) in
        joint.dependences[1][0].iter().zip(slopes.iter().enumerate())
    {
        assert!(*index == place && (slope - expected).abs() < 1e-6, "{slope} {expected}");
    }
    // without the cold test the names and the meaning of the parameters are the same
    let others = calibrate_tests(&tests[1..], &between, &sampler(9), 0, 9).unwrap();
    assert_eq!(others.names, joint.names);
}

/// The values deviate from the trend: compares the values at the ends and the value in the middle test with quadrature.
#[test]
fn deviations_from_a_trend_are_those_of_quadrature() {
    let (tests, at) = three_temperatures();
    let scale = 0.08;
    let between = BTreeMap::from([(YOUNG.to_owned(), trend(&at, false, scale))]);
    check::gradient(&calibration_over_tests(&JointTests::new(&tests, &between).unwrap()), 3);
    let sampler = sampler(10).target_accept(0.95);
    let joint = calibrate_tests(&tests, &between, &sampler, 0, 10).unwrap();
    let tables = Tables::of(&tests);
    let (bottom, width) = (200f64.ln(), 2f64.ln());
    let normal: Vec<(f64, f64)> =
        midpoints(-4.5, 4.5, 60).into_iter().map(|z| (z, (-0.5 * z * z).exp())).collect();
    // likelihood of a test if the trend has the value `e`, integrated over the deviation of E from the trend; and the
    // integrals of the likelihood times E and times E²
    let of_test = |test: usize, e: f64, spread: f64| {
        let share = (e.ln() - bottom) / width;
        let logit = (share / (1.0 - share)).ln();
        normal.iter().fold([0.0; 3], |[a, b, c], &(z, weight)| {
            let logit = logit + 4.0 * spread * z / width;
            let e = (bottom + width / (1.0 + (-logit).exp())).exp();
            let weight = weight * tables.at(test, e);
            [a + weight, b + weight * e, c + weight * e * e]
        })
    };
    let grid = midpoints(200.0, 400.0, 60);
    let mut found: [Moments; 3] = Default::default();
    for spread in midpoints(0.0, 0.36, 40) {
        let prior = (-0.5 * (spread / scale).powi(2)).exp();
        let [cold, hot] = [0, 2]
            .map(|test| grid.iter().map(|&e| of_test(test, e, spread)[0]).collect::<Vec<_>>());
        for (i, &a) in grid.iter().enumerate() {
            for (j, &b) in grid.iter().enumerate() {
                let ends = prior * cold[i] * hot[j];
                let middle = of_test(1, a.powf(0.625) * b.powf(0.375), spread);
                found[0].add(ends * middle[0], a);
                found[1].add(ends * middle[0], b);
                found[2].0.iter_mut().zip(middle).for_each(|(sum, term)| *sum += ends * term);
            }
        }
    }
    for (moments, name) in found.iter().zip(["theta[0]", "theta[1]", "in_test[1]"]) {
        moments.check(&joint.posterior, name);
    }
    assert!(joint.variances_between.concat().iter().all(|variance| *variance > 0.0));
}

/// Draws for a test that was not calibrated: a trend at another temperature, and a varying parameter about its centre.
#[test]
fn new_tests_have_the_parameters_of_the_population() {
    let (tests, at) = three_temperatures();
    let sampler = sampler(8).draws(500);
    let between = BTreeMap::from([(YOUNG.to_owned(), trend(&at, false, 0.0))]);
    let joint = calibrate_tests(&tests, &between, &sampler, 0, 8).unwrap();
    let theta = joint.posterior.posterior.get("theta").unwrap().data.clone();
    let draws = |at: f64| joint.draws_in_new_test(1, &BTreeMap::from([(YOUNG.to_owned(), at)]), 1);
    for (row, ends) in draws(50.0).iter().zip(theta.chunks(2)) {
        let exact = ends[0].powf(0.25) * ends[1].powf(0.75);
        assert!((row[0] / exact - 1.0).abs() < 1e-9, "{row:?} {exact}");
    }
    // at the ends of the trend, the values equal the values in the calibrated tests
    for (row, ends) in draws(20.0).iter().zip(theta.chunks(2)) {
        assert!((row[0] / ends[0] - 1.0).abs() < 1e-9, "{row:?} {ends:?}");
    }

    let between = BTreeMap::from([(YOUNG.to_owned(), BetweenTests::Varies { scale: 0.1 })]);
    let joint = calibrate_tests(&tests, &between, &sampler, 0, 8).unwrap();
    let group = &joint.posterior.posterior;
    let data = |name: &str| group.get(name).unwrap().data.clone();
    let (theta, spread) = (data("theta"), data("spread"));
    let new: Vec<f64> = joint.draws_in_new_test(0, &BTreeMap::new(), 1).concat();
    // on the scale of the logit, the deviations divided by their standard deviation are standard normal
    let (bottom, width) = (200f64.ln(), 2f64.ln());
    let logit = |e: f64| {
        let share = (e.ln() - bottom) / width;
        (share / (1.0 - share)).ln()
    };
    let units: Vec<f64> = new
        .iter()
        .zip(&theta)
        .zip(&spread)
        .map(|((e, centre), spread)| (logit(*e) - logit(*centre)) * width / (4.0 * spread))
        .collect();
    let n = units.len() as f64;
    let mean = units.iter().sum::<f64>() / n;
    let variance = units.iter().map(|z| z * z).sum::<f64>() / n;
    assert!(mean.abs() < 4.0 / n.sqrt(), "{mean}");
    assert!((variance - 1.0).abs() < 4.0 * (2.0 / n).sqrt(), "{variance}");
}

/// If a parameter is proportional to a power of the rate, its logarithm is a linear function of the logarithm of the
/// rate.
#[test]
fn a_power_law_of_the_rate_is_a_trend() {
    let tests = three_temperatures().0;
    let at = [("cold", 100.0), ("warm", 10.0), ("hot", 0.1)];
    let between = BTreeMap::from([(YOUNG.to_owned(), trend(&at, true, 0.0))]);
    let prepared = JointTests::new(&tests, &between).unwrap();
    let (slow, exponent) = (240.0, 0.05);
    let fast = slow * 1000f64.powf(exponent);
    let value = |test: usize| prepared.tests[test].point(&[slow, fast], &[])[0];
    for (test, rate) in [100.0, 10.0, 0.1].into_iter().enumerate() {
        let exact = slow * (rate / 0.1f64).powf(exponent);
        assert!((value(test) / exact - 1.0).abs() < 1e-12, "{} {exact}", value(test));
    }
}

/// E varies between two tests about a common centre: compares the centre and the values in the tests with quadrature.
#[test]
fn a_varying_parameter_is_that_of_quadrature() {
    let tests = [
        linear("fast", &[0.3], &[99.0, 102.0, 100.5, 101.0], 1e-4),
        linear("slow", &[0.3], &[113.0, 110.0, 112.0], 1e-4),
    ];
    let scale = 0.1;
    let varies = BTreeMap::from([(YOUNG.to_owned(), BetweenTests::Varies { scale })]);
    check::gradient(&calibration_over_tests(&JointTests::new(&tests, &varies).unwrap()), 3);
    let sampler = sampler(9).target_accept(0.95);
    let joint = calibrate_tests(&tests, &varies, &sampler, 0, 9).unwrap();
    // the likelihood of each test on a grid of its own E, interpolated linearly
    let grid = midpoints(200.0, 400.0, 400);
    let tables = tests
        .each_ref()
        .map(|test| grid.iter().map(|&e| likelihood(test, &[e])).collect::<Vec<f64>>());
    let at = |table: &[f64], e: f64| {
        let place = ((e - grid[0]) / 0.5).clamp(0.0, 398.999);
        let (low, part) = (place as usize, place.fract());
        table[low] * (1.0 - part) + table[low + 1] * part
    };
    let (bottom, width) = (200f64.ln(), 2f64.ln());
    let moved = |e: f64, by: f64| {
        let share = (e.ln() - bottom) / width;
        let logit = (share / (1.0 - share)).ln() + 4.0 * by / width;
        (bottom + width / (1.0 + (-logit).exp())).exp()
    };
    let normal: Vec<(f64, f64)> =
        midpoints(-4.5, 4.5, 90).into_iter().map(|z| (z, (-0.5 * z * z).exp())).collect();
    let mut found: [Moments; 3] = Default::default();
    for e in midpoints(200.0, 400.0, 100) {
        for spread in midpoints(0.0, 0.45, 90) {
            let prior = (-0.5 * (spread / scale).powi(2)).exp();
            let own: Vec<[f64; 3]> = tables
                .iter()
                .map(|table| {
                    let mut sums = [0.0; 3];
                    for &(z, weight) in &normal {
                        let value = moved(e, spread * z);
                        let weight = weight * at(table, value);
                        let terms = [weight, weight * value, weight * value * value];
                        sums.iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
                    }
                    sums
                })
                .collect();
            found[0].add(prior * own[0][0] * own[1][0], e);
            for (k, moments) in found[1..].iter_mut().enumerate() {
                let other = prior * own[1 - k][0];
                moments.0.iter_mut().zip(own[k]).for_each(|(sum, term)| *sum += other * term);
            }
        }
    }
    for (moments, name) in found.iter().zip(["theta[0]", "in_test[0]", "in_test[1]"]) {
        moments.check(&joint.posterior, name);
    }
    // each test has its own value of the varying parameter
    for (k, draws) in joint.tests.iter().enumerate() {
        let trace = joint.posterior.trace(&format!("in_test[{k}]")).unwrap().concat();
        let gap = draws.theta.iter().zip(&trace).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        assert!(gap < 1e-9, "{gap}");
    }
}

/// A calibration of one test that is created from joint draws contains the joint draws, and its predictions
/// and densities are computed from the joint draws.
#[test]
fn a_test_sees_the_joint_posterior() {
    let tests = [six_specimens("fast"), linear("slow", &[0.4], &[99.0, 102.0, 100.5], 4e-4)];
    // both tests have the same box
    let box_of = |mut test: JointTest| {
        let input = Input::new(YOUNG, 250.0, 300.0).unwrap();
        let terms = [(vec![0], vec![100.0]), (vec![1], vec![10.0 / 3f64.sqrt()])];
        test.forward = DynPce::from_terms(vec![input], vec!["peak_force_N".into()], terms).unwrap();
        test.priors = Prior::uniform_on(test.forward.inputs());
        test
    };
    let [fast, slow] = tests;
    let tests = [fast, box_of(slow)];
    let joint = calibrate_tests(&tests, &BTreeMap::new(), &sampler(4), 0, 4).unwrap();
    for (test, draws) in tests.iter().zip(&joint.tests) {
        let single =
            calibration_of_draws(&test.forward, &test.priors, &test.evidence, draws).unwrap();
        let theta = |posterior: &Posterior| posterior.trace("theta[matrix.young_mpa]").unwrap();
        for (ours, joint) in theta(&single.posterior).iter().zip(theta(&joint.posterior)) {
            for (a, b) in ours.iter().zip(joint) {
                assert!((a - b).abs() < 1e-9, "{a} {b}");
            }
        }
        assert_eq!(single.map, joint.map);
        assert!(single.mode.is_none());
        let loo = single.loo().unwrap();
        assert_eq!(loo.points.len(), test.evidence.qois.len());
        assert!(single.posterior.predictive.get("new_specimen").is_some());
    }
    // the joint calibration has more data than the separate calibration of the first test
    let sd = |posterior: &Posterior| moments(posterior, "theta[matrix.young_mpa]")[1].0;
    assert!(sd(&joint.posterior) < sd(&CALIBRATED.posterior));
}

#[test]
fn the_same_seed_gives_the_same_draws_on_any_number_of_threads() {
    let tests = [six_specimens("a"), six_specimens("b")];
    let run = |threads: usize| {
        let sampler = Nuts::default().chains(2).warmup(100).draws(100).seed(3).threads(threads);
        calibrate_tests(&tests, &BTreeMap::new(), &sampler, 10, 3).unwrap()
    };
    let (one, two) = (run(1), run(2));
    assert_eq!(one.tests, two.tests);
    assert_eq!(one.map, two.map);
    assert_eq!(one.tests[0].draws, 90);
}

#[test]
fn inconsistent_tests_are_refused_with_their_name() {
    let test = || linear("fast", &[0.3], &[104.0, 111.0], 0.0);
    let slow =
        || JointTest { name: "slow".into(), ..linear("slow", &[0.3, 1.0], &[99.0, 101.0], 0.0) };
    let varies = BetweenTests::Varies { scale: 0.1 };
    let between = |name: &str, relation| BTreeMap::from([(name.to_owned(), relation)]);
    let none = BTreeMap::new;
    let single =
        JointTest { evidence: Evidence { qois: vec![vec![1.0]], ..Evidence::default() }, ..slow() };
    let own = JointTest { own: vec!["matrix.poisson".into()], ..slow() };
    let mut wider = slow();
    wider.priors[0] = Prior::uniform(200.0, 500.0);
    let mut other = slow();
    other.priors[0] = Prior::new(PriorFamily::Normal, &[300.0, 50.0]).within(200.0, 400.0);
    let cases = [
        (vec![test(), test()], none(), "fast is the name of two tests"),
        (vec![test(), single], none(), "slow has 1 specimen"),
        (vec![test(), own], none(), "slow has no parameter matrix.poisson"),
        (vec![test(), wider], none(), "the ranges of the priors"),
        (vec![test(), other], none(), "slow has another prior of matrix.young_mpa"),
        (
            vec![test()],
            between("matrix.poisson", varies.clone()),
            "is not a parameter of the tests",
        ),
        (
            vec![test()],
            between(YOUNG, BetweenTests::Varies { scale: 0.0 }),
            "must be finite and above 0",
        ),
        (vec![test(), slow()], between("test.friction", varies), "no logarithm at its lower bound"),
        (vec![test()], between(YOUNG, trend(&[("slow", 1.0)], false, 0.0)), "no value for fast"),
        (vec![test()], between(YOUNG, trend(&[("fast", 1.0)], false, 0.0)), "the same value of it"),
        (vec![test()], between(YOUNG, trend(&[("fast", 0.0)], true, 0.0)), "is impossible"),
        (
            vec![test()],
            between(YOUNG, trend(&[("fast", 1.0), ("slow", 2.0)], true, -1.0)),
            "deviates from its trend by -1",
        ),
    ];
    for (tests, between, expected) in cases {
        let error = JointTests::new(&tests, &between).unwrap_err().to_string();
        assert!(error.contains(expected), "{expected:?} is not in {error:?}");
    }
}

/// The 90 % interval of a shared parameter contains the truth in 90 % of emulated laboratories with two tests, each
/// with a shared error that its covariance states.
#[test]
fn intervals_cover_over_laboratories() {
    const LABORATORIES: u64 = 60;
    let covered: f64 = (0..LABORATORIES)
        .into_par_iter()
        .map(|seed| {
            let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
            let truth = 240.0 + 120.0 * rng.random::<f64>();
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            let mut test = |name: &str, slope: f64, sd: f64, shared: f64, n: usize| {
                let mean = (100.0 + slope * (truth - 300.0)) * (1.0 + shared * normal());
                let forces: Vec<f64> = (0..n).map(|_| mean * (1.0 + sd * normal())).collect();
                linear(name, &[slope], &forces, shared * shared)
            };
            let tests = [test("fast", 0.3, 0.05, 0.02, 6), test("slow", 0.2, 0.03, 0.03, 4)];
            let sampler = Nuts::default().chains(2).warmup(200).draws(200).seed(seed).threads(1);
            let joint = calibrate_tests(&tests, &BTreeMap::new(), &sampler, 0, seed).unwrap();
            let [low, high] = joint.posterior.interval("theta[0]", 0.9).unwrap();
            f64::from(u8::from((low..=high).contains(&truth)))
        })
        .sum();
    let share = covered / LABORATORIES as f64;
    let error = (0.9 * 0.1 / LABORATORIES as f64).sqrt();
    assert!((share - 0.9).abs() < 3.0 * error, "{share} ± {error}");
}
