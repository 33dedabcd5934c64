//! The rates of an equilibrium with parameters.
//!
//! R(x, x_n, θ) = 0 holds for every θ, so that K dx/dθ = −(∂R/∂θ + ∂R/∂x_n dx_n/dθ) with the tangent K
//! at the equilibrium: one more linear system for a parameter. Prescribed values do not move, and a
//! value that a bound holds moves with its bound: the set of such values is the same for all θ near
//! by, but where one of them is about to leave it.
//!
//! A node in contact keeps its gap closed, by the rate of its pressure. That is found as the pressure is,
//! by passes: with it fixed the tangent's penalty lets the gap open a little, and the pressure follows.
//!
//! The systems of one equilibrium have one matrix, and their solutions change little from step to
//! step. Each starts from the combination of the rates at the equilibria before and of the corrections
//! found so far that leaves the least residual, as in generalised conjugate residuals.

use std::iter;

use super::external::External;
use super::linear::{Nodal, add_scaled, mask, weighted_dot};
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Increment, Shift, StepContext};

/// Residual of a solution, relative to that without a change of the free values.
const TOLERANCE: f64 = 1e-7;
/// Most corrections of a solution, and passes over the pressures.
const CORRECTIONS: usize = 4;
const PASSES: usize = 60;
/// A direction that lies in those before it up to this is none of its own.
const DEPENDENT: f64 = 1e-6;

/// The rates with one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Rates {
    /// Of u_x, u_y, u_z, φ at every node.
    pub(crate) values: Vec<Nodal>,
    /// Of the residual: what supports and bounds have to exert more.
    pub(crate) residual: Vec<Nodal>,
    /// Of the forces of contact.
    pub(crate) contact: Vec<(u32, [f64; 3])>,
}

/// What is known of a parameter before its system is solved.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    /// The parameter, with the rates where the increment began.
    pub(crate) shift: Shift<'a>,
    /// The rates of earlier equilibria, each of which is a direction to start with.
    pub(crate) earlier: &'a [Vec<Nodal>],
}

/// Directions whose products with the tangent are orthonormal.
#[derive(Default)]
struct Directions(Vec<[Vec<Nodal>; 2]>);

impl Directions {
    /// Takes up a direction with its product, unless it is one of these.
    fn add(&mut self, mut direction: Vec<Nodal>, mut product: Vec<Nodal>, weight: &[Nodal]) {
        let norm = |product: &[Nodal]| weighted_dot(weight, product, product).sqrt();
        let whole = norm(&product);
        for [v, p] in &self.0 {
            let along = weighted_dot(weight, p, &product);
            add_scaled(&mut direction, -along, v);
            add_scaled(&mut product, -along, p);
        }
        let own = norm(&product);
        if own > DEPENDENT * whole && own.is_finite() {
            let scale =
                |x: &mut Vec<Nodal>| x.as_flattened_mut().iter_mut().for_each(|x| *x /= own);
            scale(&mut direction);
            scale(&mut product);
            self.0.push([direction, product]);
        }
    }

    /// Moves x so that its residual is least.
    fn reduce(&self, x: &mut [Nodal], residual: &mut [Nodal], weight: &[Nodal]) {
        for [v, p] in &self.0 {
            let along = weighted_dot(weight, p, residual);
            add_scaled(x, along, v);
            add_scaled(residual, -along, p);
        }
    }
}

fn negate(x: &mut [Nodal]) {
    x.as_flattened_mut().iter_mut().for_each(|x| *x = -*x);
}

impl<E: External> Solver<'_, E> {
    /// The rates of the equilibrium `fields`, the last that was found, with every parameter;
    /// `follows` says that the lower bounds are what the increment began with.
    ///
    /// The tangent there is kept for the next increment.
    pub(crate) fn differentiate(
        &mut self,
        fields: &Fields,
        context: StepContext,
        known: &[Known],
        follows: bool,
    ) -> Result<Vec<Rates>, StepFailure> {
        self.linearise_at(fields, context)?;
        let shifts: Vec<Shift> = known.iter().map(|known| known.shift).collect();
        let mut residuals = vec![vec![[0.0; 4]; fields.damage.len()]; shifts.len()];
        let increment = Increment { materials: self.materials, fields, context };
        self.operator.rates(&increment, &shifts, &mut residuals)?;
        let mut directions = Directions::default();
        let mut all = Vec::with_capacity(known.len());
        for (known, mut right) in known.iter().zip(residuals) {
            negate(&mut right);
            let held = self.held(fields, context, follows, known.shift.before);
            all.push(self.solve_rates(held, right, fields, known, &mut directions)?);
        }
        Ok(all)
    }

    /// The rates of the values that a bound holds, zero in the others.
    fn held(
        &self,
        fields: &Fields,
        context: StepContext,
        follows: bool,
        before: &[Nodal],
    ) -> Vec<Nodal> {
        let mut held = vec![[0.0; 4]; before.len()];
        let Some(bounds) = context.bounds.filter(|_| follows) else { return held };
        for (n, held) in held.iter_mut().enumerate() {
            let constrained = self.unknown[n][3] && !self.free[n][3];
            if constrained && fields.damage[n] <= bounds.lower[n][3] {
                held[3] = before[n][3];
            }
        }
        held
    }

    /// The rates with one parameter, with the constrained values as they are in `x`; `residual` is the
    /// right-hand side without them.
    fn solve_rates(
        &mut self,
        mut x: Vec<Nodal>,
        mut residual: Vec<Nodal>,
        fields: &Fields,
        known: &Known,
        directions: &mut Directions,
    ) -> Result<Rates, StepFailure> {
        let mut product = vec![[0.0; 4]; x.len()];
        if x.iter().any(|x| x[3] != 0.0) {
            self.linear.multiply(&x, &mut product);
            add_scaled(&mut residual, -1.0, &product);
        }
        let weight = self.linear.weight().to_vec();
        let norm = |r: &[Nodal]| weighted_dot(&weight, r, r).sqrt();
        let size = norm(&residual);
        let mut contact: Vec<(u32, [f64; 3])> = Vec::new();
        if size == 0.0 {
            negate(&mut residual);
            return Ok(Rates { values: x, residual, contact });
        }
        let earlier = known.earlier.iter().map(Vec::as_slice);
        for guess in iter::once(known.shift.before).chain(earlier) {
            if guess.iter().any(|g| *g != [0.0; 4]) {
                let mut direction = guess.to_vec();
                mask(&self.free, &mut direction);
                self.linear.multiply(&direction, &mut product);
                directions.add(direction, product.clone(), &weight);
            }
        }
        for _ in 0..PASSES {
            self.correct(&mut x, &mut residual, size, directions)?;
            let lacking = self.external.follow(fields, &x);
            if contact.is_empty() {
                contact = lacking.iter().map(|(node, _)| (*node, [0.0; 3])).collect();
            }
            for ((node, force), (_, sum)) in lacking.iter().zip(&mut contact) {
                for k in 0..3 {
                    sum[k] += force[k];
                    residual[*node as usize][k] += force[k];
                }
            }
            if norm(&residual) <= TOLERANCE * size {
                self.turn(fields, &x, &mut contact);
                negate(&mut residual);
                return Ok(Rates { values: x, residual, contact });
            }
        }
        Err(StepFailure::Contact)
    }

    /// Corrects the rates until the residual is small against `size`.
    fn correct(
        &mut self,
        x: &mut [Nodal],
        residual: &mut [Nodal],
        size: f64,
        directions: &mut Directions,
    ) -> Result<(), StepFailure> {
        let weight = self.linear.weight().to_vec();
        let norm = |r: &[Nodal]| weighted_dot(&weight, r, r).sqrt();
        directions.reduce(x, residual, &weight);
        let mut product = vec![[0.0; 4]; x.len()];
        let mut left = norm(residual) / size;
        for _ in 0..CORRECTIONS {
            if left <= TOLERANCE {
                return Ok(());
            }
            let correction = self.solve_nodal(residual, TOLERANCE / left)?;
            self.linear.multiply(&correction, &mut product);
            add_scaled(x, 1.0, &correction);
            add_scaled(residual, -1.0, &product);
            directions.add(correction, product.clone(), &weight);
            left = norm(residual) / size;
        }
        // false for a number that is none
        if left <= TOLERANCE { Ok(()) } else { Err(StepFailure::Singular) }
    }

    /// Adds to the rates of contact forces how they turn with the normal of a curved platen.
    fn turn(&self, fields: &Fields, x: &[Nodal], contact: &mut [(u32, [f64; 3])]) {
        for ((_, force), (node, block)) in contact.iter_mut().zip(self.external.tangent(fields)) {
            let x = &x[node as usize];
            for i in 0..3 {
                force[i] -= (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
    }
}
