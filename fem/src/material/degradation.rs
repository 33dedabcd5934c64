//! How damage softens the elastic energy.

/// g(φ) = (1 − η)(1 − φ)² + η, with the residual stiffness η.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Degradation {
    pub(crate) residual: f64,
}

impl Degradation {
    /// g(φ).
    pub(crate) fn value(self, phi: f64) -> f64 {
        (1.0 - self.residual) * (1.0 - phi) * (1.0 - phi) + self.residual
    }

    /// g′(φ).
    pub(crate) fn slope(self, phi: f64) -> f64 {
        -2.0 * (1.0 - self.residual) * (1.0 - phi)
    }

    /// g″, a constant.
    pub(crate) fn curvature(self) -> f64 {
        2.0 * (1.0 - self.residual)
    }
}
