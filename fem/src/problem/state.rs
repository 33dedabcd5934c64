//! All that a run carries from step to step.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::curve::CurvePoint;
use super::discretisation::Discretisation;
use super::memory::Memory;
use super::schedule::Stepping;
use crate::fields::Fields;
use crate::material::PhaseField;
use crate::solve::Effort;

/// The last equilibrium, how the run came there, and what it does next. The clock is the fraction of
/// the whole duration.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct State {
    pub(crate) curve: Vec<CurvePoint>,
    pub(crate) reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// The last equilibrium.
    pub(crate) fields: Fields,
    /// Its change over the increment before, and that increment: for the next guess.
    pub(crate) change: Option<(Fields, f64)>,
    /// Stress forces at its nodes, N: for the work of the next increment.
    pub(crate) forces: Vec<[f64; 3]>,
    /// Reactions at it, N.
    pub(crate) reaction: BTreeMap<String, [f64; 3]>,
    /// What damage remembers.
    pub(crate) memory: Memory,
    /// What steps of prescribed release remember.
    pub(crate) arc: ArcState,
    /// Contact pressures, platen by platen, MPa; empty before the first increment.
    pub(crate) pressures: Vec<Vec<f64>>,
    pub(crate) point: CurvePoint,
    pub(crate) clock: f64,
    /// The next increment to try.
    pub(crate) step: f64,
    pub(crate) recorded: u32,
    pub(crate) peak: f64,
    pub(crate) effort: Effort,
}

/// Where steps of prescribed release stand.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ArcState {
    /// Whether the release leads, and not the position of the ends.
    pub(crate) leads: bool,
    /// The next release to try, N mm.
    pub(crate) release: f64,
    /// What the last such step released, N mm.
    pub(crate) released: Option<f64>,
}

impl State {
    /// The unloaded body.
    pub(crate) fn new(
        domain: &Discretisation,
        phase_field: Option<&PhaseField>,
        stepping: Stepping,
    ) -> Self {
        let nodes = domain.nodes().len();
        let (step, release) = match stepping {
            Stepping::Fixed(steps) => (1.0 / f64::from(steps), 0.0),
            Stepping::Adaptive { first, .. } => (first, 0.0),
            Stepping::ArcLength { step, release_n_mm } => (step, release_n_mm),
        };
        Self {
            fields: Fields::zero(nodes),
            memory: Memory::new(phase_field, domain.operator.as_ref(), nodes),
            forces: vec![[0.0; 3]; nodes],
            reactions: domain.boundary.surfaces.keys().map(|k| (k.clone(), vec![])).collect(),
            step,
            arc: ArcState { release, ..ArcState::default() },
            ..Self::default()
        }
    }
}
