//! Synthetic specimens whose place and grains are known.

mod location;
mod scene;
mod small_grains;
