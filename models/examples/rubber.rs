//! Three laws of rubber elasticity calibrated on Treloar's data and compared by PSIS-LOO.
//!
//! ```text
//! cargo run --release --example rubber
//! ```

use models::hyperelastic::{mooney_rivlin, neo_hookean, ogden, treloar_1944};
use ppl::diagnostics::{Loo, loo_compare};
use ppl::prelude::*;
use ppl::{Bound, Model};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let tests = treloar_1944();
    println!("Treloar 1944: {} points in uniaxial, equibiaxial and pure shear\n", tests.len());
    let loos = [
        ("neo-Hookean", calibrate("neo-Hookean", &neo_hookean(&tests))?),
        ("Mooney–Rivlin", calibrate("Mooney–Rivlin", &mooney_rivlin(&tests))?),
        ("Ogden, 3 terms", calibrate("Ogden, 3 terms", &ogden(&tests))?),
    ];
    println!("Expected log predictive density of a new point, best law first\n");
    println!(
        "{}",
        loo_compare(&[(loos[0].0, &loos[0].1), (loos[1].0, &loos[1].1), (loos[2].0, &loos[2].1)])?
    );
    Ok(())
}

fn calibrate<M: Model>(name: &str, model: &Bound<M>) -> Result<Loo, Box<dyn std::error::Error>> {
    let posterior = Nuts::default().chains(4).draws(2000).seed(1).sample(model)?;
    println!("{name}\n{}", posterior.summary());
    Ok(posterior.loo()?)
}
