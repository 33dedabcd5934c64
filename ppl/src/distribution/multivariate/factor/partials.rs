//! Partial derivatives with respect to the entries of a factor. The derivatives are propagated directly to the
//! coordinates and scales of the factor, so that no operation per entry is stored on the tape.

use super::Factor;
use super::angles::Angles;
use crate::distribution::multivariate::size::Size;
use crate::number::partials::Partials;
use crate::number::scalar::Scalar;

impl<R: Scalar, S: Size> Factor<R, S> {
    /// Propagates the partial derivatives `weights` of a function with respect to the entries of row `i`: calls
    /// `f(number, derivative)` for each number on which the entries depend, with the derivative of the function with
    /// respect to the number.
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

    /// Propagates the partial derivatives `weights` of a function with respect to all entries: calls
    /// `f(number, derivative)` for each number on which the entries depend, with the derivative of the function with
    /// respect to the number.
    ///
    /// The struct is destructured first, and the computation is split into several short loops. If the size is small
    /// and known at compile time, the compiler unrolls the loops and keeps the fields in registers.
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

/// Partial derivatives of entry (i, j) of a factor with angles.
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

/// Partial derivatives of a function that has three kinds of arguments: the entries of row `i` of a factor, the
/// numbers `x`, and one further number. `start` contains the further number and the derivative with respect to
/// it.
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

/// Partial derivatives of a function of all entries of a factor.
///
/// The derivatives are propagated without computing the entries as scalars, because this would store one operation
/// per entry on the tape.
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
