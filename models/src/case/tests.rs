//! Invalid values and combinations: each error names its key and the remedy.

mod bad_values;
mod specimens;

use std::path::Path;

use super::{CalibrationCase, Case, CaseFile};
use crate::qoi::{ForceAt, Quantity};

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
        (ogden.replace("-2.0", "0.0"), "", ["material.matrix.law.ogden.terms[1]", "alpha = 0"]),
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

/// A message lists at most five names of surfaces, and the number of the others.
#[test]
fn long_lists_of_surfaces_are_shortened() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("cube.msh"), "").unwrap();
    let surfaces: Vec<String> = (1..=8).map(|i| format!("face_{i} = {i}")).collect();
    let text = format!(
        "[specimen]\nmesh = \"cube.msh\"\nregions = {{ matrix = 1 }}\nsurfaces = {{ {} }}\n\
         [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\nsteps = 2\n[conditions]\n\
         prescribe = [{{ surface = \"wall\", x_mm = 0.0, y_mm = 0.0, z_mm = 0.0 }}]\n\
         measure = {{ surface = \"face_1\", direction = [1, 0, 0] }}\n",
        surfaces.join(", ")
    );
    let message = CaseFile::parse(&text, &dir.path().join("case.toml")).unwrap_err().to_string();
    for part in ["prescribe = wall", "face_1, face_2, face_3, face_4, face_5 and 3 others"] {
        assert!(message.contains(part), "{part:?} is not in {message:?}");
    }
    assert!(!message.contains("face_6"), "{message}");
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
