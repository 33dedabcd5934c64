//! Reading of cases and the errors of the parser.

use super::*;
use crate::case::{
    AdaptiveCase, ArcLengthCase, ConditionsCase, ExtensometerCase, FreeParameterCase, ImageCase,
    InterfaceCase, LineCase, MeasureCase, NotchCase, NotchedBeam, PrescribeCase, PressureCase,
    PressureKind, ProgramPointCase, SimulatorCase, TestKindCase, TimeTable, TractionCase,
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
                toml::Value::Array(all) => all.iter().filter_map(|v| v.as_table()).for_each(visit),
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

/// Marks stand under the unknown key, not under an equal word before it.
#[test]
fn unknown_keys_of_a_prior_are_marked() {
    let line =
        "matrix.young_mpa = { distribution = \"beta\", alpha = 2.0, beta = 3.0, a = 2.0, b = 3.0 }";
    let text = with("matrix.young_mpa = [250.0, 300.0]", &format!("{line}#"));
    let found = CaseFile::parse_all(&text, Path::new("case.toml")).1;
    for key in ["alpha", "beta"] {
        let problem = format!("unknown key {key:?}");
        let mistake = found.iter().find(|mistake| mistake.problem == problem);
        let excerpt = mistake.and_then(|mistake| mistake.excerpt.as_deref());
        let picture = &excerpt.unwrap_or_else(|| panic!("{found:#?}")).picture;
        let mut lines = picture.lines().skip(1);
        let (shown, marks) = (lines.next().unwrap(), lines.next().unwrap());
        assert_eq!(marks.find('^'), shown.find(&format!("{key} = ")), "{picture}");
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
    let large = message(&with("# background = 255", "background = 9223372036854775808"));
    assert!(large.contains("expected a whole number from −2⁶³ to 2⁶³ − 1"), "{large}");
    let three = message(&with("[250.0, 300.0]", "[250.0, 300.0, 1.0]"));
    assert!(three.contains("young_mpa") && three.contains("at most 2"), "{three}");
    assert!(message("").contains("specimen: is missing"), "{}", message(""));
    let file = Path::new("case.toml");
    let levels = "levels = [{ spacing_mm = 0.7, order = 1, repeats = 10 }]";
    let wrong = "[[fidelity.levels]]\nspacing_mm = 0.7\n[[fidelity.levels]]\nspacing_mm = 0.6\nrepeats = 4.5\n";
    let text = with(levels, wrong);
    let found = CaseFile::parse_all(&text, file).1;
    assert!(found.iter().any(|m| m.place == "fidelity.levels[1].repeats"), "{found:#?}");
    let broken = message(&with("radius_mm = 2.5", "radius_mm = 2,5"));
    assert!(broken.contains("specimen.radius_mm"), "{broken}");
}
