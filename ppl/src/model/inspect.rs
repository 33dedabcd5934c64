//! Inspection of models by tracing: a model is run once, and a trace records its named quantities. The code is
//! type-erased, so that it is compiled once and not for every model.

use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};

use rand::{RngCore, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::density::{FatalError, Rejection};
use crate::model::evaluation::{Statistics, SufficientStatistics};
use crate::model::trace::Trace;
use crate::model::unknowns_from::{CoordinateReader, UnknownsFrom};
use crate::quantity::format::{datum, first_to_fail, further};
use crate::quantity::layout::Layout;
use crate::quantity::record::{Entry, Record, Role};
use crate::quantity::value_reader::ValueReader;

/// Error of a model that cannot be evaluated.
#[derive(Clone, Debug, thiserror::Error)]
pub enum ModelError {
    /// The model rejected all its prior draws.
    #[error(
        "the model rejects its own prior draws ({tries} tries), last with: {last}{}",
        further(.detail)
    )]
    NoPriorDraw {
        /// Number of tried draws.
        tries: usize,
        /// Rejection of the last draw.
        #[source]
        last: Rejection,
        /// Additional description of the last rejection, such as the datum with zero density.
        detail: Option<String>,
    },
    /// The model is invalid.
    #[error(transparent)]
    Invalid(Box<FatalError>),
}

/// Type-erased model.
pub(crate) trait Statements {
    /// Runs the statements of the model with the context `trace`.
    fn trace(&self, trace: &mut Trace<'_>) -> Result<(), Rejection>;

    /// Log density at `y`. With `drop_constants`, terms that have the same value at every point are omitted.
    fn value(
        &self,
        y: &[f64],
        drop_constants: bool,
        statistics: Statistics<'_>,
    ) -> Result<f64, Rejection>;
}

/// Properties of a model, determined when it is bound to its data.
#[derive(Clone, Debug)]
pub(crate) struct Inspection {
    layout: Result<Layout, ModelError>,
    /// Sum of the terms that depend only on data; `None` if this sum is not the same at every point.
    pub(crate) constant: Option<f64>,
    /// Sufficient statistics of the observations; `None` if the executed statements or their data depend on the
    /// point.
    statistics: Option<Vec<SufficientStatistics>>,
}

impl Inspection {
    pub(crate) fn layout(&self) -> Result<&Layout, ModelError> {
        self.layout.as_ref().map_err(Clone::clone)
    }

    pub(crate) fn dim(&self) -> usize {
        match &self.layout {
            Ok(layout) => layout.dim,
            Err(_) => 0,
        }
    }

    /// Returns the precomputed sufficient statistics, or the scratch memory `memory` if they must be recomputed at
    /// every point.
    #[inline]
    pub(crate) fn statistics<'p>(&'p self, memory: &'p mut Vec<f64>) -> Statistics<'p> {
        match &self.statistics {
            Some(statistics) => Statistics::Precomputed(statistics.iter()),
            None => Statistics::Recomputed(memory),
        }
    }
}

/// Determines the names and shapes of the quantities of a model. With `is_static`, also determines the constant terms
/// and the sufficient statistics, if the submodels of the model are static too.
pub(crate) fn inspect(model: &dyn Statements, is_static: bool) -> Inspection {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let (record, statistics) = match run(model, &mut rng, is_static.then(Vec::new), &mut |_| ()) {
        Ok(drawn) => drawn,
        Err(error) => return Inspection { layout: Err(error), constant: None, statistics: None },
    };
    let mut inspection = Inspection { layout: Ok(layout(record)), constant: None, statistics };
    if inspection.statistics.is_some() {
        match constant(model, &mut rng, &inspection) {
            Ok(constant) => inspection.constant = constant,
            Err(Moving) => inspection.statistics = None,
        }
    }
    inspection
}

/// Draws one record from the prior.
pub(crate) fn draw(model: &dyn Statements, rng: &mut dyn RngCore) -> Result<Record, ModelError> {
    draw_counting(model, rng, &mut |_| ())
}

/// Draws one record from the prior. Calls `rejected` with the rejection of every draw that a statement rejects.
pub(crate) fn draw_counting(
    model: &dyn Statements,
    rng: &mut dyn RngCore,
    rejected: &mut dyn FnMut(&Rejection),
) -> Result<Record, ModelError> {
    run(model, rng, None, rejected).map(|(record, _)| record)
}

/// Draws one record from the prior. If `statistics` is given, also returns `statistics` with the sufficient statistics
/// of the observations appended; `None` if a submodel is not static.
fn run(
    model: &dyn Statements,
    rng: &mut dyn RngCore,
    statistics: Option<Vec<SufficientStatistics>>,
    rejected: &mut dyn FnMut(&Rejection),
) -> Result<(Record, Option<Vec<SufficientStatistics>>), ModelError> {
    const TRIES: usize = 100;
    let mut tries = 0;
    loop {
        tries += 1;
        let mut trace = Trace::new(UnknownsFrom::Prior, &mut *rng);
        trace.statistics.clone_from(&statistics);
        let outcome = traced(model, &mut trace);
        let statistics = trace.statistics.take();
        let failing = trace.failing.take();
        match outcome.and_then(|()| trace.finish()) {
            Ok(record) => return Ok((record, statistics)),
            Err(Rejection::Fatal(error)) => return Err(ModelError::Invalid(error)),
            Err(last) => {
                rejected(&last);
                if tries == TRIES {
                    let detail = failing.map(first_to_fail);
                    return Err(ModelError::NoPriorDraw { tries, last, detail });
                }
            }
        }
    }
}

/// Runs a model in a trace. A panic of the model, for example because of an index out of bounds, is converted to a
/// fatal error that contains the last statement executed before the panic.
fn traced(model: &dyn Statements, trace: &mut Trace<'_>) -> Result<(), Rejection> {
    let panic = match catch_unwind(AssertUnwindSafe(|| model.trace(trace))) {
        Ok(outcome) => return outcome,
        Err(panic) => panic,
    };
    let text = panic.downcast_ref::<String>().map(String::as_str);
    let text = text.or_else(|| panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
    Err(Box::new(FatalError::Panic { location: trace.last, message: text.to_owned() }).into())
}

/// Returns the named quantities at `y`. The record is incomplete if a statement rejects the point.
pub(crate) fn record_at(
    model: &dyn Statements,
    y: &[f64],
    rng: &mut dyn RngCore,
) -> (Record, Result<(), Rejection>) {
    let mut trace = Trace::new(UnknownsFrom::Point(CoordinateReader::new(y)), rng);
    let outcome = model.trace(&mut trace);
    trace.record.unfold();
    (trace.record, outcome)
}

/// Returns a copy of `y` in which the named quantities have the given values. An error describes an invalid name or
/// value.
pub(crate) fn with_values(
    model: &dyn Statements,
    y: &[f64],
    values: &[(String, Vec<f64>)],
) -> Result<Vec<f64>, String> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let source = UnknownsFrom::Values(CoordinateReader::new(y), ValueReader::new(values));
    let mut trace = Trace::new(source, &mut rng);
    let outcome = traced(model, &mut trace);
    let unknowns = trace.record.entries.iter().filter(|e| e.variable.role == Role::Parameter);
    let names: Vec<String> = unknowns.map(|e| format!("`{}`", e.variable.name)).collect();
    let (point, source) = (trace.record.unconstrained, trace.source);
    if let UnknownsFrom::Values(_, values) = source {
        match (outcome, &values.problem) {
            (Ok(()), _) | (Err(_), Some(_)) => values.check(&names.join(", "))?,
            // a statement rejected the point before all coordinates were read: return `y` itself, which the density
            // rejects too, so that the caller tries another point
            (Err(_), None) if point.len() < y.len() => return Ok(y.to_vec()),
            (Err(_), None) => {}
        }
    }
    Ok(point)
}

/// Creates the layout (names, shapes and number of coordinates) from a prior draw.
fn layout(record: Record) -> Layout {
    Layout {
        dim: record.unconstrained.len(),
        variables: record.entries.into_iter().map(|entry| entry.variable).collect(),
        coordinates: record.coordinates,
        units: BTreeMap::new(),
    }
}

/// Error of a model whose data depend on the point through a user-defined function, so that constants and sufficient
/// statistics cannot be precomputed.
struct Moving;

/// Returns the sum of the terms that `drop_constants` omits; `None` if this sum differs between prior draws. The sum
/// is computed at the draw with the smallest rounding error.
fn constant(
    model: &dyn Statements,
    rng: &mut dyn RngCore,
    inspection: &Inspection,
) -> Result<Option<f64>, Moving> {
    const DRAWS: usize = 20;
    let mut best = (f64::INFINITY, f64::NAN);
    let (mut differences, mut sums) = (Vec::new(), Vec::new());
    for _ in 0..DRAWS {
        let Ok(record) = draw(model, rng) else { return Ok(None) };
        let y = record.unconstrained;
        let mut value =
            |drop_constants| model.value(&y, drop_constants, inspection.statistics(&mut sums));
        // skip draws in the tails of the prior, where the density can be undefined
        let (Ok(full), Ok(rest)) = (value(false), value(true)) else { continue };
        if let Ok(anew) = model.value(&y, false, Statistics::Recomputed(&mut sums))
            && (anew - full).abs() > 1e-8 * (anew.abs() + full.abs() + 1.0)
        {
            return Err(Moving);
        }
        let size = full.abs() + rest.abs();
        differences.push((size, full - rest));
        if size < best.0 {
            best = (size, full - rest);
        }
    }
    let same = |(size, difference): &(f64, f64)| {
        (difference - best.1).abs() <= 1e-12 * (size + best.0 + 1.0)
    };
    let is_same = differences.iter().all(same) && best.1.is_finite();
    Ok(is_same.then_some(best.1))
}

/// Describes the first observation whose density is not finite at `y`; `None` if there is no such observation.
pub(crate) fn explain(model: &dyn Statements, y: &[f64]) -> Option<String> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut trace = Trace::new(UnknownsFrom::Point(CoordinateReader::new(y)), &mut rng);
    let outcome = model.trace(&mut trace);
    let datum = match outcome {
        Err(_) => trace.failing,
        Ok(()) => {
            let entries = &trace.record.entries;
            entries.iter().filter(|e| e.variable.role == Role::Observed).find_map(first_without)
        }
    };
    datum.map(first_to_fail)
}

fn first_without(entry: &Entry) -> Option<String> {
    let index = entry.log_likelihood.iter().position(|value| !value.is_finite())?;
    let size = entry.values.len() / entry.log_likelihood.len();
    let values = &entry.values[index * size..(index + 1) * size];
    Some(datum(&entry.variable.name, (entry.log_likelihood.len() > 1).then_some(index), values))
}

#[cfg(test)]
#[path = "../../tests/unit/inspect.rs"]
mod tests;
