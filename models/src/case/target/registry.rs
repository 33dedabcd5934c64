//! A target with its path, and the registry that finds it.

use std::cmp::Ordering;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Deref;
use std::str::FromStr;
use std::sync::{Arc, OnceLock};

use super::definition::Target;
use super::inelastic::{self, InelasticConstant};
use super::interface::{self, InterfaceToughness};
use super::material::{MaterialConstant, Property};
use super::number::NUMBERS;

/// Calibrated parameter: a target with its path. Clones share the target; two parameters are equal if their paths are
/// equal.
///
/// Parameters are ordered by table. Constants of one material have the order of their keys in the default case.
#[derive(Clone)]
pub struct Parameter {
    path: Arc<str>,
    target: Arc<dyn Target>,
}

impl Parameter {
    /// Creates the parameter of a target. The path of the target must have a table and a key, as in `matrix.young_mpa`.
    /// Only the free names of `[parameters]` have no table.
    pub fn new(target: impl Target) -> Self {
        Self { path: target.path().into(), target: Arc::new(target) }
    }

    /// Returns the table and the key of which the path consists.
    pub(crate) fn table_and_key(&self) -> (&str, &str) {
        self.path.rsplit_once('.').unwrap_or(("", &self.path))
    }

    /// Whether the parameter is one of `[parameters]`, whose names are free.
    pub(crate) fn is_free(&self) -> bool {
        !self.path.contains('.')
    }

    /// Returns label and unit; if `with_region`, the name of the region stands before the label.
    pub(crate) fn label_and_unit(&self, with_region: bool) -> String {
        let region = self.region().filter(|_| with_region);
        let region = region.map(|region| format!("{region} ")).unwrap_or_default();
        match &*self.unit() {
            "1" => format!("{region}{}", self.label()),
            unit => format!("{region}{} ({unit})", self.label()),
        }
    }

    fn order(&self) -> (&str, Option<usize>, &str) {
        let (table, key) = self.table_and_key();
        (table, Property::ALL.iter().position(|property| property.key() == key), key)
    }
}

impl Deref for Parameter {
    type Target = dyn Target;

    fn deref(&self) -> &Self::Target {
        self.target.as_ref()
    }
}

impl PartialEq for Parameter {
    fn eq(&self, other: &Self) -> bool {
        self.path == other.path
    }
}

impl Eq for Parameter {}

impl PartialOrd for Parameter {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Parameter {
    fn cmp(&self, other: &Self) -> Ordering {
        self.order().cmp(&other.order())
    }
}

impl fmt::Debug for Parameter {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

impl fmt::Display for Parameter {
    /// Writes the path.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.path)
    }
}

impl FromStr for Parameter {
    type Err = String;

    fn from_str(path: &str) -> Result<Self, String> {
        TargetRegistry::current().find(path).ok_or_else(|| {
            format!("{path:?} is not a parameter; expected a name such as matrix.young_mpa")
        })
    }
}

/// Parameters that a case can name, in addition to the constants of its materials.
///
/// The process uses the standard registry, unless a program installs another registry before it reads the first case.
#[derive(Debug)]
pub(crate) struct TargetRegistry {
    targets: Vec<Parameter>,
}

static REGISTRY: OnceLock<TargetRegistry> = OnceLock::new();

impl TargetRegistry {
    /// Returns the registry with the targets of this crate.
    pub(crate) fn standard() -> Self {
        Self { targets: NUMBERS.into_iter().map(Parameter::new).collect() }
    }

    /// Adds a target. If an earlier target has the same path, the earlier target is used.
    pub(crate) fn with_target(mut self, target: impl Target) -> Self {
        self.targets.push(Parameter::new(target));
        self
    }

    /// Makes this registry the registry of the process. Returns `false` if the process already has a
    /// registry.
    pub(crate) fn install(self) -> bool {
        REGISTRY.set(self).is_ok()
    }

    pub(crate) fn current() -> &'static Self {
        REGISTRY.get_or_init(Self::standard)
    }

    /// Returns the target with this path.
    pub(crate) fn find(&self, path: &str) -> Option<Parameter> {
        let target = self.targets.iter().find(|target| *target.path == *path).cloned();
        target.or_else(|| {
            if interface::is_of_interface(path) {
                return InterfaceToughness::of_path(path).map(Parameter::new);
            }
            if inelastic::is_inelastic(path) {
                return InelasticConstant::of_path(path).map(Parameter::new);
            }
            MaterialConstant::of_path(path).map(Parameter::new)
        })
    }

    /// Whether a path names a table within a table, whose keys are parameters: `interface.matrix-grain`,
    /// `matrix.viscoelastic`.
    pub(crate) fn is_table(path: &str) -> bool {
        interface::is_table(path) || inelastic::is_table(path)
    }

    /// Returns the targets of each table other than the tables of regions and interfaces, with their keys.
    pub(crate) fn tables(&self) -> BTreeMap<&str, Vec<(&str, &Parameter)>> {
        let mut tables = BTreeMap::<&str, Vec<_>>::new();
        for target in &self.targets {
            let (table, key) = target.table_and_key();
            tables.entry(table).or_default().push((key, target));
        }
        tables
    }

    /// Returns the keys of a table of the case that can be calibrated.
    pub(crate) fn keys_of(&self, table: &str) -> Vec<&str> {
        if interface::is_table(table) {
            return vec![interface::TOUGHNESS];
        }
        let keys = self.targets.iter().map(Parameter::table_and_key);
        let keys: Vec<&str> = keys.filter(|keys| keys.0 == table).map(|keys| keys.1).collect();
        match keys.is_empty() {
            true => Property::ALL.into_iter().map(Property::key).collect(),
            false => keys,
        }
    }
}
