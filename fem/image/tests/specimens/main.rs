//! Synthetic specimens whose place and grains are known.

mod dark;
mod location;
mod scene;
mod small_grains;
mod uneven;
