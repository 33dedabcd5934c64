//! Cholesky factors of correlation and covariance matrices.

use crate::density::DomainError;
use crate::partials::Partials;
use crate::record::{Datum, Record};
use crate::scalar::Scalar;
use crate::special::Hyperbolic;

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
    /// What the entries are functions of, where that makes derivatives cheaper.
    angles: Option<Angles<K>>,
    /// What the rows have still to be multiplied by, where that makes derivatives cheaper.
    scale: Option<[R; K]>,
}

/// Entries of a correlation factor as functions of coordinates: zᵢⱼ = tanh yᵢⱼ is a partial
/// correlation, Lᵢⱼ = zᵢⱼ rᵢⱼ and Lᵢᵢ = rᵢᵢ with rᵢⱼ = Πₖ﹤ⱼ sech yᵢₖ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Angles<const K: usize> {
    entries: [[f64; K]; K],
    tanh: [[f64; K]; K],
    sech: [[f64; K]; K],
    /// rᵢⱼ sech yᵢⱼ times the slope of yᵢⱼ in its coordinate.
    reach: [[f64; K]; K],
}

impl<const K: usize> Angles<K> {
    /// Those of the unit matrix.
    #[inline(always)]
    pub(crate) fn zero() -> Self {
        let mut entries = [[0.0; K]; K];
        for i in 0..K {
            entries[i][i] = 1.0;
        }
        Self { entries, tanh: [[0.0; K]; K], sech: [[1.0; K]; K], reach: [[1.0; K]; K] }
    }

    /// Takes yᵢⱼ, with its slope in its coordinate, once row `i` is there up to column j.
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, j: usize, at: Hyperbolic, slope: f64) {
        let rest = self.entries[i][i];
        self.entries[i][j] = rest * at.tanh;
        self.entries[i][i] = rest * at.sech;
        (self.tanh[i][j], self.sech[i][j]) = (at.tanh, at.sech);
        self.reach[i][j] = rest * at.sech * slope;
    }

    /// All entries as numbers; yᵢⱼ moves with another number by `other(j)` times xᵢⱼ's slope.
    #[inline(always)]
    pub(crate) fn unfold<R: Scalar>(
        &self,
        x: &[[R; K]; K],
        (other, slopes): (R, [f64; K]),
    ) -> [[R; K]; K] {
        let mut rows = [[R::from(0.0); K]; K];
        for i in 0..K {
            let mut rest = R::from(1.0);
            for j in 0..i {
                let (x, tanh, sech, reach) =
                    (x[i][j], self.tanh[i][j], self.sech[i][j], self.reach[i][j]);
                let gather = |value, in_rest, in_x| {
                    let in_other = in_x * x.value() * slopes[j];
                    R::gather(value, ((rest, in_rest), (x, in_x), (other, in_other)))
                };
                rows[i][j] = gather(self.entries[i][j], tanh, reach * sech);
                rest = gather(rest.value() * sech, sech, -reach * tanh);
            }
            rows[i][i] = rest;
        }
        rows
    }
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
        let entry = if self.angles.is_some() { self.unscaled()[i][j] } else { self.rows[i][j] };
        match &self.scale {
            Some(scale) if j <= i => entry * scale[i],
            _ => entry,
        }
    }

    /// Rows, with zeros above the diagonal.
    #[inline(always)]
    pub fn rows(&self) -> [[R; K]; K] {
        let mut rows = self.unscaled();
        if let Some(scale) = self.scale {
            for i in 0..K {
                for j in 0..=i {
                    rows[i][j] *= scale[i];
                }
            }
        }
        rows
    }

    /// Rows that have not been scaled yet.
    #[inline(always)]
    fn unscaled(&self) -> [[R; K]; K] {
        match &self.angles {
            Some(angles) => angles.unfold(&self.rows, (R::from(0.0), [0.0; K])),
            None => self.rows,
        }
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

    /// Calls `f` with the numbers that make the entries of row `i`, whose partials are `weights`.
    #[inline(always)]
    pub(super) fn spread_row(&self, i: usize, weights: &[f64; K], f: &mut impl FnMut(R, f64)) {
        let mut weights = *weights;
        let in_scale = self.pull_scale(i, &mut weights);
        self.pull_angles(i, &mut weights);
        self.spread_pulled(i, &weights, in_scale, f);
    }

    /// [`spread_row`](Self::spread_row) of all rows.
    ///
    /// Several short loops over parts that are taken out of this structure first: where K is small
    /// the compiler unrolls them, and keeps in registers whatever no loop looks up.
    #[inline(always)]
    pub(super) fn spread_rows(&self, mut weights: [[f64; K]; K], f: &mut impl FnMut(R, f64)) {
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

    #[inline(always)]
    fn spread_pulled(
        &self,
        i: usize,
        weights: &[f64; K],
        in_scale: f64,
        f: &mut impl FnMut(R, f64),
    ) {
        let end = if self.angles.is_some() { i } else { i + 1 };
        for j in 0..end {
            f(self.rows[i][j], weights[j]);
        }
        if let Some(scale) = &self.scale {
            f(scale[i], in_scale);
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
        let mut unit = Self::from_rows(self.unscaled());
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
    pub(super) fn times_and(&self, x: &[R; K], b: &[R; K]) -> [R; K] {
        let (l, in_row) = (self.values(), x.map(Scalar::value));
        std::array::from_fn(|i| {
            let inner: f64 = (0..=i).map(|j| l[i][j] * in_row[j]).sum();
            let (x, start) = (&x[..=i], (b[i], 1.0));
            let row = Row { factor: self, i, in_row, x, in_x: l[i], start };
            R::gather(b[i].value() + inner, row)
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
                values[i][j] = scale * self.unscaled_value(i, j);
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
    pub(super) fn lifted<R>(&self) -> CholeskyFactor<R, K>
    where
        T: Datum<R>,
    {
        let scale = self.scale.as_ref().map(Datum::lift);
        CholeskyFactor { rows: self.rows.lift(), angles: self.angles, scale }
    }
}

/// The partials of a function of a row, some numbers and one more.
struct Row<'a, R, const K: usize> {
    factor: &'a CholeskyFactor<R, K>,
    i: usize,
    in_row: [f64; K],
    x: &'a [R],
    in_x: [f64; K],
    start: (R, f64),
}

impl<R: Scalar, const K: usize> Partials<R> for Row<'_, R, K> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        f(self.start.0, self.start.1);
        self.factor.spread_row(self.i, &self.in_row, f);
        self.x.iter().zip(self.in_x).for_each(|(&x, weight)| f(x, weight));
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
