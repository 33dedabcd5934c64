use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;

use super::coverage::binomial_tail;
use super::*;

struct Noise(Xoshiro256PlusPlus);

impl Noise {
    fn new(seed: u64) -> Self {
        Self(Xoshiro256PlusPlus::seed_from_u64(seed))
    }

    fn normal(&mut self, mean: f64, sd: f64) -> f64 {
        mean + sd * self.0.sample::<f64, _>(StandardNormal)
    }

    /// Prediction of `n` draws whose means are Normal(`mean`, `between`²).
    fn prediction(
        &mut self,
        n: usize,
        mean: f64,
        between: f64,
        scatter: f64,
        shared: f64,
    ) -> Prediction {
        let means = (0..n).map(|_| self.normal(mean, between)).collect();
        Prediction::new(means, vec![scatter; n], shared).unwrap()
    }
}

/// CRPS of Normal(mean, sd²): Gneiting & Raftery (2007), section 4.2.
fn crps_of_normal(mean: f64, sd: f64, y: f64) -> f64 {
    let z = (y - mean) / sd;
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    let cdf = Normal(0.0, 1.0).cdf(z);
    sd * (z * (2.0 * cdf - 1.0) + 2.0 * density - std::f64::consts::PI.sqrt().recip())
}

/// Mean and its standard error.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    (mean(values), (variance(values) / values.len() as f64).sqrt())
}

/// The expectation of the score over ensembles of any size is the score of the normal distribution from which the
/// ensembles are drawn, with and without scatter between specimens.
#[test]
fn crps_is_on_average_the_closed_form_of_the_normal_distribution() {
    let mut noise = Noise::new(1);
    for (n, between, scatter, shared, y) in
        [(2, 2.0, 0.0, 0.0, 11.0), (24, 2.0, 0.0, 0.0, 7.0), (5, 1.0, 2.0, 1.5, 16.0)]
    {
        let scores: Vec<f64> = (0..4000)
            .map(|_| noise.prediction(n, 10.0, between, scatter, shared).crps(y))
            .collect();
        let (found, error) = mean_and_error(&scores);
        let sd = between.hypot(scatter).hypot(shared);
        let exact = crps_of_normal(10.0, sd, y);
        assert!((found - exact).abs() < 4.0 * error, "{n}: {found} ± {error}, {exact}");
        assert!(error < 0.03 * exact, "{n}: the test has no power: {error}");
    }
}

#[test]
fn crps_of_equal_draws_with_scatter_is_the_closed_form_itself() {
    let prediction = Prediction::new(vec![3.0; 7], vec![0.5; 7], 1.2).unwrap();
    for y in [-4.0, 2.9, 3.0, 8.0] {
        let exact = crps_of_normal(3.0, 1.3, y);
        assert!((prediction.crps(y) - exact).abs() < 1e-12, "{y}");
    }
    // two draws without scatter: ½(|y − a| + |y − b|) − ½|a − b|
    let two = Prediction::new(vec![1.0, 4.0], vec![0.0; 2], 0.0).unwrap();
    assert!((two.crps(6.0) - (0.5 * (5.0 + 2.0) - 0.5 * 3.0)).abs() < 1e-12);
}

/// Largest distance between the distribution function of the values and the uniform distribution function.
fn kolmogorov_smirnov(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    let n = values.len() as f64;
    let distance =
        |(i, u): (usize, &f64)| (u - i as f64 / n).abs().max((u - (i + 1) as f64 / n).abs());
    values.iter().enumerate().map(distance).fold(0.0, f64::max)
}

#[test]
fn pit_is_uniform_under_the_true_model_and_not_under_another() {
    let mut noise = Noise::new(2);
    let repetitions = 2000;
    let mut pits = |scatter_of_truth: f64, offset: f64| {
        let one = |_| {
            let prediction = noise.prediction(400, 10.0, 1.0, 2.0, 0.5);
            let truth = noise.normal(10.0 + offset, 1.0_f64.hypot(0.5));
            prediction.pit(noise.normal(truth, scatter_of_truth))
        };
        kolmogorov_smirnov((0..repetitions).map(one).collect())
    };
    // critical value at the level 0.1 %
    let critical = 1.95 / f64::from(repetitions).sqrt();
    let [right, wider, shifted] = [pits(2.0, 0.0), pits(3.0, 0.0), pits(2.0, 0.7)];
    assert!(right < critical, "{right}");
    assert!(wider > critical && shifted > critical, "{wider} {shifted}");
}

#[test]
fn quantiles_invert_the_distribution_function() {
    let prediction = Noise::new(3).prediction(24, 100.0, 3.0, 5.0, 1.0);
    for p in [0.001, 0.025, 0.25, 0.5, 0.75, 0.975, 0.999] {
        assert!((prediction.pit(prediction.quantile(p)) - p).abs() < 1e-10, "{p}");
    }
    // one normal distribution: its quantiles are in every table
    let normal = Prediction::new(vec![2.0; 3], vec![3.0; 3], 4.0).unwrap();
    let [low, high] = normal.interval(0.95);
    assert!((low - (2.0 - 5.0 * 1.959_963_984_540_054)).abs() < 1e-9, "{low}");
    assert!((high - (2.0 + 5.0 * 1.959_963_984_540_054)).abs() < 1e-9, "{high}");
    assert!((normal.sd() - 5.0).abs() < 1e-12 && (normal.mean() - 2.0).abs() < 1e-12);
    // without scatter, the quantiles are the draws
    let draws = Prediction::new(vec![4.0, 1.0, 3.0, 2.0], vec![0.0; 4], 0.0).unwrap();
    assert!((draws.quantile(0.6) - 3.0).abs() < 1e-12);
}

/// A difference between means, divided by its standard deviation, has the variance 1 under the true model.
#[test]
fn the_deviation_of_means_has_its_standard_deviation() {
    let mut noise = Noise::new(4);
    for (scatter, predicted_scatter) in [(2.0, 2.0), (2.0, 0.0)] {
        let size = 12;
        let squares: Vec<f64> = (0..4000)
            .map(|_| {
                let prediction = noise.prediction(24, 50.0, 1.0, predicted_scatter, 0.5);
                let truth = noise.normal(50.0, 1.0_f64.hypot(0.5));
                let measured: Vec<f64> = (0..size).map(|_| noise.normal(truth, scatter)).collect();
                prediction.deviation(&measured).standardised().unwrap().powi(2)
            })
            .collect();
        let (found, error) = mean_and_error(&squares);
        // an estimated variance with 23 degrees of freedom enlarges the mean square to at most 23/21
        assert!(
            found > 1.0 - 4.0 * error && found < 23.0 / 21.0 + 4.0 * error,
            "{found} ± {error}"
        );
    }
    let only = Prediction::new(vec![1.0, 2.0], vec![0.0; 2], 0.0).unwrap();
    assert_eq!(only.deviation(&[3.0]).sd, None);
    assert_eq!(only.deviation(&[3.0]).p_value(), None);
}

/// The draws have a posterior standard deviation of 1 %, and each draw has its own packing, which adds 4 %. The
/// specimens scatter by 5 % (4 % from packings, 3 % from other causes). The predicted mean of 6 specimens then has the
/// standard deviation √(1² + 5²/6) % = 2.27 %, and the prediction of one specimen √(1² + 5²) %.
#[test]
fn scatter_between_microstructures_is_not_shared_by_the_specimens() {
    let mut noise = Noise::new(6);
    let means: Vec<f64> = (0..4000).map(|_| noise.normal(100.0, 1.0_f64.hypot(4.0))).collect();
    let prediction = Prediction::new(means.clone(), vec![5.0; 4000], 0.0).unwrap();
    let prediction = prediction.without_variance(16.0);
    assert!((prediction.mean() - mean(&means)).abs() < 1e-9);
    let measured = [100.0; 6];
    let sd = prediction.deviation(&measured).sd.unwrap();
    // the sampling error of V − 16 is about 17 √(2/4000) = 0.4
    let [least, most] = [0.0_f64, 2.2].map(|spread| (spread + 25.0 / 6.0).sqrt());
    assert!(least < sd && sd < most, "{least} {sd} {most}");
    assert!((prediction.sd() - 26.0_f64.sqrt()).abs() < 0.15, "{}", prediction.sd());
    // 24 simulations in repeated laboratories: the mean square of the standardised difference is near 1
    let squares: Vec<f64> = (0..4000)
        .map(|_| {
            let means = (0..24).map(|_| noise.normal(100.0, 17.0_f64.sqrt())).collect();
            let own = Prediction::new(means, vec![5.0; 24], 0.0).unwrap().without_variance(16.0);
            let truth = noise.normal(100.0, 1.0);
            let measured: Vec<f64> = (0..6).map(|_| noise.normal(truth, 5.0)).collect();
            own.deviation(&measured).standardised().unwrap().powi(2)
        })
        .collect();
    let (found, error) = mean_and_error(&squares);
    assert!(error < 0.05 && (0.8..1.2).contains(&found), "{found} ± {error}");
    // if the removed variance exceeds the variance of the means, all means become equal
    let none = Prediction::new(vec![1.0, 3.0], vec![1.0; 2], 0.0).unwrap().without_variance(5.0);
    assert_eq!((none.means[0], none.means[1]), (2.0, 2.0));
}

/// With one degree of freedom, Student's t is the Cauchy distribution: P(|t| > x) = 1 − 2 atan(x)/π.
#[test]
fn the_probability_of_a_deviation_is_that_of_student() {
    let deviation = Deviation { difference: -3.0, sd: Some(1.5), degrees_of_freedom: 1.0 };
    let exact = 1.0 - 2.0 * 2.0_f64.atan() / std::f64::consts::PI;
    assert!((deviation.p_value().unwrap() - exact).abs() < 1e-9, "{deviation:?}");
    let measured = Prediction::new(vec![1.0, 2.0, 3.0, 4.0], vec![0.0; 4], 0.0).unwrap();
    assert_eq!(measured.deviation(&[3.0, 4.0, 7.0]).degrees_of_freedom, 2.0);
    let predicted = Prediction::new(vec![1.0, 2.0, 3.0, 4.0], vec![1.0; 4], 0.0).unwrap();
    assert_eq!(predicted.deviation(&[3.0, 4.0, 7.0]).degrees_of_freedom, 3.0);
}

/// Compares the probabilities with frequencies in simulated laboratories, in which specimens share the draw and the
/// error.
#[test]
fn the_probability_of_specimens_outside_is_their_frequency() {
    let mut noise = Noise::new(5);
    let (total, repetitions) = (8, 20_000);
    let prediction = noise.prediction(200, 0.0, 1.0, 1.5, 0.8);
    let interval = prediction.interval(0.95);
    let mut counts = vec![0; total + 1];
    for _ in 0..repetitions {
        let place = noise.0.random_range(0..prediction.draws());
        let middle = prediction.means[place] + noise.normal(0.0, 0.8);
        let values: Vec<f64> = (0..total).map(|_| noise.normal(middle, 1.5)).collect();
        counts[total - Coverage::of(&values, interval).inside] += 1;
    }
    for least in 1..=4 {
        let observed = f64::from(counts[least..].iter().sum::<i32>()) / f64::from(repetitions);
        let error = (observed * (1.0 - observed) / f64::from(repetitions)).sqrt();
        let found = prediction.probability_outside(interval, least, total);
        assert!((found - observed).abs() < 4.0 * error, "{least}: {found} {observed}");
        // of 8 specimens, either at least `least` are outside or at least 9 − `least` are inside
        let inside = prediction.probability_inside(interval, total + 1 - least, total);
        assert!((found + inside - 1.0).abs() < 1e-9, "{least}: {found} {inside}");
    }
    // without shared parameters and errors, the specimens are independent
    let alone = Prediction::new(vec![0.0; 2], vec![1.0; 2], 0.0).unwrap();
    let found = alone.probability_outside(alone.interval(0.95), 3, 8);
    assert!((found - binomial_tail(3, 8, 0.05)).abs() < 1e-9, "{found}");
}

/// Compares the probability that all specimens are outside the 90 % interval, whose ends are ±1.645 √(σ² + s²), with
/// the mean of P(outside | ε)^N over the shared error. The mean is computed by Simpson's rule with 4001 values over ±9
/// s. The limits of the verdicts are about 0.25 %.
#[test]
fn the_tails_of_the_shared_error_are_in_the_probability_of_specimens_outside() {
    for (scatter, shared, total, rounded) in
        [(3.0, 5.0, 8, 8.9e-3), (1.0, 1.0, 6, 2.0e-3), (1.0, 1.0, 10, 6.5e-4)]
    {
        let end = 1.644_853_626_951_472 * f64::hypot(scatter, shared);
        let (count, step) = (4000, 18.0 / 4000.0);
        let value = |k: usize| {
            let z = k as f64 * step - 9.0;
            let cdf = |x: f64| Normal(0.0, 1.0).cdf(x / scatter);
            let outside = cdf(-end - z * shared) + cdf(z * shared - end);
            let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
            let weight = [2.0, 4.0][k % 2] - if k.is_multiple_of(count) { 1.0 } else { 0.0 };
            weight * density * outside.powi(total)
        };
        let exact = (0..=count).map(value).sum::<f64>() * step / 3.0;
        assert!((exact / rounded - 1.0).abs() < 0.1, "{exact} {rounded}");
        let prediction = Prediction::new(vec![0.0; 2], vec![scatter; 2], shared).unwrap();
        let total = total as usize;
        let found = prediction.probability_outside(prediction.interval(0.9), total, total);
        // values beyond 6 standard deviations, with the probability 2e-9, are omitted
        assert!((found - exact).abs() < 3e-9, "{scatter} {shared} {total}: {found} {exact}");
    }
}

#[test]
fn coverage_has_the_interval_of_clopper_and_pearson() {
    // closed forms at the ends: 1 − (α/2)^(1/n) and (α/2)^(1/n)
    let none = Coverage { inside: 0, total: 10 }.interval(0.95);
    assert!(none[0] == 0.0 && (none[1] - (1.0 - 0.025_f64.powf(0.1))).abs() < 1e-12, "{none:?}");
    let all = Coverage { inside: 10, total: 10 }.interval(0.95);
    assert!(all[1] == 1.0 && (all[0] - 0.025_f64.powf(0.1)).abs() < 1e-12, "{all:?}");
    // 1 of 2: the tails are p² and (1 − p)²
    let half = Coverage { inside: 1, total: 2 }.interval(0.9);
    assert!((half[1] - 0.95_f64.sqrt()).abs() < 1e-12, "{half:?}");
    assert!((half[0] - (1.0 - 0.95_f64.sqrt())).abs() < 1e-12, "{half:?}");
    assert_eq!(Coverage::of(&[1.0, 2.0, 3.0], [1.0, 2.5]), Coverage { inside: 2, total: 3 });
    // a sum of two equally probable tails, and large numbers
    assert!((binomial_tail(2, 3, 0.5) - 0.5).abs() < 1e-12);
    assert!((binomial_tail(5000, 10_000, 0.5) - 0.504).abs() < 1e-3);
}

#[test]
fn values_that_give_no_prediction_are_refused() {
    let error = |means: &[f64], sds: &[f64], shared: f64| {
        Prediction::new(means.to_vec(), sds.to_vec(), shared).unwrap_err().to_string()
    };
    assert!(error(&[1.0], &[0.0], 0.0).contains("at least 2"));
    assert!(error(&[1.0, 2.0], &[0.0], 0.0).contains("2 means and 1"));
    assert!(error(&[1.0, f64::NAN], &[0.0, 0.0], 0.0).contains("NaN"));
    assert!(error(&[1.0, 2.0], &[0.0, -1.0], 0.0).contains("-1"));
    assert!(error(&[1.0, 2.0], &[0.0, 1.0], f64::INFINITY).contains("inf"));
}
