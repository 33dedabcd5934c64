//! Derivatives of an equilibrium with respect to parameters, called *rates*.
//!
//! An equilibrium x, reached from the previous equilibrium x_n, satisfies R(x, x_n, θ) = 0 for every value of a
//! parameter θ; R is the residual of the discrete equations. Therefore K dx/dθ = −(∂R/∂θ + ∂R/∂x_n dx_n/dθ) with the
//! tangent K at the equilibrium: one additional linear system per parameter. Prescribed values have zero rate, and a
//! value at an active bound has the rate of its bound. The active set does not change with θ, except where a value is
//! about to leave its bound.
//!
//! The gap of a node in contact stays closed, because the contact pressure has a rate too. The rate of the pressure
//! is computed iteratively in passes, like the pressure itself: at fixed pressure, the penalty in the tangent allows a
//! small rate of the gap, from which the rate of the pressure is updated.
//!
//! The systems of one equilibrium have the same matrix, and their solutions change little from step to step. The
//! systems are solved together, by corrections with the current factor or multigrid hierarchy. Each solution is the
//! linear combination of earlier rates and all corrections that minimises the residual of its system.
//!
//! The measured force is a linear functional c·R of the residual, so that its rate is c·(K dx/dθ + ∂R/∂θ + ∂R/∂x_n
//! dx_n/dθ). The residual ρ that the linear solver leaves changes this rate by y·ρ, where the adjoint y solves K y = K
//! c on the free values. The adjoint is one additional system. An approximate y is sufficient, because the error of y
//! is multiplied by ρ. With this correction, ρ must be small enough only for the rates dx/dθ, which are initial data of
//! the next increment.
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

/// Allowed residual of a linear system if the adjoint does not correct the force, relative to the residual of the
/// solution zero (all free values are 0).
const TOLERANCE: f64 = 1e-7;
/// Allowed relative residual of a linear system if the adjoint corrects the force.
const CORRECTED: f64 = 3e-6;
/// Allowed relative residual of the adjoint system.
const ADJOINT: f64 = 1e-3;
/// Largest number of corrections per system by the current factor or multigrid hierarchy.
const ROUNDS: usize = 12;
/// Largest number of corrections per system if the tangent is not the Jacobian.
const ROUNDS_WITHOUT_ENERGY: usize = 120;
/// Largest number of corrections per system by complete linear solves, in which the factor or the hierarchy may be
/// renewed.
const CORRECTIONS: usize = 4;
/// Largest number of passes over the rates of the contact pressures.
const PASSES: usize = 60;
/// Ratio by which the first correction is assumed to reduce the residual.
const FIRST_REDUCTION: f64 = 0.1;
/// Lower limit of the ratio by which a later correction is assumed to reduce the residual.
const LEAST_REDUCTION: f64 = 0.01;
/// Upper limit of the ratio by which a later correction is assumed to reduce the residual.
const MOST_REDUCTION: f64 = 0.5;
/// Largest plausible norm of the rates, relative to the norm that they would have if all unknowns were as stiff as the
/// stiffest unknown. Larger rates result from unknowns whose stiffness consists of rounding errors, which are 2e-16 of
/// the largest stiffness.
const BY_ROUNDING: f64 = 1e13;

/// Derivatives (*rates*) of an equilibrium with respect to one parameter.
#[derive(Clone, Debug)]
pub(crate) struct Rates {
    /// Rates of u_x, u_y, u_z, φ at every node.
    pub(crate) values: Vec<Nodal>,
    /// Rates of the nodal residual. At an equilibrium, the residual consists of the forces that supports and bounds
    /// exert.
    pub(crate) residual: Vec<Nodal>,
    /// Rates of the contact forces: node number and rate, N per unit of the parameter.
    pub(crate) contact: Vec<(u32, [f64; 3])>,
    /// Value that must be added to the rate of the measured force, because the linear system was solved only
    /// approximately; computed from the adjoint.
    pub(crate) correction: f64,
}

/// The measured force as a linear functional of the residual, and the adjoint of this functional.
pub(crate) struct Measured<'a> {
    /// Vector c of the measured force c·R, where R is the residual. `None` if the force is not a linear functional of
    /// R; the rates of the force are then not corrected.
    pub(crate) of_residual: Option<&'a [Nodal]>,
    /// On input, the adjoint solution at the previous equilibrium; on output, the adjoint solution at this equilibrium.
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
/// The tangent at the equilibrium stays stored for the next increment. `measured.of_residual` is not used if the
/// tangent is not the Jacobian.
///
/// `platen` contains the displacements of the nodes that are fixed to a platen, for a platen displacement of 1 mm. The
/// last entry of the result is then the response to the displacement of the platen, and all other rates are rates at
/// constant platen.
pub(crate) fn differentiate(
    newton: &mut Newton,
    at: Equilibrium,
    parameters: &[Known],
    mut measured: Measured,
    platen: Option<&[Nodal]>,
) -> Result<Vec<Rates>, StepFailure> {
    let coupling = if at.is_variational { Coupling::Full } else { Coupling::Separate };
    newton.linearise_as(coupling, at.fields, at.context)?;
    let mut contact = Vec::new();
    if !at.tangent_is_jacobian() {
        measured.of_residual = None;
        contact = newton.external.tangent(at.fields);
    }
    Systems { newton, at, contact }.differentiate(parameters, measured, platen)
}

/// Linear systems with the Jacobian of an equilibrium.
struct Systems<'s, 'a> {
    newton: &'s mut Newton<'a>,
    at: Equilibrium<'s>,
    /// Contributions of contact to the Jacobian, if the tangent is not the Jacobian.
    contact: Vec<NodeBlock>,
}

impl<'s> Systems<'s, '_> {
    fn increment(&self) -> Increment<'s> {
        let Equilibrium { fields, context, .. } = self.at;
        Increment { materials: self.newton.materials, fields, context }
    }

    fn differentiate(
        &mut self,
        parameters: &[Known],
        measured: Measured,
        platen: Option<&[Nodal]>,
    ) -> Result<Vec<Rates>, StepFailure> {
        let shifts: Vec<Shift> = parameters.iter().map(|parameter| parameter.shift).collect();
        let increment = self.increment();
        let rate = |shift| residual_rate(self.newton.operator, &increment, shift);
        let residuals = shifts.iter().map(rate).collect::<Result<Vec<_>, _>>()?;
        let mut directions = Directions::new(self.newton.linear.weight().to_vec());
        let tolerance = if measured.of_residual.is_some() { CORRECTED } else { TOLERANCE };
        let mut systems = Vec::with_capacity(parameters.len() + 2);
        for (shift, mut right) in shifts.iter().zip(residuals) {
            negate(&mut right);
            let held = self.held(shift.before);
            systems.push(self.system(held, right, tolerance, &directions)?);
        }
        if let Some(motion) = platen {
            let none = vec![[0.0; 4]; motion.len()];
            systems.push(self.system(motion.to_vec(), none, tolerance, &directions)?);
        }
        if let Some(functional) = measured.of_residual {
            let mut right = self.multiply(functional)?;
            mask(&self.newton.free, &mut right);
            let none = vec![[0.0; 4]; right.len()];
            systems.push(self.system(none, right, ADJOINT, &directions)?);
        }
        let before = parameters.iter().flat_map(|parameter| {
            let earlier = parameter.earlier.iter().map(Vec::as_slice);
            std::iter::once(parameter.shift.before).chain(earlier)
        });
        let guesses = before.chain([measured.adjoint.as_slice()]);
        // skip guesses that are zero; only the free values of a guess are used
        let guesses = guesses.filter(|guess| guess.iter().any(|g| *g != [0.0; 4])).map(|guess| {
            let mut direction = guess.to_vec();
            mask(&self.newton.free, &mut direction);
            direction
        });
        self.add_directions(guesses.collect(), &mut directions)?;
        let responses = parameters.len() + usize::from(platen.is_some());
        let mut contacts = vec![Vec::new(); responses];
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

    /// Creates the linear system of one parameter; `x` contains the rates of the constrained values. `right` is the
    /// right-hand side without the contribution of the constrained values.
    fn system(
        &mut self,
        x: Vec<Nodal>,
        mut right: Vec<Nodal>,
        tolerance: f64,
        directions: &Directions,
    ) -> Result<System, StepFailure> {
        if x.iter().any(|x| *x != [0.0; 4]) {
            let product = self.multiply(&x)?;
            add_scaled(&mut right, -1.0, &product);
        }
        Ok(directions.system(x, right, tolerance))
    }

    /// Adds search directions to `directions`, with their products with the Jacobian.
    fn add_directions(
        &mut self,
        added: Vec<Vec<Nodal>>,
        directions: &mut Directions,
    ) -> Result<(), StepFailure> {
        let product = |direction: &Vec<Nodal>| self.multiply(direction);
        let products = added.iter().map(product).collect::<Result<_, _>>()?;
        directions.add(added, products);
        Ok(())
    }

    /// Updates the rates of the contact forces in `contact` and the residual of a system, so that the gaps stay closed
    /// under the displacement rates of the system.
    fn press(&self, system: &mut System, contact: &mut Vec<(u32, [f64; 3])>) {
        if system.vanishes() {
            return;
        }
        let corrections = self.newton.external.follow(self.at.fields, &system.x);
        if contact.is_empty() {
            *contact = corrections.iter().map(|(node, _)| (*node, [0.0; 3])).collect();
        }
        for ((node, force), (_, sum)) in corrections.iter().zip(contact) {
            for k in 0..3 {
                sum[k] += force[k];
                system.residual[*node as usize][k] += force[k];
            }
        }
    }

    /// Returns the rates of the parameters from the solutions of their systems.
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
            self.add_normal_rotation(&values, &mut contact);
            // constrained values do not contribute: the adjoint is zero there
            let adjoint = measured.adjoint.as_flattened().iter();
            let correction = adjoint.zip(residual.as_flattened()).map(|(y, r)| y * r).sum();
            negate(&mut residual);
            Rates { values, residual, contact, correction }
        };
        systems.into_iter().zip(contacts).map(of_system).collect()
    }

    /// Returns the rates of the damage values that lie at an active lower bound, and zero for all other values.
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
        let rounds = if self.at.tangent_is_jacobian() { ROUNDS } else { ROUNDS_WITHOUT_ENERGY };
        let (mut spent, mut before, mut reduction) = (0, 0.0, FIRST_REDUCTION);
        while spent < rounds * systems.len() {
            // skip a component in this round if it is smaller than the residual that is expected after the correction
            // of the largest component
            let (largest, components) = directions.principal(systems, reduction);
            if components.is_empty() {
                break;
            }
            if before > 0.0 {
                reduction = (largest / before).clamp(LEAST_REDUCTION, MOST_REDUCTION);
            }
            (before, spent) = (largest, spent + components.len());
            let count_before = directions.count();
            let corrections = self.precondition(components);
            self.add_directions(corrections, directions)?;
            directions.reduce(count_before, systems);
            if directions.count() == count_before {
                break;
            }
        }
        // residuals that are still too large need a new factor or hierarchy
        for k in 0..systems.len() {
            for _ in 0..CORRECTIONS {
                if directions.solved(&systems[k]) {
                    break;
                }
                let tolerance = 1.0 / directions.excess(&systems[k]);
                let correction = self.newton.solve_nodal(&systems[k].residual, tolerance)?;
                let count_before = directions.count();
                self.add_directions(vec![correction], directions)?;
                directions.reduce(count_before, systems);
            }
            if !directions.solved(&systems[k]) {
                return Err(StepFailure::Singular);
            }
        }
        systems.iter_mut().for_each(|system| directions.form(system));
        let is_sound = |system: &System| directions.growth(system) < BY_ROUNDING;
        if systems.iter().all(is_sound) { Ok(()) } else { Err(StepFailure::Singular) }
    }

    /// Applies the current factor or multigrid hierarchy as a preconditioner to several residuals.
    fn precondition(&mut self, mut right: Vec<Vec<Nodal>>) -> Vec<Vec<Nodal>> {
        right.iter_mut().for_each(|right| mask(&self.newton.free, right));
        let right: Vec<&[Nodal]> = right.iter().map(Vec::as_slice).collect();
        let mut out = vec![vec![[0.0; 4]; self.newton.free.len()]; right.len()];
        let mut slices: Vec<&mut [Nodal]> = out.iter_mut().map(Vec::as_mut_slice).collect();
        self.newton.effort.factorisations += self.newton.linear.precondition(&right, &mut slices);
        self.newton.effort.linear += right.len() as u32;
        out
    }

    /// Adds the contribution of the rotating normal of a curved platen to the rates of the contact forces.
    fn add_normal_rotation(&self, x: &[Nodal], contact: &mut [(u32, [f64; 3])]) {
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
