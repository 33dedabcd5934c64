//! Mass matrices and their estimation from draws and scores.

use rand::Rng;
use rand_distr::StandardNormal;

/// Diagonal inverse mass matrix `M⁻¹ = diag(σ²)`, an estimate of the posterior variances.
#[derive(Clone, Debug)]
pub(super) struct DiagonalMetric {
    variance: Vec<f64>,
    sd: Vec<f64>,
}

impl DiagonalMetric {
    pub(super) fn identity(dim: usize) -> Self {
        Self { variance: vec![1.0; dim], sd: vec![1.0; dim] }
    }

    pub(super) fn variances(&self) -> &[f64] {
        &self.variance
    }

    /// Replaces the variances; an entry that is no positive finite number keeps its old value,
    /// because a window in which a coordinate never moved teaches nothing about its scale.
    pub(super) fn replace(&mut self, variances: impl Fn(usize) -> f64) {
        for i in 0..self.variance.len() {
            let v = variances(i);
            if v.is_finite() && v > 0.0 {
                self.variance[i] = v.clamp(1e-20, 1e20);
                self.sd[i] = self.variance[i].sqrt();
            }
        }
    }

    /// `v = M⁻¹ p`.
    pub(super) fn velocity(&self, p: &[f64], v: &mut [f64]) {
        for ((v, p), s2) in v.iter_mut().zip(p).zip(&self.variance) {
            *v = s2 * p;
        }
    }

    /// `p ~ Normal(0, M)`.
    pub(super) fn draw_momentum<R: Rng + ?Sized>(&self, rng: &mut R, p: &mut [f64]) {
        for (p, sd) in p.iter_mut().zip(&self.sd) {
            let z: f64 = rng.sample(StandardNormal);
            *p = z / sd;
        }
    }
}

/// Mean and variance of vectors seen one by one (Welford 1962).
#[derive(Clone, Debug)]
struct Moments {
    count: f64,
    mean: Vec<f64>,
    squares: Vec<f64>,
}

impl Moments {
    fn new(dim: usize) -> Self {
        Self { count: 0.0, mean: vec![0.0; dim], squares: vec![0.0; dim] }
    }

    fn add(&mut self, x: &[f64]) {
        self.count += 1.0;
        for ((x, mean), squares) in x.iter().zip(&mut self.mean).zip(&mut self.squares) {
            let delta = x - *mean;
            *mean += delta / self.count;
            *squares += delta * (x - *mean);
        }
    }

    /// Unbiased variance of coordinate `i`; NaN below two vectors.
    fn variance(&self, i: usize) -> f64 {
        if self.count < 2.0 { f64::NAN } else { self.squares[i] / (self.count - 1.0) }
    }

    fn clear(&mut self) {
        self.count = 0.0;
        self.mean.fill(0.0);
        self.squares.fill(0.0);
    }
}

/// Draws and scores (gradients of the log density) of one warmup window.
#[derive(Clone, Debug)]
pub(super) struct Estimator {
    draws: Moments,
    scores: Moments,
}

impl Estimator {
    pub(super) fn new(dim: usize) -> Self {
        Self { draws: Moments::new(dim), scores: Moments::new(dim) }
    }

    pub(super) fn add(&mut self, draw: &[f64], score: &[f64]) {
        self.draws.add(draw);
        self.scores.add(score);
    }

    pub(super) fn clear(&mut self) {
        self.draws.clear();
        self.scores.clear();
    }

    /// Stan's variance of the draws, shrunk towards 10⁻³: `n/(n+5) var + 10⁻³ · 5/(n+5)`.
    pub(super) fn shrunk_variance(&self, i: usize) -> f64 {
        let n = self.draws.count;
        (n * self.draws.variance(i) + 5e-3) / (n + 5.0)
    }

    /// Minimiser of the Fisher divergence among diagonal maps, `σ² = √(var x / var ∇ln p)`.
    ///
    /// Reference: Seyboldt, Carlson & Carpenter 2026, arXiv 2603.18845.
    pub(super) fn fisher_variance(&self, i: usize) -> f64 {
        (self.draws.variance(i) / self.scores.variance(i)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use approx::assert_relative_eq;

    use super::*;

    fn filled() -> Estimator {
        let mut estimator = Estimator::new(1);
        for (x, g) in [(1.0, -2.0), (2.0, -4.5), (4.0, -8.0), (9.0, -18.5)] {
            estimator.add(&[x], &[g]);
        }
        estimator
    }

    /// Two-pass variances by hand: mean 4, squares 9+4+0+25 = 38; scores mean −8.25.
    #[test]
    fn variances_by_hand() {
        let var_x: f64 = 38.0 / 3.0;
        let var_g = (6.25f64.powi(2) + 3.75f64.powi(2) + 0.25f64.powi(2) + 10.25f64.powi(2)) / 3.0;
        let estimator = filled();
        assert_relative_eq!(
            estimator.shrunk_variance(0),
            4.0 / 9.0 * var_x + 1e-3 * 5.0 / 9.0,
            max_relative = 1e-14
        );
        assert_relative_eq!(
            estimator.fisher_variance(0),
            (var_x / var_g).sqrt(),
            max_relative = 1e-14
        );
    }

    /// For a normal with variance s² the score is −x/s², so that the Fisher map is exact from any two draws.
    #[test]
    fn fisher_map_is_exact_for_a_normal() {
        let mut estimator = Estimator::new(1);
        let variance = 3e-4;
        for x in [0.7, -0.1] {
            estimator.add(&[x], &[-x / variance]);
        }
        assert_relative_eq!(estimator.fisher_variance(0), variance, max_relative = 1e-12);
    }

    #[test]
    fn a_coordinate_that_never_moved_keeps_its_scale() {
        let mut metric = DiagonalMetric::identity(2);
        let mut estimator = Estimator::new(2);
        estimator.add(&[1.0, 5.0], &[0.1, 3.0]);
        estimator.add(&[2.0, 5.0], &[-0.1, 3.0]);
        metric.replace(|i| estimator.fisher_variance(i));
        assert!(metric.variances()[0] != 1.0);
        assert_eq!(metric.variances()[1], 1.0);
    }
}
