//! Tests with synthetic specimens of known location and known grains.

mod continuity;
mod dark;
mod fine_detail;
mod location;
mod scene;
mod small_grains;
mod uneven;
mod warnings;
