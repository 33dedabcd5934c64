//! Space, unknowns and solver structure, which do not depend on the values of the material parameters.

use std::sync::Arc;

use super::definition::Definition;
use crate::boundary::Boundary;
use crate::element::{
    DamageRule, Domain, ExtraTerms, Linear, Order, Quadratic, Space, Tetrahedron,
};
use crate::error::{FemError, Unsupported};
use crate::material::{CrackDensity, DamageQuadrature, MOST_GRAIN, PhaseField};
use crate::operator::{Assembly, Operator, Unknowns, linear, quadratic};
use crate::parallel::{Part, bisect};
use crate::problem::interface::{Bands, Interface, have_same_bands};
use crate::solve::{LinearPlan, LinearScheme};
use fem_mesh::TetMesh;

/// Space, boundary conditions, unknowns and linear solver structure, shared by runs. With several ranks, each rank
/// stores its part of the mesh.
#[derive(Debug)]
pub(crate) struct Discretisation {
    pub(crate) operator: Arc<dyn Operator>,
    pub(crate) unknowns: Unknowns,
    /// Number of equations, summed over all ranks.
    pub(crate) equations: usize,
    pub(crate) linear: LinearPlan,
    pub(crate) boundary: Boundary,
    /// For each node, whether damage is an unknown.
    carries_damage: Vec<bool>,
    /// For each region, whether damage is an unknown.
    pub(crate) damaged: Vec<bool>,
    damage_rule: DamageRule,
    /// Interface bands.
    pub(crate) bands: Bands,
    /// Interfaces that the bands belong to.
    interfaces: Arc<[Interface]>,
}

impl Discretisation {
    /// Creates the discretisation with linear or quadratic elements.
    pub(crate) fn new(definition: &Definition) -> Result<Self, FemError> {
        definition.mesh.validate()?;
        match definition.order {
            Order::Linear => {
                // linear elements have straight edges, so the edges of the mesh must be straight
                definition.mesh.validate_straight()?;
                Self::with::<4, Linear>(definition)
            }
            Order::Quadratic => Self::with::<10, Quadratic>(definition),
        }
    }

    /// Creates the operator of the whole mesh, which all ranks together store in parts.
    pub(crate) fn whole(&self, definition: &Definition) -> Arc<dyn Operator> {
        let (mesh, rule) = (&definition.mesh, self.damage_rule);
        let bands = self.bands.of_element().to_vec();
        match definition.order {
            Order::Linear => {
                let mut space = Space::new::<Linear>(mesh, rule).with_bands(bands);
                space.rule.extra = extra_terms(definition);
                linear(Assembly::new(space).homogenised(definition.homogenisation))
            }
            Order::Quadratic => {
                let mut space = Space::new::<Quadratic>(mesh, rule).with_bands(bands);
                space.rule.extra = extra_terms(definition);
                quadratic(Assembly::new(space).homogenised(definition.homogenisation))
            }
        }
    }

    fn with<const N: usize, T: Tetrahedron<N>>(definition: &Definition) -> Result<Self, FemError> {
        let damaged = definition.damaged();
        let damage_rule = rule_of(definition)?;
        let interfaces = match &definition.phase_field {
            Some(_) => Arc::clone(&definition.interfaces),
            None => Arc::default(),
        };
        let bands = Bands::new(&definition.mesh, &interfaces, &damaged)?;
        let space = Space::new::<T>(&definition.mesh, damage_rule);
        let mut space = space.with_bands(bands.of_element().to_vec());
        space.rule.extra = extra_terms(definition);
        let mut boundary = boundary(&space, definition, damaged.clone())?;
        let mut carries_damage = vec![false; space.nodes.len()];
        if damage_rule != DamageRule::Absent {
            for (tet, nodes) in space.tets.iter().enumerate() {
                if damaged[usize::from(space.region[tet])] && space.fraction(tet) <= MOST_GRAIN {
                    nodes.iter().for_each(|&n| carries_damage[n as usize] = true);
                }
            }
        }
        let order: Vec<u32> = (0..space.nodes.len() as u32).collect();
        let equations = Unknowns::new(&order, &carries_damage, boundary.constrained()).count;
        let mut part = Arc::default();
        let mut linear = definition.options.linear;
        if definition.ranks.size() > 1 {
            let rank_of_tet = rank_of_tets(&space, definition.ranks.size());
            let nodes = [space.nodes.len(), definition.mesh.nodes.len()];
            part =
                Arc::new(Part::new(&definition.ranks, &rank_of_tet, |tet| &space.tets[tet], nodes));
            boundary = boundary.of_part(Arc::clone(&part), &space, &rank_of_tet);
            space = space.part(&part);
            carries_damage = part.pick_nodes(&carries_damage);
            linear = LinearScheme::Multigrid;
        }
        let (linear, unknowns) = LinearPlan::new(
            &space.tets,
            &space.nodes,
            &carries_damage,
            boundary.constrained(),
            linear,
            definition.device.as_ref(),
        )?;
        let device = definition.device.clone().filter(|_| linear.is_on_device());
        let assembly = Assembly::new(space).homogenised(definition.homogenisation);
        let operator = Arc::new(assembly.of_part(part).on_device(device));
        Ok(Self {
            operator,
            unknowns,
            equations,
            linear,
            boundary,
            carries_damage,
            damaged,
            damage_rule,
            bands,
            interfaces: Arc::clone(&definition.interfaces),
        })
    }

    /// Returns whether other materials and interfaces have the same unknowns and bands, on the same mesh.
    pub(crate) fn suits(&self, definition: &Definition) -> bool {
        definition.damaged() == self.damaged
            && self.operator.domain().rule().extra == extra_terms(definition)
            && have_same_bands(&definition.interfaces, &self.interfaces)
    }

    /// Returns the discretisation for other boundary conditions. The space and the structure of the linear solver are
    /// reused.
    pub(crate) fn with_conditions(&self, definition: &Definition) -> Result<Self, FemError> {
        if definition.ranks.size() > 1 {
            // create a new discretisation, because boundary conditions can only be created on the whole mesh, and this
            // discretisation contains only a part of the mesh
            return Self::new(definition);
        }
        let boundary = boundary(self.operator.domain(), definition, self.damaged.clone())?;
        let (linear, unknowns) =
            self.linear.with_constrained(&self.carries_damage, boundary.constrained())?;
        Ok(Self {
            operator: Arc::clone(&self.operator),
            equations: unknowns.count,
            unknowns,
            linear,
            boundary,
            carries_damage: self.carries_damage.clone(),
            damaged: self.damaged.clone(),
            damage_rule: self.damage_rule,
            bands: self.bands.clone(),
            interfaces: Arc::clone(&self.interfaces),
        })
    }

    /// Reference positions of the nodes on this rank, mm.
    pub(crate) fn nodes(&self) -> &[[f64; 3]] {
        self.operator.domain().nodes()
    }
}

/// Returns the rank of each element.
fn rank_of_tets<const N: usize>(space: &Space<N>, ranks: usize) -> Vec<u32> {
    let centre = |tet: &[u32; N]| -> [f64; 3] {
        let corners = || tet[..4].iter().map(|&n| space.nodes[n as usize]);
        std::array::from_fn(|k| 0.25 * corners().map(|x| x[k]).sum::<f64>())
    };
    let centres: Vec<[f64; 3]> = space.tets.iter().map(centre).collect();
    bisect(&centres, ranks)
}

/// Returns the terms that viscoelastic and plastic laws, and strengths, of the materials add to the tangent.
fn extra_terms(definition: &Definition) -> ExtraTerms {
    let field = definition.phase_field.as_ref();
    let point_materials: Vec<_> = definition.materials.iter().map(|m| m.at_point(field)).collect();
    let unsymmetric = point_materials.iter().any(|point| !point.has_symmetric_tangent());
    ExtraTerms {
        stored: unsymmetric || point_materials.iter().any(|point| point.inelastic.is_some()),
        unsymmetric,
    }
}

fn rule_of(definition: &Definition) -> Result<DamageRule, FemError> {
    match &definition.phase_field {
        Some(field) if definition.damaged().contains(&true) => {
            selected_rule(field, definition.order, &definition.mesh)
        }
        _ => Ok(DamageRule::Absent),
    }
}

fn boundary(
    domain: &dyn Domain,
    definition: &Definition,
    damaged: Vec<bool>,
) -> Result<Boundary, FemError> {
    Boundary::new(
        domain,
        &definition.mesh,
        &definition.conditions,
        damaged,
        definition.schedule.duration_s,
    )
}

fn selected_rule(field: &PhaseField, order: Order, mesh: &TetMesh) -> Result<DamageRule, FemError> {
    // the integral ∫ N_a dV of the shape function of a vertex is negative in a quadratic element, so that with AT1 (α =
    // φ) damage at the vertex would decrease the energy
    let lumped = order == Order::Quadratic && field.model == CrackDensity::At1;
    let gauss = matches!(field.quadrature, DamageQuadrature::Consistent | DamageQuadrature::Eleven);
    if lumped && gauss {
        return Err(FemError::unsupported("phase_field", Unsupported::At1AtGaussPoints));
    }
    Ok(match field.quadrature {
        DamageQuadrature::Vertex => DamageRule::Vertex,
        DamageQuadrature::Consistent => DamageRule::Consistent,
        DamageQuadrature::Eleven => DamageRule::Eleven,
        DamageQuadrature::Auto => {
            let between_nodes = order.node_spacing() * mesh.mean_edge();
            if lumped || field.length_mm < 2.0 * between_nodes {
                DamageRule::Vertex
            } else {
                DamageRule::Consistent
            }
        }
    })
}
