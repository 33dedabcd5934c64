//! Distributions: densities with exact partial derivatives, draws, supports, moments.
//!
//! Each family has its own file: continuous univariate distributions in `continuous`, distributions of counts and
//! flags in `discrete`, distributions of vectors and matrices in `multivariate`, variations and mixtures in
//! `compound`, regressions in `glm`, Gaussian processes in `gaussian_process`. Parameters are public fields
//! (`Normal(mean, sd)`). Each parameter is a number, a reference to a number, or an unknown of the model. Variations
//! are methods of [`Family`]: `.truncate(a..b)`, `.censor(a..b)`, `.iid(n)`, `.array::<N>()`,
//! `.array::<N>().ordered()`, `.non_centered()`.

// the modules are in order of dependency: each module uses only modules above it
mod interval;

mod family;

mod traits;

mod univariate;

mod interval_mass;

mod univariate_density;

mod vector;

pub(crate) mod user_defined;

mod continuous;

mod discrete;

mod multivariate;

mod compound;

mod glm;

mod gaussian_process;

pub use compound::*;
pub use continuous::*;
pub use discrete::*;
pub use family::{Array, Censored, Family, Iid, NonCentered, Ordered, Truncated};
pub use gaussian_process::*;
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
