//! Evaluation of an expansion and its gradient without allocation.

use crate::legendre::{MAX_ORDER, legendre, norm};

/// Terms of an expansion, arranged for fast evaluation. The kernel uses coordinates t ∈ [−1, 1]^D and plain (not
/// normalised) Legendre polynomials.
///
/// Terms that differ only in the degree of the last input form a row. Evaluation first sums over the degrees of the
/// last input, so that the product over the other inputs is computed once per row instead of once per term.
#[derive(Clone, Debug)]
pub(crate) struct PceKernel<const D: usize, const M: usize> {
    rows: Vec<TermRow<D>>,
    /// Coefficients of degrees 0, 1, … of the last input, row after row.
    coefficients: Vec<[f64; M]>,
    degree: usize,
}

#[derive(Clone, Debug)]
struct TermRow<const D: usize> {
    /// Degrees of all inputs except the last; the entry of the last input is 0.
    degrees: [u8; D],
    /// End of the row's coefficients in `coefficients`.
    end: usize,
}

impl<const D: usize, const M: usize> PceKernel<D, M> {
    /// Arranges terms with orthonormal coefficients; no degree may exceed [`MAX_ORDER`].
    pub(crate) fn new(terms: impl Iterator<Item = ([u8; D], [f64; M])>) -> Self {
        let mut terms: Vec<_> = terms.collect();
        terms.sort_by_key(|(index, _)| *index);
        let (mut rows, mut coefficients) = (Vec::<TermRow<D>>::new(), Vec::new());
        let (mut degree, mut start) = (0, 0);
        for (index, c) in terms {
            let mut degrees = index;
            let last = usize::from(std::mem::take(&mut degrees[D - 1]));
            if rows.last().is_none_or(|row| row.degrees != degrees) {
                start = coefficients.len();
                rows.push(TermRow { degrees, end: start });
            }
            // a sparse expansion may lack some degrees of the last input: their coefficients are
            // zero
            coefficients.resize(start + last, [0.0; M]);
            let scale: f64 = index.iter().map(|&a| norm(a.into())).product();
            coefficients.push(c.map(|c| c * scale));
            if let Some(row) = rows.last_mut() {
                row.end = coefficients.len();
            }
            degree = degree.max(index.iter().map(|&a| usize::from(a)).max().unwrap_or(0));
        }
        Self { rows, coefficients, degree }
    }

    pub(crate) fn value(&self, t: &[f64; D]) -> [f64; M] {
        // the common degrees have separate code, because low degrees need fewer polynomials
        match self.degree {
            0..=3 => self.sum::<4>(t),
            4..=8 => self.sum::<9>(t),
            _ => self.sum::<{ MAX_ORDER + 1 }>(t),
        }
    }

    /// Returns the outputs at t, and their derivatives with respect to t as `[output][input]`.
    // always inlined, because a function call would make the most frequent caller 10 % slower
    #[inline(always)]
    pub(crate) fn value_and_jacobian(&self, t: &[f64; D]) -> ([f64; M], [[f64; D]; M]) {
        match self.degree {
            0..=3 => self.sum_and_jacobian::<4>(t),
            4..=8 => self.sum_and_jacobian::<9>(t),
            _ => self.sum_and_jacobian::<{ MAX_ORDER + 1 }>(t),
        }
    }

    fn sum<const K: usize>(&self, t: &[f64; D]) -> [f64; M] {
        let basis = polynomials::<D, K>(t);
        let mut value = [0.0; M];
        let mut start = 0;
        for row in &self.rows {
            let c = &self.coefficients[start..row.end];
            let mut inner = c[0];
            for k in 1..c.len().min(K) {
                for m in 0..M {
                    inner[m] += c[k][m] * basis[D - 1][k][0];
                }
            }
            start = row.end;
            let weight: f64 =
                (0..D - 1).map(|d| basis[d][usize::from(row.degrees[d])][0]).product();
            for m in 0..M {
                value[m] += weight * inner[m];
            }
        }
        value
    }

    #[inline(always)]
    fn sum_and_jacobian<const K: usize>(&self, t: &[f64; D]) -> ([f64; M], [[f64; D]; M]) {
        let basis = polynomials::<D, K>(t);
        let mut value = [0.0; M];
        let mut jacobian = [[0.0; D]; M];
        let mut start = 0;
        for row in &self.rows {
            // value and derivative of the sum over the last input; P_0 = 1 needs no multiplication
            let c = &self.coefficients[start..row.end];
            let mut inner = c[0].map(|c| [c, 0.0]);
            for k in 1..c.len().min(K) {
                let [p, dp] = basis[D - 1][k];
                for m in 0..M {
                    inner[m][0] += c[k][m] * p;
                    inner[m][1] += c[k][m] * dp;
                }
            }
            start = row.end;
            // the sum over the last input is multiplied by `weight`, the product of the polynomials
            // of the other inputs; `slopes` are the derivatives of this product
            let mut weight = 1.0;
            let mut slopes = [1.0; D];
            for d in 0..D - 1 {
                let [p, dp] = basis[d][usize::from(row.degrees[d])];
                for e in 0..D - 1 {
                    slopes[e] *= if d == e { dp } else { p };
                }
                weight *= p;
            }
            for m in 0..M {
                value[m] += weight * inner[m][0];
                for d in 0..D - 1 {
                    jacobian[m][d] += slopes[d] * inner[m][0];
                }
                jacobian[m][D - 1] += weight * inner[m][1];
            }
        }
        (value, jacobian)
    }
}

/// Evaluates [`legendre`] for every input. The result is computed in place, because `map` would copy the array.
#[inline]
fn polynomials<const D: usize, const K: usize>(t: &[f64; D]) -> [[[f64; 2]; K]; D] {
    let mut basis = [[[0.0; 2]; K]; D];
    for d in 0..D {
        basis[d] = legendre(t[d]);
    }
    basis
}
