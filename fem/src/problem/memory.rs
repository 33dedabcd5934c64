//! State of irreversible damage, carried from one increment to the next.

use serde::{Deserialize, Serialize};

use crate::error::StepFailure;
use crate::fields::Fields;
use crate::material::{CrackDensity, Irreversibility, PhaseField, PointMaterial};
use crate::operator::{Bounds, Increment, Operator, StepContext};
use crate::parallel::Part;

/// State of irreversible damage.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
#[serde(from = "Saved", into = "Saved")]
pub(crate) struct Memory {
    /// Largest ψ⁺ so far at each elastic quadrature point; empty unless `Irreversibility::History` is used.
    history: Vec<f64>,
    bounds: Option<Bounds>,
    /// Whether the lower bound of damage is updated to the damage of each equilibrium.
    ratchet: bool,
}

impl Memory {
    /// Creates the state of an undamaged specimen.
    pub(crate) fn new(field: Option<&PhaseField>, operator: &dyn Operator, nodes: usize) -> Self {
        let kept = field.is_some_and(|f| f.irreversibility == Irreversibility::History);
        let ratchet = field.is_some_and(|f| f.irreversibility == Irreversibility::ActiveSet);
        let bounded = ratchet || field.is_some_and(|f| f.model == CrackDensity::At1);
        let bounds = bounded.then(|| damage_from(&vec![0.0; nodes]));
        let points = if kept { operator.domain().points() } else { 0 };
        Self { history: vec![0.0; points], bounds, ratchet }
    }

    /// Returns the context of an increment that starts from this state.
    pub(crate) fn context<'a>(
        &'a self,
        damage_before: &'a [f64],
        duration: f64,
    ) -> StepContext<'a> {
        let (history, bounds) = (&self.history[..], self.bounds.as_ref());
        StepContext { history, bounds, ..StepContext::new(damage_before, duration) }
    }

    /// Gathers the state of the whole mesh from all ranks.
    pub(crate) fn gathered(&self, part: &Part) -> Self {
        let Saved { history, lower, ratchet } = self.clone().into();
        let lower = lower.map(|lower| part.gather_nodes(&lower));
        Saved { history: part.gather_tets(&history), lower, ratchet }.into()
    }

    /// Returns the part of the state on this rank. `points` is the number of elastic quadrature points per element.
    pub(crate) fn of_part(self, part: &Part, points: usize) -> Self {
        let Saved { history, lower, ratchet } = self.into();
        let lower = lower.map(|lower| part.pick_nodes(&lower));
        Saved { history: part.pick_tets(&history, points), lower, ratchet }.into()
    }

    /// Whether the lower bounds of an increment are the damage at its start.
    pub(crate) fn follows(&self) -> bool {
        self.ratchet
    }

    /// Updates the state with an equilibrium.
    pub(crate) fn record(
        &mut self,
        operator: &dyn Operator,
        materials: &[PointMaterial],
        fields: &Fields,
    ) -> Result<(), StepFailure> {
        if !self.history.is_empty() {
            let context =
                StepContext { history: &self.history, ..StepContext::new(&fields.damage, 1.0) };
            let mut driving = vec![0.0; self.history.len()];
            operator.driving_energies(&Increment { materials, fields, context }, &mut driving)?;
            self.history = driving;
        }
        if let (true, Some(bounds)) = (self.ratchet, &mut self.bounds) {
            bounds.lower.iter_mut().zip(&fields.damage).for_each(|(b, &phi)| b[3] = phi);
        }
        Ok(())
    }
}

/// Returns the bounds lower ≤ φ ≤ 1, without bounds of the displacement.
fn damage_from(lower: &[f64]) -> Bounds {
    let mut bounds = Bounds::none(lower.len());
    bounds.lower.iter_mut().zip(lower).for_each(|(b, &phi)| b[3] = phi);
    bounds.upper.iter_mut().for_each(|b| b[3] = 1.0);
    bounds
}

/// Serialised form of [`Memory`], without data that can be recomputed.
#[derive(Serialize, Deserialize)]
struct Saved {
    history: Vec<f64>,
    /// Lower bounds of φ.
    lower: Option<Vec<f64>>,
    ratchet: bool,
}

impl From<Memory> for Saved {
    fn from(Memory { history, bounds, ratchet }: Memory) -> Self {
        let lower = bounds.map(|bounds| bounds.lower.iter().map(|b| b[3]).collect());
        Self { history, lower, ratchet }
    }
}

impl From<Saved> for Memory {
    fn from(Saved { history, lower, ratchet }: Saved) -> Self {
        Self { history, bounds: lower.map(|lower| damage_from(&lower)), ratchet }
    }
}
