//! Constants of viscoelastic and plastic laws and of strengths, such as `matrix.viscoelastic.shear.0.fraction`.

use std::borrow::Cow;

use super::definition::{SimulationParts, Target, TargetError};

/// Number in a viscoelastic, plastic or strength table of a region. After the region, the path consists of keys and of indices of
/// lists.
#[derive(Debug)]
pub(crate) struct InelasticConstant {
    path: String,
}

/// Splits a path into the region and the keys below it; `None` if the path is not in one of these tables.
fn region_and_keys(path: &str) -> Option<(&str, impl Iterator<Item = &str>)> {
    let (region, below) = path.split_once('.')?;
    let first = below.split('.').next()?;
    InelasticConstant::TABLES.contains(&first).then(|| (region, below.split('.')))
}

/// Returns whether a path is in one of these tables, or is such a table.
pub(super) fn is_inelastic(path: &str) -> bool {
    region_and_keys(path).is_some()
}

/// Returns whether a path in one of these tables is itself a table, and not a number.
pub(super) fn is_table(path: &str) -> bool {
    is_inelastic(path) && InelasticConstant::of_path(path).is_none()
}

impl InelasticConstant {
    /// Tables of a region whose numbers can be calibrated.
    pub(crate) const TABLES: [&str; 3] = ["viscoelastic", "plastic", "strength"];

    /// Keys of the constants, with their symbols and units.
    pub(crate) fn symbols() -> impl Iterator<Item = (&'static str, [&'static str; 2])> {
        SYMBOLS.into_iter()
    }

    /// Returns the constant that a path addresses, such as `matrix.plastic.hardening.voce.saturation_mpa`.
    pub(super) fn of_path(path: &str) -> Option<Self> {
        let (_, keys) = region_and_keys(path)?;
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

/// Keys of the constants, with their symbols in figures and their units.
const SYMBOLS: [(&str, [&str; 2]); 19] = [
    ("fraction", ["γ", "1"]),
    ("time_s", ["τ", "s"]),
    ("c1", ["C₁", "1"]),
    ("c2_kelvin", ["C₂", "K"]),
    ("reference_celsius", ["T₀", "°C"]),
    ("energy_kj_per_mol", ["activation energy", "kJ/mol"]),
    ("yield_mpa", ["Y₀", "MPa"]),
    ("friction_deg", ["friction angle", "°"]),
    ("dilatancy_deg", ["dilatancy angle", "°"]),
    ("modulus_mpa", ["h", "MPa"]),
    ("saturation_mpa", ["A", "MPa"]),
    ("rate", ["b", "1"]),
    ("factor_mpa", ["k", "MPa"]),
    ("offset", ["e₀", "1"]),
    ("exponent", ["n", "1"]),
    ("c", ["C", "1"]),
    ("reference_per_s", ["reference rate", "1/s"]),
    ("tensile_mpa", ["σ_ts", "MPa"]),
    ("compressive_mpa", ["σ_cs", "MPa"]),
];

/// Symbol of a number in figures, and its unit; `None` if the key is no number.
fn symbol(key: &str) -> Option<[&'static str; 2]> {
    SYMBOLS.iter().find(|(name, _)| *name == key).map(|(_, symbol)| *symbol)
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

    fn set(&self, simulation: &mut SimulationParts, value: f64) -> Result<(), TargetError> {
        let (region, keys) =
            region_and_keys(&self.path).unwrap_or_else(|| unreachable!("checked by of_path"));
        let missing = || TargetError {
            problem: format!("the case has no number material.{}", self.path),
            help: "Add it to the material, or leave the parameter out.".to_owned(),
        };
        let material = simulation.material.get_mut(region).ok_or_else(missing)?;
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

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::case::{CaseFile, Parameter};

    const CASE: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
        [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n\
        viscoelastic.shear = [{ fraction = 0.3, time_s = 0.1 }, { fraction = 0.2, time_s = 1 }]\n\
        [material.grain]\nyoung_mpa = 2e5\npoisson = 0.27\nplastic.yield_mpa = 233.2\n\
        plastic.hardening = { voce = { saturation_mpa = 1101.0, rate = 1.95 } }\n\
        plastic.rate = { johnson-cook = { c = 0.04, reference_per_s = 1e-5 } }\n\
        [test]\ndisplacement_mm = 0.2\n";

    fn parse(text: &str) -> Result<CaseFile, crate::error::InputError> {
        CaseFile::parse(text, Path::new("case.toml"))
    }

    #[test]
    fn every_number_of_the_laws_is_a_parameter() {
        let case = parse(CASE).unwrap().case;
        for (path, label, unit) in [
            ("matrix.viscoelastic.shear.0.fraction", "γ1", "1"),
            ("matrix.viscoelastic.shear.1.time_s", "τ2", "s"),
            ("grain.plastic.yield_mpa", "Y₀", "MPa"),
            ("grain.plastic.hardening.voce.saturation_mpa", "A", "MPa"),
            ("grain.plastic.hardening.voce.rate", "b", "1"),
            ("grain.plastic.rate.johnson-cook.c", "C", "1"),
        ] {
            let parameter: Parameter = path.parse().unwrap();
            assert_eq!((&*parameter.label(), &*parameter.unit()), (label, unit));
            let mut simulation = case.simulation_parts();
            parameter.set(&mut simulation, 0.0625).unwrap();
            assert_ne!(simulation, case.simulation_parts(), "{path}");
            let mut again = simulation.clone();
            parameter.set(&mut again, 0.0625).unwrap();
            assert_eq!(simulation, again, "{path}");
        }
        for path in ["matrix.viscoelastic.shear.2.fraction", "matrix.plastic.yield_mpa"] {
            let parameter: Parameter = path.parse().unwrap();
            let error = parameter.set(&mut case.simulation_parts(), 0.1).unwrap_err();
            assert!(error.to_string().contains(path), "{error}");
        }
        assert!("grain.plastic.rate".parse::<Parameter>().is_err());
    }

    #[test]
    fn strengths_are_parameters() {
        let text = CASE
            .replace("viscoelastic.shear", "#")
            .replace("[material.grain]", "toughness_n_per_mm = 0.002\nstrength = { tensile_mpa = 2.0, compressive_mpa = 6.0 }\n[material.grain]")
            + "[phase_field]\nmodel = \"at1\"\nlength_mm = 0.01\n";
        let case = parse(&text).unwrap().case;
        let parameter: Parameter = "matrix.strength.tensile_mpa".parse().unwrap();
        assert_eq!((&*parameter.label(), &*parameter.unit()), ("σ_ts", "MPa"));
        let mut simulation = case.simulation_parts();
        parameter.set(&mut simulation, 2.5).unwrap();
        assert_eq!(simulation.material["matrix"].strength.unwrap().tensile_mpa, 2.5);
        let error = parse(&text.replace("at1", "at2")).unwrap_err().to_string();
        assert!(error.contains("AT1"), "{error}");
        // each bound is possible, but not the largest tensile strength together with the smallest compressive strength
        let prior = "[prior]\nmatrix.strength.tensile_mpa = [1.5, 3.0]\nmatrix.strength.compressive_mpa = [2.5, 8.0]\n";
        let error = parse(&format!("{text}{prior}")).unwrap_err().to_string();
        assert!(error.contains("corner of the priors") && error.contains("2.5"), "{error}");
    }

    #[test]
    fn a_prior_names_constants_by_dotted_keys() {
        let text = format!(
            "{CASE}[prior]\nmatrix.viscoelastic.shear.0.fraction = [0.2, 0.4]\n\
             grain.plastic.hardening.voce.rate = [1.0, 3.0]\nmatrix.young_mpa = [250.0, 300.0]\n"
        );
        let prior = parse(&text).unwrap().case.prior.unwrap();
        let names: Vec<String> = prior.names().collect();
        assert_eq!(
            names,
            [
                "grain.plastic.hardening.voce.rate",
                "matrix.young_mpa",
                "matrix.viscoelastic.shear.0.fraction"
            ]
        );
        let again: crate::case::PriorCase =
            toml::from_str(&toml::to_string(&prior).unwrap()).unwrap();
        assert_eq!(again, prior);
    }

    #[test]
    fn impossible_constants_are_refused_with_their_key() {
        for (from, to, key) in [
            ("fraction = 0.2", "fraction = 0.8", "material.matrix.viscoelastic.shear.fraction"),
            ("time_s = 0.1", "time_s = 0.0", "material.matrix.viscoelastic.shear.time_s"),
            ("yield_mpa = 233.2", "yield_mpa = -1.0", "material.grain.plastic.yield_mpa"),
            ("saturation_mpa = 1101.0", "saturation_mpa = -5.0", "hardening.saturation_mpa"),
            ("[material.grain]", "plastic.yield_mpa = 1.0\n[material.grain]", "plastic"),
            (
                "[material.grain]",
                "viscoelastic.shift.arrhenius = { energy_kj_per_mol = 80.0, reference_celsius = 50.0 }\n\
                 [material.grain]",
                "test.temperature_celsius",
            ),
        ] {
            let error = parse(&CASE.replace(from, to)).unwrap_err().to_string();
            assert!(error.contains(key), "{error}");
        }
    }
}
