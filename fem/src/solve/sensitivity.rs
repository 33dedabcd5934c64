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
//! step. They are solved together, by corrections with the factor or the hierarchy at hand: each takes the
//! combination of the rates at the equilibria before and of all corrections that leaves the least residual.
//!
//! What residuals ρ do to the measured force f = c·(K x + ∂R/∂θ) is known without solving further: y·ρ
//! with K y = K c on the free values, the adjoint. That is one system more, but a rough y is enough, as
//! what it misses is multiplied by ρ; and ρ need only be as small as the rates themselves ask for.

use super::directions::{Directions, System};
use super::external::External;
use super::linear::{Nodal, add_scaled, mask};
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{Increment, Shift, StepContext};

/// Residual of a solution, relative to that without a change of the free values: where the force depends
/// on it, where the adjoint corrects the force, and of the adjoint.
const TOLERANCE: f64 = 1e-7;
const CORRECTED: f64 = 3e-6;
const ADJOINT: f64 = 1e-3;
/// Most corrections for each system by the factor or the hierarchy at hand, of a solution by the linear
/// solver, which renews these, and passes over the pressures.
const ROUNDS: usize = 12;
const CORRECTIONS: usize = 4;
const PASSES: usize = 60;
/// What the first correction is thought to leave of the residuals, and the least and the most that a later
/// one is.
const LEAVES: f64 = 0.1;
const LEAST_LEFT: f64 = 0.01;
const MOST_LEFT: f64 = 0.5;
/// Rates that are this much larger than those of a body as stiff as its stiffest value come from a stiffness
/// that is rounding: its digits are 2e-16 of the stiffest one's.
const BY_ROUNDING: f64 = 1e13;

/// The rates with one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Rates {
    /// Of u_x, u_y, u_z, φ at every node.
    pub(crate) values: Vec<Nodal>,
    /// Of the residual: what supports and bounds have to exert more.
    pub(crate) residual: Vec<Nodal>,
    /// Of the forces of contact.
    pub(crate) contact: Vec<(u32, [f64; 3])>,
    /// What the rate of the measured force lacks.
    pub(crate) correction: f64,
}

/// The force that is measured.
pub(crate) struct Measured<'a> {
    /// The functional that it is of the residual; `None`: it is not, and nothing corrects its rates.
    pub(crate) of_residual: Option<&'a [Nodal]>,
    /// Its adjoint at the equilibrium before, and then at this one.
    pub(crate) adjoint: &'a mut Vec<Nodal>,
}

/// What is known of a parameter before its system is solved.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    /// The parameter, with the rates where the increment began.
    pub(crate) shift: Shift<'a>,
    /// The rates of earlier equilibria, each of which is a direction to start with.
    pub(crate) earlier: &'a [Vec<Nodal>],
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
        measured: Measured,
        follows: bool,
    ) -> Result<Vec<Rates>, StepFailure> {
        self.linearise_at(fields, context)?;
        let shifts: Vec<Shift> = known.iter().map(|known| known.shift).collect();
        let mut residuals = vec![vec![[0.0; 4]; fields.damage.len()]; shifts.len()];
        let increment = Increment { materials: self.materials, fields, context };
        self.operator.rates(&increment, &shifts, &mut residuals)?;
        let mut directions = Directions::new(self.linear.weight().to_vec());
        let tolerance = if measured.of_residual.is_some() { CORRECTED } else { TOLERANCE };
        let mut systems = Vec::with_capacity(known.len() + 1);
        for (shift, mut right) in shifts.iter().zip(residuals) {
            negate(&mut right);
            let held = self.held(fields, context, follows, shift.before);
            systems.push(self.system(held, right, tolerance, &directions));
        }
        if let Some(functional) = measured.of_residual {
            let mut right = vec![[0.0; 4]; functional.len()];
            self.linear.multiply(functional, &mut right);
            mask(&self.free, &mut right);
            let none = vec![[0.0; 4]; right.len()];
            systems.push(self.system(none, right, ADJOINT, &directions));
        }
        let before = known.iter().flat_map(|known| {
            std::iter::once(known.shift.before).chain(known.earlier.iter().map(Vec::as_slice))
        });
        let guesses = before.chain([measured.adjoint.as_slice()]);
        // of these the constrained values do not count
        let guesses = guesses.filter(|guess| guess.iter().any(|g| *g != [0.0; 4])).map(|guess| {
            let mut direction = guess.to_vec();
            mask(&self.free, &mut direction);
            direction
        });
        self.take_up(guesses.collect(), &mut directions);
        let mut contacts = vec![Vec::new(); known.len()];
        for _ in 0..PASSES {
            self.correct(&mut systems, &mut directions)?;
            for (system, contact) in systems.iter_mut().zip(&mut contacts) {
                self.press(fields, system, contact);
            }
            if systems.iter().all(|system| directions.solved(system)) {
                return Ok(self.rates(fields, systems, contacts, measured));
            }
        }
        Err(StepFailure::Contact)
    }

    /// A system with the constrained values as they are in `x`; `right` is the right-hand side without
    /// them.
    fn system(
        &mut self,
        x: Vec<Nodal>,
        mut right: Vec<Nodal>,
        tolerance: f64,
        directions: &Directions,
    ) -> System {
        if x.iter().any(|x| x[3] != 0.0) {
            let mut product = vec![[0.0; 4]; x.len()];
            self.linear.multiply(&x, &mut product);
            add_scaled(&mut right, -1.0, &product);
        }
        directions.system(x, right, tolerance)
    }

    /// Adds directions with their products.
    fn take_up(&mut self, of: Vec<Vec<Nodal>>, directions: &mut Directions) {
        let product = |direction: &Vec<Nodal>| {
            let mut product = vec![[0.0; 4]; direction.len()];
            self.linear.multiply(direction, &mut product);
            product
        };
        let products = of.iter().map(product).collect();
        directions.add(of, products);
    }

    /// Adds the rates of pressure that the rates in a system ask for.
    fn press(&self, fields: &Fields, system: &mut System, contact: &mut Vec<(u32, [f64; 3])>) {
        if system.vanishes() {
            return;
        }
        let lacking = self.external.follow(fields, &system.x);
        if contact.is_empty() {
            *contact = lacking.iter().map(|(node, _)| (*node, [0.0; 3])).collect();
        }
        for ((node, force), (_, sum)) in lacking.iter().zip(contact) {
            for k in 0..3 {
                sum[k] += force[k];
                system.residual[*node as usize][k] += force[k];
            }
        }
    }

    /// The rates from the systems that are solved.
    fn rates(
        &self,
        fields: &Fields,
        mut systems: Vec<System>,
        contacts: Vec<Vec<(u32, [f64; 3])>>,
        measured: Measured,
    ) -> Vec<Rates> {
        *measured.adjoint = match measured.of_residual {
            Some(_) => systems.pop().map_or(Vec::new(), |system| system.x),
            None => Vec::new(),
        };
        let of_system = |(system, mut contact): (System, Vec<_>)| {
            let System { x: values, mut residual, .. } = system;
            self.turn(fields, &values, &mut contact);
            // zero in constrained values
            let adjoint = measured.adjoint.as_flattened().iter();
            let correction = adjoint.zip(residual.as_flattened()).map(|(y, r)| y * r).sum();
            negate(&mut residual);
            Rates { values, residual, contact, correction }
        };
        systems.into_iter().zip(contacts).map(of_system).collect()
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

    /// Corrects the solutions until their residuals are small.
    fn correct(
        &mut self,
        systems: &mut [System],
        directions: &mut Directions,
    ) -> Result<(), StepFailure> {
        directions.reduce(0, systems);
        let (mut spent, mut before, mut leaves) = (0, 0.0, LEAVES);
        while spent < ROUNDS * systems.len() {
            // what is less than a correction leaves of the largest part waits for a later one
            let (largest, parts) = directions.principal(systems, leaves);
            if parts.is_empty() {
                break;
            }
            if before > 0.0 {
                leaves = (largest / before).clamp(LEAST_LEFT, MOST_LEFT);
            }
            (before, spent) = (largest, spent + parts.len());
            let known = directions.count();
            let corrections = self.precondition(parts);
            self.take_up(corrections, directions);
            directions.reduce(known, systems);
            if directions.count() == known {
                break;
            }
        }
        // what is left asks for another factor or hierarchy
        for k in 0..systems.len() {
            for _ in 0..CORRECTIONS {
                if directions.solved(&systems[k]) {
                    break;
                }
                let tolerance = 1.0 / directions.excess(&systems[k]);
                let correction = self.solve_nodal(&systems[k].residual, tolerance)?;
                let known = directions.count();
                self.take_up(vec![correction], directions);
                directions.reduce(known, systems);
            }
            if !directions.solved(&systems[k]) {
                return Err(StepFailure::Singular);
            }
        }
        systems.iter_mut().for_each(|system| directions.form(system));
        let is_sound = |system: &System| directions.growth(system) < BY_ROUNDING;
        if systems.iter().all(is_sound) { Ok(()) } else { Err(StepFailure::Singular) }
    }

    /// Residuals times the inverse of the factor or the hierarchy at hand.
    fn precondition(&mut self, mut right: Vec<Vec<Nodal>>) -> Vec<Vec<Nodal>> {
        right.iter_mut().for_each(|right| mask(&self.free, right));
        let right: Vec<&[Nodal]> = right.iter().map(Vec::as_slice).collect();
        let mut out = vec![vec![[0.0; 4]; self.free.len()]; right.len()];
        let mut slices: Vec<&mut [Nodal]> = out.iter_mut().map(Vec::as_mut_slice).collect();
        self.effort.factorisations += self.linear.precondition(&right, &mut slices);
        self.effort.linear += right.len() as u32;
        out
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
