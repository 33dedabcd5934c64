//! Products of factors, and with vectors.

use super::factor::{CholeskyFactor, Row};
use crate::datum::Datum;
use crate::scalar::Scalar;

impl<R: Scalar, const K: usize> CholeskyFactor<R, K> {
    /// The covariance matrix L Lᵀ.
    pub fn covariance(&self) -> [[R; K]; K] {
        let rows = self.rows();
        let entry = |i: usize, j: usize| {
            let pairs = || (0..=i.min(j)).map(|k| (rows[i][k], rows[j][k]));
            let value = pairs().map(|(a, b)| a.value() * b.value()).sum();
            let partials = pairs().flat_map(|(a, b)| [(a, b.value()), (b, a.value())]);
            R::fuse_iter(value, partials)
        };
        let mut matrix = [[R::from(0.0); K]; K];
        for i in 0..K {
            for j in 0..=i {
                matrix[i][j] = entry(i, j);
                matrix[j][i] = matrix[i][j];
            }
        }
        matrix
    }

    /// The correlation matrix: L Lᵀ scaled to a unit diagonal.
    pub fn correlation(&self) -> [[R; K]; K] {
        // rows of other lengths have the same correlations
        let mut unit = Self::from_rows(Self { scale: None, ..*self }.rows());
        for (i, row) in unit.rows.iter_mut().enumerate() {
            let square: R = row[..=i].iter().map(|entry| entry.square()).sum();
            let length = square.sqrt();
            row[..=i].iter_mut().for_each(|entry| *entry /= length);
        }
        let mut matrix = unit.covariance();
        (0..K).for_each(|i| matrix[i][i] = R::from(1.0));
        matrix
    }

    /// The x with L x = b.
    pub fn solve_lower(&self, b: impl Datum<[R; K]>) -> [R; K] {
        let (l, mut x) = (self.values(), b.lift());
        for i in 0..K {
            let inner: f64 = (0..i).map(|j| l[i][j] * x[j].value()).sum();
            let inverse = l[i][i].recip();
            let value = (x[i].value() - inner) * inverse;
            let mut in_row = x.map(|x| -x.value() * inverse);
            in_row[i] = -value * inverse;
            let in_x = l[i].map(|l| -l * inverse);
            let row = Row { factor: self, i, in_row, x: &x[..i], in_x, start: (x[i], inverse) };
            x[i] = R::gather(value, row);
        }
        x
    }

    /// L x.
    pub fn times(&self, x: impl Datum<[R; K]>) -> [R; K] {
        self.times_and(&x.lift(), &[R::from(0.0); K])
    }

    /// L x + b.
    #[inline]
    pub(in crate::distribution) fn times_and(&self, x: &[R; K], b: &[R; K]) -> [R; K] {
        let (l, in_row) = (self.values(), x.map(Scalar::value));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * in_row[j]).sum();
            let (x, start) = (&x[..=i], (b[i], 1.0));
            let row = Row { factor: self, i, in_row, x, in_x: l[i], start };
            R::gather(b[i].value() + inner, row)
        })
    }
}
