//! Randomly written models: three ways to differentiate each.
//!
//! The models are written to a file, compiled against the `ppl` that this test was built with,
//! and run. `RANDOM_MODELS=3000 cargo test -p ppl --test random_models` tries more of them.

use std::fmt::Write;
use std::path::PathBuf;
use std::process::Command;
use std::time::SystemTime;

use rand::{Rng, SeedableRng, seq::IndexedRandom};
use rand_xoshiro::Xoshiro256PlusPlus;

/// Models in one file: what rustc compiles in some seconds without optimisation.
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
        // what cancels in a component was as large as the largest
        let size = dual.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for i in 0..dim {
            let (c, t, d) = (compiled[i], tape[i], dual[i]);
            let worst = (c - t).abs().max((c - d).abs());
            assert!(worst <= 1e-12 * size, "{name}, coordinate {i}: {c} {t} {d}");
        }
    }
}
"#;

/// Writes statements; knows which numbers are in scope.
struct Writer {
    rng: Xoshiro256PlusPlus,
    /// Expressions of one number each.
    numbers: Vec<String>,
    /// Unknown arrays of length 3.
    arrays: Vec<String>,
    names: usize,
}

impl Writer {
    fn name(&mut self) -> String {
        self.names += 1;
        format!("v{}", self.names)
    }

    fn pick(&mut self, from: &[&str]) -> String {
        from.choose(&mut self.rng).expect("not empty").to_string()
    }

    fn leaf(&mut self) -> String {
        match self.rng.random_range(0..6) {
            0 => format!("{:.2}", self.rng.random_range(0.2..2.0)),
            1 if !self.arrays.is_empty() => {
                let array = self.arrays.choose(&mut self.rng).expect("not empty").clone();
                format!("{array}[{}]", self.rng.random_range(0..3))
            }
            _ => self.numbers.choose(&mut self.rng).expect("an unknown comes first").clone(),
        }
    }

    /// A bounded or slowly growing formula with an unknown in it.
    fn number(&mut self, depth: usize) -> String {
        let first = self.numbers.choose(&mut self.rng).expect("an unknown comes first").clone();
        let rest = self.part(depth);
        format!("({first} * 0.5 + {rest})")
    }

    fn part(&mut self, depth: usize) -> String {
        if depth == 0 {
            return self.leaf();
        }
        let (a, b) = (self.part(depth - 1), self.part(depth - 1));
        // over unknowns, not over literals, whose type is open
        let x = self.numbers.choose(&mut self.rng).expect("an unknown comes first").clone();
        match self.rng.random_range(0..10) {
            0 => format!("({a} + {b})"),
            1 => format!("({a} - {b})"),
            2 => format!("(({x} * {a}).tanh() * {b})"),
            3 => format!("({a} / (1.5 + ({x} + {b}).square()))"),
            4 => format!("-({x} - {a}).sin()"),
            5 => format!("({x} + {a}).logistic()"),
            6 => format!("(({x} * {b}).square() + 1.0).sqrt()"),
            7 => format!("({x} - {b}).softplus().ln_1p()"),
            8 => format!("({x} - {a}).max({b} * 0.5).min({x} + 1.5)"),
            _ => format!("({x} * 0.3).powi(3).cos()"),
        }
    }

    fn scale(&mut self) -> String {
        let formula = self.number(1);
        self.pick(&["0.7", "(#x).softplus() + 0.3", "(#x).tanh().exp()"]).replace("#x", &formula)
    }

    fn family(&mut self) -> String {
        let (mean, scale) = (self.number(1), self.scale());
        self.pick(&[
            "Normal(#m, #s)",
            "StudentT(4.0, #m, #s)",
            "Normal(#m, #s).truncate(-50.0..50.0)",
        ])
        .replace("#m", &mean)
        .replace("#s", &scale)
    }

    fn unknown(&mut self, indent: &str) -> String {
        let name = self.name();
        let prior = match self.rng.random_range(0..6) {
            0 => "Normal(0.2, 1.1)".to_owned(),
            1 => "HalfNormal(0.8)".to_owned(),
            2 => "Uniform(0.2, 1.5)".to_owned(),
            3 => "Exponential(1.3)".to_owned(),
            4 => "Beta(2.0, 3.0)".to_owned(),
            _ if self.numbers.is_empty() => "LogNormal(0.0, 0.5)".to_owned(),
            _ => self.family(),
        };
        self.numbers.push(name.clone());
        format!("{indent}let {name} ~ {prior};\n")
    }

    fn statement(&mut self, text: &mut String) -> std::fmt::Result {
        match self.rng.random_range(0..12) {
            0 => text.push_str(&self.unknown("    ")),
            1 => {
                let (name, formula) = (self.name(), self.number(2));
                writeln!(text, "    let {name} = {formula};")?;
                self.numbers.push(name);
            }
            2 => {
                let (name, family) = (self.name(), self.family());
                writeln!(text, "    let {name} ~ {family}.array::<3>();")?;
                self.arrays.push(name);
            }
            3 if !self.arrays.is_empty() => {
                let array = self.arrays.choose(&mut self.rng).expect("not empty").clone();
                let (name, formula) = (self.name(), self.number(1));
                writeln!(text, "    let {name} = {array}.map(|a| {formula} * a - a.sin());")?;
                self.arrays.push(name);
            }
            4 => {
                let formula = self.number(2);
                writeln!(text, "    factor(-0.1 * {formula}.square());")?;
            }
            5 | 6 => self.plate(text)?,
            11 => self.linear(text)?,
            7 => {
                let (name, start, step) = (self.name(), self.number(1), self.number(1));
                let (y, other, scale) = (self.name(), self.number(1), self.scale());
                writeln!(text, "    let mut {name} = {start};")?;
                writeln!(text, "    for {y} in ys {{")?;
                writeln!(text, "        {name} = ({name} * 0.4 + {step} * {y}).tanh();")?;
                writeln!(text, "        {name} += {other} * 0.1;")?;
                writeln!(text, "        {y} ~ Normal({name}, {scale});")?;
                writeln!(text, "    }}")?;
                self.numbers.push(name);
            }
            8 => {
                let (a, b, condition) = (self.number(1), self.number(1), self.number(0));
                let test = self.pick(&["flag", "!flag", "#c > 0.3"]).replace("#c", &condition);
                let name = self.name();
                writeln!(text, "    let {name} = if {test} {{ {a} }} else {{ {b} }};")?;
                self.numbers.push(name);
            }
            9 => {
                // pooled: one distribution for all
                let (y, mean, scale) = (self.name(), self.number(1), self.scale());
                writeln!(
                    text,
                    "    for {y} in ys {{\n        {y} ~ Normal({mean}, {scale});\n    }}"
                )?;
            }
            _ => {
                let formula = self.number(1);
                writeln!(text, "    if flag {{ factor({formula}.tanh()); }}")?;
            }
        }
        Ok(())
    }

    /// A sum that is written as a loop.
    fn sum(&mut self, array: &str, text: &mut String) -> Result<String, std::fmt::Error> {
        let (name, start, factor) = (self.name(), self.number(1), self.number(1));
        let head = self.pick(&["d in 0..3", "(a, r) in #.iter().zip(row)"]).replace('#', array);
        let [a, r] = match head.starts_with('d') {
            true => [format!("{array}[d]"), "row[d]".to_owned()],
            false => ["a", "r"].map(str::to_owned),
        };
        let step = self.pick(&["+= #a * #r", "-= #a * #r * #f", "+= (#a * #f).sin() * #r"]);
        let step = step.replace("#a", &a).replace("#r", &r).replace("#f", &factor);
        self.adding(&name, &start, &head, &step, text)?;
        if self.rng.random() {
            writeln!(text, "        {name} -= {factor};")?;
        }
        if self.rng.random_range(0..4) == 0 {
            self.numbers.push(name.clone());
        }
        Ok(name)
    }

    /// A sum of products with data.
    fn turns(&mut self, array: &str, text: &mut String) -> Result<String, std::fmt::Error> {
        let (name, start, factor) = (self.name(), self.number(1), self.number(0));
        let step = self.pick(&["+= #a * r * #f", "-= (#a - #f) * r", "+= r * #a + r * x * #f"]);
        let heads = ["(d, r) in rows[i].iter().enumerate()", "(a, r) in #.iter().zip(&rows[i])"];
        let head = self.pick(&heads).replace('#', array);
        let a = if head.starts_with("(d") { format!("{array}[d]") } else { "a".to_owned() };
        let step = step.replace("#a", &a).replace("#f", &factor);
        self.adding(&name, &start, &head, &step, text)?;
        Ok(name)
    }

    /// `start` and all steps of a loop, which may be one of an iterator.
    fn adding(
        &mut self,
        name: &str,
        start: &str,
        head: &str,
        step: &str,
        text: &mut String,
    ) -> std::fmt::Result {
        let (pat, iter) = head.split_once(" in ").expect("the head of a loop");
        let (sign, value) = step.split_once("= ").expect("an assignment");
        if self.rng.random_range(0..3) == 0 {
            let sum = format!("({iter}).map(|{pat}| {value}).sum::<Real<_>>()");
            // what is changed later stays a variable
            return writeln!(text, "        let mut {name} = {start} {sign} {sum};");
        }
        writeln!(text, "        let mut {name} = {start};")?;
        writeln!(text, "        for {head} {{\n            {name} {step};\n        }}")
    }

    /// A plate that rows may stand for.
    fn linear(&mut self, text: &mut String) -> std::fmt::Result {
        let (y, scale) = (self.name(), self.scale());
        writeln!(text, "    for (i, (x, {y})) in xs.iter().zip(ys).enumerate() {{")?;
        writeln!(text, "        let away = x * 0.5 - 0.1;")?;
        let mut mean = self.number(1);
        for _ in 0..self.rng.random_range(1..5) {
            let (a, b) = (self.number(1), self.number(0));
            let array = self.arrays.choose(&mut self.rng).cloned();
            let term = match (self.rng.random_range(0..8), array) {
                (0, Some(array)) => format!("{array}[i % 3] * {b}"),
                (1, Some(array)) => format!("away * ({a} - {array}[i / 5 % 2])"),
                (2, Some(array)) => format!("dot(&rows[i], &{array}) / (1.5 + x * x)"),
                (3, Some(array)) => format!("away * {}", self.turns(&array, text)?),
                (4, Some(array)) => self.turns(&array, text)?,
                (5, _) => "0.3 * away".to_owned(),
                (6, _) => format!("({a} + {b} * x) * away"),
                _ => format!("x * {a}"),
            };
            write!(mean, "{}{term}", self.pick(&[" + ", " - "]))?;
        }
        if self.rng.random() {
            let name = self.name();
            writeln!(text, "        let {name} = {mean};")?;
            mean = name;
        }
        writeln!(text, "        {y} ~ Normal({mean}, {scale});")?;
        writeln!(text, "    }}")
    }

    fn plate(&mut self, text: &mut String) -> std::fmt::Result {
        let scope = self.numbers.len();
        let y = self.name();
        writeln!(text, "    for ((x, row), {y}) in xs.iter().zip(rows).zip(ys) {{")?;
        if self.rng.random() {
            text.push_str(&self.unknown("        "));
        }
        for _ in 0..self.rng.random_range(0..3) {
            let (name, formula) = (self.name(), self.number(1));
            writeln!(text, "        let {name} = {formula} * x;")?;
            self.numbers.push(name);
        }
        let product = match self.arrays.choose(&mut self.rng).cloned() {
            Some(array) if self.rng.random() => self.sum(&array, text)?,
            Some(array) => format!("dot(row, &{array})"),
            None => "row[0]".to_owned(),
        };
        let (mean, scale) = (self.number(1), self.scale());
        let family = self.pick(&["Normal(#m, #s)", "StudentT(5.0, #m, #s)"]);
        let mean = format!("{mean} + {product}");
        let family = family.replace("#m", &mean).replace("#s", &scale);
        writeln!(text, "        {y} ~ {family};")?;
        writeln!(text, "    }}")?;
        self.numbers.truncate(scope);
        Ok(())
    }
}

/// A model in the language, named `m{seed}`.
fn model(seed: u64) -> String {
    let rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut writer = Writer { rng, numbers: Vec::new(), arrays: Vec::new(), names: 0 };
    let mut text = format!(
        "fn m{seed}(xs: &[f64], rows: &[[f64; 3]], ys: &[f64], flag: bool) {{\n{}",
        writer.unknown("    ")
    );
    for _ in 0..writer.rng.random_range(2..7) {
        writer.statement(&mut text).expect("writes to a string");
    }
    text + "}\n"
}

/// The folder of compiled dependencies, and the newest `ppl` in it: the one just built.
fn compiled() -> (PathBuf, PathBuf) {
    let folder = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let is_ppl = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("libppl-") && name.ends_with(".rlib")
    };
    let age = |path: &PathBuf| -> SystemTime { path.metadata().unwrap().modified().unwrap() };
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let newest = files.filter(is_ppl).max_by_key(age).expect("this test is linked with it");
    (folder, newest)
}

fn compile_and_run(seeds: std::ops::Range<u64>) {
    let out = tempfile::tempdir().unwrap();
    let (source, program) = (out.path().join("models.rs"), out.path().join("models"));
    let models: String = seeds.clone().map(model).collect();
    let checks: String = seeds.clone().fold(String::new(), |mut text, seed| {
        for flag in [true, false] {
            let call = format!("m{seed}(&xs, &rows, &ys, {flag})");
            writeln!(text, "    check(\"m{seed} {flag}\", &{call});").unwrap();
        }
        text
    });
    let code = format!(
        "#![allow(unused, clippy::all)]\n{HARNESS}\nppl::model! {{\n{models}}}\nfn main() {{\n    \
         let wave = |i: usize, k: f64| 1.2 * (0.3 + k * i as f64).sin();\n    \
         let [xs, ys] = [1.7, 2.9].map(|k| (0..12).map(|i| wave(i, k)).collect::<Vec<_>>());\n    \
         let rows: Vec<_> = (0..12).map(|i| [1.0, wave(i, 0.7), wave(i, 1.3)]).collect();\n\
         {checks}}}\n"
    );
    std::fs::write(&source, &code).unwrap();
    let (folder, ppl) = compiled();
    let output = Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()))
        .args(["--edition=2024", "--crate-type=bin", "-Cdebuginfo=0"])
        .arg("--extern")
        .arg(format!("ppl={}", ppl.display()))
        .arg("-L")
        .arg(format!("dependency={}", folder.display()))
        .arg("-o")
        .arg(&program)
        .arg(&source)
        .output()
        .unwrap();
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
