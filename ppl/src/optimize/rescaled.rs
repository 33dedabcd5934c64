//! Log density in rescaled coordinates.

use rand::RngCore;

use crate::density::Rejection;
use crate::model::erased::{ErasedDensity, Evaluator};

/// A log density as a function of rescaled coordinates z, with y = origin + scale · z. The scales are the widths of
/// the density, so that the tolerances of a search are appropriate in all coordinates.
pub(super) struct Rescaled<'a> {
    density: &'a dyn ErasedDensity,
    origin: Vec<f64>,
    scales: Vec<f64>,
}

impl<'a> Rescaled<'a> {
    /// Creates the rescaled density. The scales are the widths 1/√|curvature| of the density at `origin`.
    pub(super) fn new(
        density: &'a dyn ErasedDensity,
        origin: Vec<f64>,
        curvatures: impl IntoIterator<Item = f64>,
    ) -> Self {
        let width = |curvature: f64| {
            let width = curvature.abs().sqrt().recip();
            if width > 0.0 && width.is_finite() { width } else { 1.0 }
        };
        let scales = curvatures.into_iter().map(width).collect();
        Self { density, origin, scales }
    }

    /// Converts rescaled to original coordinates.
    pub(super) fn point(&self, z: &[f64]) -> Vec<f64> {
        let pairs = self.origin.iter().zip(&self.scales);
        pairs.zip(z).map(|((origin, scale), z)| origin + scale * z).collect()
    }
}

impl ErasedDensity for Rescaled<'_> {
    fn dim(&self) -> usize {
        self.origin.len()
    }

    fn prior_point(&self, _: &mut dyn RngCore) -> Option<Vec<f64>> {
        None
    }

    fn with_values(&self, y: &[f64], values: &[(String, Vec<f64>)]) -> Result<Vec<f64>, String> {
        self.density.with_values(y, values)
    }

    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(RescaledEvaluator { density: self, evaluator: self.density.evaluator() })
    }
}

struct RescaledEvaluator<'a> {
    density: &'a Rescaled<'a>,
    evaluator: Box<dyn Evaluator + 'a>,
}

impl Evaluator for RescaledEvaluator<'_> {
    fn log_density(&mut self, z: &[f64]) -> Result<f64, Rejection> {
        self.evaluator.log_density(&self.density.point(z))
    }

    fn gradient(&mut self, z: &[f64], gradient: &mut [f64]) -> Result<f64, Rejection> {
        let value = self.evaluator.gradient(&self.density.point(z), gradient)?;
        gradient.iter_mut().zip(&self.density.scales).for_each(|(g, scale)| *g *= scale);
        Ok(value)
    }

    fn explain(&self, z: &[f64]) -> Option<String> {
        self.evaluator.explain(&self.density.point(z))
    }
}
