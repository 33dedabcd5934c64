//! Gradient flow of damage in pseudo-time, for rate-independent increments in which a crack grows unstably.
//!
//! Beyond a limit point, the next equilibrium is far from the last equilibrium, and neither Newton's method nor
//! alternate minimisation converges to it. A flow with the artificial resistance κ (φ − φ_k) converges, where φ_k is
//! the damage φ after the previous step of the flow. Each step of the flow is an implicit Euler step that decreases the
//! energy, and Newton's method solves the step like a step of viscous damage. The resistance κ is reduced as the
//! changes of damage become small, and the final equilibrium is computed without resistance. This equilibrium is the
//! limit of damage with vanishing viscosity.
//!
//! Reference: Kelley & Keyes, SIAM J. Numer. Anal. 35 (1998) 508, doi:10.1137/S0036142996304796 (pseudo-transient
//! continuation); Knees, Rossi & Zanini, Math. Models Methods Appl. Sci. 23 (2013) 565,
//! doi:10.1142/S021820251250056X (vanishing viscosity).

use super::newton::Newton;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// Initial resistance κ, in units of Gc/(c₀ ℓ₀) with the fracture energy Gc, the normalisation c₀ of the crack density
/// and the length scale ℓ₀.
const FIRST: f64 = 10.0;
/// Largest resistance κ, in units of Gc/(c₀ ℓ₀); the increment fails if a larger resistance would be necessary.
const LARGEST: f64 = 1e7;
/// Largest number of steps of the flow.
const STEPS: u32 = 400;
/// The resistance κ is reduced after a step of the flow whose largest change of damage is below this value.
const SLOW: f64 = 0.2;
/// After a step of the flow whose largest change of damage is below this value, the solver tries to find the
/// equilibrium without resistance.
const NEAR: f64 = 0.02;
/// Factor by which the resistance is multiplied after a step with a small change of damage.
const FASTER: f64 = 1.0 / 3.0;
/// Factor by which the resistance is multiplied after a step that did not converge.
const SLOWER: f64 = 4.0;

/// Function that solves for the fields from a guess.
pub(super) type SolveFields<'s> =
    dyn Fn(&mut Newton, &mut Fields, StepContext) -> Result<(), StepFailure> + 's;

/// Whether there are materials that can be damaged, and all of them have zero viscosity.
pub(super) fn is_rate_independent(newton: &Newton) -> bool {
    let mut damaged = newton.materials.iter().filter_map(|m| m.damage.as_ref()).peekable();
    damaged.peek().is_some() && damaged.all(|d| d.viscosity == 0.0)
}

/// Follows the gradient flow of damage from the damage at the start of the increment to an equilibrium without
/// artificial resistance. `solve` solves one step of the flow.
pub(super) fn flow(
    newton: &mut Newton,
    fields: &mut Fields,
    context: StepContext,
    solve: &SolveFields,
) -> Result<(), StepFailure> {
    let damaged = newton.materials.iter().filter_map(|m| m.damage.as_ref());
    let scale = damaged.map(|d| d.local).fold(0.0, f64::max);
    let (mut damping, mut last) = (FIRST * scale, f64::INFINITY);
    fields.damage.copy_from_slice(context.damage_before);
    let mut before = fields.clone();
    for _ in 0..STEPS {
        let damped = StepContext { damping, damage_before: &before.damage, ..context };
        if let Err(failure) = solve(newton, fields, damped) {
            fields.copy_from(&before);
            damping *= SLOWER;
            if damping > LARGEST * scale {
                return Err(failure);
            }
            continue;
        }
        let moved = distance(newton, &fields.damage, &before.damage);
        if moved < NEAR && moved < last {
            let mut rest = fields.clone();
            if solve(newton, &mut rest, context).is_ok() {
                *fields = rest;
                return Ok(());
            }
        }
        if moved < SLOW {
            damping *= FASTER;
        }
        last = moved;
        before.copy_from(fields);
    }
    Err(StepFailure::TooManyIterations { iterations: STEPS, residual: newton.relative })
}

/// Returns the largest difference between two damage fields, over all ranks.
fn distance(newton: &Newton, a: &[f64], b: &[f64]) -> f64 {
    let mut largest = [a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)];
    newton.operator.part().ranks().max(&mut largest);
    largest[0]
}
