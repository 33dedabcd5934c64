//! The factor, and what its entries are made of: partials in them go on to its numbers.

use super::angles::Angles;
use crate::datum::{Datum, Recordable};
use crate::density::DomainError;
use crate::partials::Partials;
use crate::scalar::Scalar;

/// A lower triangular K×K matrix L with positive diagonal, the factor of L Lᵀ.
///
/// The value type of [`LkjCholesky`](crate::LkjCholesky) and the scale of
/// [`MvNormalCholesky`](crate::MvNormalCholesky). A correlation factor (rows of length 1) becomes
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
    pub(super) rows: [[R; K]; K],
    /// What the entries are functions of, where that makes derivatives cheaper: never for data.
    pub(super) angles: Option<Angles<K>>,
    /// What the rows have still to be multiplied by, under the same condition.
    pub(super) scale: Option<[R; K]>,
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

    pub(in crate::distribution) fn validate(
        &self,
        distribution: &'static str,
    ) -> Result<(), DomainError> {
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
    pub(in crate::distribution) fn values(&self) -> [[f64; K]; K] {
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
    pub(in crate::distribution) fn from_angles(rows: [[R; K]; K], angles: Angles<K>) -> Self {
        Self { rows, angles: Some(angles), scale: None }
    }
}

impl<T, const K: usize> CholeskyFactor<T, K> {
    /// In numbers of another kind, with the scale still apart.
    #[inline(always)]
    pub(in crate::distribution) fn lifted<R: Scalar>(&self) -> CholeskyFactor<R, K>
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

impl<R: Recordable + Scalar, const K: usize> Recordable for CholeskyFactor<R, K> {
    fn shape(&self) -> Vec<usize> {
        vec![K, K]
    }

    fn flatten(&self, out: &mut Vec<f64>) {
        self.rows().flatten(out);
    }
}

impl<R: Scalar, const K: usize> CholeskyFactor<R, K> {
    /// Calls `f` with the numbers that make the entries of row `i`, whose partials are `weights`.
    #[inline(always)]
    fn spread_row(&self, i: usize, mut weights: [f64; K], f: &mut impl FnMut(R, f64)) {
        let in_scale = self.pull_scale(i, &mut weights);
        self.pull_angles(i, &mut weights);
        let end = if self.angles.is_some() { i } else { i + 1 };
        for j in 0..end {
            f(self.rows[i][j], weights[j]);
        }
        if let Some(scale) = &self.scale {
            f(scale[i], in_scale);
        }
    }

    /// Calls `f` with the numbers that make all entries, whose partials are `weights`.
    ///
    /// Several short loops over parts that are taken out of this structure first: where K is small
    /// the compiler unrolls them, and keeps in registers whatever no loop looks up.
    #[inline(always)]
    pub(in crate::distribution) fn spread_rows(
        &self,
        mut weights: [[f64; K]; K],
        f: &mut impl FnMut(R, f64),
    ) {
        let Self { rows, angles, scale } = *self;
        let mut end = 1;
        if let Some(scale) = scale {
            let values = match angles {
                Some(angles) => angles.entries,
                None => {
                    let mut values = [[0.0; K]; K];
                    for i in 0..K {
                        for j in 0..=i {
                            values[i][j] = rows[i][j].value();
                        }
                    }
                    values
                }
            };
            let mut in_scale = [0.0; K];
            for i in 0..K {
                for j in 0..=i {
                    in_scale[i] += weights[i][j] * values[i][j];
                    weights[i][j] *= scale[i].value();
                }
            }
            for i in 0..K {
                f(scale[i], in_scale[i]);
            }
        }
        if let Some(Angles { tanh, sech, reach, .. }) = angles {
            end = 0;
            for i in 0..K {
                let mut in_rest = weights[i][i];
                for j in (0..i).rev() {
                    let (tanh, sech, weight) = (tanh[i][j], sech[i][j], weights[i][j]);
                    weights[i][j] = reach[i][j] * (weight * sech - in_rest * tanh);
                    in_rest = weight * tanh + in_rest * sech;
                }
            }
        }
        for i in 0..K {
            for j in 0..i + end {
                f(rows[i][j], weights[i][j]);
            }
        }
    }

    /// From partials in the scaled entries of row `i` to those in the others, and in the scale.
    #[inline(always)]
    fn pull_scale(&self, i: usize, weights: &mut [f64; K]) -> f64 {
        let Some(scale) = &self.scale else { return 0.0 };
        let mut in_scale = 0.0;
        for j in 0..=i {
            in_scale += weights[j] * self.unscaled_value(i, j);
            weights[j] *= scale[i].value();
        }
        in_scale
    }

    /// From partials in the entries of row `i` to those in coordinates, if they have any.
    #[inline(always)]
    fn pull_angles(&self, i: usize, weights: &mut [f64; K]) {
        let Some(Angles { tanh, sech, reach, .. }) = &self.angles else { return };
        let mut in_rest = weights[i];
        for j in (0..i).rev() {
            let (tanh, sech, weight) = (tanh[i][j], sech[i][j], weights[j]);
            weights[j] = reach[i][j] * (weight * sech - in_rest * tanh);
            in_rest = weight * tanh + in_rest * sech;
        }
    }

    /// An entry before it is scaled.
    #[inline(always)]
    fn unscaled_value(&self, i: usize, j: usize) -> f64 {
        match &self.angles {
            Some(angles) => angles.entries[i][j],
            None => self.rows[i][j].value(),
        }
    }
}

/// The partials of entry (i, j), where coordinates make it.
struct Entry<'a, R, const K: usize> {
    factor: &'a CholeskyFactor<R, K>,
    angles: &'a Angles<K>,
    i: usize,
    j: usize,
}

impl<R: Scalar, const K: usize> Partials<R> for Entry<'_, R, K> {
    const MOST: usize = K + 1;

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { factor: CholeskyFactor { rows, scale, .. }, angles, i, j } = self;
        let mut in_rest = 1.0;
        if let Some(scale) = scale {
            f(scale[i], angles.entries[i][j]);
            in_rest = scale[i].value();
        }
        if j < i {
            f(rows[i][j], in_rest * angles.reach[i][j] * angles.sech[i][j]);
            in_rest *= angles.tanh[i][j];
        }
        for k in (0..j).rev() {
            f(rows[i][k], -in_rest * angles.reach[i][k] * angles.tanh[i][k]);
            in_rest *= angles.sech[i][k];
        }
    }
}

/// The partials of a function of a row, some numbers and one more.
pub(super) struct Row<'a, R, const K: usize> {
    pub(super) factor: &'a CholeskyFactor<R, K>,
    pub(super) i: usize,
    pub(super) in_row: [f64; K],
    pub(super) x: &'a [R],
    pub(super) in_x: [f64; K],
    pub(super) start: (R, f64),
}

impl<R: Scalar, const K: usize> Partials<R> for Row<'_, R, K> {
    const MOST: usize = 2 * K + 2;

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        f(self.start.0, self.start.1);
        self.factor.spread_row(self.i, self.in_row, f);
        self.x.iter().zip(self.in_x).for_each(|(&x, weight)| f(x, weight));
    }
}

/// The partials of a function of a whole factor and one more number.
///
/// Entries that are made on the way, each by an operation of its own, would come between the
/// arguments of this one.
pub(in crate::distribution) struct Whole<'a, R, const K: usize> {
    pub(in crate::distribution) factor: &'a CholeskyFactor<R, K>,
    pub(in crate::distribution) weights: [[f64; K]; K],
    pub(in crate::distribution) other: (R, f64),
}

impl<R: Scalar, const K: usize> Partials<R> for Whole<'_, R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        self.factor.spread_rows(self.weights, f);
        f(self.other.0, self.other.1);
    }
}
