//! Ranges, units and agreement between the keys of a case.

use super::{CaseFile, MaterialCase, PlatensName, PriorCase, Shape, VirtualCase};
use crate::error::{InputError, closest};

/// More tetrahedra than this are taken for a slip in the spacing.
const MOST_TETS: f64 = 2e7;

impl CaseFile {
    /// Names of the regions whose materials the case must give.
    fn regions(&self, shape: &Shape) -> Vec<String> {
        match shape {
            Shape::Mesh { regions, .. } => regions.keys().cloned().collect(),
            Shape::Lattice { grains: Some(_), .. } => vec!["matrix".into(), "grain".into()],
            Shape::Lattice { grains: None, .. } => vec!["matrix".into()],
        }
    }

    /// Checks every value.
    pub(super) fn validate(&self) -> Result<(), InputError> {
        let shape = self.shape()?;
        self.check_specimen(&shape)?;
        for region in self.regions(&shape) {
            if !self.case.material.contains_key(&region) {
                let given: Vec<&str> = self.case.material.keys().map(String::as_str).collect();
                let hint = closest(&region, given.iter().copied())
                    .map(|slip| format!("Is material.{slip} meant? "))
                    .unwrap_or_default();
                return Err(self.error(
                    &format!("material.{region}"),
                    "",
                    "is missing: the specimen has this region",
                    format!("{hint}Add a table [material.{region}]."),
                ));
            }
        }
        for (region, material) in &self.case.material {
            self.check_material(region, material)?;
        }
        self.check_test()?;
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
        )?;
        self.check_experiments(&shape)
    }

    fn check_specimen(&self, shape: &Shape) -> Result<(), InputError> {
        let order = self.case.specimen.order;
        self.within(
            "specimen.order",
            f64::from(order),
            1.0,
            2.0,
            "(linear or quadratic)",
            "Write order = 1 or order = 2.",
        )?;
        if let Shape::Lattice { radius_mm, height_mm, spacing_mm, grains } = shape {
            let mend = "Lengths are in mm; the paper's cylinder is 2.5 by 4.4 mm.";
            self.within("specimen.radius_mm", *radius_mm, 1e-3, 1e3, "mm", mend)?;
            self.within("specimen.height_mm", *height_mm, 1e-3, 1e3, "mm", mend)?;
            self.check_spacing("specimen.spacing_mm", *spacing_mm, *radius_mm, *height_mm)?;
            if let Some(grains) = grains {
                let mend = "It is a volume fraction; the paper's meshes have 0.19 to 0.27.";
                self.within(
                    "specimen.grains.fraction",
                    grains.fraction,
                    0.0,
                    0.5,
                    "of the volume",
                    mend,
                )?;
            }
        }
        Ok(())
    }

    fn check_spacing(
        &self,
        key: &str,
        spacing_mm: f64,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<(), InputError> {
        let coarsest = radius_mm.min(height_mm);
        self.within(
            key,
            spacing_mm,
            1e-6,
            coarsest,
            "mm",
            "It is the edge of the lattice's cells; 0.7 mm suits a cylinder of 2.5 mm radius.",
        )?;
        let tets = 12.0 * std::f64::consts::PI * radius_mm.powi(2) * height_mm / spacing_mm.powi(3);
        if tets > MOST_TETS {
            return Err(self.error(
                key,
                spacing_mm.to_string(),
                format!("makes about {tets:.1e} tetrahedra"),
                "Take a coarser spacing: the number grows with its third power.",
            ));
        }
        Ok(())
    }

    fn check_material(&self, region: &str, m: &MaterialCase) -> Result<(), InputError> {
        let key = |name: &str| format!("material.{region}.{name}");
        let young =
            "Young's modulus is in MPa: 275.0 for the paper's matrix, 22000.0 for its grains.";
        self.within(&key("young_mpa"), m.young_mpa, 1e-3, 1e7, "MPa", young)?;
        self.within(
            &key("poisson"),
            m.poisson,
            -0.99,
            0.495,
            "",
            "Incompressible solids need another element; 0.25 is the paper's value.",
        )?;
        if let Some(toughness) = m.toughness_n_per_mm {
            let mend = "It is in N/mm: 1 pJ/µm² = 0.001 N/mm. For an elastic region leave it out.";
            self.within(&key("toughness_n_per_mm"), toughness, 1e-9, 1e3, "N/mm", mend)?;
        }
        self.within(
            &key("viscosity_mpa_s"),
            m.viscosity_mpa_s,
            0.0,
            1e4,
            "MPa s",
            "The paper's matrix has 0.3 MPa s.",
        )?;
        self.within(
            &key("residual_stiffness"),
            m.residual_stiffness,
            1e-9,
            0.5,
            "of the stiffness",
            "It keeps full damage solvable; 0.01 is the paper's value.",
        )
    }

    fn check_test(&self) -> Result<(), InputError> {
        let case = &self.case;
        if let Some(field) = &case.phase_field {
            self.within(
                "phase_field.length_mm",
                field.length_mm,
                1e-6,
                1e3,
                "mm",
                "It is the width of a smeared crack; the paper takes 0.06 mm.",
            )?;
        }
        let half_height = case.specimen.height_mm.map_or(1e3, |h| 0.5 * h);
        let test = &case.test;
        self.within(
            "test.displacement_mm",
            test.displacement_mm,
            1e-9,
            half_height,
            "mm",
            "It is how far the top platen moves down: at most half the height.",
        )?;
        self.within(
            "test.duration_s",
            test.duration_s,
            1e-9,
            1e9,
            "s",
            "Only viscosity over duration matters; 1.0 reproduces the paper.",
        )?;
        if let Some(steps) = test.steps {
            self.within(
                "test.steps",
                f64::from(steps),
                1.0,
                1e6,
                "steps",
                "Write steps = 44, or leave it out for adaptive steps.",
            )?;
        }
        if let Some(share) = test.stop_below_peak {
            self.within(
                "test.stop_below_peak",
                share,
                0.03,
                1.0,
                "of the peak force",
                "0.1 stops once the force is 10 % below its peak.",
            )?;
        }
        self.check_stepping()?;
        self.check_platens()?;
        let solver = &case.solver;
        let mend = "1e-8 suits most; a looser one shows in the curve.";
        self.within("solver.tolerance", solver.tolerance, 1e-14, 1e-2, "", mend)?;
        for (key, value) in
            [("solver.iterations", solver.iterations), ("solver.alternations", solver.alternations)]
        {
            let mend = "Leave it out for the default.";
            self.within(key, f64::from(value), 1.0, 1e6, "iterations", mend)?;
        }
        Ok(())
    }

    fn check_stepping(&self) -> Result<(), InputError> {
        let test = &self.case.test;
        let given = [
            ("steps", test.steps.is_some()),
            ("adaptive", test.adaptive.is_some()),
            ("arc_length", test.arc_length.is_some()),
        ];
        let mut given = given.iter().filter(|(_, given)| *given).map(|(key, _)| *key);
        if let (Some(first), Some(second)) = (given.next(), given.next()) {
            return Err(self.error(
                &format!("test.{second}"),
                "",
                format!("stands beside test.{first}"),
                "Keep one of steps, adaptive and arc_length.",
            ));
        }
        let shares =
            test.adaptive.map(|a| [("adaptive.first", a.first), ("adaptive.largest", a.largest)]);
        for (key, share) in shares.into_iter().flatten() {
            let mend = "It is a share of the displacement: 0.01 and 0.025 suit most.";
            self.within(&format!("test.{key}"), share, 1e-5, 1.0, "of the displacement", mend)?;
        }
        if let Some(arc) = test.arc_length {
            let mend = "It is a share of the displacement, such as 0.025.";
            self.within("test.arc_length.step", arc.step, 1e-5, 1.0, "of the displacement", mend)?;
            let mend = "A fiftieth of toughness times cross-section is a start.";
            self.within(
                "test.arc_length.release_n_mm",
                arc.release_n_mm,
                1e-12,
                1e6,
                "N mm",
                mend,
            )?;
            if self.case.output.checkpoint_every > 0 {
                return Err(self.error(
                    "output.checkpoint_every",
                    self.case.output.checkpoint_every.to_string(),
                    "cannot save the state of arc-length steps",
                    "Write checkpoint_every = 0.",
                ));
            }
        }
        Ok(())
    }

    fn check_platens(&self) -> Result<(), InputError> {
        let test = &self.case.test;
        let resists = [
            ("test.friction", test.friction, 10.0, "Coulomb's coefficient is about 0.1 to 0.6."),
            (
                "test.drag_mpa_s_per_mm",
                test.drag_mpa_s_per_mm,
                1e6,
                "The paper's value is 0.01 MPa s/mm.",
            ),
        ];
        for (key, value, most, mend) in resists {
            self.within(key, value, 0.0, most, "", mend)?;
            if value > 0.0 && test.platens == PlatensName::Sliding {
                return Err(self.error(
                    key,
                    value.to_string(),
                    "is given, but the platens are sliding ones, which resist nothing",
                    "Write platens = \"unilateral\", or leave it out.",
                ));
            }
        }
        self.within(
            "test.slip_velocity_mm_per_s",
            test.slip_velocity_mm_per_s,
            1e-9,
            1e6,
            "mm/s",
            "Take a hundredth of the velocity at which the ends slide.",
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

    fn check_experiments(&self, shape: &Shape) -> Result<(), InputError> {
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

    /// Refuses a value outside `lower..=upper`, NaN included.
    fn within(
        &self,
        key: &str,
        value: f64,
        lower: f64,
        upper: f64,
        unit: &str,
        mend: &str,
    ) -> Result<(), InputError> {
        if (lower..=upper).contains(&value) {
            return Ok(());
        }
        let problem = format!("must lie between {lower} and {upper} {unit}");
        Err(self.error(key, value.to_string(), problem.trim_end(), mend))
    }
}
