//! Calibrations of many experiments with a known truth, and how often their intervals hold it.

use ppl::Nuts;
use rayon::prelude::*;
use surrogate::{CoefficientPosterior, DynPce, PceFit};

use crate::fracture::{CalibrationError, Evidence, Population, sample};

/// The central intervals that are looked at.
const NOMINAL: [f64; 3] = [0.5, 0.9, 0.95];

/// An experiment with a known truth.
#[derive(Clone, Debug, PartialEq)]
pub struct Laboratory {
    /// The parameters that its specimens scatter around.
    pub truth: Vec<f64>,
    /// Quantities of interest, one row a specimen.
    pub specimens: Vec<Vec<f64>>,
    /// The stiffness ratio of each specimen's microstructure, if it was scanned.
    pub stiffness_ratios: Vec<f64>,
}

/// Which specimens' stiffness ratio a calibration knows.
#[derive(Clone, Debug)]
pub struct KnownStiffness {
    /// The first so many of a laboratory.
    pub specimens: usize,
    /// What it may be of the others.
    pub population: Option<Population>,
}

/// A forward model, and the error that a calibration with it admits.
#[derive(Clone, Debug)]
pub struct Setting {
    /// Its name in the table.
    pub name: String,
    /// The forward model.
    pub forward: DynPce,
    /// How well it is known as the mean response over packings; none: it is taken to be exact.
    pub error: Option<CoefficientPosterior>,
    /// What is known of its last input if that is the stiffness ratio.
    pub stiffness: Option<KnownStiffness>,
}

impl Setting {
    /// A forward model that is taken to be exact.
    pub fn exact(name: impl Into<String>, forward: DynPce) -> Self {
        Self { name: name.into(), forward, error: None, stiffness: None }
    }

    /// A forward model from runs with a packing each, whose error all specimens share.
    pub fn shared(name: impl Into<String>, fit: PceFit) -> Self {
        Self { error: Some(fit.coefficients), ..Self::exact(name, fit.pce) }
    }

    /// The same with the stiffness ratio of a specimen's own microstructure as its last input, which is known of
    /// the first so many specimens of a laboratory; of the others the population says what it may be.
    pub fn knowing_stiffness(self, specimens: usize, population: Option<Population>) -> Self {
        Self { stiffness: Some(KnownStiffness { specimens, population }), ..self }
    }
}

/// How often intervals of a nominal probability held the truth.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageRow {
    /// Name of the setting.
    pub setting: String,
    /// Name of the parameter.
    pub parameter: String,
    /// Probability of the central interval.
    pub nominal: f64,
    /// Fraction of the laboratories in which it held the truth.
    pub covered: f64,
    /// Number of laboratories.
    pub laboratories: usize,
    /// Mean width of the interval, in the parameter's unit.
    pub mean_width: f64,
}

/// Calibrations of many laboratories.
#[derive(Clone, Debug)]
pub struct CoverageStudy {
    /// Sampler of every calibration; seed and threads are replaced.
    pub sampler: Nuts<'static>,
    /// Seed of everything.
    pub seed: u64,
}

impl Default for CoverageStudy {
    fn default() -> Self {
        let sampler = Nuts::default().chains(2).warmup(300).draws(600).target_accept(0.9);
        Self { sampler, seed: 1 }
    }
}

/// Intervals of one laboratory: of each setting, parameter and probability the ends.
type Intervals = Vec<Vec<[[f64; 2]; NOMINAL.len()]>>;

impl CoverageStudy {
    /// Calibrates so many laboratories by all settings that come with each, which have to be the same
    /// ones every time. A table row for each setting, parameter and nominal probability.
    ///
    /// Laboratories are made and calibrated on all threads; the table depends on the seed alone.
    /// `told` is called after each, with its number.
    ///
    /// # Errors
    /// What stops a calibration, or the making of a laboratory.
    pub fn run<E: From<CalibrationError> + Send>(
        &self,
        laboratories: usize,
        make: impl Fn(usize) -> Result<(Laboratory, Vec<Setting>), E> + Sync,
        told: impl Fn(usize) + Sync,
    ) -> Result<Vec<CoverageRow>, E> {
        type Found = (Vec<f64>, Intervals, Vec<(String, Vec<String>)>);
        let found: Vec<Found> = (0..laboratories)
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
                told(k);
                Ok((laboratory.truth, intervals, names))
            })
            .collect::<Result<_, E>>()?;
        let Some((_, _, names)) = found.first() else { return Ok(Vec::new()) };
        let mut rows = Vec::new();
        for (s, (setting, parameters)) in names.iter().enumerate() {
            for (i, parameter) in parameters.iter().enumerate() {
                for (p, nominal) in NOMINAL.into_iter().enumerate() {
                    let (mut covered, mut width) = (0.0, 0.0);
                    for (truth, intervals, _) in &found {
                        let [low, high] = intervals[s][i][p];
                        covered += f64::from(u8::from((low..=high).contains(&truth[i])));
                        width += high - low;
                    }
                    let n = found.len() as f64;
                    rows.push(CoverageRow {
                        setting: setting.clone(),
                        parameter: parameter.clone(),
                        nominal,
                        covered: covered / n,
                        laboratories: found.len(),
                        mean_width: width / n,
                    });
                }
            }
        }
        Ok(rows)
    }

    /// The intervals of every parameter.
    fn intervals(
        &self,
        setting: &Setting,
        laboratory: &Laboratory,
        seed: u64,
    ) -> Result<Vec<[[f64; 2]; NOMINAL.len()]>, CalibrationError> {
        let ratios = laboratory.stiffness_ratios.iter().enumerate();
        let (known, population) = match &setting.stiffness {
            None => (Vec::new(), None),
            Some(KnownStiffness { specimens, population }) => {
                let known = ratios.map(|(i, &ratio)| (i < *specimens).then(|| vec![ratio]));
                (known.collect(), population.clone())
            }
        };
        let size = laboratory.truth.len();
        let qois = laboratory.specimens.clone();
        let open = setting.error.iter().cloned().collect();
        let evidence = Evidence { qois, known, population, open, ..Evidence::default() };
        let sampler = self.sampler.clone().seed(seed).threads(1);
        let posterior = sample(&setting.forward, &evidence, &sampler, seed)?;
        let group = &posterior.posterior;
        let theta = group.variables.iter().find(|variable| variable.name == "theta");
        let theta = theta.map_or(&[][..], |variable| &variable.data[..]);
        let of = |i: usize| {
            let mut draws: Vec<f64> = theta.iter().skip(i).step_by(size).copied().collect();
            draws.sort_by(f64::total_cmp);
            NOMINAL.map(|p| [quantile(&draws, 0.5 * (1.0 - p)), quantile(&draws, 0.5 * (1.0 + p))])
        };
        Ok((0..size).map(of).collect())
    }
}

/// The quantile of sorted values, between the two nearest.
fn quantile(sorted: &[f64], p: f64) -> f64 {
    let Some(last) = sorted.len().checked_sub(1) else { return f64::NAN };
    let place = p * last as f64;
    let (below, part) = (place.floor() as usize, place.fract());
    sorted[below] + part * (sorted[last.min(below + 1)] - sorted[below])
}
