//! What acts on the body in one increment beside its own stress: loads and contact.

use std::collections::BTreeMap;

use super::compiled::Boundary;
use super::contact::{ContactPoint, ContactStep};
use crate::element::Domain;
use crate::fields::Fields;
use crate::operator::{NodeBlock, Residual, StepContext};
use crate::solve::External;

/// Loads and contact at the end of an increment.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExternalForces {
    loads: Option<Vec<[f64; 4]>>,
    contacts: Vec<ContactStep>,
}

impl External for ExternalForces {
    fn subtract(&self, fields: &Fields, residual: &mut Residual) {
        residual.external = [0.0; 2];
        for (node, load) in self.loads.iter().flatten().enumerate() {
            for k in 0..4 {
                residual.nodal[node][k] -= load[k];
                residual.external[k / 3] += load[k] * load[k];
            }
        }
        for (node, force) in self.contacts.iter().flat_map(|c| c.forces(fields)) {
            for k in 0..3 {
                residual.nodal[node as usize][k] -= force[k];
                residual.external[0] += force[k] * force[k];
            }
        }
    }

    fn tangent(&self, fields: &Fields) -> Vec<NodeBlock> {
        self.contacts.iter().flat_map(|c| c.blocks(fields)).collect()
    }

    fn has_contact(&self) -> bool {
        !self.contacts.is_empty()
    }

    fn has_friction(&self) -> bool {
        self.contacts.iter().any(ContactStep::has_friction)
    }

    fn augment(&mut self, fields: &Fields) -> [f64; 2] {
        self.contacts.iter_mut().fold([0.0; 2], |[change, size], contact| {
            let [c, s] = contact.update(fields);
            [change + c, size + s]
        })
    }

    fn follow(&self, fields: &Fields, rates: &[[f64; 4]]) -> Vec<(u32, [f64; 3])> {
        self.contacts.iter().flat_map(|c| c.follow(fields, rates)).collect()
    }

    fn blunt(&mut self, factor: f64) {
        self.contacts.iter_mut().for_each(|c| c.bluntness = factor);
    }
}

impl ExternalForces {
    /// What acts at `time_s`, the end of an increment that began at `before`.
    ///
    /// `pressures` are the contact pressures at its start and `young_mpa` sets the penalty.
    pub(crate) fn new(
        boundary: &Boundary,
        domain: &dyn Domain,
        time_s: f64,
        before: &Fields,
        context: StepContext,
        pressures: &[Vec<f64>],
        young_mpa: f64,
    ) -> Self {
        let contacts = boundary.contacts.iter().enumerate().map(|(k, contact)| {
            let pressure = pressures.get(k).cloned();
            ContactStep::new(contact, time_s, before, context.duration, pressure, young_mpa)
        });
        Self { loads: boundary.loads(domain, time_s), contacts: contacts.collect() }
    }

    /// The stress forces of all nodes, N: with equilibrium, all that acts on them from outside.
    pub(crate) fn stress_forces(&self, fields: &Fields, residual: &Residual) -> Vec<[f64; 3]> {
        let mut forces: Vec<[f64; 3]> = residual.nodal.iter().map(|r| [r[0], r[1], r[2]]).collect();
        for (force, load) in forces.iter_mut().zip(self.loads.iter().flatten()) {
            (0..3).for_each(|k| force[k] += load[k]);
        }
        self.add_contact(fields, &mut forces);
        forces
    }

    /// The force of what constrains or presses each surface, N: that of its platen, or the residual of its
    /// nodes.
    pub(crate) fn reactions(
        &self,
        boundary: &Boundary,
        fields: &Fields,
        residual: &Residual,
    ) -> BTreeMap<String, [f64; 3]> {
        let on = |nodes: &[u32]| -> [f64; 3] {
            let force = |n: u32| &residual.nodal[n as usize];
            std::array::from_fn(|k| nodes.iter().map(|&n| force(n)[k]).sum())
        };
        let mut reactions: BTreeMap<_, _> =
            boundary.surfaces.iter().map(|(name, nodes)| (name.clone(), on(nodes))).collect();
        for contact in &self.contacts {
            let mut force = [0.0; 3];
            for (_, nodal) in contact.forces(fields) {
                (0..3).for_each(|k| force[k] += nodal[k]);
            }
            reactions.insert(contact.surface.clone(), force);
        }
        reactions
    }

    fn add_contact(&self, fields: &Fields, forces: &mut [[f64; 3]]) {
        for (node, force) in self.contacts.iter().flat_map(|c| c.forces(fields)) {
            (0..3).for_each(|k| forces[node as usize][k] += force[k]);
        }
    }

    /// Energy that friction and drag dissipate in the increment, N mm.
    pub(crate) fn dissipated(&self, fields: &Fields) -> f64 {
        self.contacts.iter().map(|c| c.dissipated(fields)).sum()
    }
    /// Contact pressures, platen by platen, MPa.
    pub(crate) fn pressures(&self) -> Vec<Vec<f64>> {
        self.contacts.iter().map(ContactStep::pressures).collect()
    }

    /// The nodes of every surface that faces a platen.
    pub(crate) fn contact_points(&self, fields: &Fields) -> BTreeMap<String, Vec<ContactPoint>> {
        self.contacts.iter().map(|c| (c.surface.clone(), c.points(fields))).collect()
    }
}
