//! Tests with synthetic specimens of known location and known grains.

mod dark;
mod location;
mod scene;
mod small_grains;
mod uneven;
