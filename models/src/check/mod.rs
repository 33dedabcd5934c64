//! `breccia check`: reads everything that a case names, and reports what was understood, all mistakes and the expected
//! cost. Nothing is computed and no file is written.

pub(crate) mod case_check;
pub(crate) mod expected_cost;
pub(crate) mod mask;
pub(crate) mod outside;
pub(crate) mod words;
