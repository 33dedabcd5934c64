//! Changes of the default case to invalid values: each error names its key and the remedy.

use std::path::Path;

use super::super::{Case, CaseFile};

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
