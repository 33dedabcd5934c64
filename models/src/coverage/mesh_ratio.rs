//! Correction of runs on a cheap mesh in synthetic laboratories.

use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use rand::Rng;
use rand_distr::StandardNormal;
use surrogate::{Dataset, DynPce, FitOptions, Scale, Scales, SurrogateError};

use crate::fracture::CalibrationError;

/// Ratio of the quantities on the mesh of the specimens to the quantities on a cheaper mesh, as in `[fidelity]`.
#[derive(Clone, Debug)]
pub struct MeshRatio {
    /// Mean ratio over packings, as a function of the parameters.
    pub ratio: DynPce,
    /// Covariance (quantities × quantities) of the logarithm of the ratio between packings.
    pub packings: Vec<Vec<f64>>,
    /// Number of runs that are repeated on the mesh of the specimens.
    pub repeats: usize,
}

impl MeshRatio {
    /// Fits the ratio to runs on both meshes. Each row of `ratios` is the ratio of one run. The logarithm of the ratio is
    /// fitted by a constant or by a linear function, as in the pipeline.
    ///
    /// # Errors
    /// The errors of [`DynPce::fit`].
    pub fn of(ratios: &Dataset, repeats: usize) -> Result<Self, SurrogateError> {
        let fit = DynPce::fit(ratios, &options(ratios))?;
        let ones = vec![1.0; ratios.outputs().len()];
        Ok(Self { ratio: fit.pce, packings: fit.report.scatter(&ones)?, repeats })
    }

    /// Returns the runs as the pipeline would know them, and the covariance of the error of their correction. The
    /// quantities in `runs` are exact values on the mesh of the specimens. Each run is divided by the ratio of its
    /// packing, which gives the run on the cheap mesh, and multiplied by a ratio that is fitted to the first
    /// `repeats` runs.
    ///
    /// # Errors
    /// If a covariance is not positive definite, or the ratio cannot be fitted.
    pub(super) fn corrected<R: Rng>(
        &self,
        runs: &Dataset,
        rng: &mut R,
    ) -> Result<(Dataset, Vec<Vec<f64>>), CalibrationError> {
        let factor = factor(&self.packings, "covariance of the ratio of meshes between packings")?;
        let empty = || Dataset::new(runs.inputs().to_vec(), runs.outputs().to_vec(), "emulated");
        let (mut cheap, mut repeated) = (empty()?, empty()?);
        for (k, (x, better)) in runs.rows().enumerate() {
            let deviations = &factor.l() * normal(better.len(), rng);
            let mean = self.ratio.value(x)?;
            let ratios: Vec<f64> =
                mean.iter().zip(deviations.iter()).map(|(mean, z)| mean * z.exp()).collect();
            let of_cheap: Vec<f64> =
                better.iter().zip(&ratios).map(|(y, ratio)| y / ratio).collect();
            cheap.push(x, &of_cheap)?;
            if k < self.repeats {
                repeated.push(x, &ratios)?;
            }
        }
        let fit = DynPce::fit(&repeated, &options(&repeated))?;
        let mut corrected = empty()?;
        for (x, of_cheap) in cheap.rows() {
            let ratios = fit.pce.value(x)?;
            let values: Vec<f64> =
                of_cheap.iter().zip(&ratios).map(|(y, ratio)| y * ratio).collect();
            corrected.push(x, &values)?;
        }
        Ok((corrected, fit.report.mean_error(&vec![1.0; runs.outputs().len()])?))
    }
}

/// Options of a fit of ratios.
fn options(ratios: &Dataset) -> FitOptions {
    let scales = Scales::Given {
        inputs: vec![Scale::Linear; ratios.inputs().len()],
        outputs: vec![Scale::Log; ratios.outputs().len()],
    };
    FitOptions { max_order: 1, scales, ..FitOptions::default() }
}

/// Standard normal vector.
pub(super) fn normal<R: Rng>(size: usize, rng: &mut R) -> DVector<f64> {
    DVector::from_fn(size, |_, _| rng.sample(StandardNormal))
}

/// Cholesky factor of a covariance.
///
/// # Errors
/// If the covariance is not positive definite; `name` is its name in the error.
pub(super) fn factor(
    covariance: &[Vec<f64>],
    name: &'static str,
) -> Result<Cholesky<f64, Dyn>, CalibrationError> {
    let size = covariance.len();
    let matrix = DMatrix::from_fn(size, size, |i, j| covariance[i][j]);
    Cholesky::new(matrix).ok_or_else(|| {
        let value = format!("{covariance:?}");
        let allowed = "positive definite".to_owned();
        SurrogateError::Option { option: name, value, allowed }.into()
    })
}

#[cfg(test)]
mod tests {
    use rand::SeedableRng;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use surrogate::{DesignMethod, Input};

    use super::*;

    /// The squared error of the fitted ratio, averaged over the box and over many ensembles, equals the stated variance.
    /// All runs have the quantity 1. A run that is not repeated is then corrected to exp(e − w): e is the error of the
    /// fitted ratio, and w is the independent scatter of the run's own ratio.
    #[test]
    fn the_error_of_a_correction_is_as_large_as_stated() {
        let inputs = vec![Input::new("a", 0.0, 2.0).unwrap(), Input::new("b", 1.0, 3.0).unwrap()];
        let points = DesignMethod::Sobol.sample(&inputs, 256, 1).unwrap();
        let [mut runs, mut ratios] =
            [(); 2].map(|()| Dataset::new(inputs.clone(), vec!["q".into()], "test").unwrap());
        for x in &points {
            runs.push(x, &[1.0]).unwrap();
            ratios.push(x, &[(0.1 * x[0] - 0.2 * x[1]).exp()]).unwrap();
        }
        let (sd, repeats, ensembles) = (0.02_f64, 10, 300);
        let exact = MeshRatio::of(&ratios, repeats).unwrap();
        assert!(
            (exact.ratio.value(&[1.3, 1.7]).unwrap()[0] - (0.13_f64 - 0.34).exp()).abs() < 1e-9
        );
        assert!(exact.packings[0][0] < 1e-18, "{exact:?}");
        let mesh = MeshRatio { packings: vec![vec![sd * sd]], ..exact };
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
        let (mut squares, mut stated) = (Vec::new(), 0.0);
        for _ in 0..ensembles {
            let (corrected, error) = mesh.corrected(&runs, &mut rng).unwrap();
            squares.extend(corrected.rows().skip(repeats).map(|(_, y)| y[0].ln().powi(2)));
            stated += error[0][0] / f64::from(ensembles);
        }
        let found = squares.iter().sum::<f64>() / squares.len() as f64 - sd * sd;
        // three terms and ten runs: about 0.3 s²; the mean over 300 ensembles has a standard error of some 5 %
        assert!((0.2..0.6).contains(&(stated / (sd * sd))), "{stated}");
        assert!((found / stated - 1.0).abs() < 0.25, "{found} {stated}");
    }
}
