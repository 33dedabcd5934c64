//! What further tests are expected to tell, against calibrations with the data of such tests.

use models::{Belief, Evidence, FurtherTest, TestAtDraw, calibrate};
use ppl::Nuts;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};

const SPECIMENS: usize = 24;
/// Scatter of a slow specimen's peak over that of a fast one's.
const SLOW_SCATTER: f64 = 3.0;
/// E in MPa, Gc in N/mm, ξ in MPa s.
const BOX: [[f64; 2]; 3] = [[250.0, 300.0], [0.001, 0.004], [0.05, 0.55]];

/// Of a fast test, definitions of the viscous limit: m ~ E, F ~ E^(2/3) ξ^(1/3), d ~ (ξ/E)^(1/3), no Gc.
/// Of a slow one the rate-independent peak, (3/16) √(3 E Gc/l0).
fn quantities(x: &[f64]) -> [f64; 4] {
    let place = (x[2] / x[0]).cbrt();
    let slow = 3.0 / 16.0 * (3.0 * x[0] * x[1] / 0.06).sqrt();
    [5.0 * x[0], 4.0 * x[0] * place, place, slow]
}

/// An expansion of the first three, or of all.
fn forward(count: usize) -> DynPce {
    let names = ["young", "toughness", "viscosity"];
    let inputs: Vec<Input> =
        names.iter().zip(BOX).map(|(name, [a, b])| Input::new(*name, a, b).unwrap()).collect();
    let points = DesignMethod::Sobol.sample(&inputs, 200, 1).unwrap();
    let outputs = ["slope", "peak", "place", "slow"][..count].iter().map(|name| name.to_string());
    let mut data = Dataset::new(inputs, outputs.collect(), "closed form").unwrap();
    for x in points {
        data.push(&x, &quantities(&x)[..count]).unwrap();
    }
    DynPce::fit(&data, &FitOptions::default()).unwrap().pce
}

/// A draw of a posterior: parameters, and the factor of the relative covariance between specimens.
struct Draw {
    theta: Vec<f64>,
    sd: Vec<f64>,
    corr: Vec<f64>,
}

impl Draw {
    /// L of Σ = L Lᵀ.
    fn factor(&self, i: usize, j: usize) -> f64 {
        self.sd[i] * self.corr[i * self.sd.len() + j]
    }

    fn scatter(&self) -> Vec<Vec<f64>> {
        let n = self.sd.len();
        let entry =
            |i: usize, j: usize| (0..n).map(|k| self.factor(i, k) * self.factor(j, k)).sum();
        (0..n).map(|i| (0..n).map(|j| entry(i, j)).collect()).collect()
    }
}

/// Draws of a calibration.
fn posterior(forward: &DynPce, qois: Vec<Vec<f64>>, seed: u64) -> Vec<Draw> {
    let evidence = Evidence { qois, ..Evidence::default() };
    let sampler = Nuts::default().chains(2).warmup(400).draws(800).target_accept(0.9).seed(seed);
    let result = calibrate(forward, &evidence, &sampler, seed).unwrap();
    let of = |name: &str| result.posterior.posterior.get(name).unwrap().data.clone();
    let k = forward.outputs().len();
    let (theta, sd, corr) = (of("theta"), of("sd"), of("corr"));
    let rows = theta.chunks(3).zip(sd.chunks(k)).zip(corr.chunks(k * k));
    rows.map(|((theta, sd), corr)| Draw { theta: theta.into(), sd: sd.into(), corr: corr.into() })
        .collect()
}

fn contractions(draws: &[Draw]) -> [f64; 3] {
    let theta: Vec<Vec<f64>> = draws.iter().map(|draw| draw.theta.clone()).collect();
    let now = Belief::of_draws(&BOX, &theta).unwrap().now();
    [0, 1, 2].map(|i| now[i].contraction)
}

/// Specimens about `theta` that scatter as a draw says; a slow one by a multiple of the fast one's peak.
fn specimens(draw: &Draw, count: usize, rng: &mut Xoshiro256PlusPlus) -> Vec<Vec<f64>> {
    let mean = quantities(&draw.theta);
    let one = |_| {
        let mut normal = || rng.sample::<f64, _>(rand_distr::StandardNormal);
        let z: Vec<f64> = (0..4).map(|_| normal()).collect();
        let moved = |m: usize| match m {
            3 => SLOW_SCATTER * draw.sd[1] * z[3],
            m => (0..=m).map(|k| draw.factor(m, k) * z[k]).sum(),
        };
        (0..count).map(|m| mean[m] * (1.0 + moved(m))).collect()
    };
    (0..SPECIMENS).map(one).collect()
}

/// Laboratories that draw the truth from what the first specimens leave, test as many again, and are
/// calibrated to all: their mean contraction is what was expected. Slow tests are on specimens of their own.
#[test]
fn calibrations_with_further_specimens_contract_as_expected() {
    let (fast, all) = (forward(3), forward(4));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    // within the box of the prior, as scatter is not
    let corr = vec![1.0, 0.0, 0.0, 0.6, 0.8, 0.0, -0.3, 0.5, (1.0f64 - 0.34).sqrt()];
    let truth = Draw { theta: vec![277.0, 0.0022, 0.3], sd: vec![0.12, 0.1, 0.1], corr };
    let first = specimens(&truth, 3, &mut rng);
    let draws = posterior(&fast, first.clone(), 1);
    let now = contractions(&draws);
    assert!(now[0] > 0.2 && now[1] < 0.1, "{now:?}");

    let belief = {
        let theta: Vec<Vec<f64>> = draws.iter().map(|draw| draw.theta.clone()).collect();
        Belief::of_draws(&BOX, &theta).unwrap()
    };
    let relative = |draw: &Draw, outputs: std::ops::Range<usize>| {
        let (values, jacobian) = all.value_and_jacobian(&draw.theta).unwrap();
        let rows = outputs.map(|m| jacobian[m].iter().map(|slope| slope / values[m]).collect());
        rows.collect::<Vec<Vec<f64>>>()
    };
    let more = FurtherTest {
        draws: draws
            .iter()
            .step_by(4)
            .map(|draw| TestAtDraw { jacobian: relative(draw, 0..3), scatter: draw.scatter() })
            .collect(),
        shared: vec![vec![0.0; 3]; 3],
        seen: SPECIMENS,
    };
    let slow = FurtherTest {
        draws: draws
            .iter()
            .step_by(4)
            .map(|draw| TestAtDraw {
                jacobian: relative(draw, 3..4),
                scatter: vec![vec![(SLOW_SCATTER * draw.sd[1]).powi(2)]],
            })
            .collect(),
        shared: vec![vec![0.0]],
        seen: 0,
    };
    let laboratories = 20;
    let (mut of_more, mut of_slow) = (Vec::new(), Vec::new());
    for k in 0..laboratories {
        let truth = &draws[(k * draws.len()) / laboratories + 17];
        let second = specimens(truth, 4, &mut rng);
        let fast_ones = second.iter().map(|row| row[..3].to_vec());
        let both: Vec<Vec<f64>> = first.iter().cloned().chain(fast_ones).collect();
        of_more.push(contractions(&posterior(&fast, both, 2)));
        let beside = first.iter().zip(&second);
        let beside = beside.map(|(first, second)| [&first[..], &second[3..]].concat());
        of_slow.push(contractions(&posterior(&all, beside.collect(), 3)));
    }
    for (test, found) in [(more, of_more), (slow, of_slow)] {
        for (i, expected) in test.expected(&belief, SPECIMENS).unwrap().iter().enumerate() {
            let n = found.len() as f64;
            let mean = found.iter().map(|c| c[i]).sum::<f64>() / n;
            let variance = found.iter().map(|c| (c[i] - mean).powi(2)).sum::<f64>() / (n - 1.0);
            // three standard errors, and what a scatter that is sampled, and not known, adds to a variance
            // from 24 specimens: 2/(24 − 3) of it
            let tolerance = 3.0 * (variance / n).sqrt() + 0.1 * (1.0 - expected.contraction);
            assert!(
                (mean - expected.contraction).abs() < tolerance,
                "parameter {i}: {mean} found, {expected:?}, tolerance {tolerance}"
            );
        }
        // only the slow test tells Gc
        let toughness = found.iter().map(|c| c[1]).sum::<f64>() / found.len() as f64;
        assert_eq!(test.seen == 0, toughness > 0.5, "{toughness}");
    }
}
