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
//! 1. `error`, `columns`, `dataset`: errors; runs of the model, columns that describe them, and their CSV file
//! 2. `design`: experimental designs, the points at which to run the model
//! 3. `basis`: coordinates, one-dimensional polynomials and their products
//! 4. `expansion`: the expansion, its file, its moments and Sobol indices, its use in a `ppl` model
//! 5. `coefficients`: posterior of the coefficients, intervals of Sobol indices, and where further runs reduce
//!    the variance
//! 6. `fit`: least squares and its errors, the choice of order, scale and terms
//! 7. `groups`: variance components for runs in groups, such as several runs on one specimen

mod basis;
mod coefficients;
mod columns;
mod dataset;
mod design;
mod error;
mod expansion;
mod fit;
mod groups;

pub use basis::legendre::MAX_ORDER;
pub use basis::multi_index::Truncation;
pub use basis::scale::Scale;
pub use coefficients::intervals::SobolIntervals;
pub use coefficients::posterior::CoefficientPosterior;
pub use columns::{Cell, Column, Role};
pub use dataset::{Dataset, Input};
pub use design::DesignMethod;
pub use error::SurrogateError;
pub use expansion::dyn_pce::{BoxPosition, DynPce};
pub use expansion::pce::Pce;
pub use expansion::sobol::SobolIndices;
pub use fit::options::{FitOptions, PceFit, Terms};
pub use fit::report::FitReport;
pub use fit::scale_choice::Scales;
pub use fit::select::{Holdout, LeaveOneOutError, OrderReport, OrderRule, SplitError};
pub use groups::GroupedRuns;
pub use rand;
