//! Constants of viscoelastic and plastic laws, such as `matrix.viscoelastic.shear.0.fraction`.

use std::borrow::Cow;

use super::definition::{SimulationParts, Target, TargetError};

/// Tables of a region whose numbers can be calibrated.
const TABLES: [&str; 2] = ["viscoelastic", "plastic"];

/// Number in a table of a region: the path without the region consists of keys and of indices of lists.
#[derive(Debug)]
pub(super) struct InelasticConstant {
    path: String,
}

/// Splits a path into the region and the keys below it; `None` if the path is not in a viscoelastic or plastic table.
fn parts(path: &str) -> Option<(&str, impl Iterator<Item = &str>)> {
    let (region, below) = path.split_once('.')?;
    let first = below.split('.').next()?;
    TABLES.contains(&first).then(|| (region, below.split('.')))
}

/// Returns whether a path is in a viscoelastic or plastic table, or is such a table.
pub(super) fn is_inelastic(path: &str) -> bool {
    parts(path).is_some()
}

/// Returns whether a path in such a table is a table, not a number: the keys of numbers have a unit, or are known names.
pub(super) fn is_table(path: &str) -> bool {
    is_inelastic(path) && InelasticConstant::of_path(path).is_none()
}

impl InelasticConstant {
    /// The constant with a path such as `matrix.plastic.hardening.voce.saturation_mpa`.
    pub(super) fn of_path(path: &str) -> Option<Self> {
        let (_, keys) = parts(path)?;
        let keys: Vec<&str> = keys.collect();
        // plastic.rate is a table, plastic.hardening.voce.rate is a number
        let is_number = match keys[..] {
            [.., table, "rate"] => table == "voce",
            [.., key] => symbol(key).is_some(),
            [] => false,
        };
        is_number.then(|| Self { path: path.to_owned() })
    }

    fn key(&self) -> &str {
        self.path.rsplit('.').next().unwrap_or_default()
    }

    /// Number of the term in its list, counted from 1.
    fn term(&self) -> Option<usize> {
        self.path.split('.').find_map(|key| key.parse::<usize>().ok()).map(|index| index + 1)
    }
}

/// Symbol of a number in figures, and its unit; `None` if the key is no number.
fn symbol(key: &str) -> Option<[&'static str; 2]> {
    Some(match key {
        "fraction" => ["γ", "1"],
        "time_s" => ["τ", "s"],
        "c1" => ["C₁", "1"],
        "c2_kelvin" => ["C₂", "K"],
        "reference_celsius" => ["T₀", "°C"],
        "energy_kj_per_mol" => ["activation energy", "kJ/mol"],
        "yield_mpa" => ["Y₀", "MPa"],
        "friction_deg" => ["friction angle", "°"],
        "dilatancy_deg" => ["dilatancy angle", "°"],
        "modulus_mpa" => ["h", "MPa"],
        "saturation_mpa" => ["A", "MPa"],
        "rate" => ["b", "1"],
        "factor_mpa" => ["k", "MPa"],
        "offset" => ["e₀", "1"],
        "exponent" => ["n", "1"],
        "c" => ["C", "1"],
        "reference_per_s" => ["reference rate", "1/s"],
        _ => return None,
    })
}

impl Target for InelasticConstant {
    fn path(&self) -> Cow<'_, str> {
        (&*self.path).into()
    }

    fn label(&self) -> Cow<'_, str> {
        let [symbol, _] = symbol(self.key()).unwrap_or_default();
        match self.term() {
            Some(term) => format!("{symbol}{term}").into(),
            None => symbol.into(),
        }
    }

    fn unit(&self) -> Cow<'_, str> {
        symbol(self.key()).unwrap_or_default()[1].into()
    }

    fn region(&self) -> Option<&str> {
        self.path.split('.').next()
    }

    fn set(&self, parts_of_case: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        let (region, keys) =
            parts(&self.path).unwrap_or_else(|| unreachable!("checked by of_path"));
        let missing = || TargetError {
            problem: format!("the case has no number material.{}", self.path),
            help: "Add it to the material, or leave the parameter out.".to_owned(),
        };
        let material = parts_of_case.material.get_mut(region).ok_or_else(missing)?;
        // a material is a tree of tables and lists; the number is replaced in this tree
        let mut tree = toml::Value::try_from(&*material).map_err(|_| missing())?;
        let mut at = &mut tree;
        for key in keys {
            let next = match key.parse::<usize>() {
                Ok(index) => at.as_array_mut().and_then(|list| list.get_mut(index)),
                Err(_) => at.as_table_mut().and_then(|table| table.get_mut(key)),
            };
            at = next.ok_or_else(missing)?;
        }
        if !(at.is_float() || at.is_integer()) {
            return Err(missing());
        }
        *at = toml::Value::Float(value);
        *material = tree.try_into().map_err(|_| missing())?;
        Ok(())
    }
}
