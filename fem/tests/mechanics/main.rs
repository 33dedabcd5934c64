//! Whole problems: closed forms, published figures, other codes, and what is refused.

#[path = "../support/mod.rs"]
mod support;

mod boundary;
mod checkpoint;
mod compression;
mod contact;
mod cook;
mod curved;
mod damage;
mod device;
mod homogeneous;
mod iterations;
mod manufactured;
mod mixture;
mod notched_plate;
mod reference_cylinder;
mod refusals;
mod sensitivity;
mod solution;
