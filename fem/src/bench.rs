//! The parts of a Newton iteration, one call each, for the bench of the engine: behind the feature
//! `bench-internals`.

use std::sync::Arc;

use crate::element::{DamageRule, Quadratic, Space};
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Coupling, Increment, Layout, NONE, Product, Residual, StepContext, product};
use crate::parallel::{Part, Ranks, bisect};
use crate::problem::Problem;
use crate::solve::{LinearSolver, Nodal};
use fem_mesh::TetMesh;

/// What one of several ranks would have of a mesh of quadratic elements, and send.
#[derive(Clone, Copy, Debug, Default)]
pub struct PartSize {
    /// Its elements.
    pub elements: usize,
    /// Nodes that belong to it, of all and of the vertices.
    pub nodes: [usize; 2],
    /// Nodes of others that it has too, of all and of the vertices.
    pub ghosts: [usize; 2],
    /// Ranks that it exchanges values with.
    pub neighbours: usize,
}

/// The parts of a mesh for so many ranks.
pub fn parts(mesh: &TetMesh, count: usize) -> Vec<PartSize> {
    let space = Space::new::<Quadratic>(mesh, DamageRule::Absent);
    let centre = |tet: &[u32; 4]| -> [f64; 3] {
        std::array::from_fn(|k| tet.iter().map(|&n| 0.25 * mesh.nodes[n as usize][k]).sum())
    };
    let of = bisect(&mesh.tets.iter().map(centre).collect::<Vec<_>>(), count);
    let size = |ranks: &Ranks| {
        let nodes = [space.nodes.len(), mesh.nodes.len()];
        let part = Part::new(ranks, &of, |tet| &space.tets[tet], nodes);
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

/// A problem at a small compression, sheared from place to place so that no axis is a principal one.
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
    /// Nothing is evaluated yet.
    pub fn new(problem: &'a Problem) -> Self {
        let nodes = problem.nodes();
        let mut fields = Fields::zero(nodes.len());
        for (u, &[x, y, z]) in fields.displacement.iter_mut().zip(nodes) {
            *u = [1e-3 * x + 2e-4 * y * z, 1e-3 * y, -4e-3 * z + 3e-4 * x * z];
        }
        let operator = problem.discretisation.operator.as_ref();
        let domain = operator.domain();
        Self {
            problem,
            fields,
            residual: Residual::new(nodes.len()),
            linear: problem.discretisation.linear.solver(operator),
            step: vec![[0.0; 4]; nodes.len()],
            product: product(Arc::new(Layout::new(domain)), domain.tets()),
        }
    }

    /// Residual and energies.
    ///
    /// # Errors
    /// [`StepFailure::Inverted`] if an element is turned inside out, here and below.
    pub fn residual(&mut self) -> Result<(), StepFailure> {
        let increment = increment(self.problem, &self.fields);
        let operator = &self.problem.discretisation.operator;
        Ok(operator.residual(&increment, &mut self.residual)?)
    }

    /// Takes over the tangent: assembled, or its point data for quadratic elements with multigrid.
    pub fn linearise(&mut self) -> Result<(), StepFailure> {
        let equations = &self.problem.discretisation.unknowns.equation;
        let free: Vec<_> = equations.iter().map(|e| e.map(|e| e != NONE)).collect();
        let increment = increment(self.problem, &self.fields);
        Ok(self.linear.linearise(&increment, Coupling::Full, &free)?)
    }

    /// Solves to a residual of 1e-3, the first time with a new factor or hierarchy.
    ///
    /// # Errors
    /// [`StepFailure::Singular`].
    pub fn solve(&mut self) -> Result<(), StepFailure> {
        let solved = self.linear.solve(&self.residual.nodal, &mut self.step, 1e-3);
        solved.map(drop).map_err(|_| StepFailure::Singular)
    }

    /// Stores the point data of the matrix-free tangent.
    pub fn store(&mut self) -> Result<(), StepFailure> {
        let increment = increment(self.problem, &self.fields);
        let operator = self.problem.discretisation.operator.as_ref();
        Ok(self.product.linearise(operator, &increment, Coupling::Full)?)
    }

    /// A product of the matrix-free tangent.
    pub fn apply(&mut self) {
        self.product.apply(&self.residual.nodal, &mut self.step);
    }

    /// Bytes of point data, which a product reads once.
    pub fn bytes(&self) -> usize {
        self.product.bytes()
    }
}

fn increment<'a>(problem: &'a Problem, fields: &'a Fields) -> Increment<'a> {
    let context = StepContext::new(&fields.damage, 0.01);
    Increment { materials: &problem.points, fields, context }
}
