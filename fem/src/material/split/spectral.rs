//! The spectral split: only extension is degraded.

use super::shares::Shares;
use super::volumetric_deviatoric;
use crate::material::number::Scalar;
use crate::material::principal::Strains;

/// Returns 1 for each term of Hencky's energy that damage degrades, 0 for the other terms.
#[inline(always)]
pub(super) fn shares<T: Scalar>(strains: &Strains<T>) -> Shares<T> {
    let mut out = volumetric_deviatoric::shares(strains);
    let (zero, one) = (out.volume.constant(0.0), out.volume.constant(1.0));
    for i in 0..3 {
        out.principal[i] = T::select(strains.log[i].less_than(zero), zero, one);
    }
    out
}
