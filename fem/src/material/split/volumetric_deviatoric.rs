//! The split into change of volume and change of shape: damage spares the volumetric energy in compression.

use super::Shares;
use crate::material::number::Scalar;
use crate::material::principal::Strains;
use crate::material::response::ElasticResponse;

/// Returns the degraded terms of Hencky's energy.
#[inline(always)]
pub(super) fn shares<T: Scalar>(strains: &Strains<T>) -> Shares<T> {
    let trace = strains.trace();
    let (zero, one) = (trace.constant(0.0), trace.constant(1.0));
    // zero strain counts as tensile, so that ψ⁺ + ψ⁻ = ψ there
    Shares { volume: T::select(trace.less_than(zero), zero, one), principal: [one; 3] }
}

/// Returns the spared part of the response of any law: U(tr ε) in compression.
#[inline(always)]
pub(super) fn spared<T: Scalar>(trace: T, volumetric: [T; 3]) -> ElasticResponse<T> {
    let compressed = trace.less_than(trace.constant(0.0));
    ElasticResponse::volumetric(volumetric).only(compressed)
}
