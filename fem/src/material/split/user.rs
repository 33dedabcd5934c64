//! User-defined splits.

use std::fmt::Debug;
use std::sync::Arc;

use crate::material::number::{Computation, Family, MemberOf, OverScalars, Scalar};
use crate::material::principal::Strains;
use crate::material::response::ElasticResponse;
use crate::material::strain::PrincipalStrain;

/// Split of the elastic energy, given by the part ψ⁻ that damage does not degrade (spares).
///
/// The energy is ψ = ψ⁺ + ψ⁻. Damage degrades ψ⁺, and ψ⁺ drives damage. The split returns ψ⁻ with its stress and
/// tangent; the rest of the response is the degraded part.
///
/// # Example
/// The star-convex split: ψ⁻ = (1 + γ) U(J) in compression, with the volumetric energy U (Vicentini, Zolesi, Carrara,
/// Maurini & De Lorenzis, Int. J. Fract. 247 (2024) 291, doi:10.1007/s10704-024-00782-4).
/// ```
/// use fem::{ElasticPoint, ElasticResponse, EnergySplit, Fracture, Material, PhaseField, Scalar};
///
/// #[derive(Debug)]
/// struct StarConvex {
///     gamma: f64,
/// }
///
/// impl EnergySplit for StarConvex {
///     #[inline(always)]
///     fn spared<T: Scalar>(&self, point: &ElasticPoint<T>) -> ElasticResponse<T> {
///         let trace = point.strain.log_volume();
///         let compressed = trace.less_than(trace.constant(0.0));
///         let factor = trace.constant(1.0 + self.gamma);
///         ElasticResponse::volumetric(point.volumetric).times(factor).only(compressed)
///     }
/// }
///
/// let matrix = Material::hencky(275.0, 0.25)
///     .with_fracture(Fracture::new(0.0025))
///     .with_split(StarConvex { gamma: 0.5 });
/// fem::assert_material(&matrix, Some(&PhaseField::new(0.06)));
/// ```
pub trait EnergySplit: Debug + Send + Sync + 'static {
    /// Returns ψ⁻ with its stress and tangent. Write `#[inline(always)]`, so that the function is compiled with
    /// vector instructions.
    fn spared<T: Scalar>(&self, point: &ElasticPoint<T>) -> ElasticResponse<T>;
}

/// Undamaged state of a point: the input of an [`EnergySplit`].
#[derive(Clone, Copy, Debug)]
pub struct ElasticPoint<T> {
    /// Principal strains.
    pub strain: PrincipalStrain<T>,
    /// x coth x with x = ε_i − ε_j; entry k belongs to the pair (i, j) of the other two strains.
    pub coth: [T; 3],
    /// Response without damage.
    pub response: ElasticResponse<T>,
    /// U, U′ and U″ (MPa): the energy of a pure change of volume with the same tr ε as the point, and the derivatives
    /// of this energy with respect to tr ε.
    pub volumetric: [T; 3],
    /// Bulk and shear modulus at small strain, MPa.
    pub moduli: [T; 2],
}

impl<T: Scalar> ElasticPoint<T> {
    #[inline(always)]
    pub(in crate::material) fn new(
        strains: &Strains<T>,
        response: ElasticResponse<T>,
        volumetric: [T; 3],
        moduli: [T; 2],
    ) -> Self {
        let strain = PrincipalStrain::with_excess(strains.log, strains.excess);
        Self { strain, coth: strains.coth, response, volumetric, moduli }
    }
}

/// User-defined split, as stored in [`Material::split`](crate::Material::split).
///
/// Clones share the split; two values are equal if they share the same split.
#[derive(Clone, Debug, PartialEq)]
pub struct UserSplit(OverScalars<Splits>);

impl UserSplit {
    /// Stores a split.
    pub fn new(split: impl EnergySplit) -> Self {
        Self(OverScalars::new(split))
    }

    #[inline(always)]
    pub(super) fn spared<T: Scalar>(&self, point: &ElasticPoint<T>) -> ElasticResponse<T> {
        self.0.over::<T>().spared_part(point)
    }
}

/// [`Family`] of the user-defined splits.
struct Splits;

impl Family for Splits {
    type Over<T: Scalar> = dyn SparedPart<T>;
}

impl<L: EnergySplit> MemberOf<Splits> for L {
    fn over<T: Scalar>(self: Arc<Self>) -> Arc<dyn SparedPart<T>> {
        self
    }
}

/// Object-safe interface to a split.
trait SparedPart<T: Scalar>: Debug + Send + Sync {
    fn spared_part(&self, point: &ElasticPoint<T>) -> ElasticResponse<T>;
}

impl<T: Scalar, L: EnergySplit> SparedPart<T> for L {
    fn spared_part(&self, point: &ElasticPoint<T>) -> ElasticResponse<T> {
        point.coth[0].vectorize(Spared { split: self, point })
    }
}

/// Evaluation of a split, compiled with the processor instructions (such as AVX2) for the number
/// type `T`.
struct Spared<'a, T, L> {
    split: &'a L,
    point: &'a ElasticPoint<T>,
}

impl<T: Scalar, L: EnergySplit> Computation for Spared<'_, T, L> {
    type Output = ElasticResponse<T>;

    #[inline(always)]
    fn run(self) -> ElasticResponse<T> {
        self.split.spared(self.point)
    }
}
