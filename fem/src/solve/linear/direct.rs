//! Sparse symmetric factorisation by faer, one thread, as preconditioner of a Krylov method.
//!
//! The factor is L D Lᵀ without pivoting in single precision, which is half the memory and half
//! the time; conjugate gradients on the tangent in double precision make up for both the rounding
//! and the age of the factor. GMRES takes over where the tangent is not positive definite. A fresh
//! factor that is not good enough is made again in double precision, and then with Bunch–Kaufman
//! pivoting inside the supernodes.

use std::sync::Arc;

use super::factor::{Factor, Symbolic, apply_factor, ldlt, solve_memory, with_pivots};
use super::krylov::{Stop, System, conjugate_gradients, gmres};
use super::vector::{Nodal, mask, weights};
use super::{LinearEffort, LinearSolver, Singular};
use crate::material::Inverted;
use crate::operator::{Coupling, Increment, Operator, Pattern, Tangent};

/// The methods of factorisation, the cheapest first.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Means {
    Single,
    Double,
    Pivoted,
}

/// Iterations after which an old factor is given up, and a fresh one judged not good enough.
const WORN: u32 = 12;
const POOR: u32 = 30;
/// Residual of a solution that is accepted although the tolerance was not reached.
const USELESS: f64 = 1e-3;

/// A tangent with a factor of it or of an earlier one.
pub(crate) struct Direct<'a> {
    operator: &'a dyn Operator,
    symbolic: Arc<Symbolic>,
    tangent: Tangent,
    free: Vec<[bool; 4]>,
    weight: Vec<Nodal>,
    coupling: Coupling,
    factor: Factor,
    means: Means,
    /// Whether the factor is that of the tangent.
    fresh: bool,
    /// Whether conjugate gradients have met no negative curvature of this tangent.
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
            means: Means::Single,
            fresh: false,
            definite: true,
        }
    }

    fn factorise(&mut self) {
        let symbolic = &self.symbolic;
        if self.means == Means::Single {
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x as f32);
            let kept = match std::mem::replace(&mut self.factor, Factor::Absent) {
                Factor::Single(values) => values,
                _ => Vec::new(),
            };
            match ldlt(symbolic, &entries, kept) {
                Some(values) => self.factor = Factor::Single(values),
                None => self.means = Means::Double,
            }
        }
        if self.means == Means::Double {
            self.factor = Factor::Absent;
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x);
            match ldlt(symbolic, &entries, Vec::new()) {
                Some(values) => self.factor = Factor::Double(values),
                None => self.means = Means::Pivoted,
            }
        }
        if self.means == Means::Pivoted {
            self.factor = Factor::Absent;
            let entries = symbolic.entries(&self.tangent, &self.free, |x| x);
            self.factor = with_pivots(symbolic, &entries);
        }
        self.fresh = true;
    }

    fn krylov(
        &mut self,
        right: &[Nodal],
        step: &mut [Nodal],
        tolerance: f64,
        limit: u32,
    ) -> (Stop, u32, f64) {
        let Self { symbolic, tangent, free, weight, factor, .. } = self;
        let mut apply = |x: &[Nodal], y: &mut [Nodal]| {
            tangent.multiply(x, y);
            mask(free, y);
        };
        let mut memory = solve_memory(symbolic, factor);
        // the factor may be that of a tangent with other values constrained
        let mut precondition = |x: &[Nodal], y: &mut [Nodal]| {
            apply_factor(symbolic, factor, &mut memory, x, y);
            mask(free, y);
        };
        let mut system = System { apply: &mut apply, precondition: &mut precondition, weight };
        let mut spent = 0;
        if self.definite && tangent.symmetric {
            let ending = conjugate_gradients(&mut system, right, step, tolerance, limit);
            if matches!(ending.stop, Stop::Converged | Stop::Limit) {
                return (ending.stop, ending.iterations, ending.residual);
            }
            self.definite = false;
            spent = ending.iterations;
        }
        let ending = gmres(&mut system, right, step, tolerance, limit);
        (ending.stop, spent + ending.iterations, ending.residual)
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
        if coupling != self.coupling {
            self.factor = Factor::Absent;
            self.coupling = coupling;
        }
        self.free.copy_from_slice(free);
        self.weight = weights(&self.tangent.diagonal(), free);
        self.fresh = false;
        self.definite = true;
        self.means = Means::Single;
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
        if !matches!(self.factor, Factor::Absent) {
            let limit = if self.fresh { POOR } else { WORN };
            let (stop, iterations, residual) = self.krylov(&masked, step, tolerance, limit);
            effort.iterations += iterations;
            effort.residual = residual;
            if stop == Stop::Converged {
                return Ok(effort);
            }
            if self.fresh {
                // a right-hand side may need more than the one before
                self.means = self.means.max(Means::Double);
            }
            self.definite = true;
        }
        loop {
            self.factorise();
            effort.renewals += 1;
            let (stop, iterations, residual) = self.krylov(&masked, step, tolerance, POOR);
            effort.iterations += iterations;
            effort.residual = residual;
            let accepted = self.means == Means::Pivoted && residual <= USELESS;
            if stop == Stop::Converged || accepted {
                return Ok(effort);
            }
            self.means = match self.means {
                Means::Single => Means::Double,
                Means::Double => Means::Pivoted,
                Means::Pivoted => return Err(Singular),
            };
            self.definite = true;
        }
    }
}
