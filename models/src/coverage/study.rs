//! Calibrates many experiments with a known truth, and counts how often the intervals contain the
//! truth.

use ppl::Nuts;
use ppl::diagnostics::quantile;
use rayon::prelude::*;
use surrogate::{CoefficientPosterior, DynPce, PceFit};

use crate::fracture::{CalibrationError, Evidence, Population, sample};
use crate::prior::Prior;

/// Probabilities of the central intervals whose coverage is determined.
const NOMINAL: [f64; 3] = [0.5, 0.9, 0.95];

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
    /// Known stiffness ratios, if the stiffness ratio is the last input of the forward model.
    pub stiffness: Option<KnownStiffness>,
}

impl Setting {
    /// Setting with a forward model that is assumed to be exact.
    pub fn exact(name: impl Into<String>, forward: DynPce) -> Self {
        Self { name: name.into(), forward, error: None, stiffness: None }
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
}

/// Coverage of the intervals of a nominal probability.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageRow {
    /// Name of the setting.
    pub setting: String,
    /// Name of the parameter.
    pub parameter: String,
    /// Probability of the central interval.
    pub nominal: f64,
    /// Fraction of the laboratories in which the interval contains the truth.
    pub covered: f64,
    /// Number of laboratories.
    pub laboratories: usize,
    /// Mean width of the interval, in the parameter's unit.
    pub mean_width: f64,
}

/// Study that calibrates many laboratories.
#[derive(Clone, Debug)]
pub struct CoverageStudy {
    /// Sampler of every calibration; the study replaces its seed and number of threads.
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

/// Intervals of one laboratory: lower and upper ends for each setting, parameter and probability.
type Intervals = Vec<Vec<[[f64; 2]; NOMINAL.len()]>>;

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
        type Found = (Vec<f64>, Intervals, Vec<(String, Vec<String>)>);
        let calibrated: Vec<Found> = (0..laboratories)
            .into_par_iter()
            .map(|k| {
                let (laboratory, settings) = make(k)?;
                let seed = self.seed.wrapping_add(k as u64);
                let intervals = settings
                    .iter()
                    .map(|setting| self.intervals(setting, &laboratory, seed))
                    .collect::<Result<Intervals, CalibrationError>>()?;
                let named = |setting: &Setting| {
                    let inputs = setting.forward.inputs().iter().take(laboratory.truth.len());
                    (setting.name.clone(), inputs.map(|input| input.name.clone()).collect())
                };
                let names = settings.iter().map(named).collect();
                on_finished(k);
                Ok((laboratory.truth, intervals, names))
            })
            .collect::<Result<_, E>>()?;
        let Some((_, _, names)) = calibrated.first() else { return Ok(Vec::new()) };
        let mut rows = Vec::new();
        for (s, (setting, parameters)) in names.iter().enumerate() {
            for (i, parameter) in parameters.iter().enumerate() {
                for (p, nominal) in NOMINAL.into_iter().enumerate() {
                    let (mut covered, mut width) = (0.0, 0.0);
                    for (truth, intervals, _) in &calibrated {
                        let [low, high] = intervals[s][i][p];
                        covered += f64::from(u8::from((low..=high).contains(&truth[i])));
                        width += high - low;
                    }
                    let n = calibrated.len() as f64;
                    rows.push(CoverageRow {
                        setting: setting.clone(),
                        parameter: parameter.clone(),
                        nominal,
                        covered: covered / n,
                        laboratories: calibrated.len(),
                        mean_width: width / n,
                    });
                }
            }
        }
        Ok(rows)
    }

    /// Calibrates a laboratory and returns the intervals of every parameter.
    fn intervals(
        &self,
        setting: &Setting,
        laboratory: &Laboratory,
        seed: u64,
    ) -> Result<Vec<[[f64; 2]; NOMINAL.len()]>, CalibrationError> {
        let ratios = laboratory.stiffness_ratios.iter().enumerate();
        let (known_inputs, population) = match &setting.stiffness {
            None => (Vec::new(), None),
            Some(KnownStiffness { specimens, population }) => {
                let known_inputs = ratios.map(|(i, &ratio)| (i < *specimens).then(|| vec![ratio]));
                (known_inputs.collect(), population.clone())
            }
        };
        let size = laboratory.truth.len();
        let qois = laboratory.specimens.clone();
        let coefficients = setting.error.iter().cloned().collect();
        let evidence = Evidence {
            qois,
            known: known_inputs,
            population,
            open: coefficients,
            ..Evidence::default()
        };
        let sampler = self.sampler.clone().seed(seed).threads(1);
        // uniform priors, because the true parameters are drawn uniformly and not from the priors of a case
        let priors = Prior::uniform_on(&setting.forward.inputs()[..size]);
        let posterior = sample(&setting.forward, &priors, &evidence, &sampler, seed)?;
        let group = &posterior.posterior;
        let theta = group.variables.iter().find(|variable| variable.name == "theta");
        let theta = theta.map_or(&[][..], |variable| &variable.data[..]);
        let interval = |i: usize| {
            let mut draws: Vec<f64> = theta.iter().skip(i).step_by(size).copied().collect();
            // sort once: `quantile` sorts its argument in each call, which is fast for sorted values
            draws.sort_by(f64::total_cmp);
            NOMINAL.map(|p| [quantile(&draws, 0.5 * (1.0 - p)), quantile(&draws, 0.5 * (1.0 + p))])
        };
        Ok((0..size).map(interval).collect())
    }
}
