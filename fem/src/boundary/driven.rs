//! Platen whose load program prescribes a force.

use super::compiled::Boundary;
use super::constraint::Value;
use crate::fields::Fields;

/// Platen whose load program prescribes a force, as an unknown displacement with an equation for the force.
#[derive(Clone, Debug)]
pub(crate) struct DrivenPlaten {
    /// Direction of the displacement and of the force on the body.
    pub(crate) direction: [f64; 3],
    /// Displacements of the nodes that are fixed to the platen, for a platen displacement of 1 mm.
    pub(crate) motion: Vec<[f64; 4]>,
    /// Vector c of the force c·R that the platen exerts on the nodes that are fixed to it; R is the residual.
    pub(crate) functional: Vec<[f64; 4]>,
    /// Number of nodes that are fixed to the platen or can touch it, over all ranks.
    pub(crate) nodes: f64,
}

impl Boundary {
    /// Writes the displacements of the nodes that are fixed to the platen of a load program into the fields.
    pub(crate) fn follow_platen(&self, fields: &mut Fields) {
        for dof in &self.constrained {
            if let Value::Driven(multiple) = dof.value {
                fields.displacement[dof.node as usize][dof.component] = multiple * fields.platen_mm;
            }
        }
    }

    /// Returns the platen whose load program prescribes a force.
    pub(crate) fn driven_platen(&self, nodes: usize) -> Option<DrivenPlaten> {
        let direction = self.driven?;
        let mut motion = vec![[0.0; 4]; nodes];
        let mut count = 0;
        for dof in &self.constrained {
            if let Value::Driven(multiple) = dof.value {
                motion[dof.node as usize][dof.component] = multiple;
                count += usize::from(self.part.halo.owns(dof.node));
            }
        }
        let contacts = self.contacts.iter().filter(|contact| contact.is_driven());
        count += contacts.map(|contact| contact.own_places().count()).sum::<usize>();
        let mut counts = [count as f64];
        self.part.ranks().sum(&mut counts);
        let functional = self.measured(nodes).unwrap_or_else(|| vec![[0.0; 4]; nodes]);
        Some(DrivenPlaten { direction, motion, functional, nodes: counts[0] })
    }
}
