//! The rubber laws on Treloar's data: gradients, and which law predicts best.

use models::hyperelastic::{mooney_rivlin, neo_hookean, ogden, treloar_1944};
use ppl::diagnostics::{Loo, loo_compare};
use ppl::prelude::*;
use ppl::{Bound, Model};

#[test]
fn gradients_are_derivatives() {
    let tests = treloar_1944();
    ppl::check::gradient(&neo_hookean(&tests), 1);
    ppl::check::gradient(&mooney_rivlin(&tests), 2);
    ppl::check::gradient(&ogden(&tests), 3);
}

fn loo<M: Model>(model: &Bound<M>) -> Loo {
    let posterior = Nuts::default().chains(2).warmup(300).draws(300).seed(1).sample(model).unwrap();
    let summary = posterior.summary();
    assert!(summary.rows.iter().all(|row| row.rhat < 1.05), "{summary}");
    posterior.loo().unwrap()
}

/// A law with one modulus cannot fit the S-shaped curves at large stretches; a law with three terms can.
#[test]
fn ogden_predicts_better_than_neo_hookean() {
    let tests = treloar_1944();
    let (neo, three_terms) = (loo(&neo_hookean(&tests)), loo(&ogden(&tests)));
    let table = loo_compare(&[("neo-Hookean", &neo), ("Ogden", &three_terms)]).unwrap();
    let worse = &table.rows[1];
    assert_eq!(worse.name, "neo-Hookean", "{table}");
    assert!(worse.difference < -2.0 * worse.difference_se, "{table}");
}
