//! Reader and writer of case files; errors contain key, value and help.

use std::io::ErrorKind;
use std::ops::Range;
use std::path::{Path, PathBuf};

use super::Case;
use super::excerpt::{excerpt, with_excerpt};
use super::image::IMAGE_KEYS;
use super::mistakes::ReadCase;
use super::plastic::hardening_key;
use crate::error::{InputError, absence, closest};

/// A case with the path of its file.
#[derive(Clone, Debug, PartialEq)]
pub struct CaseFile {
    /// Path of the case file; relative paths in the case refer to the folder of this file.
    pub path: PathBuf,
    /// Contents of the case file.
    pub case: Case,
    /// Keys and paths of the tables of yield stresses and the time tables, whose rows replace their names in `case`.
    pub table_files: Vec<(String, PathBuf)>,
}

impl CaseFile {
    /// Reads and validates a case.
    ///
    /// # Errors
    /// If the file cannot be read, a key is unknown or missing, a value has the wrong type or is out of range, or a
    /// mesh file does not exist. The error contains file, key, value and help.
    pub fn read(path: &Path) -> Result<Self, InputError> {
        Self::parse(&Self::text(path)?, path)
    }

    /// Parses and validates the text of a case, like [`CaseFile::read`].
    ///
    /// # Errors
    /// The errors of [`CaseFile::read`].
    pub fn parse(text: &str, path: &Path) -> Result<Self, InputError> {
        let (file, mistakes) = Self::parse_all(text, path);
        match (file, mistakes.into_iter().next()) {
            (Some(file), None) => Ok(file),
            (_, Some(mistake)) => Err(mistake),
            // unreachable: `parse_all` reports at least one mistake if it returns no case
            (None, None) => {
                Err(InputError::new(path, "", "", "is not a case", "See breccia init."))
            }
        }
    }

    /// Parses a case like [`CaseFile::parse`] and returns all mistakes. The case contains everything that could be
    /// read; it is `None` if a required part is missing.
    pub(crate) fn parse_all(text: &str, path: &Path) -> (Option<Self>, Vec<InputError>) {
        if Self::is_study(text) {
            let help = format!("Run it with: breccia study {}", path.display());
            return (None, vec![InputError::new(path, "", "", "is a study, not a case", help)]);
        }
        let mut read = ReadCase::of(text);
        let mut mistakes: Vec<InputError> =
            read.lists.iter().map(|list| list.error(text, path)).collect();
        mistakes.extend(read.errors.iter().map(|error| explain(error, text, path)));
        let Some(mut case) = read.case.take() else { return (None, mistakes) };
        case.complete();
        let mut file = Self { path: path.to_owned(), case, table_files: Vec::new() };
        mistakes.extend(file.read_hardening().into_iter().map(|m| with_excerpt(m, text, path)));
        let folder = file.path.with_file_name("");
        let conditions = file.case.conditions.as_mut();
        for (key, table, read) in conditions.into_iter().flat_map(|all| all.read_tables(&folder)) {
            file.table_files.push((key, table));
            mistakes.extend(read.err());
        }
        let unexplained = file.validate().into_iter().filter(|mistake| !read.explains(mistake));
        mistakes.extend(unexplained.map(|mistake| with_excerpt(mistake, text, path)));
        // in unit tests, the schema must accept every case that the reader accepts; the reader does not read the candidates
        // of a case without a prior
        #[cfg(test)]
        if mistakes.is_empty()
            && file.case.whole_prior().is_some()
            && let Err(error) = super::schema::tests::check_case(text)
        {
            panic!("the schema refuses a case: {error}\n{text}");
        }
        (Some(file), mistakes)
    }

    /// Replaces the names of tables of yield stresses by their rows; returns the mistakes.
    fn read_hardening(&mut self) -> Vec<InputError> {
        let folder = self.path.with_file_name("");
        let mut mistakes = Vec::new();
        for (region, material) in &mut self.case.material {
            let Some(plastic) = material.plastic.as_mut() else { continue };
            let Some(table) = plastic.table().map(|table| folder.join(table)) else { continue };
            let key = hardening_key(region);
            self.table_files.push((key.clone(), table.clone()));
            if let Err([problem, help]) = plastic.read_table(&table) {
                let value = table.display().to_string();
                mistakes.push(InputError::new(&self.path, &key, value, problem, help));
            }
        }
        mistakes
    }

    /// Reads the text of a case file.
    ///
    /// # Errors
    /// If the file cannot be read.
    pub(crate) fn text(path: &Path) -> Result<String, InputError> {
        fem::read_regular_text(path).map_err(|e| {
            let help = match e.kind() {
                ErrorKind::InvalidData => "Save it as plain text, UTF-8.",
                _ => "Check its name, or write a first case with: breccia init",
            };
            InputError::unreadable(path, &e, help)
        })
    }

    /// Whether the text is a study: a study has the key `base` and neither a table `specimen` nor `simulator`.
    pub(crate) fn is_study(text: &str) -> bool {
        let table: Option<toml::Table> = text.parse().ok();
        let of_cases = ["specimen", "simulator"];
        table.is_some_and(|table| {
            table.contains_key("base") && !of_cases.iter().any(|key| table.contains_key(*key))
        })
    }

    /// Returns the built-in default case.
    pub fn default_case() -> Self {
        Self::parse(Case::TEMPLATE, Path::new("default.toml"))
            .expect("the shipped case is valid: a test reads it")
    }

    /// Resolves a path that is given in the case relative to the folder of the case file.
    pub fn beside(&self, path: &Path) -> PathBuf {
        self.path.with_file_name("").join(path)
    }

    /// Returns the path of the specimen table, if the case names one.
    ///
    /// # Errors
    /// If the file does not exist. [`CaseFile::read`] does not check this, because a single simulation does not need
    /// the table.
    pub fn table(&self) -> Result<Option<PathBuf>, InputError> {
        let Some(table) = self.case.experiments.as_ref().and_then(|e| e.table.as_ref()) else {
            return Ok(None);
        };
        let file = self.beside(table);
        if file.is_file() {
            return Ok(Some(file));
        }
        Err(self.error(
            "experiments.table",
            table.display().to_string(),
            absence(&file),
            format!("The program looks for it at {}.", file.display()),
        ))
    }

    /// Creates an error about a key of this case.
    pub(crate) fn error(
        &self,
        key: &str,
        value: impl Into<String>,
        problem: impl Into<String>,
        help: impl Into<String>,
    ) -> InputError {
        InputError::new(&self.path, key, value, problem, help)
    }
}

impl Case {
    /// Returns the case as TOML, including all default values.
    pub fn to_toml(&self) -> String {
        toml::to_string_pretty(self).expect("a case can be written as TOML")
    }
}

/// Converts an error of the TOML parser into an error with key, value and help.
fn explain(error: &toml::de::Error, text: &str, path: &Path) -> InputError {
    let span = error.span();
    let (location, value) = span.clone().map_or_else(Default::default, |span| locate(text, span));
    let excerpt = span.map(|span| Box::new(excerpt(text, span)));
    InputError { excerpt, ..explain_at(error, location, value, path) }
}

/// Converts an error of the TOML parser about the key `location` and its `value` into an error with help.
fn explain_at(error: &toml::de::Error, location: String, value: String, path: &Path) -> InputError {
    let message = error.message();
    if message.contains("such as matrix.young_mpa") {
        let problem = "a parameter is named with its region";
        let help = "Write matrix.young_mpa = … in place of young_mpa = …, grain.toughness_n_per_mm = … and so on.";
        return InputError::new(path, location, value, problem, help);
    }
    if message.contains("expected newtype variant")
        || message.contains("invalid type: unit variant")
    {
        let problem = "this name needs a value of its own";
        let help = format!("Write {} in place of it.", with_value(&location, &value));
        return InputError::new(path, location, value, problem, help);
    }
    if let Some((problem, help)) = message.split_once("; help: ") {
        return InputError::new(path, location, value, problem, help);
    }
    let names: Vec<&str> = message.split('`').skip(1).step_by(2).collect();
    let (problem, help) = match names.split_first() {
        Some((key, allowed)) if message.starts_with("unknown field") => {
            let mut allowed = allowed.to_vec();
            if allowed.contains(&"min_grain_voxels") {
                // the message of the parser lists only the keys of the segmentation
                allowed.extend(IMAGE_KEYS);
            }
            let help = format!("{}Keys here: {}.", did_you_mean(key, &allowed), allowed.join(", "));
            (format!("unknown key {key:?}"), help)
        }
        Some((word, allowed)) if message.starts_with("unknown variant") => (
            format!("unknown name {word:?}"),
            format!("{}Choose one of: {}.", did_you_mean(word, allowed), allowed.join(", ")),
        ),
        Some((key, _)) if message.starts_with("missing field") => (
            format!("the key {key} is missing"),
            "Add it; breccia init writes a case that explains every key.".to_owned(),
        ),
        _ => {
            let message = message.trim_end_matches('.');
            let help = "breccia init writes a case that explains every key.";
            (in_plain_words(message), format!("{}{help}", how_to_write(message)))
        }
    };
    InputError::new(path, location, value, problem, help)
}

/// Shows the syntax of a name that needs a value: `rule = { fixed = 3 }` for `"fixed"`.
fn with_value(location: &str, value: &str) -> String {
    let key = location.rsplit('.').next().unwrap_or(location);
    let name = value.trim_matches(['"', '\'']);
    let value = if name == "fixed" { "3" } else { "{ … }" };
    format!("{key} = {{ {name} = {value} }}")
}

/// Returns a sentence on how to write a value of the type that the parser expected; empty for types that need no
/// explanation.
fn how_to_write(message: &str) -> &'static str {
    match message.rsplit_once("expected ") {
        _ if !message.starts_with("invalid type") => "",
        Some((_, "f64")) => "Write a number without quotes and unit. ",
        Some((_, "u8" | "u16" | "u32" | "u64" | "usize" | "i32" | "i64")) => {
            "Write a whole number without quotes, unit and decimal point. "
        }
        Some((_, "a boolean")) => "Write true or false without quotes. ",
        Some((_, "a string" | "path string")) => "Write it in quotes. ",
        _ => "",
    }
}

/// Replaces Rust types in the parser's message by TOML terms, and joins its lines.
fn in_plain_words(message: &str) -> String {
    let Some((given, expected)) = message.rsplit_once("expected ") else {
        return message.replace('\n', "; ");
    };
    let expected = match expected {
        "f64" => "a number",
        "u8" | "u16" | "u32" | "u64" | "usize" => "a whole number, not below 0",
        "i32" | "i64" => "a whole number",
        "a boolean" => "true or false",
        "path string" => "a path",
        "a sequence" => "a list in brackets",
        other => other,
    };
    format!("{given}expected {expected}").replace('\n', "; ")
}

fn did_you_mean(word: &str, allowed: &[&str]) -> String {
    closest(word, allowed.iter().copied())
        .map(|best| format!("Did you mean {best:?}? "))
        .unwrap_or_default()
}

/// Returns the key at a span, with its table, and the text to the right of the equals sign.
fn locate(text: &str, span: Range<usize>) -> (String, String) {
    let start = span.start.min(text.len());
    let line_start = text[..start].rfind('\n').map_or(0, |i| i + 1);
    let line = text[line_start..].lines().next().unwrap_or("");
    let is_header = |line: &str| line.trim_start().starts_with('[');
    let table = text[..line_start + line.len()]
        .lines()
        .rev()
        .find(|line| is_header(line))
        .and_then(|line| line.trim().strip_prefix('[')?.split(']').next())
        .unwrap_or("");
    match line.split_once('=') {
        Some((key, value)) if !is_header(line) => {
            let dot = if table.is_empty() { "" } else { "." };
            let value = value.split(" #").next().unwrap_or(value);
            (format!("{table}{dot}{}", key.trim()), value.trim().to_owned())
        }
        _ if table.is_empty() => Default::default(),
        _ => (format!("[{table}]"), String::new()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::{
        AdaptiveCase, ArcLengthCase, ConditionsCase, ExtensometerCase, FreeParameterCase,
        ImageCase, InterfaceCase, LineCase, MeasureCase, NotchCase, NotchedBeam, PrescribeCase,
        PressureCase, PressureKind, ProgramPointCase, SimulatorCase, TestKindCase, TimeTable,
        TractionCase,
    };
    use crate::record::{Compression, Decimal, Encoding, ReadOptions, Separator};

    fn message(text: &str) -> String {
        CaseFile::parse(text, Path::new("case.toml")).unwrap_err().to_string()
    }

    /// Returns the default case with the first occurrence of `from` replaced.
    fn with(from: &str, to: &str) -> String {
        assert!(Case::TEMPLATE.contains(from), "the default case has no {from:?}");
        Case::TEMPLATE.replacen(from, to, 1)
    }

    #[test]
    fn the_effective_case_reads_as_the_case_itself() {
        let file = CaseFile::default_case();
        let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
        assert_eq!(again, file);
    }

    #[test]
    fn the_default_case_explains_every_key() {
        let mut full = CaseFile::default_case().case;
        let image = full.specimen.image.as_mut().unwrap();
        image.stack = Some("scan.tif".into());
        image.labels = Some("labels.tif".into());
        image.label_phases = Some([("1".to_owned(), "grain".to_owned())].into());
        image.background = Some(255);
        image.further_stacks = Some(vec!["other.tif".into()]);
        image.voxel_mm = Some(0.05);
        full.design.packings = Some(10);
        image.segmentation.void_threshold = Some(1.0);
        image.segmentation.grain_threshold = Some(2.0);
        image.segmentation.region = fem::SpecimenRegion {
            centre_px: Some([1.5, 2.5]),
            radius_px: Some(3.0),
            slices: Some([1, 9]),
            mask: Some("mask.tif".into()),
        };
        full.specimen.stl = Some(fem::SurfaceImport::new("stl".into()));
        full.specimen.mesh = Some("cylinder.msh".into());
        full.specimen.regions.insert("matrix".into(), 1.into());
        full.specimen.surfaces.insert("top".into(), 1.into());
        let interface = InterfaceCase { toughness_n_per_mm: 0.001, width_mm: 0.1 };
        full.interface.insert("matrix-grain".into(), interface);
        full.specimen.block_mm = Some([48.0, 10.0, 10.0]);
        full.specimen.notch = Some(NotchCase { depth_mm: 3.0, width_mm: 0.5 });
        full.test.kind = Some(TestKindCase::NotchedBeam(NotchedBeam { span_mm: 40.0 }));
        full.test.steps = Some(44);
        let point = ProgramPointCase {
            time_s: 1.0,
            displacement_mm: Some(0.1),
            force_n: Some(1.0),
            steps: Some(4),
        };
        full.test.program = Some(vec![point]);
        full.test.temperature_celsius = Some(50.0);
        full.machine.compliance_mm_per_n = Some(1e-5);
        full.machine.force_offset_n = Some(0.5);
        full.test.stop_below_peak = Some(0.1);
        full.test.adaptive = Some(AdaptiveCase { first: 0.01, largest: 0.025 });
        full.test.arc_length = Some(ArcLengthCase { step: 0.025, release_n_mm: 0.001 });
        let surface = || "top".to_owned();
        let line = LineCase { from_mm: [0.0; 3], to_mm: [1.0; 3] };
        full.conditions = Some(ConditionsCase {
            lines: [("support".to_owned(), line)].into(),
            prescribe: vec![PrescribeCase {
                surface: surface(),
                x_mm: Some(0.0),
                y_mm: Some(0.0),
                z_mm: Some(0.0),
                damage: Some(1.0),
                table: Some(TimeTable::Points(vec![[1.0, 1.0]])),
            }],
            symmetry: vec![surface()],
            traction: vec![TractionCase { surface: surface(), vector_mpa: [0.0; 3], table: None }],
            pressure: vec![PressureCase {
                surface: surface(),
                pressure_mpa: 1.0,
                kind: PressureKind::Dead,
                table: None,
            }],
            body_force_n_per_mm3: Some([0.0; 3]),
            remove_rigid_motions: true,
            table: None,
            measure: MeasureCase { surface: surface(), direction: [0.0; 3] },
            extensometer: Some(ExtensometerCase { from_mm: [0.0; 3], to_mm: [1.0; 3] }),
            similarity: None,
        });
        full.design.import = Some("runs.csv".into());
        full.simulator = Some(SimulatorCase {
            command: vec!["solver".into()],
            input: Some("deck.inp".into()),
            files: vec!["mesh.inc".into()],
            result: "result.csv".into(),
            time_limit_s: Some(600.0),
            retries: 1,
        });
        let parameter = FreeParameterCase {
            unit: "MPa".into(),
            label: Some("k₁".into()),
            prior: crate::prior::Prior::uniform(1.0, 2.0),
        };
        full.parameters.insert("k1".into(), parameter);
        full.confirm.second_spacing_mm = Some(0.5);
        let experiments = full.experiments.as_mut().unwrap();
        experiments.table = Some("specimens.csv".into());
        experiments.values = Some("measured.csv".into());
        experiments.group = Some("50C".into());
        experiments.read = Some(ReadOptions {
            separator: Some(Separator::Semicolon),
            decimal: Some(Decimal::Comma),
            skip: Some(4),
            stop_at: Some("Maximum".into()),
            encoding: Some(Encoding::Latin1),
            sheet: Some("Readings".into()),
            displacement: Some("Weg".into()),
            force: Some("Kraft".into()),
            time: Some("Zeit".into()),
            displacement_unit: Some("mm".into()),
            force_unit: Some("kN".into()),
            time_unit: Some("s".into()),
            displacement_factor: Some(1.0),
            force_factor: Some(1000.0),
            compression: Some(Compression::Negative),
            zero_force: true,
            zero_displacement: true,
        });
        experiments.virtual_specimens.as_mut().unwrap().spacing_mm = Some(0.5);
        fn visit(table: &toml::Table) {
            for (key, value) in table {
                assert!(Case::TEMPLATE.contains(key), "{key} is not explained");
                match value {
                    toml::Value::Table(inner) => visit(inner),
                    toml::Value::Array(all) => {
                        all.iter().filter_map(|v| v.as_table()).for_each(visit)
                    }
                    _ => {}
                }
            }
        }
        visit(&full.to_toml().parse().unwrap());
    }

    #[test]
    fn a_case_of_the_least_size_has_the_documented_defaults() {
        let text = "[specimen]\nradius_mm = 2.5\nheight_mm = 4\nspacing_mm = 0.7\n\
                    [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
        let case = CaseFile::parse(text, Path::new("case.toml")).unwrap().case;
        assert_eq!((case.specimen.order, case.test.duration_s), (fem::Order::Quadratic, Some(1.0)));
        assert_eq!(case.material["matrix"].residual_stiffness, 0.01);
        assert_eq!((case.design.runs, case.qoi.slope_fraction), (100, 0.3));
    }

    #[test]
    fn misspelt_keys_and_names_are_recognised() {
        let slip = message(&with("radius_mm", "radus_mm"));
        for part in [
            " | radus_mm = 2.5",
            " | ^^^^^^^^\nhelp: ",
            "specimen.radus_mm = 2.5",
            "unknown key \"radus_mm\"",
            "mean \"radius_mm\"?",
        ] {
            assert!(slip.contains(part), "{part:?} is not in {slip:?}");
        }
        let slip = message(&with("law = \"hencky\"", "law = \"henky\""));
        for part in ["material.matrix.law = \"henky\"", "mean \"hencky\"?", "neo-hookean"] {
            assert!(slip.contains(part), "{part:?} is not in {slip:?}");
        }
        let inline = message(&with("fraction = ", "fration = "));
        assert!(
            inline.contains("specimen.grains") && inline.contains("mean \"fraction\"?"),
            "{inline}"
        );
        let table = message(&with("[phase_field]", "[phasefield]"));
        assert!(table.contains("mean \"phase_field\"?"), "{table}");
    }

    #[test]
    fn the_keys_of_an_image_are_known_and_misspelt_ones_named() {
        let (stack, further_stacks) = (Some("scan.tif".into()), Some(vec!["other.tif".into()]));
        let mut image = ImageCase { stack, further_stacks, bin: 3, ..ImageCase::default() };
        image.voxel_mm = Some(0.05);
        image.labels = Some("labels.tif".into());
        image.label_phases = Some([("-2 to 9".to_owned(), "grain".to_owned())].into());
        image.background = Some(-3);
        image.segmentation.void_threshold = Some(1.0);
        image.segmentation.grain_threshold = Some(2.0);
        let table = toml::Table::try_from(&image).unwrap();
        let again: ImageCase = table.clone().try_into().unwrap();
        assert_eq!(again, image);
        let slip = message(&with("h_voxels = ", "h_voxel = "));
        let fragments =
            ["specimen.image.h_voxel = 0.5", "unknown key \"h_voxel\"", "mean \"h_voxels\"?"];
        for fragment in fragments.into_iter().chain(table.keys().map(String::as_str)) {
            assert!(slip.contains(fragment), "{fragment:?} is not in {slip:?}");
        }
        let slip = message(&with("# voxel_mm = ", "voxel_m = "));
        assert!(slip.contains("mean \"voxel_mm\"?"), "{slip}");
    }

    #[test]
    fn wrong_types_in_an_image_are_named_with_their_key_and_the_mend() {
        for (from, key, value, mend) in [
            ("h_voxels = 0.5", "h_voxels", "\"0.5 voxels\"", "Write a number without quotes"),
            ("# grain_threshold = 30000.0", "grain_threshold", "\"bright\"", "Write a number"),
            ("# voxel_mm = 0.0275", "voxel_mm", "\"27.5 µm\"", "Write a number without quotes"),
            ("min_grain_voxels = 30", "min_grain_voxels", "30.5", "Write a whole number"),
            ("median = true", "median", "\"yes\"", "Write true or false"),
            ("# stack = \"scan.tif\"", "stack", "7", "Write it in quotes"),
            ("bin = 1", "bin", "2.5", "Write a whole number"),
            ("# labels = \"labels.tif\"", "labels", "7", "Write it in quotes"),
            ("# background = 255", "background", "\"white\"", "Write a whole number"),
            (
                "# further_stacks = [\"M-02.tif\", \"M-03.tif\"]",
                "further_stacks",
                "\"other.tif\"",
                "expected a list in brackets",
            ),
            ("seeds = \"h-maxima\"", "seeds", "\"h-maxma\"", "mean \"h-maxima\"?"),
            ("contrast = \"bright\"", "contrast", "\"drak\"", "mean \"dark\"?"),
            ("percentiles = [0.1, 99.9]", "percentiles", "[0.1]", "expected"),
        ] {
            let error = message(&with(from, &format!("{key} = {value}")));
            for part in [&format!("specimen.image.{key} = {value}: "), mend] {
                assert!(error.contains(part), "{part:?} is not in {error:?}");
            }
        }
    }

    #[test]
    fn missing_keys_wrong_types_and_broken_syntax_are_placed() {
        let missing = message(&with("length_mm = 0.06", ""));
        assert!(
            missing.contains("[phase_field]") && missing.contains("length_mm is missing"),
            "{missing}"
        );
        let text = message(&with("radius_mm = 2.5", "radius_mm = \"2.5 mm\""));
        assert!(text.contains("specimen.radius_mm = \"2.5 mm\""), "{text}");
        assert!(text.contains("expected a number"), "{text}");
        let part = message(&with("steps = 44", "steps = 8.5"));
        assert!(part.contains("expected a whole number"), "{part}");
        let three = message(&with("[250.0, 300.0]", "[250.0, 300.0, 1.0]"));
        assert!(three.contains("young_mpa") && three.contains("[lower, upper]"), "{three}");
        assert!(message("").contains("specimen: is missing"), "{}", message(""));
        let broken = message(&with("radius_mm = 2.5", "radius_mm = 2,5"));
        assert!(broken.contains("specimen.radius_mm"), "{broken}");
    }
}
