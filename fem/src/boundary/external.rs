//! External forces on the body in one increment: loads and contact.

use std::collections::BTreeMap;
use std::sync::Arc;

use super::compiled::Boundary;
use super::contact::{Contact, ContactPoint, ContactStep};
use super::loads::Loads;
use super::pressure::Follower;
use crate::element::Domain;
use crate::fields::Fields;
use crate::operator::{NodeBlock, PairBlock, Residual, StepContext};
use crate::parallel::Part;

/// Relative rounding error of a gap, in units of `f64::EPSILON`.
const ROUNDED: f64 = 4.0;

/// Loads and contact at the end of an increment.
#[derive(Clone, Debug, Default)]
pub(crate) struct ExternalForces {
    loads: Option<Loads>,
    contacts: Vec<ContactStep>,
    /// Pressures normal to the deformed surface.
    followers: Vec<Follower>,
    part: Arc<Part>,
}

impl ExternalForces {
    /// Creates the external forces of a body without loads and contact.
    pub(crate) fn none(boundary: &Boundary) -> Self {
        Self { part: Arc::clone(boundary.part()), ..Self::default() }
    }

    /// Creates the external forces at `time_s`, the end of an increment that started at the fields `before`.
    ///
    /// `pressures` are the contact pressures at the start of the increment, MPa, by platen and node; `modulus_mpa`
    /// scales the contact penalty.
    pub(crate) fn new(
        boundary: &Boundary,
        domain: &dyn Domain,
        time_s: f64,
        before: &Fields,
        context: StepContext,
        pressures: &[Vec<f64>],
        modulus_mpa: f64,
    ) -> Self {
        let contacts = boundary.contacts.iter().enumerate().map(|(k, contact)| {
            let pressure = pressures.get(k).cloned();
            ContactStep::new(contact, time_s, before, context.duration, pressure, modulus_mpa)
        });
        let (contacts, part) = (contacts.collect(), Arc::clone(boundary.part()));
        let followers = boundary.followers(domain, time_s);
        Self { loads: boundary.loads(domain, time_s), contacts, followers, part }
    }

    /// Subtracts the external forces from a residual that contains only internal forces, and sets
    /// `residual.external`.
    pub(crate) fn subtract(&self, fields: &Fields, residual: &mut Residual) {
        residual.external = [0.0; 2];
        let halo = &self.part.halo;
        for (node, load) in self.nodal_loads().enumerate() {
            let counts = f64::from(halo.owns(node as u32));
            for k in 0..4 {
                residual.nodal[node][k] -= load[k];
                residual.external[k / 3] += counts * load[k] * load[k];
            }
        }
        for (node, force) in self.follower_forces(fields) {
            let counts = f64::from(halo.owns(node));
            for k in 0..3 {
                residual.nodal[node as usize][k] -= force[k];
                residual.external[0] += counts * force[k] * force[k];
            }
        }
        for (node, force) in self.contacts.iter().flat_map(|c| c.forces(fields)) {
            let counts = f64::from(halo.owns(node));
            for k in 0..3 {
                residual.nodal[node as usize][k] -= force[k];
                residual.external[0] += counts * force[k] * force[k];
            }
        }
    }

    /// Returns the forces of follower pressures, N, one entry per node.
    fn follower_forces(&self, fields: &Fields) -> BTreeMap<u32, [f64; 3]> {
        let mut forces: BTreeMap<u32, [f64; 3]> = BTreeMap::new();
        for follower in &self.followers {
            follower.forces(fields, &mut |node, force| {
                let sum = forces.entry(node).or_default();
                (0..3).for_each(|k| sum[k] += force[k]);
            });
        }
        forces
    }

    /// Returns the contributions of follower pressures to the tangent.
    pub(crate) fn pair_tangent(&self, fields: &Fields) -> Vec<PairBlock> {
        let mut pairs = Vec::new();
        self.followers.iter().for_each(|follower| follower.add_tangent(fields, &mut pairs));
        pairs
    }

    /// Returns the contributions of contact to the tangent.
    pub(crate) fn tangent(&self, fields: &Fields) -> Vec<NodeBlock> {
        self.contacts.iter().flat_map(|c| c.blocks(fields)).collect()
    }

    /// Returns the contributions to the tangent of the contact with the platen whose load program prescribes a force.
    pub(crate) fn driven_tangent(&self, fields: &Fields) -> Vec<NodeBlock> {
        self.driven_contacts().flat_map(|c| c.blocks(fields)).collect()
    }

    /// Returns the contact force on the body of the platen whose load program prescribes a force, N: the sum over the
    /// nodes of this rank.
    pub(crate) fn driven_force(&self, fields: &Fields) -> [f64; 3] {
        let forces = self.driven_contacts().map(|contact| contact.force(fields));
        forces.fold([0.0; 3], |sum, force| std::array::from_fn(|k| sum[k] + force[k]))
    }

    fn driven_contacts(&self) -> impl Iterator<Item = &ContactStep> {
        self.contacts.iter().filter(|contact| contact.is_driven())
    }

    /// Returns whether any surface faces a platen, so that contact pressures must be determined.
    pub(crate) fn has_contact(&self) -> bool {
        !self.contacts.is_empty()
    }

    /// Returns whether any platen has friction.
    pub(crate) fn has_friction(&self) -> bool {
        self.contacts.iter().any(ContactStep::has_friction)
    }

    /// Performs one augmentation of the augmented Lagrangian method: updates the contact pressures from the gaps.
    /// Returns the sum of the squared changes of the nodal contact forces, N².
    pub(crate) fn augment(&mut self, fields: &Fields) -> f64 {
        let mut square = [self.contacts.iter_mut().map(|contact| contact.update(fields)).sum()];
        self.part.ranks().sum(&mut square);
        square[0]
    }

    /// Returns the derivatives of the nodal contact forces with respect to a parameter θ that keep the gaps of
    /// frictionless contact closed: −γ A (n·du/dθ) n, N per unit of θ, with the penalty γ, the nodal area A, the normal
    /// n and the derivatives du/dθ in `rates`.
    pub(crate) fn follow(&self, fields: &Fields, rates: &[[f64; 4]]) -> Vec<(u32, [f64; 3])> {
        self.contacts.iter().flat_map(|c| c.follow(fields, rates)).collect()
    }

    /// Returns an estimate of the rounding error of the contact forces as two terms: a term that is proportional to
    /// the displacement, N/mm, and a constant term, N.
    pub(crate) fn rounding(&self) -> [f64; 2] {
        let mut squares = [0.0; 2];
        for (square, length) in self.contacts.iter().map(ContactStep::stiffness) {
            squares[0] += square;
            squares[1] += square * length * length;
        }
        if self.has_contact() {
            self.part.ranks().sum(&mut squares);
        }
        squares.map(|square| ROUNDED * f64::EPSILON * square.sqrt())
    }

    /// Multiplies the slip velocity ε, below which friction decreases to zero, by `factor`.
    pub(crate) fn blunt(&mut self, factor: f64) {
        self.contacts.iter_mut().for_each(|c| c.bluntness = factor);
    }

    fn nodal_loads(&self) -> impl Iterator<Item = &[f64; 4]> {
        self.loads.iter().flat_map(|loads| &loads.nodal)
    }

    /// Returns whether loads and positions of platens are finite on all ranks.
    pub(crate) fn is_finite(&self) -> bool {
        let loads = self.nodal_loads().flatten().all(|x| x.is_finite());
        let loads = loads && self.followers.iter().all(Follower::is_finite);
        let finite = loads && self.contacts.iter().all(ContactStep::is_finite);
        !self.part.ranks().any(!finite)
    }

    /// Returns the external forces at all nodes. Three components are the forces that balance the internal forces, N;
    /// the fourth component results from prescribed damage and sources of damage, N mm.
    pub(crate) fn outer_forces(
        &self,
        boundary: &Boundary,
        fields: &Fields,
        residual: &Residual,
    ) -> Vec<[f64; 4]> {
        let mut forces: Vec<[f64; 4]> =
            residual.nodal.iter().map(|&[x, y, z, _]| [x, y, z, 0.0]).collect();
        for node in boundary.damaged_nodes() {
            forces[node as usize][3] = residual.nodal[node as usize][3];
        }
        for (force, load) in forces.iter_mut().zip(self.nodal_loads()) {
            (0..4).for_each(|k| force[k] += load[k]);
        }
        for (node, follower) in self.follower_forces(fields) {
            (0..3).for_each(|k| forces[node as usize][k] += follower[k]);
        }
        self.add_contact(fields, &mut forces);
        forces
    }

    /// Returns the total force on each surface from its prescribed values, platen, tractions and pressures, N, summed over all
    /// ranks.
    pub(crate) fn reactions(
        &self,
        boundary: &Boundary,
        fields: &Fields,
        residual: &Residual,
    ) -> BTreeMap<String, [f64; 3]> {
        let mut reactions = boundary.support_forces(&residual.nodal);
        let platens = self.contacts.iter().map(|c| (&c.surface, c.force(fields)));
        let tractions = self.loads.iter().flat_map(|loads| &loads.tractions);
        for (surface, force) in platens.chain(tractions.map(|(name, force)| (name, *force))) {
            let sum = reactions.entry(surface.clone()).or_default();
            (0..3).for_each(|k| sum[k] += force[k]);
        }
        for follower in &self.followers {
            let sum = reactions.entry(follower.surface.clone()).or_default();
            follower.forces(fields, &mut |_, force| (0..3).for_each(|k| sum[k] += force[k]));
        }
        // the map is sorted by name: the order of the forces is the same on every rank
        let mut forces: Vec<f64> = reactions.values().flatten().copied().collect();
        self.part.ranks().sum(&mut forces);
        reactions.values_mut().zip(forces.as_chunks().0).for_each(|(to, &force)| *to = force);
        reactions
    }

    fn add_contact(&self, fields: &Fields, forces: &mut [[f64; 4]]) {
        for (node, force) in self.contacts.iter().flat_map(|c| c.forces(fields)) {
            (0..3).for_each(|k| forces[node as usize][k] += force[k]);
        }
    }

    /// Returns the name of a surface of this rank that faces a platen and has no node in contact with the platen.
    pub(crate) fn untouched(&self, fields: &Fields) -> Option<String> {
        let untouched = |contact: &&ContactStep| contact.is_open(fields);
        self.contacts.iter().find(untouched).map(|contact| contact.surface.clone())
    }

    /// Returns the energy that friction and drag dissipate in the increment, N mm, summed over all ranks.
    pub(crate) fn dissipated(&self, fields: &Fields) -> f64 {
        let mut sum = [self.contacts.iter().map(|c| c.dissipated(fields)).sum()];
        self.part.ranks().sum(&mut sum);
        sum[0]
    }

    /// Returns the contact pressures by platen and node, MPa.
    pub(crate) fn pressures(&self) -> Vec<Vec<f64>> {
        self.contacts.iter().map(ContactStep::pressures).collect()
    }

    /// Returns the contact points of every surface that faces a platen, gathered from all ranks.
    pub(crate) fn contact_points(
        &self,
        boundary: &Boundary,
        fields: &Fields,
    ) -> BTreeMap<String, Vec<ContactPoint>> {
        let named_points = |(step, contact): (&ContactStep, &Contact)| {
            let contact_points = step.contact_points(fields);
            let contact_points = if self.part.is_whole() {
                contact_points
            } else {
                self.gathered(contact, contact_points)
            };
            (step.surface.clone(), contact_points)
        };
        self.contacts.iter().zip(&boundary.contacts).map(named_points).collect()
    }

    /// Gathers the contact points of all ranks, with the node numbers of the whole mesh.
    fn gathered(&self, contact: &Contact, contact_points: Vec<ContactPoint>) -> Vec<ContactPoint> {
        let indices: Vec<u32> = contact.own_places().collect();
        let owned: Vec<&ContactPoint> = contact.own_of(&contact_points).collect();
        let nodes: Vec<u32> = owned.iter().map(|p| self.part.nodes[p.node as usize]).collect();
        let values = owned.iter().flat_map(|p| {
            let [x, y, z] = p.force_n;
            [p.area_mm2, p.pressure_mpa, p.gap_mm, x, y, z]
        });
        let values: Vec<f64> = values.collect();
        let nodes = self.part.ordered(&indices, 1, &nodes, contact.all);
        let values = self.part.ordered(&indices, 6, &values, contact.all);
        let point = |(node, n): (u32, &[f64; 6])| ContactPoint {
            node,
            area_mm2: n[0],
            pressure_mpa: n[1],
            gap_mm: n[2],
            force_n: [n[3], n[4], n[5]],
        };
        nodes.into_iter().zip(values.as_chunks().0).map(point).collect()
    }
}
