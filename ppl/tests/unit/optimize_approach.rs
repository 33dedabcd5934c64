//! Starts far from the posterior, and starts near it.

use super::*;
use crate::density::{LogDensity, Rejection};

/// Log density given by a function that returns value and gradient.
struct ByFunction<F>(usize, F);

impl<F: Fn(&[f64]) -> (f64, Vec<f64>) + Sync> LogDensity for ByFunction<F> {
    type Workspace = ();

    fn dim(&self) -> usize {
        self.0
    }

    fn log_density(&self, y: &[f64], (): &mut ()) -> Result<f64, Rejection> {
        Ok((self.1)(y).0)
    }

    fn gradient(&self, y: &[f64], g: &mut [f64], (): &mut ()) -> Result<f64, Rejection> {
        let (value, gradient) = (self.1)(y);
        g.copy_from_slice(&gradient);
        Ok(value)
    }
}

/// Poisson count of 5 as a function of the logarithm of its rate, y₀ + 40 y₁, from starts with the rates e^82 and
/// e^400.
#[test]
fn comes_down_from_any_height() {
    let density = ByFunction(2, |y: &[f64]| {
        let ln_rate = y[0] + 40.0 * y[1];
        let slope = 5.0 - ln_rate.exp();
        (5.0 * ln_rate - ln_rate.exp(), vec![slope, 40.0 * slope])
    });
    for start in [[2.0, 2.0], [0.0, 10.0]] {
        let near = approach(&density, &start).unwrap().expect("far from the posterior");
        let value = density.log_density(&near, &mut ()).unwrap();
        assert!(value > -1e5, "{value} at {near:?}");
    }
}

/// A usual start is not moved: its coordinates are up to 2 from the mode, and the standard deviations are 1/20.
#[test]
fn leaves_usual_starts_alone() {
    let density = ByFunction(3, |y: &[f64]| {
        let square: f64 = y.iter().map(|y| y * y).sum();
        (-200.0 * square, y.iter().map(|y| -400.0 * y).collect())
    });
    assert_eq!(approach(&density, &[2.0, -2.0, 1.0]).unwrap(), None);
}
