//! Comparison of a posterior prediction with held-out measurements: predictive intervals, coverage, PIT and CRPS.
//!
//! [`Prediction`] is the predictive distribution of one quantity of one new specimen. It is an equally weighted mixture of
//! normal distributions, one for each posterior draw at which the quantity has been computed. All statistics of the mixture
//! are in closed form or found by bisection; nothing is drawn at random.

mod coverage;
mod held_out_value;
#[cfg(test)]
mod tests;

use ppl::Univariate;
use ppl::prelude::*;
use thiserror::Error;

pub use coverage::Coverage;
use coverage::binomial_tail;
pub use held_out_value::{HeldOutScores, HeldOutValue, LEVELS};

/// Number of values at which probabilities are integrated over the shared error.
const SHARED_VALUES: usize = 97;
/// Largest of these values, in standard deviations of the shared error. It is large because the verdicts compare
/// probabilities of 0.1 %, to which the tails of the shared error contribute most.
const LARGEST_SHARED: f64 = 6.0;

/// Reason why runs at posterior draws give no prediction.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum PredictionError {
    /// Fewer than two draws, so that the spread of the posterior is unknown.
    #[error("the quantity has a value at {0} posterior draws, and a prediction needs at least 2")]
    FewDraws(usize),
    /// The number of standard deviations differs from the number of means.
    #[error("{means} means and {sds} standard deviations differ in number")]
    Lengths {
        /// Number of means.
        means: usize,
        /// Number of standard deviations.
        sds: usize,
    },
    /// A value is infinite or NaN, or a standard deviation is negative.
    #[error(
        "the mean or standard deviation {0} at a posterior draw is not finite, or the standard deviation is negative"
    )]
    NotFinite(f64),
}

/// Predictive distribution of one quantity of a new specimen.
///
/// The quantity of specimen s is y_s = μ_d + ε + e_s. The draw d is one of the posterior draws, all equally probable; the
/// error ε ~ Normal(0, `shared_sd`²) is the same for all specimens; e_s ~ Normal(0, σ_d²) is the scatter between specimens.
///
/// # Example
/// ```
/// use breccia_calibration::Prediction;
///
/// let prediction = Prediction::new(vec![99.0, 100.0, 101.0], vec![2.0; 3], 0.0)?;
/// let [low, high] = prediction.interval(0.95);
/// assert!(low < 96.0 && high > 104.0);
/// assert!((prediction.pit(100.0) - 0.5).abs() < 1e-12);
/// # Ok::<(), breccia_calibration::PredictionError>(())
/// ```
///
/// # References
/// Gneiting & Raftery (2007), *Strictly proper scoring rules, prediction, and estimation*, JASA 102, 359–378.
/// Grimit et al. (2006), *The continuous ranked probability score for circular variables and its application to mesoscale
/// forecast ensemble verification*, Q. J. R. Meteorol. Soc. 132, 2925–2942: the score of a mixture of normal distributions.
#[derive(Clone, Debug, PartialEq)]
pub struct Prediction {
    /// Mean over specimens at each draw.
    means: Vec<f64>,
    /// Standard deviation between specimens at each draw; 0 if the scatter is unknown.
    scatter_sds: Vec<f64>,
    /// Standard deviation of the error that all specimens share.
    shared_sd: f64,
    /// Variance that [`Prediction::without_variance`] has removed from the means.
    removed: f64,
}

/// Difference between the mean of held-out specimens and the predicted mean.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Mean of the measurements minus the predicted mean.
    pub difference: f64,
    /// Standard deviation of the difference if the prediction is right; `None` if it cannot be estimated, because the
    /// scatter between specimens is neither predicted nor measured.
    pub sd: Option<f64>,
    /// Degrees of freedom of `sd`: the smallest number of values from which a part of it is estimated, minus one.
    pub degrees_of_freedom: f64,
}

impl Deviation {
    /// Difference divided by its standard deviation; `None` without a standard deviation.
    pub fn standardised(&self) -> Option<f64> {
        self.sd.filter(|sd| *sd > 0.0).map(|sd| self.difference / sd)
    }

    /// Probability of a difference at least as large if the prediction is right: both tails of Student's t distribution.
    /// `None` without a standard deviation.
    pub fn p_value(&self) -> Option<f64> {
        let away = self.standardised()?.abs();
        Some(2.0 * StudentT(self.degrees_of_freedom, 0.0, 1.0).cdf(-away))
    }
}

impl Prediction {
    /// Creates the prediction from the means and the standard deviations between specimens at the draws, and the standard
    /// deviation of the shared error.
    ///
    /// # Errors
    /// Fewer than two draws, different lengths, or values that are not finite.
    pub fn new(
        means: Vec<f64>,
        scatter_sds: Vec<f64>,
        shared_sd: f64,
    ) -> Result<Self, PredictionError> {
        if means.len() < 2 {
            return Err(PredictionError::FewDraws(means.len()));
        }
        if means.len() != scatter_sds.len() {
            let (means, sds) = (means.len(), scatter_sds.len());
            return Err(PredictionError::Lengths { means, sds });
        }
        let is_sd = |x: &&f64| x.is_finite() && **x >= 0.0;
        let sds = || scatter_sds.iter().chain([&shared_sd]);
        let wrong = means.iter().find(|x| !x.is_finite()).or_else(|| sds().find(|x| !is_sd(x)));
        match wrong {
            Some(&x) => Err(PredictionError::NotFinite(x)),
            None => Ok(Self { means, scatter_sds, shared_sd, removed: 0.0 }),
        }
    }

    /// Removes a variance from the means that is part of the scatter between specimens too: each draw is simulated with its own
    /// microstructure, and each specimen has its own microstructure, so that this scatter is not shared by the specimens.
    ///
    /// The means are shrunk about their average by √(max(0, V − `included`)/V), where V is their variance. The mean of the
    /// prediction is unchanged. Its error is the error of the mean of n values with the variance V.
    pub fn without_variance(mut self, included: f64) -> Self {
        let (middle, whole) = (self.mean(), variance(&self.means));
        if whole > 0.0 && included > 0.0 {
            let factor = ((whole - included).max(0.0) / whole).sqrt();
            self.means.iter_mut().for_each(|mean| *mean = middle + factor * (*mean - middle));
            self.removed += included.min(whole);
        }
        self
    }

    /// Number of posterior draws.
    pub fn draws(&self) -> usize {
        self.means.len()
    }

    /// Mean of the prediction.
    pub fn mean(&self) -> f64 {
        mean(&self.means)
    }

    /// Standard deviation of one new specimen.
    pub fn sd(&self) -> f64 {
        (variance(&self.means) + self.shared_sd.powi(2) + self.scatter_variance()).sqrt()
    }

    /// Mean over the draws of the variance between specimens.
    fn scatter_variance(&self) -> f64 {
        self.scatter_sds.iter().map(|sd| sd * sd).sum::<f64>() / self.scatter_sds.len() as f64
    }

    /// Mean and standard deviation of one specimen at each draw.
    fn components(&self) -> impl Iterator<Item = (f64, f64)> {
        let shared = self.shared_sd;
        self.means.iter().zip(&self.scatter_sds).map(move |(mean, sd)| (*mean, sd.hypot(shared)))
    }

    /// Probability that a new specimen has a value of at most `y`: the probability integral transform (PIT) of a
    /// measurement `y`. Over specimens that the prediction describes, it is uniform between 0 and 1.
    pub fn pit(&self, y: f64) -> f64 {
        let all = self.components().map(|(mean, sd)| normal_cdf(y - mean, sd));
        all.sum::<f64>() / self.means.len() as f64
    }

    /// Quantile of the prediction at a probability between 0 and 1: the smallest value whose distribution function is at
    /// least `probability`.
    pub fn quantile(&self, probability: f64) -> f64 {
        // 40 standard deviations contain all probabilities above the smallest positive number
        let low = self.components().map(|(mean, sd)| mean - 40.0 * sd);
        let high = self.components().map(|(mean, sd)| mean + 40.0 * sd);
        let (mut low, mut high) =
            (low.fold(f64::INFINITY, f64::min), high.fold(f64::NEG_INFINITY, f64::max));
        // halve the bracket to the resolution of numbers
        for _ in 0..200 {
            let middle = 0.5 * (low + high);
            if middle <= low || middle >= high {
                break;
            }
            match self.pit(middle) < probability {
                true => low = middle,
                false => high = middle,
            }
        }
        high
    }

    /// Central interval that contains a new specimen with probability `level`.
    pub fn interval(&self, level: f64) -> [f64; 2] {
        [0.5 * (1.0 - level), 0.5 * (1.0 + level)].map(|p| self.quantile(p))
    }

    /// Continuous ranked probability score (CRPS) of a measurement, in the unit of the quantity; smaller is better.
    ///
    /// CRPS(F, y) = E|X − y| − ½ E|X − X′| with independent X, X′ ~ F (Gneiting & Raftery 2007, eq. 21). With
    /// A(μ, σ) = E|Normal(μ, σ²)| = 2σφ(μ/σ) + μ(2Φ(μ/σ) − 1), the score of the n draws is
    ///
    /// n⁻¹ Σᵢ A(y − μᵢ, σᵢ) − [2n(n − 1)]⁻¹ Σᵢ≠ⱼ A(μᵢ − μⱼ, √(σᵢ² + σⱼ²)).
    ///
    /// The second sum omits i = j and divides by n(n − 1) ("fair" score, Ferro 2014, Q. J. R. Meteorol. Soc. 140, 1917):
    /// its expectation is the score of the whole posterior, whatever the number of draws.
    pub fn crps(&self, y: f64) -> f64 {
        let all: Vec<(f64, f64)> = self.components().collect();
        let n = all.len() as f64;
        let distance: f64 = all.iter().map(|(mean, sd)| mean_absolute(y - mean, *sd)).sum();
        let mut spread = 0.0;
        for (i, (a, sd_a)) in all.iter().enumerate() {
            for (b, sd_b) in &all[..i] {
                spread += mean_absolute(a - b, sd_a.hypot(*sd_b));
            }
        }
        distance / n - spread / (n * (n - 1.0))
    }

    /// Compares the mean of independent specimens with the predicted mean.
    ///
    /// The variance of the difference is V + (V + R)/n + s² + Σ/N: V is the variance of the n means, R the variance that
    /// [`Prediction::without_variance`] has removed from them, s the standard deviation of the shared error, Σ the variance between
    /// specimens, N the number of measurements. If the prediction has no scatter, Σ is the variance of the measurements.
    pub fn deviation(&self, measured: &[f64]) -> Deviation {
        let (n, size) = (self.means.len() as f64, measured.len() as f64);
        let scatter = match self.scatter_variance() {
            0.0 if measured.len() < 2 => None,
            0.0 => Some(variance(measured)),
            predicted => Some(predicted),
        };
        let spread = variance(&self.means);
        let of_draws = spread + (spread + self.removed) / n + self.shared_sd.powi(2);
        let is_scatter_measured = self.scatter_variance() == 0.0 && measured.len() > 1;
        Deviation {
            difference: mean(measured) - self.mean(),
            sd: scatter.map(|scatter| (of_draws + scatter / size).sqrt()),
            degrees_of_freedom: if is_scatter_measured { n.min(size) } else { n } - 1.0,
        }
    }

    /// Predicted probability that at least `outside` of `total` specimens lie outside `interval`.
    ///
    /// The specimens share the parameters and the error ε, so that they are outside together. The probability is the mean,
    /// over the draws and over ε, of the binomial probability of independent specimens.
    pub fn probability_outside(&self, interval: [f64; 2], outside: usize, total: usize) -> f64 {
        self.mean_over_shared(interval, |out, _| binomial_tail(outside, total, out))
    }

    /// Predicted probability that at least `inside` of `total` specimens lie inside `interval`.
    pub fn probability_inside(&self, interval: [f64; 2], inside: usize, total: usize) -> f64 {
        self.mean_over_shared(interval, |_, within| binomial_tail(inside, total, within))
    }

    /// Mean over the draws and over the shared error of `function`, whose arguments are the probabilities that one specimen lies
    /// outside and inside `interval`.
    fn mean_over_shared(&self, interval: [f64; 2], function: impl Fn(f64, f64) -> f64) -> f64 {
        let shared = shared_values(self.shared_sd);
        let mut sum = 0.0;
        for (mean, sd) in self.means.iter().zip(&self.scatter_sds) {
            for (error, weight) in &shared {
                let [low, high] = interval.map(|end| end - mean - error);
                // both tails are computed as lower tails, in which no digits are lost
                let outside = (normal_cdf(low, *sd) + normal_cdf(-high, *sd)).min(1.0);
                sum += weight * function(outside, 1.0 - outside);
            }
        }
        sum / self.means.len() as f64
    }
}

/// Values of the shared error with their weights, which sum to 1. The weights of equidistant values are proportional to the normal
/// density: the trapezoidal rule, which converges exponentially for smooth functions that vanish at both ends.
fn shared_values(sd: f64) -> Vec<(f64, f64)> {
    if sd <= 0.0 {
        return vec![(0.0, 1.0)];
    }
    let step = 2.0 * LARGEST_SHARED / (SHARED_VALUES - 1) as f64;
    let places = (0..SHARED_VALUES).map(|k| k as f64 * step - LARGEST_SHARED);
    let all: Vec<(f64, f64)> = places.map(|z| (z * sd, (-0.5 * z * z).exp())).collect();
    let total: f64 = all.iter().map(|(_, weight)| weight).sum();
    all.into_iter().map(|(value, weight)| (value, weight / total)).collect()
}

/// Distribution function of Normal(0, `sd`²); for `sd = 0` a step with the value ½ at 0.
fn normal_cdf(x: f64, sd: f64) -> f64 {
    match sd > 0.0 {
        true => Normal(0.0, sd).cdf(x),
        false if x == 0.0 => 0.5,
        false => f64::from(u8::from(x > 0.0)),
    }
}

/// Mean of |x| for x ~ Normal(`mean`, `sd`²).
fn mean_absolute(mean: f64, sd: f64) -> f64 {
    if sd == 0.0 {
        return mean.abs();
    }
    let z = mean / sd;
    let density = (-0.5 * z * z).exp() / (2.0 * std::f64::consts::PI).sqrt();
    2.0 * sd * density + mean * (2.0 * normal_cdf(z, 1.0) - 1.0)
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Unbiased variance of at least two values.
fn variance(values: &[f64]) -> f64 {
    let middle = mean(values);
    let squares = values.iter().map(|x| (x - middle).powi(2));
    squares.sum::<f64>() / (values.len() as f64 - 1.0)
}
