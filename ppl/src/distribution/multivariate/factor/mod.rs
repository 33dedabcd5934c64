//! Cholesky factors of correlation and covariance matrices.

mod algebra;
mod angles;
mod partials;

use std::fmt::Debug;

use super::size::{Fixed, Free, MatrixEntry, Size};
use crate::density::DomainError;
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};

pub(super) use angles::Angles;
pub(super) use partials::Whole;

/// A [`Factor`] of a K×K matrix, with K known at compile time.
///
/// [`LkjCholesky`](crate::LkjCholesky) has values of this type, and [`MvNormalCholesky`](crate::MvNormalCholesky) uses
/// it as its scale.
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
pub type CholeskyFactor<R, const K: usize> = Factor<R, Fixed<K>>;

/// A [`Factor`] whose size is known only at run time, for example if a file determines the number of quantities.
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
pub type DynCholeskyFactor<R> = Factor<R, Free>;

/// Cholesky factor: a lower triangular matrix L with positive diagonal, which represents L Lᵀ. The type has the
/// aliases [`CholeskyFactor`] and [`DynCholeskyFactor`]. The method `scale_rows` with standard deviations turns a
/// correlation factor, whose rows have length 1, into a covariance factor.
#[derive(Clone, Debug)]
pub struct Factor<R: MatrixEntry, S: Size> {
    pub(super) size: S,
    /// Entries; with `angles`, the coordinates below the diagonal instead of the entries.
    pub(super) rows: S::Matrix<R>,
    /// Parametrisation of the entries by unconstrained coordinates, which makes derivatives cheaper; `None` if the
    /// factor is stored by its entries, as for data.
    pub(super) angles: Option<Angles<S>>,
    /// Factors by which the stored rows must be multiplied to get the entries; `None` if the rows are not scaled, as
    /// for data.
    pub(super) scale: Option<S::Vector<R>>,
}

impl<R: MatrixEntry, const K: usize> Copy for Factor<R, Fixed<K>> {}

impl<R: Scalar, S: Size> Factor<R, S> {
    /// Creates a factor from rows that are valid by construction.
    #[inline(always)]
    pub(super) fn from_rows(size: S, rows: S::Matrix<R>) -> Self {
        Self { size, rows, angles: None, scale: None }
    }

    /// Creates a factor from a function that returns valid entries on and below the diagonal.
    #[inline]
    pub(super) fn from_fn(size: S, mut entry: impl FnMut(usize, usize) -> R) -> Self {
        let mut rows = size.filled(R::from(0.0));
        for i in 0..size.get() {
            for j in 0..=i {
                rows[i][j] = entry(i, j);
            }
        }
        Self::from_rows(size, rows)
    }

    /// Checks that the diagonal is positive and that all entries are finite.
    pub(super) fn validate(&self, distribution: &'static str) -> Result<(), DomainError> {
        for i in 0..self.size() {
            let name = format_args!("diagonal entry {i} of the Cholesky factor");
            DomainError::require_positive(distribution, name, self.value(i, i))?;
            for j in 0..i {
                let name = format_args!("entry ({i}, {j}) of the Cholesky factor");
                DomainError::require_finite(distribution, name, self.value(i, j))?;
            }
        }
        Ok(())
    }

    /// Number of rows.
    #[inline(always)]
    pub fn size(&self) -> usize {
        self.size.get()
    }

    /// Entry (i, j); zero above the diagonal.
    ///
    /// # Panics
    /// If `i` or `j` is not below [`size`](Self::size).
    #[inline(always)]
    pub fn get(&self, i: usize, j: usize) -> R {
        let entry = self.rows[i][j];
        if j > i {
            return entry;
        }
        match (&self.angles, &self.scale) {
            (Some(angles), _) => {
                R::gather(self.value(i, j), partials::One { factor: self, angles, i, j })
            }
            (None, Some(scale)) => entry * scale[i],
            (None, None) => entry,
        }
    }

    /// All rows, with zeros above the diagonal.
    #[inline(always)]
    pub fn rows(&self) -> S::Matrix<R> {
        let mut rows = self.rows.clone();
        if self.angles.is_some() || self.scale.is_some() {
            for i in 0..self.size() {
                for j in 0..=i {
                    rows[i][j] = self.get(i, j);
                }
            }
        }
        rows
    }

    /// Product diag(scale) · L; `scale` must have one number per row.
    #[inline(always)]
    fn scaled(&self, scale: S::Vector<R>) -> Self {
        let unscaled = match self.scale {
            None => self.clone(),
            Some(_) => Self::from_rows(self.size, self.rows()),
        };
        let scaled = Self { scale: Some(scale), ..unscaled };
        if R::DIFFERENTIABLE { scaled } else { Self::from_rows(scaled.size, scaled.rows()) }
    }

    /// Values of all entries, without derivatives.
    #[inline(always)]
    pub(super) fn values(&self) -> S::Matrix<f64> {
        let mut values = self.size.filled(0.0);
        for i in 0..self.size() {
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

    /// Value of an entry before the multiplication by its scale.
    #[inline(always)]
    fn unscaled_value(&self, i: usize, j: usize) -> f64 {
        match &self.angles {
            Some(angles) => angles.entries[i][j],
            None => self.rows[i][j].value(),
        }
    }
}

impl<T: MatrixEntry, S: Size> Factor<T, S> {
    /// Converts the factor to the scalar type `R`. If derivatives are needed, angles and scale are converted
    /// separately and not multiplied out.
    #[inline(always)]
    pub(super) fn lifted<R: Scalar>(&self) -> Factor<R, S>
    where
        T: Datum<R>,
    {
        let size = self.size;
        let mut rows = size.filled(R::from(0.0));
        for i in 0..size.get() {
            for j in 0..=i {
                rows[i][j] = self.rows[i][j].lift();
            }
        }
        if T::CONSTANT || !R::DIFFERENTIABLE {
            // return early, so that the code for derivatives is not compiled for densities over `f64`
            return Factor::from_rows(size, rows);
        }
        let scale = self.scale.as_ref().map(|scale| size.vector(|i| scale[i].lift()));
        Factor { size, rows, angles: self.angles.clone(), scale }
    }
}

impl<R: Scalar, T: Datum<R> + MatrixEntry, S: Size> Datum<Factor<R, S>> for Factor<T, S> {
    fn lift(&self) -> Factor<R, S> {
        let factor = self.lifted();
        Factor::from_rows(self.size, factor.rows())
    }
}

impl<R: Scalar, S: Size> Recordable for Factor<R, S> {
    fn shape(&self) -> Vec<usize> {
        vec![self.size(); 2]
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        self.rows().flatten(out);
    }

    fn overwrite(&mut self, elements: &mut dyn Iterator<Item = f64>) -> bool {
        let mut rows = self.size.filled(R::from(0.0));
        for i in 0..self.size() {
            for j in 0..self.size() {
                let Some(number) = elements.next() else { return false };
                rows[i][j] = R::from(number);
            }
        }
        *self = Self::from_rows(self.size, rows);
        true
    }
}
