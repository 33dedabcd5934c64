//! Complete problems: comparison with closed forms, published values and other codes, and errors of invalid input.

#[path = "../support/mod.rs"]
mod support;

mod advice;
mod boundary;
mod checkpoint;
mod compression;
mod contact;
mod cook;
mod curved;
mod damage;
mod device;
mod failed_steps;
mod force_control;
mod homogeneous;
mod incompressible;
mod inelastic;
mod interface;
mod iterations;
mod jump;
mod limits;
mod loads;
mod manufactured;
mod mixture;
mod notched_plate;
mod platen_tolerance;
mod pressure;
mod program;
mod rate_independent;
mod reference_cylinder;
mod refusals;
mod round_bar;
mod sensitivity;
mod solution;
mod state_sensitivity;
mod strength;
mod supports;
mod unloading;
mod warnings;
