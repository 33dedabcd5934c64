//! A chosen quantity of interest, and the registry that finds it by its name in a case or its column in a table.

use std::borrow::Cow;
use std::fmt;
use std::ops::Deref;
use std::sync::{Arc, OnceLock};

use schemars::{JsonSchema, Schema, SchemaGenerator, json_schema};
use serde::de::{Deserializer, Error};
use serde::{Deserialize, Serialize, Serializer};

use super::creep_displacement::CreepDisplacement;
use super::definition::Qoi;
use super::displacement_at_peak::DisplacementAtPeak;
use super::energy_to_peak::EnergyToPeak;
use super::force_at::ForceAt;
use super::force_at_time::{DisplacementAtTime, ForceAtTime};
use super::hysteresis_energy::HysteresisEnergy;
use super::peak_force::PeakForce;
use super::post_peak_slope::PostPeakSlope;
use super::relative_force::RelativeForce;
use super::relaxed_fraction::RelaxedFraction;
use super::slope::Slope;
use super::table_column::TableColumn;
use super::unit::Unit;
use super::unloading_slope::UnloadingSlope;

/// A quantity of interest that a calibration compares. Clones share the quantity; two values are equal if their names
/// are equal.
#[derive(Clone)]
pub struct Quantity {
    name: Arc<str>,
    qoi: Arc<dyn Qoi>,
}

impl Quantity {
    pub fn new(qoi: impl Qoi) -> Self {
        Self { name: qoi.name().into(), qoi: Arc::new(qoi) }
    }

    /// Returns the quantities with which the paper calibrates.
    pub fn of_the_paper() -> [Self; 3] {
        [Self::new(Slope), Self::new(PeakForce), Self::new(DisplacementAtPeak)]
    }

    /// Returns quantities that describe a whole curve: peak force, displacement at peak, and the shape at these
    /// percentages of the displacement at peak. Percentages outside 1 to 199 are omitted.
    pub fn of_curve(percent: &[u8]) -> Vec<Self> {
        let shape = percent.iter().filter_map(|&percent| RelativeForce::new(percent));
        let size = [Self::new(PeakForce), Self::new(DisplacementAtPeak)];
        size.into_iter().chain(shape.map(Self::new)).collect()
    }

    /// Returns the quantity with this column, from the registry of the process.
    pub fn of_column(column: &str) -> Option<Self> {
        let mut entries = QoiRegistry::current().entries.iter();
        entries.find_map(|entry| (entry.of_column)(column))
    }

    /// Returns the name and unit for figures.
    pub fn label(&self) -> String {
        match self.unit() {
            Unit::ONE => self.description().into_owned(),
            unit => format!("{} ({unit})", self.description()),
        }
    }
}

impl Deref for Quantity {
    type Target = dyn Qoi;

    fn deref(&self) -> &Self::Target {
        self.qoi.as_ref()
    }
}

impl PartialEq for Quantity {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl Eq for Quantity {}

impl PartialOrd for Quantity {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Quantity {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.name.cmp(&other.name)
    }
}

impl fmt::Debug for Quantity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
    }
}

impl fmt::Display for Quantity {
    /// Writes the name of the quantity in a case.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.name)
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
        let registry = QoiRegistry::current();
        registry.named(&name).ok_or_else(|| {
            let names: Vec<String> =
                registry.entries.iter().map(|entry| format!("`{}`", entry.example)).collect();
            D::Error::custom(format!(
                "unknown variant `{name}`, expected one of {}",
                names.join(", ")
            ))
        })
    }
}

impl JsonSchema for Quantity {
    fn schema_name() -> Cow<'static, str> {
        "Quantity".into()
    }

    fn json_schema(_: &mut SchemaGenerator) -> Schema {
        let entries = &QoiRegistry::current().entries;
        let names = entries.iter().filter(|entry| !entry.is_family).map(|entry| &entry.example);
        let patterns: Vec<String> = entries.iter().map(Entry::pattern).collect();
        json_schema!({
            "description": "Name of a quantity of interest of a curve; [qoi] in the default case lists all names.",
            "anyOf": [
                { "type": "string", "enum": names.collect::<Vec<_>>() },
                { "type": "string", "pattern": format!("^({})$", patterns.join("|")) },
            ],
        })
    }
}

/// The quantities that can be named in a case.
///
/// The registry of the process is the standard registry, unless a program installs another registry before it reads
/// the first case.
#[derive(Debug)]
pub struct QoiRegistry {
    entries: Vec<Entry>,
}

/// Parses a name in a case or the column of a table.
type Parse = Box<dyn Fn(&str) -> Option<Quantity> + Send + Sync>;

/// One quantity, or a family of quantities whose names differ only in a number.
struct Entry {
    /// Name of the quantity, or of one of the quantities.
    example: String,
    is_family: bool,
    named: Parse,
    of_column: Parse,
}

impl Entry {
    /// Regular expression of the names: words may also be joined by `_`. In the names of a family, any text replaces
    /// the numbers, or the text behind a colon.
    fn pattern(&self) -> String {
        let mut pattern = String::new();
        for c in self.example.chars() {
            match c {
                '-' | '_' => pattern.push_str("[-_]"),
                '0'..='9' | '.' if self.is_family && pattern.ends_with(".+") => {}
                '0'..='9' if self.is_family => pattern.push_str(".+"),
                ':' if self.is_family => return pattern + ":.+",
                c if c.is_alphanumeric() => pattern.push(c),
                c => pattern.extend(['\\', c]),
            }
        }
        pattern
    }
}

impl fmt::Debug for Entry {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.example)
    }
}

static REGISTRY: OnceLock<QoiRegistry> = OnceLock::new();

impl QoiRegistry {
    /// Returns the registry of the quantities of this crate.
    pub fn standard() -> Self {
        Self { entries: Vec::new() }
            .with_qoi(Slope)
            .with_qoi(PeakForce)
            .with_qoi(DisplacementAtPeak)
            .with_qoi(EnergyToPeak)
            .with_qoi(PostPeakSlope)
            .with_qoi(RelaxedFraction)
            .with_qoi(CreepDisplacement)
            .with_qoi(UnloadingSlope)
            .with_qoi(HysteresisEnergy)
            .with_family("force-at-50-percent", RelativeForce::of_name, RelativeForce::of_column)
            .with_family("force-at-0.05-mm", ForceAt::of_name, ForceAt::of_column)
            .with_family("force-at-10-s", ForceAtTime::of_name, ForceAtTime::of_column)
            .with_family(
                "displacement-at-10-s",
                DisplacementAtTime::of_name,
                DisplacementAtTime::of_column,
            )
            // without the prefix `column:`, the name of a column does not show that the column is a quantity of this
            // family
            .with_family("column:deflection_mm", TableColumn::of_name, |_| None)
    }

    /// Adds a quantity. If its name is taken, the earlier quantity keeps the name.
    pub fn with_qoi(mut self, qoi: impl Qoi) -> Self {
        let column = qoi.column().into_owned();
        let quantity = Quantity::new(qoi);
        let by_name = quantity.clone();
        self.entries.push(Entry {
            example: quantity.to_string(),
            is_family: false,
            named: Box::new(move |name| (*by_name.name == *name).then(|| by_name.clone())),
            of_column: Box::new(move |text| (column == text).then(|| quantity.clone())),
        });
        self
    }

    /// Adds quantities whose names differ by a number. `of_name` and `of_column` parse the name in a case and the
    /// column of a table; `example` is the name of one of the quantities.
    pub fn with_family<Q: Qoi>(
        mut self,
        example: &str,
        of_name: impl Fn(&str) -> Option<Q> + Send + Sync + 'static,
        of_column: impl Fn(&str) -> Option<Q> + Send + Sync + 'static,
    ) -> Self {
        self.entries.push(Entry {
            example: example.to_owned(),
            is_family: true,
            named: Box::new(move |name| of_name(name).map(Quantity::new)),
            of_column: Box::new(move |column| of_column(column).map(Quantity::new)),
        });
        self
    }

    /// Returns the quantity with this name in a case. Words may also be joined by `_`.
    pub fn named(&self, name: &str) -> Option<Quantity> {
        let named = |name: &str| self.entries.iter().find_map(|entry| (entry.named)(name));
        named(name).or_else(|| named(&name.replace('_', "-")))
    }

    /// Makes this registry the registry of the process. Returns `false` if the process already has
    /// a registry.
    pub fn install(self) -> bool {
        REGISTRY.set(self).is_ok()
    }

    fn current() -> &'static Self {
        REGISTRY.get_or_init(Self::standard)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantities_are_found_by_their_columns_and_by_their_names_in_a_case() {
        let scalars = ["slope", "peak-force", "displacement-at-peak", "energy-to-peak"];
        let shape = ["force-at-1-percent", "force-at-50-percent", "force-at-199-percent"];
        let branches =
            ["relaxed-fraction", "creep-displacement", "unloading-slope", "hysteresis-energy"];
        let times = [
            "force-at-0.000001-s",
            "force-at-0.5-s",
            "displacement-at-10-s",
            "force-at-86400.25-s",
        ];
        let forces = ["force-at-0.001-mm", "force-at-1.234-mm", "force-at-4294967.295-mm"];
        let with_peak = scalars.into_iter().chain(["post-peak-slope"]).chain(shape);
        for name in with_peak.chain(forces).chain(branches).chain(times) {
            let quantity: Quantity = toml::Value::from(name).try_into().unwrap();
            assert_eq!(quantity.to_string(), name);
            assert_eq!(Quantity::of_column(&quantity.column()), Some(quantity.clone()));
            assert_eq!(toml::Value::try_from(&quantity).unwrap().as_str(), Some(name));
            let unit = quantity.unit().to_string();
            let label = quantity.label();
            assert!(unit == "1" || label.ends_with(&format!("({unit})")), "{label}");
        }
        let named = |name: &str| toml::Value::from(name).try_into::<Quantity>();
        assert_eq!(named("energy_to_peak").unwrap(), Quantity::new(EnergyToPeak));
        assert_eq!(named("force-at-0.050-mm").unwrap().to_string(), "force-at-0.05-mm");
        for column in [
            "colour",
            "relative_force_at_0_percent",
            "relative_force_at_200_percent",
            "force_at_0_mm_N",
            "force_at_0.0005_mm_N",
            "force_at_-1_mm_N",
            "force_at_NaN_mm_N",
            "force_at_0_s_N",
            "displacement_at_0_s_mm",
            "force_at_0.0000001_s_N",
        ] {
            assert_eq!(Quantity::of_column(column), None, "{column}");
        }
        for name in ["force-at-500-percent", "force-at-1e30-mm", "force-at-inf-mm"] {
            let error = named(name).unwrap_err().to_string();
            assert!(error.contains("force-at-50-percent"), "{error}");
        }
    }
}
