//! Correlation factors as functions of coordinates.

use crate::scalar::Scalar;
use crate::special::Hyperbolic;

/// Entries of a correlation factor as functions of coordinates: zᵢⱼ = tanh yᵢⱼ is a partial
/// correlation, Lᵢⱼ = zᵢⱼ rᵢⱼ and Lᵢᵢ = rᵢᵢ with rᵢⱼ = Πₖ﹤ⱼ sech yᵢₖ.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Angles<const K: usize> {
    pub(super) entries: [[f64; K]; K],
    pub(super) tanh: [[f64; K]; K],
    pub(super) sech: [[f64; K]; K],
    /// rᵢⱼ sech yᵢⱼ times the slope of yᵢⱼ in its coordinate.
    pub(super) reach: [[f64; K]; K],
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
