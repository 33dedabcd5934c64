//! Choice of the linear solver by the number of unknowns, and the solver data that all runs on a mesh share.

use std::sync::Arc;

use super::LinearSolver;
use super::adaptive::Adaptive;
use super::direct::{Direct, Symbolic, nested_dissection};
use super::iterative::Iterative;
use super::multigrid::ElementTangent;
use super::on_device::OnDevice;
use crate::device::ComputeDevice;
use crate::element::{Quadratic, Tetrahedron};
use crate::error::FemError;
use crate::operator::{
    Layout, Operator, Pattern, Product, Tangent, Unknowns, device_product, product,
};
use crate::solve::LinearScheme;

/// Largest number of unknowns for which a sparse factor is used. For more unknowns, the factor needs too much memory.
const DIRECT_UP_TO: usize = 70_000;
/// Largest number of unknowns for which a sparse factor is used in a problem without damage. This limit is lower than
/// [`DIRECT_UP_TO`] because multigrid converges fast for the positive definite tangent of such a problem. The limit
/// is not zero, because a single factor is sufficient for a whole run.
const DIRECT_ELASTIC_UP_TO: usize = 30_000;
/// Largest number of factor entries per unknown for which a run with damage is faster with a factor than with multigrid
/// on one thread. This number was measured on cylinders with grains, where 350 factor entries per unknown correspond to
/// 5 000 unknowns. The factor of a plate has fewer entries per unknown than the factor of a cylinder.
const FILL: usize = 350;

/// Selected linear solver of a discretisation, with the data that all runs share.
#[derive(Clone, Debug)]
pub(crate) enum LinearPlan {
    /// Sparse factor.
    Direct(FactorPlan),
    /// Multigrid; `pattern` is the sparsity pattern of the linear shape functions.
    Multigrid {
        pattern: Arc<Pattern>,
        vertices: Arc<Vec<[f64; 3]>>,
        /// The two vertices of the edge of each midpoint node; empty for linear elements.
        parents: Arc<Vec<[u32; 2]>>,
        /// Device that runs the iterations; `None` if the processor runs them.
        device: Option<ComputeDevice>,
        /// Factor that replaces multigrid if multigrid converges slowly; `None` if the factor would not fit into memory.
        factor: Option<FactorPlan>,
    },
}

/// Structure of a sparse factor, with the order of elimination.
#[derive(Clone, Debug)]
pub(crate) struct FactorPlan {
    pattern: Arc<Pattern>,
    /// Nodes in the order of elimination.
    order: Arc<Vec<u32>>,
    symbolic: Arc<Symbolic>,
}

impl FactorPlan {
    /// Returns the structure for another set of constrained displacements, and the numbering of the unknowns.
    fn with_constrained(
        &self,
        damaged: &[bool],
        constrained: impl Iterator<Item = (u32, usize)>,
    ) -> Result<(Self, Unknowns), FemError> {
        let unknowns = Unknowns::new(&self.order, damaged, constrained);
        let symbolic = Arc::new(Symbolic::new(&self.pattern.graph, &unknowns)?);
        Ok((Self { symbolic, ..self.clone() }, unknowns))
    }
}

impl LinearPlan {
    /// Selects and prepares the solver of a mesh; returns it with the numbering of the unknowns. `damaged` marks the
    /// nodes with damage; `constrained` lists the prescribed displacements as (node, component).
    pub(crate) fn new<const N: usize>(
        tets: &[[u32; N]],
        positions: &[[f64; 3]],
        damaged: &[bool],
        constrained: impl Iterator<Item = (u32, usize)>,
        choice: LinearScheme,
        device: Option<&ComputeDevice>,
    ) -> Result<(Self, Unknowns), FemError> {
        let damage = damaged.iter().filter(|d| **d).count();
        let size = 3 * positions.len() + damage;
        let multigrid = match choice {
            LinearScheme::Auto if damage == 0 => size > DIRECT_ELASTIC_UP_TO,
            LinearScheme::Auto => size > DIRECT_UP_TO,
            LinearScheme::Direct => false,
            LinearScheme::Multigrid => true,
        };
        let by_fill = choice == LinearScheme::Auto && damage > 0;
        let constrained: Vec<_> = constrained.collect();
        let mut fallback = None;
        if !multigrid {
            let pattern = Arc::new(Pattern::new(tets, positions.len()));
            let order = Arc::new(nested_dissection(&pattern.graph, positions)?);
            let unknowns = Unknowns::new(&order, damaged, constrained.iter().copied());
            let symbolic = Arc::new(Symbolic::new(&pattern.graph, &unknowns)?);
            let is_sparse = symbolic.fill() <= FILL * unknowns.count;
            let factor = FactorPlan { pattern, order, symbolic };
            if !by_fill || is_sparse {
                return Ok((Self::Direct(factor), unknowns));
            }
            fallback = Some(factor);
        }
        let unknowns = unknowns_in_node_order(damaged, constrained.into_iter());
        let mut plan = Self::multigrid(tets, positions);
        if let Self::Multigrid { device: selected, factor, .. } = &mut plan {
            (*selected, *factor) = (device.cloned(), fallback);
        }
        Ok((plan, unknowns))
    }

    /// Returns the plan for another set of constrained displacements, and the numbering of the unknowns.
    pub(crate) fn with_constrained(
        &self,
        damaged: &[bool],
        constrained: impl Iterator<Item = (u32, usize)>,
    ) -> Result<(Self, Unknowns), FemError> {
        match self {
            Self::Direct(factor) => {
                let (factor, unknowns) = factor.with_constrained(damaged, constrained)?;
                Ok((Self::Direct(factor), unknowns))
            }
            Self::Multigrid { .. } => {
                let constrained: Vec<_> = constrained.collect();
                let mut plan = self.clone();
                if let Self::Multigrid { factor: Some(factor), .. } = &mut plan {
                    *factor = factor.with_constrained(damaged, constrained.iter().copied())?.0;
                }
                Ok((plan, unknowns_in_node_order(damaged, constrained.into_iter())))
            }
        }
    }

    /// Prepares multigrid for any mesh, even if a sparse factor would be selected for this mesh.
    pub(super) fn multigrid<const N: usize>(tets: &[[u32; N]], positions: &[[f64; 3]]) -> Self {
        let corners: Vec<[u32; 4]> = tets.iter().map(|t| std::array::from_fn(|a| t[a])).collect();
        let vertices = corners.iter().flatten().max().map_or(0, |&n| n as usize + 1);
        let mut parents = vec![[0; 2]; positions.len() - vertices];
        for tet in tets.iter().filter(|_| N == 10) {
            for (edge, ends) in Quadratic::EDGES.iter().enumerate() {
                parents[tet[4 + edge] as usize - vertices] = ends.map(|v| tet[v]);
            }
        }
        let vertices = Arc::new(positions[..vertices].to_vec());
        let pattern = Arc::new(Pattern::new(&corners, vertices.len()));
        Self::Multigrid {
            pattern,
            vertices,
            parents: Arc::new(parents),
            device: None,
            factor: None,
        }
    }

    /// Whether systems are solved on a device.
    pub(crate) fn is_on_device(&self) -> bool {
        matches!(self, Self::Multigrid { device: Some(_), .. })
    }

    /// Returns the number of entries of the factor; zero for an iterative solver.
    pub(crate) fn fill(&self) -> usize {
        match self {
            Self::Direct(FactorPlan { symbolic, .. }) => symbolic.fill(),
            Self::Multigrid { .. } => 0,
        }
    }

    /// Creates a solver for one run.
    pub(crate) fn solver<'a>(&self, operator: &'a dyn Operator) -> Box<dyn LinearSolver + 'a> {
        match self {
            Self::Direct(FactorPlan { pattern, symbolic, .. }) => {
                Box::new(Direct::new(operator, Arc::clone(pattern), Arc::clone(symbolic)))
            }
            Self::Multigrid { pattern, vertices, parents, device, factor } => {
                let domain = operator.domain();
                let tangent = Tangent::new(Arc::clone(pattern));
                let solver = |product: Option<Box<dyn Product>>| {
                    let elements = product.map(|p| {
                        ElementTangent::new(p, Arc::clone(parents), Arc::clone(operator.part()))
                    });
                    Iterative::new(operator, Arc::clone(vertices), tangent, elements)
                };
                let here = || {
                    let layout = || Arc::new(Layout::new(domain));
                    (!parents.is_empty()).then(|| product(layout(), domain.tets()))
                };
                let Some(device) = device else {
                    let multigrid = solver(here());
                    let Some(FactorPlan { pattern, symbolic, .. }) = factor else {
                        return Box::new(multigrid);
                    };
                    let (pattern, symbolic) = (Arc::clone(pattern), Arc::clone(symbolic));
                    return Box::new(Adaptive::new(multigrid, operator, pattern, symbolic));
                };
                let layout = Arc::new(Layout::new(domain));
                match device_product(layout, domain.tets(), device) {
                    Ok(product) => {
                        let levels = OnDevice::new(device, vertices.len(), parents);
                        Box::new(solver(Some(product)).on_device(levels))
                    }
                    Err(error) => Box::new(solver(here()).on_device(Err(error))),
                }
            }
        }
    }
}

/// Numbers the unknowns in the order of the nodes.
fn unknowns_in_node_order(
    damaged: &[bool],
    constrained: impl Iterator<Item = (u32, usize)>,
) -> Unknowns {
    let order: Vec<u32> = (0..damaged.len() as u32).collect();
    Unknowns::new(&order, damaged, constrained)
}
