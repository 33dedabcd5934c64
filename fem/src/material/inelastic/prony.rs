//! Parameters of finite linear viscoelasticity: Prony series and time–temperature shift.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::FemError;

/// Viscoelasticity of an elastic law by Prony series.
///
/// The shear modulus relaxes as G(t) = G₀ (γ_∞ + Σ γ_i e^(−t/τ_i)) with γ_∞ = 1 − Σ γ_i, and the bulk modulus
/// likewise. At finite strain the deviatoric second Piola–Kirchhoff stress relaxes in the material frame, so that the
/// law is objective. The elastic law must be a sum of a function of the volume and a function of the isochoric
/// strain (Hencky, Mooney–Rivlin, Ogden).
///
/// Reference: Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153, doi:10.1016/0045-7825(87)90107-1.
///
/// # Example
/// ```
/// use fem::{Material, PronyTerm, Viscoelasticity};
///
/// let series = Viscoelasticity::shear([PronyTerm { fraction: 0.3, time_s: 0.1 }]);
/// assert_eq!(series.relaxed_shear(0.0), 1.0);
/// assert!((series.relaxed_shear(1e3) - 0.7).abs() < 1e-12);
/// let binder = Material::hencky(275.0, 0.25).with_viscoelasticity(series);
/// assert!(binder.validate("binder", None).is_ok());
/// ```
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct Viscoelasticity {
    /// Whether the moduli of the elastic law are the instantaneous or the long-term moduli.
    pub moduli: PronyModuli,
    /// Prony terms of the shear modulus.
    pub shear: Vec<PronyTerm>,
    /// Prony terms of the bulk modulus.
    pub bulk: Vec<PronyTerm>,
    /// Shift of the relaxation times with the temperature.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shift: Option<TimeShift>,
}

/// The time to which the moduli of an elastic law with Prony series refer.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum PronyModuli {
    /// The moduli at time zero.
    #[default]
    Instantaneous,
    /// The elastic law has the moduli after infinite time.
    LongTerm,
}

/// One term of a Prony series.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PronyTerm {
    /// Fraction γ of the instantaneous modulus, in (0, 1).
    #[schemars(extend("exclusiveMinimum" = 0, "exclusiveMaximum" = 1))]
    pub fraction: f64,
    /// Relaxation time τ at the reference temperature, s.
    #[schemars(extend("exclusiveMinimum" = 0))]
    pub time_s: f64,
}

/// Shift of relaxation times with the temperature: the time at temperature T is a_T times the time at the reference
/// temperature T₀.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum TimeShift {
    /// Williams, Landel and Ferry: log₁₀ a_T = −C₁ (T − T₀)/(C₂ + T − T₀).
    #[serde(rename_all = "snake_case")]
    Wlf {
        /// Constant C₁, dimensionless.
        c1: f64,
        /// Constant C₂, K.
        c2_kelvin: f64,
        /// Reference temperature T₀, °C.
        #[schemars(extend("exclusiveMinimum" = -273.15))]
        reference_celsius: f64,
    },
    /// Arrhenius: ln a_T = (E/R) (1/T − 1/T₀) with absolute temperatures.
    #[serde(rename_all = "snake_case")]
    Arrhenius {
        /// Activation energy E, kJ/mol.
        energy_kj_per_mol: f64,
        /// Reference temperature T₀, °C.
        #[schemars(extend("exclusiveMinimum" = -273.15))]
        reference_celsius: f64,
    },
}

/// Smallest fraction of the instantaneous modulus that remains. It is a difference of numbers near 1, whose rounding error
/// is about 1e-16.
const LEAST_REST: f64 = 1e-9;
/// Smallest fraction that remains if the moduli of the elastic law are the long-term moduli: the instantaneous moduli are
/// then at most a million times as large.
const LEAST_REST_OF_LONG_TERM: f64 = 1e-6;
/// Gas constant R, kJ/(mol K).
const GAS_CONSTANT: f64 = 8.314_462_618e-3;
/// Absolute temperature of 0 °C, K.
const ZERO_CELSIUS: f64 = 273.15;

impl TimeShift {
    /// Returns the factor a_T of the relaxation times at a temperature in °C.
    pub fn factor(&self, celsius: f64) -> f64 {
        match *self {
            Self::Wlf { c1, c2_kelvin, reference_celsius } => {
                let above = celsius - reference_celsius;
                10f64.powf(-c1 * above / (c2_kelvin + above))
            }
            Self::Arrhenius { energy_kj_per_mol, reference_celsius } => {
                let [at, reference] = [celsius, reference_celsius].map(|t| t + ZERO_CELSIUS);
                (energy_kj_per_mol / GAS_CONSTANT * (1.0 / at - 1.0 / reference)).exp()
            }
        }
    }

    /// Checks that the reference temperature is above absolute zero.
    fn validate_reference(&self, entity: &str) -> Result<(), FemError> {
        let (Self::Wlf { reference_celsius, .. } | Self::Arrhenius { reference_celsius, .. }) =
            *self;
        if reference_celsius > -ZERO_CELSIUS && reference_celsius.is_finite() {
            return Ok(());
        }
        let requirement = "a temperature in °C above absolute zero, -273.15";
        Err(FemError::parameter(entity, "reference_celsius", reference_celsius, requirement))
    }

    /// Checks that the reference temperature is above absolute zero, that the factor at a temperature in °C is positive
    /// and finite, and that WLF is above its singularity.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`].
    pub fn validate(&self, entity: &str, celsius: f64) -> Result<(), FemError> {
        self.validate_reference(entity)?;
        let refuse =
            |field, value, requirement| Err(FemError::parameter(entity, field, value, requirement));
        if let Self::Wlf { c2_kelvin, reference_celsius, .. } = *self
            && c2_kelvin + celsius - reference_celsius <= 0.0
        {
            let requirement = "above the reference temperature minus c2_kelvin, where WLF is valid";
            return refuse("temperature_celsius", celsius, requirement);
        }
        let factor = self.factor(celsius);
        if !(factor > 0.0 && factor.is_finite() && celsius > -ZERO_CELSIUS) {
            let requirement = "a temperature in °C whose time shift is positive and finite";
            return refuse("temperature_celsius", celsius, requirement);
        }
        Ok(())
    }
}

impl Viscoelasticity {
    /// Creates a series of the shear modulus alone. The moduli of the elastic law are the instantaneous moduli.
    pub fn shear(terms: impl IntoIterator<Item = PronyTerm>) -> Self {
        Self { shear: terms.into_iter().collect(), ..Self::default() }
    }

    /// Returns the series with the relaxation times at a temperature in °C, and without a shift.
    pub fn at_temperature(mut self, celsius: f64) -> Self {
        if let Some(shift) = self.shift.take() {
            let factor = shift.factor(celsius);
            let terms = self.shear.iter_mut().chain(&mut self.bulk);
            terms.for_each(|term| term.time_s *= factor);
        }
        self
    }

    /// Returns G(t)/G₀ at a time in s after a jump of the strain.
    pub fn relaxed_shear(&self, time_s: f64) -> f64 {
        relaxed(&self.shear, time_s)
    }

    /// Returns K(t)/K₀ at a time in s after a jump of the strain.
    pub fn relaxed_bulk(&self, time_s: f64) -> f64 {
        relaxed(&self.bulk, time_s)
    }

    /// Returns storage and loss modulus of shear, G′/G₀ and G″/G₀, at an angular frequency in rad/s.
    pub fn dynamic_shear(&self, omega: f64) -> [f64; 2] {
        let mut moduli = [relaxed(&self.shear, f64::INFINITY), 0.0];
        for PronyTerm { fraction, time_s } in &self.shear {
            let x = omega * time_s;
            moduli[0] += fraction * x * x / (1.0 + x * x);
            moduli[1] += fraction * x / (1.0 + x * x);
        }
        moduli
    }

    /// Returns the ratios of the instantaneous moduli to the moduli of the elastic law: shear, then bulk.
    pub(in crate::material) fn instantaneous(&self) -> [f64; 2] {
        [&self.shear, &self.bulk].map(|terms| match self.moduli {
            PronyModuli::Instantaneous => 1.0,
            PronyModuli::LongTerm => 1.0 / relaxed(terms, f64::INFINITY),
        })
    }

    /// Returns the number of state values of a point. Shear: the elastic stress in the material frame (6 values), then
    /// 6 values per term. Bulk: the elastic pressure, then one value per term.
    pub fn state_len(&self) -> usize {
        let shear = if self.shear.is_empty() { 0 } else { 6 * (1 + self.shear.len()) };
        let bulk = if self.bulk.is_empty() { 0 } else { 1 + self.bulk.len() };
        shear + bulk
    }

    /// Checks fractions, relaxation times, the number of terms and the reference temperature of the shift.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the key.
    pub fn validate(&self, entity: &str) -> Result<(), FemError> {
        for (modulus, terms) in [("shear", &self.shear), ("bulk", &self.bulk)] {
            let entity = format!("{entity}.viscoelastic.{modulus}");
            let refuse = |field, value, requirement| {
                Err(FemError::parameter(&entity, field, value, requirement))
            };
            for PronyTerm { fraction, time_s } in terms {
                if !(*fraction > 0.0 && *fraction < 1.0) {
                    return refuse("fraction", *fraction, "in (0, 1): a fraction of the modulus");
                }
                if !(*time_s > 0.0 && time_s.is_finite()) {
                    return refuse("time_s", *time_s, "a positive relaxation time in s");
                }
            }
            let sum: f64 = terms.iter().map(|term| term.fraction).sum();
            let (least, requirement) = match self.moduli {
                PronyModuli::Instantaneous => (
                    LEAST_REST,
                    "at most 0.999999999 in sum: the long-term modulus must be positive",
                ),
                PronyModuli::LongTerm => (
                    LEAST_REST_OF_LONG_TERM,
                    "at most 0.999999 in sum: the instantaneous modulus is the long-term modulus divided by (1 - sum)",
                ),
            };
            if 1.0 - sum < least {
                return refuse("fraction", sum, requirement);
            }
        }
        if let Some(shift) = &self.shift {
            let table = match shift {
                TimeShift::Wlf { .. } => "wlf",
                TimeShift::Arrhenius { .. } => "arrhenius",
            };
            shift.validate_reference(&format!("{entity}.viscoelastic.shift.{table}"))?;
        }
        if self.state_len() > super::super::law::MOST_STATE {
            let terms = (self.shear.len() + self.bulk.len()) as f64;
            let requirement = "at most 14 terms of the shear modulus";
            return Err(FemError::parameter(entity, "viscoelastic", terms, requirement));
        }
        Ok(())
    }
}

/// Returns the fraction of a modulus that remains at a time in s after a jump of the strain.
fn relaxed(terms: &[PronyTerm], time_s: f64) -> f64 {
    let lost = terms.iter().map(|term| term.fraction * -(-time_s / term.time_s).exp_m1());
    1.0 - lost.sum::<f64>()
}
