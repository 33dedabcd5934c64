//! Compares calibrations over groups with quadrature and with the true parameters of emulated laboratories.

use ppl::check;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use surrogate::{Dataset, DesignMethod, FitOptions};

use super::*;

/// Forward model whose peak force is `factor` N per MPa of the modulus.
fn proportional(factor: f64) -> DynPce {
    let x = Input::new("matrix.young_mpa", 200.0, 400.0).unwrap();
    let slope = factor * 100.0 / 3f64.sqrt();
    let terms = [(vec![0], vec![300.0 * factor]), (vec![1], vec![slope])];
    DynPce::from_terms(vec![x], vec!["peak_force_N".into()], terms).unwrap()
}

fn group(temperature_c: f64, factor: f64, forces: &[f64], shared: f64) -> TestGroup {
    let qois = forces.iter().map(|&force| vec![force]).collect();
    let evidence = Evidence { qois, shared: vec![vec![shared]], ..Evidence::default() };
    TestGroup { name: "group".into(), temperature_c, forward: proportional(factor), evidence }
}

fn priors_of(groups: &[TestGroup]) -> Vec<Prior> {
    Prior::uniform_on(groups[0].forward.inputs())
}

/// Compares the posterior of E at all temperatures, and of the scatter, with sums over a grid. There are three
/// temperatures, two microstructures, a group with a single specimen, and an error that the specimens of a group share.
#[test]
fn the_posterior_is_that_of_quadrature() {
    let groups = [
        group(50.0, 0.5, &[142.0, 135.0, 149.0], 4e-4),
        group(90.0, 0.5, &[172.0, 160.0], 4e-4),
        group(66.0, 0.6, &[183.0], 9e-4),
    ];
    let pooling = Pooling { trends: vec![Trend::LogLinear], deviation: 0.0 };
    let sampler = Nuts::default().chains(4).draws(2000).seed(4);
    let posterior = calibrate_groups(&groups, &priors_of(&groups), &pooling, &sampler).unwrap();

    // the quantities of all specimens of a group are one normal vector, whose covariance sd² I + S 1 1ᵀ has a known
    // inverse
    let ln_density = |young: f64, sd: f64, group: &TestGroup| {
        let forces: Vec<f64> = group.evidence.qois.concat();
        let n = forces.len() as f64;
        let unit = forces.iter().sum::<f64>() / n;
        let response = group.forward.value(&[young]).unwrap()[0];
        let gaps: Vec<f64> = forces.iter().map(|force| (force - response) / unit).collect();
        let (sum, squares) = gaps.iter().fold((0.0, 0.0), |(a, b), gap| (a + gap, b + gap * gap));
        let (own, shared) = (sd * sd, group.evidence.shared[0][0]);
        let all = own + n * shared;
        -0.5 * ((n - 1.0) * own.ln() + all.ln() + (squares - shared * sum * sum / all) / own)
    };
    let steps = |a: f64, b: f64, n: usize| {
        (0..n).map(move |i| a + (b - a) * (i as f64 + 0.5) / n as f64).collect::<Vec<f64>>()
    };
    let grid = steps(200.0, 400.0, 100);
    let (mut mass, mut moments) = (0.0, [[0.0; 2]; 4]);
    for sd in steps(0.0, 0.8, 160) {
        for &low in &grid {
            for &high in &grid {
                let middle = low.powf(0.6) * high.powf(0.4);
                let likelihood = ln_density(low, sd, &groups[0])
                    + ln_density(high, sd, &groups[1])
                    + ln_density(middle, sd, &groups[2]);
                let weight = (likelihood - 0.5 * ((sd - 0.15) / 0.25).powi(2)).exp();
                mass += weight;
                for (moment, x) in moments.iter_mut().zip([low, high, middle, sd]) {
                    moment[0] += weight * x;
                    moment[1] += weight * x * x;
                }
            }
        }
    }
    let names = ["theta[0,0]", "theta[2,0]", "theta[1,0]", "sd[0]"];
    for (name, moment) in names.into_iter().zip(moments) {
        let mean = moment[0] / mass;
        check::mean(&posterior, name, mean).within_mcse(4.0);
        check::sd(&posterior, name, (moment[1] / mass - mean * mean).sqrt()).within_mcse(4.0);
    }
}

/// Surrogate of the viscous limit, in which the toughness has no effect: slope ~ E, peak force ~ E^(2/3) ξ^(1/3),
/// displacement at peak ~ (ξ/E)^(1/3). `stiffness` is the factor of the microstructure on slope and peak force.
fn viscous_limit(stiffness: f64) -> DynPce {
    let bounds = [("young", 200.0, 450.0), ("toughness", 1e-5, 5e-3), ("viscosity", 0.05, 0.6)];
    let inputs = bounds.map(|(name, low, high)| Input::new(name, low, high).unwrap()).to_vec();
    let parameter_points = DesignMethod::Sobol.sample(&inputs, 64, 1).unwrap();
    let outputs = ["slope", "peak", "place"].map(str::to_owned).to_vec();
    let mut data = Dataset::new(inputs, outputs, "closed form").unwrap();
    for x in parameter_points {
        let place = (x[2] / x[0]).cbrt();
        data.push(&x, &[5.0 * stiffness * x[0], 4.0 * stiffness * x[0] * place, place]).unwrap();
    }
    DynPce::fit(&data, &FitOptions::default()).unwrap().pce
}

const TEMPERATURES_C: [f64; 4] = [50.0, 62.0, 75.0, 90.0];

/// Emulated laboratory: the true E and ξ at four temperatures, and two or three specimens per temperature. The
/// logarithms of E and ξ deviate by 2 % from their lines.
fn laboratory(seed: u64, microstructures: &[DynPce]) -> ([[f64; 2]; 4], Vec<TestGroup>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut between = |low: f64, high: f64| low + (high - low) * rng.random::<f64>();
    let (young, viscosity) = (between(240.0, 320.0), between(0.15, 0.35));
    let (by_young, by_viscosity) = (between(-0.1, 0.2), between(-0.3, 0.3));
    let toughness = between(1e-3, 4e-3);
    let mut normal = || rng.sample::<f64, _>(StandardNormal);
    let truths = TEMPERATURES_C.map(|t| {
        let place = (t - 50.0) / 40.0;
        let off = [0.02 * normal(), 0.02 * normal()];
        [
            young * (by_young * place + off[0]).exp(),
            viscosity * (by_viscosity * place + off[1]).exp(),
        ]
    });
    let groups =
        truths.iter().zip(TEMPERATURES_C).enumerate().map(|(k, (truth, temperature_c))| {
            let forward = microstructures[k % 2].clone();
            let mean = forward.value(&[truth[0], toughness, truth[1]]).unwrap();
            let mut specimen = || {
                let common = normal();
                let scatter = [0.04, 0.05, 0.02].map(|sd| sd * (0.6 * common + 0.8 * normal()));
                mean.iter().zip(scatter).map(|(m, z)| m * (1.0 + z)).collect::<Vec<f64>>()
            };
            let qois = (0..2 + k % 2).map(|_| specimen()).collect();
            let evidence = Evidence { qois, ..Evidence::default() };
            TestGroup { name: format!("{temperature_c}"), temperature_c, forward, evidence }
        });
    (truths, groups.collect())
}

/// The 90 % intervals of E and ξ at each temperature contain the truth in 90 % of 32 laboratories. The results at the
/// temperatures of one laboratory are correlated, so that the standard error is computed from the number of
/// laboratories.
#[test]
fn intervals_cover_over_laboratories() {
    const LABORATORIES: u64 = 32;
    let microstructures = [viscous_limit(1.0), viscous_limit(1.06)];
    let trends = vec![Trend::LogLinear, Trend::Constant, Trend::LogLinear];
    let pooling = Pooling { trends, deviation: 0.03 };
    let covered: Vec<[f64; 2]> = (0..LABORATORIES)
        .into_par_iter()
        .map(|seed| {
            let (truths, groups) = laboratory(seed, &microstructures);
            // with 200 draws, an end of an interval has an error of about a tenth of its length, which is small
            // compared with the standard error of 0.05 of the share
            let sampler = Nuts::default().chains(1).warmup(200).draws(200).seed(seed).threads(1);
            let posterior =
                calibrate_groups(&groups, &priors_of(&groups), &pooling, &sampler).unwrap();
            [0, 2].map(|parameter| {
                let inside = |(level, truth): (usize, &[f64; 2])| {
                    let draws = posterior.trace(&format!("theta[{level},{parameter}]")).unwrap();
                    let [low, high] =
                        [0.05, 0.95].map(|p| ppl::diagnostics::quantile(&draws.concat(), p));
                    f64::from(u8::from((low..=high).contains(&truth[parameter / 2])))
                };
                truths.iter().enumerate().map(inside).sum::<f64>() / 4.0
            })
        })
        .collect();
    let n = LABORATORIES as f64;
    let error = (0.9 * 0.1 / n).sqrt();
    for parameter in 0..2 {
        let share = covered.iter().map(|c| c[parameter]).sum::<f64>() / n;
        assert!((share - 0.9).abs() < 2.5 * error, "parameter {parameter}: {share} ± {error}");
    }
}

#[test]
fn gradients_are_derivatives() {
    let (_, groups) = laboratory(3, &[viscous_limit(1.0), viscous_limit(1.06)]);
    let trends = vec![Trend::LogLinear, Trend::Constant, Trend::LogLinear];
    for deviation in [0.0, 0.05] {
        let pooling = Pooling { trends: trends.clone(), deviation };
        let groups = Groups::new(&groups, &priors_of(&groups), &pooling).unwrap();
        check::gradient(&calibration_over_groups(&groups), 1);
    }
}

/// A parameter that deviates from the line stays in the box. In the middle of the box, the deviation is a change of the
/// logarithm.
#[test]
fn parameters_stay_in_the_box() {
    let groups = [group(50.0, 0.5, &[142.0, 135.0], 0.0), group(90.0, 0.5, &[150.0], 0.0)];
    let pooling = Pooling { trends: vec![Trend::LogLinear], deviation: 0.1 };
    let groups = Groups::new(&groups, &priors_of(&groups), &pooling).unwrap();
    let at = |place: f64, low: f64, high: f64, off: f64| {
        groups.parameters(place, &[low], &[high], &[off])[0]
    };
    approx::assert_relative_eq!(
        at(0.5, 210.0, 390.0, 0.0),
        (210f64 * 390.0).sqrt(),
        max_relative = 1e-12
    );
    let middle = 80_000f64.sqrt();
    approx::assert_relative_eq!(
        at(0.0, middle, 300.0, 1e-4),
        middle * 1e-4f64.exp(),
        max_relative = 1e-8
    );
    for off in [-9.0, 9.0] {
        assert!((200.0..=400.0).contains(&at(1.0, 300.0, 399.0, off)));
    }
}

#[test]
fn groups_that_do_not_belong_together_are_refused() {
    let good = || vec![group(50.0, 0.5, &[142.0, 135.0], 0.0), group(90.0, 0.5, &[150.0], 0.0)];
    let follows = Pooling { trends: vec![Trend::LogLinear], deviation: 0.0 };
    let message = |groups: &[TestGroup], pooling: &Pooling| {
        Groups::new(groups, &priors_of(groups), pooling).unwrap_err().to_string()
    };
    assert!(Groups::new(&good(), &priors_of(&good()), &follows).is_ok());
    assert!(message(&good()[1..], &follows).contains("at least two"));
    let at_one: Vec<TestGroup> =
        good().into_iter().map(|group| TestGroup { temperature_c: 50.0, ..group }).collect();
    let one = message(&at_one, &follows);
    assert!(
        one.contains("matrix.young_mpa has a trend with temperature, but all groups have the same temperature"),
        "{one}"
    );
    let none = Pooling { trends: Vec::new(), deviation: 0.0 };
    assert!(message(&good(), &none).contains("0 trends for 1 parameters"));
    let negative = Pooling { deviation: -1.0, ..follows.clone() };
    assert!(message(&good(), &negative).contains("deviation of -1"));
    let mut other = good();
    other[1].forward = viscous_limit(1.0);
    assert!(message(&other, &follows).contains("does not have the parameters of group"));
}
