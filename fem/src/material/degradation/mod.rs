//! Degradation of the elastic energy by damage.

use super::number::Scalar;

/// g(φ) = (1 − η)(1 − φ)² + η, with the residual stiffness η.
#[derive(Clone, Copy, Debug)]
pub struct Degradation<T> {
    /// 1 − η; zero for a material without damage.
    pub soft: T,
}

impl<T: Scalar> Degradation<T> {
    /// g(φ).
    #[inline(always)]
    pub fn value(&self, phi: T) -> T {
        let one = phi.constant(1.0);
        let sound = one - phi;
        self.soft.mul_add(sound * sound, one - self.soft)
    }

    /// g′(φ).
    #[inline(always)]
    pub fn slope(&self, phi: T) -> T {
        self.soft * (phi + phi - phi.constant(2.0))
    }

    /// g″, a constant.
    #[inline(always)]
    pub fn curvature(&self) -> T {
        self.soft + self.soft
    }
}
