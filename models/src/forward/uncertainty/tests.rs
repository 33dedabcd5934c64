//! Coverage of intervals that include the error of a mean response estimated from few specimens, in emulated
//! laboratories without simulations.

use ppl::prelude::*;
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use surrogate::{Dataset, DesignMethod, Input};

use super::*;
use crate::case::SurrogateCase;
use crate::results_folder::turns::in_turn;
use crate::runs::made_on::SEED;
use crate::simulation::stiffness::STIFFNESS_RATIO;

const SPECIMENS: usize = 12;
const RUNS: usize = 60;

/// Effects of the grains of a specimen: logarithm of the stiffness ratio, and logarithm of the remaining effect on each
/// quantity.
struct Grains {
    ratio: f64,
    rest: [f64; 2],
}

impl Grains {
    fn draw(rng: &mut impl Rng, [of_ratio, rest]: [f64; 2]) -> Self {
        let mut normal = |sd: f64| sd * rng.sample::<f64, _>(StandardNormal);
        Self { ratio: normal(of_ratio), rest: [normal(rest), normal(rest)] }
    }

    /// Slope and displacement at the peak in the viscous limit.
    fn quantities(&self, [young, viscosity]: [f64; 2], noise: [f64; 2]) -> Vec<f64> {
        let slope = (young / 275.0).ln() + self.ratio + self.rest[0] + noise[0];
        let place = (viscosity / young * 900.0).ln() / 3.0 + 0.3 * self.ratio;
        let place = place + self.rest[1] + noise[1];
        vec![2000.0 * slope.exp(), 0.12 * place.exp()]
    }
}

fn prior() -> Vec<Input> {
    vec![Input::new("young", 200.0, 370.0).unwrap(), Input::new("viscosity", 0.1, 0.6).unwrap()]
}

/// A laboratory with an ensemble on a few specimens. If `shared` is false, the runs are treated as if each run had a
/// separate specimen.
struct Laboratory {
    seed: u64,
    /// Number of specimens of the ensemble.
    count: usize,
    /// Standard deviations of the logarithm of the stiffness ratio and of the remaining effect of the grains.
    scatter: [f64; 2],
    knows_ratio: bool,
}

impl Laboratory {
    fn runs(&self, rng: &mut impl Rng, shared: bool) -> Dataset {
        let grains: Vec<Grains> =
            (0..self.count).map(|_| Grains::draw(rng, self.scatter)).collect();
        let outputs = vec!["slope_N_per_mm".into(), "displacement_at_peak_mm".into()];
        let mut runs = Dataset::new(prior(), outputs, "emulated").unwrap();
        runs = runs.with_notes(&[SEED, STIFFNESS_RATIO]).unwrap();
        let design = DesignMethod::LatinHypercube.sample(&prior(), RUNS, self.seed).unwrap();
        let turns = in_turn(RUNS, self.count, self.seed);
        for (i, (x, place)) in design.iter().zip(turns).enumerate() {
            let noise = [(); 2].map(|()| 0.001 * rng.sample::<f64, _>(StandardNormal));
            let y = grains[place].quantities([x[0], x[1]], noise);
            let name = if shared { place } else { i }.to_string();
            let ratio = match self.knows_ratio {
                true => (1.5 * grains[place].ratio.exp()).to_string(),
                false => String::new(),
            };
            runs.push_noted(x, &y, &[&name, &ratio]).unwrap();
        }
        runs
    }

    /// Returns whether the 90 % interval of E contains the true value, and the width of the interval. The estimate
    /// solves the mean response for the parameters, and the interval is computed with the model linearised at the
    /// estimate. The covariance of the specimens' mean is the sum of two parts: the scatter estimated from the
    /// specimens, divided by their number, and the errors that the specimens share.
    fn interval(&self, shared: bool) -> (bool, f64) {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(self.seed);
        let runs = self.runs(&mut rng, shared);
        let truth = [rng.random_range(235.0..320.0), rng.random_range(0.2..0.45)];
        let specimens: Vec<Grains> =
            (0..SPECIMENS).map(|_| Grains::draw(&mut rng, self.scatter)).collect();
        let qois: Vec<Vec<f64>> = specimens
            .iter()
            .map(|grains| {
                // the parameters of the material scatter slightly too
                let noise = [(); 2].map(|()| 0.005 * rng.sample::<f64, _>(StandardNormal));
                grains.quantities(truth, noise)
            })
            .collect();
        let ratio = |grains: &Grains| self.knows_ratio.then(|| 1.5 * grains.ratio.exp());
        let ratios: Vec<Option<f64>> = specimens.iter().map(ratio).collect();
        let case = SurrogateCase { max_order: 2, ..SurrogateCase::default() };
        let fitted = Fitted::of(&runs, &ratios, &case, Vec::new()).unwrap();
        assert_eq!(fitted.specimens.is_some(), shared);
        assert_eq!(fitted.known_stiffness.is_input(), self.knows_ratio);
        let means = column_means(&qois);
        let errors = SharedError::of(&fitted, &DiscrepancyCase::default(), &means).unwrap();
        let evidence = errors.evidence(qois, &fitted.known_stiffness);

        let own = |s: usize| evidence.known.get(s).cloned().flatten().unwrap_or_default();
        let mut theta = [280.0, 0.3];
        let (mut jacobian, mut residuals) = (DMatrix::zeros(2, 2), Vec::new());
        for _ in 0..6 {
            residuals.clear();
            jacobian.fill(0.0);
            for (s, y) in evidence.qois.iter().enumerate() {
                let place = [&theta[..], &own(s)].concat();
                let (value, slopes) = fitted.pce.value_and_jacobian(&place).unwrap();
                residuals.push([0, 1].map(|m| (y[m] - value[m]) / means[m]));
                for (i, j) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                    jacobian[(i, j)] += slopes[i][j] / means[i] / SPECIMENS as f64;
                }
            }
            let off = |m: usize| residuals.iter().map(|r| r[m]).sum::<f64>() / SPECIMENS as f64;
            let step = jacobian.clone().lu().solve(&DMatrix::from_fn(2, 1, |m, _| off(m))).unwrap();
            for (theta, (input, step)) in theta.iter_mut().zip(prior().iter().zip(step.iter())) {
                *theta = (*theta + step).clamp(input.lower, input.upper);
            }
        }
        let place = [&theta[..], &evidence.middle()].concat();
        let student = StudentT(SPECIMENS as f64 - 1.0, 0.0, 1.0).quantile(0.95);
        let freedom = (SPECIMENS * (SPECIMENS - 1)) as f64;
        let covariance = DMatrix::from_fn(2, 2, |i, j| {
            let scatter = residuals.iter().map(|r| r[i] * r[j]).sum::<f64>() / freedom;
            let open = |open: &CoefficientPosterior| open.error(&place, &means).unwrap()[i][j];
            let open: f64 = evidence.open.iter().map(open).sum();
            let all = evidence.shared[i][j] + open / (means[i] * means[j]);
            scatter * (student / NORMAL).powi(2) + all
        });
        let inverse = jacobian.try_inverse().unwrap();
        let half = NORMAL * (&inverse * covariance * inverse.transpose())[(0, 0)].sqrt();
        ((theta[0] - truth[0]).abs() < half, 2.0 * half)
    }
}

/// Quantile of the standard normal distribution at 95 %.
const NORMAL: f64 = 1.644854;

/// Coverage and mean width of 90 % intervals, with and without the error of a mean response estimated from few
/// specimens.
fn coverage(count: usize, scatter: [f64; 2], knows_ratio: bool) -> [(f64, f64); 2] {
    [true, false].map(|shared| {
        let of = |seed| Laboratory { seed, count, scatter, knows_ratio }.interval(shared);
        let found: Vec<(bool, f64)> = (0..LABORATORIES).into_par_iter().map(of).collect();
        let n = found.len() as f64;
        let covered = found.iter().filter(|(covered, _)| *covered).count() as f64 / n;
        let found = (covered, found.iter().map(|(_, width)| width).sum::<f64>() / n);
        println!("{count} specimens, counted {shared}, ratio {knows_ratio}: {found:?}");
        found
    })
}

const LABORATORIES: u64 = 300;

/// Standard error of a coverage of 90 %: √(0.9 · 0.1/300).
const STANDARD_ERROR: f64 = 0.0173;

#[test]
fn intervals_hold_what_three_images_leave_open() {
    let [with, without] = coverage(3, [0.02, 0.02], false);
    assert!((with.0 - 0.9).abs() < 3.0 * STANDARD_ERROR, "{with:?}");
    assert!(without.0 < 0.9 - 5.0 * STANDARD_ERROR, "{without:?}");
}

/// With the stiffness ratio as an input, the remaining scatter is small, so that the error from few specimens is small
/// too.
#[test]
fn intervals_hold_what_six_images_leave_open_beside_their_stiffness() {
    let [with, without] = coverage(6, [0.03, 0.01], true);
    assert!((with.0 - 0.9).abs() < 3.0 * STANDARD_ERROR, "{with:?}");
    assert!(without.0 < 0.9 - 5.0 * STANDARD_ERROR, "{without:?}");
    let [unknown, _] = coverage(6, [0.03, 0.01], false);
    assert!(with.1 < 0.8 * unknown.1, "{with:?} {unknown:?}");
}
