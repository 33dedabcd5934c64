//! Numerical integrals over the box, for expansions on logarithmic scales, which have no closed form.

use crate::dyn_pce::DynPce;

/// Largest number of points of a grid.
pub(crate) const MAX_POINTS: usize = 1 << 20;
/// Smallest and largest number of Gauss points per input. A quadrature rule with n points is exact for polynomials
/// up to degree 2n − 1.
const POINTS: std::ops::RangeInclusive<usize> = 4..=24;
/// Number of Gauss points per input in addition to the degree of the expansion. The integral of the square of an
/// expansion of degree p needs about p points. The additional points integrate the exponential density of an input on
/// a logarithmic scale: with 8 points the relative error is below 1e-9 for bounds a factor of 1000 apart.
const BEYOND_DEGREE: usize = 8;

/// Values of an expansion on a tensor grid of Gauss–Legendre points in the coordinates t ∈ [−1, 1], with weights for
/// inputs that are uniform on the box.
pub(crate) struct TensorGrid {
    /// Weights of the quadrature points of each input; the weights of an input sum to 1.
    weights: Vec<Vec<f64>>,
    /// Values, points × outputs; the index of the last input changes fastest.
    values: Vec<f64>,
    outputs: usize,
}

impl TensorGrid {
    /// Evaluates the expansion on a grid of at most `most` points. None if even the coarsest grid over the inputs
    /// that occur in the terms has more points; with [`MAX_POINTS`], this is the case for more than ten such inputs.
    pub(crate) fn new(pce: &DynPce, most: usize) -> Option<Self> {
        let takes_part = |i: usize| pce.terms().iter().any(|(index, _)| index[i] > 0);
        let active: Vec<bool> = (0..pce.inputs().len()).map(takes_part).collect();
        let dimension = u32::try_from(active.iter().filter(|&&a| a).count()).ok()?;
        let fits =
            |n: usize| n.checked_pow(dimension).is_some_and(|evaluations| evaluations <= most);
        let degree =
            pce.terms().iter().flat_map(|(index, _)| index.iter().map(|&k| usize::from(k)));
        let enough = degree.max().unwrap_or(0) + BEYOND_DEGREE;
        let n = POINTS.rev().find(|&n| n <= enough.max(*POINTS.start()) && fits(n))?;
        let (mut nodes, mut weights) = (Vec::new(), Vec::new());
        for (axis, active) in pce.axes().iter().zip(active) {
            let rule = gauss_legendre(if active { n } else { 1 });
            let x: Vec<f64> = rule.iter().map(|(t, _)| axis.at_unit(*t)).collect();
            // the inputs are uniformly distributed in x, so that the density of the coordinate t is
            // proportional to dx/dt
            let w: Vec<f64> =
                rule.iter().zip(&x).map(|((_, w), &x)| w / axis.slope_at(x)).collect();
            let sum: f64 = w.iter().sum();
            weights.push(w.into_iter().map(|w| w / sum).collect());
            nodes.push(x);
        }
        let outputs = pce.outputs().len();
        let mut grid = Self { weights, values: Vec::new(), outputs };
        let mut values = Vec::new();
        grid.visit(|indices| {
            let x: Vec<f64> = indices.iter().zip(&nodes).map(|(&k, nodes)| nodes[k]).collect();
            // no error occurs here, because the points of the grid lie inside the box
            values.extend(pce.value(&x).unwrap_or_else(|_| vec![f64::NAN; outputs]));
        });
        grid.values = values;
        Some(grid)
    }

    pub(crate) fn mean(&self) -> Vec<f64> {
        self.conditional_mean(&[]).1
    }

    /// Returns Var E[f | given inputs] of each output f.
    pub(crate) fn variance_by(&self, given: &[usize]) -> Vec<f64> {
        let (weights, means) = self.conditional_mean(given);
        let (mut mean, mut variance) = (vec![0.0; self.outputs], vec![0.0; self.outputs]);
        for (w, row) in weights.iter().zip(means.chunks(self.outputs)) {
            mean.iter_mut().zip(row).for_each(|(mean, f)| *mean += w * f);
        }
        for (w, row) in weights.iter().zip(means.chunks(self.outputs)) {
            for m in 0..self.outputs {
                variance[m] += w * (row[m] - mean[m]).powi(2);
            }
        }
        variance
    }

    /// Computes E[f | given inputs] of each output f at each point of the grid of the given inputs. Returns the
    /// weights of these points, and the conditional means.
    fn conditional_mean(&self, given: &[usize]) -> (Vec<f64>, Vec<f64>) {
        let size: usize = given.iter().map(|&i| self.weights[i].len()).product();
        let (mut weights, mut means) = (vec![0.0; size], vec![0.0; size * self.outputs]);
        let mut values = self.values.chunks(self.outputs);
        self.visit(|indices| {
            let key = given.iter().fold(0, |key, &i| key * self.weights[i].len() + indices[i]);
            let weight = |i: usize| self.weights[i][indices[i]];
            weights[key] = given.iter().map(|&i| weight(i)).product();
            let others = (0..indices.len()).filter(|i| !given.contains(i));
            let weight: f64 = others.map(weight).product();
            for (m, value) in values.next().unwrap_or(&[]).iter().enumerate() {
                means[key * self.outputs + m] += weight * value;
            }
        });
        (weights, means)
    }

    /// Calls `call` with the indices of every grid point; the index of the last input changes fastest.
    fn visit(&self, mut call: impl FnMut(&[usize])) {
        let mut indices = vec![0; self.weights.len()];
        loop {
            call(&indices);
            let Some(i) =
                (0..indices.len()).rev().find(|&i| indices[i] + 1 < self.weights[i].len())
            else {
                return;
            };
            indices[i] += 1;
            indices[i + 1..].fill(0);
        }
    }
}

/// Gauss–Legendre points in (−1, 1) with weights for the density ½, exact for polynomials of degree 2n − 1.
///
/// The points are the zeros of P_n, computed by Newton's method from the starting values cos(π (i + ¾)/(n +
/// ½)). The weights are 1/((1 − t²) P_n'(t)²) (half of Abramowitz & Stegun 25.4.29).
fn gauss_legendre(n: usize) -> Vec<(f64, f64)> {
    let polynomial = |t: f64| {
        let (mut before, mut now) = (1.0, t);
        for k in 1..n {
            let k = k as f64;
            (before, now) = (now, ((2.0 * k + 1.0) * t * now - k * before) / (k + 1.0));
        }
        (now, n as f64 * (before - t * now) / (1.0 - t * t))
    };
    let point = |i: usize| {
        let mut t = (std::f64::consts::PI * (i as f64 + 0.75) / (n as f64 + 0.5)).cos();
        for _ in 0..8 {
            let (p, slope) = polynomial(t);
            t -= p / slope;
        }
        (t, 1.0 / ((1.0 - t * t) * polynomial(t).1.powi(2)))
    };
    (0..n).map(point).collect()
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    #[test]
    fn the_rule_is_exact_for_its_polynomials() {
        for n in [1, 2, 5, 24] {
            let rule = gauss_legendre(n);
            for power in 0..2 * n as i32 {
                let sum: f64 = rule.iter().map(|(t, w)| w * t.powi(power)).sum();
                let exact = if power % 2 == 0 { 1.0 / f64::from(power + 1) } else { 0.0 };
                assert_relative_eq!(sum, exact, epsilon = 1e-14, max_relative = 1e-13);
            }
        }
    }
}
