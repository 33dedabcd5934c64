//! Unknown fields: displacement and damage at the nodes.

use serde::{Deserialize, Serialize};

/// Displacement (mm) and damage at the nodes of the space: first the nodes of the mesh, then, for quadratic elements,
/// the midpoints of its edges.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Fields {
    /// Displacement vectors, mm.
    pub displacement: Vec<[f64; 3]>,
    /// Damage φ; zero at a node that belongs to elastic regions only.
    pub damage: Vec<f64>,
    /// Displacement of the platen of a load program that prescribes a force, mm, downwards; zero in all other tests.
    #[serde(default)]
    pub platen_mm: f64,
    /// State from which laws with a state compute the stress. The fields of a run contain this state;
    /// [`LawState::default`] is the state before the first increment.
    #[serde(default)]
    pub state: LawState,
}

/// State of the laws at the start of the increment that led to the fields, and the duration of this increment.
///
/// Stress and energy of a law with a state depend on the state at the start of the increment. The state is empty for
/// laws without state.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct LawState {
    /// State values, ordered by element and then by integration point. An empty vector stands for zeros.
    pub(crate) values: Vec<f64>,
    /// Duration of the increment, s.
    pub(crate) duration_s: f64,
}

impl Fields {
    pub(crate) fn zero(nodes: usize) -> Self {
        let (displacement, damage) = (vec![[0.0; 3]; nodes], vec![0.0; nodes]);
        Self { displacement, damage, ..Self::default() }
    }

    /// Clones displacements and damage, without the state of the laws.
    pub(crate) fn without_state(&self) -> Self {
        let Self { displacement, damage, platen_mm, .. } = self;
        let (displacement, damage) = (displacement.clone(), damage.clone());
        Self { displacement, damage, platen_mm: *platen_mm, state: LawState::default() }
    }

    pub(crate) fn copy_from(&mut self, other: &Fields) {
        self.displacement.copy_from_slice(&other.displacement);
        self.damage.copy_from_slice(&other.damage);
        self.platen_mm = other.platen_mm;
    }

    /// Whether all values are finite.
    pub(crate) fn is_finite(&self) -> bool {
        let values = self.displacement.as_flattened().iter().chain(&self.damage);
        self.platen_mm.is_finite() && values.into_iter().all(|x| x.is_finite())
    }

    /// Adds a multiple of other fields to displacements and damage.
    pub(crate) fn add_scaled(&mut self, multiple: f64, other: &Fields) {
        let sums = self.displacement.as_flattened_mut().iter_mut().chain(&mut self.damage);
        let others = other.displacement.as_flattened().iter().chain(&other.damage);
        sums.zip(others).for_each(|(sum, x)| *sum += multiple * x);
        self.platen_mm += multiple * other.platen_mm;
    }
}
