//! Guide to the modelling language in short pages, from coin flips to a calibrated surrogate.
//!
//! Every page builds a model, runs it and explains the results. Read the pages in order. The page of
//! [`model!`](crate::model!) is the reference.
//!
//! 0. [`first_crate`]: a crate of your own, from `cargo new` to a first posterior
//! 1. [`coin`]: unknowns, data, a first posterior
//! 2. [`measurements`]: several unknowns, plates over data
//! 3. [`regression`]: predictors, generic models, predictions
//! 4. [`hierarchy`]: groups that share a distribution, and parametrisations of hierarchical models
//! 5. [`checking`]: convergence diagnostics and warnings
//! 6. [`predicting`]: prior and posterior predictive checks
//! 7. [`comparing`]: comparison of models by cross-validation
//! 8. [`extending`]: user-defined functions and distributions
//! 9. [`testing`]: tests of models under `cargo test`
//! 10. [`surrogates`]: calibration of a simulation with a cheap surrogate

#[doc = include_str!("../../docs/guide/first_crate.md")]
pub mod first_crate {}

#[doc = include_str!("../../docs/guide/coin.md")]
pub mod coin {}

#[doc = include_str!("../../docs/guide/measurements.md")]
pub mod measurements {}

#[doc = include_str!("../../docs/guide/regression.md")]
pub mod regression {}

#[doc = include_str!("../../docs/guide/hierarchy.md")]
pub mod hierarchy {}

#[doc = include_str!("../../docs/guide/checking.md")]
pub mod checking {}

#[doc = include_str!("../../docs/guide/predicting.md")]
pub mod predicting {}

#[doc = include_str!("../../docs/guide/comparing.md")]
pub mod comparing {}

#[doc = include_str!("../../docs/guide/extending.md")]
pub mod extending {}

#[doc = include_str!("../../docs/guide/testing.md")]
pub mod testing {}

#[doc = include_str!("../../docs/guide/surrogates.md")]
pub mod surrogates {}
