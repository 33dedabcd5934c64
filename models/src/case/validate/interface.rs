//! Checks of the interfaces between regions.

use fem::FemError;

use super::super::{Case, InterfaceCase};

/// Mistake in the table of an interface.
pub(super) struct WrongInterface {
    /// Key of the case.
    pub(super) key: String,
    /// Value of the key; empty if the table itself is wrong.
    pub(super) value: String,
    pub(super) problem: String,
    pub(super) help: String,
}

/// Checks that the regions of an interface exist, that one of them can break, and that the values are in their ranges.
pub(super) fn check_interface(
    case: &Case,
    name: &str,
    interface: &InterfaceCase,
) -> Result<(), WrongInterface> {
    let table = format!("interface.{name}");
    let wrong = |key: String, value: String, problem: String, help: String| {
        Err(WrongInterface { key, value, problem, help })
    };
    let Some(regions) = InterfaceCase::regions(name, &case.material) else {
        let materials = case.material.keys().map(String::as_str).collect::<Vec<_>>().join(", ");
        let help = format!(
            "Write [interface.matrix-grain]: two materials joined by a hyphen. The materials are: {materials}."
        );
        return wrong(table, String::new(), "does not name two materials".into(), help);
    };
    match interface.validate(regions) {
        Ok(()) => {}
        Err(FemError::OutOfRange { field, value, requirement, .. }) => {
            let help = match field {
                "width_mm" => "Four elements, or two phase_field.length_mm, are a start.",
                _ => "It is in N/mm: 1 pJ/µm² = 0.001 N/mm.",
            };
            let problem = format!("must be {requirement}");
            return wrong(format!("{table}.{field}"), value.to_string(), problem, help.into());
        }
        Err(other) => {
            let help = "Name two different regions.".into();
            return wrong(table, String::new(), other.to_string(), help);
        }
    }
    let can_break = |region: &str| case.material[region].toughness_n_per_mm.is_some();
    if case.phase_field.is_none() || !regions.into_iter().any(can_break) {
        let [first, second] = regions;
        let help = format!(
            "Add [phase_field] and material.{first}.toughness_n_per_mm or \
             material.{second}.toughness_n_per_mm, or leave the interface out."
        );
        let problem = "has a toughness, but neither of its regions can break".into();
        return wrong(table, String::new(), problem, help);
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use crate::case::{Case, CaseFile};

    /// Reads the default case with an interface, and with `changes` to its text.
    fn read(changes: &[(&str, &str)]) -> Result<CaseFile, String> {
        let table = "[interface.matrix-grain]\ntoughness_n_per_mm = 0.001\nwidth_mm = 0.4\n\n";
        let mut text = Case::TEMPLATE.replacen("[test]", &format!("{table}[test]"), 1);
        for (from, to) in changes {
            assert!(text.contains(from), "the case has no {from:?}");
            text = text.replacen(from, to, 1);
        }
        CaseFile::parse(&text, Path::new("case.toml")).map_err(|error| error.to_string())
    }

    #[test]
    fn an_interface_is_read_and_calibrated() {
        let path = "interface.matrix-grain.toughness_n_per_mm";
        let prior = format!("\n[prior]\n{path} = [0.0005, 0.002] ");
        let truth = format!("truth = {{ {path} = 0.001, ");
        let file = read(&[("\n[prior] ", prior.as_str()), ("truth = { ", truth.as_str())]);
        let case = file.expect("a valid case").case;
        assert_eq!(case.interface["matrix-grain"].width_mm, 0.4);
        let names: Vec<String> = case.prior.as_ref().expect("a prior").names().collect();
        assert_eq!(names[0], "interface.matrix-grain.toughness_n_per_mm");
        let again = CaseFile::parse(&case.to_toml(), Path::new("case.toml")).expect("valid").case;
        assert_eq!(again, case);
    }

    #[test]
    fn wrong_interfaces_are_refused_with_their_key() {
        let (width, toughness) = ("width_mm = 0.4", "toughness_n_per_mm = 0.001\nwidth");
        for (from, to, fragments) in [
            (
                width,
                "width_mm = -0.4",
                ["interface.matrix-grain.width_mm = -0.4", "positive width"],
            ),
            (
                toughness,
                "toughness_n_per_mm = 0.0\nwidth",
                ["interface.matrix-grain.toughness_n_per_mm = 0", "0.001 N/mm"],
            ),
            (
                width,
                "width_mm = 0.4\nstrength = { tensile_mpa = 5.0 }",
                ["strength is not a key of an interface", "Leave strength out"],
            ),
            (width, "width_m = 0.4", ["unknown key \"width_m\"", "mean \"width_mm\"?"]),
            (
                "\n[interface.matrix-grain]",
                "\n[interface.matrix-sand]",
                ["interface.matrix-sand", "grain, matrix"],
            ),
            (
                "toughness_n_per_mm = 0.0025",
                "",
                ["interface.matrix-grain", "neither of its regions can break"],
            ),
            (
                "\n[prior] ",
                "\n[prior]\ninterface.matrix-grain.toughness_n_per_mm = [-0.1, 0.002] ",
                ["prior.interface.matrix-grain.toughness_n_per_mm", "positive toughness"],
            ),
            (
                "\n[prior] ",
                "\n[prior]\ninterface.grain-matrix.toughness_n_per_mm = [0.1, 0.2] ",
                ["no table [interface.grain-matrix]", "width_mm"],
            ),
            (
                "\n[prior] ",
                "\n[prior]\ninterface.matrix-grain.width_mm = [0.1, 0.2] ",
                ["width_mm", "toughness_n_per_mm"],
            ),
        ] {
            let message = read(&[(from, to)]).expect_err(to);
            for fragment in fragments {
                assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
            }
        }
    }
}
