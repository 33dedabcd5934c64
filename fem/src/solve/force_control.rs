//! Equations of Newton's method with the displacement of the platen as an additional unknown, and the force of the platen as an
//! additional equation.
//!
//! With the residual R(x, d) at the fields x and the platen displacement d, and the force F(x, d) of the platen, the
//! equations are R = 0 at the free values and F = F*. The Newton step (δ, σ) of (x, d) satisfies K δ + b σ = R and
//! F − F* = dF·(δ, σ), with the tangent K and b = ∂R/∂d. The bordered system is solved by two solutions with the same
//! factor: a = K⁻¹ R and the response K⁻¹ b. The response is stored until the tangent changes.

use super::linear::Nodal;
use crate::boundary::{DrivenPlaten, ExternalForces};
use crate::fields::Fields;
use crate::operator::{NodeBlock, Residual};
use crate::parallel::Halo;

/// The force that a platen must exert, and the linearisation of this force.
#[derive(Clone, Debug)]
pub(crate) struct ForceControl {
    platen: DrivenPlaten,
    /// Prescribed force F*, N; `None` while the displacement of the platen is prescribed.
    target_n: Option<f64>,
    /// Force F at the fields evaluated last, N.
    pub(super) force_n: f64,
    /// Contact with the platen in the tangent.
    contact: Vec<NodeBlock>,
    /// Response of the fields to the displacement of the platen; `None` if it is not computed yet.
    response: Option<Response>,
    /// Newton step σ of the displacement of the platen, mm; zero if the displacement is fixed in the current iteration.
    pub(super) step_mm: f64,
}

/// Response of the fields to the displacement of the platen at constant tangent.
#[derive(Clone, Debug)]
struct Response {
    /// K⁻¹ b, by node.
    values: Vec<Nodal>,
    /// Derivative dF/dd of the force if the fields follow the platen, N/mm.
    stiffness: f64,
}

impl ForceControl {
    pub(crate) fn new(platen: DrivenPlaten) -> Self {
        Self {
            platen,
            target_n: None,
            force_n: 0.0,
            contact: Vec::new(),
            response: None,
            step_mm: 0.0,
        }
    }

    /// Sets the prescribed force, N; `None` prescribes the displacement of the platen instead.
    pub(super) fn prescribe(&mut self, target_n: Option<f64>) {
        (self.target_n, self.step_mm) = (target_n, 0.0);
    }

    /// Whether the force is prescribed.
    pub(super) fn is_active(&self) -> bool {
        self.target_n.is_some()
    }

    /// Computes the force at the fields, and the equation's share of the squared norms of residual and external forces.
    /// The force difference is distributed to the nodes of the platen, so that it is comparable with nodal forces. The
    /// shares are zero while the displacement of the platen is prescribed.
    pub(super) fn evaluate(
        &mut self,
        external: &ExternalForces,
        fields: &Fields,
        residual: &Residual,
        halo: &Halo,
    ) -> [f64; 2] {
        let Some(target_n) = self.target_n else { return [0.0; 2] };
        let DrivenPlaten { direction, functional, nodes, .. } = &self.platen;
        let contact = external.driven_force(fields);
        let along: f64 = (0..3).map(|k| direction[k] * contact[k]).sum();
        let mut sum = [along + dot(functional, &residual.nodal)];
        halo.ranks().sum(&mut sum);
        self.force_n = sum[0];
        [self.force_n - target_n, target_n].map(|force| force * force / nodes.max(1.0))
    }

    /// Stores the contact of a new tangent, and discards the response at the earlier tangent.
    pub(super) fn linearise(&mut self, external: &ExternalForces, fields: &Fields) {
        self.contact = external.driven_tangent(fields);
        self.response = None;
    }

    /// Whether the response to the platen has to be computed.
    pub(super) fn needs_response(&self) -> bool {
        self.response.is_none()
    }

    /// Returns the displacements of the nodes that are fixed to the platen, for a platen displacement of 1 mm.
    pub(super) fn motion(&self) -> &[Nodal] {
        &self.platen.motion
    }

    /// Returns b = ∂R/∂d from the product of the tangent with [`motion`](Self::motion).
    pub(super) fn border(&self, mut product: Vec<Nodal>) -> Vec<Nodal> {
        for (node, force) in self.contact_border() {
            (0..3).for_each(|k| product[node as usize][k] += force[k]);
        }
        product
    }

    /// Stores the response K⁻¹ b. `of_response` and `of_motion` are the products of the tangent with the response and
    /// with [`motion`](Self::motion).
    pub(super) fn respond(
        &mut self,
        values: Vec<Nodal>,
        of_response: &[Nodal],
        of_motion: &[Nodal],
        halo: &Halo,
    ) {
        let DrivenPlaten { direction, functional, .. } = &self.platen;
        // if the platen moves at constant fields, its contact force changes as if the nodes moved in the opposite
        // direction
        let owned = self.contact_border().filter(|(node, _)| halo.owns(*node));
        let contact: f64 =
            owned.map(|(_, force)| -(0..3).map(|k| direction[k] * force[k]).sum::<f64>()).sum();
        let mut sum = [dot(functional, of_motion) + contact];
        halo.ranks().sum(&mut sum);
        let stiffness = sum[0] - self.force_change(&values, of_response, halo);
        self.response = Some(Response { values, stiffness });
    }

    /// Completes the Newton step `step` = K⁻¹ R at constant platen: computes the step σ of the platen and subtracts σ
    /// times the response. `product` is the product of the tangent with `step`. Returns `false` if the force does not
    /// depend on the displacement of the platen.
    pub(super) fn complete(&mut self, step: &mut [Nodal], product: &[Nodal], halo: &Halo) -> bool {
        let (Some(target_n), Some(response)) = (self.target_n, &self.response) else {
            return false;
        };
        let Response { values, stiffness } = response;
        let missing_n = self.force_n - target_n - self.force_change(step, product, halo);
        self.step_mm = missing_n / stiffness;
        for (step, response) in step.iter_mut().zip(values) {
            (0..4).for_each(|k| step[k] -= self.step_mm * response[k]);
        }
        self.step_mm.is_finite()
    }

    /// Returns the change of the force for a change `x` of the fields at constant platen, N. `product` is the product of
    /// the tangent with `x`.
    fn force_change(&self, x: &[Nodal], product: &[Nodal], halo: &Halo) -> f64 {
        let DrivenPlaten { direction, functional, .. } = &self.platen;
        let mut contact = 0.0;
        for (node, block) in self.contact.iter().filter(|(node, _)| halo.owns(*node)) {
            let x = &x[*node as usize];
            for i in 0..3 {
                contact -= direction[i] * (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
        let mut sum = [dot(functional, product) + contact];
        halo.ranks().sum(&mut sum);
        sum[0]
    }

    /// Returns the contribution of contact to b by node: a moving platen has the opposite effect of a moving node.
    fn contact_border(&self) -> impl Iterator<Item = (u32, [f64; 3])> {
        let direction = self.platen.direction;
        self.contact.iter().map(move |(node, block)| {
            let force = block.map(|row| -(0..3).map(|k| row[k] * direction[k]).sum::<f64>());
            (*node, force)
        })
    }
}

fn dot(a: &[Nodal], b: &[Nodal]) -> f64 {
    a.as_flattened().iter().zip(b.as_flattened()).map(|(a, b)| a * b).sum()
}
