//! Probabilistic programming.
