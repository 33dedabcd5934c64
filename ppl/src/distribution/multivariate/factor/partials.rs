//! What entries are made of: partials in them go on to coordinates and scales, without an operation
//! for every entry.

use super::Factor;
use super::angles::Angles;
use crate::distribution::multivariate::size::Size;
use crate::partials::Partials;
use crate::scalar::Scalar;

impl<R: Scalar, S: Size> Factor<R, S> {
    /// Calls `f` with the numbers that make the entries of row `i`, whose partials are `weights`.
    #[inline(always)]
    fn spread_row(&self, i: usize, mut weights: S::Vector<f64>, f: &mut impl FnMut(R, f64)) {
        if let Some(scale) = &self.scale {
            let mut in_scale = 0.0;
            for j in 0..=i {
                in_scale += weights[j] * self.unscaled_value(i, j);
                weights[j] *= scale[i].value();
            }
            f(scale[i], in_scale);
        }
        let mut end = i + 1;
        if let Some(Angles { tanh, sech, reach, .. }) = &self.angles {
            end = i;
            let mut in_rest = weights[i];
            for j in (0..i).rev() {
                let (tanh, sech, weight) = (tanh[i][j], sech[i][j], weights[j]);
                weights[j] = reach[i][j] * (weight * sech - in_rest * tanh);
                in_rest = weight * tanh + in_rest * sech;
            }
        }
        for j in 0..end {
            f(self.rows[i][j], weights[j]);
        }
    }

    /// Calls `f` with the numbers that make all entries, whose partials are `weights`.
    ///
    /// Several short loops over parts that are taken out of this structure first: where the size is
    /// small and in the type the compiler unrolls them, and keeps in registers whatever no loop looks
    /// up.
    #[inline(always)]
    pub(in crate::distribution::multivariate) fn spread_rows(
        self,
        mut weights: S::Matrix<f64>,
        f: &mut impl FnMut(R, f64),
    ) {
        let Self { size, rows, angles, scale } = self;
        let k = size.get();
        let mut end = 1;
        if let Some(scale) = scale {
            let values = match &angles {
                Some(angles) => angles.entries.clone(),
                None => {
                    let mut values = size.filled(0.0);
                    for i in 0..k {
                        for j in 0..=i {
                            values[i][j] = rows[i][j].value();
                        }
                    }
                    values
                }
            };
            let mut in_scale = size.vector(|_| 0.0);
            for i in 0..k {
                for j in 0..=i {
                    in_scale[i] += weights[i][j] * values[i][j];
                    weights[i][j] *= scale[i].value();
                }
            }
            for i in 0..k {
                f(scale[i], in_scale[i]);
            }
        }
        if let Some(Angles { tanh, sech, reach, .. }) = angles {
            end = 0;
            for i in 0..k {
                let mut in_rest = weights[i][i];
                for j in (0..i).rev() {
                    let (tanh, sech, weight) = (tanh[i][j], sech[i][j], weights[i][j]);
                    weights[i][j] = reach[i][j] * (weight * sech - in_rest * tanh);
                    in_rest = weight * tanh + in_rest * sech;
                }
            }
        }
        for i in 0..k {
            for j in 0..i + end {
                f(rows[i][j], weights[i][j]);
            }
        }
    }
}

/// The partials of entry (i, j), where coordinates make it.
pub(super) struct One<'a, R: Scalar, S: Size> {
    pub(super) factor: &'a Factor<R, S>,
    pub(super) angles: &'a Angles<S>,
    pub(super) i: usize,
    pub(super) j: usize,
}

impl<R: Scalar, S: Size> Partials<R> for One<'_, R, S> {
    const MOST: usize = S::AT_MOST.saturating_add(1);

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        let Self { factor: Factor { rows, scale, .. }, angles, i, j } = self;
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
pub(super) struct Row<'a, R: Scalar, S: Size> {
    pub(super) factor: &'a Factor<R, S>,
    pub(super) i: usize,
    pub(super) in_row: S::Vector<f64>,
    pub(super) x: &'a [R],
    pub(super) in_x: &'a [f64],
    pub(super) start: (R, f64),
}

impl<R: Scalar, S: Size> Partials<R> for Row<'_, R, S> {
    const MOST: usize = S::AT_MOST.saturating_mul(2).saturating_add(2);

    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        f(self.start.0, self.start.1);
        self.factor.spread_row(self.i, self.in_row, f);
        self.x.iter().zip(self.in_x).for_each(|(&x, &weight)| f(x, weight));
    }
}

/// The partials of a function of a whole factor.
///
/// Entries that are made on the way, each by an operation of its own, would come between the
/// arguments of this one.
pub(in crate::distribution::multivariate) struct Whole<R: Scalar, S: Size> {
    pub(in crate::distribution::multivariate) factor: Factor<R, S>,
    pub(in crate::distribution::multivariate) weights: S::Matrix<f64>,
}

impl<R: Scalar, S: Size> Partials<R> for Whole<R, S> {
    #[inline(always)]
    fn spread(self, f: &mut impl FnMut(R, f64)) {
        self.factor.spread_rows(self.weights, f);
    }
}
