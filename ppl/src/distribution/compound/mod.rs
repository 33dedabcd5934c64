//! Distributions composed of other distributions: arrays, truncation, censoring, ordering, mixtures.

mod array;
mod censored;
mod iid;
mod mixture;
mod non_centered;
mod ordered;
mod repeated;
mod truncated;
mod variations;

pub use array::Array;
pub use censored::Censored;
pub use iid::Iid;
pub use mixture::Mixture;
pub use non_centered::{LocationScale, NonCentered};
pub use ordered::Ordered;
pub use repeated::Repeated;
pub use truncated::Truncated;
pub use variations::Variations;
