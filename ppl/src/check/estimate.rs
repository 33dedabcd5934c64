//! Comparison of an estimate with a known value, in units of the Monte Carlo standard error.

use crate::diagnostics as diag;
use crate::posterior::Posterior;

/// Largest R-hat at which chains count as mixed. Vehtari et al. (2021) recommend 1.01 for results that are reported.
/// The limit here is larger, because a comparison in units of the standard error is less sensitive to slow mixing.
const LARGEST_RHAT: f64 = 1.05;
/// Smallest number of effective draws per chain for a reliable standard error (Vehtari et al. 2021, section 4: 50 for
/// each half of a chain).
const LEAST_EFFECTIVE: f64 = 100.0;

/// Reason why an estimate does not confirm the expected value.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckFailure {
    /// The chains did not mix or have too few effective draws, so that no comparison is possible.
    #[error(
        "{what}: the chains do not mix (R-hat {rhat:.2}, at most {LARGEST_RHAT} is allowed; \
         {effective:.0} effective draws, at least {least:.0} are needed), so that the comparison is not \
         reliable: run longer, or see `summary()`"
    )]
    Unmixed {
        /// Name of the estimate, such as "mean of mu".
        what: String,
        /// Rank-normalised split R-hat.
        rhat: f64,
        /// Bulk effective sample size over all chains.
        effective: f64,
        /// Required effective sample size: 100 per chain.
        least: f64,
    },
    /// The estimate differs too much from the expected value.
    #[error(
        "{what}: got {got:.6}, expected {expected:.6}; the difference is {sigmas:.1} standard errors \
         (MCSE {mcse:.2e}, error of the reference {reference_error:.2e}), at most {allowed} are allowed"
    )]
    Distant {
        /// Name of the estimate, such as "mean of mu".
        what: String,
        /// Estimate from the draws.
        got: f64,
        /// Reference value.
        expected: f64,
        /// Monte Carlo standard error of the estimate.
        mcse: f64,
        /// Standard error of the reference value.
        reference_error: f64,
        /// Difference divided by the joint standard error; NaN if this is undefined.
        sigmas: f64,
        /// Largest number of standard errors allowed.
        allowed: f64,
    },
}

/// An estimate with its Monte Carlo standard error and the expected value.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "call within_mcse to assert"]
pub struct Estimate {
    what: String,
    got: f64,
    mcse: f64,
    expected: f64,
    reference_error: f64,
    rhat: f64,
    /// Bulk effective sample size. The field `least` is the smallest size that is accepted.
    effective: f64,
    least: f64,
}

impl Estimate {
    /// Estimates a mean from one trace (the sequence of draws) per chain, for draws that do not belong to a
    /// [`Posterior`].
    pub fn of_mean(name: &str, chains: &[&[f64]], expected: f64) -> Self {
        let got = diag::mean(chains.iter().copied().flatten().copied());
        Self::new(format!("mean of {name}"), chains, got, diag::mcse_mean(chains), expected)
    }

    /// Estimates a standard deviation from one trace (the sequence of draws) per chain.
    pub fn of_sd(name: &str, chains: &[&[f64]], expected: f64) -> Self {
        let (_, variance) = diag::mean_and_variance(chains.iter().copied().flatten().copied());
        let (what, mcse) = (format!("sd of {name}"), diag::mcse_sd(chains));
        Self::new(what, chains, variance.sqrt(), mcse, expected)
    }

    /// Estimates a quantile from one trace (the sequence of draws) per chain; `probability` is in (0, 1).
    pub fn of_quantile(name: &str, chains: &[&[f64]], probability: f64, expected: f64) -> Self {
        let got = diag::quantile(&chains.concat(), probability);
        let mcse = diag::mcse_quantile(chains, probability);
        let what = format!("{} % quantile of {name}", 100.0 * probability);
        Self::new(what, chains, got, mcse, expected)
    }

    fn new(what: String, chains: &[&[f64]], got: f64, mcse: f64, expected: f64) -> Self {
        Self {
            what,
            got,
            mcse,
            expected,
            reference_error: 0.0,
            rhat: diag::rhat(chains),
            effective: diag::ess_bulk(chains),
            least: LEAST_EFFECTIVE * chains.len() as f64,
        }
    }

    /// Sets the standard error of the reference value, for example of a reference from another long run.
    pub fn reference_error(mut self, standard_error: f64) -> Self {
        self.reference_error = standard_error;
        self
    }

    /// Absolute difference between estimate and expected value, divided by the joint standard error √(MCSE² +
    /// reference error²).
    pub fn sigmas(&self) -> f64 {
        (self.got - self.expected).abs() / self.mcse.hypot(self.reference_error)
    }

    /// Checks that the chains mix, and that estimate and expected value differ by at most `allowed` standard errors.
    /// A constant quantity has no standard error; its estimate must equal the expected value.
    ///
    /// # Errors
    /// [`CheckFailure::Unmixed`] if R-hat is above 1.05 or if there are fewer than 100 effective draws per chain.
    /// [`CheckFailure::Distant`] if the difference is larger than allowed.
    pub fn check(&self, allowed: f64) -> Result<(), CheckFailure> {
        let (what, rhat, effective, least) =
            (self.what.clone(), self.rhat, self.effective, self.least);
        // R-hat and effective sample size of a constant quantity are NaN, which passes this test
        if rhat > LARGEST_RHAT || effective < least {
            return Err(CheckFailure::Unmixed { what, rhat, effective, least });
        }
        let sigmas = self.sigmas();
        if sigmas <= allowed || self.got == self.expected {
            return Ok(());
        }
        Err(CheckFailure::Distant {
            what,
            got: self.got,
            expected: self.expected,
            mcse: self.mcse,
            reference_error: self.reference_error,
            sigmas,
            allowed,
        })
    }

    /// Asserts that the chains mix, and that estimate and expected value differ by at most `allowed` standard errors.
    ///
    /// # Panics
    /// If the assertion fails, with the message of [`CheckFailure`].
    #[track_caller]
    pub fn within_mcse(&self, allowed: f64) {
        if let Err(failure) = self.check(allowed) {
            panic!("{failure}");
        }
    }
}

/// Compares the posterior mean of one number, such as `mu` or `sd[0]`, with a known value:
/// `check::mean(&posterior, "mu", 4.37).within_mcse(4.0)`.
///
/// # Panics
/// If the posterior has no such quantity.
#[track_caller]
pub fn mean(posterior: &Posterior, name: &str, expected: f64) -> Estimate {
    with_trace(posterior, name, |chains| Estimate::of_mean(name, chains, expected))
}

/// Compares the posterior standard deviation of one number with a known value.
///
/// # Panics
/// If the posterior has no such quantity.
#[track_caller]
pub fn sd(posterior: &Posterior, name: &str, expected: f64) -> Estimate {
    with_trace(posterior, name, |chains| Estimate::of_sd(name, chains, expected))
}

/// Compares a posterior quantile of one number with a known value; `probability` is in (0, 1).
///
/// # Panics
/// If the posterior has no such quantity.
#[track_caller]
pub fn quantile(posterior: &Posterior, name: &str, probability: f64, expected: f64) -> Estimate {
    with_trace(posterior, name, |c| Estimate::of_quantile(name, c, probability, expected))
}

#[track_caller]
fn with_trace(
    posterior: &Posterior,
    name: &str,
    estimate: impl FnOnce(&[&[f64]]) -> Estimate,
) -> Estimate {
    let Some(trace) = posterior.trace(name) else {
        let names: Vec<String> =
            posterior.posterior.variables.iter().flat_map(|v| v.elements()).collect();
        panic!("the posterior has no `{name}`; it has {}", names.join(", "));
    };
    estimate(&trace.iter().map(Vec::as_slice).collect::<Vec<_>>())
}
