//! Diagonal mass matrices.

use nalgebra::DMatrix;

use crate::sampler::hamiltonian::metric::sample::Centred;

/// Diagonal inverse mass matrix `M⁻¹ = diag(σ²)`.
#[derive(Clone, Debug)]
pub(crate) struct Diagonal {
    variance: Vec<f64>,
    sd: Vec<f64>,
}

impl Diagonal {
    pub(crate) fn identity(dim: usize) -> Self {
        Self::new(vec![1.0; dim])
    }

    pub(crate) fn new(variance: Vec<f64>) -> Self {
        let sd = variance.iter().map(|v| v.sqrt()).collect();
        Self { variance, sd }
    }

    /// Replaces the variances `before` by new variances. An entry keeps its old value if its new value is not
    /// positive and finite, because a window in which a coordinate is constant contains no information about the
    /// scale of this coordinate.
    pub(crate) fn renewed(mut before: Vec<f64>, variance: impl Fn(usize) -> f64) -> Self {
        for (i, old) in before.iter_mut().enumerate() {
            let new = variance(i);
            if new.is_finite() && new > 0.0 {
                *old = new.clamp(1e-20, 1e20);
            }
        }
        Self::new(before)
    }

    pub(crate) fn variances(&self) -> &[f64] {
        &self.variance
    }

    pub(crate) fn sd(&self) -> &[f64] {
        &self.sd
    }

    #[inline]
    pub(crate) fn apply(&self, p: &[f64], v: &mut [f64]) {
        for ((v, p), s2) in v.iter_mut().zip(p).zip(&self.variance) {
            *v = s2 * p;
        }
    }

    /// Transforms standard normals to momenta.
    pub(crate) fn colour(&self, p: &mut [f64]) {
        p.iter_mut().zip(&self.sd).for_each(|(p, sd)| *p /= sd);
    }

    /// Residual `Fᵀg + F⁻¹x` with `F = diag(σ)`, whose mean square is the Fisher divergence, for centred draws x and
    /// scores g (gradients of the log density).
    pub(crate) fn residual(&self, sample: &Centred) -> DMatrix<f64> {
        let scaled = sample.scaled(&self.sd);
        scaled.draws + scaled.scores
    }
}
