//! Quantities of interest, prior, surrogate, sampler and experiments.

use super::super::{CaseFile, PriorCase, Shape, VirtualCase};
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
        let runs_mend = "The paper uses 100; order 3 in three parameters needs more than 20.";
        self.within("design.runs", case.design.runs as f64, 4.0, 1e6, "runs", runs_mend)?;
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
        let mend = "0.95 follows the posterior's narrow parts; 0.8 is faster.";
        self.within("calibration.target_accept", c.target_accept, 0.5, 0.999, "", mend)?;
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
        let Some(material) = self.case.material.get(&prior.region) else {
            let known: Vec<&str> = self.case.material.keys().map(String::as_str).collect();
            return Err(self.error(
                "prior.region",
                format!("{:?}", prior.region),
                "there is no such material",
                format!("Choose one of: {}.", known.join(", ")),
            ));
        };
        if self.case.phase_field.is_none() || material.toughness_n_per_mm.is_none() {
            return Err(self.error(
                "prior",
                "",
                "there is no damage to calibrate",
                format!("Add [phase_field] and material.{}.toughness_n_per_mm.", prior.region),
            ));
        }
        if material.law.has_constants() {
            return Err(self.error(
                "prior.region",
                format!("{:?}", prior.region),
                "its law has no Young's modulus to calibrate",
                "Give the region a law with young_mpa, such as law = \"hencky\".",
            ));
        }
        let most = [1e7, 1e3, 1e4];
        for ((name, [lower, upper]), most) in PriorCase::NAMES.iter().zip(prior.bounds()).zip(most)
        {
            let value = format!("[{lower:?}, {upper:?}]");
            let key = format!("prior.{name}");
            if !(lower > 0.0 && upper <= most && upper.is_finite()) {
                return Err(self.error(
                    &key,
                    value,
                    format!("must be above 0 and at most {most:.0}"),
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

    pub(super) fn check_experiments(&self, shape: &Shape) -> Result<(), InputError> {
        let Some(experiments) = &self.case.experiments else {
            return Ok(());
        };
        match (&experiments.table, &experiments.laboratory) {
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
            // only the laboratory stage needs the file: see `CaseFile::table`
            (Some(_), None) => Ok(()),
            (None, Some(laboratory)) => self.check_laboratory(laboratory, shape),
        }
    }

    fn check_laboratory(&self, v: &VirtualCase, shape: &Shape) -> Result<(), InputError> {
        let Shape::Lattice { radius_mm, height_mm, .. } = shape else {
            return Err(self.error(
                "experiments.virtual",
                "",
                "virtual specimens need a lattice to put their own grains on",
                "Give specimen.radius_mm, height_mm and spacing_mm instead of a mesh.",
            ));
        };
        if self.case.prior.is_none() {
            return Err(self.error(
                "prior",
                "",
                "is missing",
                "Virtual specimens vary the parameters that [prior] calibrates.",
            ));
        }
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
        let most = [1e7, 1e3, 1e4];
        for ((name, value), most) in PriorCase::NAMES.iter().zip(v.truth.to_array()).zip(most) {
            let key = format!("experiments.virtual.truth.{name}");
            self.within(&key, value, 1e-9, most, "", "Check the unit in the key's name.")?;
        }
        let s = &v.scatter;
        for (name, value) in
            [("young", s.young), ("toughness", s.toughness), ("viscosity", s.viscosity)]
        {
            let key = format!("experiments.virtual.scatter.{name}");
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
