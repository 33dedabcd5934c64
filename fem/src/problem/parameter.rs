//! Parameters of the materials that the force is differentiated by.

use std::convert::Infallible;

use crate::error::FemError;
use crate::material::{Material, PhaseField};

/// A number of the materials by which the force is differentiated, given by the materials on either
/// side of its value.
///
/// It may be any number and stand in any region, in several of them too: a modulus of a law of one's
/// own as well as a toughness that two regions share. Only the equations at a point are read on either
/// side, never a run: what they are linear in, as E, Gc and ξ, is differentiated exactly.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialParameter {
    /// Its name, with its unit: a column of the curve file is `d_force_d_<name>`.
    pub name: String,
    /// The materials below its value, by region.
    pub below: Vec<Material>,
    /// Those above it.
    pub above: Vec<Material>,
    /// The difference of the parameter between them.
    pub width: f64,
}

/// Half of the difference between the two sides, relative to the value: what is left out is below
/// 1e-8 of the derivative, and so is round-off.
const REACH: f64 = 1e-4;

impl MaterialParameter {
    /// A parameter of this value; `materials` gives those of all regions for a value near it.
    ///
    /// At zero the derivative is that from above, for which `materials` is asked for 1e-4.
    pub fn new(
        name: impl Into<String>,
        value: f64,
        materials: impl Fn(f64) -> Vec<Material>,
    ) -> Self {
        let Ok(parameter) = Self::try_new(name, value, |x| Ok::<_, Infallible>(materials(x)));
        parameter
    }

    /// The same where a value may make no material.
    ///
    /// # Errors
    /// Those of `materials`.
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

    /// Refuses what is no neighbourhood of the materials of a problem.
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
        let refused =
            |message: String, help: &str| Err(FemError::unsupported(entity(), message, help));
        if !(self.width > 0.0 && self.width.is_finite()) {
            let requirement = "positive: what the parameter has more above than below";
            return Err(FemError::parameter(&entity(), "width", self.width, requirement));
        }
        for side in [&self.below, &self.above] {
            if side.len() != materials.len() {
                let message = format!("{} materials for {} regions", side.len(), materials.len());
                return refused(message, "give one material to each region, in their order");
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
                let message =
                    format!("region '{region}' has another law on one side, or a toughness");
                return refused(message, "move a number of the materials, and nothing else");
            }
            for ((below, above), at) in
                numbers(below).into_iter().zip(numbers(above)).zip(numbers(at))
            {
                let slack = 1e-9 * at.abs();
                if at < below.min(above) - slack || at > below.max(above) + slack {
                    let message = format!(
                        "region '{region}' has {below} and {above} on its two sides, the problem {at}"
                    );
                    return refused(
                        message,
                        "build the parameter around the materials of the problem",
                    );
                }
            }
        }
        Ok(())
    }
}

/// What can be told of a material by numbers.
fn numbers(material: &Material) -> [f64; 5] {
    let elasticity = &material.elasticity;
    let [toughness, viscosity, residual] = material
        .fracture
        .map_or([0.0; 3], |f| [f.toughness_n_per_mm, f.viscosity_mpa_s, f.residual_stiffness]);
    [elasticity.young_mpa(), elasticity.poisson(), toughness, viscosity, residual]
}
