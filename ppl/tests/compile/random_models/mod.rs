//! Randomly written models, each differentiated by three methods.
//!
//! The models are written to a file, compiled and run. `RANDOM_MODELS=3000 cargo test -p ppl --test
//! compile random_models` tries 3000 models.

mod families;
mod plates;
mod shapes;
mod statements;
mod writer;

use std::fmt::Write;
use std::process::Command;

use rand::Rng;

use crate::rustc_with_ppl;
use writer::Writer;

/// Number of models in one file, which rustc compiles in a few seconds without optimisation.
const IN_A_FILE: usize = 40;

/// Checks every model at several draws from its prior.
const HARNESS: &str = r#"
use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use ppl::rand::SeedableRng;

fn check(name: &str, model: &Bound<impl Model>) {
    let mut rng = ppl::rand_xoshiro::Xoshiro256PlusPlus::seed_from_u64(5);
    let dim = model.layout().unwrap_or_else(|error| panic!("{name}: {error}")).dim;
    let mut workspace = Workspace::default();
    let [mut compiled, mut tape, mut dual] = [vec![0.0; dim], vec![0.0; dim], vec![0.0; dim]];
    for _ in 0..3 {
        let y = model.draw_prior(&mut rng).unwrap().unconstrained;
        let Ok(value) = model.log_density(&y, &mut workspace) else { continue };
        let values = [
            model.gradient(&y, &mut compiled, &mut workspace).unwrap(),
            model.tape_gradient(&y, &mut tape, &mut workspace).unwrap(),
            model.forward_gradient(&y, &mut dual).unwrap(),
        ];
        for other in values {
            assert!((other - value).abs() <= 1e-11 * (1.0 + value.abs()), "{name}: {values:?}");
        }
        // rounding errors are relative to the largest component of the gradient
        let size = dual.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for i in 0..dim {
            let (c, t, d) = (compiled[i], tape[i], dual[i]);
            let worst = (c - t).abs().max((c - d).abs());
            assert!(worst <= 1e-12 * size, "{name}, coordinate {i}: {c} {t} {d}");
        }
    }
}
"#;

/// Twelve data of every type.
const DATA: &str = r#"
    let wave = |k: f64| (0..12).map(move |i| 1.2 * (0.3 + k * i as f64).sin());
    let (xs, ys): (Vec<f64>, Vec<f64>) = wave(1.7).zip(wave(2.9)).unzip();
    let rows: Vec<_> = wave(0.7).zip(wave(1.3)).map(|(a, b)| [1.0, a, b]).collect();
    let positive: Vec<f64> = ys.iter().map(|y| y.exp()).collect();
    let shares: Vec<f64> = ys.iter().map(|y| 0.5 + 0.4 * y).collect();
    let counts: Vec<u64> = (0..12).map(|i| (7 * i + 3) % 10).collect();
    let hits: Vec<bool> = (0..12).map(|i| i % 3 == 1).collect();
    let kinds: Vec<u64> = (0..12).map(|i| (5 * i + 1) % 3).collect();
    let gaps: Vec<_> = ys.iter().map(|y| (*y > -0.6).then_some(*y)).collect();
"#;

/// The parameters of every model.
const ARGUMENTS: &str = "xs: &[f64], rows: &[[f64; 3]], ys: &[f64], positive: &[f64], \
     shares: &[f64], counts: &[u64], hits: &[bool], kinds: &[u64], gaps: &[Option<f64>], flag: bool";

/// Submodels that every model can call.
const SUBMODELS: &str = r#"
    fn level(around: Real, ys: &[f64]) -> Real {
        let away ~ Normal(around, 0.7);
        for y in ys {
            y ~ StudentT(4.0, away, 0.8);
        }
        away.tanh() + around
    }

    fn levels(scale: Real, n: usize) -> Vec<Real> {
        let each ~ Normal(0.1, scale).iid(n);
        each.iter().map(|x| *x * 0.5).collect()
    }
"#;

/// The source of a random model named `m{seed}`.
fn model(seed: u64) -> String {
    let mut writer = Writer::new(seed);
    let mut text = format!("fn m{seed}({ARGUMENTS}) {{\n{}", writer.unknown("    "));
    for _ in 0..writer.rng.random_range(2..7) {
        writer.statement(&mut text).expect("writes to a string");
    }
    text + "}\n"
}

fn compile_and_run(seeds: std::ops::Range<u64>) {
    let out = tempfile::tempdir().unwrap();
    let (source, program) = (out.path().join("models.rs"), out.path().join("models"));
    let models: String = seeds.clone().map(model).collect();
    let checks: String = seeds.clone().fold(String::new(), |mut text, seed| {
        for flag in [true, false] {
            let names = "&xs, &rows, &ys, &positive, &shares, &counts, &hits, &kinds, &gaps";
            writeln!(text, "    check(\"m{seed} {flag}\", &m{seed}({names}, {flag}));").unwrap();
        }
        text
    });
    let code = format!(
        "#![allow(unused, clippy::all)]\n{HARNESS}\nppl::model! {{\n{SUBMODELS}{models}}}\n\
         fn main() {{\n{DATA}{checks}}}\n"
    );
    std::fs::write(&source, &code).unwrap();
    let output =
        rustc_with_ppl().args(["-Cdebuginfo=0", "-o"]).arg(&program).arg(&source).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{seeds:?} do not compile:\n{said}\n{code}");
    let output = Command::new(&program).output().unwrap();
    let said = String::from_utf8_lossy(&output.stderr);
    let culprit = seeds.clone().find(|seed| said.contains(&format!("m{seed} ")));
    let culprit = culprit.map(model).unwrap_or_default();
    assert!(output.status.success(), "{said}\n{culprit}");
}

#[test]
fn compiled_tape_and_dual_gradients_agree() {
    let asked = std::env::var("RANDOM_MODELS").ok().and_then(|number| number.parse().ok());
    let number = asked.unwrap_or(IN_A_FILE as u64);
    for start in (0..number).step_by(IN_A_FILE) {
        compile_and_run(start..number.min(start + IN_A_FILE as u64));
    }
}
