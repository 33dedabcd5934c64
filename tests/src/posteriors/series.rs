//! Time series: models in which a value is carried from one observation to the next.

use ppl::prelude::*;

use super::Data;

ppl::model! {
    /// GARCH(1, 1): the variance depends on the preceding deviation and the preceding variance.
    pub fn garch11(y: &[f64], first_sd: f64) {
        let mu ~ Normal(0.0, 1e4);
        let alpha0 ~ HalfNormal(1e4);
        let alpha1 ~ Uniform(0.0, 1.0);
        // beta1 has a flat prior on (0, 1 − alpha1); as a share of this interval is sampled, the density gets the width
        // 1 − alpha1 as a factor
        let share ~ Uniform(0.0, 1.0);
        factor((1.0 - alpha1).ln());
        #[track] let beta1 = share * (1.0 - alpha1);
        let mut variance = Real::from(first_sd * first_sd);
        for t in 0..y.len() {
            if t > 0 {
                variance = alpha0 + alpha1 * (y[t - 1] - mu).square() + beta1 * variance;
            }
            y[t] ~ Normal(mu, variance.sqrt());
        }
    }

    /// ARMA(1, 1): the prediction depends on the preceding value and on the error of the preceding prediction.
    pub fn arma11(y: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let phi ~ Normal(0.0, 2.0);
        let theta ~ Normal(0.0, 2.0);
        let sigma ~ HalfCauchy(2.5);
        let mut prediction = mu + phi * mu;
        for t in 0..y.len() {
            y[t] ~ Normal(prediction, sigma);
            let error = y[t] - prediction;
            prediction = mu + phi * y[t] + theta * error;
        }
    }

    /// Autoregressive model of order 5.
    pub fn ark(y: &[f64]) {
        let alpha ~ Normal(0.0, 10.0);
        let beta ~ Normal(0.0, 10.0).array::<5>();
        let sigma ~ HalfCauchy(2.5);
        for t in 5..y.len() {
            let mut mean = alpha;
            for k in 0..5 {
                mean += beta[k] * y[t - 1 - k];
            }
            y[t] ~ Normal(mean, sigma);
        }
    }
}

/// Parses the simulated series of a fixture.
pub fn series(text: &str) -> Vec<f64> {
    Data::parse(text).column("y")
}

/// Data of [`garch11`]. The standard deviation of the first observation is 0.5.
pub fn garch_data() -> Vec<f64> {
    series(include_str!("../../fixtures/posteriors/garch.json"))
}

/// Data of [`arma11`].
pub fn arma_data() -> Vec<f64> {
    series(include_str!("../../fixtures/posteriors/arma.json"))
}

/// Data of [`ark`].
pub fn ark_data() -> Vec<f64> {
    series(include_str!("../../fixtures/posteriors/ark.json"))
}
