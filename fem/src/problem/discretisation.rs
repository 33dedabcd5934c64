//! Everything about a problem that does not depend on the values of the parameters.

use std::sync::Arc;

use crate::boundary::{Boundary, Conditions};
use crate::element::{DamageRule, Linear, Order, Quadratic, Space, Tetrahedron};
use crate::error::FemError;
use crate::material::{CrackDensity, DamageQuadrature, PhaseField};
use crate::mesh::TetMesh;
use crate::operator::{Assembly, Operator, Unknowns};
use crate::solve::{LinearPlan, LinearScheme};

/// Space, boundary conditions, unknowns and what the linear solver needs, shared by runs.
#[derive(Debug)]
pub(crate) struct Discretisation {
    pub(crate) operator: Arc<dyn Operator>,
    pub(crate) unknowns: Unknowns,
    pub(crate) linear: LinearPlan,
    pub(crate) boundary: Boundary,
    /// Nodes with damage.
    carries_damage: Vec<bool>,
    /// Regions with damage.
    pub(crate) damaged: Vec<bool>,
}

impl Discretisation {
    /// Builds the space of the given order; `damaged` marks the regions that have a toughness.
    pub(crate) fn new(
        mesh: &TetMesh,
        order: Order,
        phase_field: Option<&PhaseField>,
        damaged: Vec<bool>,
        conditions: &Conditions,
        duration_s: f64,
        linear: LinearScheme,
    ) -> Result<Self, FemError> {
        mesh.validate()?;
        let rule = match phase_field {
            Some(field) if damaged.contains(&true) => damage_rule(field, order, mesh)?,
            _ => DamageRule::Absent,
        };
        match order {
            Order::Linear => {
                Self::with::<4, Linear>(mesh, rule, damaged, conditions, duration_s, linear)
            }
            Order::Quadratic => {
                Self::with::<10, Quadratic>(mesh, rule, damaged, conditions, duration_s, linear)
            }
        }
    }

    fn with<const N: usize, T: Tetrahedron<N>>(
        mesh: &TetMesh,
        rule: DamageRule,
        damaged: Vec<bool>,
        conditions: &Conditions,
        duration_s: f64,
        linear: LinearScheme,
    ) -> Result<Self, FemError> {
        let space = Space::new::<T>(mesh, rule);
        let boundary = Boundary::new(&space, mesh, conditions, damaged.clone(), duration_s)?;
        let mut carries_damage = vec![false; space.nodes.len()];
        if rule != DamageRule::Absent {
            for (nodes, &region) in space.tets.iter().zip(&space.region) {
                if damaged[usize::from(region)] {
                    nodes.iter().for_each(|&n| carries_damage[n as usize] = true);
                }
            }
        }
        let (linear, unknowns) = LinearPlan::new(
            &space.tets,
            &space.nodes,
            &carries_damage,
            boundary.constrained(),
            linear,
        )?;
        Ok(Self {
            operator: Arc::new(Assembly::new(space)),
            unknowns,
            linear,
            boundary,
            carries_damage,
            damaged,
        })
    }

    /// The same space, with what the linear solver knows of it, under other conditions.
    pub(crate) fn with_conditions(
        &self,
        mesh: &TetMesh,
        conditions: &Conditions,
        duration_s: f64,
    ) -> Result<Self, FemError> {
        let domain = self.operator.domain();
        let boundary = Boundary::new(domain, mesh, conditions, self.damaged.clone(), duration_s)?;
        let (linear, unknowns) =
            self.linear.with_constrained(&self.carries_damage, boundary.constrained())?;
        Ok(Self {
            operator: Arc::clone(&self.operator),
            unknowns,
            linear,
            boundary,
            carries_damage: self.carries_damage.clone(),
            damaged: self.damaged.clone(),
        })
    }

    /// Reference positions of the nodes, mm.
    pub(crate) fn nodes(&self) -> &[[f64; 3]] {
        self.operator.domain().nodes()
    }
}

fn damage_rule(field: &PhaseField, order: Order, mesh: &TetMesh) -> Result<DamageRule, FemError> {
    // ∫ N_a dV of the vertices of a quadratic element is negative: α = φ would reward damage there
    let lumped = order == Order::Quadratic && field.model == CrackDensity::At1;
    let gauss = matches!(field.quadrature, DamageQuadrature::Consistent | DamageQuadrature::Eleven);
    if lumped && gauss {
        return Err(FemError::Unsupported {
            entity: "phase_field".into(),
            message: "with Gauss points, AT1 damages the vertices of quadratic elements unloaded"
                .into(),
            help: "take quadrature = \"vertex\", which \"auto\" does, or linear elements".into(),
        });
    }
    Ok(match field.quadrature {
        DamageQuadrature::Vertex => DamageRule::Vertex,
        DamageQuadrature::Consistent => DamageRule::Consistent,
        DamageQuadrature::Eleven => DamageRule::Eleven,
        DamageQuadrature::Auto => {
            // quadratic elements have a node in the middle of each edge
            let between_nodes = match order {
                Order::Linear => mesh.mean_edge(),
                Order::Quadratic => 0.5 * mesh.mean_edge(),
            };
            if lumped || field.length_mm < 2.0 * between_nodes {
                DamageRule::Vertex
            } else {
                DamageRule::Consistent
            }
        }
    })
}
