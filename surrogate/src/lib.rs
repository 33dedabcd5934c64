//! Polynomial chaos surrogates of expensive computer models, with exact gradients.
//!
//! Some computer models take hours per run and cannot be sampled directly. A [`DesignMethod`] chooses the points at
//! which to run the model, a [`Dataset`] stores the results, and [`Pce::fit`] fits a polynomial chaos expansion whose
//! order has the least leave-one-out error. The fitted [`Pce`] evaluates in nanoseconds: value and Jacobian together,
//! moments and Sobol indices. A [`Pce`] returns an error for points outside the box of the training runs. This crate
//! does not depend on the kind of computer model.
//!
//! ```
//! use surrogate::{Dataset, DesignMethod, FitOptions, Input, Pce};
//!
//! // points at which to run the model
//! let inputs = vec![Input::new("young_mpa", 250.0, 300.0)?, Input::new("poisson", 0.2, 0.3)?];
//! let points = DesignMethod::Sobol.sample(&inputs, 64, 1)?;
//!
//! // results of the runs, in one file that other tools can read
//! let mut runs = Dataset::new(inputs, vec!["bulk_mpa".into()], "K = E / (3 (1 - 2 nu))")?;
//! for x in points {
//!     runs.push(&x, &[x[0] / (3.0 * (1.0 - 2.0 * x[1]))])?;
//! }
//!
//! // surrogate of the model
//! let fit = Pce::<2, 1>::fit(&runs, &FitOptions::default())?;
//! println!("{}", fit.report);
//! let (bulk, slope) = fit.pce.value_and_jacobian(&[275.0, 0.25])?;
//! assert!((bulk[0] - 275.0 / 1.5).abs() < 1e-3);
//! assert!((slope[0][0] - 1.0 / 1.5).abs() < 1e-4);
//! assert!(fit.pce.sobol().total[0][1] > 0.8);
//! # Ok::<(), surrogate::SurrogateError>(())
//! ```
//!
//! Scope: independent uniform inputs on a box; expansions fitted by least squares up to order 16, with all
//! terms of an order or a sparse subset ([`Terms`]). [`Pce`] has numbers of inputs and outputs that are known
//! at compile time. [`DynPce`] has numbers that are known at run time, for example from a file.
//!
//! # Modules
//!
//! A module imports only from modules above it in this list, and no two files import each other.
//!
//! 1. `error`, `dataset`, `dataset_csv`: errors; runs of the model and their CSV file
//! 2. `sobol_sequence`, `design`: experimental designs, the points at which to run the model
//! 3. `scale`, `legendre`, `multi_index`: coordinates, one-dimensional polynomials and their products
//! 4. `dyn_pce`, `kernel`, `pce`: the expansion, with sizes known at run time and at compile time
//! 5. `pce_file`, `quadrature`, `sobol`, `differentiable`: file format, moments and Sobol indices, use in a
//!    `ppl` model
//! 6. `coefficients`: posterior of the coefficients, intervals of Sobol indices, and where further runs reduce
//!    the variance
//! 7. `fit`: least squares and its errors, the choice of order, scale and terms
//! 8. `groups`: variance components for runs in groups, such as several runs on one specimen

mod coefficients;
mod dataset;
mod dataset_csv;
mod design;
mod differentiable;
mod dyn_pce;
mod error;
mod fit;
mod groups;
mod kernel;
mod legendre;
mod multi_index;
mod pce;
mod pce_file;
mod quadrature;
mod scale;
mod sobol;
mod sobol_sequence;

pub use coefficients::intervals::SobolIntervals;
pub use coefficients::posterior::CoefficientPosterior;
pub use dataset::{Dataset, Input};
pub use design::DesignMethod;
pub use dyn_pce::{BoxPosition, DynPce};
pub use error::SurrogateError;
pub use fit::options::{FitOptions, PceFit, Terms};
pub use fit::report::FitReport;
pub use fit::scale_choice::Scales;
pub use fit::select::{Holdout, LeaveOneOutError, OrderReport, OrderRule, SplitError};
pub use groups::GroupedRuns;
pub use legendre::MAX_ORDER;
pub use multi_index::Truncation;
pub use pce::Pce;
pub use rand;
pub use scale::Scale;
pub use sobol::SobolIndices;
