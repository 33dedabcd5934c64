//! Unit tests of the macro.

mod expansions;
mod fuzz;
