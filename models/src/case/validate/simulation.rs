//! Checks of specimen, materials, test and solver.

use fem::{FemError, Fracture, Packing, PhaseField, Platens, Segmentation, Unsupported};

use super::super::{Case, CaseFile, MaterialCase, Mistakes, NotchCase, Property, SpecimenGeometry};
use super::program::check_program;
use super::test_kind::check_kind;
use crate::error::InputError;

/// Largest number of tetrahedra; a larger number is assumed to be a typing error in the spacing.
const MOST_TETS: f64 = 2e7;

impl CaseFile {
    pub(super) fn check_specimen(&self, geometry: &SpecimenGeometry, mistakes: &mut Mistakes) {
        self.check_voxels(mistakes);
        let (size, meshing) = match geometry {
            SpecimenGeometry::Mesh { .. } | SpecimenGeometry::Absent => return,
            SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, scan, meshing } => {
                let size = [Some(*radius_mm), Some(*height_mm)];
                self.check_size(size, mistakes);
                let is_sound = *radius_mm > 0.0 && *height_mm > 0.0;
                if let Some(packing) = grains.as_ref().filter(|_| is_sound) {
                    mistakes.note(self.check_packing(packing, *radius_mm, *height_mm));
                }
                if let Some((scanner, segmentation)) = scan {
                    mistakes
                        .note(scanner.validate().map_err(|e| self.refused("specimen.scan", &e)));
                    mistakes.note(self.check_segmentation(segmentation));
                }
                (size, meshing)
            }
            SpecimenGeometry::Block { size_mm, notch, planes_mm, meshing } => {
                mistakes.note(self.check_block(*size_mm, *notch));
                mistakes.note(self.check_block_spacing(
                    "specimen.spacing_mm",
                    *size_mm,
                    planes_mm,
                    meshing.spacing_mm,
                ));
                return;
            }
            SpecimenGeometry::Image { segmentation, radius_mm, height_mm, meshing, .. } => {
                mistakes.note(self.check_segmentation(segmentation));
                let size = [*radius_mm, *height_mm];
                self.check_size(size, mistakes);
                (size, meshing)
            }
            SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } => {
                mistakes.note(import.validate().map_err(|e| self.refused("specimen.stl", &e)));
                let size = [*radius_mm, *height_mm];
                self.check_size(size, mistakes);
                (size, meshing)
            }
        };
        let (key, spacing_mm) = ("specimen.spacing_mm", meshing.spacing_mm);
        // the size of an image or of surfaces is unknown until the stage `mesh` reads their files; that stage then
        // compares the spacing with the size
        mistakes.note(match size {
            [Some(radius_mm), Some(height_mm)] => {
                self.check_spacing(key, spacing_mm, radius_mm, height_mm)
            }
            _ => {
                let help = "It is the edge of the lattice's cells.";
                self.within(key, spacing_mm, 1e-6, 1e3, "mm", help)
            }
        });
        mistakes.note(meshing.validate().map_err(|e| self.refused("specimen", &e)));
    }

    fn check_size(&self, [radius_mm, height_mm]: [Option<f64>; 2], mistakes: &mut Mistakes) {
        let help = "Lengths are in mm; the paper's cylinder is 2.5 by 4.4 mm.";
        for (key, length) in [("radius_mm", radius_mm), ("height_mm", height_mm)] {
            if let Some(length) = length {
                let key = format!("specimen.{key}");
                mistakes.note(self.within(&key, length, 1e-3, 1e3, "mm", help));
            }
        }
    }

    fn check_block(&self, size_mm: [f64; 3], notch: Option<NotchCase>) -> Result<(), InputError> {
        let help = "block_mm = [length along x, width along y, depth along z], in mm.";
        for size in size_mm {
            self.within("specimen.block_mm", size, 1e-3, 1e4, "mm", help)?;
        }
        let Some(NotchCase { depth_mm, width_mm }) = notch else { return Ok(()) };
        let [length, _, depth] = size_mm;
        for (name, value, largest, of) in
            [("depth_mm", depth_mm, depth, "depth"), ("width_mm", width_mm, length, "length")]
        {
            if !(value > 0.0 && value < largest) {
                let key = format!("specimen.notch.{name}");
                let problem = format!("must lie between 0 and the {of} of the block, {largest} mm");
                let help = "The notch is open at the bottom, in the middle of the length.";
                return Err(self.error(&key, value.to_string(), problem, help));
            }
        }
        Ok(())
    }

    /// Checks the spacing of a block, whose mesh has nodes at all `planes_mm` along x.
    pub(in crate::case) fn check_block_spacing(
        &self,
        key: &str,
        size_mm: [f64; 3],
        planes_mm: &[f64],
        spacing_mm: f64,
    ) -> Result<(), InputError> {
        let help =
            "It is the longest edge of the hexahedra of which each is split into six tetrahedra.";
        let least = size_mm.into_iter().fold(f64::INFINITY, f64::min);
        self.within(key, spacing_mm, 1e-6, least.max(1e-6), "mm", help)?;
        // each plane adds at most one cell to the length
        let cells = |size: f64, planes: usize| (size / spacing_mm).ceil() + planes as f64;
        let [x, y, z] = size_mm;
        let tets = 6.0 * cells(x, planes_mm.len() + 4) * cells(y, 0) * cells(z, 1);
        if tets > MOST_TETS {
            let problem = format!("makes some {tets:.1e} tetrahedra");
            return Err(self.error(key, spacing_mm.to_string(), problem, help));
        }
        Ok(())
    }

    fn check_packing(
        &self,
        packing: &Packing,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<(), InputError> {
        let help = "It is a volume fraction; the paper's meshes have 0.19 to 0.27.";
        let (key, fraction) = ("specimen.grains.fraction", packing.fraction);
        self.within(key, fraction, 0.0, 0.5, "of the volume", help)?;
        if fraction == 0.0 {
            return Ok(());
        }
        packing.validate(radius_mm, height_mm).map_err(|e| self.refused("specimen.grains", &e))
    }

    /// Checks `voxel_mm` and `bin` of `[specimen.image]`, also in a case with a virtual scan, which does not use them.
    fn check_voxels(&self, mistakes: &mut Mistakes) {
        let Some(image) = &self.case.specimen.image else { return };
        if let Some(voxel_mm) = image.voxel_mm {
            let help =
                "It is the edge of a voxel; remove it if the tags of the file state the edge.";
            let key = "specimen.image.voxel_mm";
            mistakes.note(self.within(key, voxel_mm, 1e-9, 1e2, "mm", help));
        }
        let help = "It averages blocks of bin × bin × bin voxels; 1 means no averaging.";
        let bin = image.bin as f64;
        mistakes.note(self.within("specimen.image.bin", bin, 1.0, 1000.0, "voxels", help));
    }

    fn check_segmentation(&self, segmentation: &Segmentation) -> Result<(), InputError> {
        segmentation.check().map_err(|e| self.refused("specimen.image", &e))
    }

    /// Converts an error of `fem`, which names field, value and accepted values, to an error at a table of the case.
    fn refused(&self, table: &str, error: &dyn std::error::Error) -> InputError {
        let help = "breccia init writes a case that explains every key.";
        self.error(table, "", error.to_string(), help)
    }

    /// Checks that a lattice of this spacing results in a mesh of a size that can be computed.
    pub(crate) fn check_spacing(
        &self,
        key: &str,
        spacing_mm: f64,
        radius_mm: f64,
        height_mm: f64,
    ) -> Result<(), InputError> {
        let coarsest = radius_mm.min(height_mm);
        if coarsest.is_nan() || coarsest <= 0.0 {
            // the check of the radius and the height reports the invalid size
            return Ok(());
        }
        self.within(
            key,
            spacing_mm,
            1e-6,
            coarsest,
            "mm",
            "It is the edge of the lattice's cells; 1 mm suits a cylinder of 2.5 mm radius.",
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

    pub(super) fn check_material(&self, region: &str, m: &MaterialCase, mistakes: &mut Mistakes) {
        let mut is_complete = true;
        for (property, value) in [(Property::Young, m.young_mpa), (Property::Poisson, m.poisson)] {
            let key = format!("material.{region}.{}", property.key());
            let mistake = match (value, m.law.has_constants()) {
                (None, false) => {
                    let help = format!("Add it. {}", property.help());
                    self.error(&key, "", "is missing", help)
                }
                (Some(value), true) => self.error(
                    &key,
                    value.to_string(),
                    "is given, but the law has constants of its own",
                    "Remove it: the constants of the law determine the stiffness.",
                ),
                _ => continue,
            };
            is_complete = false;
            mistakes.note(Err(mistake));
        }
        if m.viscoelastic.is_some() && m.plastic.is_some() {
            is_complete = false;
            mistakes.note(Err(self.error(
                &format!("material.{region}.plastic"),
                "",
                "cannot be combined with viscoelastic",
                "A region is viscoelastic or plastic: remove one of the two.",
            )));
        }
        if let Some(shift) = m.viscoelastic.as_ref().and_then(|series| series.shift) {
            mistakes.note(self.check_shift(region, &shift));
        }
        if is_complete {
            let checked = self.in_fem(region, m);
            mistakes.note(checked.map_err(|error| self.material_error(region, error)));
        }
        // `fem` ignores the constants of damage in a region without a toughness; a wrong value is reported nevertheless
        if m.toughness_n_per_mm.is_none() {
            let checked = Fracture {
                toughness_n_per_mm: 1.0,
                viscosity_mpa_s: m.viscosity_mpa_s,
                residual_stiffness: m.residual_stiffness,
            };
            mistakes
                .note(checked.validate(region).map_err(|error| self.material_error(region, error)));
        }
    }

    /// Checks that the time shift of a region has a temperature at which it is valid.
    fn check_shift(&self, region: &str, shift: &fem::TimeShift) -> Result<(), InputError> {
        let Some(celsius) = self.case.test.temperature_celsius else {
            return Err(self.error(
                "test.temperature_celsius",
                "",
                format!("is missing, but material.{region}.viscoelastic.shift depends on it"),
                "Add the temperature of the test in °C, or leave the shift out.",
            ));
        };
        match shift.validate("test", celsius) {
            // a wrong reference temperature is reported by the check of the material
            Ok(()) | Err(FemError::OutOfRange { field: "reference_celsius", .. }) => Ok(()),
            Err(error) => {
                let key = format!("material.{region}.viscoelastic.shift");
                let help = "Check its constants and the temperature.";
                Err(self.error(&key, "", error.to_string(), help))
            }
        }
    }

    /// Checks a material of a region with the checks of `fem`.
    pub(super) fn in_fem(&self, region: &str, material: &MaterialCase) -> Result<(), FemError> {
        material.in_fem()?.validate(region, self.case.phase_field.as_ref())
    }

    /// Converts an error of `fem` about the material of a region to an error that names the key of the case.
    fn material_error(&self, region: &str, error: FemError) -> InputError {
        match error {
            FemError::OutOfRange { entity, field, value, requirement }
                if entity.starts_with(&format!("material.{region}.")) =>
            {
                let (key, problem) =
                    (format!("{entity}.{field}"), format!("must be {requirement}"));
                let is_strength = entity.ends_with(".strength");
                let page = if is_strength { "strength" } else { "memory" };
                let help = format!("See docs/how-to/{page}.md.");
                self.error(&key, value.to_string(), problem, help)
            }
            FemError::OutOfRange { field, value, requirement, .. } => {
                let property = Property::ALL.into_iter().find(|p| p.key() == field);
                let table = if property.is_some() { "" } else { "law.ogden.terms." };
                let help = property.map_or("Leave the term out.", Property::help);
                let key = format!("material.{region}.{table}{field}");
                self.error(&key, value.to_string(), format!("must be {requirement}"), help)
            }
            FemError::Unsupported { reason, .. } => {
                let key = match reason {
                    Unsupported::StrengthWithoutToughness
                    | Unsupported::StrengthOfInelasticLaw
                    | Unsupported::StrengthOfField
                    | Unsupported::StrengthLength { .. } => "strength",
                    Unsupported::PlasticLaw => "plastic",
                    Unsupported::ViscoelasticLaw => "viscoelastic",
                    _ => "law",
                };
                let key = format!("material.{region}.{key}");
                self.error(&key, "", reason.to_string(), sentence(reason.help()))
            }
            other => {
                let key = format!("material.{region}");
                self.error(&key, "", other.to_string(), "Check its numbers.")
            }
        }
    }

    pub(super) fn check_test(&self, mistakes: &mut Mistakes) {
        let Case { phase_field, test, solver, .. } = &self.case;
        match self.case.test.kind {
            Some(kind) => check_kind(self, kind, mistakes),
            None => mistakes.note(self.check_drive()),
        }
        mistakes.note(self.check_energies());
        mistakes.note(self.check_stepping());
        check_program(self, mistakes);
        self.check_platens(mistakes);
        if let Some(celsius) = test.temperature_celsius {
            let help = "It is the temperature of the specimen during the test.";
            let key = "test.temperature_celsius";
            mistakes.note(self.within(key, celsius, -273.15, 5000.0, "°C", help));
        }
        let field = phase_field.as_ref().map_or(Ok(()), PhaseField::validate);
        let schedule = match test.program {
            // `check_program` reports the mistakes in the load program
            Some(_) => test.compression(None).map_or(Ok(()), |test| test.schedule.validate()),
            None => test.schedule(None).validate(),
        };
        for checked in [field, schedule, solver.validate()] {
            mistakes.note(self.accepted(checked));
        }
    }

    /// Converts an error of `fem` to an error at a key of the case.
    fn accepted(&self, checked: Result<(), FemError>) -> Result<(), InputError> {
        let Err(error) = checked else { return Ok(()) };
        let FemError::OutOfRange { entity, field, value, requirement } = error else {
            let help = "breccia init writes a case that explains every key.";
            return Err(self.error("test", "", error.to_string(), help));
        };
        let table = match field {
            "first" | "largest" => "adaptive.",
            "step" | "release_n_mm" => "arc_length.",
            _ => "",
        };
        let key = format!("{entity}.{table}{field}");
        let help = match key.as_str() {
            "phase_field.length_mm" => {
                "It is the width of a smeared crack; the paper takes 0.06 mm."
            }
            "test.duration_s" => "Only viscosity over duration matters; 1.0 reproduces the paper.",
            "test.steps" => "Write steps = 44, or leave it out for adaptive steps.",
            "test.stop_below_peak" => "0.1 stops once the force is 10 % below its peak.",
            "test.arc_length.release_n_mm" => {
                "A fiftieth of toughness times cross-section is a start."
            }
            "solver.tolerance" => {
                "1e-8 suits most cases; a larger tolerance changes the curve noticeably."
            }
            _ => "Leave it out for the default.",
        };
        Err(self.error(&key, value.to_string(), format!("must be {requirement}"), help))
    }

    /// Refuses energies of `[phase_field]` that no region has: the key would have no effect.
    fn check_energies(&self) -> Result<(), InputError> {
        let Some(PhaseField { drive, degrade, .. }) = &self.case.phase_field else { return Ok(()) };
        let materials = || self.case.material.values();
        let (is_plastic, is_viscous) = (
            materials().any(|material| material.plastic.is_some()),
            materials().any(|material| material.viscoelastic.is_some()),
        );
        let plastic = ("plastic", "plastic.yield_mpa");
        let viscous = ("viscous", "viscoelastic.shear");
        // `degrade.viscous` is not checked, because it is true by default
        let without_effect = [
            ("drive", drive.plastic && !is_plastic, plastic),
            ("drive", drive.viscous && !is_viscous, viscous),
            ("degrade", degrade.plastic && !is_plastic, plastic),
        ];
        match without_effect.into_iter().find(|(_, is_idle, _)| *is_idle) {
            None => Ok(()),
            Some((key, _, (energy, constants))) => {
                let problem =
                    format!("is the energy of a material with {constants}, but no region has it");
                let help = format!(
                    "Remove {energy:?} from the list, or add {constants} to a region (docs/how-to/memory.md)."
                );
                Err(self.error(&format!("phase_field.{key}"), format!("{energy:?}"), problem, help))
            }
        }
    }

    /// Checks that either a displacement of the platens or `[conditions]` is given, but not both.
    fn check_drive(&self) -> Result<(), InputError> {
        let case = &self.case;
        let beside = |key: &str| {
            Err(self.error(
                key,
                "",
                "cannot be combined with [conditions]",
                "Conditions replace the platens: remove one of the two.",
            ))
        };
        match (&case.conditions, case.test.displacement_mm) {
            (None, None) if case.test.program.is_some() => Ok(()),
            (None, None) => Err(self.error(
                "test.displacement_mm",
                "",
                "is missing",
                "Add the displacement of the top platen, a load program in test.program, or a table [conditions] with \
                 displacements and loads.",
            )),
            (None, Some(displacement_mm)) => self.within(
                "test.displacement_mm",
                displacement_mm,
                1e-9,
                case.specimen.height_mm.map_or(1e3, |h| 0.5 * h),
                "mm",
                "It is how far the top platen moves down: at most half the height.",
            ),
            (Some(_), Some(_)) => beside("test.displacement_mm"),
            (Some(_), _) if case.test.platens != Platens::Sliding => beside("test.platens"),
            (Some(conditions), _) => self.check_conditions(conditions),
        }
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
                format!("cannot be combined with test.{first}"),
                "Keep one of steps, adaptive and arc_length.",
            ));
        }
        Ok(())
    }

    fn check_platens(&self, mistakes: &mut Mistakes) {
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
        for (key, value, most, help) in resists {
            mistakes.note(self.within(key, value, 0.0, most, "", help));
            if value > 0.0 && test.platens == Platens::Sliding {
                mistakes.note(Err(self.error(
                    key,
                    value.to_string(),
                    "is given, but sliding platens have no friction and no drag",
                    "Write platens = \"unilateral\", or leave it out.",
                )));
            }
        }
        let help = "Take a hundredth of the velocity at which the ends slide.";
        let (key, velocity) = ("test.slip_velocity_mm_per_s", test.slip_velocity_mm_per_s);
        mistakes.note(self.within(key, velocity, 1e-9, 1e6, "mm/s", help));
    }
}

/// Turns a clause into a sentence: adds a capital first letter and a full stop.
fn sentence(clause: &str) -> String {
    let mut letters = clause.chars();
    let first = letters.next().into_iter().flat_map(char::to_uppercase);
    first.chain(letters).chain(['.']).collect()
}
