//! Distributions: densities with exact partial derivatives, draws, supports, moments.
//!
//! Each family has its own file: continuous univariate distributions in `continuous`, distributions of counts and
//! flags in `discrete`, distributions of vectors and matrices in `multivariate`, variations and mixtures in
//! `compound`, regressions in `glm`, Gaussian processes in `gaussian_process`. Parameters are public fields
//! (`Normal(mean, sd)`). Each parameter is a number, a reference to a number, or an unknown of the model. Variations
//! are methods of [`Variations`]: `.truncate(a..b)`, `.censor(a..b)`, `.iid(n)`, `.array::<N>()`,
//! `.array::<N>().ordered()`, `.non_centered()`.
//!
//! A module imports only from modules above it in this list:
//! 1. `interval`, `family`, `traits`: ranges, the marker and the traits of distributions
//! 2. `univariate`, `interval_mass`, `univariate_density`: univariate distributions, probabilities of intervals
//! 3. `vector`: sequences of parameters
//! 4. `user_defined`: distributions of a user
//! 5. `continuous`, `discrete`, `multivariate`: families
//! 6. `compound`: variations and mixtures
//! 7. `glm`: regressions
//! 8. `gaussian_process`: Gaussian processes

mod compound;
mod continuous;
mod discrete;
mod family;
mod gaussian_process;
mod glm;
mod interval;
mod interval_mass;
mod multivariate;
mod traits;
mod univariate;
mod univariate_density;
pub(crate) mod user_defined;
mod vector;

pub use compound::*;
pub use continuous::*;
pub use discrete::*;
pub use family::Family;
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
pub use vector::Sequence;
