//! Parameters of finite-strain plasticity.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::hardening::{Hardening, PlasticRate};
use crate::error::FemError;

/// Plasticity of Hencky's law in logarithmic strains, with isotropic hardening.
///
/// Yield stress σ_y = Y₀ r + h(α), where Y₀ is the initial yield stress, r the factor of the rate, h the hardening and
/// α the equivalent plastic strain. The yield condition is written in Kirchhoff stress τ.
///
/// Reference: Simo, Comput. Methods Appl. Mech. Engrg. 99 (1992) 61, doi:10.1016/0045-7825(92)90123-2.
///
/// # Example
/// ```
/// use fem::{Hardening, Material, Plasticity};
///
/// let hardening = Hardening::Voce { saturation_mpa: 1101.0, rate: 1.95 };
/// let steel = Material::hencky(199_950.0, 0.27)
///     .with_plasticity(Plasticity { hardening, ..Plasticity::new(233.2) });
/// assert!(steel.validate("steel", None).is_ok());
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Plasticity {
    /// Yield criterion.
    #[serde(default)]
    pub criterion: YieldCriterion,
    /// Initial yield stress Y₀, MPa; for [`YieldCriterion::DruckerPrager`], the initial cohesion.
    pub yield_mpa: f64,
    /// Hardening h(α).
    #[serde(default)]
    pub hardening: Hardening,
    /// Dependence of the factor r on the rate of plastic strain; `None`: r = 1.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub rate: Option<PlasticRate>,
}

/// Condition at which a material yields.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum YieldCriterion {
    /// Von Mises: √(3/2) |dev τ| ≤ σ_y. α̇ is √(2/3) times the norm of the rate of plastic strain.
    #[default]
    J2,
    /// Drucker and Prager: √(½) |dev τ| + η p ≤ ξ c with the mean stress p = tr τ/3 and the cohesion c = σ_y. η and ξ
    /// follow from the friction angle by the outer cone through the compressive corners of Mohr and Coulomb.
    #[serde(rename_all = "snake_case")]
    DruckerPrager {
        /// Friction angle, degrees, in [0, 90).
        #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
        friction_deg: f64,
        /// Dilatancy angle, degrees, from zero to the friction angle; plastic flow is associated if both are equal.
        #[schemars(extend("minimum" = 0, "exclusiveMaximum" = 90))]
        dilatancy_deg: f64,
    },
}

impl YieldCriterion {
    /// Returns η, η̄ and ξ of the cone: factor of the mean stress in the yield condition, factor of the mean stress in
    /// the flow potential, factor of the cohesion. J2 is the cone (0, 0, 1/√3).
    ///
    /// Reference: de Souza Neto, Perić & Owen, Computational Methods for Plasticity (2008), section 6.4.4.
    pub fn cone(&self) -> [f64; 3] {
        match *self {
            Self::J2 => [0.0, 0.0, 1.0 / 3f64.sqrt()],
            Self::DruckerPrager { friction_deg, dilatancy_deg } => {
                let [friction, dilatancy] = [friction_deg, dilatancy_deg].map(f64::to_radians);
                let slope = |angle: f64| 6.0 * angle.sin() / (3f64.sqrt() * (3.0 - angle.sin()));
                let cohesion = 6.0 * friction.cos() / (3f64.sqrt() * (3.0 - friction.sin()));
                [slope(friction), slope(dilatancy), cohesion]
            }
        }
    }
}

impl Plasticity {
    /// Creates J2 plasticity without hardening from the yield stress in MPa.
    pub fn new(yield_mpa: f64) -> Self {
        Self { criterion: YieldCriterion::J2, yield_mpa, hardening: Hardening::None, rate: None }
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the key.
    pub fn validate(&self, entity: &str) -> Result<(), FemError> {
        let entity = format!("{entity}.plastic");
        if !(self.yield_mpa > 0.0 && self.yield_mpa <= 1e6) {
            let requirement = "a positive stress in MPa, at most 1e6";
            return Err(FemError::parameter(&entity, "yield_mpa", self.yield_mpa, requirement));
        }
        if let YieldCriterion::DruckerPrager { friction_deg, dilatancy_deg } = self.criterion {
            for (field, angle) in [("friction_deg", friction_deg), ("dilatancy_deg", dilatancy_deg)]
            {
                if !(0.0..90.0).contains(&angle) {
                    let requirement = "an angle in degrees, in [0, 90)";
                    return Err(FemError::parameter(&entity, field, angle, requirement));
                }
            }
            if dilatancy_deg == 0.0 && friction_deg > 0.0 {
                let requirement = "positive: without dilatancy the apex of the cone has no flow";
                let entity = &entity;
                return Err(FemError::parameter(
                    entity,
                    "dilatancy_deg",
                    dilatancy_deg,
                    requirement,
                ));
            }
            if dilatancy_deg > friction_deg {
                let requirement = "at most friction_deg: the flow would produce energy";
                return Err(FemError::parameter(
                    &entity,
                    "dilatancy_deg",
                    dilatancy_deg,
                    requirement,
                ));
            }
        }
        self.hardening.validate(&entity)?;
        self.rate.map_or(Ok(()), |rate| rate.validate(&entity))
    }
}
