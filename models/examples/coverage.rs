//! Measures how often the intervals of a calibration include the true parameters.
//!
//! ```text
//! breccia run                                                      # leaves results in breccia-out
//! cargo run --release -p models --example coverage -- breccia-out
//! cargo run --release -p models --example coverage -- breccia-out --simulate 40
//! ```
//! Prints `setting,parameter,nominal,covered,laboratories,mean_width,difference,difference_error`. The last two columns
//! compare each setting with the first setting on the same laboratories. For emulated laboratories, specimens and
//! ensembles are drawn from the surrogate and from the scatter between packings. For simulated laboratories,
//! specimens that each have a different packing are simulated on the cheapest mesh of the case. Settings:
//! - the exact forward model;
//! - a surrogate from runs with a separate packing each, with its shared error;
//! - a surrogate with the stiffness ratio of the microstructure as an input, which is known for no specimen, for half
//!   of the specimens, or for all;
//! - a surrogate from runs with one packing, as in the paper.
//!
//! The results of a case with several tests are calibrated jointly, in emulated laboratories. The settings are the
//! exact forward models, surrogates with their errors and, with `--without-errors`, the same surrogates without their
//! errors:
//!
//! ```text
//! cargo run --release -p models --example coverage -- results --runs 40 --repeats 10 --max-order 3
//! ```
//! If the results have more runs than `--runs`, the emulated response is more accurate than the surrogates of the
//! laboratories.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};

use clap::Parser;
use models::coverage::{
    CoverageRow, CoverageStudy, Emulated, EmulatedTests, JointSetting, MeshRatio, NextTests,
    ProgrammeStep, Setting, with_ratios,
};
use models::{Case, CaseFile, Population, simulate_laboratories};
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
    /// Number of simultaneous simulations, and of simultaneous calibrations; 0: all cores.
    #[arg(long, default_value_t = 0)]
    threads: usize,
    /// Number of runs of each emulated ensemble; default: the number of runs of the case.
    #[arg(long)]
    runs: Option<usize>,
    /// Highest order of the surrogates of emulated ensembles; default: the order of the case.
    #[arg(long)]
    max_order: Option<usize>,
    /// Number of runs that are repeated on the mesh of the specimens, for a case with several tests; default: the number of
    /// the case.
    #[arg(long)]
    repeats: Option<usize>,
    /// Number of chains of each calibration.
    #[arg(long, default_value_t = 2)]
    chains: usize,
    /// With several tests, also calibrate with surrogates that are assumed to be exact. Their intervals are too narrow.
    #[arg(long)]
    without_errors: bool,
    /// Number of laboratories that choose their next tests among the tests of the case, after its first test.
    #[arg(long, default_value_t = 0)]
    choose: usize,
    /// Largest accepted ratio of standard deviation to mean, for each parameter in the order of the case.
    #[arg(long, value_delimiter = ',', default_value = "0.03,0.05,0.03")]
    goals: Vec<f64>,
    /// Largest number of further tests of a laboratory that chooses.
    #[arg(long, default_value_t = 3)]
    most_tests: usize,
    /// Numbers of specimens of a further test.
    #[arg(long, value_delimiter = ',', default_value = "4,8,16")]
    specimens: Vec<usize>,
}

type Error = Box<dyn std::error::Error + Send + Sync>;

fn main() -> Result<(), Error> {
    let arguments = Arguments::parse();
    rayon::ThreadPoolBuilder::new().num_threads(arguments.threads).build_global()?;
    let file = CaseFile::read(&arguments.results.join("case.toml"))?;
    let case = &file.case;
    println!(
        "setting,parameter,nominal,covered,laboratories,mean_width,difference,difference_error"
    );
    let study = CoverageStudy::default();
    let study = CoverageStudy { sampler: study.sampler.chains(arguments.chains), ..study };
    let count = arguments.emulate;
    if !case.tests.is_empty() {
        if arguments.simulate > 0 {
            return Err("laboratories with several tests can only be emulated".into());
        }
        let world = tests(&arguments, case)?;
        let make = |k: usize| {
            let mut laboratory = world.laboratory(k as u64)?;
            let is_used =
                |setting: &JointSetting| arguments.without_errors || setting.name != "no error";
            laboratory.settings.retain(is_used);
            Ok::<_, Error>(laboratory)
        };
        print("emulated", &study.run_joint(count, make, counter(count))?);
        return choose(&arguments, world, &study);
    }
    let world = world(&arguments, &arguments.results, case)?;
    let make = |k: usize| Ok::<_, Error>(world.laboratory(k as u64)?);
    print("emulated", &study.run(count, make, counter(count))?);
    let (specimens, fit) = (world.specimens, world.fit);
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
            with_stiffness("stiffness half known", specimens / 2),
            with_stiffness("stiffness known", specimens),
            Setting::exact("one packing", DynPce::fit(&made.one_packing, &fit)?.pce),
        ];
        let make = |k: usize| Ok::<_, Error>((made.laboratories[k].clone(), settings.to_vec()));
        print("simulated", &study.run(arguments.simulate, make, counter(arguments.simulate))?);
    }
    Ok(())
}

/// Simulates laboratories that choose their next tests, and prints the tests of each laboratory and the share of
/// laboratories that meet all goals.
fn choose(arguments: &Arguments, world: EmulatedTests, study: &CoverageStudy) -> Result<(), Error> {
    let count = arguments.choose;
    if count == 0 {
        return Ok(());
    }
    let next = NextTests {
        candidates: world,
        goals: arguments.goals.clone(),
        most_tests: arguments.most_tests,
        specimens: arguments.specimens.clone(),
    };
    let programmes = next.run(study, count, counter(count))?;
    let percent = |values: &[f64]| {
        let cells: Vec<String> = values.iter().map(|x| format!("{:.1}", 100.0 * x)).collect();
        cells.join(" ")
    };
    println!("laboratory,step,test,specimens,expected_percent,sd_percent");
    for (k, programme) in programmes.iter().enumerate() {
        for (number, step) in programme.steps.iter().enumerate() {
            let ProgrammeStep { test, specimens, expected, relative_sd } = step;
            let [expected, reached] = [expected, relative_sd].map(|values| percent(values));
            println!("{k},{number},{test},{specimens},{expected},{reached}");
        }
    }
    let successful = programmes.iter().filter(|programme| programme.is_successful).count();
    println!("{successful} of {count} laboratories meet all goals");
    Ok(())
}

/// Returns the models by which laboratories with several tests are emulated. The stiffness ratio of packings is not an
/// input, because virtual specimens have no image.
fn tests(arguments: &Arguments, case: &Case) -> Result<EmulatedTests, Error> {
    let test = |name: &String| {
        let folder = arguments.results.join("tests").join(name);
        let file = CaseFile::read(&folder.join("case.toml"))?;
        let runs = Dataset::read_csv(folder.join("runs.csv"))?;
        let mesh = mesh_ratio(arguments, &folder, &file.case, &runs)?;
        let emulated = emulated(arguments, &file.case, &runs, None)?;
        Ok::<_, Error>((name.clone(), Emulated { mesh, ..emulated }))
    };
    let all = case.tests.iter().map(|test_entry| test(&test_entry.name));
    Ok(EmulatedTests::new(all.collect::<Result<_, Error>>()?)?)
}

/// Returns the ratio of the meshes of `[fidelity]`; `None` if all runs use the mesh of the specimens.
fn mesh_ratio(
    arguments: &Arguments,
    folder: &Path,
    case: &Case,
    runs: &Dataset,
) -> Result<Option<MeshRatio>, Error> {
    let level = match &case.fidelity.levels[..] {
        [] => return Ok(None),
        [level] => level,
        _ => return Err("only one level of [fidelity] can be emulated".into()),
    };
    let mut cheap: BTreeMap<String, Vec<f64>> = BTreeMap::new();
    let mut ratios = Dataset::new(runs.inputs().to_vec(), runs.outputs().to_vec(), "ratios")?;
    for row in csv::Reader::from_path(folder.join("fidelity_runs.csv"))?.into_deserialize() {
        let row: BTreeMap<String, String> = row?;
        let number = |name: &String| Ok::<f64, Error>(row[name].parse()?);
        let values: Vec<f64> = runs.outputs().iter().map(number).collect::<Result<_, _>>()?;
        if row["level"] == "1" {
            cheap.insert(row["run"].clone(), values);
            continue;
        }
        let Some(of_cheap) = cheap.get(&row["run"]) else {
            return Err(format!("fidelity_runs.csv: run {} has no level 1", row["run"]).into());
        };
        let inputs = runs.inputs().iter().map(|input| number(&input.name));
        let ratio: Vec<f64> = values.iter().zip(of_cheap).map(|(b, c)| b / c).collect();
        ratios.push(&inputs.collect::<Result<Vec<f64>, _>>()?, &ratio)?;
    }
    Ok(Some(MeshRatio::of(&ratios, arguments.repeats.unwrap_or(level.repeats))?))
}

/// Returns the model by which laboratories with one test are emulated.
fn world(arguments: &Arguments, folder: &Path, case: &Case) -> Result<Emulated, Error> {
    let runs = Dataset::read_csv(folder.join("runs.csv"))?;
    let Some(ratios) = stiffness_ratios(&runs) else {
        return emulated(arguments, case, &runs, None);
    };
    let rows: Vec<Vec<f64>> = ratios.iter().map(|&k| vec![k]).collect();
    let population = Population::of(&rows)?;
    let (mean, sd) = (population.mean()[0], population.sd()[0]);
    // all ratios that laboratories can draw
    let drawn = [mean - 6.0 * sd, mean + 6.0 * sd];
    emulated(arguments, case, &with_ratios(&runs, &ratios, &drawn)?, Some([mean, sd]))
}

/// Returns the model by which one test is emulated: the surrogate of the runs is the mean response, and the residuals of
/// the runs are the scatter between packings. `stiffness` has the mean and the standard deviation of the stiffness ratio,
/// if the ratio is the last input of the runs.
fn emulated(
    arguments: &Arguments,
    case: &Case,
    runs: &Dataset,
    stiffness: Option<[f64; 2]>,
) -> Result<Emulated, Error> {
    if case.prior.iter().any(|prior| prior.iter().any(|(_, prior)| !prior.is_uniform())) {
        return Err("the true parameters are drawn uniformly: [prior] must have ranges only".into());
    }
    let specimens = case.experiments.as_ref().and_then(|e| e.virtual_specimens.as_ref());
    let specimens =
        specimens.ok_or("the case has no virtual specimens: there is no scatter to draw from")?;
    let options = |max_order: usize| FitOptions {
        max_order,
        rule: case.surrogate.rule,
        ..FitOptions::default()
    };
    let order = case.surrogate.max_order;
    let PceFit { pce: response, report, .. } = DynPce::fit(runs, &options(order))?;
    eprintln!("response of order {} from {} runs", report.order, runs.len());
    let mean = response.mean();
    let scatter = report.scatter(&mean)?;
    let packings: Vec<Vec<f64>> = (0..mean.len())
        .map(|i| (0..mean.len()).map(|j| scatter[i][j] / (mean[i] * mean[j])).collect())
        .collect();
    for (m, output) in response.outputs().iter().enumerate() {
        eprintln!("{output}: scatter between packings {:.2} %", 100.0 * packings[m][m].sqrt());
    }
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
        runs: arguments.runs.unwrap_or(case.design.runs),
        method: case.design.method,
        fit: options(arguments.max_order.unwrap_or(order)),
        mesh: None,
    })
}

/// Returns the stiffness ratio of the packing of each run; `None` if a run has no ratio.
fn stiffness_ratios(runs: &Dataset) -> Option<Vec<f64>> {
    (0..runs.len()).map(|i| runs.covariate(i, "stiffness_ratio")).collect()
}

fn print(kind: &str, rows: &[CoverageRow]) {
    for row in rows {
        let CoverageRow { setting, parameter, nominal, covered, laboratories, .. } = row;
        let CoverageRow { mean_width, difference, difference_error, .. } = row;
        println!(
            "{kind}: {setting},{parameter},{nominal},{covered:.3},{laboratories},{mean_width:.4},{difference:.4},\
             {difference_error:.4}"
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
