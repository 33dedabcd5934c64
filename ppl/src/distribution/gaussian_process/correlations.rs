//! Correlations between the points of a Gaussian process, and the derivatives of its density with respect to the
//! parameters of the covariance.

use super::covariance::Covariance;
use super::matrix::Upper;
use crate::distribution::glm::Design;

/// Returns the squared distance u² = Σ (Δ_d/ℓ_d)² of two points. `weights` contains 1/ℓ² for all
/// columns of the points, or 1/ℓ_d² for each column.
#[inline]
pub(super) fn square_distance(a: &[f64], b: &[f64], weights: &[f64]) -> f64 {
    let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
    match weights {
        [weight] => weight * squares.sum::<f64>(),
        weights => squares.zip(weights).map(|(square, weight)| weight * square).sum(),
    }
}

/// Correlations ρ of all pairs of points (the covariances divided by a²), and the derivatives of
/// these correlations.
pub(super) struct Correlations {
    size: usize,
    /// Correlation ρ(uᵢⱼ) of points i and j ≤ i, at the index `i (i + 1)/2 + j`.
    values: Vec<f64>,
    /// Derivative −ρ′(uᵢⱼ)/uᵢⱼ of the correlation of points i and j, at the indices of `values`.
    slopes: Vec<f64>,
}

impl Correlations {
    pub(super) fn new(points: impl Design, covariance: &impl Covariance, weights: &[f64]) -> Self {
        let size = points.size();
        let pairs = size * (size + 1) / 2;
        let (mut values, mut slopes) = (Vec::with_capacity(pairs), Vec::with_capacity(pairs));
        for i in 0..size {
            for j in 0..=i {
                let square = square_distance(points.row(i), points.row(j), weights);
                let (value, slope) = covariance.correlation(square);
                values.push(value);
                slopes.push(slope);
            }
        }
        Self { size, values, slopes }
    }

    #[inline]
    fn index(i: usize, j: usize) -> usize {
        i * (i + 1) / 2 + j
    }

    /// Returns the factor of the covariance matrix; `None` if the matrix is not positive definite.
    pub(super) fn factor(&self, amplitude: f64, noise: f64) -> Option<Upper> {
        let (scale, nugget) = (amplitude * amplitude, noise * noise);
        Upper::of_covariance(self.size, |i, j| {
            let value = scale * self.values[Self::index(j, i)];
            if i == j { value + nugget } else { value }
        })
    }
}

/// Partial derivatives of the log density with respect to the entries of the covariance matrix: with α = C⁻¹ (x − m),
/// the derivative of the log density along a change dC is ½ Σᵢⱼ (αᵢ αⱼ − C⁻¹ᵢⱼ) dCᵢⱼ.
pub(super) struct InCovariance {
    /// Entries αᵢ αⱼ − C⁻¹ᵢⱼ for j ≤ i, at the index `i * size + j`.
    entries: Vec<f64>,
    size: usize,
}

impl InCovariance {
    pub(super) fn new(factor: &Upper, alpha: &[f64]) -> Self {
        let (size, mut entries) = (alpha.len(), factor.inverse_covariance());
        for (i, row) in entries.chunks_exact_mut(size.max(1)).enumerate() {
            for (entry, other) in row[..=i].iter_mut().zip(alpha) {
                *entry = alpha[i] * other - *entry;
            }
        }
        Self { entries, size }
    }

    /// Returns the derivatives of the log density with respect to the amplitude, the lengths and
    /// the noise.
    pub(super) fn slopes(
        &self,
        points: impl Design,
        correlations: &Correlations,
        amplitude: f64,
        noise: f64,
        weights: &[f64],
    ) -> Vec<f64> {
        let (mut in_scale, mut in_nugget) = (0.0, 0.0);
        // derivatives with respect to the weights 1/ℓ², without the factor a²
        let mut in_weights = vec![0.0; weights.len()];
        for i in 0..self.size {
            for j in 0..i {
                // the entries (i, j) and (j, i) are equal
                let (entry, at) = (self.entries[i * self.size + j], Correlations::index(i, j));
                in_scale += entry * correlations.values[at];
                // the derivatives with respect to the weights 1/ℓ² follow from dρ = ρ′ du and u du
                // = ½ Σ Δ² d(1/ℓ²)
                let slope = -0.5 * entry * correlations.slopes[at];
                let (a, b) = (points.row(i), points.row(j));
                let squares = a.iter().zip(b).map(|(a, b)| (a - b) * (a - b));
                match &mut in_weights[..] {
                    [all] => *all += slope * squares.sum::<f64>(),
                    each => each.iter_mut().zip(squares).for_each(|(sum, x)| *sum += slope * x),
                }
            }
            let half = 0.5 * self.entries[i * self.size + i];
            in_scale += half * correlations.values[Correlations::index(i, i)];
            in_nugget += half;
        }
        // d(1/ℓ²) = −2/ℓ³ dℓ
        let of_lengths = in_weights
            .iter()
            .zip(weights)
            .map(|(slope, weight)| -2.0 * amplitude * amplitude * slope * weight * weight.sqrt());
        let of_amplitude = std::iter::once(2.0 * amplitude * in_scale);
        of_amplitude.chain(of_lengths).chain([2.0 * noise * in_nugget]).collect()
    }
}
