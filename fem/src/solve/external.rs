//! What a solver needs to know of the forces from outside.

use crate::fields::Fields;
use crate::operator::{NodeBlock, Residual};

/// Loads and contact at the end of an increment; clones share nothing.
pub(crate) trait External: Clone + Default {
    /// Turns a residual of stresses alone into that of the body with what acts on it.
    fn subtract(&self, fields: &Fields, residual: &mut Residual);

    /// What contact adds to the tangent.
    fn tangent(&self, fields: &Fields) -> Vec<NodeBlock>;

    /// Whether there are contact pressures, to be found by passes.
    fn has_contact(&self) -> bool;

    /// Whether friction resists sliding somewhere.
    fn has_friction(&self) -> bool;

    /// A pass: the contact pressures take the values that the gaps ask for; the square of the change of
    /// the contact forces, N².
    fn augment(&mut self, fields: &Fields) -> f64;

    /// What contact without friction lacks where the rates of its gaps are not zero: the forces of the
    /// pressures that those of the displacement in `rates` ask for, −γ A (n·du/dθ) n, N.
    fn follow(&self, fields: &Fields, rates: &[[f64; 4]]) -> Vec<(u32, [f64; 3])>;

    /// What rounding leaves of contact forces: for each mm of displacement, N/mm, and beside that, N.
    fn rounding(&self) -> [f64; 2];

    /// Lets friction fade below a multiple of its slip velocity.
    fn blunt(&mut self, factor: f64);
}

/// Nothing acts from outside.
#[cfg(test)]
impl External for () {
    fn subtract(&self, _: &Fields, _: &mut Residual) {}

    fn tangent(&self, _: &Fields) -> Vec<NodeBlock> {
        Vec::new()
    }

    fn has_contact(&self) -> bool {
        false
    }

    fn has_friction(&self) -> bool {
        false
    }

    fn augment(&mut self, _: &Fields) -> f64 {
        0.0
    }

    fn follow(&self, _: &Fields, _: &[[f64; 4]]) -> Vec<(u32, [f64; 3])> {
        Vec::new()
    }

    fn rounding(&self) -> [f64; 2] {
        [0.0; 2]
    }

    fn blunt(&mut self, _: f64) {}
}
