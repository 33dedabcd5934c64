//! Stiffness ratios of runs and specimens. The ratio is an input of the surrogate. The ratio is known for specimens
//! with an image; the unknown ratios of other specimens have the distribution of a population.

use surrogate::{Dataset, DynPce, Input, SurrogateError};

use crate::error::InputError;
use crate::fracture::Population;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::runs::made_on::{LEAST_FOR_STIFFNESS, MadeOn, specimen_of};
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::table::{CsvTable, TableRow};

/// Stiffness ratio of each specimen used in the calibration; `None` for a specimen without an image.
pub(crate) fn of_specimens(inputs: &Inputs<'_>) -> Result<Vec<Option<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id"])?;
    let ratio = |row: TableRow<'_>| match row.text(STIFFNESS_RATIO).is_empty() {
        true => Ok(None),
        false => row.positive(STIFFNESS_RATIO).map(Some),
    };
    Ok(table.rows().map(ratio).collect::<Result<_, InputError>>()?)
}

/// Stiffness ratio of the microstructure of each run; `None` unless all runs have a ratio.
fn of_runs(runs: &Dataset) -> Option<Vec<f64>> {
    (0..runs.len()).map(|i| runs.note(i, STIFFNESS_RATIO)?.parse().ok()).collect()
}

/// Population of stiffness ratios. Its members are the microstructures of the design, each counted once, and the
/// specimens with an image. `None` if the runs have no ratios, or if there are too few members.
pub(crate) fn population(runs: &Dataset, specimens: &[Option<f64>]) -> Option<Population> {
    let mut members: Vec<(&str, f64)> = Vec::new();
    for (i, ratio) in of_runs(runs)?.into_iter().enumerate() {
        let name = specimen_of(runs, i);
        if !members.iter().any(|(other, _)| *other == name) {
            members.push((name, ratio));
        }
    }
    let of_design: Vec<f64> = members.into_iter().map(|(_, ratio)| ratio).collect();
    // a specimen whose image is also an image of the design has the same ratio as the design's image; count it once
    let others = specimens.iter().flatten().copied().filter(|ratio| !of_design.contains(ratio));
    let all: Vec<Vec<f64>> =
        of_design.iter().copied().chain(others).map(|ratio| vec![ratio]).collect();
    Population::of(&all).ok()
}

/// Stiffness ratios of the specimens, for a surrogate that has the ratio as an input.
#[derive(Clone, Debug, Default)]
pub(crate) struct KnownStiffness {
    /// Ratio of each specimen, if known; empty if the ratio is not an input of the surrogate.
    ratios: Vec<Option<f64>>,
    /// Distribution of the unknown ratios.
    pub(crate) population: Option<Population>,
    /// Note for the user about specimens whose ratio is unknown or not used.
    pub(crate) note: Option<String>,
    pub(crate) warning: Option<String>,
}

impl KnownStiffness {
    /// Collects the stiffness ratios of the specimens for `pce`, a surrogate of the runs.
    pub(crate) fn of(pce: &DynPce, runs: &Dataset, specimens: &[Option<f64>]) -> Self {
        if pce.inputs().last().is_none_or(|input| input.name != STIFFNESS_RATIO) {
            return Self { note: left_out(runs, specimens), ..Self::default() };
        }
        let population = population(runs, specimens);
        Self {
            note: population.as_ref().and_then(|p| in_words(specimens, p)),
            warning: unlike_design(runs, specimens),
            population,
            ratios: specimens.to_vec(),
        }
    }

    /// Whether the ratio is an input of the surrogate.
    pub(crate) fn is_input(&self) -> bool {
        !self.ratios.is_empty()
    }

    /// One row per specimen with its ratio; `None` if the ratio is unknown.
    pub(crate) fn rows(&self) -> Vec<Option<Vec<f64>>> {
        self.ratios.iter().map(|ratio| ratio.map(|k| vec![k])).collect()
    }
}

/// Returns a note about specimens whose ratio is known but not used, because the runs use too few specimens.
fn left_out(runs: &Dataset, specimens: &[Option<f64>]) -> Option<String> {
    let count = MadeOn::of(runs).several().filter(|count| *count < LEAST_FOR_STIFFNESS)?;
    specimens.iter().flatten().next().map(|_| {
        format!(
            "The stiffness ratio of the specimens' grains is not used: the runs are on {count} specimens, and at least \
             {LEAST_FOR_STIFFNESS} are needed to separate the effect of the ratio from other differences between specimens."
        )
    })
}

/// Returns a note on the number of specimens with an unknown ratio, and on the population that describes the unknown
/// ratios.
pub(crate) fn in_words(specimens: &[Option<f64>], population: &Population) -> Option<String> {
    let unknown = specimens.iter().filter(|ratio| ratio.is_none()).count();
    (unknown > 0).then(|| {
        format!(
            "{unknown} of {} specimens have no image: the stiffness ratio of their grains is estimated from {} \
             known microstructures as {:.4} ± {:.4}.",
            specimens.len(),
            population.count(),
            population.mean()[0],
            population.sd()[0]
        )
    })
}

/// Returns a warning if the mean ratios of the specimens with an image and of the microstructures of the design differ
/// by more than three standard errors. The distribution of the design is assumed for specimens without an image, so
/// that the assumption is then doubtful.
fn unlike_design(runs: &Dataset, specimens: &[Option<f64>]) -> Option<String> {
    let seen: Vec<f64> = specimens.iter().flatten().copied().collect();
    if seen.is_empty() || seen.len() == specimens.len() {
        return None;
    }
    let design = population(runs, &[])?;
    let (mean, of_design) = (seen.iter().sum::<f64>() / seen.len() as f64, design.mean()[0]);
    let error = design.sd()[0] * ((seen.len() as f64).recip() + design.count().recip()).sqrt();
    ((mean - of_design).abs() > 3.0 * error).then(|| {
        format!(
            "Specimens with an image have a stiffness ratio of {mean:.3} on average, the microstructures of the design \
             {of_design:.3}. These two groups are not from one population, but specimens without an image are assumed to be \
             from this population. Check specimen.grains, or calibrate against the specimens with an image only."
        )
    })
}

/// Returns the runs with the stiffness ratio as an additional input. Returns `None` unless the ratio is known for all
/// specimens, or for some specimens if there is a population for the other specimens. Also returns `None` if the runs
/// share too few specimens: with two specimens, a function of the ratio would fit both specimens exactly, and the
/// scatter about the response could not be estimated. Without the ratio as an input, the scatter of packings is part
/// of the surrogate's residuals and of the scatter of the specimens.
///
/// # Errors
/// Fails if all ratios are equal.
pub(crate) fn knowing_stiffness(
    runs: &Dataset,
    specimens: &[Option<f64>],
) -> Result<Option<Dataset>, SurrogateError> {
    let ratios: Vec<f64> = specimens.iter().flatten().copied().collect();
    let population = population(runs, specimens);
    let are_all_known = ratios.len() == specimens.len();
    let are_too_few = MadeOn::of(runs).are_too_few_for_stiffness();
    if ratios.is_empty() || are_too_few || (!are_all_known && population.is_none()) {
        return Ok(None);
    }
    with_stiffness_ratio(runs, &ratios, population.as_ref())
}

/// Returns the runs with the stiffness ratio of their microstructure as an additional input; `None` if a run has no
/// ratio. The range of the input covers the ratios of the runs, the given specimens and the population.
///
/// # Errors
/// Fails if all ratios are equal.
pub(crate) fn with_stiffness_ratio(
    runs: &Dataset,
    specimens: &[f64],
    population: Option<&Population>,
) -> Result<Option<Dataset>, SurrogateError> {
    let Some(ratios) = of_runs(runs) else { return Ok(None) };
    let places = population.map_or_else(Vec::new, |population| population.places().concat());
    let all = || ratios.iter().chain(specimens).chain(&places).copied();
    let (low, high) =
        (all().fold(f64::INFINITY, f64::min), all().fold(f64::NEG_INFINITY, f64::max));
    let mut inputs = runs.inputs().to_vec();
    inputs.push(Input::new(STIFFNESS_RATIO, low, high)?);
    // the derivatives of the runs are derivatives at constant stiffness ratio
    let differentiated = runs.inputs_with_derivatives();
    let mut data = Dataset::new(inputs, runs.outputs().to_vec(), runs.provenance())?
        .with_derivatives_in(differentiated)?;
    for (i, ((x, y), ratio)) in runs.rows().zip(&ratios).enumerate() {
        let x = [x, &[*ratio]].concat();
        match runs.derivatives(i) {
            None => data.push(&x, y)?,
            Some(slopes) => {
                let jacobian: Vec<&[f64]> = slopes.chunks(differentiated).collect();
                data.push_differentiated(&x, y, &jacobian, &[])?;
            }
        }
    }
    Ok(Some(data))
}
