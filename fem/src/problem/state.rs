//! All that a run carries from step to step.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::controller::Step;
use super::curve::CurvePoint;
use super::discretisation::Discretisation;
use super::memory::Memory;
use super::past::Past;
use crate::boundary::Contact;
use crate::fields::Fields;
use crate::material::PhaseField;
use crate::parallel::Part;
use crate::solve::{Effort, Scales};

/// The last equilibrium, how the run came there, and what it does next. The clock is the fraction of
/// the whole duration.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct RunState {
    pub(crate) curve: Vec<CurvePoint>,
    pub(crate) reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// The last equilibrium.
    pub(crate) fields: Fields,
    /// How it came about: for the next guess.
    pub(crate) past: Past,
    /// What acts on its nodes from outside, N and N mm: for the work of the next increment.
    pub(crate) forces: Vec<[f64; 4]>,
    /// Reactions at it, N.
    pub(crate) reaction: BTreeMap<String, [f64; 3]>,
    /// What damage remembers.
    pub(crate) memory: Memory,
    /// Contact pressures, platen by platen, MPa; empty before the first increment.
    pub(crate) pressures: Vec<Vec<f64>>,
    pub(crate) point: CurvePoint,
    pub(crate) clock: f64,
    /// The step that led here, as it was asked for.
    pub(crate) taken: Option<Step>,
    pub(crate) peak: f64,
    /// The largest scales of residuals so far.
    pub(crate) scales: Scales,
    pub(crate) effort: Effort,
    pub(crate) derivatives: Derivatives,
}

/// The rates of the last equilibrium with the parameters, one after the other.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Derivatives {
    /// Of u_x, u_y, u_z, φ at the nodes.
    pub(crate) values: Vec<Vec<[f64; 4]>>,
    /// The same at the equilibria before it, the last one first: where the next solution starts.
    pub(crate) earlier: Vec<Vec<Vec<[f64; 4]>>>,
    /// Of the force, N.
    pub(crate) force_n: Vec<f64>,
    /// Of the force at the points of the curve.
    pub(crate) curve: Vec<Vec<f64>>,
    /// The adjoint of the force, where the next one starts; empty where there is none.
    pub(crate) adjoint: Vec<[f64; 4]>,
    /// Why an equilibrium had none, so that those behind it have none either.
    pub(crate) lost: Option<String>,
}

impl RunState {
    /// The unloaded body.
    pub(crate) fn new(
        domain: &Discretisation,
        phase_field: Option<&PhaseField>,
        parameters: usize,
    ) -> Self {
        let nodes = domain.nodes().len();
        let values = vec![vec![[0.0; 4]; nodes]; parameters];
        let earlier = vec![Vec::new(); parameters];
        Self {
            derivatives: Derivatives { values, earlier, ..Derivatives::default() },
            fields: Fields::zero(nodes),
            memory: Memory::new(phase_field, domain.operator.as_ref(), nodes),
            forces: vec![[0.0; 4]; nodes],
            reactions: domain.boundary.surfaces.keys().map(|k| (k.clone(), vec![])).collect(),
            ..Self::default()
        }
    }

    /// The state of the whole body, from those of all ranks.
    pub(crate) fn gathered(&self, domain: &Discretisation) -> Self {
        let part = domain.operator.part();
        let contacts = &domain.boundary.contacts;
        let pressures = self.pressures.iter().zip(contacts).map(|(own, contact)| {
            let places: Vec<u32> = contact.own_places().collect();
            let own: Vec<f64> = contact.own_of(own).copied().collect();
            part.ordered(&places, 1, &own, contact.all)
        });
        Self {
            fields: gather_fields(part, &self.fields),
            past: self.past.map(|change| gather_fields(part, change)),
            forces: part.gather_nodes(&self.forces),
            memory: self.memory.gathered(part),
            pressures: pressures.collect(),
            ..self.clone()
        }
    }

    /// What this rank has of the state of the whole body.
    pub(crate) fn of_part(self, domain: &Discretisation) -> Self {
        let part = domain.operator.part();
        let fields = |fields: &Fields| Fields {
            displacement: part.pick_nodes(&fields.displacement),
            damage: part.pick_nodes(&fields.damage),
        };
        let pressures = self.pressures.iter().zip(&domain.boundary.contacts);
        let pick = |(all, contact): (&Vec<f64>, &Contact)| {
            contact.places.iter().map(|&place| all[place as usize]).collect()
        };
        let pressures = pressures.map(pick).collect();
        let points = domain.operator.domain().rule().points.len();
        Self {
            fields: fields(&self.fields),
            past: self.past.map(fields),
            forces: part.pick_nodes(&self.forces),
            memory: self.memory.of_part(part, points),
            pressures,
            ..self
        }
    }
}

/// The fields of the whole body, from those of all ranks.
pub(crate) fn gather_fields(part: &Part, fields: &Fields) -> Fields {
    Fields {
        displacement: part.gather_nodes(&fields.displacement),
        damage: part.gather_nodes(&fields.damage),
    }
}
