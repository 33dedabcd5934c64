//! The quadratic degradation function ĝ(φ) = (1 − φ)².

use crate::material::number::Scalar;

/// Returns ĝ, ĝ′ and ĝ″.
#[inline(always)]
pub(super) fn derivatives<T: Scalar>(phi: T) -> [T; 3] {
    let sound = phi.constant(1.0) - phi;
    [sound * sound, phi + phi - phi.constant(2.0), phi.constant(2.0)]
}
