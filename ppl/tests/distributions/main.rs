//! Tests of all distributions with independent references: finite differences, quadrature, comparison of draws with
//! distribution functions, and values computed with 50 digits.

mod counts;
mod discrete;
mod extremes;
mod far_models;
mod gaussian_process;
mod intervals;
mod lkj;
mod multivariate;
mod numerics;
mod own_density;
mod own_tails;
mod reference;
mod scalar_models;
mod scipy_families;
mod sizes;
mod stability;
mod tails;
mod univariate;
mod validation;
mod variations;
mod vector_conformance;
mod vector_models;
mod vectors;
