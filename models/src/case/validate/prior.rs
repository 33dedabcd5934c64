//! Checks of the prior and its extensions.

use fem::FemError;
use ppl::Univariate;

use super::super::{CaseFile, MaterialParameter, Mistakes, PriorCase};
use crate::error::InputError;
use crate::prior::{Prior, PriorBounds};

impl CaseFile {
    /// Checks that each extension continues the bounds of one parameter where the bounds so far end.
    pub(super) fn check_extensions(&self) -> Result<(), InputError> {
        let mut case = self.case.clone();
        case.extend.clear();
        for (k, extension) in self.case.extend.iter().enumerate() {
            let key = format!("extend[{k}]");
            let help = "As many as the first batch fill a box of the same width alike.";
            self.within(&format!("{key}.runs"), extension.runs as f64, 1.0, 1e6, "runs", help)?;
            let mut mistakes = Mistakes::default();
            for (parameter, bounds) in extension.prior.iter() {
                let place = format!("{key}.prior.{parameter}");
                mistakes.note(self.check_bounds(&place, parameter, bounds));
            }
            mistakes.into_vec().into_iter().next().map_or(Ok(()), Err)?;
            let refuse =
                |key: &str, problem: &str, help: &str| Err(self.error(key, "", problem, help));
            let mut all = extension.prior.iter();
            let (Some((parameter, &PriorBounds([lower, upper]))), None) = (all.next(), all.next())
            else {
                let help = "Write a table [[extend]] for each parameter.";
                return refuse(&format!("{key}.prior"), "must extend one parameter", help);
            };
            let place = format!("{key}.prior.{parameter}");
            let whole = case.whole_prior();
            let before = whole.as_ref().and_then(|prior| prior.get(parameter));
            let Some([low, high]) = before.map(Prior::range) else {
                return refuse(&place, "is not calibrated", "Extend a parameter of [prior].");
            };
            if lower > high || upper < low || (lower >= low && upper <= high) {
                let help = format!("It is [{low:?}, {high:?}] until here: begin where that ends.");
                let problem = "does not go on where the prior ends";
                return Err(self.error(&place, format!("[{lower:?}, {upper:?}]"), problem, help));
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
                "Name what is calibrated with its prior: matrix.young_mpa = [250.0, 300.0].",
            )));
        }
        for (parameter, prior) in prior.iter() {
            let key = format!("prior.{parameter}");
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
        parameter: &MaterialParameter,
        &PriorBounds([lower, upper]): &PriorBounds,
    ) -> Result<(), InputError> {
        self.check_parameter(key, parameter)?;
        let value = format!("[{lower:?}, {upper:?}]");
        for bound in [lower, upper] {
            self.check_value(key, &value, parameter, bound)?;
        }
        if lower < upper {
            return Ok(());
        }
        let problem = "the lower bound is not below the upper one";
        Err(self.error(key, value, problem, "Write [lower, upper]."))
    }

    /// Checks that the material of the parameter's region accepts this value of the parameter.
    pub(super) fn check_value(
        &self,
        key: &str,
        shown: &str,
        parameter: &MaterialParameter,
        value: f64,
    ) -> Result<(), InputError> {
        let Some(mut material) = self.case.material.get(&parameter.region).cloned() else {
            return Ok(());
        };
        material.set(parameter.property, value);
        match self.in_fem(&parameter.region, &material) {
            Ok(_) => Ok(()),
            Err(FemError::OutOfRange { requirement, .. }) => Err(self.error(
                key,
                shown,
                format!("must be {requirement}"),
                "Check the unit in the key's name.",
            )),
            Err(other) => Err(self.error(key, shown, other.to_string(), "Choose another value.")),
        }
    }

    /// Checks that the region of a parameter exists and has this parameter.
    fn check_parameter(&self, key: &str, parameter: &MaterialParameter) -> Result<(), InputError> {
        let MaterialParameter { region, property } = parameter;
        let Some(material) = self.case.material.get(region) else {
            let known: Vec<&str> = self.case.material.keys().map(String::as_str).collect();
            return Err(self.error(
                key,
                "",
                format!("there is no material {region:?}"),
                format!("Choose one of: {}.", known.join(", ")),
            ));
        };
        let has_damage = self.case.phase_field.is_some() && material.toughness_n_per_mm.is_some();
        if property.is_of_damage() && !has_damage {
            return Err(self.error(
                key,
                "",
                "there is no damage to calibrate",
                format!("Add [phase_field] and material.{region}.toughness_n_per_mm."),
            ));
        }
        if !property.is_of_damage() && material.law.has_constants() {
            return Err(self.error(
                key,
                "",
                "the region's law has no Young's modulus and no Poisson's ratio to calibrate",
                "Give the region a law with young_mpa, such as law = \"hencky\".",
            ));
        }
        Ok(())
    }
}
