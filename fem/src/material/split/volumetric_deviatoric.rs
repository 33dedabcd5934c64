//! The split into change of volume and change of shape: damage spares the volumetric energy in compression.

use super::shares::Shares;
use super::user::{ElasticPoint, EnergySplit};
use crate::material::number::Scalar;
use crate::material::principal::Strains;
use crate::material::response::ElasticResponse;

/// Returns 1 for each term of Hencky's energy that damage degrades, 0 for the other terms.
#[inline(always)]
pub(super) fn shares<T: Scalar>(strains: &Strains<T>) -> Shares<T> {
    let trace = strains.trace();
    let (zero, one) = (trace.constant(0.0), trace.constant(1.0));
    // zero strain counts as tensile, so that ψ⁺ + ψ⁻ = ψ there
    Shares { volume: T::select(trace.less_than(zero), zero, one), principal: [one; 3] }
}

/// Volumetric–deviatoric split of any law: ψ⁻ = U(tr ε) in compression, zero in extension.
#[derive(Clone, Copy, Debug)]
pub(super) struct VolumetricDeviatoric;

impl EnergySplit for VolumetricDeviatoric {
    #[inline(always)]
    fn spared<T: Scalar>(&self, point: &ElasticPoint<T>) -> ElasticResponse<T> {
        let trace = point.strain.log_volume();
        let compressed = trace.less_than(trace.constant(0.0));
        ElasticResponse::volumetric(point.volumetric).only(compressed)
    }
}
