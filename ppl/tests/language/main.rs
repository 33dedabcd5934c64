//! Models in the language of `model!` against the same models by hand, and three methods of differentiation for every
//! kind of statement.

mod accumulators;
mod by_hand;
mod densities;
mod dimensions;
mod entries;
mod literals;
mod long;
mod missing;
mod models;
mod names;
mod non_centered;
mod quiet;
mod records;
mod references;
mod submodels;
mod sufficient_statistics;
mod sums;
mod tails;
mod updates;
mod variables;
