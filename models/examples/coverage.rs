//! Measures how often the intervals of a calibration include the true parameters.
//!
//! ```text
//! breccia run                                                      # leaves results in breccia-out
//! cargo run --release -p models --example coverage -- breccia-out
//! cargo run --release -p models --example coverage -- breccia-out --simulate 40
//! ```
//! Prints `setting,parameter,nominal,covered,laboratories,mean_width`. For emulated laboratories, specimens and
//! ensembles are drawn from the surrogate and from the scatter between packings. For simulated laboratories,
//! specimens that each have a different packing are simulated on the cheapest mesh of the case. Settings:
//! - the exact forward model;
//! - a surrogate from runs with a separate packing each, with its shared error;
//! - a surrogate with the stiffness ratio of the microstructure as an input, which is known for no specimen, for half
//!   of the specimens, or for all;
//! - a surrogate from runs with one packing, as in the paper.

use std::path::PathBuf;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use clap::Parser;
use models::coverage::{CoverageRow, CoverageStudy, Emulated, Setting, with_ratios};
use models::{CaseFile, Population, VirtualCase, simulate_laboratories};
use surrogate::{Dataset, DynPce, FitOptions, PceFit};

/// Fraction of each side of the prior box from which true parameters are drawn.
const INNER: f64 = 0.8;

/// Measures how often the intervals of a calibration include the true parameters.
#[derive(Parser)]
struct Arguments {
    /// Folder with the results of a finished run.
    results: PathBuf,
    /// Number of emulated laboratories.
    #[arg(long, default_value_t = 300)]
    emulate: usize,
    /// Number of laboratories with real simulations of their specimens.
    #[arg(long, default_value_t = 0)]
    simulate: usize,
    /// Number of points for the exact forward model of the simulated laboratories; each point needs two runs.
    #[arg(long, default_value_t = 300)]
    exact_points: usize,
    /// Number of simultaneous simulations; 0: all cores.
    #[arg(long, default_value_t = 0)]
    threads: usize,
}

type Error = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Error> {
    let arguments = Arguments::parse();
    let file = CaseFile::read(&arguments.results.join("case.toml"))?;
    let case = &file.case;
    let specimens = case.experiments.as_ref().and_then(|e| e.virtual_specimens.clone());
    if case.prior.iter().any(|prior| prior.iter().any(|(_, prior)| !prior.is_uniform())) {
        return Err("the true parameters are drawn uniformly: [prior] must have ranges only".into());
    }
    let specimens =
        specimens.ok_or("the case has no virtual specimens: there is no scatter to draw from")?;
    let fit = FitOptions {
        max_order: case.surrogate.max_order,
        rule: case.surrogate.rule,
        ..FitOptions::default()
    };
    println!("setting,parameter,nominal,covered,laboratories,mean_width");
    let study = CoverageStudy::default();
    let world = world(&arguments, case, &specimens, &fit)?;
    let told = counter(arguments.emulate);
    let rows =
        study.run(arguments.emulate, |k| Ok::<_, Error>(world.laboratory(k as u64)?), told)?;
    print("emulated", &rows);
    if arguments.simulate > 0 {
        let interrupt = AtomicBool::new(false);
        let counts = [arguments.simulate, arguments.exact_points];
        let made = simulate_laboratories(
            &file,
            &arguments.results,
            counts,
            INNER,
            arguments.threads,
            &interrupt,
        )?;
        let stiffness_fit = DynPce::fit(&made.with_stiffness, &fit)?;
        let ratios: Vec<Vec<f64>> =
            made.with_stiffness.rows().map(|(x, _)| x[x.len() - 1..].to_vec()).collect();
        let population = Population::of(&ratios)?;
        let with_stiffness = |name: &str, known: usize| {
            Setting::shared(name, stiffness_fit.clone())
                .knowing_stiffness(known, Some(population.clone()))
        };
        let settings = [
            Setting::exact("exact", DynPce::fit(&made.mean_response, &fit)?.pce),
            Setting::shared("packing per run", DynPce::fit(&made.per_run, &fit)?),
            with_stiffness("stiffness unknown", 0),
            with_stiffness("stiffness half known", specimens.specimens / 2),
            with_stiffness("stiffness known", specimens.specimens),
            Setting::exact("one packing", DynPce::fit(&made.one_packing, &fit)?.pce),
        ];
        let make = |k: usize| Ok::<_, Error>((made.laboratories[k].clone(), settings.to_vec()));
        print("simulated", &study.run(arguments.simulate, make, counter(arguments.simulate))?);
    }
    Ok(())
}

/// Returns the model by which laboratories are emulated: the surrogate of the results is the mean response, and the scatter
/// between packings is added.
fn world(
    arguments: &Arguments,
    case: &models::Case,
    specimens: &VirtualCase,
    fit: &FitOptions,
) -> Result<Emulated, Error> {
    let runs = Dataset::read_csv(arguments.results.join("runs.csv"))?;
    let stiffness = stiffness_ratios(&runs)
        .map(|ratios| {
            Population::of(&ratios.iter().map(|&k| vec![k]).collect::<Vec<_>>())
                .map(|p| (ratios, p))
        })
        .transpose()?;
    let (data, stiffness) = match stiffness {
        None => (runs, None),
        Some((ratios, p)) => {
            let (mean, sd) = (p.mean()[0], p.sd()[0]);
            // all ratios that laboratories can draw
            let drawn = [mean - 6.0 * sd, mean + 6.0 * sd];
            (with_ratios(&runs, &ratios, &drawn)?, Some([mean, sd]))
        }
    };
    let PceFit { pce: response, report, .. } = DynPce::fit(&data, fit)?;
    let mean = response.mean();
    let scatter = report.scatter(&mean)?;
    let packings = (0..mean.len())
        .map(|i| (0..mean.len()).map(|j| scatter[i][j] / (mean[i] * mean[j])).collect())
        .collect();
    let scatter_of = |name: &String| specimens.scatter.get(&name.parse().ok()?).copied();
    let parameters =
        &response.inputs()[..response.inputs().len() - usize::from(stiffness.is_some())];
    let scatter = parameters.iter().map(|input| scatter_of(&input.name).unwrap_or(0.0)).collect();
    Ok(Emulated {
        response,
        stiffness,
        packings,
        scatter,
        noise: 0.003,
        specimens: specimens.specimens,
        inner: INNER,
        runs: case.design.runs,
        method: case.design.method,
        fit: fit.clone(),
    })
}

/// Returns the stiffness ratio of the packing of each run; `None` if a run has no ratio.
fn stiffness_ratios(runs: &Dataset) -> Option<Vec<f64>> {
    (0..runs.len()).map(|i| runs.note(i, "stiffness_ratio")?.parse().ok()).collect()
}

fn print(kind: &str, rows: &[CoverageRow]) {
    for row in rows {
        let CoverageRow { setting, parameter, nominal, covered, laboratories, mean_width } = row;
        println!(
            "{kind}: {setting},{parameter},{nominal},{covered:.3},{laboratories},{mean_width:.4}"
        );
    }
}

fn counter(all: usize) -> impl Fn(usize) + Sync {
    let done = AtomicUsize::new(0);
    move |_| {
        let done = done.fetch_add(1, Ordering::Relaxed) + 1;
        if done.is_multiple_of(10) {
            eprintln!("{done} of {all} laboratories");
        }
    }
}
