//! Synthetic laboratories: a known response replaces the simulations of specimens and ensembles.

use nalgebra::{Cholesky, DMatrix, Dyn};
use rand::{Rng, SeedableRng};
use rand_distr::StandardNormal;
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, SurrogateError};

use super::study::{Laboratory, Setting};
use crate::fracture::{CalibrationError, Population};

/// Synthetic model of laboratories: the mean response over packings is a known surrogate, and the responses of single
/// packings scatter about the mean.
///
/// Each laboratory draws its own true parameters, specimens and ensembles, as if all experiments and simulations had
/// been repeated.
#[derive(Clone, Debug)]
pub struct Emulated {
    /// Mean response over packings. If `stiffness` is set, the last input is the stiffness ratio, and the response is
    /// the mean over packings with this ratio.
    pub response: DynPce,
    /// Mean and standard deviation of the stiffness ratio of packings, if it is an input of the response.
    pub stiffness: Option<[f64; 2]>,
    /// Covariance (quantities × quantities) of the logarithms of the quantities between packings.
    pub packings: Vec<Vec<f64>>,
    /// Standard deviation of the logarithm of each parameter between specimens.
    pub scatter: Vec<f64>,
    /// Relative standard deviation of a quantity due to measurement noise.
    pub noise: f64,
    /// Number of specimens of a laboratory.
    pub specimens: usize,
    /// Fraction of each side of the prior box, around its centre, from which true parameters are drawn.
    pub inner: f64,
    /// Number of runs of an ensemble.
    pub runs: usize,
    /// Sampling method of the ensemble.
    pub method: DesignMethod,
    /// Options of the surrogate fits.
    pub fit: FitOptions,
}

impl Emulated {
    /// Draws a laboratory and the forward models for its calibration: (1) the exact response; (2) a surrogate of runs
    /// that each have a separate packing, with the shared error of this surrogate; (3) a surrogate of runs with a
    /// single packing, which is assumed to be exact, as in the paper. If the stiffness ratio is an input of the
    /// response, there are also surrogates with this input: the ratio is known for no specimen, for the first half of
    /// the specimens, or for all specimens.
    ///
    /// # Errors
    /// If a covariance is not positive definite, or an ensemble cannot be fitted.
    pub fn laboratory(&self, seed: u64) -> Result<(Laboratory, Vec<Setting>), CalibrationError> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
        let truth = self.truth(&mut rng);
        let (specimens, stiffness_ratios) = self.specimens(&truth, &mut rng)?;
        let exact = Setting::exact("exact", self.response.clone());
        let (per_run, ratios) = self.ensemble(true, &mut rng)?;
        let of_runs = Setting::shared("packing per run", DynPce::fit(&per_run, &self.fit)?);
        let mut settings = match self.stiffness {
            None => vec![exact, of_runs],
            Some([mean, sd]) => {
                let whole = Population::normal(vec![mean], vec![sd], f64::INFINITY);
                vec![exact.knowing_stiffness(0, Some(whole)), of_runs]
            }
        };
        if self.stiffness.is_some() {
            let population = |known_ratios: usize| {
                let members = ratios.iter().chain(&stiffness_ratios[..known_ratios]);
                Population::of(&members.map(|&ratio| vec![ratio]).collect::<Vec<_>>())
            };
            let seen = [&population(0)?.places().concat()[..], &stiffness_ratios].concat();
            let fit = DynPce::fit(&with_ratios(&per_run, &ratios, &seen)?, &self.fit)?;
            for (name, known_ratios) in [
                ("stiffness unknown", 0),
                ("stiffness half known", self.specimens / 2),
                ("stiffness known", self.specimens),
            ] {
                let setting = Setting::shared(name, fit.clone());
                settings
                    .push(setting.knowing_stiffness(known_ratios, Some(population(known_ratios)?)));
            }
        }
        let (one, _) = self.ensemble(false, &mut rng)?;
        settings.push(Setting::exact("one packing", DynPce::fit(&one, &self.fit)?.pce));
        Ok((Laboratory { truth, specimens, stiffness_ratios }, settings))
    }

    /// Inputs of the response that are parameters (all except the stiffness ratio).
    fn parameters(&self) -> &[Input] {
        let inputs = self.response.inputs();
        &inputs[..inputs.len() - usize::from(self.stiffness.is_some())]
    }

    /// Draws the stiffness ratio of a microstructure, if it is an input of the response.
    fn ratio<R: Rng>(&self, rng: &mut R) -> Option<f64> {
        self.stiffness.map(|[mean, sd]| mean + sd * rng.sample::<f64, _>(StandardNormal))
    }

    /// Draws true parameters from the inner part of the prior box.
    pub fn truth<R: Rng>(&self, rng: &mut R) -> Vec<f64> {
        let position = |rng: &mut R| 0.5 + self.inner * (rng.random::<f64>() - 0.5);
        let inputs = self.parameters().iter();
        inputs.map(|input| input.lower + position(rng) * (input.upper - input.lower)).collect()
    }

    /// Draws the quantities and stiffness ratios of the specimens. The response is linearised about the true
    /// parameters, so that it is never evaluated outside the prior box.
    fn specimens<R: Rng>(
        &self,
        truth: &[f64],
        rng: &mut R,
    ) -> Result<(Vec<Vec<f64>>, Vec<f64>), CalibrationError> {
        let factor = self.factor()?;
        let (mut rows, mut ratios) = (Vec::new(), Vec::new());
        for _ in 0..self.specimens {
            let ratio = self.ratio(rng);
            let inputs: Vec<f64> = truth.iter().copied().chain(ratio).collect();
            let (mean, jacobian) = self.response.value_and_jacobian(&inputs)?;
            let mut normal = || rng.sample::<f64, _>(StandardNormal);
            let parameters: Vec<f64> = self.scatter.iter().map(|sd| sd * normal()).collect();
            let packing = factor.l() * nalgebra::DVector::from_fn(mean.len(), |_, _| normal());
            let row = (0..mean.len()).map(|m| {
                let moved = (0..truth.len())
                    .map(|i| jacobian[m][i] * truth[i] / mean[m] * parameters[i])
                    .sum::<f64>();
                mean[m] * (moved + packing[m] + self.noise * normal()).exp()
            });
            rows.push(row.collect());
            ratios.extend(ratio);
        }
        Ok((rows, ratios))
    }

    /// Draws runs over the prior box and their stiffness ratios. Each run has its own packing (`per_run`), or all runs
    /// share one packing.
    fn ensemble<R: Rng>(
        &self,
        per_run: bool,
        rng: &mut R,
    ) -> Result<(Dataset, Vec<f64>), CalibrationError> {
        let inputs = self.parameters().to_vec();
        let parameter_points = self.method.sample(&inputs, self.runs, rng.random())?;
        let outputs = self.response.outputs().to_vec();
        let mut data = Dataset::new(inputs, outputs, "emulated")?;
        let mut ratios = Vec::new();
        let factor = self.factor()?;
        let size = self.packings.len();
        let packing = |rng: &mut R| {
            let normal = nalgebra::DVector::from_fn(size, |_, _| rng.sample(StandardNormal));
            (factor.l() * normal, self.ratio(rng))
        };
        let common = packing(rng);
        for x in parameter_points {
            let (deviations, ratio) = if per_run { packing(rng) } else { common.clone() };
            let inputs: Vec<f64> = x.iter().copied().chain(ratio).collect();
            let mean = self.response.value(&inputs)?;
            let quantities: Vec<f64> =
                mean.iter().zip(deviations.iter()).map(|(mean, z)| mean * z.exp()).collect();
            data.push(&x, &quantities)?;
            ratios.extend(ratio);
        }
        Ok((data, ratios))
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

/// Adds the stiffness ratios of the runs as the last input, `stiffness_ratio`. The range of the input also includes the
/// ratios in `seen`, which occur in the population and in specimens.
///
/// # Errors
/// If a ratio is not finite, or all ratios are equal.
pub fn with_ratios(
    runs: &Dataset,
    ratios: &[f64],
    seen: &[f64],
) -> Result<Dataset, CalibrationError> {
    let all = || ratios.iter().chain(seen).copied();
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut inputs = runs.inputs().to_vec();
    inputs.push(Input::new("stiffness_ratio", low, high)?);
    let mut data = Dataset::new(inputs, runs.outputs().to_vec(), "emulated")?;
    for ((x, y), &ratio) in runs.rows().zip(ratios) {
        data.push(&[x, &[ratio]].concat(), y)?;
    }
    Ok(data)
}

#[cfg(test)]
mod tests {
    use super::super::{CoverageRow, CoverageStudy};
    use super::*;
    use crate::case::{CaseFile, PriorCase};
    use crate::qoi::Quantity;

    /// Viscous limit: slope ~ E, peak force ~ E^(2/3) ξ^(1/3), displacement at peak ~ (ξ/E)^(1/3),
    /// independent of Gc. If the stiffness ratio is an input, each quantity is multiplied by a power of the ratio; the
    /// exponents are taken from simulated packings.
    fn viscous_limit(prior: &PriorCase, stiffness: Option<Input>) -> DynPce {
        let inputs: Vec<Input> = prior.inputs().unwrap().into_iter().chain(stiffness).collect();
        let parameter_points = DesignMethod::Sobol.sample(&inputs, 256, 1).unwrap();
        let outputs = Quantity::of_the_paper().map(|q| q.column().into_owned()).to_vec();
        let mut data = Dataset::new(inputs, outputs, "closed form").unwrap();
        for x in parameter_points {
            let (young, viscosity) = (x[0], x[2]);
            let ratio = (viscosity / young).cbrt();
            let k = x.get(3).copied().unwrap_or(1.0);
            let powers = [0.93, 1.05, 0.33].map(|power| k.powf(power));
            let y = [5.0 * young, 4.0 * young * ratio, ratio];
            data.push(&x, &[y[0] * powers[0], y[1] * powers[1], y[2] * powers[2]]).unwrap();
        }
        DynPce::fit(&data, &FitOptions::default()).unwrap().pce
    }

    fn world(prior: &PriorCase) -> Emulated {
        Emulated {
            response: viscous_limit(prior, None),
            stiffness: None,
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
        }
    }

    fn study() -> CoverageStudy {
        CoverageStudy {
            sampler: ppl::Nuts::default().chains(1).warmup(200).draws(300),
            ..CoverageStudy::default()
        }
    }

    fn at<'a>(
        rows: &'a [CoverageRow],
        setting: &str,
        parameter: &str,
        nominal: f64,
    ) -> &'a CoverageRow {
        let is = |row: &&CoverageRow| {
            row.setting == setting && row.parameter == parameter && row.nominal == nominal
        };
        rows.iter().find(is).unwrap()
    }

    /// Intervals cover the truth as often as stated with exact forward models and with shared errors, but not with one
    /// packing for all runs, as in the paper.
    #[test]
    fn a_packing_for_each_run_covers_and_one_packing_does_not() {
        let prior = CaseFile::default_case().case.prior.unwrap();
        let (world, n) = (world(&prior), 32);
        let rows = study().run(n, |k| world.laboratory(k as u64), |_| ()).unwrap();
        assert_eq!(rows.len(), 3 * 3 * 3);
        // 90 % minus two binomial standard errors: intervals with the correct coverage pass in 97 or 98 of 100 studies
        let least = 0.9 - 2.0 * (0.9 * 0.1 / n as f64).sqrt();
        for parameter in ["matrix.young_mpa", "matrix.viscosity_mpa_s"] {
            for setting in ["exact", "packing per run"] {
                let row = at(&rows, setting, parameter, 0.9);
                assert!(row.covered >= least, "{row:?}");
                let half = at(&rows, setting, parameter, 0.5);
                assert!(row.mean_width > 2.0 * half.mean_width, "{row:?}");
            }
            let row = at(&rows, "one packing", parameter, 0.9);
            assert!(row.covered < least, "{row:?}");
        }
    }

    /// If the stiffness ratio explains the scatter of packings, intervals cover the truth for any
    /// number of known ratios. The more ratios are known, the narrower are the intervals of E.
    #[test]
    fn stiffness_ratios_of_some_specimens_narrow_intervals_that_cover() {
        let prior = CaseFile::default_case().case.prior.unwrap();
        let ratio = [1.5, 0.045];
        let reach = |by: f64| ratio[0] + by * ratio[1];
        let input = Input::new("stiffness_ratio", reach(-6.0), reach(6.0)).unwrap();
        let world = Emulated {
            response: viscous_limit(&prior, Some(input)),
            stiffness: Some(ratio),
            packings: (0..3)
                .map(|i| (0..3).map(|j| if i == j { 0.01f64.powi(2) } else { 0.0 }).collect())
                .collect(),
            ..world(&prior)
        };
        let n = 32;
        let rows = study().run(n, |k| world.laboratory(k as u64), |_| ()).unwrap();
        assert_eq!(rows.len(), 6 * 3 * 3);
        // three binomial standard errors, because ten fractions are tested
        let least = 0.9 - 3.0 * (0.9 * 0.1 / n as f64).sqrt();
        let settings =
            ["packing per run", "stiffness unknown", "stiffness half known", "stiffness known"];
        for parameter in ["matrix.young_mpa", "matrix.viscosity_mpa_s"] {
            for setting in ["exact"].iter().chain(&settings) {
                let row = at(&rows, setting, parameter, 0.9);
                assert!(row.covered >= least, "{row:?}");
            }
        }
        let widths = settings.map(|s| at(&rows, s, "matrix.young_mpa", 0.9).mean_width);
        assert!(widths.is_sorted_by(|a, b| a > b), "{widths:?}");
    }
}
