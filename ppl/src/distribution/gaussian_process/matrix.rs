//! Dense symmetric positive definite matrices of plain numbers: factorisation, solutions, inverse.
//!
//! All inner loops add a multiple of a row to a row, which the compiler computes in SIMD registers.

/// Factor U of a covariance matrix UᵀU: an upper triangular matrix with positive diagonal.
#[derive(Clone, Debug)]
pub(super) struct Upper {
    size: usize,
    /// Entries, row-major; entries below the diagonal are unspecified.
    entries: Vec<f64>,
}

/// Adds `factor` times `row` to `sum`.
#[inline]
fn add_multiple(sum: &mut [f64], factor: f64, row: &[f64]) {
    for (sum, x) in sum.iter_mut().zip(row) {
        *sum += factor * x;
    }
}

impl Upper {
    /// Factorises the matrix with the given entries on and above the diagonal. Returns `None` if the matrix is not
    /// positive definite.
    pub(super) fn of_covariance(size: usize, entry: impl Fn(usize, usize) -> f64) -> Option<Self> {
        let mut entries = vec![0.0; size * size];
        for i in 0..size {
            for j in i..size {
                entries[i * size + j] = entry(i, j);
            }
        }
        for k in 0..size {
            let (before, after) = entries.split_at_mut((k + 1) * size);
            let row = &mut before[k * size + k..];
            let pivot = row[0];
            if !(pivot > 0.0 && pivot.is_finite()) {
                return None;
            }
            let inverse = pivot.sqrt().recip();
            row.iter_mut().for_each(|x| *x *= inverse);
            for (i, next) in (k + 1..size).zip(after.chunks_exact_mut(size)) {
                let factor = -row[i - k];
                add_multiple(&mut next[i..], factor, &row[i - k..]);
            }
        }
        Some(Self { size, entries })
    }

    /// Returns row `i`, from the diagonal on.
    #[inline]
    fn row(&self, i: usize) -> &[f64] {
        &self.entries[i * self.size + i..(i + 1) * self.size]
    }

    /// Returns Σ ln Uᵢᵢ, which is half of the log determinant of the covariance matrix.
    pub(super) fn half_ln_determinant(&self) -> f64 {
        (0..self.size).map(|i| self.row(i)[0].ln()).sum()
    }

    /// Solves Uᵀ x = b in place.
    pub(super) fn solve_transposed(&self, b: &mut [f64]) {
        for i in 0..self.size {
            let (entry, rest) = b[i..].split_at_mut(1);
            entry[0] /= self.row(i)[0];
            add_multiple(rest, -entry[0], &self.row(i)[1..]);
        }
    }

    /// Solves U x = b in place.
    pub(super) fn solve(&self, b: &mut [f64]) {
        for i in (0..self.size).rev() {
            let (entry, solved) = b[i..].split_at_mut(1);
            let inner: f64 = self.row(i)[1..].iter().zip(&*solved).map(|(u, x)| u * x).sum();
            entry[0] = (entry[0] - inner) / self.row(i)[0];
        }
    }

    /// Product Uᵀ x.
    pub(super) fn transposed_times(&self, x: &[f64]) -> Vec<f64> {
        let mut product = vec![0.0; self.size];
        for (i, &x) in x.iter().enumerate() {
            add_multiple(&mut product[i..], x, self.row(i));
        }
        product
    }

    /// Returns the inverse of the covariance matrix; entry (i, j) with j ≤ i has the index `i * size + j`, and the
    /// other entries are 0.
    pub(super) fn inverse_covariance(&self) -> Vec<f64> {
        let size = self.size;
        // the lower triangular matrix V = U⁻ᵀ, row by row; the inverse is VᵀV
        let mut v = vec![0.0; size * size];
        for i in 0..size {
            let (before, new_row) = v.split_at_mut(i * size);
            let new_row = &mut new_row[..=i];
            new_row[i] = 1.0;
            for (k, row) in before.chunks_exact(size).enumerate() {
                add_multiple(new_row, -self.row(k)[i - k], &row[..=k]);
            }
            let inverse = self.row(i)[0].recip();
            new_row.iter_mut().for_each(|x| *x *= inverse);
        }
        let mut product = vec![0.0; size * size];
        for (k, row) in v.chunks_exact(size).enumerate() {
            for (i, sum) in product.chunks_exact_mut(size).take(k + 1).enumerate() {
                add_multiple(&mut sum[..=i], row[i], &row[..=i]);
            }
        }
        product
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SIZE: usize = 7;

    fn entry(i: usize, j: usize) -> f64 {
        let distance = i as f64 - j as f64;
        (-0.3 * distance * distance).exp() + if i == j { 0.1 + i as f64 } else { 0.0 }
    }

    #[test]
    fn solutions_and_inverse_are_those_of_nalgebra() {
        let factor = Upper::of_covariance(SIZE, entry).unwrap();
        let matrix = nalgebra::DMatrix::from_fn(SIZE, SIZE, entry);
        let inverse = matrix.clone().try_inverse().unwrap();
        let computed = factor.inverse_covariance();
        for i in 0..SIZE {
            for j in 0..=i {
                let error = (computed[i * SIZE + j] - inverse[(i, j)]).abs();
                assert!(error < 1e-13, "({i}, {j}): {error}");
            }
        }
        let b: Vec<f64> = (0..SIZE).map(|i| (1.3 * i as f64).sin()).collect();
        let mut x = b.clone();
        factor.solve_transposed(&mut x);
        let square: f64 = x.iter().map(|x| x * x).sum();
        factor.solve(&mut x);
        let expected = &inverse * nalgebra::DVector::from_vec(b.clone());
        assert!(x.iter().zip(expected.iter()).all(|(a, b)| (a - b).abs() < 1e-13));
        let form: f64 = b.iter().zip(&x).map(|(b, x)| b * x).sum();
        assert!((square - form).abs() < 1e-13);
        let half = 0.5 * matrix.determinant().ln();
        assert!((factor.half_ln_determinant() - half).abs() < 1e-12);
        // solving with Uᵀ undoes the product with Uᵀ
        let mut y = factor.transposed_times(&b);
        factor.solve_transposed(&mut y);
        assert!(y.iter().zip(&b).all(|(a, b)| (a - b).abs() < 1e-13));
    }

    #[test]
    fn indefinite_matrices_have_no_factor() {
        assert!(Upper::of_covariance(2, |i, j| if i == j { 1.0 } else { 2.0 }).is_none());
        assert!(Upper::of_covariance(1, |_, _| f64::NAN).is_none());
    }
}
