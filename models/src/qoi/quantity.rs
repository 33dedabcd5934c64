//! The numbers of a curve that a case can name.

use std::fmt;
use std::sync::LazyLock;

use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};

/// A number of a curve that a calibration can compare.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quantity {
    /// Slope of the rising branch in N/mm.
    Slope,
    /// Peak force in N.
    PeakForce,
    /// Displacement at the peak force in mm.
    DisplacementAtPeak,
    /// Work of the force up to its peak in N mm.
    WorkToPeak,
    /// The force at a whole percentage of the displacement at peak, from 1 to 199, over the peak force:
    /// the shape of the curve.
    RelativeForce(u8),
}

/// What the quantities are called in a case, the last for any percentage.
const NAMES: [&str; 5] =
    ["slope", "peak-force", "displacement-at-peak", "work-to-peak", "force-at-50-percent"];

/// Column and label of the relative force at each percentage.
static RELATIVE_FORCES: LazyLock<Vec<[String; 2]>> = LazyLock::new(|| {
    let words = |percent: usize| {
        let label = format!("force at {percent} % of the displacement at peak / peak force");
        [format!("relative_force_at_{percent}_percent"), label]
    };
    (0..=usize::from(Quantity::LARGEST_PERCENT)).map(words).collect()
});

impl Quantity {
    /// Those that are not of the shape.
    pub const SCALARS: [Self; 4] =
        [Self::Slope, Self::PeakForce, Self::DisplacementAtPeak, Self::WorkToPeak];

    /// What the paper calibrates against.
    pub const OF_THE_PAPER: [Self; 3] = [Self::Slope, Self::PeakForce, Self::DisplacementAtPeak];

    /// The largest percentage of a relative force.
    pub const LARGEST_PERCENT: u8 = 199;

    /// A curve as a whole: its height, its width, and its shape at percentages of the width.
    pub fn of_curve(percent: &[u8]) -> Vec<Self> {
        let shape = percent.iter().map(|&percent| Self::RelativeForce(percent));
        [Self::PeakForce, Self::DisplacementAtPeak].into_iter().chain(shape).collect()
    }

    /// Name with unit: the column of every table, the output of every surrogate.
    pub fn column(self) -> &'static str {
        match self {
            Self::Slope => "slope_N_per_mm",
            Self::PeakForce => "peak_force_N",
            Self::DisplacementAtPeak => "displacement_at_peak_mm",
            Self::WorkToPeak => "work_to_peak_N_mm",
            Self::RelativeForce(percent) => &RELATIVE_FORCES[usize::from(percent)][0],
        }
    }

    /// The quantity of a column.
    pub fn of_column(column: &str) -> Option<Self> {
        let shape = column.strip_prefix("relative_force_at_").and_then(of_percentage);
        shape.or_else(|| Self::SCALARS.into_iter().find(|quantity| quantity.column() == column))
    }

    /// Its unit; 1 without one.
    pub fn unit(self) -> &'static str {
        self.label().split_once(" (").map_or("1", |(_, unit)| unit.trim_end_matches(')'))
    }

    /// The quantity that a case names so.
    fn named(name: &str) -> Option<Self> {
        let of_shape = || of_percentage(&name.strip_prefix("force-at-")?.replace('-', "_"));
        let scalar = NAMES.iter().zip(Self::SCALARS).find(|(own, _)| **own == name);
        scalar.map(|(_, quantity)| quantity).or_else(of_shape)
    }

    /// Name and unit for figures.
    pub(crate) fn label(self) -> &'static str {
        match self {
            Self::Slope => "initial slope (N/mm)",
            Self::PeakForce => "peak force (N)",
            Self::DisplacementAtPeak => "displacement at peak (mm)",
            Self::WorkToPeak => "work to the peak (N mm)",
            Self::RelativeForce(percent) => &RELATIVE_FORCES[usize::from(percent)][1],
        }
    }
}

/// The relative force at `50_percent`.
fn of_percentage(words: &str) -> Option<Quantity> {
    let percent: u8 = words.strip_suffix("_percent")?.parse().ok()?;
    (1..=Quantity::LARGEST_PERCENT).contains(&percent).then_some(Quantity::RelativeForce(percent))
}

impl fmt::Display for Quantity {
    /// As the case names it.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Slope => f.write_str(NAMES[0]),
            Self::PeakForce => f.write_str(NAMES[1]),
            Self::DisplacementAtPeak => f.write_str(NAMES[2]),
            Self::WorkToPeak => f.write_str(NAMES[3]),
            Self::RelativeForce(percent) => write!(f, "force-at-{percent}-percent"),
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
        for quantity in Quantity::SCALARS.into_iter().chain(shape) {
            assert_eq!(Quantity::of_column(quantity.column()), Some(quantity));
            let name = toml::Value::try_from(quantity).unwrap();
            assert_eq!(name.as_str(), Some(quantity.to_string().as_str()));
            assert_eq!(name.try_into::<Quantity>().unwrap(), quantity);
        }
        for column in ["colour", "relative_force_at_0_percent", "relative_force_at_200_percent"] {
            assert_eq!(Quantity::of_column(column), None);
        }
        let error = toml::Value::from("force-at-500-percent").try_into::<Quantity>().unwrap_err();
        assert!(error.to_string().contains("force-at-50-percent"), "{error}");
    }
}
