//! Rates of an equilibrium: derivatives with respect to parameters.
//!
//! R(x, x_n, θ) = 0 holds for every θ, so that K dx/dθ = −(∂R/∂θ + ∂R/∂x_n dx_n/dθ) with the tangent K at the
//! equilibrium: one additional linear system per parameter. Prescribed values have zero rate, and a value at an
//! active bound has the rate of its bound. The active set does not change with θ, except where a value is about to
//! leave its bound.
//!
//! The gap of a node in contact stays closed, because the contact pressure has a rate too. The rate of the pressure
//! is found by passes, like the pressure itself: at fixed pressure, the penalty in the tangent allows a small rate of
//! the gap, from which the rate of the pressure is updated.
//!
//! The systems of one equilibrium have the same matrix, and their solutions change little from step to step. They are
//! solved together, by corrections with the current factor or hierarchy. Each solution is the combination of earlier
//! rates and all corrections that minimises its residual.
//!
//! The effect of the residuals ρ on the measured force f = c·(K x + ∂R/∂θ) is y·ρ, where the adjoint y solves K y = K
//! c on the free values. The adjoint is one additional system, but a rough y is sufficient, because its error is
//! multiplied by ρ; and ρ need only be small enough for the rates themselves.
//!
//! If no energy is minimised (a history of the driving energy, a hybrid split, a law with a state), the tangent is not
//! the Jacobian K, which is not symmetric. The tangent is then only the preconditioner, products with K are differences
//! of residuals, and there is no adjoint.

use super::directions::{Directions, System};
use super::linear::{Nodal, add_scaled, mask};
use super::newton::Newton;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::{
    Coupling, Increment, NodeBlock, Shift, StepContext, jacobian_product, residual_rate,
};

/// Allowed residual of the linear systems, relative to the residual without a change of the free values: `TOLERANCE`
/// if the force is computed from the rates alone, `CORRECTED` if the adjoint corrects the force, `ADJOINT` for the
/// adjoint system.
const TOLERANCE: f64 = 1e-7;
const CORRECTED: f64 = 3e-6;
const ADJOINT: f64 = 1e-3;
/// Limits: `ROUNDS` corrections per system with the current factor or hierarchy (`WITHOUT_ENERGY` if the tangent is not
/// the Jacobian), `CORRECTIONS` solutions per system by the linear solver, which renews the factor, and `PASSES` passes
/// over the contact pressures.
const ROUNDS: usize = 12;
const WITHOUT_ENERGY: usize = 120;
const CORRECTIONS: usize = 4;
const PASSES: usize = 60;
/// Assumed reduction of the residual by the first correction, and the limits of the reduction that is assumed for
/// later corrections.
const LEAVES: f64 = 0.1;
const LEAST_LEFT: f64 = 0.01;
const MOST_LEFT: f64 = 0.5;
/// Limit of the size of rates, relative to a body in which every value is as stiff as the stiffest. Larger rates come
/// from a stiffness that consists of rounding errors, which are 2e-16 of the stiffest value.
const BY_ROUNDING: f64 = 1e13;

/// Rates of an equilibrium with respect to one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Rates {
    /// Rates of u_x, u_y, u_z, φ at every node.
    pub(crate) values: Vec<Nodal>,
    /// Rate of the residual: of the forces exerted by supports and bounds.
    pub(crate) residual: Vec<Nodal>,
    /// Rates of the contact forces, with their nodes.
    pub(crate) contact: Vec<(u32, [f64; 3])>,
    /// Correction of the rate of the measured force for the residual of the linear system, from the adjoint.
    pub(crate) correction: f64,
}

/// Measured force as a functional, and its adjoint.
pub(crate) struct Measured<'a> {
    /// Vector c, if the force is the functional c·R of the residual. `None`: the force is no such functional, and its
    /// rates are not corrected.
    pub(crate) of_residual: Option<&'a [Nodal]>,
    /// On input the adjoint at the previous equilibrium; on output the adjoint at this equilibrium.
    pub(crate) adjoint: &'a mut Vec<Nodal>,
}

/// Data of one parameter before its linear system is solved.
#[derive(Clone, Copy)]
pub(crate) struct Known<'a> {
    /// The parameter, with the rates at the start of the increment.
    pub(crate) shift: Shift<'a>,
    /// Rates of earlier equilibria, used as initial search directions.
    pub(crate) earlier: &'a [Vec<Nodal>],
}

/// The equilibrium that is differentiated.
#[derive(Clone, Copy)]
pub(crate) struct Equilibrium<'a> {
    /// The most recent equilibrium of Newton's method.
    pub(crate) fields: &'a Fields,
    /// The increment that led to the equilibrium.
    pub(crate) context: StepContext<'a>,
    /// Whether the lower bounds of damage are the damage at the start of the increment.
    pub(crate) bound_follows_damage: bool,
    /// Whether displacement and damage minimise a common energy.
    pub(crate) is_variational: bool,
}

impl Equilibrium<'_> {
    /// Whether the tangent is the Jacobian of the residual.
    fn tangent_is_jacobian(&self) -> bool {
        self.is_variational && self.context.state.is_empty()
    }
}

fn negate(x: &mut [Nodal]) {
    x.as_flattened_mut().iter_mut().for_each(|x| *x = -*x);
}

/// Returns the rates of an equilibrium of `newton` with respect to every parameter.
///
/// The tangent at the equilibrium is kept for the next increment. `measured.of_residual` is not used if the tangent is
/// not the Jacobian.
pub(crate) fn differentiate(
    newton: &mut Newton,
    at: Equilibrium,
    known: &[Known],
    mut measured: Measured,
) -> Result<Vec<Rates>, StepFailure> {
    let coupling = if at.is_variational { Coupling::Full } else { Coupling::Separate };
    newton.linearise_as(coupling, at.fields, at.context)?;
    let mut contact = Vec::new();
    if !at.tangent_is_jacobian() {
        measured.of_residual = None;
        contact = newton.external.tangent(at.fields);
    }
    Systems { newton, at, contact }.differentiate(known, measured)
}

/// Linear systems with the Jacobian of an equilibrium.
struct Systems<'s, 'a> {
    newton: &'s mut Newton<'a>,
    at: Equilibrium<'s>,
    /// Contributions of contact to a Jacobian that is not the tangent.
    contact: Vec<NodeBlock>,
}

impl<'s> Systems<'s, '_> {
    fn increment(&self) -> Increment<'s> {
        let Equilibrium { fields, context, .. } = self.at;
        Increment { materials: self.newton.materials, fields, context }
    }

    fn differentiate(
        &mut self,
        known: &[Known],
        measured: Measured,
    ) -> Result<Vec<Rates>, StepFailure> {
        let shifts: Vec<Shift> = known.iter().map(|known| known.shift).collect();
        let increment = self.increment();
        let rate = |shift| residual_rate(self.newton.operator, &increment, shift);
        let residuals = shifts.iter().map(rate).collect::<Result<Vec<_>, _>>()?;
        let mut directions = Directions::new(self.newton.linear.weight().to_vec());
        let tolerance = if measured.of_residual.is_some() { CORRECTED } else { TOLERANCE };
        let mut systems = Vec::with_capacity(known.len() + 1);
        for (shift, mut right) in shifts.iter().zip(residuals) {
            negate(&mut right);
            let held = self.held(shift.before);
            systems.push(self.system(held, right, tolerance, &directions)?);
        }
        if let Some(functional) = measured.of_residual {
            let mut right = self.multiply(functional)?;
            mask(&self.newton.free, &mut right);
            let none = vec![[0.0; 4]; right.len()];
            systems.push(self.system(none, right, ADJOINT, &directions)?);
        }
        let before = known.iter().flat_map(|known| {
            std::iter::once(known.shift.before).chain(known.earlier.iter().map(Vec::as_slice))
        });
        let guesses = before.chain([measured.adjoint.as_slice()]);
        // the constrained values of the guesses are not used
        let guesses = guesses.filter(|guess| guess.iter().any(|g| *g != [0.0; 4])).map(|guess| {
            let mut direction = guess.to_vec();
            mask(&self.newton.free, &mut direction);
            direction
        });
        self.take_up(guesses.collect(), &mut directions)?;
        let mut contacts = vec![Vec::new(); known.len()];
        for _ in 0..PASSES {
            self.correct(&mut systems, &mut directions)?;
            for (system, contact) in systems.iter_mut().zip(&mut contacts) {
                self.press(system, contact);
            }
            if systems.iter().all(|system| directions.solved(system)) {
                return Ok(self.rates(systems, contacts, measured));
            }
        }
        let largest = systems.iter().map(|system| directions.excess(system)).fold(0.0, f64::max);
        Err(StepFailure::Contact { passes: PASSES as u32, change: tolerance * largest })
    }

    /// Multiplies values by the Jacobian.
    fn multiply(&mut self, x: &[Nodal]) -> Result<Vec<Nodal>, StepFailure> {
        if self.at.tangent_is_jacobian() {
            let mut product = vec![[0.0; 4]; x.len()];
            self.newton.linear.multiply(x, &mut product);
            return Ok(product);
        }
        let mut product = jacobian_product(self.newton.operator, &self.increment(), x)?;
        for (node, block) in &self.contact {
            let (x, product) = (&x[*node as usize], &mut product[*node as usize]);
            for i in 0..3 {
                product[i] += (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
        Ok(product)
    }

    /// Creates a system whose constrained values are those of `x`. `right` is the right-hand side without the
    /// contribution of the constrained values.
    fn system(
        &mut self,
        x: Vec<Nodal>,
        mut right: Vec<Nodal>,
        tolerance: f64,
        directions: &Directions,
    ) -> Result<System, StepFailure> {
        if x.iter().any(|x| x[3] != 0.0) {
            let product = self.multiply(&x)?;
            add_scaled(&mut right, -1.0, &product);
        }
        Ok(directions.system(x, right, tolerance))
    }

    /// Multiplies directions by the Jacobian and adds them with their products.
    fn take_up(
        &mut self,
        of: Vec<Vec<Nodal>>,
        directions: &mut Directions,
    ) -> Result<(), StepFailure> {
        let product = |direction: &Vec<Nodal>| self.multiply(direction);
        let products = of.iter().map(product).collect::<Result<_, _>>()?;
        directions.add(of, products);
        Ok(())
    }

    /// Adds the rates of the contact pressures that close the gaps for the displacement rates of a system.
    fn press(&self, system: &mut System, contact: &mut Vec<(u32, [f64; 3])>) {
        if system.vanishes() {
            return;
        }
        let lacking = self.newton.external.follow(self.at.fields, &system.x);
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

    /// Collects the rates from the solved systems.
    fn rates(
        &self,
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
            self.turn(&values, &mut contact);
            // the adjoint is zero in constrained values
            let adjoint = measured.adjoint.as_flattened().iter();
            let correction = adjoint.zip(residual.as_flattened()).map(|(y, r)| y * r).sum();
            negate(&mut residual);
            Rates { values, residual, contact, correction }
        };
        systems.into_iter().zip(contacts).map(of_system).collect()
    }

    /// Returns the rates of the values at an active lower bound, and zero for all other values.
    fn held(&self, before: &[Nodal]) -> Vec<Nodal> {
        let mut held = vec![[0.0; 4]; before.len()];
        let Equilibrium { fields, context, bound_follows_damage, .. } = self.at;
        let Some(bounds) = context.bounds.filter(|_| bound_follows_damage) else { return held };
        for (n, held) in held.iter_mut().enumerate() {
            let constrained = self.newton.unknown[n][3] && !self.newton.free[n][3];
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
        let rounds = if self.at.tangent_is_jacobian() { ROUNDS } else { WITHOUT_ENERGY };
        let (mut spent, mut before, mut leaves) = (0, 0.0, LEAVES);
        while spent < rounds * systems.len() {
            // components smaller than the expected residual of the largest component after its correction wait for a
            // later round
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
            self.take_up(corrections, directions)?;
            directions.reduce(known, systems);
            if directions.count() == known {
                break;
            }
        }
        // the remaining residuals need a new factor or hierarchy
        for k in 0..systems.len() {
            for _ in 0..CORRECTIONS {
                if directions.solved(&systems[k]) {
                    break;
                }
                let tolerance = 1.0 / directions.excess(&systems[k]);
                let correction = self.newton.solve_nodal(&systems[k].residual, tolerance)?;
                let known = directions.count();
                self.take_up(vec![correction], directions)?;
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

    /// Applies the current factor or hierarchy as a preconditioner to several residuals.
    fn precondition(&mut self, mut right: Vec<Vec<Nodal>>) -> Vec<Vec<Nodal>> {
        right.iter_mut().for_each(|right| mask(&self.newton.free, right));
        let right: Vec<&[Nodal]> = right.iter().map(Vec::as_slice).collect();
        let mut out = vec![vec![[0.0; 4]; self.newton.free.len()]; right.len()];
        let mut slices: Vec<&mut [Nodal]> = out.iter_mut().map(Vec::as_mut_slice).collect();
        self.newton.effort.factorisations += self.newton.linear.precondition(&right, &mut slices);
        self.newton.effort.linear += right.len() as u32;
        out
    }

    /// Adds to the rates of contact forces the contribution of the rotating normal of a curved platen.
    fn turn(&self, x: &[Nodal], contact: &mut [(u32, [f64; 3])]) {
        for ((_, force), (node, block)) in
            contact.iter_mut().zip(self.newton.external.tangent(self.at.fields))
        {
            let x = &x[node as usize];
            for i in 0..3 {
                force[i] -= (0..3).map(|j| block[i][j] * x[j]).sum::<f64>();
            }
        }
    }
}
