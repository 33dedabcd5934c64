//! Scalar types: plain numbers, dual numbers, and numbers on a tape.

pub(crate) mod arithmetic;
pub(crate) mod dual;
pub(crate) mod ln_sum_exp;
pub(crate) mod partials;
pub(crate) mod real;
pub(crate) mod scalar;
pub mod tape;
