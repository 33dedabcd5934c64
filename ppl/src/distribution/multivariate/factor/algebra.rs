//! Algebra of Cholesky factors: covariance matrices, products with vectors, solutions of linear systems, and
//! factorisation.

use super::partials::Row;
use super::{CholeskyFactor, DynCholeskyFactor, Factor};
use crate::density::DomainError;
use crate::distribution::multivariate::size::{Fixed, Free, Size};
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;

impl<R: Scalar, S: Size> Factor<R, S> {
    /// Covariance matrix L Lᵀ.
    pub fn covariance(&self) -> S::Matrix<R> {
        let rows = self.rows();
        let entry = |i: usize, j: usize| {
            let pairs = || (0..=i.min(j)).map(|k| (rows[i][k], rows[j][k]));
            let value = pairs().map(|(a, b)| a.value() * b.value()).sum();
            let partials = pairs().flat_map(|(a, b)| [(a, b.value()), (b, a.value())]);
            R::fuse_iter(value, partials)
        };
        let mut matrix = self.size.filled(R::from(0.0));
        for i in 0..self.size() {
            for j in 0..=i {
                matrix[i][j] = entry(i, j);
                matrix[j][i] = matrix[i][j];
            }
        }
        matrix
    }

    /// Correlation matrix: L Lᵀ, scaled to a unit diagonal.
    pub fn correlation(&self) -> S::Matrix<R> {
        // scaling of rows does not change the correlations
        let mut rows = Self { scale: None, ..self.clone() }.rows();
        for i in 0..self.size() {
            let row = &mut rows[i];
            let square: R = (0..=i).map(|j| row[j].square()).sum();
            let length = square.sqrt();
            (0..=i).for_each(|j| row[j] /= length);
        }
        let mut matrix = Self::from_rows(self.size, rows).covariance();
        (0..self.size()).for_each(|i| matrix[i][i] = R::from(1.0));
        matrix
    }

    /// Solution x of L x = b.
    fn solved(&self, mut x: S::Vector<R>) -> S::Vector<R> {
        let l = self.values();
        for i in 0..self.size() {
            let inner: f64 = (0..i).map(|j| l[i][j] * x[j].value()).sum();
            let inverse = l[i][i].recip();
            let value = (x[i].value() - inner) * inverse;
            let mut in_row = self.size.vector(|j| -x[j].value() * inverse);
            in_row[i] = -value * inverse;
            let in_x = self.size.vector(|j| -l[i][j] * inverse);
            let (start, (x_before, in_x)) = ((x[i], inverse), (&x.as_ref()[..i], in_x.as_ref()));
            let row = Row { factor: self, i, in_row, x: x_before, in_x, start };
            x[i] = R::gather(value, row);
        }
        x
    }

    /// Computes the factor of the covariance matrix with the given entries on and below the diagonal.
    fn factorised(
        name: &'static str,
        size: S,
        entry: impl Fn(usize, usize) -> R,
    ) -> Result<Self, DomainError> {
        let mut rows = size.filled(R::from(0.0));
        for i in 0..size.get() {
            for j in 0..=i {
                let pairs = || (0..j).map(|k| (rows[i][k], rows[j][k]));
                let inner: f64 = pairs().map(|(a, b)| a.value() * b.value()).sum();
                let partials = pairs().flat_map(|(a, b)| [(a, -b.value()), (b, -a.value())]);
                let value = entry(i, j).value() - inner;
                if i == j {
                    require_pivot(name, i, value)?;
                }
                let rest = R::fuse_iter(value, partials.chain([(entry(i, j), 1.0)]));
                let reduced = if j < i { rest / rows[j][j] } else { rest.sqrt() };
                rows[i][j] = reduced;
            }
        }
        Ok(Self::from_rows(size, rows))
    }

    /// Product L x + b.
    #[inline]
    fn product(&self, x: &S::Vector<R>, b: &S::Vector<R>) -> S::Vector<R> {
        let (l, x_values) = (self.values(), self.size.vector(|j| x[j].value()));
        self.size.vector(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * x_values[j]).sum();
            let (x, in_x, start) = (&x.as_ref()[..=i], l[i].as_ref(), (b[i], 1.0));
            let row = Row { factor: self, i, in_row: x_values.clone(), x, in_x, start };
            R::gather(b[i].value() + inner, row)
        })
    }
}

impl<R: Scalar, const K: usize> CholeskyFactor<R, K> {
    /// Creates a factor from its rows; the entries above the diagonal must be zero.
    ///
    /// # Errors
    /// [`DomainError`] if an entry above the diagonal is nonzero, or if a diagonal entry is not positive and finite.
    pub fn new(rows: [[R; K]; K]) -> Result<Self, DomainError> {
        require_zeros("CholeskyFactor", &rows)?;
        let factor = Self::from_rows(Fixed, rows);
        factor.validate("CholeskyFactor")?;
        Ok(factor)
    }

    /// Computes the Cholesky factor of a covariance matrix, whose entries can depend on unknowns. The entries above the
    /// diagonal are not read.
    ///
    /// # Errors
    /// [`DomainError`] if the matrix is not positive definite.
    ///
    /// # Example
    /// ```
    /// use ppl::CholeskyFactor;
    ///
    /// let factor = CholeskyFactor::of_covariance([[4.0, 6.0], [6.0, 25.0]])?;
    /// assert_eq!(factor.rows(), [[2.0, 0.0], [3.0, 4.0]]);
    /// assert!(CholeskyFactor::of_covariance([[1.0, 2.0], [2.0, 1.0]]).is_err());
    /// # Ok::<(), ppl::DomainError>(())
    /// ```
    pub fn of_covariance(matrix: [[R; K]; K]) -> Result<Self, DomainError> {
        Self::factorised("CholeskyFactor", Fixed, |i, j| matrix[i][j])
    }

    /// Product diag(scale) · L.
    #[inline(always)]
    pub fn scale_rows(&self, scale: impl Datum<[R; K]>) -> Self {
        self.scaled(scale.lift())
    }

    /// Solution x of L x = b.
    pub fn solve_lower(&self, b: impl Datum<[R; K]>) -> [R; K] {
        self.solved(b.lift())
    }

    /// Product L x.
    pub fn times(&self, x: impl Datum<[R; K]>) -> [R; K] {
        self.product(&x.lift(), &[R::from(0.0); K])
    }

    /// Product L x + b.
    #[inline]
    pub(in crate::distribution) fn times_and(&self, x: &[R; K], b: &[R; K]) -> [R; K] {
        self.product(x, b)
    }
}

impl<R: Scalar> DynCholeskyFactor<R> {
    /// Creates a factor from its rows. Each row must reach at least the diagonal, and entries above the diagonal must
    /// be zero.
    ///
    /// # Errors
    /// [`DomainError`] if a row is too short or too long, if an entry above the diagonal is nonzero, or if a diagonal
    /// entry is not positive and finite.
    pub fn new(rows: &[Vec<R>]) -> Result<Self, DomainError> {
        let size = rows.len();
        for (i, row) in rows.iter().enumerate() {
            let holds = (i + 1..=size).contains(&row.len());
            let (needed, length) = (i + 1, row.len() as f64);
            let requirement = format_args!("between {needed} and {size}");
            let name = format_args!("length of row {i}");
            DomainError::require(holds, NAME, name, requirement, length)?;
        }
        require_zeros(NAME, rows)?;
        let factor = Self::from_fn(Free(size), |i, j| rows[i][j]);
        factor.validate(NAME)?;
        Ok(factor)
    }

    /// Computes the Cholesky factor of a covariance matrix. The entries of the matrix can depend on unknowns. The entries
    /// above the diagonal are not read. For a Gaussian process with a known form of covariance,
    /// [`GaussianProcess`](crate::GaussianProcess) is faster.
    ///
    /// # Errors
    /// [`DomainError`] if a row does not reach the diagonal, or if the matrix is not positive definite.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// ppl::model! {
    ///     /// A line plus a smooth discrepancy, observed with noise.
    ///     fn discrepancy(x: &[f64], y: &[f64]) {
    ///         let slope ~ Normal(0.0, 2.0);
    ///         let amplitude ~ HalfNormal(1.0);
    ///         let length ~ LogNormal(0.0, 0.5);
    ///         let sd ~ HalfNormal(0.3);
    ///         let mut covariance: Vec<Vec<Real>> = Vec::new();
    ///         for (i, a) in x.iter().enumerate() {
    ///             let near = |b: &f64| (-0.5 * ((a - b) / length).square()).exp();
    ///             let mut row: Vec<Real> = x[..=i].iter().map(|b| amplitude.square() * near(b)).collect();
    ///             row[i] += sd.square();
    ///             covariance.push(row);
    ///         }
    ///         let mean: Vec<Real> = x.iter().map(|x| slope * x).collect();
    ///         y ~ MvNormalCholesky(mean, DynCholeskyFactor::of_covariance(&covariance)?);
    ///     }
    /// }
    /// ppl::check::gradient(&discrepancy(&[0.0, 0.4, 1.0], &[0.1, 0.6, 0.9]), 1);
    /// ```
    ///
    /// # References
    /// Golub & Van Loan (2013), *Matrix Computations*, 4th ed., algorithm 4.2.1; Kennedy & O'Hagan
    /// (2001), *Bayesian Calibration of Computer Models*, doi:10.1111/1467-9868.00294.
    pub fn of_covariance(matrix: &[Vec<R>]) -> Result<Self, DomainError> {
        for (i, entries) in matrix.iter().enumerate() {
            let (needed, length) = (i + 1, entries.len() as f64);
            let (name, required) =
                (format_args!("length of row {i}"), format_args!("at least {needed}"));
            DomainError::require(entries.len() > i, NAME, name, required, length)?;
        }
        Self::factorised(NAME, Free(matrix.len()), |i, j| matrix[i][j])
    }

    fn collected(&self, what: &'static str, x: &[impl Datum<R>]) -> Result<Vec<R>, DomainError> {
        let (size, length) = (self.size(), x.len());
        let requirement = format_args!("equal to the number of rows, {size}");
        DomainError::require(length == size, NAME, what, requirement, length as f64)?;
        Ok(x.iter().map(Datum::lift).collect())
    }

    /// Product diag(scale) · L.
    ///
    /// # Errors
    /// [`DomainError`] if the number of scales differs from the number of rows.
    pub fn scale_rows(&self, scale: &[impl Datum<R>]) -> Result<Self, DomainError> {
        Ok(self.scaled(self.collected("number of scales", scale)?))
    }

    /// Solution x of L x = b.
    ///
    /// # Errors
    /// [`DomainError`] if the length of b differs from the number of rows.
    pub fn solve_lower(&self, b: &[impl Datum<R>]) -> Result<Vec<R>, DomainError> {
        Ok(self.solved(self.collected("length of b", b)?))
    }

    /// Product L x.
    ///
    /// # Errors
    /// [`DomainError`] if the length of x differs from the number of rows.
    pub fn times(&self, x: &[impl Datum<R>]) -> Result<Vec<R>, DomainError> {
        let x = self.collected("length of x", x)?;
        Ok(self.product(&x, &vec![R::from(0.0); x.len()]))
    }
}

const NAME: &str = "DynCholeskyFactor";

/// Checks that a pivot, the square of a diagonal entry of the factor, is positive and finite.
fn require_pivot(name: &'static str, i: usize, pivot: f64) -> Result<(), DomainError> {
    let holds = pivot > 0.0 && pivot.is_finite();
    let parameter = format_args!("pivot {i} of the covariance matrix");
    let requirement = match pivot.is_nan() {
        true => "positive and finite",
        false => {
            "positive and finite (equal or nearly equal rows make a covariance matrix singular: add a \
             nugget of about 1e-10 of the variance to the diagonal)"
        }
    };
    DomainError::require(holds, name, parameter, requirement, pivot)
}

/// Checks that all entries above the diagonal are zero.
fn require_zeros<R: Scalar>(
    name: &'static str,
    rows: &[impl AsRef<[R]>],
) -> Result<(), DomainError> {
    for (i, row) in rows.iter().enumerate() {
        for (j, entry) in row.as_ref().iter().enumerate().skip(i + 1) {
            let v = entry.value();
            let position = format_args!("entry ({i}, {j}) above the diagonal");
            DomainError::require(v == 0.0, name, position, "zero", v)?;
        }
    }
    Ok(())
}
