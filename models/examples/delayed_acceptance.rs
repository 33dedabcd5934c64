//! Samples the exact posterior of a finite-element model by delayed acceptance: a surrogate screens proposals, and
//! simulations decide.
//!
//! `cargo run --release -p models --example delayed_acceptance -- DIRECTORY` stores about 680 simulations on a coarse
//! mesh, with their parameters, in `DIRECTORY/simulations.csv`. An interrupted run resumes where it stopped, because
//! the seed determines all points. Prints both posteriors and the acceptance rate of the simulation, and draws
//! `DIRECTORY/posteriors.png`.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use fem::{CompressionTest, CylinderLattice, Fracture, Material, Packing, PhaseField, Problem};
use fem::{Schedule, label};
use models::report::{Chart, Ink};
use models::{Prior, Qois, Specimens, TestCurve, calibration_on};
use ppl::prelude::*;
use ppl::{DomainError, Posterior};
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};

type Error = Box<dyn std::error::Error>;
const NAMES: [&str; 3] = ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"];
const PRIOR: [[f64; 2]; 3] = [[250.0, 300.0], [1e-5, 5e-3], [0.05, 0.55]];

/// Forward model by simulation: slope, peak force and displacement at peak, relative to `units`.
struct Simulation {
    test: Problem,
    units: [f64; 3],
    known: Mutex<(BTreeMap<String, [f64; 3]>, File)>,
}

fn materials(&[young, toughness_n_per_mm, viscosity_mpa_s]: &[f64; 3]) -> [Material; 2] {
    let fracture = Fracture { toughness_n_per_mm, viscosity_mpa_s, residual_stiffness: 0.01 };
    [Material::hencky(young, 0.25).with_fracture(fracture), Material::hencky(22_000.0, 0.25)]
}

/// Formats numbers for the file: the shortest digits that represent them exactly.
fn key(x: &[f64]) -> String {
    x.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

impl Simulation {
    fn new(file: &Path) -> Result<Self, Error> {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.1 };
        let mut mesh = lattice.build()?;
        label(&mut mesh, &Packing::new(0.15, 1).fill(lattice.radius_mm, lattice.height_mm)?);
        let test = CompressionTest::new(0.22, Schedule::fixed(1.0, 44).stop_below_peak(0.05))
            .builder(mesh)?
            .materials(materials(&[275.0, 2.5e-3, 0.3]))
            .phase_field(PhaseField::new(0.06))
            .build()?;
        let line = |line: &str| {
            // an incomplete line, written when the program was stopped, has no semicolon
            let cells = line.strip_suffix(";")?.split(',').map(str::parse);
            let cells: Vec<f64> = cells.collect::<Result<_, _>>().ok()?;
            Some((key(cells.get(..3)?), cells.get(3..)?.try_into().ok()?))
        };
        let known = std::fs::read_to_string(file).unwrap_or_default();
        let known = known.lines().filter_map(line).collect();
        let mut file = OpenOptions::new().create(true).append(true).open(file)?;
        writeln!(file)?;
        Ok(Self { test, units: [1.0; 3], known: Mutex::new((known, file)) })
    }

    fn run(&self, x: &[f64; 3]) -> Result<[f64; 3], Error> {
        let lock = || self.known.lock().map_err(|_| "another chain has failed");
        if let Some(found) = lock()?.0.get(&key(x)) {
            return Ok(*found);
        }
        let run = self.test.with_materials(materials(x).to_vec())?.run(&mut ());
        let readings = run.curve.iter().map(|p| (p.displacement_mm, p.force_n));
        let (displacement_mm, force_n) = [(0.0, 0.0)].into_iter().chain(readings).unzip();
        let q = Qois::of(&TestCurve::new(displacement_mm, force_n), 0.3)?;
        let found = [q.slope_n_per_mm, q.peak_force_n, q.displacement_at_peak_mm];
        writeln!(lock()?.1, "{},{};", key(x), key(&found))?;
        lock()?.0.insert(key(x), found);
        Ok(found)
    }
}

impl DynDifferentiable for Simulation {
    fn outputs(&self) -> usize {
        3
    }

    fn value_and_jacobian(&self, _: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), DomainError> {
        Err(DomainError::new("a random walk asks for no derivatives"))
    }

    fn value(&self, x: &[f64]) -> Result<Vec<f64>, DomainError> {
        let x = x.try_into().map_err(|_| DomainError::new("a simulation has three parameters"))?;
        let found = self.run(x).map_err(|error| DomainError::new(error.to_string()))?;
        Ok((0..3).map(|m| found[m] / self.units[m]).collect())
    }
}

fn main() -> Result<(), Error> {
    let usage = "usage: delayed_acceptance DIRECTORY";
    let directory = PathBuf::from(std::env::args().nth(1).ok_or(usage)?);
    std::fs::create_dir_all(&directory)?;
    let mut simulation = Simulation::new(&directory.join("simulations.csv"))?;
    // six specimens with E near 280 MPa and ξ near 0.3 MPa s, and a surrogate from thirty runs
    let part = |k: i32, n: i32| f64::from(k % n - n / 2);
    let point = |k: i32| [280.0 + 6.0 * part(k, 3), 2.5e-3, 0.3 + 0.01 * part(k, 5)];
    let found = (0..6).map(|k| simulation.run(&point(k))).collect::<Result<Vec<_>, _>>()?;
    let units = [0, 1, 2].map(|m| found.iter().map(|q| q[m]).sum::<f64>() / 6.0);
    let relative = |q: &[f64; 3]| -> Vec<f64> { (0..3).map(|m| q[m] / units[m]).collect() };
    let specimens = Specimens::new(&found.iter().map(relative).collect::<Vec<_>>())?;
    simulation.units = units;
    let inputs = NAMES.iter().zip(PRIOR).map(|(name, [low, high])| Input::new(*name, low, high));
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let outputs = ["slope", "peak", "displacement"].map(str::to_owned).to_vec();
    let mut runs = Dataset::new(inputs.clone(), outputs, "one packing")?;
    for x in DesignMethod::LatinHypercube.sample(&inputs, 30, 1)? {
        runs.push(&x, &simulation.value(&x)?)?;
    }
    let fit = DynPce::fit(&runs, &FitOptions::default())?;
    // the same statistical model with the surrogate and with the simulation
    let priors = PRIOR.map(|[low, high]| Prior::uniform(low, high));
    let cheap = calibration_on(&fit.pce, &priors, &specimens);
    let exact = calibration_on(&simulation, &priors, &specimens);
    let screened = Nuts::default().draws(4000).target_accept(0.95).seed(1).sample(&cheap)?;
    // each of four chains: warm-up of 2000 transitions on the surrogate alone and ten with the simulation, then 150
    // stored draws
    let sampler = DelayedAcceptance::default().screening_steps(300).screened_warmup(2000);
    let chains = sampler.warmup(2010).draws(150).seed(2).run(&cheap, &exact)?;
    let mean = |acceptance: Vec<f64>| acceptance.iter().sum::<f64>() / acceptance.len() as f64;
    let late = chains.chains.iter().flat_map(|c| &c.warmup.stats[1000..2000]);
    let first = mean(late.map(|s| s.acceptance).collect());
    let second = mean(chains.chains.iter().flat_map(|c| &c.stats).map(|s| s.acceptance).collect());
    println!("accepted: a step of the surrogate {first:.2}, what it proposes {second:.2}");
    println!("{} simulations decided\n", chains.evaluations());
    // both models have the same parameters; with the exact model, prior predictions would need further simulations
    let decided = Posterior::from_chains(&cheap, chains, 2)?;
    println!("parameter,by surrogate,sd,by simulation,sd,R-hat,difference in standard errors");
    let (a, b) = (screened.summary(), decided.summary());
    let mut panels = Vec::new();
    for (k, (name, [low, high])) in NAMES.iter().zip(PRIOR).enumerate() {
        let parameter = format!("theta[{k}]");
        let (Some(s), Some(d)) = (a.row(&parameter), b.row(&parameter)) else { continue };
        let moments = [s.mean, s.sd, d.mean, d.sd].map(|x| format!("{x:.5}")).join(",");
        let gap = (d.mean - s.mean) / d.mcse_mean.hypot(s.mcse_mean);
        println!("{name},{moments},{:.3},{gap:.1}", d.rhat);
        let cumulative = |posterior: &Posterior| {
            let mut draws = posterior.trace(&parameter).unwrap_or_default().concat();
            draws.sort_by(f64::total_cmp);
            let n = draws.len() as f64;
            draws.into_iter().enumerate().map(move |(k, x)| (x, (k as f64 + 0.5) / n))
        };
        let chart = Chart::new(name, "posterior probability below").over((low, high), (0.0, 1.0));
        let chart = chart.line("surrogate", Ink::Other, cumulative(&screened)).legend_above_left();
        panels.push(chart.line("simulation", Ink::Posterior, cumulative(&decided)));
    }
    Ok(Chart::write_png(&directory.join("posteriors.png"), panels)?)
}
