//! State of a run that is carried from step to step.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::past::Past;
use crate::boundary::Contact;
use crate::fields::{Fields, LawState};
use crate::material::{PhaseField, PointMaterial};
use crate::parallel::Part;
use crate::problem::control::Step;
use crate::problem::curve::CurvePoint;
use crate::problem::definition::Discretisation;
use crate::problem::memory::Memory;
use crate::solve::{Effort, Scales};

/// Last equilibrium, history and counters of a run.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct RunState {
    pub(crate) curve: Vec<CurvePoint>,
    pub(crate) reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// The last equilibrium.
    pub(crate) fields: Fields,
    /// Changes of the fields over earlier increments, for the next initial guess.
    pub(crate) past: Past,
    /// External nodal forces at the last equilibrium, from which the work of the next increment is computed: forces in
    /// N, damage source in N mm.
    pub(crate) forces: Vec<[f64; 4]>,
    /// Reaction at each surface at the last equilibrium, N.
    pub(crate) reaction: BTreeMap<String, [f64; 3]>,
    /// State of the laws and bounds of irreversible damage.
    pub(crate) memory: Memory,
    /// Contact pressures for each platen, MPa; empty before the first increment.
    pub(crate) pressures: Vec<Vec<f64>>,
    /// Point of the curve for the last equilibrium. The counters of iterations are sums over all steps since the last
    /// recorded point.
    pub(crate) point: CurvePoint,
    /// Fraction of the total duration that has been completed.
    pub(crate) clock: f64,
    /// Displacement (mm) and force (N) of the measured surface at the last corner of the load; zero before the first
    /// corner.
    pub(crate) corner: [f64; 2],
    /// The request of the last successful step.
    pub(crate) taken: Option<Step>,
    /// Largest absolute value of the force so far, N.
    pub(crate) peak: f64,
    /// Largest reference values (scales) of residuals so far.
    pub(crate) scales: Scales,
    pub(crate) effort: Effort,
    pub(crate) derivatives: Derivatives,
}

/// Derivatives of the last equilibrium with respect to the parameters (*rates*), one entry per parameter.
#[derive(Clone, Debug, Default, Serialize, Deserialize)]
pub(crate) struct Derivatives {
    /// Rates of u_x, u_y, u_z, φ at the nodes.
    pub(crate) values: Vec<Vec<[f64; 4]>>,
    /// Rates of the state of the laws; empty for laws without state.
    pub(crate) state: Vec<Vec<f64>>,
    /// Rates of u_x, u_y, u_z, φ at earlier equilibria, newest first, as initial search directions of the next linear
    /// solution.
    pub(crate) earlier: Vec<Vec<Vec<[f64; 4]>>>,
    /// Rates of the force, N.
    pub(crate) force_n: Vec<f64>,
    /// Rates of the displacement of the platen, mm; empty unless the load program prescribes a force.
    pub(crate) platen_mm: Vec<f64>,
    /// Rates of the displacement of the platen (mm) and of the force (N) at the last corner of the load; empty before the
    /// first corner.
    pub(crate) corner: Vec<[f64; 2]>,
    /// Rates of the force, N, at the points of the curve.
    pub(crate) curve: Vec<Vec<f64>>,
    /// Rates of the displacement of the platen, mm, at the points of the curve; empty unless the load program prescribes a
    /// force.
    pub(crate) platen_curve: Vec<Vec<f64>>,
    /// Adjoint solution of the force, as initial guess of the adjoint at the next equilibrium; empty if not computed
    /// yet.
    pub(crate) adjoint: Vec<[f64; 4]>,
    /// Reason why the derivatives of an equilibrium could not be computed. No derivatives are computed for later
    /// equilibria.
    pub(crate) lost: Option<String>,
}

impl RunState {
    /// Creates the state of the unloaded body.
    pub(crate) fn new(
        domain: &Discretisation,
        phase_field: Option<&PhaseField>,
        materials: &[PointMaterial],
        parameters: usize,
    ) -> Self {
        let nodes = domain.nodes().len();
        let values = vec![vec![[0.0; 4]; nodes]; parameters];
        let earlier = vec![Vec::new(); parameters];
        let memory = Memory::new(phase_field, materials, domain.operator.as_ref());
        Self {
            derivatives: Derivatives {
                state: vec![vec![0.0; memory.len()]; parameters],
                values,
                earlier,
                ..Derivatives::default()
            },
            fields: Fields::zero(nodes),
            memory,
            forces: vec![[0.0; 4]; nodes],
            reactions: domain.boundary.surfaces.keys().map(|k| (k.clone(), vec![])).collect(),
            ..Self::default()
        }
    }

    /// Gathers the state of the whole body from all ranks.
    pub(crate) fn gathered(&self, domain: &Discretisation) -> Self {
        let part = domain.operator.part();
        let contacts = &domain.boundary.contacts;
        let pressures = self.pressures.iter().zip(contacts).map(|(pressures, contact)| {
            let own_places: Vec<u32> = contact.own_places().collect();
            let owned: Vec<f64> = contact.own_of(pressures).copied().collect();
            part.ordered(&own_places, 1, &owned, contact.all)
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

    /// Returns this rank's part of the state of the whole body.
    pub(crate) fn of_part(self, domain: &Discretisation) -> Self {
        let part = domain.operator.part();
        let elastic_points = domain.operator.domain().rule().elastic_points.len();
        let width = elastic_points * self.memory.per_point();
        let fields = |fields: &Fields| Fields {
            displacement: part.pick_nodes(&fields.displacement),
            damage: part.pick_nodes(&fields.damage),
            platen_mm: fields.platen_mm,
            state: LawState { values: part.pick_tets(&fields.state.values, width), ..fields.state },
        };
        let pressures = self.pressures.iter().zip(&domain.boundary.contacts);
        let pick = |(all, contact): (&Vec<f64>, &Contact)| {
            contact.places.iter().map(|&place| all[place as usize]).collect()
        };
        let pressures = pressures.map(pick).collect();
        Self {
            fields: fields(&self.fields),
            past: self.past.map(fields),
            forces: part.pick_nodes(&self.forces),
            memory: self.memory.of_part(part, elastic_points),
            pressures,
            ..self
        }
    }
}

/// Gathers the fields of the whole body from all ranks.
pub(crate) fn gather_fields(part: &Part, fields: &Fields) -> Fields {
    Fields {
        displacement: part.gather_nodes(&fields.displacement),
        damage: part.gather_nodes(&fields.damage),
        platen_mm: fields.platen_mm,
        state: LawState { values: part.gather_tets(&fields.state.values), ..fields.state },
    }
}
