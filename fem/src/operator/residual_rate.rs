//! Derivative of the residual with respect to a material parameter, from residuals.

use super::equations::Operator;
use super::increment::{Increment, Residual, StepContext};
use crate::material::{Inverted, PointMaterial};

/// A material parameter, given by the materials below and above its value.
#[derive(Clone, Copy)]
pub struct Shift<'a> {
    /// Materials by region, with the parameter below its value.
    pub below: &'a [PointMaterial],
    pub above: &'a [PointMaterial],
    /// Difference of the parameter between `above` and `below`.
    pub width: f64,
    /// Derivatives of the nodal values u_x, u_y, u_z, φ at the start of the increment with respect to the parameter.
    pub before: &'a [[f64; 4]],
}

/// Derivative of the residual at fixed fields, ∂R/∂θ + ∂R/∂φ_n ∂φ_n/∂θ, at every node, prescribed values included.
///
/// It is the difference of the residuals for the materials above and below, each with the damage at the start of the
/// increment for its parameter. The residual is affine in E, Gc and ξ of a phase and in ξ φ_n, so that the difference
/// is exact in these; in other parameters its error is of second order in the width.
pub fn residual_rate(
    operator: &dyn Operator,
    increment: &Increment,
    shift: &Shift,
) -> Result<Vec<[f64; 4]>, Inverted> {
    let nodes = shift.before.len();
    let fraction = shift.fraction_below(increment.materials);
    let residual = |materials: &[PointMaterial], change: f64| {
        let before = increment.context.damage_before.iter().zip(shift.before);
        let before: Vec<f64> = before.map(|(phi, rate)| phi + change * rate[3]).collect();
        let context = StepContext { damage_before: &before, ..increment.context };
        let mut residual = Residual::new(nodes);
        operator.residual(&Increment { materials, context, ..*increment }, &mut residual)?;
        Ok(residual.nodal)
    };
    // with these changes of φ_n the difference of a product ξ φ_n is exact
    let mut rate = residual(shift.above, fraction * shift.width)?;
    let below = residual(shift.below, (fraction - 1.0) * shift.width)?;
    for (rate, below) in rate.as_flattened_mut().iter_mut().zip(below.as_flattened()) {
        *rate = (*rate - below) / shift.width;
    }
    Ok(rate)
}

impl Shift<'_> {
    /// Fraction of the width that lies below the value, from the viscosity if it differs between the sides; else one
    /// half.
    fn fraction_below(&self, materials: &[PointMaterial]) -> f64 {
        let viscosity = |m: &PointMaterial| m.damage.map_or(0.0, |damage| damage.viscosity);
        let sides = self.below.iter().zip(self.above).zip(materials);
        let fractions = sides.map(|((below, above), at)| {
            let [below, above, at] = [below, above, at].map(viscosity);
            (above != below).then(|| (at - below) / (above - below))
        });
        fractions.flatten().next().unwrap_or(0.5)
    }
}
