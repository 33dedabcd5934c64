//! Distributions: density with exact partials, draws, support, moments.
//!
//! One family a file: of one real number in `continuous`, of counts, flags and categories in
//! `discrete`, of vectors and matrices in `multivariate`; variations and mixtures of others in
//! `compound`; regressions in `glm`. Parameters are public fields (`Normal(mean, sd)`), each a number, a reference to one,
//! or an unknown of the model. Variations are methods of [`Family`]: `.truncate(a..b)`,
//! `.censor(a..b)`, `.iid(n)`, `.array::<N>()`, `.array::<N>().ordered()`, `.non_centered()`.

// in the order in which they may use each other
mod interval;

mod family;

mod traits;

mod univariate;

mod interval_mass;

mod univariate_density;

mod vector;

mod continuous;

mod discrete;

mod multivariate;

mod compound;

mod glm;

pub use compound::*;
pub use continuous::*;
pub use discrete::*;
pub use family::{Array, Censored, Family, Iid, NonCentered, Ordered, Truncated};
pub use glm::{
    BernoulliLogitGlm, ByGroup, Design, Intercept, NormalGlm, PoissonLogGlm, Predictors,
};
pub use interval::{Ends, Interval};
pub use multivariate::*;
pub use traits::{Distribution, Unknown};
pub use univariate::Univariate;
pub use univariate_density::UnivariateDensity;
#[doc(hidden)]
pub use univariate_density::{add_terms, constrain};
pub use vector::{Repeated, Sequence};
