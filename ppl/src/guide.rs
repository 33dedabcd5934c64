//! The language in ten short pages, from coin flips to a calibrated surrogate.
//!
//! Every page builds one model, runs it and says what to look at. Read them in order; the page
//! of [`model!`](crate::model!) is the reference.
//!
//! 1. [`coin`]: unknowns, data, a first posterior
//! 2. [`measurements`]: several unknowns, plates over data
//! 3. [`regression`]: predictors, generic models, predictions
//! 4. [`hierarchy`]: groups that share a distribution, and its shape
//! 5. [`checking`]: was the run good? diagnostics and warnings
//! 6. [`predicting`]: would the model make such data? prior and posterior predictive checks
//! 7. [`comparing`]: which of two models predicts better? cross-validation
//! 8. [`extending`]: own functions and own distributions
//! 9. [`testing`]: models under `cargo test`
//! 10. [`surrogates`]: calibrating a simulation through a cheap stand-in

#[doc = include_str!("../docs/guide/coin.md")]
pub mod coin {}

#[doc = include_str!("../docs/guide/measurements.md")]
pub mod measurements {}

#[doc = include_str!("../docs/guide/regression.md")]
pub mod regression {}

#[doc = include_str!("../docs/guide/hierarchy.md")]
pub mod hierarchy {}

#[doc = include_str!("../docs/guide/checking.md")]
pub mod checking {}

#[doc = include_str!("../docs/guide/predicting.md")]
pub mod predicting {}

#[doc = include_str!("../docs/guide/comparing.md")]
pub mod comparing {}

#[doc = include_str!("../docs/guide/extending.md")]
pub mod extending {}

#[doc = include_str!("../docs/guide/testing.md")]
pub mod testing {}

#[doc = include_str!("../docs/guide/surrogates.md")]
pub mod surrogates {}
