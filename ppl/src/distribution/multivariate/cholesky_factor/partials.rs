//! What entries of a factor are made of: partials in them go on to its numbers.

use super::{Angles, CholeskyFactor};
use crate::partials::Partials;
use crate::scalar::Scalar;

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
    pub(super) fn unscaled_value(&self, i: usize, j: usize) -> f64 {
        match &self.angles {
            Some(angles) => angles.entries[i][j],
            None => self.rows[i][j].value(),
        }
    }
}

/// The partials of entry (i, j), where coordinates make it.
pub(super) struct Entry<'a, R, const K: usize> {
    pub(super) factor: &'a CholeskyFactor<R, K>,
    pub(super) angles: &'a Angles<K>,
    pub(super) i: usize,
    pub(super) j: usize,
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
