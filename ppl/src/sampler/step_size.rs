//! Step size adaptation by dual averaging.

use serde::{Deserialize, Serialize};

/// Nesterov's dual averaging on the logarithm of the step size ε.
///
/// With acceptance statistic aₜ and target δ,
/// `s̄ ← (1−ηₜ) s̄ + ηₜ (δ−aₜ)`, `ηₜ = 1/(t+t₀)`, `ln ε = μ − s̄ √t/γ`,
/// `x̄ ← (1−t^−κ) x̄ + t^−κ ln ε`; γ = 0.05, κ = 0.75, t₀ = 10.
///
/// Reference: Hoffman & Gelman, *The No-U-Turn Sampler*, JMLR 15 (2014), section 3.2.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct DualAveraging {
    pub(super) target: f64,
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
    /// Starts at `step_size`, and pulls towards ten times as much to explore cheap large steps first.
    pub(super) fn new(target: f64, step_size: f64) -> Self {
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

    pub(super) fn restart(&mut self, step_size: f64) {
        *self = Self::new(self.target, step_size);
    }

    pub(super) fn learn(&mut self, acceptance: f64) {
        self.count += 1.0;
        let eta = 1.0 / (self.count + T0);
        self.error += eta * (self.target - acceptance.min(1.0) - self.error);
        self.log_step = self.mu - self.error * self.count.sqrt() / GAMMA;
        let weight = self.count.powf(-KAPPA);
        self.log_average += weight * (self.log_step - self.log_average);
    }

    /// Step for the next warmup transition.
    pub(super) fn current(&self) -> f64 {
        self.log_step.exp()
    }

    /// Step to freeze.
    pub(super) fn average(&self) -> f64 {
        self.log_average.exp()
    }

    /// Transitions learnt from since the last restart.
    pub(super) fn count(&self) -> f64 {
        self.count
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Recursion carried out apart from this code (Python, 17 digits); see the formula above.
    #[test]
    fn golden_sequence() {
        let mut step = DualAveraging::new(0.8, 0.5);
        let accepted = [0.3, 1.0, 0.95, 0.0, 0.72, 1.0];
        let currents = [
            2.0144516076456647,
            2.4653434569761985,
            3.352592341675178,
            0.3312612957613083,
            0.23190469789054852,
            0.3938017394474507,
        ];
        let averages = [
            2.0144516076456647,
            2.2715160780442187,
            2.6945307055164402,
            1.2842189883582098,
            0.7697181060867385,
            0.6462655349216961,
        ];
        for i in 0..6 {
            step.learn(accepted[i]);
            approx::assert_relative_eq!(step.current(), currents[i], max_relative = 1e-13);
            approx::assert_relative_eq!(step.average(), averages[i], max_relative = 1e-13);
        }
    }

    /// A smooth stand-in for the acceptance of HMC: the tuned step must approach the target. The
    /// bias falls as t^(−1/4), the rate at which the average forgets its beginning.
    #[test]
    fn solves_for_the_target() {
        let acceptance = |step: f64| (-step * step).exp();
        let mut step = DualAveraging::new(0.8, 10.0);
        let mut errors = Vec::new();
        for t in 1..=64_000 {
            let a = acceptance(step.current());
            step.learn(a);
            if t == 1000 || t == 64_000 {
                errors.push((acceptance(step.average()) - 0.8).abs());
            }
        }
        assert!(errors[0] < 0.01, "{errors:?}");
        assert!(errors[1] < errors[0] / 2.0, "{errors:?}");
    }
}
