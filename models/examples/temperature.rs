//! Stiffness against temperature from few specimens at each temperature: calibrated jointly, and separately for each
//! temperature.
//!
//! ```text
//! cargo run --release -p models --example temperature [picture.png]
//! ```
//! Virtual tests of two microstructures at five temperatures, in the closed form of the viscous limit: slope ~ E,
//! displacement at peak ~ (ξ/E)^(1/3), peak force ~ E^(2/3) ξ^(1/3). Each microstructure has a surrogate from 40 runs.
//! Prints and draws E and ξ at each temperature from both calibrations, with the true values.

use models::report::{Chart, Ink};
use models::{
    CalibrationError, Evidence, Pooling, Prior, TestGroup, Trend, calibrate, calibrate_groups,
};
use ppl::diagnostics::quantile;
use ppl::prelude::*;
use ppl::rand::{Rng, SeedableRng};
use ppl::rand_xoshiro::Xoshiro256PlusPlus;
use rand_distr::StandardNormal;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, SurrogateError};

const TEMPERATURES_C: [f64; 5] = [50.0, 60.0, 70.0, 80.0, 90.0];
/// Number of specimens at each temperature.
const SPECIMENS: [usize; 5] = [4, 2, 2, 2, 3];
/// Relative stiffness of the two microstructures.
const STIFFNESS: [f64; 2] = [1.0, 1.06];

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let microstructures = [fitted(STIFFNESS[0])?, fitted(STIFFNESS[1])?];
    let groups = tests(&microstructures, 3)?;
    let sampler = Nuts::default().chains(4).warmup(1000).draws(1000).target_accept(0.9).seed(1);

    let trends = vec![Trend::LogLinear, Trend::Constant, Trend::LogLinear];
    let pooling = Pooling { trends, deviation: 0.03 };
    let priors = Prior::uniform_on(microstructures[0].inputs());
    let all = calibrate_groups(&groups, &priors, &pooling, &sampler)?;
    println!("{}", all.summary());
    let together = |level: usize, parameter: usize| {
        all.trace(&format!("theta[{level},{parameter}]")).unwrap_or_default().concat()
    };
    let alone: Vec<_> = groups
        .iter()
        .map(|group| calibrate(&group.forward, &priors, &group.evidence, &sampler, 1))
        .collect::<Result<_, CalibrationError>>()?;
    let mut charts = Vec::new();
    for (parameter, label, range) in [(0, "E (MPa)", (200.0, 450.0)), (2, "ξ (MPa s)", (0.05, 0.6))]
    {
        println!("{label}: temperature, truth, all at once, this temperature alone");
        let mut bars = Vec::new();
        for (level, temperature) in TEMPERATURES_C.into_iter().enumerate() {
            let own = alone[level].posterior.trace(&format!("theta[{parameter}]"));
            let [a, b] = [together(level, parameter), own.unwrap_or_default().concat()]
                .map(|draws| [0.05, 0.5, 0.95].map(|p| quantile(&draws, p)));
            let truth = truth(temperature)[parameter];
            println!("{temperature} °C  {truth:.3}  {a:.3?}  {b:.3?}");
            bars.push([temperature + 0.6, b[0], b[1], b[2]]);
        }
        // one curve over the temperatures for each draw
        let levels: Vec<Vec<f64>> = (0..5).map(|level| together(level, parameter)).collect();
        let curves: Vec<Vec<f64>> =
            (0..levels[0].len()).map(|s| levels.iter().map(|draws| draws[s]).collect()).collect();
        let line = TEMPERATURES_C.map(|t| (t, truth(t)[parameter]));
        charts.push(
            Chart::new("temperature (°C)", label)
                .over((45.0, 95.0), range)
                .band("all at once, 90 %", Ink::Posterior, &TEMPERATURES_C, &curves, 0.9)
                .intervals("each alone, 90 %", Ink::Other, bars)
                .dashed("truth", Ink::Truth, line)
                .legend_above_left(),
        );
    }
    let picture = std::env::args().nth(1).unwrap_or_else(|| "temperature.png".to_owned());
    Chart::write_png(picture.as_ref(), charts)?;
    println!("{picture}");
    Ok(())
}

/// True parameters at a temperature: E in MPa, Gc in N/mm, ξ in MPa s.
fn truth(temperature_c: f64) -> [f64; 3] {
    let warmer = (temperature_c - 50.0) / 40.0;
    [280.0 * (0.18 * warmer).exp(), 0.0025, 0.3 * (-0.35 * warmer).exp()]
}

/// Slope in N/mm, peak force in N and displacement at peak in mm, in the viscous limit.
fn response([young_mpa, _, viscosity_mpa_s]: [f64; 3], stiffness: f64) -> [f64; 3] {
    let place = (viscosity_mpa_s / young_mpa).cbrt();
    [5.0 * stiffness * young_mpa, 4.2 * stiffness * young_mpa * place, 1.3 * place]
}

/// Fits the surrogate of a microstructure.
fn fitted(stiffness: f64) -> Result<DynPce, SurrogateError> {
    let inputs = vec![
        Input::new("matrix.young_mpa", 200.0, 450.0)?,
        Input::new("matrix.toughness_n_per_mm", 1e-5, 5e-3)?,
        Input::new("matrix.viscosity_mpa_s", 0.05, 0.6)?,
    ];
    let parameter_points = DesignMethod::Sobol.sample(&inputs, 40, 1)?;
    let outputs = ["slope_N_per_mm", "peak_force_N", "displacement_at_peak_mm"];
    let mut runs = Dataset::new(inputs, outputs.map(str::to_owned).to_vec(), "viscous limit")?;
    for x in parameter_points {
        runs.push(&x, &response([x[0], x[1], x[2]], stiffness))?;
    }
    Ok(DynPce::fit(&runs, &FitOptions::default())?.pce)
}

/// Draws the specimens at each temperature. The relative scatter of their quantities is 5 % (slope), 6 % (peak force) and 3 %
/// (displacement at peak), with a part that is common to all quantities. The two microstructures alternate between
/// temperatures.
fn tests(microstructures: &[DynPce; 2], seed: u64) -> Result<Vec<TestGroup>, SurrogateError> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut groups = Vec::new();
    for (k, temperature_c) in TEMPERATURES_C.into_iter().enumerate() {
        let mean = response(truth(temperature_c), STIFFNESS[k % 2]);
        let mut normal = || rng.sample::<f64, _>(StandardNormal);
        let mut specimen = || {
            let common = normal();
            let scatter = [0.05, 0.06, 0.03].map(|sd| sd * (0.6 * common + 0.8 * normal()));
            mean.iter().zip(scatter).map(|(mean, z)| mean * (1.0 + z)).collect::<Vec<f64>>()
        };
        let qois = (0..SPECIMENS[k]).map(|_| specimen()).collect();
        let forward = microstructures[k % 2].clone();
        let evidence = Evidence { qois, ..Evidence::default() };
        groups.push(TestGroup {
            name: format!("{temperature_c} °C"),
            temperature_c,
            forward,
            evidence,
        });
    }
    Ok(groups)
}
