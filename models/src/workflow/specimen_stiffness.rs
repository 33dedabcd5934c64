//! Stiffness ratios of runs and specimens: an input of the surrogate, known of those that have an image; of the
//! others what their population says.

use surrogate::{Dataset, DynPce, Input, SurrogateError};

use super::WorkflowError;
use super::inputs::Inputs;
use super::made_on::{LEAST_FOR_STIFFNESS, MadeOn, specimen_of};
use super::stiffness::STIFFNESS_RATIO;
use crate::error::InputError;
use crate::fracture::Population;
use crate::table::{CsvTable, TableRow};

/// The stiffness ratio of each specimen that is calibrated against, as far as it is known.
pub(super) fn of_specimens(inputs: &Inputs<'_>) -> Result<Vec<Option<f64>>, WorkflowError> {
    let path = inputs.file("experiments.csv")?;
    let table = CsvTable::read(&path, &["id"])?;
    let ratio = |row: TableRow<'_>| match row.text(STIFFNESS_RATIO).is_empty() {
        true => Ok(None),
        false => row.positive(STIFFNESS_RATIO).map(Some),
    };
    Ok(table.rows().map(ratio).collect::<Result<_, InputError>>()?)
}

/// That of the microstructure of each run, if all have one.
fn of_runs(runs: &Dataset) -> Option<Vec<f64>> {
    (0..runs.len()).map(|i| runs.note(i, STIFFNESS_RATIO)?.parse().ok()).collect()
}

/// What is known of microstructures: those of the design, each once, and of the specimens that have an image. None
/// if runs have no ratio or these are too few.
pub(super) fn population(runs: &Dataset, specimens: &[Option<f64>]) -> Option<Population> {
    let mut members: Vec<(&str, f64)> = Vec::new();
    for (i, ratio) in of_runs(runs)?.into_iter().enumerate() {
        let name = specimen_of(runs, i);
        if !members.iter().any(|(other, _)| *other == name) {
            members.push((name, ratio));
        }
    }
    let of_design: Vec<f64> = members.into_iter().map(|(_, ratio)| ratio).collect();
    // specimens whose images are those of the design have the ratios of these, and are counted once
    let others = specimens.iter().flatten().copied().filter(|ratio| !of_design.contains(ratio));
    let all: Vec<Vec<f64>> =
        of_design.iter().copied().chain(others).map(|ratio| vec![ratio]).collect();
    Population::of(&all).ok()
}

/// What is known of the stiffness ratios of specimens, where a surrogate takes them.
#[derive(Clone, Debug, Default)]
pub(super) struct KnownStiffness {
    /// Of each specimen; none where the surrogate does not take them.
    ratios: Vec<Option<f64>>,
    /// What is known of those that are not.
    pub(super) population: Option<Population>,
    /// What there is to say of the others, and to warn of.
    pub(super) told: Option<String>,
    pub(super) warning: Option<String>,
}

impl KnownStiffness {
    /// From runs and specimens, for a surrogate of the runs.
    pub(super) fn of(pce: &DynPce, runs: &Dataset, specimens: &[Option<f64>]) -> Self {
        if pce.inputs().last().is_none_or(|input| input.name != STIFFNESS_RATIO) {
            return Self { told: left_out(runs, specimens), ..Self::default() };
        }
        let population = population(runs, specimens);
        Self {
            told: population.as_ref().and_then(|p| in_words(specimens, p)),
            warning: unlike_design(runs, specimens),
            population,
            ratios: specimens.to_vec(),
        }
    }

    /// Whether the surrogate takes the ratio.
    pub(super) fn is_input(&self) -> bool {
        !self.ratios.is_empty()
    }

    /// A row each, as far as it is known.
    pub(super) fn rows(&self) -> Vec<Option<Vec<f64>>> {
        self.ratios.iter().map(|ratio| ratio.map(|k| vec![k])).collect()
    }
}

/// What is said where the ratio is known and yet left out.
fn left_out(runs: &Dataset, specimens: &[Option<f64>]) -> Option<String> {
    let count = MadeOn::of(runs).several().filter(|count| *count < LEAST_FOR_STIFFNESS)?;
    specimens.iter().flatten().next().map(|_| {
        format!(
            "The stiffness ratio of the specimens' grains is not used: the runs are on {count} specimens, and it takes \
             {LEAST_FOR_STIFFNESS} to tell what the ratio does from how they differ otherwise."
        )
    })
}

/// What is said of specimens of which the ratio is not known.
pub(super) fn in_words(specimens: &[Option<f64>], population: &Population) -> Option<String> {
    let unknown = specimens.iter().filter(|ratio| ratio.is_none()).count();
    (unknown > 0).then(|| {
        format!(
            "{unknown} of {} specimens have no image: the stiffness ratio of their grains is taken from {} \
             microstructures that are known, {:.4} ± {:.4}.",
            specimens.len(),
            population.count(),
            population.mean()[0],
            population.sd()[0]
        )
    })
}

/// A warning where specimens with an image are not like the microstructures of the design, to which those without
/// one are likened: their mean is more than three standard errors off.
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
             {of_design:.3}: they are not of one population, and those without an image are taken for members of it. \
             Look at specimen.grains, or calibrate against those with an image alone."
        )
    })
}

/// The runs with the stiffness ratio as an input, where it is known of each specimen, or of some while a population
/// tells of the others. Where it is known of none it stays out: the scatter of packings is then in the residuals of
/// the surrogate and in that of the specimens. So it is where runs share too few specimens: with two the ratio
/// would tell them apart exactly, and nothing would be left of how they scatter about the response.
///
/// # Errors
/// Ratios that are all the same.
pub(super) fn knowing_stiffness(
    runs: &Dataset,
    specimens: &[Option<f64>],
) -> Result<Option<Dataset>, SurrogateError> {
    let known: Vec<f64> = specimens.iter().flatten().copied().collect();
    let population = population(runs, specimens);
    let are_all_known = known.len() == specimens.len();
    let are_too_few = MadeOn::of(runs).are_too_few_for_stiffness();
    if known.is_empty() || are_too_few || (!are_all_known && population.is_none()) {
        return Ok(None);
    }
    with_stiffness_ratio(runs, &known, population.as_ref())
}

/// The runs with the stiffness ratio of the packing of each as one more input, over the range of runs,
/// specimens and what the population says of others; none if a run has none.
///
/// # Errors
/// Ratios that are all the same.
pub(super) fn with_stiffness_ratio(
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
    // derivatives, where there are some, are those at a given ratio
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
