//! Statistical assertions for the tests of user code.
//!
//! Sampling is random, so a tolerance must come from the standard error of the estimate, and every assertion has a
//! known probability of failing although nothing is wrong:
//!
//! | assertion | tolerance | false alarms |
//! |---|---|---|
//! | [`mean`], [`sd`], [`quantile`] `.within_mcse(k)` | k Monte Carlo standard errors | 2 Φ(−k): 1 in 370 for k = 3, 1 in 16 000 for k = 4 |
//! | [`gradient`] | 1e-8 relative | none: the seed fixes the random points |
//! | [`assert_distribution!`] | relative, per property; draws at level 1 in 10 000 | none: the seed is fixed |
//! | [`sbc`] `.assert_uniform(p)` | uniform ranks | at most p, over all quantities |
//!
//! [`mean`], [`sd`] and [`quantile`] also fail if the chains do not mix, that is, if R-hat is above 1.05 or if there
//! are fewer than 100 effective draws per chain. Without this test, chains in separate modes would pass for any
//! expected value, because their standard error is very large.
//!
//! The false-alarm rate of [`mean`], [`sd`] and [`quantile`] assumes that the MCSE is known exactly. With the few
//! hundred effective draws of a short run, the MCSE has an uncertainty of about 5 %, which can double the false-alarm
//! rate at k = 4. With a fixed seed, a test gives the same result in every run, so a false alarm appears once, when
//! the test is written.
//!
//! ```
//! use ppl::check;
//! let draws: Vec<f64> = (0..1000).map(|i| ((i as f64 + 0.5) * 0.618_033_988_749).fract()).collect();
//! check::Estimate::of_mean("u", &[&draws], 0.5).within_mcse(4.0);
//! ```

mod distribution;
mod error;
mod estimate;
mod gradient;
mod sampler;
mod sbc;

pub use crate::assert_distribution;
#[doc(hidden)]
pub use distribution::{Case, Lifted, Over, assert_conformance};
pub use error::CheckError;
pub use estimate::{CheckFailure, Estimate, mean, quantile, sd};
pub use gradient::{GradientMismatch, gradient, gradient_at};
pub use sampler::{Draws, Sampler};
pub use sbc::{Sbc, SbcQuantity, SbcReport, Trial, sbc};
