//! Step size adaptation by dual averaging.

use serde::{Deserialize, Serialize};

/// Nesterov's dual averaging on the logarithm of the step size ε.
///
/// With the acceptance statistic aₜ of transition t, the target δ, and μ = ln(10 ε₀) for the initial step size ε₀,
/// `s̄ ← (1−ηₜ) s̄ + ηₜ (δ−aₜ)`, `ηₜ = 1/(t+t₀)`, `ln ε = μ − s̄ √t/γ`, `x̄ ← (1−t^−κ) x̄ + t^−κ ln ε`; γ = 0.05, κ =
/// 0.75, t₀ = 10.
///
/// Reference: Hoffman & Gelman, *The No-U-Turn Sampler*, JMLR 15 (2014), section 3.2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct DualAveraging {
    pub(crate) target: f64,
    mu: f64,
    count: f64,
    error: f64,
    log_step: f64,
    log_average: f64,
}

const GAMMA: f64 = 0.05;
const KAPPA: f64 = 0.75;
const T0: f64 = 10.0;

impl DualAveraging {
    /// Starts the adaptation at `step_size`. The iteration is shrunk towards ten times this value, so that large
    /// steps, which cost fewer gradients, are tried first.
    pub(crate) fn new(target: f64, step_size: f64) -> Self {
        let log_step = step_size.ln();
        Self {
            target,
            mu: std::f64::consts::LN_10 + log_step,
            count: 0.0,
            error: 0.0,
            log_step,
            log_average: log_step,
        }
    }

    pub(crate) fn restart(&mut self, step_size: f64) {
        *self = Self::new(self.target, step_size);
    }

    pub(crate) fn learn(&mut self, acceptance: f64) {
        self.count += 1.0;
        let eta = 1.0 / (self.count + T0);
        self.error += eta * (self.target - acceptance.min(1.0) - self.error);
        self.log_step = self.mu - self.error * self.count.sqrt() / GAMMA;
        let weight = self.count.powf(-KAPPA);
        self.log_average += weight * (self.log_step - self.log_average);
    }

    /// Step size of the next warmup transition.
    pub(crate) fn current(&self) -> f64 {
        self.log_step.exp()
    }

    /// Averaged step size, used after the warmup.
    pub(crate) fn average(&self) -> f64 {
        self.log_average.exp()
    }

    /// Number of transitions since the last restart.
    pub(crate) fn count(&self) -> f64 {
        self.count
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/sampler_step_size.rs"]
mod tests;
