//! Derivatives of residual and state with respect to a material parameter, and of the residual along a direction of
//! the fields, as differences between two evaluations.

use super::equations::Operator;
use super::increment::{Increment, Residual, StepContext};
use crate::fields::Fields;
use crate::material::{Inverted, PointMaterial};

/// Largest change of the fields in a product with the Jacobian, relative to the largest displacement and to φ = 1. The
/// truncation error and the rounding error of the product are both below 1e-8 of the product.
const STEP: f64 = 1e-6;

/// Materials for a smaller and a larger value of a material parameter θ, for a difference quotient.
#[derive(Clone, Copy)]
pub struct Shift<'a> {
    /// Materials by region, for the smaller value of the parameter.
    pub below: &'a [PointMaterial],
    /// Materials by region, for the larger value of the parameter.
    pub above: &'a [PointMaterial],
    /// Difference of the parameter between `above` and `below`.
    pub width: f64,
    /// Derivatives of the nodal values u_x, u_y, u_z, φ at the start of the increment with respect to the parameter.
    pub before: &'a [[f64; 4]],
    /// Derivatives of the state at the start of the increment with respect to the parameter; empty if they are zero.
    pub state: &'a [f64],
}

/// One of the two evaluations of a difference quotient.
struct Side<'a> {
    materials: &'a [PointMaterial],
    /// Factor by which the derivatives of fields and state are multiplied on this side, see [`Shift::sides`].
    /// If the value of the parameter is in the middle between both sides, the factor is the difference between
    /// the parameter on this side and its value.
    change: f64,
    damage_before: Vec<f64>,
    state: Vec<f64>,
}

/// Computes the derivative of the residual at fixed fields, ∂R/∂θ + ∂R/∂φ_n ∂φ_n/∂θ + ∂R/∂s_n ∂s_n/∂θ with the state
/// s_n, at every node, including the components with prescribed values.
///
/// The derivative is computed as the difference quotient of two residuals, for the materials `above` and `below`.
/// Each residual uses the start values of the increment that belong to its parameter value. The residual is affine
/// in E, Gc and ξ of a phase and in ξ φ_n, so that the quotient is exact for these parameters. For other
/// parameters, the error of the quotient is of second order in the width.
pub fn residual_rate(
    operator: &dyn Operator,
    increment: &Increment,
    shift: &Shift,
) -> Result<Vec<[f64; 4]>, Inverted> {
    let [mut rate, below] = shift.sides(increment).map(|side| {
        let mut residual = Residual::new(shift.before.len());
        operator.residual(&side.increment(increment), &mut residual).map(|()| residual.nodal)
    });
    if let (Ok(rate), Ok(below)) = (&mut rate, &below) {
        difference(rate.as_flattened_mut(), below.as_flattened(), shift.width);
    }
    below.and(rate)
}

/// Computes the derivative of the state at the end of the increment. `rates` are the derivatives of the nodal values
/// u_x, u_y, u_z, φ at the end of the increment. The error is of second order in the width of the shift.
pub fn state_rate(
    operator: &dyn Operator,
    increment: &Increment,
    shift: &Shift,
    rates: &[[f64; 4]],
) -> Result<Vec<f64>, Inverted> {
    let [mut rate, below] = shift.sides(increment).map(|side| {
        let fields = moved(increment.fields, side.change, rates);
        let mut state = vec![0.0; increment.context.state.len()];
        let at = Increment { fields: &fields, ..side.increment(increment) };
        operator.state(&at, &mut state).map(|()| state)
    });
    if let (Ok(rate), Ok(below)) = (&mut rate, &below) {
        difference(rate, below, shift.width);
    }
    below.and(rate)
}

/// Product of the Jacobian of the residual at fixed materials, ∂R/∂x, with a direction of the nodal values u_x, u_y,
/// u_z, φ: the central difference of two residuals. Contact is not included.
///
/// Unlike the tangent, the product is consistent also if no energy is minimised: with a history of the driving energy,
/// with a hybrid split, and with laws that dissipate energy.
pub fn jacobian_product(
    operator: &dyn Operator,
    increment: &Increment,
    direction: &[[f64; 4]],
) -> Result<Vec<[f64; 4]>, Inverted> {
    let step = step(increment.fields, direction);
    if step == 0.0 {
        return Ok(vec![[0.0; 4]; direction.len()]);
    }
    let [mut product, below] = [step, -step].map(|step| {
        let fields = moved(increment.fields, step, direction);
        let mut residual = Residual::new(direction.len());
        let at = Increment { fields: &fields, ..*increment };
        operator.residual(&at, &mut residual).map(|()| residual.nodal)
    });
    if let (Ok(product), Ok(below)) = (&mut product, &below) {
        difference(product.as_flattened_mut(), below.as_flattened(), 2.0 * step);
    }
    below.and(product)
}

/// Returns the factor by which the direction is multiplied to obtain the change of the fields; zero for
/// a direction that is zero.
fn step(fields: &Fields, direction: &[[f64; 4]]) -> f64 {
    let largest =
        |values: &mut dyn Iterator<Item = f64>| values.fold(0.0f64, |m, x| m.max(x.abs()));
    let mut displacement_mm = largest(&mut fields.displacement.as_flattened().iter().copied());
    if displacement_mm == 0.0 {
        displacement_mm = 1.0;
    }
    let moves = largest(&mut direction.iter().flat_map(|d| [d[0], d[1], d[2]]));
    let damages = largest(&mut direction.iter().map(|d| d[3]));
    let relative = (moves / displacement_mm).max(damages);
    if relative > 0.0 { STEP / relative } else { 0.0 }
}

/// Returns the fields plus `multiple` times the rates of u_x, u_y, u_z, φ.
fn moved(fields: &Fields, multiple: f64, rates: &[[f64; 4]]) -> Fields {
    let mut fields = fields.clone();
    let values = fields.displacement.iter_mut().zip(&mut fields.damage);
    for ((u, phi), rate) in values.zip(rates) {
        (0..3).for_each(|k| u[k] += multiple * rate[k]);
        *phi += multiple * rate[3];
    }
    fields
}

/// Replaces `above` by the difference quotient (`above` − `below`)/`width`.
fn difference(above: &mut [f64], below: &[f64], width: f64) {
    above.iter_mut().zip(below).for_each(|(above, below)| *above = (*above - below) / width);
}

impl<'a> Shift<'a> {
    /// Returns the sides above and below. The changes of φ_n are weighted so that the difference of the product ξ φ_n
    /// is exact also if the value of ξ is not in the middle between both sides.
    fn sides(&self, increment: &Increment) -> [Side<'a>; 2] {
        let fraction = self.fraction_below(increment.materials);
        [(self.above, fraction * self.width), (self.below, (fraction - 1.0) * self.width)].map(
            |(materials, change)| {
                let damage = increment.context.damage_before.iter().zip(self.before);
                let state = increment.context.state.iter().zip(self.state);
                Side {
                    materials,
                    change,
                    damage_before: damage.map(|(phi, rate)| phi + change * rate[3]).collect(),
                    state: state.map(|(value, rate)| value + change * rate).collect(),
                }
            },
        )
    }

    /// Returns the fraction of the width that lies below the value of the parameter. The fraction follows from the
    /// viscosity if the viscosity differs between the sides; else it is one half.
    fn fraction_below(&self, materials: &[PointMaterial]) -> f64 {
        let viscosity =
            |m: &PointMaterial| m.damage.as_ref().map_or(0.0, |damage| damage.viscosity);
        let sides = self.below.iter().zip(self.above).zip(materials);
        let fractions = sides.map(|((below, above), at)| {
            let [below, above, at] = [below, above, at].map(viscosity);
            (above != below).then(|| (at - below) / (above - below))
        });
        fractions.flatten().next().unwrap_or(0.5)
    }
}

impl Side<'_> {
    /// Returns the increment with the materials and start values of this side.
    fn increment<'b>(&'b self, increment: &Increment<'b>) -> Increment<'b> {
        let state = if self.state.is_empty() { increment.context.state } else { &self.state };
        let damage_before = &self.damage_before;
        let context = StepContext { damage_before, state, ..increment.context };
        Increment { materials: self.materials, context, ..*increment }
    }
}
