//! Cholesky factors of correlation and covariance matrices.

use crate::density::DomainError;
use crate::partials::Partials;
use crate::record::{Datum, Record};
use crate::scalar::Scalar;

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
    rows: [[R; K]; K],
    /// What the rows have still to be multiplied by, where that makes derivatives cheaper.
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
        let factor = Self { rows, scale: None };
        factor.validate("CholeskyFactor")?;
        Ok(factor)
    }

    pub(super) fn validate(&self, distribution: &str) -> Result<(), DomainError> {
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
        match &self.scale {
            Some(scale) if j <= i => self.rows[i][j] * scale[i],
            _ => self.rows[i][j],
        }
    }

    /// Rows, with zeros above the diagonal.
    #[inline(always)]
    pub fn rows(&self) -> [[R; K]; K] {
        let mut rows = self.rows;
        if let Some(scale) = self.scale {
            for i in 0..K {
                for j in 0..=i {
                    rows[i][j] *= scale[i];
                }
            }
        }
        rows
    }

    /// diag(scale) · L.
    #[inline(always)]
    pub fn scale_rows(&self, scale: impl Datum<[R; K]>) -> Self {
        let scaled = Self { rows: self.rows(), scale: Some(scale.lift()) };
        if R::DIFFERENTIABLE { scaled } else { Self { rows: scaled.rows(), scale: None } }
    }

    /// Calls `f` with the numbers that make the entries of row `i`, whose partials are `weights`.
    #[inline(always)]
    pub(super) fn spread_row(&self, i: usize, weights: &[f64; K], f: &mut impl FnMut(R, f64)) {
        let row = self.rows[i].iter().zip(weights).take(i + 1);
        match &self.scale {
            None => row.for_each(|(&entry, weight)| f(entry, *weight)),
            Some(scale) => {
                let (s, mut in_scale) = (scale[i], 0.0);
                for (&entry, weight) in row {
                    in_scale += weight * entry.value();
                    f(entry, weight * s.value());
                }
                f(s, in_scale);
            }
        }
    }

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
        let mut unit = Self { rows: self.rows, scale: None };
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
        let (rows, mut x) = (self.rows(), b.lift());
        for i in 0..K {
            let row = &rows[i];
            let known = &x[..i];
            let inner: f64 = known.iter().zip(row).map(|(x, l)| x.value() * l.value()).sum();
            let inverse = row[i].value().recip();
            let value = (x[i].value() - inner) * inverse;
            let terms = known
                .iter()
                .zip(row)
                .flat_map(|(&x, &l)| [(l, -x.value() * inverse), (x, -l.value() * inverse)]);
            let own = [(x[i], inverse), (row[i], -value * inverse)];
            x[i] = R::fuse_iter(value, own.into_iter().chain(terms));
        }
        x
    }

    /// L x.
    pub fn times(&self, x: impl Datum<[R; K]>) -> [R; K] {
        self.times_and(&x.lift(), &[R::from(0.0); K])
    }

    /// L x + b.
    #[inline]
    pub(super) fn times_and(&self, x: &[R; K], b: &[R; K]) -> [R; K] {
        let rows = self.rows();
        std::array::from_fn(|i| {
            let (row, start) = (&rows[i][..=i], b[i]);
            let inner: f64 = row.iter().zip(x).map(|(l, x)| l.value() * x.value()).sum();
            R::gather(start.value() + inner, Product { row, x, start })
        })
    }

    /// A B of two factors, again one.
    pub(super) fn product(&self, other: &Self) -> Self {
        let (ours, theirs) = (self.rows(), other.rows());
        Self::from_fn(|i, j| {
            let pairs = || (j..=i).map(|k| (ours[i][k], theirs[k][j]));
            let value = pairs().map(|(a, b)| a.value() * b.value()).sum();
            R::fuse_iter(value, pairs().flat_map(|(a, b)| [(a, b.value()), (b, a.value())]))
        })
    }

    /// Plain numbers.
    #[inline(always)]
    pub(super) fn values(&self) -> [[f64; K]; K] {
        let mut values = [[0.0; K]; K];
        for i in 0..K {
            let scale = self.scale.as_ref().map_or(1.0, |scale| scale[i].value());
            for j in 0..=i {
                values[i][j] = scale * self.rows[i][j].value();
            }
        }
        values
    }

    /// From entries on and below the diagonal that are right by construction.
    #[inline]
    pub(crate) fn from_fn(mut entry: impl FnMut(usize, usize) -> R) -> Self {
        let mut rows = [[R::from(0.0); K]; K];
        for (i, row) in rows.iter_mut().enumerate() {
            row[..=i].iter_mut().enumerate().for_each(|(j, x)| *x = entry(i, j));
        }
        Self { rows, scale: None }
    }

    /// From rows that are right by construction.
    #[inline(always)]
    pub(super) fn from_rows(rows: [[R; K]; K]) -> Self {
        Self { rows, scale: None }
    }
}

impl<T, const K: usize> CholeskyFactor<T, K> {
    /// In numbers of another kind, with the scale still apart.
    #[inline(always)]
    pub(super) fn lifted<R>(&self) -> CholeskyFactor<R, K>
    where
        T: Datum<R>,
    {
        CholeskyFactor { rows: self.rows.lift(), scale: self.scale.as_ref().map(Datum::lift) }
    }
}

/// b + Σⱼ Lⱼ xⱼ over a row.
struct Product<'a, R> {
    row: &'a [R],
    x: &'a [R],
    start: R,
}

impl<R: Scalar> Partials<R> for Product<'_, R> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        f(self.start, 1.0);
        for (&l, &x) in self.row.iter().zip(self.x) {
            f(l, x.value());
            f(x, l.value());
        }
    }
}

impl<R: Scalar, T: Datum<R>, const K: usize> Datum<CholeskyFactor<R, K>> for CholeskyFactor<T, K> {
    fn lift(&self) -> CholeskyFactor<R, K> {
        CholeskyFactor { rows: self.lifted().rows(), scale: None }
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

/// A distribution over arrays or factors, for a factor that is seen behind a reference, as data
/// of a model are: `by_reference!(Name<parameters before the factor>(their fields), its field)`.
macro_rules! by_reference {
    ($Name:ident<$($P:ident),*>($($field:tt),*), $factor:tt) => {
        impl<$($P: Clone,)* T: Copy, const K: usize>
            $Name<$($P,)* &$crate::distribution::CholeskyFactor<T, K>>
        {
            #[inline]
            fn owned(&self) -> $Name<$($P,)* $crate::distribution::CholeskyFactor<T, K>> {
                $Name($(self.$field.clone(),)* *self.$factor)
            }
        }

        impl<R, $($P,)* T, const K: usize> $crate::distribution::Distribution<R>
            for $Name<$($P,)* &$crate::distribution::CholeskyFactor<T, K>>
        where
            R: $crate::Scalar,
            T: Copy,
            $($P: Clone,)*
            Self: $crate::distribution::Family,
            $Name<$($P,)* $crate::distribution::CholeskyFactor<T, K>>:
                $crate::distribution::Distribution<R>,
        {
            type Value = <$Name<$($P,)* $crate::distribution::CholeskyFactor<T, K>> as
                $crate::distribution::Distribution<R>>::Value;

            #[inline]
            fn ln_density(&self, x: &Self::Value) -> R {
                self.owned().ln_density(x)
            }

            #[inline]
            fn add_terms(&self, x: &Self::Value, terms: &mut impl $crate::terms::Terms<R>) {
                self.owned().add_terms(x, terms);
            }

            fn validate(&self) -> Result<(), $crate::DomainError> {
                $crate::distribution::Distribution::<R>::validate(&self.owned())
            }

            fn draw<G: rand::Rng + ?Sized>(&self, rng: &mut G) -> Self::Value {
                self.owned().draw(rng)
            }
        }

        impl<R, $($P,)* T, const K: usize> $crate::distribution::Unknown<R>
            for $Name<$($P,)* &$crate::distribution::CholeskyFactor<T, K>>
        where
            R: $crate::Scalar,
            T: Copy,
            $($P: Clone,)*
            Self: $crate::distribution::Family,
            $Name<$($P,)* $crate::distribution::CholeskyFactor<T, K>>:
                $crate::distribution::Unknown<R>,
        {
            fn dim(&self) -> usize {
                $crate::distribution::Unknown::<R>::dim(&self.owned())
            }

            #[inline]
            fn constrain(
                &self,
                next: &mut impl FnMut() -> R,
                jacobian: bool,
                terms: &mut impl $crate::terms::Terms<R>,
            ) -> Self::Value {
                self.owned().constrain(next, jacobian, terms)
            }

            fn unconstrain(&self, x: &Self::Value, out: &mut Vec<f64>) {
                self.owned().unconstrain(x, out);
            }
        }
    };
}
pub(crate) use by_reference;
