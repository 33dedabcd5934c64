//! Draws and scores of a part of the warmup.

use std::ops::Range;

use nalgebra::DMatrix;
use serde::{Deserialize, Serialize};

/// Draws and scores (gradients of the log density), in the order of the chain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Sample {
    dim: usize,
    draws: Vec<f64>,
    scores: Vec<f64>,
}

impl Sample {
    pub(crate) fn new(dim: usize) -> Self {
        Self { dim, draws: Vec::new(), scores: Vec::new() }
    }

    pub(crate) fn add(&mut self, draw: &[f64], score: &[f64]) {
        self.draws.extend_from_slice(draw);
        self.scores.extend_from_slice(score);
    }

    /// Removes all draws and scores except the last `keep`.
    pub(crate) fn keep_last(&mut self, keep: usize) {
        let old = self.len().saturating_sub(keep) * self.dim;
        self.draws.drain(..old);
        self.scores.drain(..old);
    }

    /// Whether the sample has `dim` coordinates and as many scores as draws.
    pub(crate) fn fits(&self, dim: usize) -> bool {
        self.dim == dim
            && self.draws.len() == self.scores.len()
            && self.draws.len() == self.len() * dim
    }

    pub(crate) fn len(&self) -> usize {
        self.draws.len().checked_div(self.dim).unwrap_or(0)
    }

    /// Returns the draws and scores with indices in `range`, minus their means.
    pub(crate) fn centred(&self, range: Range<usize>) -> Centred {
        let stretch = |coordinates: &[f64]| {
            let coordinates = &coordinates[range.start * self.dim..range.end * self.dim];
            let mut columns = DMatrix::from_column_slice(self.dim, range.len(), coordinates);
            let mean = columns.column_mean();
            columns.column_iter_mut().for_each(|mut column| column -= &mean);
            columns
        };
        Centred { draws: stretch(&self.draws), scores: stretch(&self.scores) }
    }

    pub(crate) fn all(&self) -> Centred {
        self.centred(0..self.len())
    }
}

/// Draws and scores minus their means; each column is one draw.
pub(crate) struct Centred {
    pub(crate) draws: DMatrix<f64>,
    pub(crate) scores: DMatrix<f64>,
}

impl Centred {
    pub(crate) fn dim(&self) -> usize {
        self.draws.nrows()
    }

    pub(crate) fn len(&self) -> usize {
        self.draws.ncols()
    }

    /// Degrees of freedom of the variance estimates: the number of draws minus 1.
    pub(crate) fn degrees_of_freedom(&self) -> f64 {
        self.len() as f64 - 1.0
    }

    /// Variance of coordinate `i` over the n draws, shrunk towards 10⁻³ as in Stan: `n/(n+5) var + 10⁻³ · 5/(n+5)`.
    pub(crate) fn shrunk_variance(&self, i: usize) -> f64 {
        let n = self.len() as f64;
        (n * self.draws.row(i).norm_squared() / self.degrees_of_freedom() + 5e-3) / (n + 5.0)
    }

    /// Variance `σ² = √(var xᵢ / var gᵢ)` of coordinate `i` in the diagonal matrix with the smallest Fisher
    /// divergence, for draws x and scores g (gradients of the log density).
    pub(crate) fn fisher_variance(&self, i: usize) -> f64 {
        (self.draws.row(i).norm_squared() / self.scores.row(i).norm_squared()).sqrt()
    }

    /// Rescales each coordinate to the unit `sd`: draws are divided by `sd`, and scores are multiplied by `sd`.
    pub(crate) fn scaled(&self, sd: &[f64]) -> Self {
        let scale = |columns: &DMatrix<f64>, factor: fn(f64) -> f64| {
            DMatrix::from_fn(self.dim(), self.len(), |i, k| columns[(i, k)] * factor(sd[i]))
        };
        Self { draws: scale(&self.draws, f64::recip), scores: scale(&self.scores, |sd| sd) }
    }

    /// Projects draws and scores onto the orthogonal complement of the orthonormal columns of `basis`.
    pub(crate) fn without(&self, basis: &DMatrix<f64>) -> Self {
        let rest = |columns: &DMatrix<f64>| columns - basis * (basis.transpose() * columns);
        Self { draws: rest(&self.draws), scores: rest(&self.scores) }
    }
}
