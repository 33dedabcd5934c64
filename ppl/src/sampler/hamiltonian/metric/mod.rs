//! Inverse mass matrices: diagonal, dense, and diagonal with a low-rank correction.
//!
//! Each matrix is given by a linear map F from a standard normal to the scales of the posterior, `M⁻¹ = F Fᵀ`.
//! Matrices are compared by the Fisher divergence `E|Fᵀ(g − ḡ) + F⁻¹(x − x̄)|²` of draws x with scores g (gradients
//! of the log density). The divergence is zero if the density is normal with covariance `F Fᵀ`, and it does not
//! depend on the normalising constant.
//!
//! Reference: Seyboldt, Carlson & Carpenter 2026, arXiv 2603.18845.

mod choice;
mod dense;
mod diagonal;
mod low_rank;
mod sample;

use rand::Rng;

pub(crate) use choice::{Choice, choose};
pub(crate) use dense::Dense;
pub(crate) use diagonal::Diagonal;
pub(crate) use low_rank::LowRank;
pub(crate) use sample::{Centred, Sample};

use crate::sampler::draws::report::{InverseMassMatrix, MapKind};

/// Inverse mass matrix `M⁻¹`, an estimate of the posterior covariance.
#[derive(Clone, Debug)]
pub(crate) enum Metric {
    Diagonal(Diagonal),
    Dense(Dense),
    LowRank(LowRank),
}

impl Metric {
    pub(crate) fn identity(dim: usize) -> Self {
        Self::Diagonal(Diagonal::identity(dim))
    }

    /// Creates the matrix from a stored covariance; `None` if the covariance is not positive definite or does not
    /// have `dim` coordinates.
    pub(crate) fn from_covariance(covariance: &InverseMassMatrix, dim: usize) -> Option<Self> {
        let positive = |v: &[f64]| v.iter().all(|v| v.is_finite() && *v > 0.0);
        match covariance {
            InverseMassMatrix::Diagonal(variances) => (variances.len() == dim
                && positive(variances))
            .then(|| Self::Diagonal(Diagonal::new(variances.clone()))),
            InverseMassMatrix::Dense(matrix) if matrix.len() == dim * dim => {
                Dense::new(matrix.clone(), dim).map(Self::Dense)
            }
            InverseMassMatrix::Dense(_) => None,
            InverseMassMatrix::LowRank { variances, vectors, values } => {
                let fits = variances.len() == dim && vectors.len() == dim * values.len();
                (fits && positive(variances) && positive(values)).then(|| {
                    let diagonal = Diagonal::new(variances.clone());
                    Self::LowRank(LowRank::new(diagonal, vectors.clone(), values.clone()))
                })
            }
        }
    }

    pub(crate) fn covariance(&self) -> InverseMassMatrix {
        match self {
            Self::Diagonal(m) => InverseMassMatrix::Diagonal(m.variances().to_vec()),
            Self::Dense(m) => InverseMassMatrix::Dense(m.matrix().to_vec()),
            Self::LowRank(m) => m.covariance(),
        }
    }

    pub(crate) fn kind(&self) -> MapKind {
        match self {
            Self::Diagonal(_) => MapKind::Diagonal,
            Self::Dense(_) => MapKind::Dense,
            Self::LowRank(m) => MapKind::LowRank { rank: m.rank() },
        }
    }

    /// Diagonal of `M⁻¹`.
    pub(crate) fn variances(&self) -> Vec<f64> {
        match self {
            Self::Diagonal(m) => m.variances().to_vec(),
            Self::Dense(m) => m.variances(),
            Self::LowRank(m) => m.variances(),
        }
    }

    /// Computes `v = M⁻¹ p`, where p is a momentum or a score.
    #[inline]
    pub(crate) fn apply(&self, p: &[f64], v: &mut [f64]) {
        match self {
            Self::Diagonal(m) => m.apply(p, v),
            Self::Dense(m) => m.apply(p, v),
            Self::LowRank(m) => m.apply(p, v),
        }
    }

    /// Draws a momentum, `p ~ Normal(0, M)`.
    pub(crate) fn draw_momentum<R: Rng + ?Sized>(&self, rng: &mut R, p: &mut [f64]) {
        p.iter_mut().for_each(|p| *p = rng.sample(rand_distr::StandardNormal));
        match self {
            Self::Diagonal(m) => m.colour(p),
            Self::Dense(m) => m.colour(p),
            Self::LowRank(m) => m.colour(p),
        }
    }

    /// Fisher divergence per coordinate, estimated from centred draws and scores.
    pub(crate) fn divergence(&self, sample: &Centred) -> f64 {
        let residual = match self {
            Self::Diagonal(m) => m.residual(sample),
            Self::Dense(m) => m.residual(sample),
            Self::LowRank(m) => m.residual(sample),
        };
        residual.norm_squared() / (sample.degrees_of_freedom() * sample.dim() as f64)
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/sampler_metric.rs"]
mod tests;
