//! The marginal likelihood and its error.

/// ln ∫ prior · likelihood, estimated by independent runs.
///
/// Each run's estimate of the evidence itself is unbiased, so the runs are averaged before the
/// logarithm. The standard error is that of the logarithm of the mean, `sd(Z_r)/(Z̄ √R)`; it means
/// something where it is well below 1.
#[derive(Clone, Debug, PartialEq)]
pub struct Evidence {
    /// Log evidence.
    pub ln: f64,
    /// Its standard error.
    pub standard_error: f64,
    /// Log evidence of every run.
    pub runs: Vec<f64>,
}

impl Evidence {
    pub(super) fn new(runs: Vec<f64>) -> Self {
        let largest = runs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let relative = runs.iter().map(|ln| (ln - largest).exp());
        let (mean, variance) = crate::diagnostics::mean_and_variance(relative);
        let standard_error = (variance / runs.len() as f64).sqrt() / mean;
        Self { ln: largest + mean.ln(), standard_error, runs }
    }

    /// Log Bayes factor for this model against another of the same data, and its standard error.
    ///
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     fn fair(heads: u64) {
    ///         heads ~ Poisson(5.0);
    ///     }
    /// }
    /// ppl::model! {
    ///     fn unknown(heads: u64) {
    ///         let rate ~ Gamma(1.0, 0.2);
    ///         heads ~ Poisson(rate);
    ///     }
    /// }
    /// let smc = Smc::default().particles(200);
    /// let (one, two) = (smc.sample(&fair(6))?.evidence, smc.sample(&unknown(6))?.evidence);
    /// let (ln_bayes_factor, standard_error) = one.ln_bayes_factor(&two);
    /// // a geometric number of heads: 0.2/1.2 · 1.2⁻⁶
    /// let ln_fair: f64 = Poisson(5.0).ln_density(&6);
    /// let exact = ln_fair - ((0.2f64 / 1.2).ln() - 6.0 * 1.2f64.ln());
    /// assert!((ln_bayes_factor - exact).abs() < 4.0 * standard_error);
    /// # Ok::<(), ppl::SampleError>(())
    /// ```
    pub fn ln_bayes_factor(&self, other: &Self) -> (f64, f64) {
        (self.ln - other.ln, self.standard_error.hypot(other.standard_error))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_averaged_before_the_logarithm() {
        let evidence = Evidence::new(vec![-1000.0 + 1f64.ln(), -1000.0 + 3f64.ln()]);
        approx::assert_relative_eq!(evidence.ln, -1000.0 + 2f64.ln(), max_relative = 1e-15);
        // sd of 1 and 3 is √2, over √2 runs, over the mean 2
        approx::assert_relative_eq!(evidence.standard_error, 0.5, max_relative = 1e-12);
    }
}
