//! Damage without viscosity that runs on by itself: the increment is followed in a time of its own.
//!
//! Past a limit point the next equilibrium is far from the last one, and neither Newton's method nor alternate
//! minimisation finds a way there. Damage resisted by its rate, κ (φ − φ_k), does: each step of this flow is an implicit
//! Euler step down the energy, which Newton's method takes as it takes those of viscous damage. The resistance
//! κ falls as damage comes to rest, and the equilibrium at the end is one without it: the one that
//! damage of vanishing viscosity comes to.
//!
//! Reference: Kelley & Keyes, SIAM J. Numer. Anal. 35 (1998) 508, doi:10.1137/S0036142996304796 (pseudo-transient
//! continuation); Knees, Rossi & Zanini, Math. Models Methods Appl. Sci. 23 (2013) 565,
//! doi:10.1142/S021820251250056X (vanishing viscosity).

use super::external::External;
use super::newton::Solver;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

/// The first resistance, and the largest that is tried, over Gc/(c₀ ℓ₀).
const FIRST: f64 = 10.0;
const LARGEST: f64 = 1e7;
/// Steps of the flow.
const STEPS: u32 = 400;
/// Growth of damage in a step below which the resistance falls, and the growth of which a step may be the last one.
const SLOW: f64 = 0.2;
const NEAR: f64 = 0.02;
/// Factors of the resistance after a slow step and after one without equilibrium.
const FASTER: f64 = 1.0 / 3.0;
const SLOWER: f64 = 4.0;

impl<E: External> Solver<'_, E> {
    /// Whether damage is there and nothing resists its rate.
    pub(super) fn is_rate_independent(&self) -> bool {
        let mut damaged = self.materials.iter().filter_map(|m| m.damage.as_ref()).peekable();
        damaged.peek().is_some() && damaged.all(|d| d.viscosity == 0.0)
    }

    /// Follows the flow from the damage at the start of the increment to an equilibrium.
    pub(super) fn flow(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        let damaged = self.materials.iter().filter_map(|m| m.damage.as_ref());
        let scale = damaged.map(|d| d.local).fold(0.0, f64::max);
        let (mut damping, mut last) = (FIRST * scale, f64::INFINITY);
        fields.damage.copy_from_slice(context.damage_before);
        let mut before = fields.clone();
        for _ in 0..STEPS {
            let damped = StepContext { damping, damage_before: &before.damage, ..context };
            if let Err(failure) = self.solve_at_once(fields, damped) {
                fields.copy_from(&before);
                damping *= SLOWER;
                if damping > LARGEST * scale {
                    return Err(failure);
                }
                continue;
            }
            let moved = self.distance(&fields.damage, &before.damage);
            if moved < NEAR && moved < last {
                let mut rest = fields.clone();
                if self.solve_at_once(&mut rest, context).is_ok() {
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
        Err(StepFailure::TooManyIterations)
    }

    /// The largest difference between two fields of damage.
    fn distance(&self, a: &[f64], b: &[f64]) -> f64 {
        let mut largest = [a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)];
        self.operator.part().ranks().max(&mut largest);
        largest[0]
    }
}
