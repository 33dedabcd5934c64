//! Datasets, fits, evaluation and errors of expansions.

mod coefficients;
mod dataset;
mod derivatives;
mod evaluation;
mod fit;
mod groups;
mod reference;
mod scales;
mod sparse;
