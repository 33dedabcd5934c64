//! Cholesky factors whose size comes from the data.

use crate::datum::{Datum, Recordable};
use crate::density::DomainError;
use crate::scalar::Scalar;

/// A [`CholeskyFactor`](super::CholeskyFactor) of K×K numbers where K is known at run time only: as
/// the number of quantities that a file names.
///
/// The value type of [`DynLkjCholesky`](super::DynLkjCholesky) and, behind a reference or not, the
/// scale of [`MvNormalCholesky`](super::MvNormalCholesky). Every entry is a number of its own, so
/// that for a small K known at compile time the other one is some times faster.
///
/// # Example
/// ```
/// use ppl::DynCholeskyFactor;
///
/// let factor = DynCholeskyFactor::new(&[vec![1.0], vec![0.6, 0.8]])?.scale_rows(&[2.0, 5.0])?;
/// assert_eq!(factor.covariance(), [[4.0, 6.0], [6.0, 25.0]]);
/// assert_eq!(factor.solve_lower(&[2.0, 7.0])?, [1.0, 1.0]);
/// # Ok::<(), ppl::DomainError>(())
/// ```
#[derive(Clone, Debug, PartialEq)]
pub struct DynCholeskyFactor<R> {
    size: usize,
    /// Rows up to the diagonal, one after the other.
    entries: Vec<R>,
}

/// Where row i begins.
fn start(i: usize) -> usize {
    i * (i + 1) / 2
}

impl<R> DynCholeskyFactor<R> {
    /// K.
    pub fn size(&self) -> usize {
        self.size
    }

    /// Row `i` up to the diagonal, of i + 1 numbers.
    ///
    /// # Panics
    /// If `i` is not below K.
    #[inline]
    pub fn row(&self, i: usize) -> &[R] {
        &self.entries[start(i)..start(i + 1)]
    }

    /// From entries on and below the diagonal, row by row, that are right by construction.
    pub(super) fn from_fn(size: usize, mut entry: impl FnMut(usize, usize) -> R) -> Self {
        let mut entries = Vec::with_capacity(start(size));
        for i in 0..size {
            for j in 0..=i {
                entries.push(entry(i, j));
            }
        }
        Self { size, entries }
    }
}

impl<R: Scalar> DynCholeskyFactor<R> {
    /// From rows, each at least up to the diagonal; what stands above it must be zero.
    ///
    /// # Errors
    /// [`DomainError`] for a row that is too short, a nonzero entry above the diagonal, or a diagonal
    /// that is not positive and finite.
    pub fn new(rows: &[Vec<R>]) -> Result<Self, DomainError> {
        const NAME: &str = "DynCholeskyFactor";
        for (i, row) in rows.iter().enumerate() {
            let holds = (i + 1..=rows.len()).contains(&row.len());
            let name = format_args!("length of row {i}");
            let requirement = format_args!("between {} and {}", i + 1, rows.len());
            DomainError::require(holds, NAME, name, requirement, row.len() as f64)?;
            for (j, entry) in row.iter().enumerate().skip(i + 1) {
                let v = entry.value();
                let name = format_args!("entry ({i}, {j}) above the diagonal");
                DomainError::require(v == 0.0, NAME, name, "zero", v)?;
            }
        }
        let factor = Self::from_fn(rows.len(), |i, j| rows[i][j]);
        factor.validate(NAME)?;
        Ok(factor)
    }

    pub(super) fn validate(&self, distribution: &'static str) -> Result<(), DomainError> {
        for i in 0..self.size {
            let (entries, diagonal) = self.row(i).split_at(i);
            let name = format_args!("diagonal entry {i} of the Cholesky factor");
            DomainError::require_positive(distribution, name, diagonal[0].value())?;
            for (j, entry) in entries.iter().enumerate() {
                let name = format_args!("entry ({i}, {j}) of the Cholesky factor");
                DomainError::require_finite(distribution, name, entry.value())?;
            }
        }
        Ok(())
    }

    /// Entry (i, j), zero above the diagonal.
    ///
    /// # Panics
    /// If `i` is not below K.
    #[inline]
    pub fn get(&self, i: usize, j: usize) -> R {
        self.row(i).get(j).copied().unwrap_or(R::from(0.0))
    }

    /// Rows, with zeros above the diagonal.
    pub fn rows(&self) -> Vec<Vec<R>> {
        (0..self.size).map(|i| (0..self.size).map(|j| self.get(i, j)).collect()).collect()
    }

    /// Plain numbers, rows up to the diagonal one after the other.
    pub(super) fn values(&self) -> DynCholeskyFactor<f64> {
        let entries = self.entries.iter().map(|entry| entry.value()).collect();
        DynCholeskyFactor { size: self.size, entries }
    }

    fn require_length(&self, what: &'static str, length: usize) -> Result<(), DomainError> {
        let requirement = format_args!("that of the rows, {}", self.size);
        let holds = length == self.size;
        DomainError::require(holds, "DynCholeskyFactor", what, requirement, length as f64)
    }

    /// diag(scale) · L.
    ///
    /// # Errors
    /// [`DomainError`] unless there are as many scales as rows.
    pub fn scale_rows(&self, scale: &[impl Datum<R>]) -> Result<Self, DomainError> {
        let scale: Vec<R> = scale.iter().map(Datum::lift).collect();
        self.require_length("number of scales", scale.len())?;
        Ok(Self::from_fn(self.size, |i, j| self.row(i)[j] * scale[i]))
    }

    /// The covariance matrix L Lᵀ.
    pub fn covariance(&self) -> Vec<Vec<R>> {
        let entry = |i: usize, j: usize| {
            let pairs = || self.row(i).iter().copied().zip(self.row(j).iter().copied());
            let value = pairs().map(|(a, b)| a.value() * b.value()).sum();
            R::fuse_iter(value, pairs().flat_map(|(a, b)| [(a, b.value()), (b, a.value())]))
        };
        let mut matrix = vec![vec![R::from(0.0); self.size]; self.size];
        for i in 0..self.size {
            for j in 0..=i {
                matrix[i][j] = entry(i, j);
                matrix[j][i] = matrix[i][j];
            }
        }
        matrix
    }

    /// The correlation matrix: L Lᵀ scaled to a unit diagonal.
    pub fn correlation(&self) -> Vec<Vec<R>> {
        let length = |i| self.row(i).iter().map(|entry| entry.square()).sum::<R>().sqrt();
        let lengths: Vec<R> = (0..self.size).map(length).collect();
        let mut matrix = Self::from_fn(self.size, |i, j| self.row(i)[j] / lengths[i]).covariance();
        (0..self.size).for_each(|i| matrix[i][i] = R::from(1.0));
        matrix
    }

    /// The x with L x = b.
    ///
    /// # Errors
    /// [`DomainError`] unless b has as many numbers as there are rows.
    pub fn solve_lower(&self, b: &[impl Datum<R>]) -> Result<Vec<R>, DomainError> {
        let mut x: Vec<R> = b.iter().map(Datum::lift).collect();
        self.require_length("length of b", x.len())?;
        for i in 0..self.size {
            let (entries, diagonal) = self.row(i).split_at(i);
            let (solved, rest) = x.split_at_mut(i);
            let inner: R = entries.iter().zip(solved).map(|(l, x)| *l * *x).sum();
            rest[0] = (rest[0] - inner) / diagonal[0];
        }
        Ok(x)
    }

    /// L x.
    ///
    /// # Errors
    /// [`DomainError`] unless x has as many numbers as there are rows.
    pub fn times(&self, x: &[impl Datum<R>]) -> Result<Vec<R>, DomainError> {
        let x: Vec<R> = x.iter().map(Datum::lift).collect();
        self.require_length("length of x", x.len())?;
        let product = |i| self.row(i).iter().zip(&x).map(|(l, x)| *l * *x).sum();
        Ok((0..self.size).map(product).collect())
    }
}

impl<R: Scalar, T: Datum<R>> Datum<DynCholeskyFactor<R>> for DynCholeskyFactor<T> {
    fn lift(&self) -> DynCholeskyFactor<R> {
        let entries = self.entries.iter().map(Datum::lift).collect();
        DynCholeskyFactor { size: self.size, entries }
    }
}

impl<R: Recordable + Scalar> Recordable for DynCholeskyFactor<R> {
    fn shape(&self) -> Vec<usize> {
        vec![self.size; 2]
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        self.rows().flatten(out);
    }
}
