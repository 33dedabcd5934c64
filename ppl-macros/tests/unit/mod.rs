//! Tests that need to see inside the macro.

mod expansions;
mod fuzz;
