//! Check of a case: reads all inputs of a run and reports all mistakes. Computes nothing and writes nothing.

use std::fmt::Display;
use std::path::{Path, PathBuf};

use fem::{ReadOptions, StackHeader, TetMesh};

use super::expected_cost::ExpectedCost;
use super::mask::mask_in_words;
use super::outside::{measured_specimens, missing_program, source_in_words};
use super::words::{conditions_in_words, program_in_words};
use crate::case::{
    CaseFile, SingleTest, SpecimenGeometry, has_surrogate_for, single_tests, validation_case,
};
use crate::experiment::{Specimen, SpecimenTable};
use crate::experiments::common_specimens::refuse_counted_twice;
use crate::experiments::experiment_inputs;
use crate::experiments::mesh_scale::MeshSize;
use crate::experiments::specimen_checks::{InspectedSpecimens, inspect};
use crate::experiments::specimen_quantities::{SpecimenNames, compared};
use crate::experiments::validation_folders::{refuse_calibrated, refuse_calibrated_by_others};
use crate::pipeline::inputs::Inputs;
use crate::pipeline::stage::Stage;
use crate::simulation::setup::Setup;
use crate::simulation::simulator::Simulator;
use crate::simulation::without_viscosity::without_viscosity;
use crate::specimen::build::{import_notes, imported_grains, imported_mesh};
use crate::specimen::coarse_body::{CoarseCheck, check_on_coarse_body};
use crate::specimen::mesh::grain_fraction;
use crate::specimen_files::{SpecimenFiles, recorded_file};

/// Result of the check of a case and its files.
#[derive(Clone, Debug, Default)]
pub struct CaseCheck {
    /// Interpreted input: subject and text of each line.
    pub understood: Vec<(&'static str, String)>,
    /// Notes for the user, as the stages print them.
    pub notes: Vec<String>,
    /// Warnings: findings that may make results wrong, as the stages print them.
    pub warnings: Vec<String>,
    /// Mistakes that would stop a run.
    pub mistakes: Vec<String>,
    /// Expected simulations and their cost; `None` for a case without a prior.
    pub cost: Option<ExpectedCost>,
    /// Interpreted input of each test of a case with several tests, and of each validation, by its name.
    pub tests: Vec<(String, Vec<(&'static str, String)>)>,
    /// Whether the specimens are held out, so that a single specimen is sufficient.
    is_held_out: bool,
    /// Whether mistakes have been found in the case that has this test or validation.
    has_other_mistakes: bool,
}

impl CaseCheck {
    /// Reads a case and all files that it names. The stages use the same functions for reading.
    pub fn read(path: &Path) -> Self {
        let mut check = Self::default();
        let text = match CaseFile::text(path) {
            Ok(text) => text,
            Err(mistake) => {
                check.fail(mistake);
                return check;
            }
        };
        let (file, mistakes) = CaseFile::parse_all(&text, path);
        mistakes.into_iter().for_each(|mistake| check.fail(mistake));
        let Some(file) = file else {
            check.say("case", "its files are read after these mistakes have been corrected");
            return check;
        };
        match file.case.tests.is_empty() {
            true => check.calibration(&file),
            false => check.several_tests(&file),
        }
        check
    }

    /// Checks each test of a case as a complete case. Mistakes in the case itself have been reported before.
    fn several_tests(&mut self, file: &CaseFile) {
        let names: Vec<&str> = file.case.tests.iter().map(|test| test.name.as_str()).collect();
        self.say("tests", names.join(", "));
        let Ok(tests) = single_tests(file) else { return };
        for refused in [refuse_counted_twice(&tests), refuse_calibrated_by_others(&tests)] {
            refused.err().into_iter().for_each(|mistake| self.fail(mistake));
        }
        let mut costs = Vec::new();
        for SingleTest { name, file, own: separate } in tests {
            let has_other_mistakes = !self.mistakes.is_empty();
            let mut check = Self { has_other_mistakes, ..Self::default() };
            check.calibration(&file);
            if !separate.is_empty() {
                let text = format!("of this test alone: {}", separate.join(", "));
                check.say("prior", text);
            }
            let named = |text: &String| format!("{name}: {text}");
            self.notes.extend(check.notes.iter().map(named));
            self.warnings.extend(check.warnings.iter().map(named));
            self.mistakes.extend(check.mistakes.iter().map(named));
            costs.extend(check.cost);
            self.tests.push((name, check.understood));
            self.tests.extend(check.tests);
        }
        let total = ExpectedCost::sum(&costs.iter().collect::<Vec<_>>());
        self.say("cost", format!("{} (all tests together)", total.total()));
        self.cost = Some(total);
    }

    /// Reads the files that a case names.
    pub(crate) fn of_calibration(file: &CaseFile) -> Self {
        let mut check = Self::default();
        check.calibration(file);
        check
    }

    /// Reads the files of a case that is used only for tests of virtual specimens (`simulate_laboratories`).
    pub(crate) fn of_laboratory(file: &CaseFile) -> Self {
        let mut check = Self::default();
        check.case(file);
        let size = check.specimen(file);
        check.experiments(file, size);
        let geometry = file.geometry().ok();
        check.cost(geometry.map(|geometry| ExpectedCost::of_laboratory(&file.case, &geometry)));
        check
    }

    fn calibration(&mut self, file: &CaseFile) {
        self.case(file);
        let size = self.specimen(file);
        self.experiments(file, size);
        self.quantities_and_priors(file);
        let geometry = file.geometry().ok();
        let cost = geometry.and_then(|g| ExpectedCost::of_calibration(&file.case, &g));
        let of_validations = self.validations(file);
        self.cost(cost.map(|cost| cost.with(of_validations)));
    }

    /// Checks the held-out specimens of each validation. Mistakes in the keys of a validation have been reported before.
    /// Returns the cost of the simulations.
    fn validations(&mut self, file: &CaseFile) -> Vec<ExpectedCost> {
        let mut costs = Vec::new();
        for (index, entry) in file.case.validation.iter().enumerate() {
            let Ok(validation_file) = validation_case(file, entry, index) else { continue };
            let has_other_mistakes = self.has_other_mistakes || !self.mistakes.is_empty();
            let mut check = Self { is_held_out: true, has_other_mistakes, ..Self::default() };
            let size = check.specimen(&validation_file);
            check.experiments(&validation_file, size);
            if let Err(mistake) = refuse_calibrated(file, &validation_file) {
                check.fail(mistake);
            }
            let draws = if has_surrogate_for(file, entry) { 0 } else { entry.draws };
            check.say(
                "predicted",
                match draws {
                    0 => "by the surrogate of the calibration".to_owned(),
                    draws => format!("by {draws} simulations at posterior draws"),
                },
            );
            let geometry = validation_file.geometry().ok();
            costs.extend(
                geometry
                    .map(|g| ExpectedCost::of_validation(&validation_file.case, entry, draws, &g)),
            );
            let name = format!("validation {}", entry.name);
            let named = |text: &String| format!("{name}: {text}");
            self.notes.extend(check.notes.iter().map(named));
            self.warnings.extend(check.warnings.iter().map(named));
            self.mistakes.extend(check.mistakes.iter().map(named));
            self.tests.push((name, check.understood));
        }
        costs
    }

    /// Smallest number of specimens.
    fn least_specimens(&self) -> usize {
        if self.is_held_out { 1 } else { 2 }
    }

    fn cost(&mut self, cost: Option<ExpectedCost>) {
        if let Some(cost) = &cost {
            cost.lines.iter().for_each(|line| self.say("cost", line));
            self.say("cost", cost.total());
        }
        self.cost = cost;
    }

    fn say(&mut self, subject: &'static str, text: impl Into<String>) {
        self.understood.push((subject, text.into()));
    }

    fn fail(&mut self, mistake: impl Display) {
        self.mistakes.push(mistake.to_string());
    }

    fn case(&mut self, file: &CaseFile) {
        let case = &file.case;
        if case.is_built_in() {
            self.say("units", "mm, N, MPa, s, MPa s (viscosity), N/mm (toughness)");
            let names: Vec<&str> = case.material.keys().map(String::as_str).collect();
            self.say("materials", names.join(", "));
        }
        for (name, interface) in &case.interface {
            let (toughness, width) = (interface.toughness_n_per_mm, interface.width_mm);
            let text = format!("{name}: toughness {toughness} N/mm, in a band of {width} mm");
            self.say("interface", text);
        }
        self.warnings.extend(without_viscosity(case));
        let test = &case.test;
        if let Some(program) = &test.program {
            self.say("test", program_in_words(program, test.steps));
        }
        if let Some(conditions) = &case.conditions {
            let lines = conditions_in_words(conditions, test.duration_s());
            lines.into_iter().for_each(|line| self.say("conditions", line));
        }
        if let Some(displacement_mm) = test.displacement_mm {
            let steps = match test.steps {
                Some(steps) => format!("{steps} load steps"),
                None => "adaptive load steps".to_owned(),
            };
            let rate = displacement_mm / test.duration_s();
            let duration_s = test.duration_s();
            let kind = test.kind.map(|kind| kind.kind().in_words());
            let kind = kind.as_deref().unwrap_or("compression");
            let text = format!(
                "{kind} by {displacement_mm} mm in {duration_s} s ({rate:.4} mm/s), {steps}"
            );
            self.say("test", text);
        }
        if case.prior.is_none() || case.experiments.is_none() {
            let text =
                "without [prior] and [experiments] the case is for segment, mesh and simulate";
            self.say("case", text);
        } else if let Err(mistake) = file.check_steps() {
            self.fail(mistake);
        }
    }

    /// Returns the size of the simulated specimen; `None` if the size is unknown until the image is segmented.
    fn specimen(&mut self, file: &CaseFile) -> Option<MeshSize> {
        let geometry = file.geometry().ok()?;
        // skip this check if the case has a mistake, because the check would report the same mistake again
        if self.mistakes.is_empty() && !self.has_other_mistakes {
            match check_on_coarse_body(file, &geometry) {
                Ok(CoarseCheck { notes, warnings }) => {
                    self.notes.extend(notes);
                    self.warnings.extend(warnings);
                }
                Err(mistake) => self.fail(mistake),
            }
        }
        match &geometry {
            SpecimenGeometry::Absent => {
                match source_in_words(file) {
                    Ok(lines) => self.understood.extend(lines),
                    Err(mistake) => self.fail(mistake),
                }
                if let Err(mistake) = missing_program(file) {
                    self.fail(mistake);
                }
                None
            }
            SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, .. } => {
                let grains = match grains.as_ref().filter(|grains| grains.fraction > 0.0) {
                    Some(grains) => format!("{:.1} % of grains", 100.0 * grains.fraction),
                    None => "without grains".to_owned(),
                };
                let text = format!(
                    "cylinder of radius {radius_mm} mm and height {height_mm} mm, {grains}"
                );
                self.say("specimen", text);
                Some(MeshSize::of_cylinder([*height_mm, *radius_mm]))
            }
            SpecimenGeometry::Block { size_mm: [length, width, depth], notch, .. } => {
                let notch = match notch {
                    Some(notch) => {
                        format!("a notch {} mm deep and {} mm wide", notch.depth_mm, notch.width_mm)
                    }
                    None => "without a notch".to_owned(),
                };
                let text = format!(
                    "block of length {length} mm, width {width} mm and depth {depth} mm, {notch}"
                );
                self.say("specimen", text);
                let radius_mm = 0.5 * length.hypot(*width);
                Some(MeshSize { is_cylinder: false, ..MeshSize::of_cylinder([*depth, radius_mm]) })
            }
            SpecimenGeometry::Mesh { file: mesh_file, regions, surfaces } => {
                match imported_mesh(mesh_file, regions, surfaces) {
                    Ok(imported) => {
                        for note in import_notes(mesh_file, &imported.notes) {
                            self.say("mesh", note);
                        }
                        Some(self.mesh(file, mesh_file, imported.mesh))
                    }
                    Err(mistake) => {
                        self.fail(mistake);
                        None
                    }
                }
            }
            SpecimenGeometry::Surfaces { import, radius_mm, height_mm, meshing } => {
                let size = [*radius_mm, *height_mm];
                match imported_grains(&file.path, import, size, meshing) {
                    Ok(stl_grains) => {
                        self.say("specimen", stl_grains.in_words());
                        self.warnings.extend(stl_grains.warnings());
                        let [radius_mm, height_mm] = stl_grains.size_mm();
                        let key = "specimen.spacing_mm";
                        let fits =
                            file.check_spacing(key, meshing.spacing_mm, radius_mm, height_mm);
                        fits.err().into_iter().for_each(|mistake| self.fail(mistake));
                        Some(MeshSize::of_cylinder([height_mm, radius_mm]))
                    }
                    Err(mistake) => {
                        self.fail(mistake);
                        None
                    }
                }
            }
            SpecimenGeometry::Image { stack, further, options, radius_mm, height_mm, .. } => {
                let mut header = None;
                for stack in [stack].into_iter().chain(further) {
                    let stack_header = self.image(stack, options);
                    header = header.or(stack_header);
                }
                let image = file.case.specimen.image.as_ref();
                let mask = image.and_then(|image| image.segmentation.region.mask.as_ref());
                if let Some(mask) = mask {
                    match mask_in_words(file, &file.beside(mask), header.as_ref()) {
                        Ok(text) => self.say("mask", text),
                        Err(mistake) => self.fail(mistake),
                    }
                }
                Some(MeshSize::of_cylinder([(*height_mm)?, (*radius_mm)?]))
            }
        }
    }

    /// Returns the size of an imported mesh. Reports the mesh, and reports materials or a test that do not suit the
    /// mesh.
    fn mesh(&mut self, file: &CaseFile, mesh_file: &Path, mesh: TetMesh) -> MeshSize {
        let size = MeshSize::of(&mesh);
        let text = format!(
            "mesh {}: {} tetrahedra, {} nodes, height {:.4} mm, radius {:.4} mm, {:.1} % grains",
            mesh_file.display(),
            mesh.tets.len(),
            mesh.nodes.len(),
            size.height_mm,
            size.radius_mm,
            100.0 * grain_fraction(&mesh)
        );
        self.say("specimen", text);
        // build a simulator, which checks that the materials and the test suit the mesh
        let parameters = file.case.whole_prior();
        let parameters = parameters.iter().flat_map(|prior| prior.parameters()).cloned();
        let simulator = Simulator::new(&Setup::from(file), mesh, parameters.collect());
        simulator.err().into_iter().for_each(|mistake| self.fail(mistake));
        size
    }

    /// Reads the header of an image; `None` if the image cannot be read.
    fn image(&mut self, stack: &Path, options: &ReadOptions) -> Option<StackHeader> {
        match StackHeader::read(stack, options) {
            Ok(header) => {
                self.say("image", format!("{}: {}", stack.display(), header.in_words()));
                self.warnings.extend_from_slice(&header.warnings);
                Some(header)
            }
            Err(mistake) => {
                self.fail(mistake);
                None
            }
        }
    }

    fn experiments(&mut self, file: &CaseFile, size: Option<MeshSize>) {
        let Some(experiments) = &file.case.experiments else { return };
        if let Some(specimens) = &experiments.virtual_specimens {
            let text = format!("{} virtual specimens, simulated first", specimens.specimens);
            self.say("specimens", text);
            return;
        }
        if let Some(values) = &experiments.values {
            let path = file.beside(values);
            // the check of the case reports a missing file
            if path.is_file() {
                match measured_specimens(file, &path, self.least_specimens()) {
                    Ok((table, warnings)) => {
                        self.table(&path, &table, None);
                        self.notes.extend(warnings);
                    }
                    Err(mistake) => self.fail(mistake),
                }
            }
            return;
        }
        let path = match file.table() {
            Ok(Some(path)) => path,
            Ok(None) => return,
            Err(mistake) => return self.fail(mistake),
        };
        let options = experiments.read.clone().unwrap_or_default();
        let SpecimenFiles { table, table_understood, understood, mistakes } =
            SpecimenFiles::read(&path, &options).of_test(experiments.test.as_deref(), &path);
        mistakes.into_iter().for_each(|mistake| self.fail(mistake));
        self.table(&path, &table, table_understood.as_deref());
        self.curves(&table, &understood);
        let image = file.case.specimen.image.clone().unwrap_or_default();
        let image_options = image.read_options();
        for stack in table.specimens.iter().filter_map(|specimen| specimen.image.as_ref()) {
            self.image(&path.with_file_name(stack), &image_options);
        }
        self.look_at(file, &path, table, size);
    }

    fn table(&mut self, path: &Path, table: &SpecimenTable, understood: Option<&str>) {
        let counts: Vec<String> = table
            .groups()
            .into_iter()
            .map(|(group, count)| format!("{count} of group {group:?}"))
            .collect();
        let text = format!(
            "{} readable in {}: {}{}",
            table.specimens.len(),
            path.display(),
            counts.join(", "),
            understood.map(|how| format!("; read as: {how}")).unwrap_or_default()
        );
        self.say("specimens", text);
    }

    /// Reports how the curve files were read, with one line for all curves that were read in the same way.
    fn curves(&mut self, table: &SpecimenTable, understood: &[Option<String>]) {
        let mut ways: Vec<(&str, Vec<&str>)> = Vec::new();
        for (specimen, how) in table.specimens.iter().zip(understood) {
            let how = how.as_deref().unwrap_or("displacement_mm,force_N without conversion");
            match ways.iter_mut().find(|(way, _)| *way == how) {
                Some((_, ids)) => ids.push(&specimen.id),
                None => ways.push((how, vec![&specimen.id])),
            }
        }
        for (how, ids) in ways {
            let others = match ids.len() - 1 {
                0 => String::new(),
                1 => " and 1 other".to_owned(),
                others => format!(" and {others} others"),
            };
            self.say("curves", format!("{}{others} read as: {how}", ids[0]));
        }
    }

    /// Checks the curves with the checks of the stage `experiments`.
    fn look_at(
        &mut self,
        file: &CaseFile,
        path: &Path,
        table: SpecimenTable,
        size: Option<MeshSize>,
    ) {
        if table.specimens.is_empty() {
            return;
        }
        let folder = file.path.parent().map_or_else(PathBuf::new, Path::to_owned);
        let inputs = Inputs::new(file, &folder, Stage::that_writes);
        let inputs = if self.is_held_out { inputs.of_held_out() } else { inputs };
        let table = match experiment_inputs::chosen(&inputs, table.clone()) {
            Ok(chosen) => chosen,
            Err(mistake) => {
                self.fail(mistake);
                table
            }
        };
        let size = size.or_else(|| {
            if !file.case.is_built_in() {
                return None;
            }
            let text = "radius and height are compared with the image once it has been segmented";
            self.notes.push(text.to_owned());
            let mean_of = |size: fn(&Specimen) -> f64| {
                mean(&table.specimens.iter().map(size).collect::<Vec<_>>())
            };
            let height_mm = mean_of(|specimen| specimen.height_mm);
            Some(MeshSize::of_cylinder([height_mm, mean_of(|specimen| specimen.radius_mm)]))
        });
        let size = size.map(|size| size.measured_by(file.case.conditions.as_ref()));
        let curve = |id: &str| recorded_file(path, id).unwrap_or_else(|_| path.to_owned());
        let names = SpecimenNames { table: path, curve: &curve };
        match inspect(&inputs, table, size, &names, false) {
            Ok(InspectedSpecimens { table, notes, mistakes }) => {
                self.notes.extend_from_slice(notes.lines());
                self.warnings.extend_from_slice(notes.warnings());
                mistakes.into_iter().for_each(|mistake| self.fail(mistake));
                self.means(file, &table, size);
            }
            Err(mistake) => self.fail(mistake),
        }
    }

    /// Reports mean and range of each compared quantity over the specimens.
    fn means(&mut self, file: &CaseFile, table: &SpecimenTable, mesh: Option<MeshSize>) {
        let qoi = &file.case.qoi_comparison();
        let values = table.specimens.iter();
        let values = values.map(|s| compared(s, mesh, qoi, &qoi.quantities).values);
        let values: Vec<Vec<f64>> = values.collect();
        for (m, quantity) in qoi.quantities.iter().enumerate() {
            let column: Vec<f64> =
                values.iter().map(|row| row[m]).filter(|value| !value.is_nan()).collect();
            if column.is_empty() {
                continue;
            }
            let low = column.iter().copied().fold(f64::INFINITY, f64::min);
            let high = column.iter().copied().fold(f64::NEG_INFINITY, f64::max);
            let (name, mean) = (quantity.column(), mean(&column));
            let text = format!("{name}: mean {mean:.5}, {low:.5} to {high:.5}");
            self.say("measured", text);
        }
    }

    fn quantities_and_priors(&mut self, file: &CaseFile) {
        let compared = file.case.compared_quantities();
        let names: Vec<String> = compared.iter().map(|q| q.column().into_owned()).collect();
        if file.case.prior.is_some() {
            self.say("compared", names.join(", "));
        }
        for (parameter, prior) in file.case.whole_prior().iter().flat_map(|prior| prior.iter()) {
            let unit = parameter.unit();
            let unit = if unit == "1" { String::new() } else { format!(" {unit}") };
            self.say("prior", format!("{parameter}: {prior}{unit}"));
        }
    }
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}
