//! Leave-one-out cross-validation by Pareto-smoothed importance sampling.

use std::fmt;

use super::{ess_mean, mean, mean_and_variance};

/// Error of a cross-validation.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum LooError {
    /// The model has no observations.
    #[error(
        "no pointwise log-likelihood: the model has no statement `place ~ D` that observes data"
    )]
    NoObservations,
    /// There are too few draws to fit the tail of the importance ratios.
    #[error("{draws} draws are too few: PSIS needs at least 25 to fit a tail of 5")]
    TooFewDraws {
        /// Number of draws over all chains.
        draws: usize,
    },
    /// The log-likelihood of an observation is not finite at some draw.
    #[error("the log-likelihood of observation {observation} is {value} at a draw")]
    NotFinite {
        /// Index of the observation.
        observation: usize,
        /// Value of the log-likelihood.
        value: f64,
    },
    /// The number of log-likelihood values differs from chains × draws × observations.
    #[error(
        "log-likelihood has {got} values; {chains} chains × {draws} draws × {observations} observations need {expected}"
    )]
    Shape {
        /// Number of values given.
        got: usize,
        /// Number of values required.
        expected: usize,
        /// Number of chains.
        chains: usize,
        /// Number of draws per chain.
        draws: usize,
        /// Number of observations.
        observations: usize,
    },
    /// The compared models have different numbers of observations.
    #[error(
        "`{first}` was validated on {expected} observations but `{other}` on {got}: compare models on the same data"
    )]
    DifferentData {
        /// Name of the first model.
        first: String,
        /// Name of the other model.
        other: String,
        /// Number of observations of the first model.
        expected: usize,
        /// Number of observations of the other model.
        got: usize,
    },
}

/// Leave-one-out result of one observation.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LooPoint {
    /// Log predictive density of the observation, log p(y_i | y_−i).
    pub elpd: f64,
    /// Influence of the observation on the fit, log p(y_i | y) − log p(y_i | y_−i).
    pub p_loo: f64,
    /// Shape k of the generalised Pareto tail of the importance ratios; see [`Loo::threshold`].
    pub pareto_k: f64,
}

/// Expected log pointwise predictive density for new data, estimated by PSIS-LOO.
///
/// elpd = Σ_i log (Σ_s w_is p(y_i | θ_s) / Σ_s w_is) with w_is ∝ 1/p(y_i | θ_s). The largest weights are replaced by
/// quantiles of a generalised Pareto distribution that is fitted to them.
///
/// ```
/// // one chain of 100 draws, two observations: [chain][draw][observation]
/// let log_likelihood: Vec<f64> =
///     (0..200).map(|i| -0.5 * (i as f64 * 0.7).sin().powi(2)).collect();
/// let loo = ppl::diagnostics::Loo::new(1, 100, 2, &log_likelihood)?;
/// assert_eq!(loo.points.len(), 2);
/// assert!(loo.elpd < 0.0);
/// # Ok::<(), ppl::diagnostics::LooError>(())
/// ```
///
/// References: Vehtari, Gelman & Gabry (2017), doi:10.1007/s11222-016-9696-4; Vehtari et al.
/// (2024), J. Mach. Learn. Res. 25(72).
#[derive(Clone, Debug, PartialEq)]
pub struct Loo {
    /// Expected log predictive density: sum of log p(y_i | y_−i) over the observations.
    pub elpd: f64,
    /// Standard error √(n·var(elpd_i)) of `elpd`, where n is the number of observations and the variance has the
    /// divisor n − 1.
    pub se: f64,
    /// Effective number of parameters.
    pub p_loo: f64,
    /// Largest Pareto shape k for which the estimate is reliable: min(1 − 1/log₁₀ S, 0.7), for S draws.
    pub threshold: f64,
    /// One result per observation.
    pub points: Vec<LooPoint>,
    /// Hash of the observed data, by which a comparison detects models that were fitted to different data. `None` if
    /// the data are unknown.
    pub data: Option<u64>,
    /// Whether the model also adds terms to its density with `factor`. Cross-validation never leaves out such terms.
    pub has_factors: bool,
}

impl Loo {
    /// Computes the cross-validation from the log-likelihood of each observation at each draw, row-major
    /// `[chain][draw][observation]`.
    ///
    /// The number of importance ratios of an observation that are smoothed depends on the effective sample size of
    /// its likelihood.
    ///
    /// # Errors
    /// [`LooError`] if there is no observation, if there are fewer than 25 draws, if the length of `log_likelihood`
    /// is wrong, or if a value is not finite.
    pub fn new(
        chains: usize,
        draws: usize,
        observations: usize,
        log_likelihood: &[f64],
    ) -> Result<Self, LooError> {
        let expected = chains * draws * observations;
        if log_likelihood.len() != expected {
            let got = log_likelihood.len();
            return Err(LooError::Shape { got, expected, chains, draws, observations });
        }
        if observations == 0 {
            return Err(LooError::NoObservations);
        }
        let total = chains * draws;
        if total < 25 {
            return Err(LooError::TooFewDraws { draws: total });
        }
        let points: Vec<LooPoint> = (0..observations)
            .map(|i| {
                let values: Vec<f64> =
                    log_likelihood[i..].iter().step_by(observations).copied().collect();
                if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                    return Err(LooError::NotFinite { observation: i, value });
                }
                let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
                let likelihood: Vec<f64> = values.iter().map(|v| (v - top).exp()).collect();
                let traces: Vec<&[f64]> = likelihood.chunks(draws).collect();
                let relative = ess_mean(&traces) / total as f64;
                Ok(leave_one_out(&values, if relative.is_nan() { 1.0 } else { relative }))
            })
            .collect::<Result<_, _>>()?;

        let threshold = (1.0 - 1.0 / (total as f64).log10()).min(0.7);
        let (elpd, se, p_loo) = (0.0, 0.0, 0.0);
        let loo = Self { elpd, se, p_loo, threshold, points, data: None, has_factors: false };
        Ok(loo.sum_up())
    }

    /// Returns the indices of the observations with an unreliable estimate, that is, with a Pareto k above the
    /// threshold or NaN.
    ///
    /// Refit the model without each observation whose Pareto k is too large, or use a more robust
    /// likelihood.
    pub fn unreliable(&self) -> Vec<usize> {
        let bad = |p: &LooPoint| p.pareto_k.is_nan() || p.pareto_k > self.threshold;
        (0..self.points.len()).filter(|&i| bad(&self.points[i])).collect()
    }

    /// Replaces the estimate of one observation by log p(y_i | y_−i) from a fit without this observation.
    ///
    /// The Pareto k of the observation becomes −∞, because the new estimate does not use importance sampling.
    ///
    /// ```
    /// # let log_likelihood: Vec<f64> =
    /// #     (0..200).map(|i| -0.5 * (i as f64 * 0.7).sin().powi(2)).collect();
    /// let loo = ppl::diagnostics::Loo::new(1, 100, 2, &log_likelihood)?;
    /// let refitted = loo.clone().refitted(1, -3.0);
    /// assert!((refitted.elpd - (loo.points[0].elpd - 3.0)).abs() < 1e-12);
    /// # Ok::<(), ppl::diagnostics::LooError>(())
    /// ```
    ///
    /// # Panics
    /// If `observation` is not an index of an observation.
    pub fn refitted(mut self, observation: usize, elpd: f64) -> Self {
        let point = &mut self.points[observation];
        let with_it = point.elpd + point.p_loo;
        *point = LooPoint { elpd, p_loo: with_it - elpd, pareto_k: f64::NEG_INFINITY };
        self.sum_up()
    }

    /// Recomputes the sums over the observations.
    fn sum_up(mut self) -> Self {
        let n = self.points.len() as f64;
        let (mean, variance) = mean_and_variance(self.points.iter().map(|p| p.elpd));
        self.elpd = n * mean;
        self.se = (n * variance).sqrt();
        self.p_loo = self.points.iter().map(|p| p.p_loo).sum();
        self
    }
}

impl fmt::Display for Loo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        writeln!(f, "elpd  {:>10.2} ± {:.2}", self.elpd, self.se)?;
        writeln!(f, "p_loo {:>10.2}", self.p_loo)?;
        let bad = self.unreliable();
        if bad.is_empty() {
            write!(f, "every Pareto k is below {:.2}", self.threshold)?;
        } else {
            write!(
                f,
                "Pareto k exceeds {:.2} at {} of {} observations {bad:?}: the estimates of these \
                 observations are not reliable; refit without each of these observations, or use a \
                 likelihood with heavier tails",
                self.threshold,
                bad.len(),
                self.points.len()
            )?;
        }
        if self.has_factors {
            write!(
                f,
                "\nterms of `factor` are not cross-validated: data in these terms are never left out or \
                 predicted"
            )?;
        }
        Ok(())
    }
}

fn leave_one_out(log_likelihood: &[f64], relative_ess: f64) -> LooPoint {
    let mut log_weights: Vec<f64> = log_likelihood.iter().map(|l| -l).collect();
    let pareto_k = pareto_smooth(&mut log_weights, relative_ess);
    let weighted: Vec<f64> = log_weights.iter().zip(log_likelihood).map(|(w, l)| w + l).collect();
    let elpd = log_sum_exp(&weighted);
    let with_it = log_sum_exp(log_likelihood) - (log_likelihood.len() as f64).ln();
    LooPoint { elpd, p_loo: with_it - elpd, pareto_k }
}

/// Replaces log importance ratios by normalised, Pareto-smoothed log weights. Returns the shape k of the tail of the
/// ratios.
///
/// The tail consists of the largest min(0.2 S, 3 √(S/r)) of S ratios, with the relative effective sample size r. k is
/// −∞ if all ratios of the tail are equal, so that no smoothing is needed. k is +∞ if no Pareto tail can be fitted. In
/// both cases the weights are the normalised ratios. All ratios must be finite.
///
/// Reference: Vehtari, Simpson, Gelman, Yao & Gabry (2024), J. Mach. Learn. Res. 25(72).
pub fn pareto_smooth(log_ratios: &mut [f64], relative_ess: f64) -> f64 {
    let total = log_ratios.len();
    let top = log_ratios.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    log_ratios.iter_mut().for_each(|r| *r -= top);

    let s = total as f64;
    let length = (0.2 * s).min(3.0 * (s / relative_ess).sqrt()).floor() as usize;
    let mut order: Vec<usize> = (0..total).collect();
    order.sort_by(|&a, &b| log_ratios[a].total_cmp(&log_ratios[b]));
    let (body, tail) = order.split_at(total - length);

    let shape = if length < 5 {
        f64::INFINITY
    } else if log_ratios[tail[0]] == log_ratios[tail[length - 1]] {
        f64::NEG_INFINITY
    } else {
        let cutoff = log_ratios[body[body.len() - 1]].exp();
        let exceedances: Vec<f64> = tail.iter().map(|&i| log_ratios[i].exp() - cutoff).collect();
        match fit_generalised_pareto(&exceedances) {
            Some((shape, scale)) => {
                for (rank, &i) in tail.iter().enumerate() {
                    let p = (rank as f64 + 0.5) / length as f64;
                    let quantile = if shape == 0.0 {
                        -(-p).ln_1p()
                    } else {
                        (-shape * (-p).ln_1p()).exp_m1() / shape
                    };
                    // limit the smoothed ratios to the largest raw ratio, which is 1 after the normalisation above
                    log_ratios[i] = (cutoff + scale * quantile).ln().min(0.0);
                }
                shape
            }
            None => f64::INFINITY,
        }
    };
    let norm = log_sum_exp(log_ratios);
    log_ratios.iter_mut().for_each(|r| *r -= norm);
    shape
}

/// Fits a generalised Pareto distribution to exceedances in ascending order; returns shape and scale. The estimate is
/// the posterior mean of Zhang & Stephens (2009), doi:10.1198/tech.2009.08017, with the shape shrunk towards 0.5 by a
/// prior that has the weight of ten observations. `None` if the lower quarter of the exceedances is constant.
fn fit_generalised_pareto(exceedances: &[f64]) -> Option<(f64, f64)> {
    let n = exceedances.len();
    let quartile = exceedances[(n as f64 / 4.0 + 0.5) as usize - 1];
    let largest = exceedances[n - 1];
    if quartile <= exceedances[0] {
        return None;
    }
    let shape_at = |b: f64| mean(exceedances.iter().map(|x| (-b * x).ln_1p()));
    let grid_size = 30 + (n as f64).sqrt() as usize;
    let grid: Vec<f64> = (1..=grid_size)
        .map(|i| {
            let spread = 1.0 - (grid_size as f64 / (i as f64 - 0.5)).sqrt();
            1.0 / largest + spread / (3.0 * quartile)
        })
        .collect();
    let profile: Vec<f64> = grid
        .iter()
        .map(|&b| {
            let k = shape_at(b);
            n as f64 * ((-b / k).ln() - k - 1.0)
        })
        .collect();
    let norm = log_sum_exp(&profile);
    let b: f64 = grid.iter().zip(&profile).map(|(b, l)| b * (l - norm).exp()).sum();
    let k = shape_at(b);
    let scale = -k / b;
    let shape = (n as f64 * k + 10.0 * 0.5) / (n as f64 + 10.0);
    (shape.is_finite() && scale > 0.0).then_some((shape, scale))
}

fn log_sum_exp(values: &[f64]) -> f64 {
    let top = values.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    top + values.iter().map(|v| (v - top).exp()).sum::<f64>().ln()
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// Fits a sample with known shape, drawn by inversion. The asymptotic standard error of the shape is (1 + k)/√n, at
    /// most 0.03; four standard errors are allowed.
    #[test]
    fn pareto_fit_finds_the_shape_it_was_drawn_from() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(9);
        for k in [0.1, 0.5, 0.9] {
            let mut x: Vec<f64> =
                (0..4000).map(|_| ((1.0 - rng.random::<f64>()).powf(-k) - 1.0) / k).collect();
            x.sort_by(f64::total_cmp);
            let (shape, _) = fit_generalised_pareto(&x).expect("a Pareto sample");
            assert!((shape - k).abs() < 0.12, "{shape} for {k}");
        }
    }
}
