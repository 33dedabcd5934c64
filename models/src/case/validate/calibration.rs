//! Quantities of interest, prior, surrogate, sampler and experiments.

use super::super::{Bounds, CaseFile, Parameter, PriorCase, Shape, VirtualCase};
use crate::error::InputError;

impl CaseFile {
    pub(super) fn check_calibration(&self) -> Result<(), InputError> {
        let (case, whole) = (&self.case, "a whole number");
        self.within(
            "qoi.slope_fraction",
            case.qoi.slope_fraction,
            0.1,
            0.9,
            "of the displacement at peak",
            "The paper takes 0.3.",
        )?;
        if let Some(prior) = &case.prior {
            self.check_prior(prior)?;
        }
        let runs_help = "The paper uses 100; order 3 in three parameters needs more than 20.";
        self.within("design.runs", case.design.runs as f64, 4.0, 1e6, "runs", runs_help)?;
        self.within(
            "surrogate.max_order",
            case.surrogate.max_order as f64,
            0.0,
            8.0,
            whole,
            "Orders 0 to 8 are tried; the paper's choice is 3.",
        )?;
        let c = &case.calibration;
        self.within(
            "calibration.chains",
            c.chains as f64,
            1.0,
            64.0,
            "chains",
            "Four chains show whether they agree.",
        )?;
        self.within(
            "calibration.warmup",
            c.warmup as f64,
            20.0,
            1e6,
            "draws",
            "1000 are ample for nine parameters.",
        )?;
        self.within(
            "calibration.draws",
            c.draws as f64,
            20.0,
            1e7,
            "draws",
            "2000 a chain give quantiles to a few per cent.",
        )?;
        let help = "0.95 follows the posterior's narrow parts; 0.8 is faster.";
        self.within("calibration.target_accept", c.target_accept, 0.5, 0.999, "", help)?;
        self.within(
            "confirm.draws",
            case.confirm.draws as f64,
            0.0,
            1000.0,
            "simulations",
            "A few show the posterior's spread.",
        )
    }

    fn check_prior(&self, prior: &PriorCase) -> Result<(), InputError> {
        if prior.parameters().len() == 0 {
            return Err(self.error(
                "prior",
                "",
                "names no parameter",
                "Name what is calibrated with its bounds: matrix.young_mpa = [250.0, 300.0].",
            ));
        }
        for (parameter, &Bounds([lower, upper])) in prior.iter() {
            let key = format!("prior.{parameter}");
            self.check_parameter(&key, parameter)?;
            let value = format!("[{lower:?}, {upper:?}]");
            let [least, most] = parameter.property.range();
            let above = if least < 0.0 { lower >= least } else { lower > 0.0 };
            if !(above && upper <= most) {
                return Err(self.error(
                    &key,
                    value,
                    format!("must be above {} and at most {most}", least.min(0.0)),
                    "Check the unit in the key's name.",
                ));
            }
            if lower >= upper {
                return Err(self.error(
                    &key,
                    value,
                    "the lower bound is not below the upper one",
                    "Write [lower, upper].",
                ));
            }
        }
        Ok(())
    }

    /// Whether a parameter is one of a region that has it.
    fn check_parameter(&self, key: &str, parameter: &Parameter) -> Result<(), InputError> {
        let Parameter { region, property } = parameter;
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

    pub(super) fn check_experiments(&self, shape: &Shape) -> Result<(), InputError> {
        let Some(experiments) = &self.case.experiments else {
            return Ok(());
        };
        match (&experiments.table, &experiments.virtual_specimens) {
            (None, None) => Err(self.error(
                "experiments",
                "",
                "neither table nor virtual is given",
                "Write table = \"specimens.csv\" or virtual = { … }.",
            )),
            (Some(table), Some(_)) => Err(self.error(
                "experiments.table",
                table.display().to_string(),
                "stands beside experiments.virtual",
                "Specimens are either measured or virtual: remove one of the two.",
            )),
            // only the experiments stage needs the file: see `CaseFile::table`
            (Some(_), None) => Ok(()),
            (None, Some(specimens)) => self.check_virtual(specimens, shape),
        }
    }

    fn check_virtual(&self, v: &VirtualCase, shape: &Shape) -> Result<(), InputError> {
        let Shape::Lattice { radius_mm, height_mm, .. } = shape else {
            return Err(self.error(
                "experiments.virtual",
                "",
                "virtual specimens need a lattice to put their own grains on",
                "Give specimen.radius_mm, height_mm and spacing_mm instead of a mesh.",
            ));
        };
        let Some(prior) = &self.case.prior else {
            return Err(self.error(
                "prior",
                "",
                "is missing",
                "Virtual specimens vary the parameters that [prior] calibrates.",
            ));
        };
        self.within(
            "experiments.virtual.specimens",
            v.specimens as f64,
            2.0,
            1000.0,
            "specimens",
            "The paper has 8 curves at 50 °C.",
        )?;
        if let Some(spacing) = v.spacing_mm {
            self.check_spacing("experiments.virtual.spacing_mm", spacing, *radius_mm, *height_mm)?;
        }
        if let Some(parameter) = prior.parameters().find(|p| v.truth.get(p).is_none()) {
            return Err(self.error(
                &format!("experiments.virtual.truth.{parameter}"),
                "",
                "is missing",
                "Give the true value of every parameter that [prior] calibrates.",
            ));
        }
        let given = |table: &str, parameter: &Parameter| {
            let key = format!("experiments.virtual.{table}.{parameter}");
            match prior.get(parameter) {
                Some(_) => Ok(key),
                None => Err(self.error(
                    &key,
                    "",
                    "is not calibrated",
                    format!("[prior] has: {}.", prior.names().collect::<Vec<_>>().join(", ")),
                )),
            }
        };
        for (parameter, &value) in v.truth.iter() {
            let key = given("truth", parameter)?;
            let [least, most] = parameter.property.range();
            let (unit, _) = parameter.property.help();
            // the scatter multiplies it
            let least = least.max(1e-9);
            self.within(&key, value, least, most, unit, "Check the unit in the key's name.")?;
        }
        for (parameter, &value) in v.scatter.iter() {
            let key = given("scatter", parameter)?;
            self.within(&key, value, 0.0, 1.0, "", "It is relative: 0.03 is 3 %.")?;
        }
        self.within(
            "experiments.virtual.noise.force_n",
            v.noise.force_n,
            0.0,
            1e6,
            "N",
            "It is the standard deviation of one reading.",
        )?;
        self.within(
            "experiments.virtual.noise.displacement_mm",
            v.noise.displacement_mm,
            0.0,
            1.0,
            "mm",
            "It is the standard deviation of one reading.",
        )
    }
}
