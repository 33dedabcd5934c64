//! Hardening of 304L steel from eight specimens, by the laws of Voce and Swift.
//!
//! ```text
//! cargo run --release -p models --example tension [tension.csv [picture.png]]
//! ```
//! Prints the posteriors, the leave-one-out predictive density of each specimen under each law, and the strain at which
//! a new specimen necks. Draws the curves with the 90 % predictive band of a new specimen.

use std::path::{Path, PathBuf};

use models::report::{Chart, Ink};
use models::tension::{
    HardeningLaw, Swift, TensionTest, Unloading, Voce, calibrate, loo_by_specimen,
    read_tension_tests,
};
use ppl::diagnostics::{Loo, loo_compare, quantile};
use ppl::prelude::*;

/// Young's modulus in MPa; the source of the data states 29 · 10⁶ psi.
const YOUNG_MPA: f64 = 200_000.0;

type Error = Box<dyn std::error::Error>;

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1).map(PathBuf::from);
    let shipped = || Path::new(env!("CARGO_MANIFEST_DIR")).join("data/matcal_304L_tension.csv");
    let file = arguments.next().unwrap_or_else(shipped);
    let tests = read_tension_tests(&file, YOUNG_MPA, Unloading::default())?;
    let picture = arguments.next().unwrap_or_else(|| "tension.png".into());
    for test in &tests {
        let [kept, left] = [test.points.len(), test.unloading.len()];
        println!("{}: {kept} points, {left} readings of unloading left out", test.specimen);
    }
    let (voce, left) = look_at::<Voce>("Voce", &tests)?;
    let (swift, right) = look_at::<Swift>("Swift", &tests)?;
    println!("Log predictive density of whole specimens\n");
    println!("{}", loo_compare(&[("Voce", &voce), ("Swift", &swift)])?);
    Chart::write_png(&picture, vec![left, right])?;
    println!("{}", picture.display());
    Ok(())
}

/// Calibrates a law; returns its cross-validation and its chart.
fn look_at<L: HardeningLaw>(name: &str, tests: &[TensionTest]) -> Result<(Loo, Chart), Error> {
    let sampler = Nuts::default().chains(4).warmup(1000).draws(1000).target_accept(0.98).seed(1);
    let posterior = calibrate::<L>(tests, &sampler)?;
    println!("{name}: {}\n{}", L::PARAMETERS.join(", "), posterior.summary());
    let loo = loo_by_specimen::<L>(&posterior, tests, &sampler)?;
    for (test, point) in tests.iter().zip(&loo.points) {
        println!("{}: elpd {:.1}, Pareto k {:.2}", test.specimen, point.elpd, point.pareto_k);
    }
    // predictive draws of the parameters of a new specimen; each draw gives a curve
    let new = posterior.predictive.get("ln_new").map_or(&[][..], |values| &values.data);
    let new: Vec<[f64; 3]> =
        new.chunks_exact(3).map(|ln| [ln[0].exp(), ln[1].exp(), ln[2].exp()]).collect();
    let necking: Vec<f64> = new.iter().map(|own| L::uniform_strain(own)).collect();
    let [low, middle, high] = [0.05, 0.5, 0.95].map(|p| quantile(&necking, p));
    println!("a new specimen necks at a strain of {middle:.3} ({low:.3} … {high:.3})");
    let measured: Vec<String> = tests.iter().map(|t| format!("{:.3}", t.uniform_strain)).collect();
    println!("measured: {}\n", measured.join(", "));
    let strains: Vec<f64> = (0..=100).map(|i| 0.0051 * f64::from(i)).collect();
    let curve = |own: &[f64; 3]| strains.iter().map(|&e| L::stress_mpa(own, e)).collect();
    let curves: Vec<Vec<f64>> = new.iter().map(curve).collect();
    let mut chart = Chart::new("plastic strain", "true stress (MPa)")
        .titled(name)
        .over((0.0, 0.52), (150.0, 1050.0))
        .band("90 % of new specimens", Ink::Posterior, &strains, &curves, 0.9);
    for (k, test) in tests.iter().enumerate() {
        let curve = test.points.iter().map(|p| (p.plastic_strain, p.true_stress_mpa));
        chart = chart.thin(if k == 0 { "eight specimens" } else { "" }, Ink::Measured, curve);
    }
    Ok((loo, chart))
}
