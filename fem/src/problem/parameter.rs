//! Material parameters with respect to which the force is differentiated.

use std::convert::Infallible;

use crate::error::{FemError, Unsupported};
use crate::material::{Material, PhaseField};

/// Material parameter for sensitivities of the force, defined by the materials below and above its value.
///
/// The parameter may be any number in any region, or in several regions: e.g. a modulus of a user-defined law, or a
/// toughness shared by two regions. Only the equations at a quadrature point are differenced, never a whole run; the
/// derivative is exact for parameters that occur linearly, such as E, Gc and ξ.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialParameter {
    /// Name with unit. The column of the curve file is `d_force_d_<name>`.
    pub name: String,
    /// Materials, by region, for a value below that of the problem.
    pub below: Vec<Material>,
    /// Materials, by region, for a value above that of the problem.
    pub above: Vec<Material>,
    /// Difference of the parameter between `above` and `below`.
    pub width: f64,
}

/// Step of the central difference, relative to the value of the parameter. With this step, the truncation error and
/// the rounding error are both below 1e-8 of the derivative.
const REACH: f64 = 1e-4;

impl MaterialParameter {
    /// Creates a parameter with this value. `materials` returns the materials of all regions for a value near it.
    ///
    /// If the value is zero, the derivative is one-sided, from above; `materials` is called with 0 and 1e-4.
    pub fn new(
        name: impl Into<String>,
        value: f64,
        materials: impl Fn(f64) -> Vec<Material>,
    ) -> Self {
        let Ok(parameter) = Self::try_new(name, value, |x| Ok::<_, Infallible>(materials(x)));
        parameter
    }

    /// Like [`new`](Self::new), for a function that can fail.
    ///
    /// # Errors
    /// Errors of `materials`.
    pub fn try_new<E>(
        name: impl Into<String>,
        value: f64,
        materials: impl Fn(f64) -> Result<Vec<Material>, E>,
    ) -> Result<Self, E> {
        let reach = REACH * value.abs();
        let [low, high] = if reach > 0.0 { [value - reach, value + reach] } else { [0.0, REACH] };
        let (below, above) = (materials(low)?, materials(high)?);
        Ok(Self { name: name.into(), below, above, width: high - low })
    }

    /// Checks that the materials of the problem lie between the two sides.
    ///
    /// # Errors
    /// As [`Problem::with_sensitivities`](crate::Problem::with_sensitivities).
    pub(super) fn validate(
        &self,
        regions: &[String],
        materials: &[Material],
        field: Option<&PhaseField>,
    ) -> Result<(), FemError> {
        let entity = || format!("sensitivities: parameter '{}'", self.name);
        let refused = |reason| Err(FemError::unsupported(entity(), reason));
        if !(self.width > 0.0 && self.width.is_finite()) {
            let requirement = "positive: what the parameter has more above than below";
            return Err(FemError::parameter(&entity(), "width", self.width, requirement));
        }
        for side in [&self.below, &self.above] {
            if side.len() != materials.len() {
                let (materials, regions) = (side.len(), materials.len());
                return refused(Unsupported::ParameterRegions { materials, regions });
            }
            for (region, material) in regions.iter().zip(side) {
                material.validate(region, field)?;
            }
        }
        let sides = self.below.iter().zip(&self.above).zip(materials).zip(regions);
        for (((below, above), at), region) in sides {
            let kinds = [below, above, at].map(|m| std::mem::discriminant(&m.elasticity));
            let broken = [below, above, at].map(|m| m.fracture.is_some());
            if kinds != [kinds[2]; 3] || broken != [broken[2]; 3] {
                return refused(Unsupported::ParameterKind(region.clone()));
            }
            for ((below, above), at) in
                numbers(below).into_iter().zip(numbers(above)).zip(numbers(at))
            {
                let slack = 1e-9 * at.abs();
                if at < below.min(above) - slack || at > below.max(above) + slack {
                    let (region, value) = (region.clone(), at);
                    return refused(Unsupported::ParameterSides { region, below, above, value });
                }
            }
        }
        Ok(())
    }
}

/// Returns the parameters of a material that can be compared as numbers.
fn numbers(material: &Material) -> [f64; 5] {
    let elasticity = &material.elasticity;
    let [toughness, viscosity, residual] = material
        .fracture
        .map_or([0.0; 3], |f| [f.toughness_n_per_mm, f.viscosity_mpa_s, f.residual_stiffness]);
    [elasticity.young_mpa(), elasticity.poisson(), toughness, viscosity, residual]
}
