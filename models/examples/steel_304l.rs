//! Calibrates 304L steel to eight round bars in tension, through necking, and to 64 yield stresses at five strain rates.
//!
//! ```text
//! cargo run --release -p models --example steel_304l -- DIRECTORY
//! ```
//! Simulates an eighth of the bar for each point of a design, repeats six runs on elements of half the size, and
//! corrects all runs by the mean ratios. A surrogate of the runs is the forward model. Runs are stored, and an
//! interrupted program resumes where it stopped. Writes `summary.csv` and `steel.png`. The tests and the comparison
//! are taken from MatCal (Sandia).

use std::array::from_fn;
use std::f64::consts::LN_10;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

use fem::{Ensemble, Hardening, Material, Order, PlasticRate, Plasticity, Problem, RoundBar};
use fem::{RunInput, TensionTest};
use models::report::{Chart, Ink};
use models::viscoplastic::{BarCurve, RateTest, VoceJohnsonCook, read_bar_curves, read_rate_tests};
use ppl::prelude::*;
use ppl::rand::SeedableRng;
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, FitOptions, Input, Pce, Scales};

type Error = Box<dyn std::error::Error>;

/// Quantities of a bar: stresses at these engineering strains, largest stress, strain at the largest stress.
pub const STRAINS: [f64; 7] = [0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.7];
/// Number of quantities.
pub const M: usize = STRAINS.len() + 2;
/// Error of the law in each quantity, relative to its error in a stress: 1 % of stress moves the flat peak by far more.
const LAW_ERRORS: [f64; M] = [1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 3.0];
/// Unknowns. The rise of the stress up to a plastic strain of 0.3 replaces the saturation stress, which
/// the bars determine only together with the rate of hardening.
pub const NAMES: [&str; 4] = ["yield_mpa", "rise_mpa", "rate", "log10_c"];
/// Ranges of the unknowns.
pub const RANGES: [[f64; 2]; 4] = [[205.0, 265.0], [440.0, 520.0], [1.1, 2.2], [-1.7, -1.1]];
/// MatCal's point.
const MATCAL: [f64; 4] = [233.22, 486.78, 1.945_57, -1.400_12];
/// Number of runs, and number of these runs that are repeated on the finer mesh.
const RUNS: [usize; 2] = [48, 6];
const INCH_MM: f64 = 25.4;

/// Returns the flow stress at the unknowns.
pub fn law<S: Scalar>([yield_mpa, rise_mpa, rate, log10_c]: [S; 4]) -> VoceJohnsonCook<S> {
    VoceJohnsonCook::from_rise(yield_mpa, rise_mpa, rate, (log10_c * LN_10).exp(), 1e-5)
}

ppl::model! {
    /// Bars and rate tests of one material. `bars` and `forward` are logarithms of quantities, `errors` the standard
    /// deviations of the surrogate's errors.
    pub fn steel(bars: &[[f64; M]], forward: &Pce<4, M>, errors: &[f64; M], rates: &[RateTest]) {
        let yield_mpa ~ Uniform(RANGES[0][0], RANGES[0][1]);
        let rise_mpa ~ Uniform(RANGES[1][0], RANGES[1][1]);
        let rate ~ Uniform(RANGES[2][0], RANGES[2][1]);
        let log10_c ~ Uniform(RANGES[3][0], RANGES[3][1]);
        let flow = law([yield_mpa, rise_mpa, rate, log10_c]);
        #[track] let saturation_mpa = flow.saturation_mpa;
        #[track] let c = flow.c;

        // errors of law and surrogate, which all bars share; scatter between bars
        let law_error ~ HalfNormal(0.02);
        let deviation ~ Normal(0.0, 1.0).array::<M>();
        let scatter ~ HalfNormal(0.03).array::<M>();
        let corr ~ LkjCholesky::<M>(2.0);
        let chol = corr.scale_rows(scatter);
        let simulated = forward.at([yield_mpa, rise_mpa, rate, log10_c]);
        let mean: [Real; M] = from_fn(|k| {
            let law = law_error * LAW_ERRORS[k];
            simulated[k] + deviation[k] * (law * law + errors[k] * errors[k]).sqrt()
        });
        for bar in bars {
            bar ~ MvNormalCholesky(mean, chol);
        }

        // MatCal's factor X: the 0.2 % offset yield of a test is not the yield stress of the law
        let offset_factor ~ Uniform(0.5, 1.75);
        let rate_scatter ~ HalfNormal(0.2);
        for test in rates {
            let expected = offset_factor * yield_mpa * flow.rate_factor(test.rate_per_s);
            test.yield_mpa ~ LogNormal(expected.ln(), rate_scatter);
        }
    }
}

fn material(x: &[f64]) -> Material {
    let VoceJohnsonCook { yield_mpa, saturation_mpa, rate, c, reference_per_s } =
        law(from_fn(|k| x[k]));
    let hardening = Hardening::Voce { saturation_mpa, rate };
    let rate = Some(PlasticRate::JohnsonCook { c, reference_per_s });
    let plasticity = Plasticity { hardening, rate, ..Plasticity::new(yield_mpa) };
    Material::hencky(199_950.0, 0.27).with_plasticity(plasticity)
}

/// Returns the curves of bars with MatCal's dimensions and speed (2e-4 inch/s at the extensometer), simulated or read from
/// `directory`.
fn curves(
    directory: &Path,
    spacing: f64,
    parameter_points: &[Vec<f64>],
) -> Result<Vec<BarCurve>, Error> {
    let [radius_mm, length_mm, necking_mm, spacing_mm, taper_mm] =
        [0.125, 1.25, 0.375 * 0.75, spacing, 0.5 * 0.0015].map(|inch| inch * INCH_MM);
    let bar = RoundBar { radius_mm, taper_mm, length_mm, necking_mm, spacing_mm };
    let test = TensionTest::new(bar, 0.75 * INCH_MM, 2e-4 / 0.75, 1.0);
    let builder = test.builder(bar.eighth()?)?.order(Order::Quadratic);
    let problem: Problem = builder.materials([material(&MATCAL)]).build()?;
    let job = |run: &RunInput, _: &dyn Fn(f64)| {
        Ok(test.pull(&problem.with_materials(vec![material(&run.inputs)])?, 0.72, 0.02))
    };
    let never = AtomicBool::new(false);
    let ensemble = Ensemble::open(directory, &format!("{test:?}"))?;
    let records =
        ensemble.run(&RunInput::numbered(parameter_points), &NAMES, 0, &job, &(), &never)?;
    let curve = |record: &fem::RunRecord| {
        let readings = test.engineering_curve(record.finished_curve()?);
        Ok(BarCurve { specimen: format!("run {}", record.id), readings })
    };
    records.iter().map(curve).collect()
}

/// Returns the logarithms of the quantities of some bars.
fn quantities(curves: &[BarCurve]) -> Result<Vec<[f64; M]>, Error> {
    let logarithms = |curve: &BarCurve| Ok(curve.quantities(&STRAINS)?.map(f64::ln));
    curves.iter().map(logarithms).collect()
}

fn mean(rows: &[[f64; M]]) -> [f64; M] {
    from_fn(|k| rows.iter().map(|row| row[k]).sum::<f64>() / rows.len() as f64)
}

fn difference(a: &[f64; M], b: &[f64; M]) -> [f64; M] {
    from_fn(|k| a[k] - b[k])
}

fn main() -> Result<(), Error> {
    let directory = PathBuf::from(std::env::args().nth(1).ok_or("usage: steel_304l DIRECTORY")?);
    let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("data");
    let bars = read_bar_curves(&data.join("matcal_304L_tension.csv"))?;
    let rates = read_rate_tests(&data.join("matcal_304L_rate_yield.csv"))?;
    let measured = quantities(&bars)?;

    let input = |(name, [low, high]): (&&str, [f64; 2])| Input::new(*name, low, high);
    let inputs = NAMES.iter().zip(RANGES).map(input).collect::<Result<Vec<_>, _>>()?;
    let parameter_points = DesignMethod::Sobol.sample(&inputs, RUNS[0], 1)?;
    let coarse = quantities(&curves(&directory.join("runs"), 0.03, &parameter_points)?)?;
    let fine = quantities(&curves(&directory.join("fine"), 0.015, &parameter_points[..RUNS[1]])?)?;
    let corrections: Vec<_> =
        fine.iter().zip(&coarse).map(|(fine, coarse)| difference(fine, coarse)).collect();
    let correction = mean(&corrections);
    println!("finer mesh, logarithms of the ratios: {corrections:.4?}, mean {correction:.4?}");
    let outputs = (0..M).map(|k| format!("quantity_{k}")).collect();
    let mut runs = Dataset::new(inputs, outputs, "304L bars")?;
    for (x, row) in parameter_points.iter().zip(&coarse) {
        runs.push(x, &from_fn::<_, M, _>(|k| row[k] + correction[k]))?;
    }
    let options = FitOptions { max_order: 4, scales: Scales::Linear, ..FitOptions::default() };
    let fit = Pce::<4, M>::fit(&runs, &options)?;
    let lack = fit.report.lack_of_fit(&[1.0; M])?;
    let errors = from_fn(|k| lack[k][k].sqrt());
    println!("surrogate of order {}, relative errors {errors:.4?}", fit.report.order);

    let model = steel(&measured, &fit.pce, &errors, &rates);
    let sampler = Nuts::default().chains(4).warmup(1000).draws(1000).target_accept(0.9).seed(1);
    let posterior = sampler.sample(&model)?;
    let mut summary = posterior.summary();
    println!("{summary}");
    let rows = ["yield_mpa", "saturation_mpa", "rate", "c"];
    summary.rows.retain(|row| rows.contains(&&*row.name));
    summary.rows.sort_by_key(|row| rows.iter().position(|name| *name == row.name));
    summary.write_csv(directory.join("summary.csv"))?;

    let mode = Map::default().seed(1).find(&model)?;
    let mode = model.constrain(&mode.point, &mut Xoshiro256PlusPlus::seed_from_u64(1))?;
    let mode = NAMES.map(|name| mode.values(name).map_or(f64::NAN, |values| values[0]));
    let compared = [mode, MATCAL].map(|x| x.to_vec());
    let compared = curves(&directory.join("compared"), 0.015, &compared)?;
    for row in quantities(&compared)? {
        let ratio = difference(&row, &mean(&measured)).map(f64::exp);
        println!("simulated quantities over the means of the bars {ratio:.4?}");
    }
    let mut stresses = Chart::new("engineering strain", "engineering stress (MPa)");
    for (k, bar) in bars.iter().enumerate() {
        let name = if k == 0 { "eight bars" } else { "" };
        stresses = stresses.thin(name, Ink::Measured, bar.readings.iter().copied());
    }
    let stresses = stresses
        .line("simulated at the mode", Ink::Posterior, compared[0].readings.iter().copied())
        .dashed("simulated at MatCal's point", Ink::Truth, compared[1].readings.iter().copied());
    let draws = |name: &str| posterior.trace(name).unwrap_or_default().concat();
    let hardening = draws("rate").into_iter().zip(draws("rise_mpa")).step_by(8);
    let hardening = Chart::new("rate of hardening", "rise of the stress (MPa)")
        .points("posterior", Ink::Posterior, hardening)
        .points("MatCal's point", Ink::Truth, [(MATCAL[2], MATCAL[1])]);
    Ok(Chart::write_png(&directory.join("steel.png"), vec![stresses, hardening])?)
}
