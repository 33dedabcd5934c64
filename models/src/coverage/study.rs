//! Calibrates many experiments with a known truth, and counts how often the intervals contain the
//! truth.

use std::collections::BTreeMap;

use ppl::{Nuts, Posterior, SampleError};
use rayon::prelude::*;
use surrogate::{CoefficientPosterior, DynPce, PceFit};

use super::table::{CalibratedLaboratory, CoverageRow, SettingIntervals, intervals, rows};
use crate::fracture::{
    CalibrationError, Evidence, JointTest, JointTests, Population, calibration_over_tests, sample,
};
use crate::prior::Prior;

/// Synthetic experiment with a known truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Laboratory {
    /// True parameters: the centre of the scatter of the specimens.
    pub truth: Vec<f64>,
    /// Quantities of interest, one row per specimen.
    pub specimens: Vec<Vec<f64>>,
    /// Stiffness ratio of each specimen's microstructure; empty if the specimens were not scanned.
    pub stiffness_ratios: Vec<f64>,
}

/// Known stiffness ratios of specimens, and the distribution of the unknown ratios.
#[derive(Clone, Debug)]
pub struct KnownStiffness {
    /// Number n of specimens with a known ratio; the first n specimens of the laboratory have known
    /// ratios.
    pub specimens: usize,
    /// Distribution of the stiffness ratio of specimens whose ratio is unknown.
    pub population: Option<Population>,
}

/// A forward model, and its error in the calibration.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Name of the setting in the table.
    pub name: String,
    /// The forward model.
    pub forward: DynPce,
    /// Error of the forward model relative to the mean response over packings; `None` if the forward model is assumed
    /// to be exact.
    pub error: Option<CoefficientPosterior>,
    /// Covariance of a further error that all specimens share, relative to the means of the quantities, such as the error
    /// of a correction between meshes; empty without such an error.
    pub shared: Vec<Vec<f64>>,
    /// Known stiffness ratios, if the stiffness ratio is the last input of the forward model.
    pub stiffness: Option<KnownStiffness>,
}

impl Setting {
    /// Setting with a forward model that is assumed to be exact.
    pub fn exact(name: impl Into<String>, forward: DynPce) -> Self {
        Self { name: name.into(), forward, error: None, shared: Vec::new(), stiffness: None }
    }

    /// Setting with a surrogate of runs that have a separate packing each. All specimens share the error of the
    /// surrogate.
    pub fn shared(name: impl Into<String>, fit: PceFit) -> Self {
        Self { error: Some(fit.coefficients), ..Self::exact(name, fit.pce) }
    }

    /// Setting whose forward model has the stiffness ratio of a specimen's microstructure as its last input. The ratio
    /// is known for the first `specimens` specimens of a laboratory; `population` is the distribution of the other
    /// ratios.
    pub fn knowing_stiffness(self, specimens: usize, population: Option<Population>) -> Self {
        Self { stiffness: Some(KnownStiffness { specimens, population }), ..self }
    }

    /// Setting with a further error that all specimens share.
    pub fn sharing(self, covariance: Vec<Vec<f64>>) -> Self {
        Self { shared: covariance, ..self }
    }

    /// Setting with the same forward model, which is assumed to be exact. Its intervals are too narrow if the forward
    /// model has an error.
    pub fn without_error(self, name: impl Into<String>) -> Self {
        Self { name: name.into(), error: None, shared: Vec::new(), ..self }
    }

    /// Names of the parameters, which are the first `count` inputs of the forward model.
    fn parameters(&self, count: usize) -> Vec<String> {
        self.forward.inputs().iter().take(count).map(|input| input.name.clone()).collect()
    }

    /// Priors of the parameters. They are uniform, because the true parameters are drawn uniformly and not from the priors
    /// of a case.
    fn priors(&self, count: usize) -> Vec<Prior> {
        Prior::uniform_on(&self.forward.inputs()[..count])
    }

    /// Data of a laboratory, and the errors of the forward model.
    fn evidence(&self, laboratory: &Laboratory) -> Evidence {
        let ratios = laboratory.stiffness_ratios.iter().enumerate();
        let (known, population) = match &self.stiffness {
            None => (Vec::new(), None),
            Some(KnownStiffness { specimens, population }) => {
                let known = ratios.map(|(i, &ratio)| (i < *specimens).then(|| vec![ratio]));
                (known.collect(), population.clone())
            }
        };
        Evidence {
            qois: laboratory.specimens.clone(),
            known,
            population,
            shared: self.shared.clone(),
            open: self.error.iter().cloned().collect(),
        }
    }

    /// Converts to a test of a joint calibration, with the data of a laboratory.
    pub fn joint_test(&self, name: &str, laboratory: &Laboratory) -> JointTest {
        JointTest {
            name: name.to_owned(),
            forward: self.forward.clone(),
            priors: self.priors(laboratory.truth.len()),
            own: Vec::new(),
            evidence: self.evidence(laboratory),
        }
    }
}

/// Synthetic experiments of several tests of one material with a known truth.
#[derive(Clone, Debug)]
pub struct JointLaboratory {
    /// True parameters, which all tests share.
    pub truth: Vec<f64>,
    /// Settings of the joint calibration.
    pub settings: Vec<JointSetting>,
}

/// Setting of a joint calibration.
#[derive(Clone, Debug)]
pub struct JointSetting {
    /// Name of the setting in the table.
    pub name: String,
    /// Forward model, specimens and errors of each test. All tests have the same parameters in the same order.
    pub tests: Vec<JointTest>,
}

/// Study that calibrates many laboratories.
#[derive(Clone, Debug)]
pub struct CoverageStudy {
    /// Sampler of every calibration; the study replaces its seed. Do not set its number of threads: a sampler with its own
    /// threads lets the threads of the study begin further laboratories while they wait for it, up to all laboratories at
    /// once.
    pub sampler: Nuts<'static>,
    /// Seed of all random numbers.
    pub seed: u64,
}

impl Default for CoverageStudy {
    fn default() -> Self {
        let sampler = Nuts::default().chains(2).warmup(300).draws(600).target_accept(0.9);
        Self { sampler, seed: 1 }
    }
}

impl CoverageStudy {
    /// Calibrates the given number of laboratories. `make(k)` returns laboratory k and its settings; all laboratories
    /// must have settings of the same names in the same order. Returns a row for each setting, parameter and nominal
    /// probability.
    ///
    /// Laboratories are made and calibrated on all threads; the table depends only on the seed. `on_finished` is called with
    /// the number of each finished laboratory.
    ///
    /// # Errors
    /// The first error of a calibration or of `make`.
    pub fn run<E: From<CalibrationError> + Send>(
        &self,
        laboratories: usize,
        make: impl Fn(usize) -> Result<(Laboratory, Vec<Setting>), E> + Sync,
        on_finished: impl Fn(usize) + Sync,
    ) -> Result<Vec<CoverageRow>, E> {
        let calibrated = |k| {
            let (laboratory, settings) = make(k)?;
            let size = laboratory.truth.len();
            let calibrated = |setting: &Setting| {
                let (priors, evidence) = (setting.priors(size), setting.evidence(&laboratory));
                let seed = self.seed_of(k);
                let sampler = self.sampler.clone().seed(seed);
                let posterior = sample(&setting.forward, &priors, &evidence, &sampler, seed)?;
                Ok(SettingIntervals {
                    setting: setting.name.clone(),
                    parameters: setting.parameters(size),
                    intervals: intervals(theta(&posterior), size),
                })
            };
            let settings = settings.iter().map(calibrated).collect::<Result<_, CalibrationError>>();
            Ok(CalibratedLaboratory { settings: settings?, truth: laboratory.truth })
        };
        self.on_all_threads(laboratories, calibrated, on_finished)
    }

    /// Calibrates the given number of laboratories like [`Self::run`]. Each laboratory has several tests of one material,
    /// which are calibrated jointly.
    ///
    /// # Errors
    /// The first error of a calibration or of `make`.
    pub fn run_joint<E: From<CalibrationError> + Send>(
        &self,
        laboratories: usize,
        make: impl Fn(usize) -> Result<JointLaboratory, E> + Sync,
        on_finished: impl Fn(usize) + Sync,
    ) -> Result<Vec<CoverageRow>, E> {
        let calibrated = |k| {
            let JointLaboratory { truth, settings } = make(k)?;
            let calibrated = |JointSetting { name, tests }: &JointSetting| {
                let posterior = self.joint_posterior(tests, k)?;
                let first = tests.first().map_or(&[][..], |test| test.forward.inputs());
                let parameters = first.iter().take(truth.len()).map(|input| input.name.clone());
                Ok(SettingIntervals {
                    setting: name.clone(),
                    parameters: parameters.collect(),
                    intervals: intervals(theta(&posterior), truth.len()),
                })
            };
            let settings = settings.iter().map(calibrated).collect::<Result<_, CalibrationError>>();
            Ok(CalibratedLaboratory { settings: settings?, truth })
        };
        self.on_all_threads(laboratories, calibrated, on_finished)
    }

    /// Samples the joint posterior of the tests of laboratory `k`, which share all parameters.
    pub(super) fn joint_posterior(
        &self,
        tests: &[JointTest],
        k: usize,
    ) -> Result<Posterior, CalibrationError> {
        let prepared = JointTests::new(tests, &BTreeMap::new())?;
        let model = calibration_over_tests(&prepared);
        let seed = self.seed_of(k);
        let sampler = self.sampler.clone().seed(seed);
        let chains = sampler.run(&model).map_err(SampleError::from)?;
        Ok(Posterior::from_chains(&model, chains, seed)?)
    }

    fn seed_of(&self, laboratory: usize) -> u64 {
        self.seed.wrapping_add(laboratory as u64)
    }

    fn on_all_threads<E: Send>(
        &self,
        laboratories: usize,
        calibrated: impl Fn(usize) -> Result<CalibratedLaboratory, E> + Sync,
        on_finished: impl Fn(usize) + Sync,
    ) -> Result<Vec<CoverageRow>, E> {
        let calibrated = |k| {
            let laboratory = calibrated(k)?;
            on_finished(k);
            Ok(laboratory)
        };
        let all: Vec<CalibratedLaboratory> =
            (0..laboratories).into_par_iter().map(calibrated).collect::<Result<_, E>>()?;
        Ok(rows(&all))
    }
}

/// Draws of the parameters, one row per draw.
pub(super) fn theta(posterior: &Posterior) -> &[f64] {
    posterior.posterior.get("theta").map_or(&[], |values| &values.data)
}
