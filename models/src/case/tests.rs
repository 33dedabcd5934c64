//! Invalid values and combinations: each error names its key and the remedy.

use std::path::Path;

use super::{CalibrationCase, Case, CaseFile, SpecimenGeometry};
use crate::qoi::{ForceAt, Quantity};

/// Changes of the default case, each with the parts that the error message must contain.
#[test]
fn every_bad_value_is_named_with_its_key_and_what_to_do() {
    let changes: &[(&str, &str, &[&str])] = &[
        ("radius_mm = 2.5", "radius_mm = -2.5", &["specimen.radius_mm = -2.5", "mm"]),
        ("radius_mm = 2.5", "radius_mm = nan", &["specimen.radius_mm = NaN"]),
        ("radius_mm = 2.5", "", &["specimen.radius_mm", "missing", "or a mesh"]),
        (
            "spacing_mm = 0.42",
            "spacing_mm = 0.001",
            &["specimen.spacing_mm = 0.001", "tetrahedra", "coarser"],
        ),
        ("order = 2", "order = 3", &["specimen.order = 3", "order = 2"]),
        (
            "fraction = 0.2,",
            "fraction = 20,",
            &["specimen.grains.fraction = 20", "volume fraction"],
        ),
        (
            "young_mpa = 275.0",
            "young_mpa = 275e6",
            &["material.matrix.young_mpa = 275000000", "MPa"],
        ),
        ("poisson = 0.25", "poisson = 0.5", &["material.matrix.poisson = 0.5"]),
        (
            "toughness_n_per_mm = 0.0025",
            "toughness_n_per_mm = 2500.0",
            &["material.matrix.toughness_n_per_mm", "pJ/µm²"],
        ),
        (
            "viscosity_mpa_s = 0.3",
            "viscosity_mpa_s = -0.3",
            &["material.matrix.viscosity_mpa_s = -0.3", "MPa s"],
        ),
        (
            "residual_stiffness = 0.01",
            "residual_stiffness = 1.0",
            &["material.matrix.residual_stiffness = 1"],
        ),
        ("young_mpa = 275.0", "", &["material.matrix.young_mpa", "is missing"]),
        (
            "# drive = [\"elastic\"] ",
            "drive = [\"elastic\", \"plastic\"] #",
            &["phase_field.drive = \"plastic\"", "plastic.yield_mpa", "no region"],
        ),
        (
            "# degrade = [\"elastic\", \"viscous\"] ",
            "degrade = [\"elastic\", \"plastic\"] #",
            &["phase_field.degrade = \"plastic\"", "Remove \"plastic\""],
        ),
        (
            "law = \"hencky\" ",
            "law = { mooney-rivlin = { c10_mpa = 1.0, c01_mpa = 0.1, bulk_mpa = 9.0 } } ",
            &["material.matrix.young_mpa = 275", "constants of its own"],
        ),
        (
            "law = \"hencky\" ",
            "law = { mooney-rivlin = { c10_mp = 1.0, c01_mpa = 0.1, bulk_mpa = 9.0 } } ",
            &["material.matrix.law", "unknown key \"c10_mp\"", "mean \"c10_mpa\"?"],
        ),
        (
            "[design]  ",
            "[[extend]]\nruns = 9\nprior.matrix.young_mpa = [310.0, 350.0]\n[design]  ",
            &["extend[0].prior.matrix.young_mpa = [310.0, 350.0]", "The range is [250.0, 300.0]"],
        ),
        (
            "[design]  ",
            "[[extend]]\nruns = 0\nprior.matrix.young_mpa = [300.0, 350.0]\n[design]  ",
            &["extend[0].runs = 0"],
        ),
        (
            "[design]  ",
            "[[extend]]\nruns = 9\nprior.matrix.poisson = [0.2, 0.3]\n[design]  ",
            &["extend[0].prior.matrix.poisson", "is not calibrated"],
        ),
        (
            "[design]  ",
            "[[extend]]\nruns = 9\nprior.matrix = { young_mpa = [300.0, 350.0], viscosity_mpa_s = [0.5, 0.9] }\n[design]  ",
            &["extend[0].prior", "several parameters", "[[extend]]"],
        ),
        ("[design]  ", "[sequential]\nshare = 0.0\n[design]  ", &["sequential.share = 0", "0.001"]),
        (
            "[design]  ",
            "[sequential]\nbatch = 20\nmost = 10\n[design]  ",
            &["sequential.most = 10", "at least one batch"],
        ),
        (
            "[design]  ",
            "[sequential]\nbatches = 20\n[design]  ",
            &["sequential", "batches", "mean \"batch\"?"],
        ),
        (
            "[material.grain]",
            "[material.grian]",
            &["material.grain: is missing", "mean material.grian?"],
        ),
        (
            "[phase_field] ",
            "[material.grian]\nyoung_mpa = 1.0\npoisson = 0.2\n[phase_field] ",
            &["material.grian", "no region", "mean material.grain?"],
        ),
        ("height_mm = 4.4", "hieght = 4.4", &["specimen.hieght", "mean \"height_mm\"?"]),
        ("max_order = 8", "max_order = 0", &["surrogate.max_order = 0", "a constant"]),
        (
            "rule = \"corrected-loo\"",
            "rule = \"fixed\"",
            &["surrogate.rule = \"fixed\"", "a value of its own", "rule = { fixed = 3 }"],
        ),
        (
            "rule = \"corrected-loo\"",
            "rule = { fixed = 0 }",
            &["surrogate.rule.fixed = 0", "at most max_order"],
        ),
        ("length_mm = 0.06", "length_mm = 0.0", &["phase_field.length_mm = 0"]),
        (
            "displacement_mm = 0.22",
            "displacement_mm = 4.0",
            &["test.displacement_mm = 4", "half the height"],
        ),
        ("duration_s = 1.0", "duration_s = 0.0", &["test.duration_s = 0"]),
        ("steps = 44", "steps = 0", &["test.steps = 0", "steps = 44"]),
        ("friction = 0.0", "friction = 0.3", &["test.friction = 0.3", "platens = \"unilateral\""]),
        (
            "slip_velocity_mm_per_s = 0.001",
            "slip_velocity_mm_per_s = 0.0",
            &["test.slip_velocity_mm_per_s = 0", "mm/s"],
        ),
        (
            "# adaptive = {",
            "adaptive = {",
            &["test.adaptive", "cannot be combined with test.steps", "Keep one of"],
        ),
        ("platens = \"sliding\"", "platens = \"slidin\"", &["test.platens", "\"sliding\"?"]),
        ("tolerance = 1e-8", "tolerance = 1.0", &["solver.tolerance = 1", "1e-8"]),
        ("stop_below_peak = 0.03", "stop_below_peak = 10", &["test.stop_below_peak = 10", "10 %"]),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = [300.0, 250.0]",
            &["prior.matrix.young_mpa = [300.0, 250.0]", "[lower, upper]"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = [0.0, 300.0]",
            &["prior.matrix.young_mpa", "unit"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "binder.young_mpa = [250.0, 300.0]",
            &["prior.binder.young_mpa", "grain, matrix"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.yuong_mpa = [250.0, 300.0]",
            &["prior.matrix.yuong_mpa", "mean \"young_mpa\"?"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "young_mpa = [250.0, 300.0]",
            &["prior.young_mpa = [250.0, 300.0]", "with its region", "matrix.young_mpa = "],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "region = \"matrix\"",
            &["prior.region = \"matrix\"", "with its region"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognorml\", median = 280.0, factor = 1.1 }",
            &["prior.matrix.young_mpa = ", "unknown name \"lognorml\"", "mean \"lognormal\"?"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognormal\", mediam = 280.0, factor = 1.1 }",
            &["prior.matrix.young_mpa = ", "\"mediam\"", "mean \"median\"?"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognormal\", median = 280.0, sd = 1.1 }",
            &[
                "prior.matrix.young_mpa = ",
                "the distribution lognormal has no key sd",
                "help: Write { distribution = \"lognormal\", median = …, factor = …, range = [lower, upper] }",
            ],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"normal\", mean = 280.0 }",
            &["prior.matrix.young_mpa = ", "the distribution normal needs the key sd"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { mean = 280.0, sd = 3.0 }",
            &["prior.matrix.young_mpa = ", "names no distribution", "^^^^^^"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"uniform\" }",
            &["prior.matrix.young_mpa = ", "needs a range"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"normal\", mean = 280.0, sd = \"3\" }",
            &["prior.matrix.young_mpa = ", "expected a number"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"lognormal\", median = 280.0, factor = 0.9 }",
            &["prior.matrix.young_mpa: ", "factor must be above 1", "^^^^^^"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"normal\", mean = 280.0, sd = 9.0, range = [400.0, 200.0] }",
            &["prior.matrix.young_mpa = [400.0, 200.0]", "not below the upper"],
        ),
        (
            "matrix.young_mpa = [250.0, 300.0]",
            "matrix.young_mpa = { distribution = \"normal\", mean = 280.0, sd = 9.0, range = [-20.0, 400.0] }",
            &["prior.matrix.young_mpa", "unit"],
        ),
        (
            "matrix.young_mpa = 280.0,",
            "",
            &["experiments.virtual.truth.matrix.young_mpa", "is missing"],
        ),
        (
            "matrix.young_mpa = 280.0,",
            "matrix.young_mpa = 280.0, grain.young_mpa = 22000.0,",
            &["experiments.virtual.truth.grain.young_mpa", "is not calibrated"],
        ),
        (
            "fraction = 0.2,",
            "facets = 1000000000, fraction = 0.2,",
            &["specimen.grains", "facets = 1000000000", "6 to 200"],
        ),
        (
            "fraction = 0.2,",
            "sizes = [{ median_radius_mm = 0.0001, spread = 0.1, share = 1.0 }], fraction = 0.2,",
            &["specimen.grains", "grains", "median_radius_mm"],
        ),
        ("voxel_mm = 0.05", "voxel_mm = -0.05", &["specimen.scan", "voxel_mm = -0.05"]),
        ("blur = 0.7", "blur = nan", &["specimen.scan", "blur = NaN"]),
        ("h_voxels = 0.5", "h_voxels = 1e9", &["specimen.image", "h_voxels = 1000000000"]),
        (
            "# stack = ",
            "stack = ",
            &["specimen.grains", "cannot be combined with specimen.image.stack"],
        ),
        ("# further_stacks = ", "further_stacks = ", &["specimen.image.stack", "is missing"]),
        (
            "# labels = ",
            "labels = ",
            &["specimen.grains", "cannot be combined with specimen.image.labels"],
        ),
        (
            "# background = ",
            "background = ",
            &["specimen.image.background", "needs specimen.image.labels"],
        ),
        (
            "# label_phases = ",
            "label_phases = ",
            &["specimen.image.label_phases", "needs specimen.image.labels"],
        ),
        (
            "contrast = \"bright\"",
            "contrast = \"dark\"\nlabels = \"labels.tif\"",
            &["specimen.image.contrast", "cannot be combined with specimen.image.labels"],
        ),
        ("# packings = 10", "packings = 1", &["design.packings = 1", "between 2 and 100"]),
        ("# packings = 10", "packings = 101", &["design.packings = 101", "between 2 and 100"]),
        (
            "microstructure = \"per-run\"",
            "packings = 5\nmicrostructure = \"one\"",
            &["design.packings = 5", "cannot be combined with design.microstructure"],
        ),
        (
            "min_dihedral_deg = 12.0",
            "min_dihedral_deg = 60.0",
            &["specimen", "min_dihedral_deg = 60"],
        ),
        (
            "grain_mode = \"fraction\"",
            "grain_mode = \"aut\"",
            &["specimen.grain_mode", "\"auto\"?"],
        ),
        (
            "quantities = [\"slope\", ",
            "quantities = [\"slop\", ",
            &["qoi.quantities", "\"slope\"?"],
        ),
        (
            "quantities = [\"slope\", ",
            "quantities = [\"slope\", \"slope\", ",
            &["qoi.quantities", "named twice"],
        ),
        (
            "curve_percent = [25, 50, 75]",
            "curve_percent = [50, 25]",
            &["qoi.curve_percent = [50, 25]", "ascending order"],
        ),
        (
            "curve_percent = [25, 50, 75]",
            "curve_percent = [0, 25]",
            &["qoi.curve_percent = 0", "1 and 199"],
        ),
        (
            "curve_percent = [25, 50, 75]",
            "curve_percent = [50, 100]",
            &["qoi.curve_percent = [50, 100]", "that of the peak"],
        ),
        (
            "quantities = [\"slope\", ",
            "quantities = [\"post-peak-slope\", ",
            &["test.stop_below_peak = 0.03", "post-peak-slope", "130 %", "write 0.15 or more"],
        ),
        (
            "quantities = [\"slope\", ",
            "quantities = [\"force-at-0.25-mm\", ",
            &["qoi.quantities = force-at-0.25-mm", "test.displacement_mm = 0.22"],
        ),
        (
            "quantities = [\"slope\", ",
            "quantities = [\"force-at-0-percent\", ",
            &["qoi.quantities", "\"force-at-50-percent\"?"],
        ),
        (
            "percent = { slope = 1.5,",
            "percent = { energy-to-peak = 3.0,",
            &[
                "calibration.discrepancy.percent.energy-to-peak = 3",
                "not compared",
                "slope, peak-force",
            ],
        ),
        (
            "percent = { slope = 1.5,",
            "percent = { slope = -3.0,",
            &["calibration.discrepancy.percent.slope = -3", "standard deviation"],
        ),
        ("runs = 100", "runs = 2", &["design.runs = 2"]),
        ("chains = 4", "chains = 0", &["calibration.chains = 0"]),
        ("specimens = 8", "specimens = 1", &["experiments.virtual.specimens = 1"]),
        (
            "matrix.young_mpa = 0.03 ",
            "matrix.young_mpa = 3.0 ",
            &["experiments.virtual.scatter.matrix.young_mpa = 3", "relative"],
        ),
    ];
    for (from, to, fragments) in changes {
        assert!(Case::TEMPLATE.contains(from), "the default case has no {from:?}");
        let text = Case::TEMPLATE.replacen(from, to, 1);
        let message = CaseFile::parse(&text, Path::new("case.toml")).unwrap_err().to_string();
        for fragment in [&"case.toml"].into_iter().chain(*fragments) {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
        // messages that quote a line of the file state its number
        let line = 1 + text.lines().position(|line| line.contains(to)).unwrap_or_default();
        if message.contains(&format!("\n{line} | ")) {
            assert!(message.contains(&format!("case.toml:{line}")), "{message:?}");
        }
    }
}

#[test]
fn laws_with_constants_of_their_own_become_materials() {
    let parse = |law: &str, prior: &str| {
        let text = format!(
            "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
             [material.matrix]\nlaw = {law}\n[test]\ndisplacement_mm = 0.2\n{prior}"
        );
        CaseFile::parse(&text, Path::new("case.toml"))
    };
    let shear = |law: &str| {
        let case = parse(law, "").unwrap().case;
        let elasticity = case.material["matrix"].in_fem().unwrap().elasticity;
        assert_eq!(CaseFile::parse(&case.to_toml(), Path::new("again.toml")).unwrap().case, case);
        elasticity.young_mpa() / (2.0 * (1.0 + elasticity.poisson()))
    };
    let mooney = "{ mooney-rivlin = { c10_mpa = 0.16, c01_mpa = 0.01, bulk_mpa = 20.0 } }";
    assert!((shear(mooney) - 2.0 * 0.17).abs() < 1e-12);
    let ogden = "{ ogden = { terms = [{ mu_mpa = 0.63, alpha = 1.3 }, \
                 { mu_mpa = -0.01, alpha = -2.0 }], bulk_mpa = 40.0 } }";
    assert!((shear(ogden) - 0.5 * (0.63 * 1.3 + 0.01 * 2.0)).abs() < 1e-12);
    let kirchhoff = shear("\"saint-venant-kirchhoff\"\nyoung_mpa = 275\npoisson = 0.25");
    assert!((kirchhoff - 110.0).abs() < 1e-10);
    for (law, prior, fragments) in [
        (mooney.replace("0.16", "-0.16"), "", ["material.matrix.law", "not both positive"]),
        (ogden.replace("-2.0", "0.0"), "", ["material.matrix.law.ogden.terms", "alpha = 0"]),
        (
            format!("{mooney}\ntoughness_n_per_mm = 1.0"),
            "[prior]\nmatrix.young_mpa = [1, 2]\n[phase_field]\nlength_mm = 0.1\n",
            ["prior.matrix.young_mpa", "no Young's modulus"],
        ),
    ] {
        let message = parse(&law, prior).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
}

#[test]
fn a_mesh_replaces_lattice_and_packing() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.toml");
    std::fs::write(dir.path().join("cylinder.msh"), "").unwrap();
    let rest =
        "[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
    let parse = |specimen: &str| CaseFile::parse(&format!("[specimen]\n{specimen}\n{rest}"), &path);
    let good =
        "mesh = \"cylinder.msh\"\nregions = { matrix = 1 }\nsurfaces = { bottom = 11, top = 12 }";
    let geometry = parse(good).unwrap().geometry().unwrap();
    assert!(
        matches!(geometry, SpecimenGeometry::Mesh { file, .. } if file == dir.path().join("cylinder.msh"))
    );
    for (specimen, part) in [
        (good.replace("cylinder", "missing"), "there is no such file"),
        (format!("{good}\nradius_mm = 2.5"), "cannot be combined with specimen.mesh"),
        (good.replace("regions = { matrix = 1 }", ""), "specimen.regions"),
        (good.replace(", top = 12", ""), "the surface top is missing"),
        (good.replace("{ matrix = 1 }", "{ matrix = 1, void = 3 }"), "material.void"),
        (good.replace("{ matrix = 1 }", "{ matrix = 1, grain = 1 }"), "grain and matrix both"),
        (good.replace("top = 12", "top = 11"), "bottom and top both"),
    ] {
        let message = parse(&specimen).unwrap_err().to_string();
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn surfaces_take_the_place_of_a_packing_and_an_image() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("stl")).unwrap();
    let parse = |specimen: &str, stl: &str| {
        let grain = "[material.grain]\nyoung_mpa = 22000\npoisson = 0.25\n";
        let text = format!(
            "[specimen]\n{specimen}\n[specimen.stl]\n{stl}\n[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n\
             {grain}[test]\ndisplacement_mm = 0.2\nsteps = 2\n"
        );
        CaseFile::parse(&text, &dir.path().join("case.toml"))
    };
    let (specimen, good) = ("spacing_mm = 0.5", "surfaces = \"stl\"");
    let file = parse(specimen, good).unwrap();
    let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
    assert_eq!(again, file);
    let SpecimenGeometry::Surfaces { import, radius_mm: None, .. } = file.geometry().unwrap()
    else {
        panic!("no surfaces")
    };
    assert_eq!(import, fem::SurfaceImport::new(dir.path().join("stl")));
    let all = "unit_mm = 0.001\naxis = \"x\"\nsmoothing_passes = 3\ndecimation = 20\nleast_distance_mm = 0.01\nmargin_mm = 0.1";
    let SpecimenGeometry::Surfaces { import, height_mm: Some(4.0), .. } =
        parse("spacing_mm = 0.5\nheight_mm = 4.0", &format!("{good}\n{all}"))
            .unwrap()
            .geometry()
            .unwrap()
    else {
        panic!("no surfaces")
    };
    assert_eq!(
        (import.unit_mm, import.axis, import.decimation),
        (0.001, fem::SurfaceAxis::X, 20.0)
    );
    for (specimen, stl, fragments) in [
        (specimen, "surfaces = \"other\"", ["specimen.stl.surfaces", "there is no such file"]),
        (specimen, "unit_mm = 1.0", ["surfaces", "missing"]),
        (
            specimen,
            "surfaces = \"stl\"\nunit_mm = 0.0",
            ["specimen.stl", "unit_mm = 0; give a length"],
        ),
        (specimen, "surfaces = \"stl\"\ndecimation = 0.5", ["specimen.stl", "recommended: 20"]),
        (specimen, "surfaces = \"stl\"\nmargin = 1.0", ["margin", "margin_mm"]),
        (specimen, "surfaces = \"stl\"\naxis = \"q\"", ["axis", "z"]),
        ("radius_mm = 2.5", good, ["specimen.spacing_mm", "is missing"]),
        (
            "spacing_mm = 0.5\ngrains = { fraction = 0.2, seed = 1 }",
            good,
            ["specimen.grains", "cannot be combined with specimen.stl"],
        ),
        (
            "spacing_mm = 0.5\nimage = { stack = \"a.tif\" }",
            good,
            ["specimen.image", "cannot be combined with specimen.stl"],
        ),
        (
            "mesh = \"a.msh\"\nregions = { matrix = 1 }",
            good,
            ["specimen.stl", "cannot be combined with specimen.mesh"],
        ),
    ] {
        let message = parse(specimen, stl).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
}

#[test]
fn phases_of_labels_are_regions_with_materials() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("labels.tif"), "II*").unwrap();
    let parse = |image: &str, rest: &str| {
        let text = format!(
            "[specimen]\nspacing_mm = 0.5\n[specimen.image]\n{image}\n[material.matrix]\nyoung_mpa = 275\n\
             poisson = 0.25\n[test]\ndisplacement_mm = 0.2\nsteps = 2\n{rest}\n"
        );
        CaseFile::parse(&text, &dir.path().join("case.toml"))
    };
    let phases = "labels = \"labels.tif\"\nbackground = 255\n\
                  label_phases = { 1 = \"grain\", 20 = \"void\", \"3 to 9\" = \"inclusion\" }";
    let of = |name: &str| format!("[material.{name}]\nyoung_mpa = 22000\npoisson = 0.2\n");
    let both = of("grain") + &of("inclusion");
    let file = parse(phases, &both).unwrap();
    let again = CaseFile::parse(&file.case.to_toml(), &file.path).unwrap();
    assert_eq!(again, file);
    let SpecimenGeometry::Image { labels: Some(rules), .. } = file.geometry().unwrap() else {
        panic!("no labels")
    };
    assert_eq!((rules.background, rules.phases.len()), (Some(255), 3));
    assert_eq!(rules.grain_phases(), ["grain", "inclusion", "void"]);
    // if no phases are given, each label is a grain
    let plain = "labels = \"labels.tif\"";
    assert!(parse(plain, &of("grain")).is_ok());
    let prior = "[prior]\ninclusion.young_mpa = [10000.0, 30000.0]\n";
    assert!(parse(phases, &format!("{both}{prior}")).is_ok());

    for (image, rest, fragments) in [
        (phases.to_owned(), of("grain"), ["material.inclusion", "is missing"]),
        (phases.to_owned(), both.clone() + &of("crust"), ["material.crust", "grain, inclusion"]),
        (phases.to_owned(), both.clone() + &of("void"), ["material.void", "no part of the mesh"]),
        (phases.replace("1 = \"grain\", ", ""), both.clone(), ["material.grain", "belongs to no"]),
        (phases.to_owned(), of("grain") + prior, ["material.inclusion", "is missing"]),
        (phases.replace("255", "5"), both.clone(), ["specimen.image", "also a label of inclusion"]),
        (phases.replace("20", "4"), both.clone(), ["specimen.image", "the label 4 belongs to"]),
        (phases.replace("20", "x"), both.clone(), ["label_phases", "names no label"]),
        (phases.replace("void", "a.b"), both.clone(), ["label_phases", "not the name of a phase"]),
        (format!("{phases}\nbin = 2"), both.clone(), ["specimen.image.bin = 2", "no mean"]),
        (
            format!("{phases}\nstack = \"a.tif\""),
            both.clone(),
            ["image.labels", "cannot be combined"],
        ),
        (
            format!("{plain}\nspecimen = \"cylinder\""),
            of("grain"),
            ["specimen.image", "give background"],
        ),
        (
            plain.replace("labels.tif", "other.tif"),
            of("grain"),
            ["specimen.image.labels", "no such"],
        ),
    ] {
        let message = parse(&image, &rest).unwrap_err().to_string();
        assert!(
            fragments.iter().all(|fragment| message.contains(fragment)),
            "{fragments:?} in {message:?}"
        );
    }
}

#[test]
fn conditions_replace_the_platens() {
    let specimen = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
                    [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n";
    let parse = |test: &str, conditions: &str| {
        let text = format!("{specimen}[test]\n{test}\n[conditions]\n{conditions}\n");
        CaseFile::parse(&text, Path::new("case.toml"))
    };
    let hold = "{ surface = \"bottom\", x_mm = 0.0, y_mm = 0.0, z_mm = 0.0 }";
    let measure = "measure = { surface = \"top\", direction = [1, 0, 0] }";
    let good = format!("prescribe = [{hold}, {{ surface = \"top\", x_mm = 0.1 }}]\n{measure}");
    let case = parse("steps = 2", &good).unwrap().case;
    assert_eq!(CaseFile::parse(&case.to_toml(), Path::new("again.toml")).unwrap().case, case);
    let prior = "\n[prior]\nmatrix.young_mpa = [250.0, 300.0]";
    parse("steps = 2", &format!("{good}{prior}")).unwrap();
    let loads = "pressure = [{ surface = \"side\", pressure_mpa = 5.0, kind = \"dead\" }]\n\
                 table = [[0.5, 1.0]]\nextensometer = { from_mm = [0, 0, 1], to_mm = [0, 0, 2] }";
    let case = parse("steps = 2", &format!("{good}\n{loads}")).unwrap().case;
    assert_eq!(CaseFile::parse(&case.to_toml(), Path::new("again.toml")).unwrap().case, case);
    for (test, conditions, fragments) in [
        ("displacement_mm = 0.1", good.clone(), ["test.displacement_mm", "remove one of the two"]),
        ("platens = \"unilateral\"", good.clone(), ["test.platens", "replace the platens"]),
        (
            "steps = 2",
            good.replace("x_mm = 0.1", "x_mm = 0.1, table = [[1.0, 1.0], [1.0, 0.0]]"),
            ["prescribe (top).table = 1 s", "increase from point to point"],
        ),
        (
            "steps = 2",
            good.replace("x_mm = 0.1", "x_mm = 0.1, table = []"),
            ["prescribe (top).table", "has no points"],
        ),
        (
            "steps = 2",
            good.replace("x_mm = 0.1", "x_mm = 0.1, table = \"missing.csv\""),
            ["missing.csv", "cannot be read"],
        ),
        (
            "steps = 2",
            format!("{good}\npressure = [{{ surface = \"side\", pressure_mpa = nan }}]"),
            ["pressure (side).pressure_mpa = NaN", "the end"],
        ),
        (
            "steps = 2",
            format!("{good}\nextensometer = {{ from_mm = [0, 0, 1], to_mm = [0, 0, 1] }}"),
            ["conditions.extensometer.to_mm", "same point"],
        ),
        ("steps = 2", good.replace(measure, ""), ["[conditions]", "measure is missing"]),
        ("steps = 2", good.replace("x_mm = 0.1", ""), ["prescribe (top)", "prescribes no value"]),
        ("steps = 2", good.replace("x_mm = 0.1", "x_mm = nan"), ["(top).x_mm = NaN", "the end"]),
        ("steps = 2", good.replace("x_mm = 0.1", "damage = 2"), ["(top).damage = 2", "crack"]),
        ("steps = 2", good.replace("x_mm = 0.1", "x = 0.1"), ["unknown key \"x\"", "x_mm, y_mm"]),
    ] {
        let message = parse(test, &conditions).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "{fragment:?} is not in {message:?}");
        }
    }
    let nothing = format!("{specimen}[test]\nsteps = 2\n");
    let message = CaseFile::parse(&nothing, Path::new("case.toml")).unwrap_err().to_string();
    for part in ["test.displacement_mm", "is missing", "[conditions]"] {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn an_extension_beyond_the_end_of_the_distribution_is_refused() {
    let prior = "matrix.young_mpa = { distribution = \"triangular\", lower = 250.0, mode = 270.0, \
                 upper = 300.0 }";
    let text = Case::TEMPLATE.replacen("matrix.young_mpa = [250.0, 300.0]", prior, 1);
    let extended = |upper: &str| {
        let batch = format!("[[extend]]\nruns = 9\nprior.matrix.young_mpa = [280.0, {upper}]\n");
        let text = text.replacen("[design]  ", &format!("{batch}[design]  "), 1);
        CaseFile::parse(&text, Path::new("case.toml")).map_err(|error| error.to_string())
    };
    let whole = extended("300.0").unwrap().case.whole_prior().unwrap();
    let prior = whole.get(&"matrix.young_mpa".parse().unwrap()).unwrap();
    assert_eq!(prior.range()[1], 300.0);
    let message = extended("350.0").unwrap_err();
    for part in ["extend[0].prior.matrix.young_mpa = [280.0, 350.0]", "at most 300"] {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

#[test]
fn a_single_simulation_does_not_need_the_specimen_table() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("case.toml");
    let text = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
                [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
                [experiments]\ntable = \"specimens.csv\"\n";
    let file = CaseFile::parse(text, &path).unwrap();
    let message = file.table().unwrap_err().to_string();
    for part in
        ["case.toml", "experiments.table = specimens.csv", "no such file", "looks for it at"]
    {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
    let table = dir.path().join("specimens.csv");
    std::fs::write(&table, "").unwrap();
    assert_eq!(file.table().unwrap(), Some(table));
}

#[test]
fn load_steps_too_few_for_an_ensemble_are_refused_as_such() {
    let with = |steps: &str| {
        let text = Case::TEMPLATE.replacen("steps = 44", steps, 1);
        CaseFile::parse(&text, Path::new("case.toml")).unwrap().check_steps()
    };
    let message = with("steps = 1").unwrap_err().to_string();
    for part in ["case.toml", "test.steps = 1", "44 steps"] {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
    assert_eq!(with("steps = 44"), Ok(()));
    assert_eq!(with(""), Ok(()), "steps that adapt are as many as it takes");
    // without a peak, the limit is the number of points of a curve
    let without_peak = |steps: u32| {
        let text = Case::TEMPLATE.replacen("steps = 44", &format!("steps = {steps}"), 1);
        let mut file = CaseFile::parse(&text, Path::new("case.toml")).unwrap();
        let force = ForceAt::micrometres(50).expect("a positive displacement");
        file.case.qoi.quantities = vec![Quantity::new(force)];
        file.check_steps()
    };
    assert_eq!(without_peak(4), Ok(()));
    let message = without_peak(3).unwrap_err().to_string();
    for part in ["test.steps = 3", "at least five points"] {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
}

/// The paper's sampling: four chains with 2 000 warm-up steps and 50 000 further steps each; the first 25 000 of these
/// steps are discarded, and every tenth of the others is stored.
#[test]
fn the_papers_sampling_is_one_key() {
    let own = "chains = 4\nwarmup = 1000\ndraws = 2000                     # number of stored draws per chain\n";
    assert!(Case::TEMPLATE.contains(own));
    let with = |text: &str| {
        CaseFile::parse(&text.replace(own, "sampling = \"paper\"\n"), "c.toml".as_ref())
    };
    let calibration = with(Case::TEMPLATE).unwrap().case.calibration;
    let CalibrationCase { chains, warmup, burn_in, draws, thin, .. } = calibration;
    assert_eq!((chains, warmup, burn_in), (4, 2_000, 25_000));
    assert_eq!((draws, burn_in + draws * thin), (2_500, 50_000));
    let written = with(Case::TEMPLATE).unwrap().case.to_toml();
    let read = CaseFile::parse(&written, "c.toml".as_ref()).unwrap();
    assert_eq!(read.case.calibration, calibration, "as it is written out");
    let both = Case::TEMPLATE.replace("chains = 4\n", "chains = 4\nsampling = \"paper\"\n");
    let error = CaseFile::parse(&both, "c.toml".as_ref()).unwrap_err().to_string();
    assert!(error.contains("remove chains"), "{error}");
}
