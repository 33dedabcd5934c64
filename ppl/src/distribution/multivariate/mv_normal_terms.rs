//! Log densities of the multivariate normal distribution and their partial derivatives: for one datum, and for many
//! data with the same mean and factor.

use super::factor::{Factor, Whole};
use super::size::Size;
use crate::number::partials::Partials;
use crate::number::scalar::Scalar;
use crate::special::HALF_LN_2PI;
use crate::term::accumulator::Accumulator;

/// Partial derivatives of the log density of one datum: −w with respect to x, w with respect to μ, and wᵢ zⱼ −
/// δᵢⱼ/Lᵢᵢ with respect to Lᵢⱼ.
pub(super) struct Gradient<R: Scalar, S: Size> {
    pub(super) x: S::Vector<R>,
    pub(super) mean: S::Vector<R>,
    pub(super) factor: Factor<R, S>,
    /// z = L⁻¹(x − μ).
    pub(super) z: S::Vector<f64>,
    /// w = L⁻ᵀ z.
    pub(super) w: S::Vector<f64>,
    /// Reciprocal diagonal 1/Lᵢᵢ.
    pub(super) inverse: S::Vector<f64>,
}

impl<R: Scalar, S: Size> Partials<R> for Gradient<R, S> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { x, mean, factor, z, w, inverse } = self;
        let mut in_factor = factor.size.filled(0.0);
        for i in 0..factor.size() {
            f(x[i], -w[i]);
            f(mean[i], w[i]);
            for j in 0..=i {
                in_factor[i][j] = w[i] * z[j];
            }
            in_factor[i][i] -= inverse[i];
        }
        factor.spread_rows(in_factor, f);
    }
}

/// Partial derivatives of the log density of many data.
struct Sum<R: Scalar, S: Size> {
    mean: S::Vector<R>,
    in_mean: S::Vector<f64>,
    whole: Whole<R, S>,
}

impl<R: Scalar, S: Size> Partials<R> for Sum<R, S> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { mean, in_mean, whole } = self;
        for i in 0..whole.factor.size() {
            f(mean[i], in_mean[i]);
        }
        whole.spread(f);
    }
}

/// Log determinant Σ ln Lᵢᵢ; NaN if a diagonal entry is negative. The product is computed by a loop: with a call of
/// `Iterator::product`, the compiler does not move the logarithm out of the loop over the data.
#[inline]
pub(super) fn ln_determinant<S: Size>(size: S, l: &S::Matrix<f64>) -> f64 {
    let (mut product, mut positive) = (1.0, true);
    for i in 0..size.get() {
        product *= l[i][i];
        positive &= l[i][i] > 0.0;
    }
    if positive && product.is_normal() {
        return product.ln();
    }
    let mut sum = 0.0;
    for i in 0..size.get() {
        sum += l[i][i].ln();
    }
    sum
}

/// Solves L x = b in place; `inverse` contains the reciprocals of the diagonal.
#[inline]
pub(super) fn solve_lower<S: Size>(
    size: S,
    l: &S::Matrix<f64>,
    inverse: &S::Vector<f64>,
    b: &mut S::Vector<f64>,
) {
    for i in 0..size.get() {
        for j in 0..i {
            b[i] -= l[i][j] * b[j];
        }
        b[i] *= inverse[i];
    }
}

/// Solves Lᵀ x = b in place; `inverse` contains the reciprocals of the diagonal.
#[inline]
pub(super) fn solve_upper<S: Size>(
    size: S,
    l: &S::Matrix<f64>,
    inverse: &S::Vector<f64>,
    b: &mut S::Vector<f64>,
) {
    for i in (0..size.get()).rev() {
        for k in i + 1..size.get() {
            b[i] -= l[k][i] * b[k];
        }
        b[i] *= inverse[i];
    }
}

/// Adds the log density at `x`.
#[inline(always)]
pub(super) fn add_terms<R: Scalar, S: Size>(
    x: &S::Vector<R>,
    mean: S::Vector<R>,
    factor: Factor<R, S>,
    terms: &mut impl Accumulator<R>,
) {
    let (size, l) = (factor.size, factor.values());
    let inverse = size.vector(|i| l[i][i].recip());
    let mut z = size.vector(|i| x[i].value() - mean[i].value());
    solve_lower(size, &l, &inverse, &mut z);
    let mut square = 0.0;
    for i in 0..size.get() {
        square += z[i] * z[i];
    }
    let constant = -HALF_LN_2PI * size.get() as f64;
    let value = constant - 0.5 * square - ln_determinant(size, &l);
    if !R::DIFFERENTIABLE {
        return terms.add_number(R::from(value));
    }
    let mut w = z.clone();
    solve_upper(size, &l, &inverse, &mut w);
    terms.add(value, Gradient { x: x.clone(), mean, factor, z, w, inverse });
}

/// Statistics n, x̄ and the scatter matrix Σ (x − x̄)(x − x̄)ᵀ, row-major. If the data have different lengths, the only
/// statistic is NaN.
pub(super) fn sufficient_statistics(mut data: impl Iterator<Item = Vec<f64>>, out: &mut Vec<f64>) {
    // the sums are over differences from the first datum, which avoids cancellation
    let Some(origin) = data.next() else { return };
    let size = origin.len();
    let (mut n, mut sum, mut scatter) = (1.0, vec![0.0; size], vec![0.0; size * size]);
    for x in data {
        if x.len() != size {
            return out.push(f64::NAN);
        }
        n += 1.0;
        for i in 0..size {
            let d = x[i] - origin[i];
            sum[i] += d;
            for j in 0..size {
                scatter[i * size + j] += d * (x[j] - origin[j]);
            }
        }
    }
    out.push(n);
    out.extend((0..size).map(|i| origin[i] + sum[i] / n));
    out.extend((0..size * size).map(|k| scatter[k] - sum[k / size] * sum[k % size] / n));
}

/// Adds the log density of the data with the given sufficient statistics; −∞ if the size of the data differs from
/// the size of the factor.
#[inline(always)]
pub(super) fn add_statistics_terms<R: Scalar, S: Size>(
    statistics: &[f64],
    mean: S::Vector<R>,
    factor: Factor<R, S>,
    terms: &mut impl Accumulator<R>,
) {
    let Some((&n, statistics)) = statistics.split_first() else { return };
    let (size, k) = (factor.size, factor.size());
    if statistics.len() != k + k * k {
        return terms.add_number(R::from(f64::NEG_INFINITY));
    }
    let (center, scatter) = statistics.split_at(k);
    let l = factor.values();
    let inverse = size.vector(|i| l[i][i].recip());
    let mut z = size.vector(|i| center[i] - mean[i].value());
    solve_lower(size, &l, &inverse, &mut z);
    // A = L⁻¹ S L⁻ᵀ for the scatter matrix S: solve with the rows of the symmetric S, then with the columns of the
    // result
    let (mut half, mut a) = (size.filled(0.0), size.filled(0.0));
    for i in 0..k {
        let mut row = size.vector(|j| scatter[i * k + j]);
        solve_lower(size, &l, &inverse, &mut row);
        for j in 0..k {
            half[i][j] = row[j];
        }
    }
    for i in 0..k {
        let mut row = size.vector(|j| half[j][i]);
        solve_lower(size, &l, &inverse, &mut row);
        for j in 0..k {
            a[i][j] = row[j];
        }
    }
    let mut value = -HALF_LN_2PI * k as f64 * n;
    for i in 0..k {
        value -= 0.5 * (n * z[i] * z[i] + a[i][i]);
    }
    value -= n * ln_determinant(size, &l);
    if !R::DIFFERENTIABLE {
        return terms.add_number(R::from(value));
    }
    // G = L⁻ᵀ (n z zᵀ + A); the partial derivative with respect to L is the lower triangle of G minus n/Lᵢᵢ on the
    // diagonal
    let mut weights = size.filled(0.0);
    for j in 0..k {
        let mut column = size.vector(|i| n * z[i] * z[j] + a[i][j]);
        solve_upper(size, &l, &inverse, &mut column);
        for i in j..k {
            weights[i][j] = column[i];
        }
        weights[j][j] -= n * inverse[j];
    }
    let mut in_mean = z;
    solve_upper(size, &l, &inverse, &mut in_mean);
    for i in 0..k {
        in_mean[i] *= n;
    }
    terms.add(value, Sum { mean, in_mean, whole: Whole { factor, weights } });
}
