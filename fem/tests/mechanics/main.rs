//! Complete problems: comparison with closed forms, published values and other codes, and errors of invalid input.

#[path = "../support/mod.rs"]
mod support;

mod advice;
mod boundary;
mod cantilever;
mod checkpoint;
mod compression;
mod contact;
mod cook;
mod cook_plasticity;
mod curved;
mod damage;
mod device;
mod energy_release;
mod failed_steps;
mod homogeneous;
mod incompressible;
mod inelastic;
mod interface;
mod iterations;
mod jump;
mod limit_load;
mod limits;
mod loads;
mod manufactured;
mod mixture;
mod necking;
mod nine_circles;
mod notched_plate;
mod platen_tolerance;
mod program;
mod rate_independent;
mod reference_cylinder;
mod refusals;
mod round_bar;
mod sensitivity;
mod simo_steel;
mod solution;
mod state_sensitivity;
mod strength;
mod supports;
mod thick_sphere;
mod unloading;
mod warnings;
