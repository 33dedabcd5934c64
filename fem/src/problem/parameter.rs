//! Material parameters with respect to which the force is differentiated.

use std::convert::Infallible;

use crate::error::{FemError, Unsupported};
use crate::material::{Material, PhaseField};
use crate::problem::interface::{Interface, have_same_bands};

/// Material parameter for sensitivities of the force, defined by the materials and interfaces for a smaller and for a
/// larger value of the parameter.
///
/// The parameter may be any material constant of one or several regions, e.g. a modulus of a user-defined law, or a
/// toughness shared by two regions. Finite differences are taken only of the equations at a quadrature point, not of
/// the results of two runs. The derivative is exact for parameters that occur linearly in the equations, such as E, Gc
/// and ξ.
#[derive(Clone, Debug, PartialEq)]
pub struct MaterialParameter {
    /// Name with unit. The column of the curve file is `d_force_d_<name>`.
    pub name: String,
    /// Materials, by region, for a parameter value below the value of the problem.
    pub below: Vec<Material>,
    /// Materials, by region, for a parameter value above the value of the problem.
    pub above: Vec<Material>,
    /// Value of the parameter in `above` minus its value in `below`.
    pub width: f64,
    /// Interfaces for the smaller and for the larger value of the parameter; `None`: the interfaces
    /// of the problem.
    pub interfaces: Option<[Vec<Interface>; 2]>,
}

/// Step of the central difference, relative to the value of the parameter. With this step, the truncation error and
/// the rounding error are both below 1e-8 of the derivative.
const RELATIVE_STEP: f64 = 1e-4;

impl MaterialParameter {
    /// Creates a parameter with the value `value`. `materials` returns the materials of all regions for a parameter
    /// value near `value`.
    ///
    /// If `value` is zero, the derivative is one-sided, from above: `materials` is called with 0 and 1e-4.
    pub fn new(
        name: impl Into<String>,
        value: f64,
        materials: impl Fn(f64) -> Vec<Material>,
    ) -> Self {
        let Ok(parameter) = Self::try_new(name, value, |x| Ok::<_, Infallible>(materials(x)));
        parameter
    }

    /// Creates a parameter like [`new`](Self::new), from a function that can fail.
    ///
    /// # Errors
    /// The error that `materials` returns.
    pub fn try_new<E>(
        name: impl Into<String>,
        value: f64,
        materials: impl Fn(f64) -> Result<Vec<Material>, E>,
    ) -> Result<Self, E> {
        let with_none = |value| materials(value).map(|materials| (materials, Vec::new()));
        let parameter = Self::try_with_interfaces(name, value, with_none)?;
        Ok(Self { interfaces: None, ..parameter })
    }

    /// Creates a parameter like [`try_new`](Self::try_new), which changes interfaces too. `constants` returns the
    /// materials of all regions and the interfaces for a parameter value near `value`.
    ///
    /// # Errors
    /// The error that `constants` returns.
    pub fn try_with_interfaces<E>(
        name: impl Into<String>,
        value: f64,
        constants: impl Fn(f64) -> Result<(Vec<Material>, Vec<Interface>), E>,
    ) -> Result<Self, E> {
        let step = RELATIVE_STEP * value.abs();
        let [low, high] =
            if step > 0.0 { [value - step, value + step] } else { [0.0, RELATIVE_STEP] };
        let ((below, first), (above, second)) = (constants(low)?, constants(high)?);
        let (interfaces, width) = (Some([first, second]), high - low);
        Ok(Self { name: name.into(), below, above, width, interfaces })
    }

    /// Checks that `below` and `above` are valid materials of the same kinds as the materials of the problem, and that
    /// each constant of the problem lies between its values in `below` and `above`. Checks the interfaces in the same
    /// way.
    ///
    /// # Errors
    /// The errors of [`Problem::with_sensitivities`](crate::Problem::with_sensitivities).
    pub(super) fn validate(
        &self,
        regions: &[String],
        materials: &[Material],
        interfaces: &[Interface],
        field: Option<&PhaseField>,
    ) -> Result<(), FemError> {
        let entity = || format!("sensitivities: parameter '{}'", self.name);
        let refused = |reason| Err(FemError::unsupported(entity(), reason));
        if !(self.width > 0.0 && self.width.is_finite()) {
            let requirement =
                "positive: the parameter value in `above` minus the parameter value in `below`";
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
        for side in self.interfaces.iter().flatten() {
            if !have_same_bands(side, interfaces) {
                return refused(Unsupported::ParameterInterfaces);
            }
            side.iter().try_for_each(Interface::validate)?;
        }
        if let Some([below, above]) = &self.interfaces {
            for ((below, above), at) in below.iter().zip(above).zip(interfaces) {
                let [below, above, value] = [below, above, at].map(|i| i.toughness_n_per_mm);
                let slack = 1e-9 * value.abs();
                if value < below.min(above) - slack || value > below.max(above) + slack {
                    let region = at.regions.join("-");
                    return refused(Unsupported::ParameterSides { region, below, above, value });
                }
            }
        }
        let sides = self.below.iter().zip(&self.above).zip(materials).zip(regions);
        for (((below, above), at), region) in sides {
            let kinds = [below, above, at].map(|m| std::mem::discriminant(&m.elasticity));
            let broken = [below, above, at].map(|m| m.fracture.is_some());
            let states = [below, above, at].map(Material::state_len);
            if kinds != [kinds[2]; 3] || broken != [broken[2]; 3] || states != [states[2]; 3] {
                return refused(Unsupported::ParameterKind(region.clone()));
            }
            for ((below, above), at) in
                constants(below).into_iter().zip(constants(above)).zip(constants(at))
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

/// Returns E, ν, Gc, ξ and the residual stiffness of a material. For a material without fracture, the last three are
/// zero.
fn constants(material: &Material) -> [f64; 5] {
    let elasticity = &material.elasticity;
    let [toughness, viscosity, residual] = material
        .fracture
        .map_or([0.0; 3], |f| [f.toughness_n_per_mm, f.viscosity_mpa_s, f.residual_stiffness]);
    [elasticity.young_mpa(), elasticity.poisson(), toughness, viscosity, residual]
}
