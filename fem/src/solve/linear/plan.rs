//! The choice of a linear solver, and what all runs on a mesh share of it.

use std::sync::Arc;

use super::LinearSolver;
use super::direct::{Direct, Symbolic};
use super::ordering::nested_dissection;
use crate::error::FemError;
use crate::operator::{Graph, Operator, Pattern, Unknowns};

/// The linear solver of a discretisation: its structure, found once.
#[derive(Debug)]
pub(crate) struct LinearPlan {
    pattern: Arc<Pattern>,
    symbolic: Arc<Symbolic>,
}

impl LinearPlan {
    /// Prepares the solver of a mesh; `damaged` marks the nodes that carry damage and `held` are
    /// the prescribed displacements.
    pub(crate) fn new<const N: usize>(
        tets: &[[u32; N]],
        points: &[[f64; 3]],
        damaged: &[bool],
        held: impl Iterator<Item = (u32, usize)>,
    ) -> Result<(Self, Unknowns), FemError> {
        let pattern = Arc::new(Pattern::new(tets, points.len()));
        let graph: &Graph = &pattern.graph;
        let order = nested_dissection(graph, points)?;
        let unknowns = Unknowns::new(&order, damaged, held);
        let symbolic = Arc::new(Symbolic::new(graph, &unknowns)?);
        Ok((Self { pattern, symbolic }, unknowns))
    }

    /// Entries of the factor; zero for an iterative solver.
    pub(crate) fn fill(&self) -> usize {
        self.symbolic.fill()
    }

    /// A solver of its own for a run.
    pub(crate) fn solver<'a>(&self, operator: &'a dyn Operator) -> Box<dyn LinearSolver + 'a> {
        Box::new(Direct::new(operator, Arc::clone(&self.pattern), Arc::clone(&self.symbolic)))
    }
}
