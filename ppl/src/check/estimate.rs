//! An estimate against a known value, in units of its Monte Carlo standard error.

use crate::diagnostics as diag;
use crate::posterior::Posterior;

/// R-hat from which on chains are not of one distribution. Vehtari et al. (2021) ask for 1.01 before
/// results are reported; an assertion with its own standard error needs less.
const LARGEST_RHAT: f64 = 1.05;
/// Effective draws for each chain below which a standard error is not known itself (Vehtari et al.
/// 2021, section 4: 50 for each half of a chain).
const LEAST_EFFECTIVE: f64 = 100.0;

/// Why an estimate does not confirm the value expected.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CheckFailure {
    /// The chains say nothing, whatever was expected: they disagree, or have too few effective draws.
    #[error(
        "{what}: the chains do not mix (R-hat {rhat:.2}, at most {LARGEST_RHAT} is allowed; \
         {effective:.0} effective draws, at least {least:.0} are needed), so that they confirm no \
         value: run longer, or see `summary()`"
    )]
    Unmixed {
        /// The quantity, as "mean of mu".
        what: String,
        /// Rank-normalised split R-hat.
        rhat: f64,
        /// Bulk effective sample size over all chains.
        effective: f64,
        /// The least that is needed: 100 a chain.
        least: f64,
    },
    /// The estimate lies too far from what was expected.
    #[error(
        "{what}: got {got:.6}, expected {expected:.6}; the difference is {sigmas:.1} standard errors \
         (MCSE {mcse:.2e}, error of the reference {reference_error:.2e}), allowed are {allowed}"
    )]
    Distant {
        /// The quantity, as "mean of mu".
        what: String,
        /// Estimate from the draws.
        got: f64,
        /// Reference value.
        expected: f64,
        /// Monte Carlo standard error of the estimate.
        mcse: f64,
        /// Standard error of the reference value.
        reference_error: f64,
        /// Difference over the joint standard error; NaN where it is not defined.
        sigmas: f64,
        /// Largest number of standard errors allowed.
        allowed: f64,
    },
}

/// An estimate, its Monte Carlo standard error and the value expected.
#[derive(Clone, Debug, PartialEq)]
#[must_use = "call within_mcse to assert"]
pub struct Estimate {
    what: String,
    got: f64,
    mcse: f64,
    expected: f64,
    reference_error: f64,
    rhat: f64,
    /// Bulk effective sample size, and the least that is needed.
    effective: f64,
    least: f64,
}

impl Estimate {
    /// Of the mean of one trace a chain, for draws that do not belong to a [`Posterior`].
    pub fn of_mean(name: &str, chains: &[&[f64]], expected: f64) -> Self {
        let got = diag::mean(chains.iter().copied().flatten().copied());
        Self::new(format!("mean of {name}"), chains, got, diag::mcse_mean(chains), expected)
    }

    /// Of the standard deviation of one trace a chain.
    pub fn of_sd(name: &str, chains: &[&[f64]], expected: f64) -> Self {
        let (_, variance) = diag::mean_and_variance(chains.iter().copied().flatten().copied());
        let (what, mcse) = (format!("sd of {name}"), diag::mcse_sd(chains));
        Self::new(what, chains, variance.sqrt(), mcse, expected)
    }

    /// Of a quantile of one trace a chain; `probability` in (0, 1).
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

    /// The reference has a standard error itself, as one that comes from another long run.
    pub fn reference_error(mut self, standard_error: f64) -> Self {
        self.reference_error = standard_error;
        self
    }

    /// Difference in joint standard errors, √(MCSE² + reference error²).
    pub fn sigmas(&self) -> f64 {
        (self.got - self.expected).abs() / self.mcse.hypot(self.reference_error)
    }

    /// Whether the chains mix, and the difference is at most `allowed` standard errors. An estimate
    /// that has no standard error, because the quantity never moved, has to be exact.
    ///
    /// # Errors
    /// [`CheckFailure::Unmixed`] for an R-hat above 1.05 or fewer than 100 effective draws a chain,
    /// whatever was expected; else [`CheckFailure::Distant`] with all numbers.
    pub fn check(&self, allowed: f64) -> Result<(), CheckFailure> {
        let (what, rhat, effective, least) =
            (self.what.clone(), self.rhat, self.effective, self.least);
        // of a quantity that never moved both are NaN
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

    /// Asserts that the chains mix, and that the difference is at most `allowed` standard errors.
    ///
    /// # Panics
    /// If not, with the numbers of [`CheckFailure`].
    #[track_caller]
    pub fn within_mcse(&self, allowed: f64) {
        if let Err(failure) = self.check(allowed) {
            panic!("{failure}");
        }
    }
}

/// The posterior mean of one number, as `mu` or `sd[0]`, against a known value:
/// `check::mean(&posterior, "mu", 4.37).within_mcse(4.0)`.
///
/// # Panics
/// If the posterior has no such quantity.
#[track_caller]
pub fn mean(posterior: &Posterior, name: &str, expected: f64) -> Estimate {
    with_trace(posterior, name, |chains| Estimate::of_mean(name, chains, expected))
}

/// The posterior standard deviation of one number against a known value.
///
/// # Panics
/// If the posterior has no such quantity.
#[track_caller]
pub fn sd(posterior: &Posterior, name: &str, expected: f64) -> Estimate {
    with_trace(posterior, name, |chains| Estimate::of_sd(name, chains, expected))
}

/// A posterior quantile of one number against a known value; `probability` in (0, 1).
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
        let known: Vec<String> =
            posterior.posterior.variables.iter().flat_map(|v| v.elements()).collect();
        panic!("the posterior has no `{name}`; it has {}", known.join(", "));
    };
    estimate(&trace.iter().map(Vec::as_slice).collect::<Vec<_>>())
}
