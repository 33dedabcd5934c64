//! Everything about a test that does not depend on the values of the parameters.

use crate::contact::SlidingPlatens;
use crate::element::{DamageRule, Linear, Order, Quadratic, Rule, Space, Tetrahedron};
use crate::error::FemError;
use crate::material::{DamageQuadrature, PhaseField};
use crate::mesh::TetMesh;
use crate::operator::{Assembly, Operator, Unknowns};
use crate::solve::LinearPlan;

/// Space, platens, unknowns and what the linear solver needs, shared by runs.
#[derive(Debug)]
pub(crate) struct Discretisation {
    pub(crate) operator: Box<dyn Operator>,
    pub(crate) unknowns: Unknowns,
    pub(crate) linear: LinearPlan,
    pub(crate) platens: SlidingPlatens,
    pub(crate) nodes: Vec<[f64; 3]>,
    /// Regions with damage.
    pub(crate) damaged: Vec<bool>,
    pub(crate) height: f64,
}

impl Discretisation {
    /// Builds the space of the given order; `damaged` marks the regions that have a toughness.
    pub(crate) fn new(
        mesh: &TetMesh,
        order: Order,
        phase_field: Option<&PhaseField>,
        damaged: Vec<bool>,
    ) -> Result<Self, FemError> {
        mesh.validate()?;
        let rule = match phase_field {
            Some(field) if damaged.contains(&true) => damage_rule(field, order, mesh),
            _ => DamageRule::Absent,
        };
        match order {
            Order::Linear => Self::with::<4, Linear>(mesh, rule, damaged),
            Order::Quadratic => Self::with::<10, Quadratic>(mesh, rule, damaged),
        }
    }

    fn with<const N: usize, T: Tetrahedron<N>>(
        mesh: &TetMesh,
        rule: DamageRule,
        damaged: Vec<bool>,
    ) -> Result<Self, FemError> {
        let space = Space::new::<T>(mesh, Rule::new::<T>(rule));
        let (bottom, top) = (end(&space, mesh, "bottom")?, end(&space, mesh, "top")?);
        let level = |nodes: &[u32]| {
            nodes.iter().map(|&n| space.nodes[n as usize][2]).sum::<f64>() / nodes.len() as f64
        };
        let height = level(&top) - level(&bottom);
        if height <= 0.0 {
            return Err(FemError::Platens(
                "surface 'top' does not lie above 'bottom' (the axis is z)",
            ));
        }
        let mut at_bottom = vec![false; space.nodes.len()];
        bottom.iter().for_each(|&n| at_bottom[n as usize] = true);
        if top.iter().any(|&n| at_bottom[n as usize]) {
            return Err(FemError::Platens(
                "surfaces 'bottom' and 'top' have nodes in common, which cannot stand still and move",
            ));
        }
        let platens = SlidingPlatens::new(&space.nodes, bottom, top)?;
        let mut carries_damage = vec![false; space.nodes.len()];
        if rule != DamageRule::Absent {
            for (nodes, &region) in space.tets.iter().zip(&space.region) {
                if damaged[usize::from(region)] {
                    nodes.iter().for_each(|&n| carries_damage[n as usize] = true);
                }
            }
        }
        let (linear, unknowns) =
            LinearPlan::new(&space.tets, &space.nodes, &carries_damage, platens.held())?;
        let nodes = space.nodes.clone();
        Ok(Self {
            operator: Box::new(Assembly::new::<T>(space)),
            unknowns,
            linear,
            platens,
            nodes,
            damaged,
            height,
        })
    }
}

/// The nodes of a loaded end.
fn end<const N: usize>(
    space: &Space<N>,
    mesh: &TetMesh,
    name: &'static str,
) -> Result<Vec<u32>, FemError> {
    match mesh.surfaces.get(name) {
        Some(triangles) if !triangles.is_empty() => Ok(space.nodes_on(triangles)),
        _ => {
            let names: Vec<_> = mesh
                .surfaces
                .iter()
                .filter(|(_, t)| !t.is_empty())
                .map(|(n, _)| format!("'{n}'"))
                .collect();
            let present = if names.is_empty() { "none".into() } else { names.join(", ") };
            Err(FemError::MissingSurface { name, present })
        }
    }
}

fn damage_rule(field: &PhaseField, order: Order, mesh: &TetMesh) -> DamageRule {
    match field.quadrature {
        DamageQuadrature::Vertex => DamageRule::Vertex,
        DamageQuadrature::Consistent => DamageRule::Consistent,
        DamageQuadrature::Auto => {
            // quadratic elements have a node in the middle of each edge
            let between_nodes = match order {
                Order::Linear => mesh.mean_edge(),
                Order::Quadratic => 0.5 * mesh.mean_edge(),
            };
            if field.length_mm < 2.0 * between_nodes {
                DamageRule::Vertex
            } else {
                DamageRule::Consistent
            }
        }
    }
}
