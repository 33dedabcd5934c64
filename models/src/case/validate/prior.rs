//! Checks of the prior and its extensions.

use fem::FemError;
use ppl::Univariate;

use super::super::{
    Case, CaseFile, MaterialCase, Mistakes, Parameter, PriorCase, SimulationParts, TargetError,
};
use super::interface::{WrongInterface, check_interface};
use super::machine::check_machine;
use crate::error::InputError;
use crate::prior::{Prior, PriorBounds};

impl CaseFile {
    /// Checks that each extension widens the range of one parameter. The extension must touch or overlap the present
    /// range, which includes earlier extensions.
    pub(super) fn check_extensions(&self) -> Result<(), InputError> {
        let mut case = self.case.clone();
        case.extend.clear();
        for (k, extension) in self.case.extend.iter().enumerate() {
            let key = format!("extend[{k}]");
            let help = "Use as many runs as in the first batch for a range of the same width.";
            self.within(&format!("{key}.runs"), extension.runs as f64, 1.0, 1e6, "runs", help)?;
            let mut mistakes = Mistakes::default();
            for (parameter, bounds) in extension.prior.iter() {
                let key_of_bounds = format!("{key}.prior.{parameter}");
                mistakes.note(self.check_bounds(&key_of_bounds, parameter, bounds));
            }
            mistakes.into_vec().into_iter().next().map_or(Ok(()), Err)?;
            let refuse =
                |key: &str, problem: &str, help: &str| Err(self.error(key, "", problem, help));
            let mut all = extension.prior.iter();
            let (Some((parameter, &PriorBounds([lower, upper]))), None) = (all.next(), all.next())
            else {
                let help = "Write a table [[extend]] for each parameter.";
                return refuse(&format!("{key}.prior"), "extends several parameters or none", help);
            };
            let key_of_bounds = format!("{key}.prior.{parameter}");
            let whole = case.whole_prior();
            let before = whole.as_ref().and_then(|prior| prior.get(parameter));
            let Some(before) = before else {
                return refuse(
                    &key_of_bounds,
                    "is not calibrated",
                    "Extend a parameter of [prior].",
                );
            };
            let ([low, high], value) = (before.range(), format!("[{lower:?}, {upper:?}]"));
            if lower > high || upper < low || (lower >= low && upper <= high) {
                let help = format!("The range is [{low:?}, {high:?}]: begin at one of its ends.");
                let problem = "does not adjoin the range of the prior";
                return Err(self.error(&key_of_bounds, value, problem, help));
            }
            if let Err(error) = before.within(low.min(lower), high.max(upper)).validate() {
                let help = "Extend the range only as far as the distribution has a density.";
                return Err(self.error(&key_of_bounds, value, error.to_string(), help));
            }
            case.extend.push(extension.clone());
        }
        Ok(())
    }

    pub(super) fn check_prior(&self, prior: &PriorCase, mistakes: &mut Mistakes) {
        if prior.parameters().len() == 0 {
            mistakes.note(Err(self.error(
                "prior",
                "",
                "names no parameter",
                "Name each calibrated parameter with its prior: matrix.young_mpa = [250.0, 300.0].",
            )));
        }
        for (parameter, prior) in prior.iter() {
            let key = match self.case.parameters.contains_key(&parameter.to_string()) {
                true => format!("parameters.{parameter}.prior"),
                false => format!("prior.{parameter}"),
            };
            let checked = self
                .check_distribution(&key, prior)
                .and_then(|()| self.check_bounds(&key, parameter, &PriorBounds(prior.range())));
            mistakes.note(checked);
        }
    }

    /// Checks the parameters of a distribution that is not uniform, and its range.
    fn check_distribution(&self, key: &str, prior: &Prior) -> Result<(), InputError> {
        let [lower, upper] = prior.range();
        // `check_bounds` reports reversed bounds
        if prior.is_uniform() || lower >= upper {
            return Ok(());
        }
        prior.validate().map_err(|error| {
            let help = "The comments at [prior] in the case of breccia init explain the keys.";
            self.error(key, "", error.to_string(), help)
        })
    }

    fn check_bounds(
        &self,
        key: &str,
        parameter: &Parameter,
        &PriorBounds([lower, upper]): &PriorBounds,
    ) -> Result<(), InputError> {
        let value = format!("[{lower:?}, {upper:?}]");
        if parameter.is_free() && !self.case.parameters.contains_key(&parameter.to_string()) {
            let problem = "a parameter is named with its region";
            let help = "Write matrix.young_mpa = … in place of young_mpa = …, grain.toughness_n_per_mm = … and so on. \
                        Free names are declared in [parameters].";
            return Err(self.error(key, value, problem, help));
        }
        // without the built-in simulation, a parameter sets no number of the case: only its bounds are checked
        if !self.case.is_built_in() {
            if !(lower.is_finite() && upper.is_finite()) {
                return Err(self.error(key, value, "must be finite", "Write [lower, upper]."));
            }
        } else if parameter.is_free() {
            // `check_outside` refuses free parameters of the built-in simulation
            return Ok(());
        } else {
            self.check_parameter(key, parameter)?;
            for bound in [lower, upper] {
                self.check_value(key, &value, parameter, bound)?;
            }
        }
        if lower < upper {
            return Ok(());
        }
        let problem = "the lower bound is not below the upper one";
        Err(self.error(key, value, problem, "Write [lower, upper]."))
    }

    /// Checks that the case is valid with this value of an existing parameter.
    pub(super) fn check_value(
        &self,
        key: &str,
        shown: &str,
        parameter: &Parameter,
        value: f64,
    ) -> Result<(), InputError> {
        let refuse = |problem: String, help: &str| Err(self.error(key, shown, problem, help));
        let [least, most] = parameter.range();
        if !(least < value && value < most) {
            return refuse(format!("must lie between {least} and {most}"), "Check its unit.");
        }
        let mut simulation = self.case.simulation_parts();
        if parameter.set(&mut simulation, value).is_err() {
            // `check_parameter` reports the error of a parameter that cannot be set
            return Ok(());
        }
        let changed = |(region, _): &(&String, &_)| {
            simulation.material[*region] != self.case.material[*region]
        };
        for (region, material) in self.case.material.iter().filter(changed) {
            // the check of the material reports a mistake that does not depend on the parameter
            if self.in_fem(region, material).is_err() {
                continue;
            }
            match self.in_fem(region, &simulation.material[region]) {
                Ok(()) => {}
                Err(FemError::OutOfRange { entity, field, value, requirement }) => {
                    let is_parameter = parameter.path().ends_with(&format!(".{field}"));
                    let help = "Check the unit in the key's name.";
                    return match is_parameter {
                        true => refuse(format!("must be {requirement}"), help),
                        // with this bound, another constant is outside its range
                        false => refuse(
                            format!(
                                "is not possible with {entity}.{field} = {value}, which must be {requirement}"
                            ),
                            "Change the bound of the prior, or the other constant.",
                        ),
                    };
                }
                Err(other) => return refuse(other.to_string(), "Choose another value."),
            }
        }
        // a shift depends on constants of its material and on the temperature of the test
        let shift_error = |parts: &SimulationParts| {
            let celsius = parts.test.temperature_celsius?;
            let series = parts.material.values().filter_map(|m| m.viscoelastic.as_ref());
            { series }.find_map(|series| series.shift.as_ref()?.validate("test", celsius).err())
        };
        if shift_error(&self.case.simulation_parts()).is_none()
            && let Some(error) = shift_error(&simulation)
        {
            return refuse(error.to_string(), "Choose another value.");
        }
        let changed = simulation
            .interface
            .iter()
            .filter(|(name, interface)| self.case.interface[*name] != **interface);
        for (name, interface) in changed {
            if check_interface(&self.case, name, &self.case.interface[name]).is_ok()
                && let Err(WrongInterface { problem, help, .. }) =
                    check_interface(&self.case, name, interface)
            {
                return refuse(problem, &help);
            }
        }
        let Case { phase_field, test, machine, .. } = &self.case;
        if (&simulation.phase_field, &simulation.test, &simulation.machine)
            == (phase_field, test, machine)
        {
            return Ok(());
        }
        let SimulationParts { phase_field, test, machine, .. } = simulation;
        let case = Case { phase_field, test, machine, ..self.case.clone() };
        let mistakes = |file: &Self| {
            let mut mistakes = Mistakes::default();
            file.check_test(&mut mistakes);
            check_machine(file, &mut mistakes);
            mistakes.into_vec()
        };
        let file = Self { path: self.path.clone(), case, table_files: Vec::new() };
        // mistakes of the case that do not depend on the parameter are reported with their own keys
        let before = mistakes(self);
        let is_new = |mistake: &InputError| {
            before
                .iter()
                .all(|other| (&other.place, &other.problem) != (&mistake.place, &mistake.problem))
        };
        match mistakes(&file).into_iter().find(is_new) {
            Some(InputError { problem, help, .. }) => refuse(problem, &help),
            None => Ok(()),
        }
    }

    /// Refuses priors of the fractions of a Prony series if the sum of all upper bounds is 1 or more: no long-term
    /// modulus would remain. The check of a single bound uses the values of the case for the other fractions.
    pub(super) fn check_fractions(&self) -> Result<(), InputError> {
        let Some(prior) = self.case.whole_prior().filter(|_| self.case.is_built_in()) else {
            return Ok(());
        };
        let mut simulation = self.case.simulation_parts();
        for (parameter, parameter_prior) in prior.iter() {
            let path = parameter.to_string();
            if path.contains(".viscoelastic.") && path.ends_with(".fraction") {
                let [_, upper] = parameter_prior.range();
                // `check_parameter` reports a parameter that cannot be set
                let _ = parameter.set(&mut simulation, upper);
            }
        }
        let changed = |(region, _): &(&String, &_)| {
            simulation.material[*region] != self.case.material[*region]
        };
        for (region, material) in self.case.material.iter().filter(changed) {
            if self.in_fem(region, material).is_err() {
                continue;
            }
            let error = self.in_fem(region, &simulation.material[region]);
            if let Err(FemError::OutOfRange { field: "fraction", value, .. }) = error {
                let key = format!("prior.{region}.viscoelastic");
                let problem =
                    "is the sum of the upper bounds of all fractions: no long-term modulus remains";
                let help =
                    "Lower the upper bounds of the fractions, so that their sum stays below 1.";
                return Err(self.error(&key, value.to_string(), problem, help));
            }
        }
        Ok(())
    }

    /// Refuses priors with a corner at which the strength of a region is not defined: tensile strength and regularisation
    /// length have their upper bounds; compressive strength, toughness and Young's modulus have their lower bounds. The
    /// check of a single bound uses the values of the case for the other parameters.
    pub(super) fn check_strengths(&self) -> Result<(), InputError> {
        let Some(prior) = self.case.whole_prior().filter(|_| self.case.is_built_in()) else {
            return Ok(());
        };
        let mut simulation = self.case.simulation_parts();
        let mut names = Vec::new();
        for (parameter, parameter_prior) in prior.iter() {
            let path = parameter.to_string();
            let [lower, upper] = parameter_prior.range();
            let is_of = |key: &str| path.ends_with(key);
            let value = if is_of(".strength.tensile_mpa") || path == "phase_field.length_mm" {
                upper
            } else if [".strength.compressive_mpa", ".toughness_n_per_mm", ".young_mpa"]
                .into_iter()
                .any(is_of)
            {
                lower
            } else {
                continue;
            };
            // `check_parameter` reports a parameter that cannot be set
            let _ = parameter.set(&mut simulation, value);
            names.push(format!("{path} = {value}"));
        }
        // the check of the material reports a strength that the case itself does not allow
        let is_checked = |(region, material): &(&String, &MaterialCase)| {
            material.strength.is_some() && self.in_fem(region, &self.case.material[*region]).is_ok()
        };
        for (region, material) in simulation.material.iter().filter(is_checked) {
            let checked = material
                .in_fem()
                .and_then(|material| material.validate(region, simulation.phase_field.as_ref()));
            if let Err(error) = checked {
                let key = format!("prior.{region}.strength");
                let problem = format!("is not possible in a corner of the priors: {error}");
                let help =
                    "Narrow the ranges, so that every combination of their bounds is possible.";
                return Err(self.error(&key, names.join(", "), problem, help));
            }
        }
        Ok(())
    }

    /// Checks that the parameter exists in the case.
    fn check_parameter(&self, key: &str, parameter: &Parameter) -> Result<(), InputError> {
        let set = parameter.set(&mut self.case.simulation_parts(), 1.0);
        set.map_err(|TargetError { problem, help }| self.error(key, "", problem, help))
    }
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// The mistakes of a case with a constant of the matrix in place of the viscosity.
    fn mistakes(constant: &str, prior: &str) -> Vec<String> {
        let text = format!(
            "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
             [material.matrix]\nyoung_mpa = 275.0\npoisson = 0.25\ntoughness_n_per_mm = 0.05\n{constant}\n\
             [phase_field]\nlength_mm = 0.06\nmodel = \"at1\"\n\
             [test]\ndisplacement_mm = 0.2\n[prior]\n{prior}\n\
             [experiments]\ntable = \"specimens.csv\"\n"
        );
        let mistakes = CaseFile::parse_all(&text, Path::new("case.toml")).1;
        mistakes.iter().map(ToString::to_string).collect()
    }

    const YOUNG: &str = "matrix.young_mpa = [230.0, 330.0]";

    /// A wrong constant is reported once, at its own key, and not at a prior of another constant.
    #[test]
    fn a_wrong_constant_is_no_mistake_of_a_prior() {
        for (constant, key) in [
            (
                "viscoelastic.shear = [{ fraction = 0.3, time_s = -0.1 }]",
                "material.matrix.viscoelastic.shear.time_s = -0.1",
            ),
            ("viscosity_mpa_s = -1.0", "material.matrix.viscosity_mpa_s = -1"),
            (
                "strength = { tensile_mpa = 2.0, compressive_mpa = 1.0 }",
                "material.matrix.strength.compressive_mpa = 1",
            ),
        ] {
            let found = mistakes(constant, YOUNG);
            assert_eq!(found.len(), 1, "{found:?}");
            assert!(found[0].contains(key), "{key}: {found:?}");
        }
        assert_eq!(mistakes("viscosity_mpa_s = 1.0", YOUNG), [""; 0]);
    }

    /// A bound that contradicts another constant names this constant.
    #[test]
    fn a_bound_that_contradicts_another_constant_names_it() {
        let strength = "strength = { tensile_mpa = 2.0, compressive_mpa = 6.0 }";
        let found = mistakes(strength, "matrix.strength.tensile_mpa = [1.0, 7.0]");
        let part = "not possible with material.matrix.strength.compressive_mpa = 6, which must be larger than tensile_mpa";
        assert!(found.iter().any(|mistake| mistake.contains(part)), "{found:?}");
        let found = mistakes("viscosity_mpa_s = 1.0", "matrix.young_mpa = [-1.0, 300.0]");
        assert!(found[0].contains("prior.matrix.young_mpa"), "{found:?}");
        assert!(!found[0].contains("not possible with"), "{found:?}");
    }

    #[test]
    fn an_impossible_strength_is_a_mistake_of_the_strength() {
        let plastic = "plastic = { yield_mpa = 5.0 }\nstrength = { tensile_mpa = 2.0, compressive_mpa = 6.0 }";
        let found = mistakes(plastic, YOUNG);
        assert!(
            found[0].contains("material.matrix.strength: a strength is implemented"),
            "{found:?}"
        );
    }
}
