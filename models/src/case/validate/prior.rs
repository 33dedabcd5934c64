//! Checks of the prior and its extensions.

use fem::FemError;
use ppl::Univariate;

use super::super::{Case, CaseFile, Mistakes, Parameter, PriorCase, SimulationParts, TargetError};
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
        // the case has no numbers that parameters of runs from outside could set
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
        for (region, _) in self.case.material.iter().filter(changed) {
            match self.in_fem(region, &simulation.material[region]) {
                Ok(()) => {}
                Err(FemError::OutOfRange { requirement, .. }) => {
                    let help = "Check the unit in the key's name.";
                    return refuse(format!("must be {requirement}"), help);
                }
                Err(other) => return refuse(other.to_string(), "Choose another value."),
            }
        }
        // a shift depends on constants of its material and on the temperature of the test
        for series in simulation.material.values().filter_map(|m| m.viscoelastic.as_ref()) {
            if let (Some(shift), Some(celsius)) =
                (&series.shift, simulation.test.temperature_celsius)
                && let Err(error) = shift.validate("test", celsius)
            {
                return refuse(error.to_string(), "Choose another value.");
            }
        }
        let changed = simulation
            .interface
            .iter()
            .filter(|(name, interface)| self.case.interface[*name] != **interface);
        for (name, interface) in changed {
            if let Err(WrongInterface { problem, help, .. }) =
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
        let mut mistakes = Mistakes::default();
        let file = Self { path: self.path.clone(), case, table_files: Vec::new() };
        file.check_test(&mut mistakes);
        check_machine(&file, &mut mistakes);
        match mistakes.into_vec().into_iter().next() {
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
        for (region, _) in self.case.material.iter().filter(changed) {
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
        for (region, material) in simulation.material.iter().filter(|(_, m)| m.strength.is_some()) {
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
