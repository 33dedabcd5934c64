//! Diagonal mass matrices.

use nalgebra::DMatrix;

use super::sample::Centred;

/// Diagonal inverse mass matrix `M⁻¹ = diag(σ²)`.
#[derive(Clone, Debug)]
pub(in crate::sampler) struct Diagonal {
    variance: Vec<f64>,
    sd: Vec<f64>,
}

impl Diagonal {
    pub(super) fn identity(dim: usize) -> Self {
        Self::new(vec![1.0; dim])
    }

    pub(in crate::sampler) fn new(variance: Vec<f64>) -> Self {
        let sd = variance.iter().map(|v| v.sqrt()).collect();
        Self { variance, sd }
    }

    /// Replaces the variances `before` by new variances. An entry keeps its old value if its new value is not
    /// positive and finite, because a window in which a coordinate is constant contains no information about the
    /// scale of this coordinate.
    pub(in crate::sampler) fn renewed(
        mut before: Vec<f64>,
        variance: impl Fn(usize) -> f64,
    ) -> Self {
        for (i, old) in before.iter_mut().enumerate() {
            let new = variance(i);
            if new.is_finite() && new > 0.0 {
                *old = new.clamp(1e-20, 1e20);
            }
        }
        Self::new(before)
    }

    pub(super) fn variances(&self) -> &[f64] {
        &self.variance
    }

    pub(super) fn sd(&self) -> &[f64] {
        &self.sd
    }

    #[inline]
    pub(super) fn apply(&self, p: &[f64], v: &mut [f64]) {
        for ((v, p), s2) in v.iter_mut().zip(p).zip(&self.variance) {
            *v = s2 * p;
        }
    }

    /// Transforms standard normals to momenta.
    pub(super) fn colour(&self, p: &mut [f64]) {
        p.iter_mut().zip(&self.sd).for_each(|(p, sd)| *p /= sd);
    }

    /// Residual `Fᵀg + F⁻¹x` with `F = diag(σ)`, whose mean square is the Fisher divergence, for centred draws x and
    /// scores g (gradients of the log density).
    pub(super) fn residual(&self, sample: &Centred) -> DMatrix<f64> {
        let scaled = sample.scaled(&self.sd);
        scaled.draws + scaled.scores
    }
}
