//! Bounds on nodal values, enforced by projection and an active set.
//!
//! A value is constrained if it lies on a bound and the residual pushes the value outwards. The equation of a
//! constrained value is removed from the system, and its residual is the reaction of the bound. A Newton step changes
//! the other values; values that leave their bounds are then projected back. This is the projected Newton method of
//! Bertsekas (SIAM J. Control Optim. 20 (1982) 221, doi:10.1137/0320018). After the active set has converged it is
//! Newton's method.

use crate::fields::Fields;

/// Bounds lower ≤ u_x, u_y, u_z, φ ≤ upper at every node; infinite if a value has no bound.
#[derive(Clone, Debug)]
pub struct Bounds {
    pub lower: Vec<[f64; 4]>,
    pub upper: Vec<[f64; 4]>,
}

impl Bounds {
    /// Creates infinite bounds for `nodes` nodes.
    pub fn none(nodes: usize) -> Self {
        Self { lower: vec![[f64::NEG_INFINITY; 4]; nodes], upper: vec![[f64::INFINITY; 4]; nodes] }
    }

    /// Projects values outside their bounds onto the bounds.
    pub fn project(&self, fields: &mut Fields) {
        let bounds = self.lower.iter().zip(&self.upper);
        let values = fields.displacement.iter_mut().zip(&mut fields.damage);
        for ((u, phi), (lower, upper)) in values.zip(bounds) {
            for k in 0..3 {
                u[k] = u[k].clamp(lower[k], upper[k]);
            }
            *phi = phi.clamp(lower[3], upper[3]);
        }
    }

    /// Sets `free` to false for the values that a bound constrains. `residual` has four values per node.
    pub fn constrain(&self, fields: &Fields, residual: &[[f64; 4]], free: &mut [[bool; 4]]) {
        for (n, free) in free.iter_mut().enumerate() {
            let [x, y, z] = fields.displacement[n];
            for (k, value) in [x, y, z, fields.damage[n]].into_iter().enumerate() {
                let r = residual[n][k];
                let constrained = (value <= self.lower[n][k] && r > 0.0)
                    || (value >= self.upper[n][k] && r < 0.0);
                free[k] &= !constrained;
            }
        }
    }
}
