//! The first draws for a seed. A change of these draws changes all stored results, so that it must be intended.

use std::fmt::Write;

use ppl::Recordable;
use ppl::prelude::*;
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

fn first_draws<D: Distribution<f64>>(out: &mut String, name: &str, distribution: D) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(2026);
    let mut values = Vec::new();
    for _ in 0..3 {
        distribution.draw(&mut rng).flatten(&mut values);
    }
    writeln!(out, "{name}: {values:.12?}").unwrap();
}

#[test]
fn first_draws_of_every_family() {
    let out = &mut String::new();
    first_draws(out, "Normal", Normal(0.5, 2.0));
    first_draws(out, "Uniform", Uniform(-1.0, 3.0));
    first_draws(out, "HalfNormal", HalfNormal(2.0));
    first_draws(out, "LogNormal", LogNormal(0.5, 0.3));
    first_draws(out, "Exponential", Exponential(0.5));
    first_draws(out, "Gamma", Gamma(2.5, 0.5));
    first_draws(out, "Beta", Beta(2.0, 3.0));
    first_draws(out, "StudentT", StudentT(4.0, 1.0, 2.0));
    first_draws(out, "HalfCauchy", HalfCauchy(2.0));
    first_draws(out, "Poisson", Poisson(6.0));
    first_draws(out, "Bernoulli", Bernoulli(0.7));
    first_draws(out, "Truncated", Normal(0.15, 0.25).truncate(0.0..));
    first_draws(out, "Array", Normal(0.5, 2.0).array::<2>());
    first_draws(out, "Iid", Normal(0.5, 2.0).iid(2));
    let factor = CholeskyFactor::new([[2.0, 0.0], [0.5, 1.0]]).unwrap();
    first_draws(out, "MvNormalCholesky", MvNormalCholesky([0.0, 1.0], factor));
    first_draws(out, "LkjCholesky", LkjCholesky::<2>(3.0));
    let expected = include_str!("first_draws.txt");
    assert_eq!(out.as_str(), expected, "the draws of this seed are now\n{out}");
}
