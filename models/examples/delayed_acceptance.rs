//! The posterior by the simulation itself: a surrogate screens, the finite elements decide.
//!
//! ```text
//! cargo run --release -p models --example delayed_acceptance -- DIRECTORY
//! ```
//! Some 500 simulations of a small mesh, of a tenth of a second each. They are kept in
//! `DIRECTORY/simulations.csv`: stopped at any moment, the same command goes on, since a seed leads to the same
//! points. Prints both posteriors and how often the simulation agreed, and draws
//! `DIRECTORY/posteriors.svg`.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::fs::{File, OpenOptions};
use std::io::Write;
use std::iter::once;
use std::path::Path;
use std::sync::Mutex;

use fem::{
    CompressionTest, CylinderLattice, Fracture, Material, Packing, PhaseField, Problem, Schedule,
    label,
};
use models::{Qois, TestCurve, calibration};
use ppl::prelude::*;
use ppl::{DomainError, Posterior};
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, Pce};

type Error = Box<dyn std::error::Error>;

const NAMES: [&str; 3] = ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"];
const PRIOR: [[f64; 2]; 3] = [[250.0, 300.0], [1e-5, 5e-3], [0.05, 0.55]];

/// Slope, peak force and displacement at peak as a function of the parameters, each a simulation; relative
/// to `units`.
struct Simulation {
    test: Problem,
    units: [f64; 3],
    known: Mutex<(BTreeMap<String, [f64; 3]>, File)>,
}

fn materials(&[young, toughness_n_per_mm, viscosity_mpa_s]: &[f64; 3]) -> [Material; 2] {
    let fracture = Fracture { toughness_n_per_mm, viscosity_mpa_s, residual_stiffness: 0.01 };
    [Material::hencky(young, 0.25).with_fracture(fracture), Material::hencky(22_000.0, 0.25)]
}

impl Simulation {
    fn new(directory: &Path) -> Result<Self, Error> {
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.1 };
        let mut mesh = lattice.build()?;
        label(&mut mesh, &Packing::new(0.15, 1).fill(lattice.radius_mm, lattice.height_mm)?);
        let test = CompressionTest::new(0.22, Schedule::fixed(1.0, 44).stop_below_peak(0.05))
            .builder(mesh)?
            .materials(materials(&[275.0, 2.5e-3, 0.3]))
            .phase_field(PhaseField::new(0.06))
            .build()?;
        let path = directory.join("simulations.csv");
        let line = |line: &str| {
            // a line that was cut has no end
            let cells = line.strip_suffix(";")?.split(',').map(str::parse);
            let cells: Vec<f64> = cells.collect::<Result<_, _>>().ok()?;
            Some((key(cells.get(..3)?), cells.get(3..)?.try_into().ok()?))
        };
        let known = std::fs::read_to_string(&path).unwrap_or_default();
        let known = known.lines().filter_map(line).collect();
        let file = OpenOptions::new().create(true).append(true).open(path)?;
        Ok(Self { test, units: [1.0; 3], known: Mutex::new((known, file)) })
    }

    fn run(&self, x: &[f64; 3]) -> Result<[f64; 3], Error> {
        if let Ok(known) = self.known.lock()
            && let Some(found) = known.0.get(&key(x))
        {
            return Ok(*found);
        }
        let run = self.test.with_materials(materials(x).to_vec())?.run(&mut ());
        let curve = TestCurve {
            displacement_mm: once(0.0).chain(run.curve.iter().map(|p| p.displacement_mm)).collect(),
            force_n: once(0.0).chain(run.curve.iter().map(|p| p.force_n)).collect(),
        };
        let q = Qois::of(&curve, 0.3)?;
        let found = [q.slope_n_per_mm, q.peak_force_n, q.displacement_at_peak_mm];
        if let Ok(mut known) = self.known.lock() {
            writeln!(known.1, "{},{};", key(x), key(&found))?;
            known.0.insert(key(x), found);
        }
        Ok(found)
    }
}

/// Numbers as they are kept: the shortest digits that say them exactly.
fn key(x: &[f64]) -> String {
    x.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

impl Differentiable<3, 3> for Simulation {
    fn value_and_jacobian(&self, _: &[f64; 3]) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
        Err(DomainError::new("a random walk asks for no derivatives"))
    }

    fn value(&self, x: &[f64; 3]) -> Result<[f64; 3], DomainError> {
        let found = self.run(x).map_err(|error| DomainError::new(error.to_string()))?;
        Ok([0, 1, 2].map(|m| found[m] / self.units[m]))
    }
}

fn main() -> Result<(), Error> {
    let directory = std::env::args().nth(1).ok_or("usage: delayed_acceptance DIRECTORY")?;
    let directory = Path::new(&directory);
    std::fs::create_dir_all(directory)?;
    let mut simulation = Simulation::new(directory)?;

    // specimens about 280 MPa and 0.3 MPa s, and a surrogate from sixty runs
    let of =
        |k: i32| [280.0 + 6.0 * f64::from(k % 3 - 1), 2.5e-3, 0.3 + 0.01 * f64::from(k % 5 - 2)];
    let specimens = (0..6).map(|k| simulation.run(&of(k))).collect::<Result<Vec<_>, _>>()?;
    let units = [0, 1, 2].map(|m| specimens.iter().map(|q| q[m]).sum::<f64>() / 6.0);
    let qois: Vec<[f64; 3]> =
        specimens.iter().map(|q| [0, 1, 2].map(|m| q[m] / units[m])).collect();
    simulation.units = units;
    let inputs = NAMES.iter().zip(PRIOR).map(|(name, [low, high])| Input::new(*name, low, high));
    let inputs = inputs.collect::<Result<Vec<_>, _>>()?;
    let outputs = ["slope", "peak", "at"].map(str::to_owned).to_vec();
    let mut runs = Dataset::new(inputs.clone(), outputs, "one packing")?;
    for x in DesignMethod::LatinHypercube.sample(&inputs, 60, 1)? {
        runs.push(&x, &simulation.value(&[x[0], x[1], x[2]])?)?;
    }
    let fit = DynPce::fit(&runs, &FitOptions::default())?;
    println!("{}", fit.report);
    let pce: Pce<3, 3> = fit.pce.try_into()?;

    // the same model with each of them
    let (cheap, exact) =
        (calibration(&pce, &qois, &PRIOR), calibration(&simulation, &qois, &PRIOR));
    let screened = Nuts::default().draws(4000).target_accept(0.95).seed(1).sample(&cheap)?;
    let sampler =
        DelayedAcceptance::default().screening_steps(300).warmup(2010).screened_warmup(2000);
    let chains = sampler.draws(100).seed(2).run(&cheap, &exact)?;
    let (stats, asked) = (chains.chains.iter().flat_map(|c| &c.stats), chains.evaluations());
    let agreed = stats.map(|s| s.acceptance).sum::<f64>() / 400.0;
    let decided = Posterior::from_chains(&exact, chains, 2)?;

    println!("parameter,surrogate mean,sd,simulation mean,sd,mcse,difference / mcse");
    let (a, b) = (screened.summary(), decided.summary());
    for name in NAMES {
        let (Some(s), Some(d)) = (a.row(name), b.row(name)) else { continue };
        let mcse = d.mcse_mean.hypot(s.mcse_mean);
        let numbers = [s.mean, s.sd, d.mean, d.sd, mcse].map(|x| format!("{x:.5}")).join(",");
        println!("{name},{numbers},{:.1}", (d.mean - s.mean) / mcse);
    }
    println!("{asked} simulations decided; they agreed with probability {agreed:.2}");
    std::fs::write(directory.join("posteriors.svg"), picture(&[&screened, &decided]))?;
    Ok(())
}

/// For each parameter the fraction of draws below a value: grey by the surrogate, black by the simulation.
fn picture(posteriors: &[&Posterior; 2]) -> String {
    let mut svg =
        "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 760 240' font-family='sans-serif' \
                   font-size='12'><rect width='760' height='240' fill='white'/>"
            .to_owned();
    for (i, (name, [low, high])) in NAMES.iter().zip(PRIOR).enumerate() {
        let left = 15.0 + 250.0 * i as f64;
        let _ = write!(
            svg,
            "<rect x='{left}' y='20' width='230' height='180' fill='none' stroke='silver'/>\
             <text x='{left}' y='225'>{low} … {name} … {high}</text>"
        );
        for (posterior, style) in posteriors.iter().zip(["silver' stroke-width='5", "black"]) {
            let mut draws = posterior.trace(name).unwrap_or_default().concat();
            draws.sort_by(f64::total_cmp);
            let _ = write!(svg, "<polyline fill='none' stroke='{style}' points='");
            for (k, x) in draws.iter().enumerate().step_by(draws.len().div_ceil(400)) {
                let x = left + 230.0 * (x - low) / (high - low);
                let y = 200.0 - 180.0 * (k as f64 + 0.5) / draws.len() as f64;
                let _ = write!(svg, "{x:.1},{y:.1} ");
            }
            svg += "'/>";
        }
    }
    svg + "</svg>\n"
}
