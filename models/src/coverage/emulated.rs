//! Laboratories whose specimens and ensembles come from a known response instead of simulations.

use nalgebra::{Cholesky, DMatrix, Dyn};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, SurrogateError};

use super::study::{Laboratory, Setting};
use crate::fracture::CalibrationError;

/// A world in which the mean response over packings is a known surrogate, and packings scatter about it.
///
/// Each laboratory draws a truth, specimens about it, and ensembles of its own: what a calibration would
/// have seen had everything been done again.
#[derive(Clone, Debug)]
pub struct Emulated {
    /// The mean response.
    pub response: DynPce,
    /// Covariance (quantities × quantities) of the logarithms of the quantities between packings.
    pub packings: Vec<Vec<f64>>,
    /// Standard deviation of the logarithm of each parameter between specimens.
    pub scatter: Vec<f64>,
    /// Relative standard deviation of a quantity by the noise of readings.
    pub noise: f64,
    /// Specimens of a laboratory.
    pub specimens: usize,
    /// Fraction of each side of the prior box, around its middle, that truths are drawn from.
    pub inner: f64,
    /// Runs of an ensemble, and how they fill the box.
    pub runs: usize,
    /// How the runs fill the box.
    pub method: DesignMethod,
    /// How surrogates are fitted.
    pub fit: FitOptions,
}

impl Emulated {
    /// A laboratory with three settings: the exact response, a surrogate from a packing for each run with
    /// its shared error, and one from a single packing that is taken to be exact (the paper's way).
    ///
    /// # Errors
    /// Covariances that are not positive definite; ensembles that cannot be fitted.
    pub fn laboratory(&self, seed: u64) -> Result<(Laboratory, Vec<Setting>), CalibrationError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let truth = self.truth(&mut rng);
        let specimens = self.specimens(&truth, &mut rng)?;
        let settings = vec![
            Setting::exact("exact", self.response.clone()),
            Setting::shared(
                "packing per run",
                DynPce::fit(&self.ensemble(true, &mut rng)?, &self.fit)?,
            ),
            Setting::exact(
                "one packing",
                DynPce::fit(&self.ensemble(false, &mut rng)?, &self.fit)?.pce,
            ),
        ];
        Ok((Laboratory { truth, specimens, stiffness_ratios: Vec::new() }, settings))
    }

    /// A truth in the inner part of the box.
    pub fn truth<R: Rng>(&self, rng: &mut R) -> Vec<f64> {
        let place = |rng: &mut R| 0.5 + self.inner * (rng.random::<f64>() - 0.5);
        let inputs = self.response.inputs().iter();
        inputs.map(|input| input.lower + place(rng) * (input.upper - input.lower)).collect()
    }

    /// Quantities of specimens: parameters scatter to first order, so that none leaves the box.
    fn specimens<R: Rng>(
        &self,
        truth: &[f64],
        rng: &mut R,
    ) -> Result<Vec<Vec<f64>>, CalibrationError> {
        let (mean, jacobian) = self.response.value_and_jacobian(truth)?;
        let factor = self.factor()?;
        let specimen = |rng: &mut R| {
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            let parameters: Vec<f64> = self.scatter.iter().map(|sd| sd * normal()).collect();
            let packing = factor.l() * nalgebra::DVector::from_fn(mean.len(), |_, _| normal());
            (0..mean.len())
                .map(|m| {
                    let moved = (0..truth.len())
                        .map(|i| jacobian[m][i] * truth[i] / mean[m] * parameters[i])
                        .sum::<f64>();
                    mean[m] * (moved + packing[m] + self.noise * normal()).exp()
                })
                .collect()
        };
        Ok((0..self.specimens).map(|_| specimen(rng)).collect())
    }

    /// Runs over the box, each with a packing of its own or all with the same.
    fn ensemble<R: Rng>(&self, per_run: bool, rng: &mut R) -> Result<Dataset, CalibrationError> {
        let inputs = self.response.inputs().to_vec();
        let points = self.method.sample(&inputs, self.runs, rng.random())?;
        let outputs = self.response.outputs().to_vec();
        let mut data = Dataset::new(inputs, outputs, "emulated")?;
        let factor = self.factor()?;
        let size = self.packings.len();
        let mut packing =
            || factor.l() * nalgebra::DVector::from_fn(size, |_, _| rng.sample(StandardNormal));
        let common = packing();
        for x in points {
            let own = if per_run { packing() } else { common.clone() };
            let mean = self.response.value(&x)?;
            let quantities: Vec<f64> =
                mean.iter().zip(own.iter()).map(|(mean, z)| mean * z.exp()).collect();
            data.push(&x, &quantities)?;
        }
        Ok(data)
    }

    fn factor(&self) -> Result<Cholesky<f64, Dyn>, CalibrationError> {
        let size = self.packings.len();
        let covariance = DMatrix::from_fn(size, size, |i, j| self.packings[i][j]);
        Cholesky::new(covariance).ok_or_else(|| {
            let value = format!("{:?}", self.packings);
            let allowed = "positive definite".to_owned();
            SurrogateError::Option { option: "covariance between packings", value, allowed }.into()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::CoverageStudy;
    use super::*;
    use crate::case::{CaseFile, PriorCase};
    use crate::qoi::Quantity;

    /// The viscous limit of definitions 3.3: m ~ E, F ~ E^(2/3) ξ^(1/3), d ~ (ξ/E)^(1/3), no Gc.
    fn viscous_limit(prior: &PriorCase) -> DynPce {
        let inputs = prior.inputs().unwrap();
        let points = DesignMethod::Sobol.sample(&inputs, 128, 1).unwrap();
        let outputs = Quantity::OF_THE_PAPER.map(|q| q.column().into_owned()).to_vec();
        let mut data = Dataset::new(inputs, outputs, "closed form").unwrap();
        for x in points {
            let (young, viscosity) = (x[0], x[2]);
            let place = (viscosity / young).cbrt();
            data.push(&x, &[5.0 * young, 4.0 * young * place, place]).unwrap();
        }
        DynPce::fit(&data, &FitOptions::default()).unwrap().pce
    }

    /// Exact forward models and shared errors cover as promised; the paper's way, which takes one packing
    /// for all, does not.
    #[test]
    fn a_packing_for_each_run_covers_and_one_packing_does_not() {
        let prior = CaseFile::default_case().case.prior.unwrap();
        let world = Emulated {
            response: viscous_limit(&prior),
            packings: (0..3)
                .map(|i| (0..3).map(|j| if i == j { 0.03f64.powi(2) } else { 3e-4 }).collect())
                .collect(),
            scatter: vec![0.02, 0.1, 0.05],
            noise: 0.002,
            specimens: 8,
            inner: 0.8,
            runs: 40,
            method: DesignMethod::LatinHypercube,
            fit: FitOptions { max_order: 2, ..FitOptions::default() },
        };
        let study = CoverageStudy {
            sampler: ppl::Nuts::default().chains(1).warmup(200).draws(300),
            ..CoverageStudy::default()
        };
        let n = 32;
        let rows = study.run(n, |k| world.laboratory(k as u64), |_| ()).unwrap();
        assert_eq!(rows.len(), 3 * 3 * 3);
        // 90 % less two binomial standard errors: honest intervals reach it in 97 or 98 of 100 studies
        let least = 0.9 - 2.0 * (0.9 * 0.1 / n as f64).sqrt();
        let at = |setting: &str, parameter: &str, nominal: f64| {
            let found = rows.iter().find(|row| {
                row.setting == setting && row.parameter == parameter && row.nominal == nominal
            });
            found.unwrap().clone()
        };
        for parameter in ["matrix.young_mpa", "matrix.viscosity_mpa_s"] {
            for setting in ["exact", "packing per run"] {
                let row = at(setting, parameter, 0.9);
                assert!(row.covered >= least, "{row:?}");
                assert!(row.mean_width > 2.0 * at(setting, parameter, 0.5).mean_width, "{row:?}");
            }
            let row = at("one packing", parameter, 0.9);
            assert!(row.covered < least, "{row:?}");
        }
    }
}
