//! Two tests in closed form, for the tests of coverage.

use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input};

use super::{CoverageStudy, Emulated, EmulatedTests};

pub(super) const INPUTS: [(&str, [f64; 2]); 3] = [
    ("matrix.young_mpa", [230.0, 330.0]),
    ("matrix.toughness_n_per_mm", [0.001, 0.005]),
    ("matrix.viscosity_mpa_s", [0.1, 0.55]),
];

pub(super) fn inputs() -> Vec<Input> {
    let input = |(name, [low, high]): (&str, [f64; 2])| Input::new(name, low, high).unwrap();
    INPUTS.map(input).to_vec()
}

/// Expansion of quantities in closed form: powers of E, Gc and ξ.
fn closed_form(powers: &[[f64; 3]]) -> DynPce {
    let names = ["slope_N_per_mm", "peak_force_N"];
    let outputs = names.map(str::to_owned).to_vec();
    let mut data = Dataset::new(inputs(), outputs, "closed form").unwrap();
    for x in DesignMethod::Sobol.sample(&inputs(), 256, 1).unwrap() {
        let quantity =
            |powers: &[f64; 3]| x.iter().zip(powers).map(|(x, p)| x.powf(*p)).product::<f64>();
        data.push(&x, &powers.iter().map(quantity).collect::<Vec<_>>()).unwrap();
    }
    DynPce::fit(&data, &FitOptions::default()).unwrap().pce
}

/// Fast test: the peak force of the viscous limit, ~ E^(2/3) ξ^(1/3). Slow test: the rate-independent peak force,
/// ~ √(E Gc), with a little viscosity. Neither test alone identifies both Gc and ξ.
pub(super) fn world(specimens: usize, runs: usize) -> EmulatedTests {
    let (packing, common) = (0.03_f64.powi(2), 2e-4);
    let test = |peak: [f64; 3]| Emulated {
        response: closed_form(&[[1.0, 0.0, 0.0], peak]),
        stiffness: None,
        packings: vec![vec![packing, common], vec![common, packing]],
        scatter: vec![0.02, 0.1, 0.05],
        noise: 0.002,
        specimens,
        inner: 0.8,
        runs,
        method: DesignMethod::LatinHypercube,
        fit: FitOptions { max_order: 2, ..FitOptions::default() },
        mesh: None,
    };
    let third = 1.0 / 3.0;
    let fast = ("fast".to_owned(), test([2.0 * third, 0.0, third]));
    let slow = ("slow".to_owned(), test([0.45, 0.45, 0.1]));
    EmulatedTests::new(vec![fast, slow]).unwrap()
}

pub(super) fn study() -> CoverageStudy {
    CoverageStudy {
        sampler: ppl::Nuts::default().chains(1).warmup(200).draws(300),
        ..CoverageStudy::default()
    }
}
