//! Parts of a Newton iteration as separate functions, for benchmarks. Available with the feature `bench-internals`.

use std::sync::Arc;

use crate::element::{DamageRule, Quadratic, Space};
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Coupling, Increment, Layout, NONE, Product, Residual, StepContext, product};
use crate::parallel::{Part, Ranks, bisect};
use crate::problem::Problem;
use crate::solve::{LinearSolver, Nodal};
use fem_mesh::TetMesh;

/// Numbers of elements, nodes and neighbours of one rank, for a partitioned mesh of quadratic
/// elements.
#[derive(Clone, Copy, Debug, Default)]
pub struct PartSize {
    /// Number of elements of the part.
    pub elements: usize,
    /// Number of nodes that the rank owns, then the number of vertices among these nodes.
    pub nodes: [usize; 2],
    /// Number of ghost nodes, which other ranks own, then the number of vertices among these nodes.
    pub ghosts: [usize; 2],
    /// Number of ranks with which the rank exchanges values.
    pub neighbours: usize,
}

/// Partitions a mesh into `count` parts and returns their sizes.
pub fn parts(mesh: &TetMesh, count: usize) -> Vec<PartSize> {
    let space = Space::new::<Quadratic>(mesh, DamageRule::Absent);
    let centre = |tet: &[u32; 4]| -> [f64; 3] {
        std::array::from_fn(|k| tet.iter().map(|&n| 0.25 * mesh.nodes[n as usize][k]).sum())
    };
    let rank_of_tet = bisect(&mesh.tets.iter().map(centre).collect::<Vec<_>>(), count);
    let size = |ranks: &Ranks| {
        let nodes = [space.nodes.len(), mesh.nodes.len()];
        let part = Part::new(ranks, &rank_of_tet, |tet| &space.tets[tet], nodes);
        let ghosts = [&part.halo, &part.vertices]
            .map(|halo| halo.neighbours().iter().map(|n| n.ghosts.len()).sum::<usize>());
        let vertices = part.nodes.iter().filter(|n| (**n as usize) < mesh.nodes.len()).count();
        PartSize {
            elements: part.tets.len(),
            nodes: [part.nodes.len() - ghosts[0], vertices - ghosts[1]],
            ghosts,
            neighbours: part.halo.neighbours().len(),
        }
    };
    Ranks::threads(count).iter().map(size).collect()
}

/// Newton solver with an assumed displacement field: a small, non-uniform compression and shear, whose principal
/// axes differ from the coordinate axes.
pub struct NewtonParts<'a> {
    problem: &'a Problem,
    fields: Fields,
    residual: Residual,
    linear: Box<dyn LinearSolver + 'a>,
    step: Vec<Nodal>,
    product: Box<dyn Product>,
}

impl std::fmt::Debug for NewtonParts<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("NewtonParts").field("problem", self.problem).finish_non_exhaustive()
    }
}

impl<'a> NewtonParts<'a> {
    /// Creates the displacement field and the solver; no equation is evaluated yet.
    pub fn new(problem: &'a Problem) -> Self {
        let nodes = problem.nodes();
        let mut fields = Fields::zero(nodes.len());
        for (u, &[x, y, z]) in fields.displacement.iter_mut().zip(nodes) {
            *u = [1e-3 * x + 2e-4 * y * z, 1e-3 * y, -4e-3 * z + 3e-4 * x * z];
        }
        let operator = problem.setup.discretisation.operator.as_ref();
        let domain = operator.domain();
        Self {
            problem,
            fields,
            residual: Residual::new(nodes.len()),
            linear: problem.setup.discretisation.linear.solver(operator),
            step: vec![[0.0; 4]; nodes.len()],
            product: product(Arc::new(Layout::new(domain)), domain.tets()),
        }
    }

    /// Computes the residual and the energies at the fields.
    ///
    /// # Errors
    /// [`StepFailure::Inverted`] if an element is inverted.
    pub fn residual(&mut self) -> Result<(), StepFailure> {
        let increment = increment(self.problem, &self.fields);
        let operator = &self.problem.setup.discretisation.operator;
        Ok(operator.residual(&increment, &mut self.residual)?)
    }

    /// Linearises the equations: assembles the tangent or, for quadratic elements with multigrid, computes the data at
    /// quadrature points (*point data*) of the matrix-free tangent.
    ///
    /// # Errors
    /// [`StepFailure::Inverted`] if an element is inverted.
    pub fn linearise(&mut self) -> Result<(), StepFailure> {
        let equations = &self.problem.setup.discretisation.unknowns.equation;
        let free: Vec<_> = equations.iter().map(|e| e.map(|e| e != NONE)).collect();
        let increment = increment(self.problem, &self.fields);
        Ok(self.linear.linearise(&increment, Coupling::Full, &free)?)
    }

    /// Solves the linear system to a relative residual of 1e-3. The first call also factorises the matrix or
    /// builds the multigrid hierarchy.
    ///
    /// # Errors
    /// [`StepFailure::Singular`] if the system has no solution.
    pub fn solve(&mut self) -> Result<(), StepFailure> {
        let solved = self.linear.solve(&self.residual.nodal, &mut self.step, 1e-3);
        solved.map(drop).map_err(|_| StepFailure::Singular)
    }

    /// Computes and stores the data at quadrature points (*point data*) of the matrix-free tangent.
    ///
    /// # Errors
    /// [`StepFailure::Inverted`] if an element is inverted.
    pub fn store(&mut self) -> Result<(), StepFailure> {
        let increment = increment(self.problem, &self.fields);
        let operator = self.problem.setup.discretisation.operator.as_ref();
        Ok(self.product.linearise(operator, &increment, Coupling::Full)?)
    }

    /// Computes a product with the matrix-free tangent.
    pub fn apply(&mut self) {
        let applied = self.product.apply(&self.residual.nodal, &mut self.step);
        applied.expect("the processor has the tangent");
    }

    /// Returns the number of bytes of the point data. A product with the tangent reads each byte once.
    pub fn bytes(&self) -> usize {
        self.product.bytes()
    }
}

fn increment<'a>(problem: &'a Problem, fields: &'a Fields) -> Increment<'a> {
    let context = StepContext::new(&fields.damage, 0.01);
    Increment { materials: &problem.setup.point_materials, fields, context }
}
