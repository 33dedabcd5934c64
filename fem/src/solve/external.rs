//! Interface of the external forces (loads and contact) for the solver.

use crate::fields::Fields;
use crate::operator::{NodeBlock, Residual};

/// Loads and contact at the end of an increment. Clones share no data.
pub(crate) trait External: Clone + Default {
    /// Subtracts the external forces from a residual that contains only forces of the stress.
    fn subtract(&self, fields: &Fields, residual: &mut Residual);

    /// Returns the contributions of contact to the tangent.
    fn tangent(&self, fields: &Fields) -> Vec<NodeBlock>;

    /// Whether there are contact pressures, which are determined by augmentation passes.
    fn has_contact(&self) -> bool;

    /// Whether there is a contact with friction.
    fn has_friction(&self) -> bool;

    /// Makes one augmentation pass: updates the contact pressures from the gaps. Returns the square of the change of
    /// the contact forces, N².
    fn augment(&mut self, fields: &Fields) -> f64;

    /// Returns the change of the contact forces that keeps the gaps of contact without friction closed for the
    /// displacement rates du/dθ in `rates`: −γ A (n·du/dθ) n, N, for each node.
    fn follow(&self, fields: &Fields, rates: &[[f64; 4]]) -> Vec<(u32, [f64; 3])>;

    /// Returns the rounding error of contact forces: per mm of displacement, N/mm, and independent of displacement,
    /// N.
    fn rounding(&self) -> [f64; 2];

    /// Multiplies the slip velocity below which friction fades out by `factor`.
    fn blunt(&mut self, factor: f64);
}

/// No external forces.
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
