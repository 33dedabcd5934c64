//! Quantities of interest, prior, surrogate, sampler and experiments.

use ::surrogate::OrderRule;
use fem::FemError;

use super::super::{
    CaseFile, DiscrepancyCase, Likelihood, MaterialParameter, PriorBounds, PriorCase,
    SpecimenGeometry, VirtualCase,
};
use crate::error::InputError;
use crate::qoi::Quantity;

/// A slope's window is a fifth of the displacement at peak wide and ought to hold two readings.
const LEAST_STEPS: f64 = 10.0;

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
        self.check_quantities(&case.qoi.quantities)?;
        self.check_curve_percent(&case.qoi.curve_percent)?;
        self.check_reach()?;
        if let Some(prior) = &case.prior {
            self.check_prior("prior", prior)?;
        }
        self.check_extensions()?;
        let runs_help = "The paper uses 100; order 3 in three parameters needs more than 20.";
        self.within("design.runs", case.design.runs as f64, 4.0, 1e6, "runs", runs_help)?;
        let max_order = case.surrogate.max_order as f64;
        let help = "Orders up to this one are tried: order 0 alone is a constant, from which \
                    nothing can be calibrated; the paper's choice is 3.";
        self.within("surrogate.max_order", max_order, 1.0, 8.0, whole, help)?;
        if let OrderRule::Fixed(order) = case.surrogate.rule {
            let help = "Write rule = { fixed = 3 }, at most max_order.";
            self.within("surrogate.rule.fixed", order as f64, 1.0, max_order, whole, help)?;
        }
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
        let help = "1 keeps every step, 10 every tenth.";
        self.within("calibration.thin", c.thin as f64, 1.0, 1e4, "", help)?;
        let help = "Steps that are left out after those of tuning.";
        self.within("calibration.burn_in", c.burn_in as f64, 0.0, 1e7, "", help)?;
        let (kept, help) = ((c.chains * c.draws) as f64, "All draws are kept in memory.");
        self.within("calibration.draws", kept, 20.0, 1e7, "draws of all chains together", help)?;
        let help = "0.95 follows the posterior's narrow parts; 0.8 is faster.";
        self.within("calibration.target_accept", c.target_accept, 0.5, 0.999, "", help)?;
        self.check_discrepancy(&c.discrepancy)?;
        self.within(
            "confirm.draws",
            case.confirm.draws as f64,
            0.0,
            1000.0,
            "simulations",
            "A few show the posterior's spread.",
        )
    }

    /// Refuses load steps too few for curves that quantities of interest are taken from. A single
    /// simulation may have fewer, so that [`CaseFile::read`] does not ask.
    ///
    /// # Errors
    /// Names the key and what to write.
    pub(crate) fn check_steps(&self) -> Result<(), InputError> {
        let steps = self.case.test.steps;
        steps.map_or(Ok(()), |steps| self.check_number_of_steps("test.steps", steps))
    }

    /// The same for the steps that a key gives.
    pub(crate) fn check_number_of_steps(&self, key: &str, steps: u32) -> Result<(), InputError> {
        let help = "A curve that a slope and a peak are taken from has points on both sides of \
                    the peak: the paper takes 44 steps. Leave it out for adaptive steps.";
        self.within(key, f64::from(steps), LEAST_STEPS, 1e9, "steps", help)
    }

    fn check_quantities(&self, quantities: &[Quantity]) -> Result<(), InputError> {
        let shown = quantities.iter().map(Quantity::to_string).collect::<Vec<_>>().join(", ");
        let refuse = |problem: &str| {
            let help = "Name each once, as in quantities = [\"slope\", \"peak-force\"].";
            Err(self.error("qoi.quantities", format!("[{shown}]"), problem, help))
        };
        if quantities.is_empty() {
            return refuse("nothing is compared");
        }
        if (1..quantities.len()).any(|i| quantities[..i].contains(&quantities[i])) {
            return refuse("one is named twice");
        }
        Ok(())
    }

    /// Refuses a test that ends before what its curve is compared by. How far a force has fallen somewhere
    /// past its peak is not known before the run: that of viscous damage, x e^((1 − x³)/3) of the peak at x
    /// displacements at peak, falls faster than a rate-independent one.
    fn check_reach(&self) -> Result<(), InputError> {
        let (test, compared) = (&self.case.test, self.case.compared());
        let farthest = compared.iter().filter_map(|q| Some((q.reach()?, *q)));
        let farthest = farthest.max_by(|a, b| a.0.total_cmp(&b.0));
        if let (Some((reach, quantity)), Some(stop)) = (farthest, test.stop_below_peak) {
            let fall = 1.0 - reach * ((1.0 - reach.powi(3)) / 3.0).exp();
            if stop < fall {
                let named = match self.case.calibration.likelihood {
                    Likelihood::Quantities => "qoi.quantities",
                    Likelihood::Curve => "qoi.curve_percent",
                };
                let problem = format!(
                    "ends curves before {:.0} % of their displacement at peak, where {named} needs them for \
                     {quantity}",
                    100.0 * reach
                );
                let enough = (100.0 * fall + 2.0).ceil().min(99.0) / 100.0;
                let help = format!(
                    "Viscous damage is {:.0} % below its peak there: write {enough} or more, or leave the key out.",
                    100.0 * fall
                );
                return Err(self.error("test.stop_below_peak", stop.to_string(), problem, help));
            }
        }
        let Some(end) = test.displacement_mm else { return Ok(()) };
        let is_beyond = |q: &&Quantity| match **q {
            Quantity::ForceAt(place_um) => f64::from(place_um) > 1000.0 * end.abs(),
            _ => false,
        };
        compared.iter().find(is_beyond).map_or(Ok(()), |quantity| {
            let problem = format!("lies beyond the end of the test, test.displacement_mm = {end}");
            let help = "Name a displacement before all peaks, which every run reaches.";
            Err(self.error("qoi.quantities", quantity.to_string(), problem, help))
        })
    }

    fn check_curve_percent(&self, percent: &[u8]) -> Result<(), InputError> {
        let key = "qoi.curve_percent";
        let help = "Write them in order, as in curve_percent = [25, 50, 75]; the peak itself is \
                    compared besides.";
        for &one in percent {
            let most = f64::from(Quantity::LARGEST_PERCENT);
            self.within(key, f64::from(one), 1.0, most, "% of the displacement at peak", help)?;
        }
        let ascends = percent.windows(2).all(|pair| pair[0] < pair[1]);
        if ascends && !percent.is_empty() && !percent.contains(&100) {
            return Ok(());
        }
        let problem = match ascends {
            true if percent.is_empty() => "names no part of the curve",
            true => "at 100 % the force is that of the peak",
            false => "are not in ascending order",
        };
        Err(self.error(key, format!("{percent:?}"), problem, help))
    }

    fn check_discrepancy(&self, discrepancy: &DiscrepancyCase) -> Result<(), InputError> {
        let compared = self.case.compared();
        for (quantity, &percent) in &discrepancy.percent {
            let key = format!("calibration.discrepancy.percent.{quantity}");
            if !compared.contains(quantity) {
                let known: Vec<String> = compared.iter().map(Quantity::to_string).collect();
                let help = format!("What is compared is: {}.", known.join(", "));
                return Err(self.error(&key, percent.to_string(), "is not compared", help));
            }
            let help = "It is the standard deviation of the model's own error: 3.0 for one that may \
                        be 3 % off. Leave the quantity out where there is none.";
            self.within(&key, percent, 1e-3, 100.0, "%", help)?;
        }
        Ok(())
    }

    /// Each extension goes on where the box before it ends, in one parameter.
    fn check_extensions(&self) -> Result<(), InputError> {
        let mut case = self.case.clone();
        case.extend.clear();
        for (k, extension) in self.case.extend.iter().enumerate() {
            let key = format!("extend[{k}]");
            let help = "As many as the first batch fill a box of the same width alike.";
            self.within(&format!("{key}.runs"), extension.runs as f64, 1.0, 1e6, "runs", help)?;
            self.check_prior(&format!("{key}.prior"), &extension.prior)?;
            let refuse =
                |key: &str, problem: &str, help: &str| Err(self.error(key, "", problem, help));
            let mut all = extension.prior.iter();
            let (Some((parameter, &PriorBounds([lower, upper]))), None) = (all.next(), all.next())
            else {
                let help = "Write a table [[extend]] for each parameter.";
                return refuse(&format!("{key}.prior"), "extends several parameters at once", help);
            };
            let place = format!("{key}.prior.{parameter}");
            let whole = case.whole_prior();
            let before = whole.as_ref().and_then(|prior| prior.get(parameter));
            let Some(&PriorBounds([low, high])) = before else {
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

    fn check_prior(&self, table: &str, prior: &PriorCase) -> Result<(), InputError> {
        if prior.parameters().len() == 0 {
            return Err(self.error(
                table,
                "",
                "names no parameter",
                "Name what is calibrated with its bounds: matrix.young_mpa = [250.0, 300.0].",
            ));
        }
        for (parameter, &PriorBounds([lower, upper])) in prior.iter() {
            let key = format!("{table}.{parameter}");
            self.check_parameter(&key, parameter)?;
            let value = format!("[{lower:?}, {upper:?}]");
            for bound in [lower, upper] {
                self.check_value(&key, &value, parameter, bound)?;
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

    /// Whether the material of a parameter's region can have this value of it.
    fn check_value(
        &self,
        key: &str,
        shown: &str,
        parameter: &MaterialParameter,
        value: f64,
    ) -> Result<(), InputError> {
        let Some(mut material) = self.case.material.get(&parameter.region).cloned() else {
            return Ok(());
        };
        parameter.property.set(&mut material, value);
        match self.in_fem(&parameter.region, &material) {
            Ok(_) => Ok(()),
            Err(FemError::Parameter { requirement, .. }) => Err(self.error(
                key,
                shown,
                format!("must be {requirement}"),
                "Check the unit in the key's name.",
            )),
            Err(other) => Err(self.error(key, shown, other.to_string(), "Choose another value.")),
        }
    }

    /// Whether a parameter is one of a region that has it.
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

    pub(super) fn check_experiments(&self, geometry: &SpecimenGeometry) -> Result<(), InputError> {
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
            (None, Some(specimens)) => self.check_virtual(specimens, geometry),
        }
    }

    fn check_virtual(
        &self,
        v: &VirtualCase,
        geometry: &SpecimenGeometry,
    ) -> Result<(), InputError> {
        let SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } = geometry else {
            return Err(self.error(
                "experiments.virtual",
                "",
                "virtual specimens need a cylinder to put their own grains in",
                "Give specimen.radius_mm, height_mm and spacing_mm instead of a mesh or an image.",
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
        if v.scans && !matches!(geometry, SpecimenGeometry::Cylinder { scan: Some(_), .. }) {
            return Err(self.error(
                "experiments.virtual.scans",
                "true",
                "there is no scanner",
                "Add a table [specimen.scan], or leave out scans.",
            ));
        }
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
        let given = |table: &str, parameter: &MaterialParameter| {
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
            self.check_value(&key, &value.to_string(), parameter, value)?;
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
