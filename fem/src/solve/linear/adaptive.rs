//! Multigrid that is replaced by a sparse factor if multigrid converges slowly.
//!
//! If a linear solve with multigrid takes hundreds of iterations or does not converge, load steps are reduced. The
//! criterion for the replacement is the number of iterations, which does not depend on the cause of the slow
//! convergence.

use std::sync::Arc;

use super::direct::{Direct, Symbolic};
use super::in_memory::Nodal;
use super::iterative::Iterative;
use super::{LinearEffort, LinearSolver, Singular};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, Operator, Pattern};

/// Acceptable number of iterations that reduce the residual to a tenth (by one decimal digit). Most meshes need 2 to
/// 10; systems that are indefinite because of a crack need up to 30.
const USUAL: f64 = 30.0;
/// If [`Convergence::excess`] exceeds this number, the factor replaces multigrid.
const PATIENCE: f64 = 300.0;

/// Convergence history of multigrid.
#[derive(Debug, Default)]
struct Convergence {
    /// Sum over all solves of the number of iterations minus the acceptable number of iterations. A negative sum is set
    /// to 0.
    excess: f64,
    /// Iterations of the most recent solution.
    last: u32,
}

impl Convergence {
    fn record(&mut self, effort: LinearEffort, tolerance: f64) {
        let digits = (-tolerance.log10()).max(1.0);
        let more = f64::from(effort.iterations) - USUAL * digits;
        self.excess = (self.excess + more).max(0.0);
        self.last = effort.iterations;
        if effort.residual > tolerance {
            self.excess = f64::INFINITY;
        }
    }

    fn is_bad(&self) -> bool {
        self.excess > PATIENCE
    }
}

enum Method<'a> {
    Multigrid(Box<Iterative<'a>>),
    Factor(Box<Direct<'a>>),
}

/// Linear solver that uses multigrid until multigrid converges slowly, and a sparse factor for all later tangents.
pub(super) struct Adaptive<'a> {
    method: Method<'a>,
    convergence: Convergence,
    operator: &'a dyn Operator,
    pattern: Arc<Pattern>,
    symbolic: Arc<Symbolic>,
}

impl<'a> Adaptive<'a> {
    /// Creates the solver; `symbolic` is the structure of the sparse factor that may replace `multigrid`.
    pub(super) fn new(
        multigrid: Iterative<'a>,
        operator: &'a dyn Operator,
        pattern: Arc<Pattern>,
        symbolic: Arc<Symbolic>,
    ) -> Self {
        let (method, convergence) =
            (Method::Multigrid(Box::new(multigrid)), Convergence::default());
        Self { method, convergence, operator, pattern, symbolic }
    }

    fn current(&mut self) -> &mut dyn LinearSolver {
        match &mut self.method {
            Method::Multigrid(multigrid) => multigrid.as_mut(),
            Method::Factor(factor) => factor.as_mut(),
        }
    }
}

impl LinearSolver for Adaptive<'_> {
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        if matches!(self.method, Method::Multigrid(_)) && self.convergence.is_bad() {
            let (pattern, symbolic) = (Arc::clone(&self.pattern), Arc::clone(&self.symbolic));
            let factor = Direct::new(self.operator, pattern, symbolic);
            self.method = Method::Factor(Box::new(factor));
        }
        self.current().linearise(increment, coupling, free)
    }

    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular> {
        let solved = self.current().solve(right, step, tolerance);
        if matches!(self.method, Method::Multigrid(_)) {
            let effort = match &solved {
                Ok(effort) => *effort,
                Err(Singular(effort)) => LinearEffort { residual: f64::INFINITY, ..*effort },
            };
            self.convergence.record(effort, tolerance);
        }
        solved
    }

    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32 {
        self.current().precondition(right, out)
    }

    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.current().multiply(x, y);
    }

    fn weight(&self) -> &[Nodal] {
        match &self.method {
            Method::Multigrid(multigrid) => multigrid.weight(),
            Method::Factor(factor) => factor.weight(),
        }
    }

    fn gave_way_after(&self) -> Option<u32> {
        self.convergence.is_bad().then_some(self.convergence.last)
    }

    fn give_way(&mut self, iterations: u32) {
        self.convergence = Convergence { excess: f64::INFINITY, last: iterations };
    }

    fn machine(&self) -> String {
        match &self.method {
            Method::Multigrid(multigrid) => multigrid.machine(),
            Method::Factor(_) => format!(
                "the processor, by a sparse factor because multigrid converged slowly ({} iterations in one \
                 linear solve)",
                self.convergence.last
            ),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn after(solutions: &[(u32, f64)], tolerance: f64) -> bool {
        let mut convergence = Convergence::default();
        for &(iterations, residual) in solutions {
            convergence.record(LinearEffort { iterations, renewals: 0, residual }, tolerance);
        }
        convergence.is_bad()
    }

    #[test]
    fn iterations_above_the_acceptable_number_replace_multigrid() {
        // 60 iterations are acceptable for a residual of 1e-2, which is two decimal digits
        assert!(!after(&[(60, 1e-3); 1000], 1e-2));
        assert!(!after(&[(160, 1e-3), (10, 1e-3), (10, 1e-3)].repeat(100), 1e-2));
        assert!(!after(&[(160, 1e-3); 3], 1e-2));
        assert!(after(&[(160, 1e-3); 4], 1e-2));
        // 120 iterations are acceptable for a residual of 1e-4, which is four decimal digits
        assert!(!after(&[(120, 1e-5); 1000], 1e-4));
        // a solve that does not reach its tolerance replaces multigrid at once
        assert!(after(&[(300, 0.05)], 1e-2));
        assert!(after(&[(10, f64::INFINITY)], 1e-2));
    }
}
