//! Sparse symmetric factorisation by faer, on one thread, as preconditioner of a Krylov method.
//!
//! The factor is L D Lᵀ without pivoting in single precision, which needs half the memory and half the time of double
//! precision. Conjugate gradients on the tangent in double precision correct for rounding and for an outdated factor.
//! GMRES is used if the tangent is not positive definite. If a factor of the current tangent is not accurate enough, a
//! second factor is computed in double precision, with Bunch–Kaufman pivoting inside the supernodes.

mod cover;
mod factor;
mod ordering;

use std::sync::Arc;

use faer::dyn_stack::MemBuffer;

use self::factor::Factor;
pub(crate) use self::factor::Symbolic;
pub(crate) use self::ordering::nested_dissection;
use super::in_memory::{Nodal, NodalVectors, mask, weights};
use super::krylov::{Ending, Preconditioned, Stop, System, solve};
use super::{LinearEffort, LinearSolver, Singular};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, Operator, Pattern, Tangent};

/// If a solve with the factor of an earlier tangent needs more iterations, the factor is recomputed.
const WORN: u32 = 12;
/// If a solve with the factor of the current tangent needs more iterations, a factor with pivoting replaces the factor.
const POOR: u32 = 30;
/// Time of a factorisation, divided by the time of one iteration; measured for 3 000 to 20 000 unknowns.
const FACTOR_IN_ITERATIONS: f64 = 20.0;
/// Largest relative residual of a solution that is accepted although it has not reached the tolerance.
const USELESS: f64 = 1e-3;

/// Tangent, with the factor of this tangent or of an earlier tangent.
pub(crate) struct Direct<'a> {
    operator: &'a dyn Operator,
    symbolic: Arc<Symbolic>,
    tangent: Tangent,
    free: Vec<[bool; 4]>,
    weight: Vec<Nodal>,
    coupling: Coupling,
    factor: Factor,
    /// Whether the factor must be recomputed before it is used.
    worn: bool,
    /// Iterations that the first solve with the factor needed to reduce the residual to a tenth (by one decimal digit).
    at_first: f64,
    /// Number of iterations of all later solves with the factor, minus the number of iterations that these solves would
    /// need if each needed `at_first` iterations per decimal digit.
    excess: f64,
    /// Whether the factor belongs to the current tangent.
    fresh: bool,
    /// Whether the current tangent needs a factor with pivoting, because the factor without pivoting was not accurate
    /// enough.
    pivots: bool,
    /// Whether conjugate gradients can be used: no negative curvature has occurred with the current tangent.
    definite: bool,
}

impl<'a> Direct<'a> {
    pub(crate) fn new(
        operator: &'a dyn Operator,
        pattern: Arc<Pattern>,
        symbolic: Arc<Symbolic>,
    ) -> Self {
        let nodes = pattern.graph.nodes();
        Self {
            operator,
            symbolic,
            tangent: Tangent::new(pattern),
            free: vec![[true; 4]; nodes],
            weight: vec![[0.0; 4]; nodes],
            coupling: Coupling::Full,
            factor: Factor::Absent,
            worn: true,
            at_first: 0.0,
            excess: 0.0,
            fresh: false,
            pivots: false,
            definite: true,
        }
    }

    fn factorise(&mut self) {
        let Self { symbolic, tangent, free, .. } = self;
        let old = std::mem::replace(&mut self.factor, Factor::Absent);
        if !self.pivots {
            self.factor = old.single(symbolic, tangent, free);
            self.pivots = matches!(self.factor, Factor::Absent);
        }
        if self.pivots {
            self.factor = Factor::pivoted(symbolic, tangent, free);
        }
        (self.worn, self.fresh) = (false, true);
    }

    /// Counts the additional iterations that are caused by the age of the factor. Marks the factor as worn once these
    /// iterations have cost as much time as a new factor.
    fn age(&mut self, iterations: u32, tolerance: f64) {
        let (iterations, digits) = (f64::from(iterations), -tolerance.log10());
        if self.fresh {
            (self.at_first, self.excess) = (iterations / digits.max(1.0), 0.0);
        }
        self.excess += (iterations - self.at_first * digits).max(0.0);
        self.worn = self.excess >= FACTOR_IN_ITERATIONS;
    }

    fn krylov(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
        limit: u32,
    ) -> Ending {
        let Self { operator, symbolic, tangent, free, weight, factor, definite, .. } = self;
        let memory = factor.memory(symbolic, 1);
        let mut matrix = Factored { symbolic, tangent, free, factor, memory };
        let vectors = &NodalVectors::new(&operator.part().halo);
        let mut system = System { vectors, matrix: &mut matrix, weight };
        solve(&mut system, definite, right, step, tolerance, limit)
    }
}

/// Rows and columns of the tangent for the free (not constrained) values, with a factor as preconditioner.
struct Factored<'a> {
    symbolic: &'a Symbolic,
    tangent: &'a Tangent,
    free: &'a [[bool; 4]],
    factor: &'a Factor,
    memory: MemBuffer,
}

impl Preconditioned<NodalVectors> for Factored<'_> {
    fn apply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.tangent.multiply(x, y);
        mask(self.free, y);
    }

    fn precondition(&mut self, r: &[Nodal], z: &mut [Nodal]) {
        self.factor.apply(self.symbolic, &mut self.memory, &[r], &mut [&mut *z]);
        // the factor may belong to an earlier tangent with other constrained values
        mask(self.free, z);
    }
}

impl LinearSolver for Direct<'_> {
    fn linearise(
        &mut self,
        increment: &Increment,
        coupling: Coupling,
        free: &[[bool; 4]],
    ) -> Result<(), Inverted> {
        self.operator.tangent(increment, coupling, &mut self.tangent)?;
        self.worn |= coupling != self.coupling;
        self.coupling = coupling;
        self.free.copy_from_slice(free);
        self.weight = weights(&self.tangent.diagonal(), free, &self.operator.part().halo);
        self.fresh = false;
        self.pivots = false;
        self.definite = self.tangent.symmetric;
        Ok(())
    }

    fn solve(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
    ) -> Result<LinearEffort, Singular> {
        let mut masked = right.to_vec();
        mask(&self.free, &mut masked);
        let mut effort = LinearEffort::default();
        loop {
            if self.worn {
                self.factorise();
                effort.renewals += 1;
            }
            let limit = if self.fresh { POOR } else { WORN };
            let ending = self.krylov(&masked, step, tolerance, limit);
            effort.iterations += ending.iterations;
            effort.residual = ending.residual;
            if ending.stop == Stop::Converged {
                self.age(ending.iterations, tolerance);
                return Ok(effort);
            }
            if self.fresh {
                if self.pivots {
                    let accepted = ending.residual <= USELESS;
                    return if accepted { Ok(effort) } else { Err(Singular(effort)) };
                }
                self.pivots = true;
            }
            self.worn = true;
            // allow conjugate gradients again: the old factor may have caused the negative curvature
            self.definite = self.tangent.symmetric;
        }
    }

    fn precondition(&mut self, right: &[&[Nodal]], out: &mut [&mut [Nodal]]) -> u32 {
        let renewals = u32::from(self.worn);
        if self.worn {
            self.factorise();
        }
        let Self { symbolic, free, factor, .. } = self;
        let mut memory = factor.memory(symbolic, right.len());
        factor.apply(symbolic, &mut memory, right, out);
        out.iter_mut().for_each(|out| mask(free, out));
        renewals
    }

    fn multiply(&mut self, x: &[Nodal], y: &mut [Nodal]) {
        self.tangent.multiply(x, y);
    }

    fn weight(&self) -> &[Nodal] {
        &self.weight
    }
}
