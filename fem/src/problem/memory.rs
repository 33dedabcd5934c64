//! State of the material, carried from one increment to the next: state of the laws at the integration points, and
//! bounds of irreversible damage.

use serde::{Deserialize, Serialize};

use crate::error::StepFailure;
use crate::fields::{Fields, LawState};
use crate::material::{CrackDensity, Irreversibility, PhaseField, PointMaterial};
use crate::operator::{Bounds, Increment, Operator, StepContext, state_len};
use crate::parallel::Part;

/// State of the material at the last equilibrium of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "Saved", into = "Saved")]
pub(crate) struct Memory {
    /// State values of the laws, ordered by element and then by integration point.
    law_state: Vec<f64>,
    /// Number of state values per point.
    per_point: usize,
    bounds: Option<Bounds>,
    /// Whether the damage at each equilibrium is the lower bound of the damage in the next increment.
    bound_follows_damage: bool,
}

impl Memory {
    /// Creates the state of an unloaded and undamaged specimen.
    pub(crate) fn new(
        field: Option<&PhaseField>,
        materials: &[PointMaterial],
        operator: &dyn Operator,
    ) -> Self {
        let domain = operator.domain();
        let follows = field.is_some_and(|f| f.irreversibility == Irreversibility::ActiveSet);
        let bounded = follows || field.is_some_and(|f| f.model == CrackDensity::At1);
        let bounds = bounded.then(|| damage_from(&vec![0.0; domain.nodes().len()]));
        let per_point = state_len(materials);
        let law_state = vec![0.0; domain.elastic_points() * per_point];
        Self { law_state, per_point, bounds, bound_follows_damage: follows }
    }

    /// Returns the context of an increment that starts from this state.
    pub(crate) fn context<'a>(
        &'a self,
        damage_before: &'a [f64],
        duration: f64,
    ) -> StepContext<'a> {
        let (state, bounds) = (&self.law_state[..], self.bounds.as_ref());
        StepContext { state, bounds, ..StepContext::new(damage_before, duration) }
    }

    /// Gathers the state of the whole mesh from all ranks.
    pub(crate) fn gathered(&self, part: &Part) -> Self {
        let saved = Saved::from(self.clone());
        let lower = saved.lower.map(|lower| part.gather_nodes(&lower));
        Saved { points: part.gather_tets(&saved.points), lower, ..saved }.into()
    }

    /// Returns the part of the state on this rank. `elastic_points` is the number of elastic quadrature points per element.
    pub(crate) fn of_part(self, part: &Part, elastic_points: usize) -> Self {
        let saved = Saved::from(self);
        let lower = saved.lower.map(|lower| part.pick_nodes(&lower));
        let width = elastic_points * saved.per_point;
        Saved { points: part.pick_tets(&saved.points, width), lower, ..saved }.into()
    }

    /// Returns the number of stored state values of the laws, for all points together.
    pub(crate) fn len(&self) -> usize {
        self.law_state.len()
    }

    /// Number of state values per point.
    pub(crate) fn per_point(&self) -> usize {
        self.per_point
    }

    /// Whether the lower bound of damage in an increment is the damage at the start of the increment.
    pub(crate) fn bound_follows_damage(&self) -> bool {
        self.bound_follows_damage
    }

    /// Returns the state of the laws at the equilibrium `fields` of an increment that lasted `duration` seconds.
    pub(crate) fn law_state_at(
        &self,
        operator: &dyn Operator,
        materials: &[PointMaterial],
        fields: &Fields,
        duration: f64,
    ) -> Result<Vec<f64>, StepFailure> {
        let mut law_state = vec![0.0; self.law_state.len()];
        if !law_state.is_empty() {
            let context = self.context(&fields.damage, duration);
            operator.state(&Increment { materials, fields, context }, &mut law_state)?;
        }
        Ok(law_state)
    }

    /// Stores the state at the equilibrium `fields` of an increment that lasted `duration` seconds; `law_state` is the
    /// result of [`law_state_at`](Self::law_state_at). Returns the state from which the laws compute the stress at `fields`.
    pub(crate) fn record(
        &mut self,
        law_state: Vec<f64>,
        materials: &[PointMaterial],
        fields: &Fields,
        duration: f64,
    ) -> LawState {
        let start = std::mem::replace(&mut self.law_state, law_state);
        if let (true, Some(bounds)) = (self.bound_follows_damage, &mut self.bounds) {
            bounds.lower.iter_mut().zip(&fields.damage).for_each(|(b, &phi)| b[3] = phi);
        }
        // the history of the driving energy is not needed: the stress does not depend on it
        if materials.iter().any(|m| m.law().state_len() > 0) {
            return LawState { values: start, duration_s: duration };
        }
        LawState::default()
    }
}

/// Returns the bounds `lower` ≤ φ ≤ 1 of the damage. The displacement has no bounds.
fn damage_from(lower: &[f64]) -> Bounds {
    let mut bounds = Bounds::none(lower.len());
    bounds.lower.iter_mut().zip(lower).for_each(|(b, &phi)| b[3] = phi);
    bounds.upper.iter_mut().for_each(|b| b[3] = 1.0);
    bounds
}

/// Serialised form of [`Memory`], without data that can be recomputed.
#[derive(Serialize, Deserialize)]
struct Saved {
    points: Vec<f64>,
    per_point: usize,
    /// Lower bounds of φ.
    lower: Option<Vec<f64>>,
    bound_follows_damage: bool,
}

impl From<Memory> for Saved {
    fn from(Memory { law_state: points, per_point, bounds, bound_follows_damage }: Memory) -> Self {
        let lower = bounds.map(|bounds| bounds.lower.iter().map(|b| b[3]).collect());
        Self { points, per_point, lower, bound_follows_damage }
    }
}

impl From<Saved> for Memory {
    fn from(Saved { points, per_point, lower, bound_follows_damage }: Saved) -> Self {
        let bounds = lower.map(|lower| damage_from(&lower));
        Self { law_state: points, per_point, bounds, bound_follows_damage }
    }
}
