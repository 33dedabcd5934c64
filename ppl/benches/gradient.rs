//! Nanoseconds per log density and per gradient, as CSV: `cargo bench -p ppl --bench gradient`.
//!
//! Each figure is the smallest of repeated timings, because other processes can only make a run slower. A name after
//! `--` selects the models whose names contain it. `cargo test --benches` runs every model once.

use std::hint::black_box;
use std::time::Instant;

use ppl::prelude::*;
use ppl::{Bound, DomainError, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

ppl::model! {
    fn eight_schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        for j in 0..8 {
            #[track] let theta = mu + tau * z[j];
            effects[j] ~ Normal(theta, errors[j]);
        }
    }

    fn regression<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.5).array::<D>();
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(dot(row, &slope), sd);
        }
    }

    /// The observations of `regression`, as a submodel.
    fn around_plane<const D: usize>(
        x: &[[f64; D]],
        y: &[f64],
        slope: &[Real; D],
        sd: Real,
    ) -> () {
        for (row, y) in x.iter().zip(y) {
            y ~ Normal(dot(row, slope), sd);
        }
    }

    /// Version of `regression` with the observations in a submodel.
    fn regression_submodel<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.5).array::<D>();
        let sd ~ HalfNormal(1.0);
        let data ~ around_plane(x, y, &slope, sd);
    }

    /// Version of `regression` with all observations in one statement.
    fn regression_glm<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.5).array::<D>();
        let sd ~ HalfNormal(1.0);
        y ~ NormalGlm(x, 0.0, slope, sd);
    }

    /// Version of `regression` with the linear predictor summed in a loop.
    fn regression_loop<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let slope ~ Normal(0.0, 2.5).array::<D>();
        let sd ~ HalfNormal(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = slope[0] * row[0];
            for d in 1..D {
                mean += slope[d] * row[d];
            }
            y ~ Normal(mean, sd);
        }
    }

    /// Groups with separate levels and 5 observations each.
    fn hierarchy(groups: usize, group: &[usize], y: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfNormal(2.0);
        let sd ~ HalfNormal(2.0);
        let level ~ Normal(mu, tau).iid(groups);
        for (g, y) in group.iter().zip(y) {
            y ~ Normal(level[*g], sd);
        }
    }

    /// Version of `hierarchy` with all observations in one statement, without predictors.
    fn hierarchy_glm(groups: usize, none: &[[f64; 0]], group: &[usize], y: &[f64]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfNormal(2.0);
        let sd ~ HalfNormal(2.0);
        let level ~ Normal(mu, tau).iid(groups);
        y ~ NormalGlm(none, ByGroup(&level, group), [0.0; 0], sd);
    }

    /// Varying intercepts and two covariates, non-centred.
    fn radon(counties: usize, houses: &[House]) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(1.0);
        let sd ~ HalfNormal(1.0);
        let slope ~ Normal(0.0, 10.0).array::<2>();
        let z ~ Normal(0.0, 1.0).iid(counties);
        for house in houses {
            let level = mu + tau * z[house.county];
            let mean = level + slope[0] * house.uranium + slope[1] * house.floor;
            house.radon ~ Normal(mean, sd);
        }
    }

    /// Version of `radon` with all observations in one statement.
    fn radon_glm(counties: usize, county: &[usize], x: &[[f64; 2]], radon: &[f64]) {
        let mu ~ Normal(0.0, 10.0);
        let tau ~ HalfNormal(1.0);
        let sd ~ HalfNormal(1.0);
        let slope ~ Normal(0.0, 10.0).array::<2>();
        let level ~ Normal(mu, tau).non_centered().iid(counties);
        radon ~ NormalGlm(x, ByGroup(&level, county), slope, sd);
    }

    /// Calibration of the paper: nine parameters, eight experiments.
    fn calibration(forward: &Cubic, qois: &[[f64; 3]]) {
        let young ~ Uniform(-1.0, 1.0);
        let toughness ~ Uniform(-1.0, 1.0);
        let viscosity ~ Uniform(-1.0, 1.0);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);
        #[track] let mean = forward.at([young, toughness, viscosity]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
    }

    /// The observations of `calibration`, as a submodel.
    fn of_specimens(
        qois: &[[f64; 3]],
        mean: &[Real; 3],
        chol: &CholeskyFactor<Real, 3>,
    ) -> () {
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
    }

    /// Version of `calibration` with the observations in a submodel.
    fn calibration_submodel(forward: &Cubic, qois: &[[f64; 3]]) {
        let young ~ Uniform(-1.0, 1.0);
        let toughness ~ Uniform(-1.0, 1.0);
        let viscosity ~ Uniform(-1.0, 1.0);
        let sd ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);
        #[track] let mean = forward.at([young, toughness, viscosity]);
        let data ~ of_specimens(qois, &mean, &chol);
    }

    /// Two outcomes per datum, whose means depend on the datum.
    fn mv_normal_means(x: &[f64], y: &[[f64; 2]]) {
        let level ~ Normal(0.0, 10.0).array::<2>();
        let slope ~ Normal(0.0, 2.5).array::<2>();
        let sd ~ HalfNormal(1.0).array::<2>();
        let corr ~ LkjCholesky::<2>(2.0);
        let chol = corr.scale_rows(sd);
        for (x, y) in x.iter().zip(y) {
            y ~ MvNormalCholesky([level[0] + slope[0] * x, level[1] + slope[1] * x], chol);
        }
    }

    fn garch11(ys: &[f64], first_sd: f64) {
        let mu ~ Normal(0.0, 10.0);
        let constant ~ LogNormal(0.0, 2.0);
        let arch ~ Uniform(0.0, 1.0);
        let share ~ Uniform(0.0, 1.0);
        let garch = (1.0 - arch) * share;
        let mut sd = Real::from(first_sd);
        for (i, y) in ys.iter().enumerate() {
            if i > 0 {
                sd = (constant + arch * (ys[i - 1] - mu).square() + garch * sd.square()).sqrt();
            }
            y ~ Normal(mu, sd);
        }
    }
}

struct House {
    county: usize,
    uranium: f64,
    floor: f64,
    radon: f64,
}

/// Polynomial surrogate of total degree 3 in 3 variables, with the size and the cost of the surrogate in the paper. The
/// three coefficients of a term are padded with a zero, so that they fill a SIMD register.
struct Cubic([Term; 20]);

type Term = [f64; 4];

impl Cubic {
    fn new() -> Self {
        let entry = |m: f64, j: f64| 0.3 * (1.0 + 2.3 * m + 0.7 * j).sin();
        Self(
            std::array::from_fn(|j| [0.0, 1.0, 2.0].map(|m| entry(m, j as f64)))
                .map(|[a, b, c]| [a, b, c, 0.0]),
        )
    }
}

/// Σ termₖ xᵏ.
fn sum(terms: &[Term], x: f64) -> Term {
    let powers = [1.0, x, x * x, x * x * x];
    let mut sum = terms[0];
    for k in 1..terms.len() {
        for m in 0..4 {
            sum[m] += terms[k][m] * powers[k];
        }
    }
    sum
}

/// Σ k termₖ xᵏ⁻¹.
fn slope(terms: &[Term], x: f64) -> Term {
    let slopes = [0.0, 1.0, 2.0 * x, 3.0 * x * x];
    let mut sum = terms.get(1).copied().unwrap_or_default();
    for k in 2..terms.len() {
        for m in 0..4 {
            sum[m] += terms[k][m] * slopes[k];
        }
    }
    sum
}

impl Differentiable<3, 3> for Cubic {
    fn value_and_jacobian(
        &self,
        &[x, y, z]: &[f64; 3],
    ) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
        // nested sums in powers of z, y and x, with derivatives
        let (mut planes, mut terms) = ([[Term::default(); 4]; 3], &self.0[..]);
        for a in 0..4 {
            let mut lines = [[Term::default(); 4]; 2];
            for b in 0..4 - a {
                let (line, others) = terms.split_at(4 - a - b);
                terms = others;
                lines[0][b] = sum(line, z);
                lines[1][b] = slope(line, z);
            }
            let [values, slopes] = &lines;
            planes[0][a] = sum(&values[..4 - a], y);
            planes[1][a] = slope(&values[..4 - a], y);
            planes[2][a] = sum(&slopes[..(3 - a).max(1)], y);
        }
        let [values, in_y, in_z] = &planes;
        let by = [slope(values, x), sum(&in_y[..3], x), sum(&in_z[..3], x)];
        let jacobian = std::array::from_fn(|m| by.map(|slope| slope[m]));
        Ok((first(sum(values, x)), jacobian))
    }

    fn value(&self, &[x, y, z]: &[f64; 3]) -> Result<[f64; 3], DomainError> {
        let (mut planes, mut terms) = ([Term::default(); 4], &self.0[..]);
        for a in 0..4 {
            let mut lines = [Term::default(); 4];
            for b in 0..4 - a {
                let (line, others) = terms.split_at(4 - a - b);
                terms = others;
                lines[b] = sum(line, z);
            }
            planes[a] = sum(&lines[..4 - a], y);
        }
        Ok(first(sum(&planes, x)))
    }
}

/// Removes the padding zero.
fn first([a, b, c, _]: Term) -> [f64; 3] {
    [a, b, c]
}

/// Function that repeats a computation the given number of times.
type Batch<'f> = &'f mut dyn FnMut(u32);

/// Nanoseconds per call of `f` and of `g`: the smallest of many batches that are long compared with the resolution of
/// the clock. The batches of `f` and `g` alternate, so that a change of the processor's speed affects both.
fn time<'f>(quick: bool, f: Batch<'f>, g: Batch<'f>) -> [f64; 2] {
    let (repeats, nanoseconds) = if quick { (1, 0) } else { (201, 300_000) };
    let run = |f: &mut Batch<'f>, batch: u32| {
        let start = Instant::now();
        f(batch);
        start.elapsed()
    };
    let mut timed = [f, g].map(|mut f| {
        let mut batch = 1;
        while run(&mut f, batch).as_nanos() < nanoseconds {
            batch *= 2;
        }
        (f, batch, f64::INFINITY)
    });
    for _ in 0..repeats {
        for (f, batch, least) in &mut timed {
            *least = least.min(run(f, *batch).as_secs_f64() * 1e9 / f64::from(*batch));
        }
    }
    timed.map(|(_, _, least)| least)
}

fn report(name: &str, quick: bool, model: &Bound<impl Model>) {
    let mut selected =
        std::env::args().skip(1).filter(|argument| !argument.starts_with("--")).peekable();
    if selected.peek().is_some() && !selected.any(|part| name.contains(&part)) {
        return;
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let y = model.draw_prior(&mut rng).expect("a proper model").unconstrained;
    let [mut w, mut gradient_workspace] = [Workspace::default(), Workspace::default()];
    let mut gradient = vec![0.0; y.len()];
    let [value, both] = time(
        quick,
        &mut |batch| {
            for _ in 0..batch {
                black_box(model.log_density(black_box(&y), &mut w).ok());
            }
        },
        &mut |batch| {
            for _ in 0..batch {
                black_box(
                    model.gradient(black_box(&y), &mut gradient, &mut gradient_workspace).ok(),
                );
            }
        },
    );
    println!("{name},{},{value:.1},{both:.1}", y.len());
}

fn main() {
    let quick = !std::env::args().any(|argument| argument == "--bench");
    println!("model,dim,value_ns,gradient_ns");
    report("eight_schools_non_centred", quick, &eight_schools(&EFFECTS, &ERRORS));
    let qois: Vec<[f64; 3]> =
        (0..8).map(|i| [1.0, 0.9, 1.1].map(|m| m + 0.1 * f64::from(i).sin())).collect();
    report("paper_calibration", quick, &calibration(&Cubic::new(), &qois));
    report("paper_calibration_submodel", quick, &calibration_submodel(&Cubic::new(), &qois));
    for n in [20, 200, 2000] {
        let wave = |i: usize, d: usize| (1.0 + i as f64 * (0.7 + d as f64)).sin();
        let x: Vec<[f64; 5]> = (0..n).map(|i| std::array::from_fn(|d| wave(i, d))).collect();
        let y: Vec<f64> = x.iter().map(|row| row.iter().sum::<f64>() + 0.1 * row[0]).collect();
        report(&format!("linear_regression_n{n}"), quick, &regression(&x, &y));
        report(&format!("linear_regression_submodel_n{n}"), quick, &regression_submodel(&x, &y));
        report(&format!("linear_regression_loop_n{n}"), quick, &regression_loop(&x, &y));
        report(&format!("linear_regression_glm_n{n}"), quick, &regression_glm(&x, &y));
    }
    for groups in [8, 100, 1000] {
        let group: Vec<usize> = (0..5 * groups).map(|i| i / 5).collect();
        let y: Vec<f64> = (0..5 * groups).map(|i| (1.7 * i as f64).sin()).collect();
        report(&format!("hierarchical_d{}", groups + 3), quick, &hierarchy(groups, &group, &y));
        let none = vec![[]; y.len()];
        let glm = hierarchy_glm(groups, &none, &group, &y);
        report(&format!("hierarchical_glm_d{}", groups + 3), quick, &glm);
    }
    let houses: Vec<House> = (0..919)
        .map(|i| House {
            county: i * 85 / 919,
            uranium: (0.1 * i as f64).sin(),
            floor: f64::from(u8::from(i % 3 == 0)),
            radon: (1.7 * i as f64).sin(),
        })
        .collect();
    report("radon_n919", quick, &radon(85, &houses));
    let county: Vec<usize> = houses.iter().map(|house| house.county).collect();
    let x: Vec<[f64; 2]> = houses.iter().map(|house| [house.uranium, house.floor]).collect();
    let log_radon: Vec<f64> = houses.iter().map(|house| house.radon).collect();
    report("radon_glm_n919", quick, &radon_glm(85, &county, &x, &log_radon));
    let wave = |speed: f64| (0..200).map(move |i| (speed * f64::from(i)).sin());
    let x: Vec<f64> = wave(0.7).collect();
    let pairs: Vec<[f64; 2]> = wave(0.3).zip(wave(1.7)).map(|(a, b)| [a, b]).collect();
    report("mv_normal_means_n200", quick, &mv_normal_means(&x, &pairs));
    let returns: Vec<f64> = (0..200).map(|i| 2.0 * (1.3 * f64::from(i)).sin()).collect();
    report("garch11", quick, &garch11(&returns, 0.5));
}
