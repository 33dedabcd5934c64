//! Degrees of freedom whose value is prescribed.

use std::collections::BTreeMap;

use super::function::Function;
use crate::error::{FemError, Unsupported};

/// One degree of freedom whose value is prescribed; component 3 is the damage.
#[derive(Clone, Debug)]
pub(super) struct ConstrainedDof {
    pub(super) node: u32,
    pub(super) component: usize,
    pub(super) value: Value,
}

/// Prescribed value of a degree of freedom, as a function of position and time, or of the displacement of the platen.
#[derive(Clone, Debug)]
pub(super) enum Value {
    Zero,
    Displacement(Function<[f64; 3]>),
    Damage(Function<f64>),
    /// Multiple of the displacement of a platen whose load program prescribes a force.
    Driven(f64),
}

impl ConstrainedDof {
    /// Returns the prescribed value at a reference position (mm), a time and a displacement of the platen (mm): a
    /// displacement component (mm) or the damage.
    pub(super) fn at(&self, position: [f64; 3], time_s: f64, platen_mm: f64) -> f64 {
        match &self.value {
            Value::Zero => 0.0,
            Value::Displacement(f) => f.at(position, time_s)[self.component],
            Value::Damage(f) => f.at(position, time_s),
            Value::Driven(multiple) => multiple * platen_mm,
        }
    }
}

/// Constraints, collected surface by surface.
pub(super) struct Constraints<'a> {
    nodes: &'a [[f64; 3]],
    duration_s: f64,
    dofs: Vec<ConstrainedDof>,
    /// For each constrained component of a node: its index in `dofs`, and the name of the surface that constrained it
    /// first.
    first: BTreeMap<(u32, usize), (usize, String)>,
}

impl<'a> Constraints<'a> {
    /// Creates an empty set for nodes with the given reference positions, mm. The values that surfaces prescribe at a
    /// common node are compared at half of `duration_s` and at its end.
    pub(super) fn new(nodes: &'a [[f64; 3]], duration_s: f64) -> Self {
        Self { nodes, duration_s, dofs: Vec::new(), first: BTreeMap::new() }
    }

    /// Constrains a component on the nodes of a surface. Returns an error if another surface prescribes a different
    /// value at a common node.
    pub(super) fn add(
        &mut self,
        surface: &str,
        nodes: &[u32],
        component: usize,
        value: Value,
    ) -> Result<(), FemError> {
        for &node in nodes {
            let dof = ConstrainedDof { node, component, value: value.clone() };
            match self.first.get(&(node, component)) {
                Some((first, other)) => self.agree(&self.dofs[*first], other, &dof, surface)?,
                None => {
                    self.first.insert((node, component), (self.dofs.len(), surface.into()));
                    self.dofs.push(dof);
                }
            }
        }
        Ok(())
    }

    pub(super) fn into_dofs(self) -> Vec<ConstrainedDof> {
        self.dofs
    }

    /// Returns an error if two surfaces prescribe different values at a common node.
    fn agree(
        &self,
        first: &ConstrainedDof,
        first_surface: &str,
        second: &ConstrainedDof,
        second_surface: &str,
    ) -> Result<(), FemError> {
        const NAMES: [&str; 4] = ["u_x", "u_y", "u_z", "the damage"];
        let x = self.nodes[first.node as usize];
        for fraction in [0.5, 1.0] {
            let [a, b] = [first, second].map(|dof| dof.at(x, fraction * self.duration_s, fraction));
            if (a - b).abs() > 1e-9 * (a.abs() + b.abs()) + 1e-12 {
                let reason = Unsupported::Conflict {
                    node: first.node,
                    position_mm: x,
                    component: NAMES[first.component],
                    first: a,
                    second: b,
                };
                let entity = format!("surfaces '{first_surface}' and '{second_surface}'");
                return Err(FemError::unsupported(entity, reason));
            }
        }
        Ok(())
    }
}
