//! What a model says when it is read by a trace: compiled once, here, and not anew for every model.

use rand::RngCore;

use crate::bound::{Layout, ModelError};
use crate::density::Rejection;
use crate::entry::Record;
use crate::reading::Pool;
use crate::trace::{Source, Trace};

/// Runs the statements of a model.
pub(crate) type Statements<'m> = &'m dyn Fn(&mut Trace<'_>) -> Result<(), Rejection>;

/// The log density at a point, with `true` without constants.
pub(crate) type Value<'v> = &'v mut dyn FnMut(&[f64], bool) -> Result<f64, Rejection>;

/// A draw from the prior, and what suffices of observations if it is to be added to `pools`.
pub(crate) fn draw(
    statements: Statements<'_>,
    rng: &mut dyn RngCore,
    pools: Option<Vec<Pool>>,
) -> Result<(Record, Option<Vec<Pool>>), ModelError> {
    const TRIES: usize = 100;
    let mut last = None;
    for _ in 0..TRIES {
        let mut trace = Trace::new(Source::Prior, &mut *rng);
        trace.pools.clone_from(&pools);
        let outcome = statements(&mut trace);
        let pools = trace.pools.take();
        match outcome.and_then(|()| trace.finish()) {
            Ok(record) => return Ok((record, pools)),
            Err(fatal @ Rejection::Fatal { .. }) => return Err(ModelError::Invalid(fatal)),
            Err(rejection) => last = Some(rejection),
        }
    }
    let last = last.unwrap_or(Rejection::Fatal { message: "no tries".to_owned() });
    Err(ModelError::NoPriorDraw { tries: TRIES, last })
}

/// What the model names at `y`, up to a rejection.
pub(crate) fn read(
    statements: Statements<'_>,
    y: &[f64],
    rng: &mut dyn RngCore,
) -> (Record, Result<(), Rejection>) {
    let mut trace = Trace::new(Source::point(y), rng);
    let outcome = statements(&mut trace);
    (trace.record, outcome)
}

/// Names, shapes and the number of unknowns, from a draw.
pub(crate) fn layout(record: Record) -> Layout {
    Layout {
        dim: record.unconstrained.len(),
        variables: record.entries.into_iter().map(|entry| entry.variable).collect(),
        coordinates: record.coordinates,
    }
}

/// The difference that leaving out constants makes, if it is the same at several draws from the
/// prior; from the draw where least is lost to rounding.
pub(crate) fn constant(
    statements: Statements<'_>,
    rng: &mut dyn RngCore,
    value: Value<'_>,
) -> Option<f64> {
    const DRAWS: usize = 20;
    let mut best = (f64::INFINITY, f64::NAN);
    let mut found = Vec::new();
    for _ in 0..DRAWS {
        let y = draw(statements, rng, None).ok()?.0.unconstrained;
        // far out in the prior there may be no density
        let (Ok(full), Ok(lean)) = (value(&y, false), value(&y, true)) else { continue };
        let size = full.abs() + lean.abs();
        found.push((size, full - lean));
        if size < best.0 {
            best = (size, full - lean);
        }
    }
    let same = |(size, difference): &(f64, f64)| {
        (difference - best.1).abs() <= 1e-12 * (size + best.0 + 1.0)
    };
    found.iter().all(same).then_some(best.1).filter(|constant| constant.is_finite())
}
