//! Comparison of a gradient with finite differences.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::density::{LogDensity, Rejection};
use crate::quantity::format::further;

/// Allowed difference between a component ∂ of the gradient and its finite difference, relative to max(1, |∂|).
const TOLERANCE: f64 = 1e-8;
/// Rounding error of a log density relative to max(1, |ln p|), which limits the accuracy of finite differences.
const ROUNDING: f64 = 1e-12;
const POINTS: usize = 10;

/// Error of a gradient that differs from the derivative of its density.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum GradientMismatch {
    /// One component of the gradient differs.
    #[error(
        "∂/∂y[{coordinate}] is {got:.12e}, but finite differences of the log density give {expected:.12e} \
         (± {uncertainty:.1e}) at y = {point:?}"
    )]
    Component {
        /// Index of the unconstrained coordinate.
        coordinate: usize,
        /// Component of the gradient.
        got: f64,
        /// Extrapolated central difference.
        expected: f64,
        /// Estimated error of the central difference.
        uncertainty: f64,
        /// Point of the comparison.
        point: Vec<f64>,
    },
    /// A component is NaN or infinite.
    #[error("∂/∂y[{coordinate}] is {got} at y = {point:?}{}", further(.detail))]
    NotFinite {
        /// Index of the unconstrained coordinate.
        coordinate: usize,
        /// Component of the gradient.
        got: f64,
        /// Point of the comparison.
        point: Vec<f64>,
        /// Statement of the model that caused the value, if the density reports it.
        detail: Option<String>,
    },
    /// The log density returned with the gradient differs from the log density computed alone.
    #[error(
        "the log density returned with the gradient is {got:.15e}, but the log density computed alone is \
         {expected:.15e} at y = {point:?}"
    )]
    Value {
        /// Log density returned with the gradient.
        got: f64,
        /// Log density computed alone.
        expected: f64,
        /// Point of the comparison.
        point: Vec<f64>,
    },
    /// The finite differences do not converge, so that no comparison is possible.
    #[error(
        "finite differences of the log density along y[{coordinate}] do not converge (± {uncertainty:.1e} \
         at {estimate:.6e}): the log density is not smooth near y = {point:?}"
    )]
    NotSmooth {
        /// Index of the unconstrained coordinate.
        coordinate: usize,
        /// Most accurate finite difference.
        estimate: f64,
        /// Estimated error of the finite difference.
        uncertainty: f64,
        /// Point of the comparison.
        point: Vec<f64>,
    },
    /// Every tried point was rejected by the density.
    #[error("all {tries} points were rejected, the last with: {last}")]
    NoPoint {
        /// Number of points tried.
        tries: usize,
        /// Rejection of the last point.
        #[source]
        last: Rejection,
    },
}

/// Asserts that the gradient of `density` is the derivative of its log density at ten random points, which are
/// uniform on (−2, 2)ᵈ. The allowed difference is 1e-8 relative to max(1, |∂|), or 1e-12 relative to the log density
/// if that is larger.
///
/// The derivative is a central difference of [`LogDensity::log_density`], extrapolated to step 0 (Ridders 1982,
/// doi:10.1016/S0141-1195(82)80057-0). The expected derivative is therefore independent of the tested code. Points
/// that the density rejects are replaced by other points.
///
/// # Panics
/// If the gradient is wrong, with the message of [`GradientMismatch`].
///
/// ```
/// use ppl::{LogDensity, Rejection, check};
///
/// struct Normal;
/// impl LogDensity for Normal {
///     type Workspace = ();
///     fn dim(&self) -> usize { 1 }
///     fn log_density(&self, y: &[f64], _: &mut ()) -> Result<f64, Rejection> {
///         Ok(-0.5 * y[0] * y[0])
///     }
///     fn gradient(&self, y: &[f64], g: &mut [f64], w: &mut ()) -> Result<f64, Rejection> {
///         g[0] = -y[0];
///         self.log_density(y, w)
///     }
/// }
///
/// check::gradient(&Normal, 7);
/// ```
#[track_caller]
pub fn gradient<D: LogDensity>(density: &D, seed: u64) {
    if let Err(mismatch) = at_random_points(density, seed) {
        panic!("{mismatch}");
    }
}

fn at_random_points<D: LogDensity>(density: &D, seed: u64) -> Result<(), GradientMismatch> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut workspace = D::Workspace::default();
    let mut rejected = 0;
    for _ in 0..POINTS {
        let point = loop {
            let point: Vec<f64> = (0..density.dim()).map(|_| rng.random_range(-2.0..2.0)).collect();
            match density.log_density(&point, &mut workspace) {
                Ok(_) => break point,
                Err(last) if rejected == 100 => {
                    return Err(GradientMismatch::NoPoint { tries: 101, last });
                }
                Err(_) => rejected += 1,
            }
        };
        gradient_at(density, &point)?;
    }
    Ok(())
}

/// Compares the gradient at one point with finite differences of the log density; see [`gradient`].
///
/// # Errors
/// [`GradientMismatch`] with the component and both values.
pub fn gradient_at<D: LogDensity>(density: &D, point: &[f64]) -> Result<(), GradientMismatch> {
    let mut workspace = D::Workspace::default();
    let rejected = |last: Rejection| GradientMismatch::NoPoint { tries: 1, last };
    let mut computed = vec![0.0; point.len()];
    let with = density.gradient(point, &mut computed, &mut workspace).map_err(rejected)?;
    let alone = density.log_density(point, &mut workspace).map_err(rejected)?;
    let rounding = ROUNDING * alone.abs().max(1.0);
    if (with - alone).abs() > rounding || with.is_nan() {
        return Err(GradientMismatch::Value { got: with, expected: alone, point: point.to_vec() });
    }
    for (coordinate, &got) in computed.iter().enumerate() {
        if !got.is_finite() {
            let (point, detail) = (point.to_vec(), density.explain(point));
            return Err(GradientMismatch::NotFinite { coordinate, got, point, detail });
        }
        let mut moved = point.to_vec();
        let along = |step: f64| {
            moved[coordinate] = point[coordinate] + step;
            density.log_density(&moved, &mut workspace).unwrap_or(f64::NAN)
        };
        let (expected, uncertainty) = derivative(along);
        let allowed = (TOLERANCE * expected.abs().max(1.0)).max(rounding);
        if (got - expected).abs() <= allowed {
            continue;
        }
        let point = point.to_vec();
        return Err(if uncertainty > allowed || uncertainty.is_nan() {
            GradientMismatch::NotSmooth { coordinate, estimate: expected, uncertainty, point }
        } else {
            GradientMismatch::Component { coordinate, got, expected, uncertainty, point }
        });
    }
    Ok(())
}

/// Computes the derivative of `f` at 0 and its estimated error by Ridders' method. Central differences with
/// decreasing steps are extrapolated as polynomials in the squared step. The result is the table entry that agrees
/// best with its neighbours.
pub(super) fn derivative(mut f: impl FnMut(f64) -> f64) -> (f64, f64) {
    const SHRINK: f64 = 1.6;
    const ROWS: usize = 16;
    let mut step = 0.2;
    let mut best = (f64::NAN, f64::INFINITY);
    let mut previous: Vec<f64> = Vec::new();
    for _ in 0..ROWS {
        let mut row = vec![(f(step) - f(-step)) / (2.0 * step)];
        let mut factor = 1.0;
        for (k, before) in previous.iter().enumerate() {
            factor *= SHRINK * SHRINK;
            let better = (factor * row[k] - before) / (factor - 1.0);
            let error = (better - row[k]).abs().max((better - before).abs());
            if error < best.1 {
                best = (better, error);
            }
            row.push(better);
        }
        previous = row;
        step /= SHRINK;
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extrapolated_differences_reach_ten_digits() {
        let (d, error) = derivative(|h| (1.3 + h).exp() * (1.3 + h).sin());
        let exact = 1.3_f64.exp() * (1.3_f64.sin() + 1.3_f64.cos());
        assert!((d / exact - 1.0).abs() < 1e-11 && error < 1e-9, "{d} ± {error}, {exact}");
        // test a steep function, and a function that is undefined at the larger difference steps
        let (d, _) = derivative(|h| (200.0 * h).sin());
        assert!((d / 200.0 - 1.0).abs() < 1e-9, "{d}");
        let (d, _) = derivative(|h| (0.01 + h).ln());
        assert!((d / 100.0 - 1.0).abs() < 1e-9, "{d}");
    }
}
