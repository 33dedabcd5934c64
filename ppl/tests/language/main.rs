//! The language of `model!` against the same models by hand, and three ways to differentiate
//! every kind of statement.

mod densities;
mod entries;
mod literals;
mod long;
mod models;
mod names;
mod records;
mod references;
mod tails;
mod updates;
mod variables;
