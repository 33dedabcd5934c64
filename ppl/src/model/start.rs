//! Starting points in unconstrained space: uniform, drawn from the prior, or given by the user.

use rand::RngCore;
use serde::{Deserialize, Serialize};

use crate::density::{FatalError, Rejection};
use crate::model::erased::ErasedDensity;

/// Number of uniform starting points that are tried first.
const UNIFORM_TRIES: u32 = 100;
/// Number of draws from the prior that are tried after the uniform points.
const PRIOR_TRIES: u32 = 100;
/// Number of prior draws from which the scales of the coordinates are estimated.
const SCALE_DRAWS: usize = 200;

/// Origin of a starting point.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, Serialize, Deserialize)]
pub enum StartKind {
    /// Uniform in every unconstrained coordinate.
    #[default]
    Uniform,
    /// A draw from the prior, because the density rejected every uniform point.
    PriorDraw,
    /// Given by the user.
    Given,
}

/// Values of quantities by name, one number per element.
pub(crate) type NamedValues = Vec<(String, Vec<f64>)>;

/// Error of a search for a starting point.
pub(crate) enum NoStart {
    /// A named value does not fit the model.
    Values(String),
    /// The density reported a fatal error. The second field is the point of the evaluation.
    Fatal(Box<FatalError>, Vec<f64>),
    /// The density rejected all points. The fields are the numbers of uniform points and of prior draws, the last
    /// rejection, and the last point.
    Rejected { uniform: u32, prior: u32, last: Rejection, point: Vec<f64> },
}

/// Finds the first point that `accept` accepts. The candidates are points from `uniform`, and then draws from the
/// prior of the density. In each candidate, the quantities named in `values` are set to the given values.
pub(crate) fn find_start<G: RngCore>(
    density: &dyn ErasedDensity,
    values: &NamedValues,
    rng: &mut G,
    uniform: &mut dyn FnMut(&mut G) -> Vec<f64>,
    accept: &mut dyn FnMut(&[f64]) -> Result<(), Rejection>,
) -> Result<(StartKind, Vec<f64>), NoStart> {
    let mut attempt = |point: Vec<f64>| -> Result<(Vec<f64>, Option<Rejection>), NoStart> {
        let point = with_values(density, point, values)?;
        match accept(&point) {
            Ok(()) => Ok((point, None)),
            Err(Rejection::Fatal(error)) => Err(NoStart::Fatal(error, point)),
            Err(rejection) => Ok((point, Some(rejection))),
        }
    };
    let mut tries = 0;
    let (mut point, mut last) = loop {
        tries += 1;
        let (point, rejection) = attempt(uniform(rng))?;
        let Some(last) = rejection else { return Ok((StartKind::Uniform, point)) };
        if tries == UNIFORM_TRIES {
            break (point, last);
        }
    };
    let mut prior = 0;
    while prior < PRIOR_TRIES
        && let Some(draw) = density.prior_point(rng)
    {
        prior += 1;
        if draw.len() != density.dim() {
            let error = FatalError::PointLength { point: draw.len(), dim: density.dim() };
            return Err(NoStart::Fatal(Box::new(error), draw));
        }
        let (next, rejection) = attempt(draw)?;
        match rejection {
            None => return Ok((StartKind::PriorDraw, next)),
            Some(rejection) => (point, last) = (next, rejection),
        }
    }
    Err(NoStart::Rejected { uniform: tries, prior, last, point })
}

/// Returns a copy of `point` in which the named quantities have the given values.
pub(crate) fn with_values(
    density: &dyn ErasedDensity,
    point: Vec<f64>,
    values: &NamedValues,
) -> Result<Vec<f64>, NoStart> {
    match values.is_empty() {
        true => Ok(point),
        false => density.with_values(&point, values).map_err(NoStart::Values),
    }
}

/// Returns the scale of every coordinate under the prior, which is the interquartile range divided by 1.349; `None`
/// if the density has no prior, or if a draw has another length than the points. For a normal prior the scale is the
/// standard deviation, and the scale is finite for every prior.
pub(crate) fn prior_scales(density: &dyn ErasedDensity, rng: &mut dyn RngCore) -> Option<Vec<f64>> {
    let draws: Option<Vec<Vec<f64>>> = (0..SCALE_DRAWS).map(|_| density.prior_point(rng)).collect();
    let draws = draws.filter(|draws| draws.iter().all(|draw| draw.len() == density.dim()))?;
    let scale = |i: usize| {
        let mut column: Vec<f64> = draws.iter().map(|draw| draw[i]).collect();
        column.sort_by(f64::total_cmp);
        let scale = (column[3 * SCALE_DRAWS / 4] - column[SCALE_DRAWS / 4]) / 1.349;
        if scale > 0.0 && scale.is_finite() { scale } else { 1.0 }
    };
    Some((0..density.dim()).map(scale).collect())
}
