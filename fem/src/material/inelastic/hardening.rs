//! Hardening of a plastic material: the yield stress as a function of plastic strain and its rate.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::error::FemError;
use crate::material::number::Scalar;

/// Isotropic hardening: the increase of the yield stress with the equivalent plastic strain α.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum Hardening {
    /// No hardening: perfect plasticity.
    #[default]
    None,
    /// Linear hardening h α.
    #[serde(rename_all = "snake_case")]
    Linear {
        /// Hardening modulus h, MPa.
        modulus_mpa: f64,
    },
    /// Voce: A (1 − e^(−b α)).
    #[serde(rename_all = "snake_case")]
    Voce {
        /// Stress A, at which the hardening saturates, MPa.
        saturation_mpa: f64,
        /// Rate b of the saturation, dimensionless.
        rate: f64,
    },
    /// Swift: k ((e₀ + α)ⁿ − e₀ⁿ).
    #[serde(rename_all = "snake_case")]
    Swift {
        /// Factor k, MPa.
        factor_mpa: f64,
        /// Strain offset e₀, positive.
        offset: f64,
        /// Exponent n, in (0, 1].
        exponent: f64,
    },
    /// Linear interpolation between the points of a table; the hardening is constant beyond the last point.
    Table(
        /// Points in increasing order of plastic strain. The first point has zero plastic strain and zero
        /// hardening.
        Vec<HardeningPoint>,
    ),
}

/// Point of a hardening table.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HardeningPoint {
    /// Equivalent plastic strain α.
    pub plastic_strain: f64,
    /// Increase of the yield stress, MPa.
    pub hardening_mpa: f64,
}

/// Dependence of the yield stress on the rate of plastic strain.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case", deny_unknown_fields)]
pub enum PlasticRate {
    /// Johnson and Cook: the initial yield stress is multiplied by 1 + C ln(α̇/ε̇₀) for a rate α̇ above ε̇₀.
    #[serde(rename_all = "snake_case")]
    JohnsonCook {
        /// Rate sensitivity C, dimensionless.
        #[schemars(range(min = 0))]
        c: f64,
        /// Reference rate ε̇₀, 1/s.
        #[schemars(extend("exclusiveMinimum" = 0))]
        reference_per_s: f64,
    },
}

impl Hardening {
    /// Returns the hardening, MPa, and its derivative with respect to α.
    #[inline(always)]
    pub(super) fn at<T: Scalar>(&self, alpha: T) -> [T; 2] {
        let zero = alpha.constant(0.0);
        match self {
            Self::None => [zero; 2],
            Self::Linear { modulus_mpa } => {
                let modulus = alpha.constant(*modulus_mpa);
                [modulus * alpha, modulus]
            }
            Self::Voce { saturation_mpa, rate } => {
                let change = (alpha * -rate).exp_m1();
                [change * -saturation_mpa, (change + 1.0) * (saturation_mpa * rate)]
            }
            Self::Swift { factor_mpa, offset, exponent } => {
                let strain = alpha + *offset;
                let power = strain.powf(*exponent) * *factor_mpa;
                [power - factor_mpa * offset.powf(*exponent), power * *exponent / strain]
            }
            Self::Table(table) => {
                let (mut stress, mut slope, mut before) = (zero, zero, 0.0);
                for ends in segments(table) {
                    // the slope changes at the first point of each segment
                    let above = alpha - ends[0].plastic_strain;
                    let change = slope_of(ends) - before;
                    before += change;
                    let behind = zero.less_than(above);
                    stress += T::select(behind, above * change, zero);
                    slope += T::select(behind, zero.constant(change), zero);
                }
                [stress, slope]
            }
        }
    }

    /// Returns the plastic work ∫ h dα of the hardening h, from zero to α, MPa.
    #[inline(always)]
    pub(super) fn work<T: Scalar>(&self, alpha: T) -> T {
        let zero = alpha.constant(0.0);
        match self {
            Self::None => zero,
            Self::Linear { modulus_mpa } => alpha * alpha * (0.5 * modulus_mpa),
            Self::Voce { saturation_mpa, rate } => {
                ((alpha * -rate).exp_m1() / *rate + alpha) * *saturation_mpa
            }
            Self::Swift { factor_mpa, offset, exponent } => {
                let next = exponent + 1.0;
                let powers = (alpha + *offset).powf(next) - offset.powf(next);
                powers * (factor_mpa / next) - alpha * (factor_mpa * offset.powf(*exponent))
            }
            Self::Table(table) => {
                let (mut work, mut before) = (zero, 0.0);
                for ends in segments(table) {
                    let above = (alpha - ends[0].plastic_strain).max(zero);
                    let change = slope_of(ends) - before;
                    before += change;
                    work += above * above * (0.5 * change);
                }
                work
            }
        }
    }

    /// Checks the constants.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the key.
    pub(super) fn validate(&self, entity: &str) -> Result<(), FemError> {
        let entity = format!("{entity}.hardening");
        let check = |holds: bool, field: &'static str, value: f64, requirement: &'static str| {
            if holds && value.is_finite() {
                Ok(())
            } else {
                Err(FemError::parameter(&entity, field, value, requirement))
            }
        };
        let not_negative = |field, value| {
            check(value >= 0.0, field, value, "zero or positive: softening needs a regularisation")
        };
        match self {
            Self::None => Ok(()),
            Self::Linear { modulus_mpa } => not_negative("modulus_mpa", *modulus_mpa),
            Self::Voce { saturation_mpa, rate } => {
                not_negative("saturation_mpa", *saturation_mpa)?;
                check(*rate > 0.0, "rate", *rate, "a positive number")
            }
            Self::Swift { factor_mpa, offset, exponent } => {
                not_negative("factor_mpa", *factor_mpa)?;
                check(*offset > 0.0, "offset", *offset, "a positive strain")?;
                let allowed = *exponent > 0.0 && *exponent <= 1.0;
                check(allowed, "exponent", *exponent, "in (0, 1]")
            }
            Self::Table(table) => {
                let first =
                    table.first().map_or([f64::NAN; 2], |p| [p.plastic_strain, p.hardening_mpa]);
                check(
                    first == [0.0; 2],
                    "table",
                    first[0],
                    "a table whose first point has the plastic strain zero",
                )?;
                for ends in table.windows(2) {
                    let strain = ends[1].plastic_strain;
                    check(
                        strain > ends[0].plastic_strain,
                        "plastic_strain",
                        strain,
                        "larger than in the row above",
                    )?;
                    let stress = ends[1].hardening_mpa;
                    check(
                        stress >= ends[0].hardening_mpa,
                        "hardening_mpa",
                        stress,
                        "at least the value of the row above: softening needs a regularisation",
                    )?;
                }
                Ok(())
            }
        }
    }
}

impl PlasticRate {
    /// Checks the constants.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] with the name of the key.
    pub(super) fn validate(&self, entity: &str) -> Result<(), FemError> {
        let Self::JohnsonCook { c, reference_per_s } = *self;
        let entity = format!("{entity}.rate.johnson-cook");
        let refuse = |field, value, requirement| {
            Err(FemError::parameter(&entity, field, value, requirement))
        };
        if !(c >= 0.0 && c.is_finite()) {
            return refuse("c", c, "zero or positive");
        }
        if !(reference_per_s > 0.0 && reference_per_s.is_finite()) {
            return refuse("reference_per_s", reference_per_s, "a positive rate in 1/s");
        }
        Ok(())
    }
}

/// Returns the two end points of each segment of a table. A last segment of zero width represents the constant
/// hardening beyond the table.
fn segments(table: &[HardeningPoint]) -> impl Iterator<Item = [HardeningPoint; 2]> + '_ {
    let last = table.last().map(|&point| [point; 2]);
    table.windows(2).map(|ends| [ends[0], ends[1]]).chain(last)
}

/// Returns the slope of a segment, MPa; zero for the last segment of zero width.
fn slope_of([start, end]: [HardeningPoint; 2]) -> f64 {
    let width = end.plastic_strain - start.plastic_strain;
    if width > 0.0 { (end.hardening_mpa - start.hardening_mpa) / width } else { 0.0 }
}
