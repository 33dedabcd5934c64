//! Correlation factors as functions of unconstrained coordinates.

use crate::distribution::multivariate::size::{Fixed, Size};
use crate::special::Hyperbolic;

/// Entries Lᵢⱼ of a correlation factor as functions of unconstrained coordinates yᵢⱼ: Lᵢⱼ = zᵢⱼ rᵢⱼ and Lᵢᵢ = rᵢᵢ,
/// with the partial correlation zᵢⱼ = tanh yᵢⱼ and rᵢⱼ = Πₖ﹤ⱼ sech yᵢₖ.
#[derive(Clone, Debug)]
pub(crate) struct Angles<S: Size> {
    pub(super) entries: S::Matrix<f64>,
    pub(super) tanh: S::Matrix<f64>,
    pub(super) sech: S::Matrix<f64>,
    /// The products rᵢⱼ sech yᵢⱼ · dyᵢⱼ/dx, where x is the coordinate of the sampler from which yᵢⱼ is computed.
    pub(super) reach: S::Matrix<f64>,
}

impl<const K: usize> Copy for Angles<Fixed<K>> {}

impl<S: Size> Angles<S> {
    /// Creates the angles of the identity matrix (all yᵢⱼ = 0).
    #[inline(always)]
    pub(crate) fn zero(size: S) -> Self {
        let mut entries = size.filled(0.0);
        for i in 0..size.get() {
            entries[i][i] = 1.0;
        }
        let (tanh, sech, reach) = (size.filled(0.0), size.filled(1.0), size.filled(1.0));
        Self { entries, tanh, sech, reach }
    }

    /// Sets yᵢⱼ from its hyperbolic functions `at`. `slope` is the derivative of yᵢⱼ with respect to the coordinate
    /// of the sampler. The columns of a row must be set in ascending order.
    #[inline(always)]
    pub(crate) fn set(&mut self, i: usize, j: usize, at: Hyperbolic, slope: f64) {
        let rest = self.entries[i][i];
        self.entries[i][j] = rest * at.tanh;
        self.entries[i][i] = rest * at.sech;
        (self.tanh[i][j], self.sech[i][j]) = (at.tanh, at.sech);
        self.reach[i][j] = rest * at.sech * slope;
    }

    /// Entry (i, j) of the factor.
    #[inline(always)]
    pub(crate) fn entry(&self, i: usize, j: usize) -> f64 {
        self.entries[i][j]
    }
}
