//! What damage remembers from one increment to the next.

use crate::fields::Fields;
use crate::material::{CrackDensity, Irreversibility, PhaseField, PointMaterial};
use crate::operator::{Bounds, Increment, Operator, Span};
use crate::solve::StepFailure;

/// The state of the irreversibility.
#[derive(Clone, Debug, Default)]
pub(crate) struct Memory {
    /// Largest ψ⁺ so far at each elastic point; empty where it is not kept.
    history: Vec<f64>,
    bounds: Option<Bounds>,
    /// Whether the lower bound follows the damage.
    ratchet: bool,
}

impl Memory {
    /// The memory of an undamaged specimen.
    pub(crate) fn new(field: Option<&PhaseField>, operator: &dyn Operator, nodes: usize) -> Self {
        let kept = field.is_some_and(|f| f.irreversibility == Irreversibility::History);
        let ratchet = field.is_some_and(|f| f.irreversibility == Irreversibility::ActiveSet);
        let bounded = ratchet || field.is_some_and(|f| f.model == CrackDensity::At1);
        let bounds = bounded.then(|| {
            let mut bounds = Bounds::none(nodes);
            bounds.lower.iter_mut().for_each(|b| b[3] = 0.0);
            bounds.upper.iter_mut().for_each(|b| b[3] = 1.0);
            bounds
        });
        let points = if kept { operator.domain().points() } else { 0 };
        Self { history: vec![0.0; points], bounds, ratchet }
    }

    /// History and lower bounds of φ, to be saved.
    pub(crate) fn arrays(&self) -> [Vec<f64>; 2] {
        let lower = self.bounds.iter().flat_map(|b| b.lower.iter().map(|b| b[3]));
        [self.history.clone(), lower.collect()]
    }

    /// Takes back what [`arrays`](Self::arrays) gave.
    pub(crate) fn restore(&mut self, [history, lower]: [Vec<f64>; 2]) {
        self.history = history;
        if let Some(bounds) = &mut self.bounds {
            bounds.lower.iter_mut().zip(lower).for_each(|(b, phi)| b[3] = phi);
        }
    }

    /// An increment that starts from this memory.
    pub(crate) fn span<'a>(&'a self, damage_before: &'a [f64], duration: f64) -> Span<'a> {
        let (history, bounds) = (&self.history[..], self.bounds.as_ref());
        Span { history, bounds, ..Span::new(damage_before, duration) }
    }

    /// Takes an equilibrium into memory.
    pub(crate) fn record(
        &mut self,
        operator: &dyn Operator,
        materials: &[PointMaterial],
        fields: &Fields,
    ) -> Result<(), StepFailure> {
        if !self.history.is_empty() {
            let span = Span { history: &self.history, ..Span::new(&fields.damage, 1.0) };
            let mut driving = vec![0.0; self.history.len()];
            operator.driving_energies(&Increment { materials, fields, span }, &mut driving)?;
            self.history = driving;
        }
        if let (true, Some(bounds)) = (self.ratchet, &mut self.bounds) {
            bounds.lower.iter_mut().zip(&fields.damage).for_each(|(b, &phi)| b[3] = phi);
        }
        Ok(())
    }
}
