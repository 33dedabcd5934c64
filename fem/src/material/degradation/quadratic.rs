//! The quadratic degradation function ĝ(φ) = (1 − φ)².

use super::user::DegradationFunction;
use crate::material::number::Scalar;

/// ĝ = (1 − φ)².
#[derive(Clone, Copy, Debug)]
pub(super) struct Quadratic;

impl DegradationFunction for Quadratic {
    #[inline(always)]
    fn value<T: Scalar>(&self, damage: T) -> T {
        let sound = damage.constant(1.0) - damage;
        sound * sound
    }

    #[inline(always)]
    fn derivatives<T: Scalar>(&self, damage: T) -> [T; 3] {
        let two = damage.constant(2.0);
        [self.value(damage), damage + damage - two, two]
    }
}
