//! Code that the tests of several crates share.

pub mod eight_schools;
pub mod fixed_size;
pub mod posteriors;

use models::Prior;
use ppl::Posterior;
use ppl::check::Estimate;
use serde_json::Value;
use surrogate::{Input, Pce};

/// Asserts that mean and standard deviation of a named element are within 4 Monte Carlo standard errors of these
/// values.
///
/// # Panics
/// If the mean or the standard deviation differs by more.
pub fn assert_moments(posterior: &Posterior, name: &str, mean: f64, sd: f64) {
    ppl::check::mean(posterior, name, mean).within_mcse(4.0);
    ppl::check::sd(posterior, name, sd).within_mcse(4.0);
}

/// Version of [`assert_moments`] for reference moments, each with its standard error: (moment, standard error).
///
/// # Panics
/// If the mean or the standard deviation differs by more than 4 standard errors of the difference.
pub fn assert_moments_of(chains: &[Vec<f64>], name: &str, mean: (f64, f64), sd: (f64, f64)) {
    let chains: Vec<&[f64]> = chains.iter().map(Vec::as_slice).collect();
    Estimate::of_mean(name, &chains, mean.0).reference_error(mean.1).within_mcse(4.0);
    Estimate::of_sd(name, &chains, sd.0).reference_error(sd.1).within_mcse(4.0);
}

/// Fixed benchmark instance of the paper's calibration (`fixtures/calibration_instance.json`): a synthetic surrogate
/// with inputs on [−1, 1], and eight synthetic experiments.
#[derive(Debug)]
pub struct Instance {
    /// Contents of the file.
    pub json: Value,
    /// The surrogate.
    pub pce: Pce<3, 3>,
    /// Normalised QoIs, one row per experiment.
    pub qois: Vec<[f64; 3]>,
}

impl Instance {
    /// Reads the fixture.
    ///
    /// # Panics
    /// If the fixture is damaged.
    pub fn load() -> Self {
        let json: Value =
            serde_json::from_str(include_str!("../fixtures/calibration_instance.json"))
                .expect("the fixture is JSON");
        let input = |name: &str| Input::new(name, -1.0, 1.0).expect("a proper interval");
        let indices = json["multi_indices"].as_array().expect("multi-indices");
        let terms = indices.iter().enumerate().map(|(j, index)| {
            let index: [u8; 3] = std::array::from_fn(|d| index[d].as_u64().expect("degree") as u8);
            // the coefficients in the file refer to plain Legendre polynomials, the coefficients of a `Pce` to
            // orthonormal polynomials
            let norm = index.iter().map(|&a| f64::from(2 * a + 1).sqrt()).product::<f64>();
            (index, std::array::from_fn(|m| number(&json["C"][m][j]) / norm))
        });
        let outputs = ["slope", "peak_force", "disp_at_peak"].map(str::to_owned);
        let pce = Pce::from_terms([input("E"), input("G_c"), input("xi")], outputs, terms)
            .expect("the fixture is a valid expansion");
        let rows = json["Y"].as_array().expect("experiments");
        let qois = rows.iter().map(numbers::<3>).collect();
        Self { json, pce, qois }
    }

    /// The priors of the instance.
    pub fn prior() -> [Prior; 3] {
        [Prior::uniform(-1.0, 1.0); 3]
    }
}

/// Reads a number of a fixture.
///
/// # Panics
/// If the value is not a number.
pub fn number(value: &Value) -> f64 {
    value.as_f64().unwrap_or_else(|| panic!("{value} is not a number"))
}

/// Reads an array of `N` numbers of a fixture.
///
/// # Panics
/// If the value is not an array of `N` numbers.
pub fn numbers<const N: usize>(value: &Value) -> [f64; N] {
    assert_eq!(value.as_array().map(Vec::len), Some(N), "{value}");
    std::array::from_fn(|i| number(&value[i]))
}
