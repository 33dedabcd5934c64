//! Quantities of interest of a curve, and their names in cases, tables and figures.

use std::borrow::Cow;
use std::fmt;

use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};

/// Quantity of interest of a curve, which a calibration can compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Slope of the rising branch in N/mm.
    Slope,
    /// Peak force in N.
    PeakForce,
    /// Displacement at the peak force in mm.
    DisplacementAtPeak,
    /// Work of the force up to the peak in N mm.
    EnergyToPeak,
    /// Slope of the falling branch in N/mm, negative if the force falls. It is the slope of the least-squares line
    /// through the curve from 1.1 to 1.3 times the displacement at peak.
    PostPeakSlope,
    /// Shape of the curve: force at a percentage of the displacement at peak, from 1 to 199, divided by the peak force.
    RelativeForce(u8),
    /// Force in N at a displacement in µm. Names and tables state this displacement in mm.
    ForceAt(u32),
}

/// Names of the quantities in a case. The last two represent any percentage and any whole number of µm.
const NAMES: [&str; 7] = [
    "slope",
    "peak-force",
    "displacement-at-peak",
    "energy-to-peak",
    "post-peak-slope",
    "force-at-50-percent",
    "force-at-0.05-mm",
];

impl Quantity {
    /// Quantities without a percentage or a displacement.
    pub const SCALARS: [Self; 5] = [
        Self::Slope,
        Self::PeakForce,
        Self::DisplacementAtPeak,
        Self::EnergyToPeak,
        Self::PostPeakSlope,
    ];

    /// Quantities that the paper calibrates against.
    pub const OF_THE_PAPER: [Self; 3] = [Self::Slope, Self::PeakForce, Self::DisplacementAtPeak];

    /// Largest percentage of [`Self::RelativeForce`].
    pub const LARGEST_PERCENT: u8 = 199;

    /// Middle of the window of the slope past the peak, divided by the displacement at peak.
    pub const POST_PEAK: f64 = 1.2;

    /// Quantities that describe a whole curve: peak force, displacement at peak, and the shape at these percentages of
    /// the displacement at peak.
    pub fn of_curve(percent: &[u8]) -> Vec<Self> {
        let shape = percent.iter().map(|&percent| Self::RelativeForce(percent));
        [Self::PeakForce, Self::DisplacementAtPeak].into_iter().chain(shape).collect()
    }

    /// Name with unit, used for the columns of tables and the outputs of surrogates.
    pub fn column(self) -> Cow<'static, str> {
        match self {
            Self::Slope => "slope_N_per_mm".into(),
            Self::PeakForce => "peak_force_N".into(),
            Self::DisplacementAtPeak => "displacement_at_peak_mm".into(),
            Self::EnergyToPeak => "energy_to_peak_N_mm".into(),
            Self::PostPeakSlope => "post_peak_slope_N_per_mm".into(),
            Self::RelativeForce(percent) => format!("relative_force_at_{percent}_percent").into(),
            Self::ForceAt(place_um) => format!("force_at_{}_mm_N", mm(place_um)).into(),
        }
    }

    /// Returns the quantity with this column name.
    pub fn of_column(column: &str) -> Option<Self> {
        let shape = || of_percentage(column.strip_prefix("relative_force_at_")?);
        let force = || of_displacement(column.strip_prefix("force_at_")?.strip_suffix("_N")?);
        let scalar = Self::SCALARS.into_iter().find(|quantity| quantity.column() == column);
        scalar.or_else(shape).or_else(force)
    }

    /// Unit of the quantity; `1` if it is dimensionless.
    pub fn unit(self) -> &'static str {
        match self {
            Self::Slope | Self::PostPeakSlope => "N/mm",
            Self::PeakForce | Self::ForceAt(_) => "N",
            Self::DisplacementAtPeak => "mm",
            Self::EnergyToPeak => "N mm",
            Self::RelativeForce(_) => "1",
        }
    }

    /// Displacement that a curve must reach, divided by the displacement at peak. `None` if the quantity is taken up to
    /// the peak or at a fixed displacement.
    pub fn reach(self) -> Option<f64> {
        match self {
            Self::PostPeakSlope => Some(1.3),
            Self::RelativeForce(percent) => {
                Some(0.01 * f64::from(percent)).filter(|&reach| reach > 1.0)
            }
            _ => None,
        }
    }

    /// Returns the quantity with this name in a case. Words may also be joined by `_`.
    fn named(name: &str) -> Option<Self> {
        let name = &name.replace('_', "-");
        let at = || {
            let place = name.strip_prefix("force-at-")?.replace('-', "_");
            of_percentage(&place).or_else(|| of_displacement(&place))
        };
        let scalar = NAMES.iter().zip(Self::SCALARS).find(|(own, _)| *own == name);
        scalar.map(|(_, quantity)| quantity).or_else(at)
    }

    /// Name and unit for figures.
    pub fn label(self) -> Cow<'static, str> {
        match self {
            Self::Slope => "initial slope (N/mm)".into(),
            Self::PeakForce => "peak force (N)".into(),
            Self::DisplacementAtPeak => "displacement at peak (mm)".into(),
            Self::EnergyToPeak => "energy to the peak (N mm)".into(),
            Self::PostPeakSlope => "slope past the peak (N/mm)".into(),
            Self::RelativeForce(percent) => {
                format!("force at {percent} % of the displacement at peak / peak force").into()
            }
            Self::ForceAt(place_um) => format!("force at {} mm (N)", mm(place_um)).into(),
        }
    }
}

/// Converts a displacement from µm to mm.
fn mm(place_um: u32) -> f64 {
    f64::from(place_um) / 1000.0
}

/// Parses a percentage such as `50_percent` as a relative force.
fn of_percentage(words: &str) -> Option<Quantity> {
    let percent: u8 = words.strip_suffix("_percent")?.parse().ok()?;
    (1..=Quantity::LARGEST_PERCENT).contains(&percent).then_some(Quantity::RelativeForce(percent))
}

/// Parses a displacement such as `0.05_mm`, a whole number of µm, as a force at this displacement.
fn of_displacement(words: &str) -> Option<Quantity> {
    let place_um = 1000.0 * words.strip_suffix("_mm")?.parse::<f64>().ok()?;
    let whole = place_um.round();
    let is_whole = (1.0..=f64::from(u32::MAX)).contains(&whole) && (place_um - whole).abs() < 1e-6;
    is_whole.then_some(Quantity::ForceAt(whole as u32))
}

impl fmt::Display for Quantity {
    /// Writes the name of the quantity in a case.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slope => f.write_str(NAMES[0]),
            Self::PeakForce => f.write_str(NAMES[1]),
            Self::DisplacementAtPeak => f.write_str(NAMES[2]),
            Self::EnergyToPeak => f.write_str(NAMES[3]),
            Self::PostPeakSlope => f.write_str(NAMES[4]),
            Self::RelativeForce(percent) => write!(f, "force-at-{percent}-percent"),
            Self::ForceAt(place_um) => write!(f, "force-at-{}-mm", mm(*place_um)),
        }
    }
}

impl Serialize for Quantity {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_str(self)
    }
}

impl<'de> Deserialize<'de> for Quantity {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        let name = String::deserialize(deserializer)?;
        Self::named(&name).ok_or_else(|| D::Error::unknown_variant(&name, &NAMES))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_known_by_their_columns_and_by_their_names_in_a_case() {
        let shape = [1, 50, 199].map(Quantity::RelativeForce);
        let forces = [1, 50, 1234, 12_000, u32::MAX].map(Quantity::ForceAt);
        for quantity in Quantity::SCALARS.into_iter().chain(shape).chain(forces) {
            assert_eq!(Quantity::of_column(&quantity.column()), Some(quantity));
            let name = toml::Value::try_from(quantity).unwrap();
            assert_eq!(name.as_str(), Some(quantity.to_string().as_str()));
            assert_eq!(name.try_into::<Quantity>().unwrap(), quantity);
            let label = quantity.label();
            let unit = label.split_once(" (").map_or("1", |(_, unit)| unit.trim_end_matches(')'));
            assert_eq!(quantity.unit(), unit);
        }
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>();
        assert_eq!(named("energy_to_peak").unwrap(), Quantity::EnergyToPeak);
        assert_eq!(named("force-at-0.050-mm").unwrap(), Quantity::ForceAt(50));
        for column in [
            "colour",
            "relative_force_at_0_percent",
            "relative_force_at_200_percent",
            "force_at_0_mm_N",
            "force_at_0.0005_mm_N",
            "force_at_-1_mm_N",
            "force_at_NaN_mm_N",
        ] {
            assert_eq!(Quantity::of_column(column), None, "{column}");
        }
        for name in ["force-at-500-percent", "force-at-1e30-mm", "force-at-inf-mm"] {
            let error = named(name).unwrap_err().to_string();
            assert!(error.contains("force-at-50-percent"), "{error}");
        }
    }
}
