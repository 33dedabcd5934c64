//! Distributions composed of other distributions: arrays, truncation, censoring, ordering, mixtures.

mod array;
mod censored;
mod iid;
mod mixture;
mod non_centered;
mod ordered;
mod truncated;

pub use mixture::Mixture;
pub use non_centered::LocationScale;
