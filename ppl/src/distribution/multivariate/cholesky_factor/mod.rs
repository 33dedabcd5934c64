//! Cholesky factors of correlation and covariance matrices.

mod algebra;
mod angles;
mod by_reference;
mod partials;

use crate::density::DomainError;
use crate::record::{Datum, Record};
use crate::scalar::Scalar;

pub(crate) use angles::Angles;
pub(crate) use by_reference::by_reference;
use partials::Entry;
pub(super) use partials::Whole;

/// A lower triangular K×K matrix L with positive diagonal, the factor of L Lᵀ.
///
/// The value type of [`LkjCholesky`](super::LkjCholesky) and the scale of
/// [`MvNormalCholesky`](super::MvNormalCholesky). A correlation factor (rows of length 1) becomes
/// a covariance factor by [`scale_rows`](Self::scale_rows) with standard deviations.
///
/// # Example
/// ```
/// use ppl::CholeskyFactor;
///
/// let factor = CholeskyFactor::new([[1.0, 0.0], [0.6, 0.8]])?.scale_rows([2.0, 5.0]);
/// assert_eq!(factor.covariance(), [[4.0, 6.0], [6.0, 25.0]]);
/// assert_eq!(factor.solve_lower([2.0, 7.0]), [1.0, 1.0]);
/// # Ok::<(), ppl::DomainError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CholeskyFactor<R, const K: usize> {
    /// Entries, or below the diagonal the coordinates of `angles`.
    rows: [[R; K]; K],
    /// What the entries are functions of, where that makes derivatives cheaper: never for data.
    angles: Option<Angles<K>>,
    /// What the rows have still to be multiplied by, under the same condition.
    scale: Option<[R; K]>,
}

impl<R: Scalar, const K: usize> CholeskyFactor<R, K> {
    /// From rows; what stands above the diagonal must be zero.
    ///
    /// # Errors
    /// [`DomainError`] for a nonzero entry above the diagonal, or a diagonal that is not
    /// positive and finite.
    pub fn new(rows: [[R; K]; K]) -> Result<Self, DomainError> {
        for (i, row) in rows.iter().enumerate() {
            for (j, entry) in row.iter().enumerate().skip(i + 1) {
                let v = entry.value();
                let name = format_args!("entry ({i}, {j}) above the diagonal");
                DomainError::require(v == 0.0, "CholeskyFactor", name, "zero", v)?;
            }
        }
        let factor = Self::from_rows(rows);
        factor.validate("CholeskyFactor")?;
        Ok(factor)
    }

    pub(super) fn validate(&self, distribution: &'static str) -> Result<(), DomainError> {
        for (i, row) in self.values().iter().enumerate() {
            let name = format_args!("diagonal entry {i} of the Cholesky factor");
            DomainError::require_positive(distribution, name, row[i])?;
            for (j, entry) in row.iter().enumerate().take(i) {
                let name = format_args!("entry ({i}, {j}) of the Cholesky factor");
                DomainError::require_finite(distribution, name, *entry)?;
            }
        }
        Ok(())
    }

    /// Entry (i, j), zero above the diagonal.
    ///
    /// # Panics
    /// If `i` or `j` is not below K.
    #[inline]
    pub fn get(&self, i: usize, j: usize) -> R {
        self.entry(i, j)
    }

    #[inline(always)]
    fn entry(&self, i: usize, j: usize) -> R {
        let entry = self.rows[i][j];
        if j > i {
            return entry;
        }
        match (&self.angles, &self.scale) {
            (Some(angles), _) => R::gather(self.value(i, j), Entry { factor: self, angles, i, j }),
            (None, Some(scale)) => entry * scale[i],
            (None, None) => entry,
        }
    }

    /// Rows, with zeros above the diagonal.
    #[inline(always)]
    pub fn rows(&self) -> [[R; K]; K] {
        let mut rows = self.rows;
        if self.angles.is_some() || self.scale.is_some() {
            for i in 0..K {
                for j in 0..=i {
                    rows[i][j] = self.entry(i, j);
                }
            }
        }
        rows
    }

    /// diag(scale) · L.
    #[inline(always)]
    pub fn scale_rows(&self, scale: impl Datum<[R; K]>) -> Self {
        let unscaled = match self.scale {
            None => *self,
            Some(_) => Self::from_rows(self.rows()),
        };
        let scaled = Self { scale: Some(scale.lift()), ..unscaled };
        if R::DIFFERENTIABLE { scaled } else { Self::from_rows(scaled.rows()) }
    }

    /// Plain numbers.
    #[inline(always)]
    pub(super) fn values(&self) -> [[f64; K]; K] {
        let mut values = [[0.0; K]; K];
        for i in 0..K {
            for j in 0..=i {
                values[i][j] = self.value(i, j);
            }
        }
        values
    }

    #[inline(always)]
    fn value(&self, i: usize, j: usize) -> f64 {
        let scale = self.scale.as_ref().map_or(1.0, |scale| scale[i].value());
        scale * self.unscaled_value(i, j)
    }

    /// From entries on and below the diagonal that are right by construction.
    #[inline]
    pub(crate) fn from_fn(mut entry: impl FnMut(usize, usize) -> R) -> Self {
        let mut rows = [[R::from(0.0); K]; K];
        for (i, row) in rows.iter_mut().enumerate() {
            row[..=i].iter_mut().enumerate().for_each(|(j, x)| *x = entry(i, j));
        }
        Self::from_rows(rows)
    }

    /// From rows that are right by construction.
    #[inline(always)]
    pub(crate) fn from_rows(rows: [[R; K]; K]) -> Self {
        Self { rows, angles: None, scale: None }
    }

    /// From the numbers below the diagonal that the angles are functions of.
    #[inline(always)]
    pub(super) fn from_angles(rows: [[R; K]; K], angles: Angles<K>) -> Self {
        Self { rows, angles: Some(angles), scale: None }
    }
}

impl<T, const K: usize> CholeskyFactor<T, K> {
    /// In numbers of another kind, with the scale still apart.
    #[inline(always)]
    pub(super) fn lifted<R: Scalar>(&self) -> CholeskyFactor<R, K>
    where
        T: Datum<R>,
    {
        if T::CONSTANT || !R::DIFFERENTIABLE {
            // said once more, so that no density of plain numbers asks for the rest
            return CholeskyFactor { rows: self.rows.lift(), angles: None, scale: None };
        }
        let scale = self.scale.as_ref().map(Datum::lift);
        CholeskyFactor { rows: self.rows.lift(), angles: self.angles, scale }
    }
}

impl<R: Scalar, T: Datum<R>, const K: usize> Datum<CholeskyFactor<R, K>> for CholeskyFactor<T, K> {
    fn lift(&self) -> CholeskyFactor<R, K> {
        CholeskyFactor::from_rows(self.lifted().rows())
    }
}

impl<R: Record + Scalar, const K: usize> Record for CholeskyFactor<R, K> {
    fn shape(&self) -> Vec<usize> {
        vec![K, K]
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        self.rows().flatten(out);
    }
}
