//! Calibrates 304L steel to eight round bars in tension, through necking, and to 64 yield stresses at five strain rates.
//!
//! ```text
//! cargo run --release -p models --example steel_304l -- DIRECTORY
//! ```
//! Simulates an eighth of the bar for each point of a design, repeats six runs on elements of half the size, and corrects
//! all runs by the mean ratios. A surrogate of the runs is the forward model. Runs are stored, and an interrupted program
//! resumes where it stopped. Writes `summary.csv` and `steel.png`. Tests and comparison are those of MatCal (Sandia).

use std::array::from_fn;
use std::f64::consts::LN_10;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use fem::{Ensemble, Hardening, Material, Order, PlasticRate, Plasticity, Problem, RoundBar};
use fem::{CurvePoint, RunInput, RunStatus, TensionTest};
use models::report::{Chart, Ink};
use models::viscoplastic::{BarCurve, RateTest, VoceJohnsonCook, read_bar_curves, read_rate_tests};
use ppl::prelude::*;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, FitOptions, Input, Pce};

type Error = Box<dyn std::error::Error>;

/// Quantities of a bar: stresses at these engineering strains, largest stress, strain at the largest stress.
pub const STRAINS: [f64; 7] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7];
pub const M: usize = STRAINS.len() + 2;
/// Error of the law in each quantity, relative to its error in a stress: 1 % of stress moves the flat peak by far more.
const LAW_ERRORS: [f64; M] = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 3.0];
/// Unknowns and their ranges. The rise of the stress up to a plastic strain of 0.3 replaces the saturation stress, which
/// the bars determine only together with the rate of hardening.
pub const NAMES: [&str; 4] = ["yield_mpa", "rise_mpa", "rate", "log10_c"];
pub const RANGES: [[f64; 2]; 4] = [[205.0, 270.0], [430.0, 530.0], [0.9, 2.3], [-1.7, -1.1]];
/// MatCal's point.
const MATCAL: [f64; 4] = [233.22, 486.6, 1.945_57, -1.400_12];
const RUNS: usize = 48;
const REPEATED: usize = 6;
const INCH_MM: f64 = 25.4;

/// Returns the flow stress at the unknowns.
pub fn law<S: Scalar>([yield_mpa, rise_mpa, rate, log10_c]: [S; 4]) -> VoceJohnsonCook<S> {
    VoceJohnsonCook::from_rise(yield_mpa, rise_mpa, rate, (log10_c * LN_10).exp(), 1e-5)
}

ppl::model! {
    /// Bars and rate tests of one material. Quantities of bars are relative to their means; `errors` are the relative errors
    /// of the surrogate.
    pub fn steel(bars: &[[f64; M]], forward: &Pce<4, M>, errors: &[f64; M], rates: &[RateTest]) {
        let yield_mpa ~ Uniform(RANGES[0][0], RANGES[0][1]);
        let rise_mpa ~ Uniform(RANGES[1][0], RANGES[1][1]);
        let rate ~ Uniform(RANGES[2][0], RANGES[2][1]);
        let log10_c ~ Uniform(RANGES[3][0], RANGES[3][1]);
        let law = law([yield_mpa, rise_mpa, rate, log10_c]);
        #[track] let saturation_mpa = law.saturation_mpa;
        #[track] let c = law.c;

        // errors of law and surrogate, which all bars share; scatter between bars
        let law_error ~ HalfNormal(0.02);
        let deviation ~ Normal(0.0, 1.0).array::<M>();
        let scatter ~ HalfNormal(0.03).array::<M>();
        let corr ~ LkjCholesky::<M>(2.0);
        let chol = corr.scale_rows(scatter);
        let simulated = forward.at([yield_mpa, rise_mpa, rate, log10_c]);
        let mean = from_fn(|k| {
            let variance = (law_error * LAW_ERRORS[k]).powi(2) + errors[k].powi(2);
            simulated[k] * (deviation[k] * variance.sqrt() + 1.0)
        });
        for bar in bars {
            bar ~ MvNormalCholesky(mean, chol);
        }

        // MatCal's factor X: the 0.2 % offset yield of a test is not the yield stress of the law
        let offset_factor ~ Uniform(0.5, 1.75);
        let rate_scatter ~ HalfNormal(0.2);
        for test in rates {
            let expected = offset_factor * yield_mpa * law.rate_factor(test.rate_per_s);
            test.yield_mpa ~ LogNormal(expected.ln(), rate_scatter);
        }
    }
}

fn material(x: [f64; 4]) -> Material {
    let VoceJohnsonCook { yield_mpa, saturation_mpa, rate, c, reference_per_s } = law(x);
    Material::hencky(199_950.0, 0.27).with_plasticity(Plasticity {
        yield_mpa,
        hardening: Hardening::Voce { saturation_mpa, rate },
        rate: Some(PlasticRate::JohnsonCook { c, reference_per_s }),
        ..Plasticity::default()
    })
}

/// Returns the test with MatCal's dimensions and speed (2e-4 inch/s at the extensometer), and its problem.
fn tension(spacing_inch: f64) -> Result<(TensionTest, Problem), Error> {
    let [radius_mm, length_mm, necking_mm, spacing_mm] =
        [0.125, 1.25, 0.375 * 0.75, spacing_inch].map(|inch| inch * INCH_MM);
    let taper_mm = 0.5 * 0.0015 * INCH_MM;
    let bar = RoundBar { radius_mm, taper_mm, length_mm, necking_mm, spacing_mm };
    let test = TensionTest::new(bar, 0.75 * INCH_MM, 2e-4 / 0.75, 0.8);
    let builder = test.builder(bar.eighth()?)?.order(Order::Quadratic);
    Ok((test, builder.materials([material(MATCAL)]).build()?))
}

/// Returns the curves of a design, simulated or read from `directory`.
fn curves(directory: &Path, spacing_inch: f64, points: &[Vec<f64>]) -> Result<Vec<BarCurve>, Error> {
    let (test, problem) = tension(spacing_inch)?;
    let ensemble = Ensemble::open(directory.join(format!("runs-{spacing_inch}")), &format!("{test:?}"))?;
    let job = |run: &RunInput, _: &dyn Fn(f64)| {
        let problem = problem.with_materials(vec![material(from_fn(|k| run.inputs[k]))])?;
        Ok(test.pull(&problem, 0.72))
    };
    let runs: Vec<RunInput> =
        points.iter().enumerate().map(|(id, x)| RunInput { id, inputs: x.clone() }).collect();
    let records = ensemble.run(&runs, &NAMES, 0, &job, &(), &AtomicBool::new(false))?;
    let curve = |record: fem::RunRecord| {
        if let RunStatus::Failed(reason) = &record.status {
            return Err(format!("run {} failed: {reason}", record.id).into());
        }
        let readings = record.curve.iter().map(|point: &CurvePoint| test.engineering(point));
        let readings = std::iter::once((0.0, 0.0)).chain(readings).collect();
        Ok(BarCurve { specimen: format!("run {}", record.id), readings })
    };
    records.into_iter().map(curve).collect()
}

fn main() -> Result<(), Error> {
    let directory = std::env::args().nth(1).ok_or("usage: steel_304l DIRECTORY")?;
    let directory = PathBuf::from(directory);
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let bars = read_bar_curves(&data.join("matcal_304L_tension.csv"))?;
    let rates = read_rate_tests(&data.join("matcal_304L_rate_yield.csv"))?;
    let quantities = |curves: &[BarCurve]| -> Result<Vec<[f64; M]>, Error> {
        Ok(curves.iter().map(|curve| curve.quantities(&STRAINS)).collect::<Result<_, _>>()?)
    };
    let mean_of = |rows: &[[f64; M]]| -> [f64; M] {
        from_fn(|k| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64)
    };
    let measured = quantities(&bars)?;
    let mean = mean_of(&measured);
    let relative = |row: &[f64; M]| -> [f64; M] { from_fn(|k| row[k] / mean[k]) };

    let input = |(name, [low, high]): (&&str, [f64; 2])| Input::new(*name, low, high);
    let inputs = NAMES.iter().zip(RANGES).map(input).collect::<Result<Vec<_>, _>>()?;
    let points = DesignMethod::Sobol.sample(&inputs, RUNS, 1)?;
    let coarse = quantities(&curves(&directory, 0.03, &points)?)?;
    let fine = quantities(&curves(&directory, 0.015, &points[..REPEATED])?)?;
    let ratios: Vec<[f64; M]> =
        fine.iter().zip(&coarse).map(|(fine, coarse)| from_fn(|k| fine[k] / coarse[k])).collect();
    let ratio = mean_of(&ratios);
    println!("quantities on elements of 0.015 inch over those of 0.03 inch: {ratio:.4?}");

    let outputs = STRAINS.map(|strain| format!("stress_at_{strain}")).to_vec();
    let outputs = [outputs, vec!["peak_stress".into(), "strain_at_peak".into()]].concat();
    let mut runs = Dataset::new(inputs, outputs, "304L bar")?;
    for (x, row) in points.iter().zip(&coarse) {
        runs.push(x, &relative(&from_fn(|k| row[k] * ratio[k])))?;
    }
    let fit = Pce::<4, M>::fit(&runs, &FitOptions { max_order: 4, ..FitOptions::default() })?;
    let lack = fit.report.lack_of_fit(&[1.0; M])?;
    let errors = from_fn(|k| lack[k][k].sqrt());
    println!("relative errors of the surrogate: {errors:.4?}");
    let relative_bars: Vec<[f64; M]> = measured.iter().map(relative).collect();
    let model = steel(&relative_bars, &fit.pce, &errors, &rates);
    let sampler = Nuts::default().chains(4).warmup(1000).draws(1000).target_accept(0.9).seed(1);
    let posterior = sampler.sample(&model)?;
    let mut summary = posterior.summary();
    println!("{summary}");
    let rows = ["yield_mpa", "saturation_mpa", "rate", "c"];
    summary.rows.retain(|row| rows.contains(&&*row.name));
    summary.rows.sort_by_key(|row| rows.iter().position(|name| *name == row.name));
    summary.write_csv(directory.join("summary.csv"))?;

    // simulations at the mode and at MatCal's point
    let mode = Map::default().seed(1).find(&model)?;
    let mode = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(1))?;
    let mode = NAMES.map(|name| mode.values(name).map_or(f64::NAN, |values| values[0]));
    let pulled = [mode, MATCAL].map(|x| x.to_vec());
    let pulled = curves(&directory.join("compared"), 0.015, &pulled)?;
    for (name, row) in ["mode", "MatCal's point"].iter().zip(quantities(&pulled)?) {
        println!("{name}: quantities over the means of the bars {:.4?}", relative(&row));
    }
    let mut stresses = Chart::new("engineering strain", "engineering stress (MPa)");
    for (k, bar) in bars.iter().enumerate() {
        let name = if k == 0 { "eight bars" } else { "" };
        stresses = stresses.thin(name, Ink::Measured, bar.readings.iter().copied());
    }
    let stresses = stresses
        .line("simulated at the mode", Ink::Posterior, pulled[0].readings.iter().copied())
        .dashed("simulated at MatCal's point", Ink::Truth, pulled[1].readings.iter().copied());
    let draws = |name: &str| posterior.trace(name).unwrap_or_default().concat();
    let [factor, yields, c] = ["offset_factor", "yield_mpa", "c"].map(draws);
    let decades: Vec<f64> = (-9..=8).map(|k| 0.5 * f64::from(k)).collect();
    let yielding = |factor: f64, yield_mpa: f64, c: f64| -> Vec<f64> {
        let at = |decade: &f64| factor * yield_mpa * (1.0 + c * (decade + 5.0) * LN_10);
        decades.iter().map(at).collect()
    };
    let bands: Vec<Vec<f64>> =
        (0..c.len()).map(|k| yielding(factor[k], yields[k], c[k])).collect();
    let matcal = decades.iter().copied().zip(yielding(0.96, MATCAL[0], 0.0398));
    let rates = rates.iter().map(|test| (test.rate_per_s.log10(), test.yield_mpa));
    let yields = Chart::new("log10 of the strain rate (1/s)", "0.2 % offset yield (MPa)")
        .band("posterior, 90 %", Ink::Posterior, &decades, &bands, 0.9)
        .points("64 tests", Ink::Measured, rates)
        .dashed("MatCal's point", Ink::Truth, matcal);
    let hardening = draws("rate").into_iter().zip(draws("saturation_mpa")).step_by(8);
    let hardening = Chart::new("rate of hardening", "saturation (MPa)")
        .points("posterior", Ink::Posterior, hardening)
        .points("MatCal's point", Ink::Truth, [(MATCAL[2], 1100.94)]);
    Chart::write_png(&directory.join("steel.png"), vec![stresses, yields, hardening])?;
    Ok(())
}
