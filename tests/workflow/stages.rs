//! A stage is run again if a key of the case that it has read changes. Checked for every key.

use std::collections::BTreeSet;
use std::path::Path;
use std::sync::atomic::AtomicBool;

use models::{CaseFile, STAGES, Stage, Workflow};
use toml::{Table, Value};

use super::TINY;

/// Stages that read a key of the case, except the report, which reads all keys.
fn readers(key: &str) -> &'static [&'static str] {
    let simulating = &["mesh", "experiments", "ensemble", "confirm"];
    match key.split('.').collect::<Vec<_>>()[..] {
        ["specimen", "order" | "homogenisation"] => simulating,
        ["specimen", "image" | "scan" | "grains" | "radius_mm" | "height_mm", ..] => {
            &["segment", "mesh", "experiments", "ensemble", "confirm"]
        }
        ["specimen", ..] => simulating,
        ["material" | "phase_field" | "solver", ..] => simulating,
        // measured curves of a load program have branches
        ["test", ..] => &["mesh", "experiments", "ensemble", "calibrate", "confirm"],
        // keys of single simulations only
        ["output", ..] => &[],
        // a rule of the verdict computes the toe of the simulation at the mode
        ["qoi", ..] => &["experiments", "ensemble", "confirm", "verdict"],
        // the verdict compares the posterior with the prior
        ["prior", ..] => &["ensemble", "calibrate", "verdict", "next-test"],
        ["design", ..] => &["ensemble"],
        ["fidelity", ..] => &["experiments", "ensemble"],
        // `calibrate` fits a separate surrogate of the shapes of predicted curves
        ["surrogate", ..] => &["surrogate", "calibrate"],
        ["experiments", "virtual", "truth", ..] => &["experiments", "calibrate"],
        // predicted curves are drawn over the measured curves; a rule of the verdict reads the toes
        ["experiments", "toe"] => &["experiments", "calibrate", "verdict"],
        ["experiments", ..] => &["experiments"],
        // the likelihood determines the quantities of [qoi]
        ["calibration", "likelihood"] => {
            &["experiments", "ensemble", "calibrate", "confirm", "verdict", "next-test"]
        }
        // the rule on meshes reads the discrepancy
        ["calibration", ..] => &["calibrate", "verdict", "next-test"],
        ["confirm", ..] => &["confirm"],
        // a rule of the verdict warns of held-out specimens that contradict their prediction
        ["validation", ..] => &["validate", "verdict"],
        ["further_tests", ..] => &["next-test"],
        _ => panic!("{key} is not in the table of this test: say which stages read it"),
    }
}

/// Another valid value of a key.
fn changed(key: &str, value: &Value) -> Value {
    let name = |word: &str| match word {
        "hencky" => "neo-hookean",
        "at2" => "at1",
        "monolithic" => "alternate",
        "none" if key.ends_with("split") => "volumetric-deviatoric",
        "none" => "active-set",
        "auto" if key.starts_with("solver") => "direct",
        "auto" if key.ends_with("grain_mode") => "conforming",
        "auto" if key.ends_with("image.specimen") => "cylinder",
        "bright" => "dark",
        "h-maxima" => "spacing",
        "geometric-mean" => "reuss",
        "auto" => "vertex",
        "sliding" => "unilateral",
        "latin-hypercube" => "sobol",
        "per-run" => "one",
        "all" => "sparse",
        "corrected-loo" => "split",
        "sphere" => "polyhedron",
        "slope" => "energy-to-peak",
        "report" => "correct",
        "quantities" => "curve",
        other => panic!("{key} = {other:?}: give this test another value"),
    };
    match value {
        Value::Boolean(flag) => (!flag).into(),
        Value::Integer(_) if key.ends_with("projections") => 32.into(),
        Value::Integer(n) => (n + 1).into(),
        // values of this key may be 0, so that a relative change has no effect
        Value::Float(_) if key.ends_with("lean") || key.ends_with("threshold_mpa") => 0.01.into(),
        Value::Float(x) => (0.99 * x).into(),
        Value::String(_) if key.ends_with("group") => "60C".into(),
        Value::String(word) => name(word).into(),
        Value::Array(_) if key.ends_with("drive") || key.ends_with("degrade") => {
            ["elastic", "plastic"].map(Value::from).to_vec().into()
        }
        Value::Array(all) => {
            let first = changed(key, &all[0]);
            [first].into_iter().chain(all[1..].iter().cloned()).collect::<Vec<_>>().into()
        }
        Value::Table(table) => {
            let mut table = table.clone();
            let (key, value) = table.iter().next().map(|(k, v)| (k.clone(), v.clone())).unwrap();
            table.insert(key.clone(), changed(&key, &value));
            table.into()
        }
        Value::Datetime(_) => panic!("{key} is no date"),
    }
}

/// Dotted keys of all values of a table.
fn keys(table: &Table, front: &str, found: &mut Vec<String>) {
    for (key, value) in table {
        match value {
            Value::Table(inner) => keys(inner, &format!("{front}{key}."), found),
            _ => found.push(format!("{front}{key}")),
        }
    }
}

fn at<'t>(table: &'t mut Table, key: &str) -> &'t mut Value {
    let (first, rest) = key.split_once('.').map_or((key, None), |(a, b)| (a, Some(b)));
    let value = table.get_mut(first).unwrap();
    match rest {
        Some(rest) => at(value.as_table_mut().unwrap(), rest),
        None => value,
    }
}

fn due(case: &CaseFile, dir: &Path) -> BTreeSet<&'static str> {
    let interrupt = AtomicBool::new(false);
    let workflow = Workflow::open(case, dir, 1, &interrupt).unwrap();
    STAGES.iter().filter(|stage| workflow.due(stage).is_some()).map(|stage| stage.name).collect()
}

#[test]
fn a_changed_key_runs_the_stages_that_read_it_and_no_others() {
    let small = TINY
        .replace("runs = 12", "runs = 6")
        .replace("specimens = 3", "specimens = 2")
        .replace("warmup = 150\ndraws = 150", "warmup = 60\ndraws = 60")
        .replace("max_order = 2", "max_order = 1")
        // in addition to the three parameters, a parameter of another region
        .replace(
            "matrix.viscosity_mpa_s = [0",
            "grain.young_mpa = [18000.0, 26000.0]\nmatrix.viscosity_mpa_s = [0",
        )
        .replace(
            "matrix.viscosity_mpa_s = 0.3 }",
            "matrix.viscosity_mpa_s = 0.3, grain.young_mpa = 22000.0 }",
        );
    let dir = tempfile::tempdir().unwrap();
    let interrupt = AtomicBool::new(false);
    let case = CaseFile::parse(&small, &dir.path().join("case.toml")).unwrap();
    Workflow::open(&case, dir.path(), 2, &interrupt).unwrap().run_all().unwrap();
    assert_eq!(due(&case, dir.path()), BTreeSet::new());
    let names: Vec<String> = super::table(&dir.path().join("map.csv"))
        .iter()
        .map(|row| row["parameter"].clone())
        .collect();
    let region =
        ["young_mpa", "toughness_n_per_mm", "viscosity_mpa_s"].map(|p| format!("matrix.{p}"));
    assert_eq!(names, [&["grain.young_mpa".to_owned()], &region[..]].concat());

    let whole: Table = case.case.to_toml().parse().unwrap();
    let mut all = Vec::new();
    keys(&whole, "", &mut all);
    assert!(all.len() > 50, "{all:?}");
    for key in &all {
        let mut table = whole.clone();
        let value = at(&mut table, key);
        *value = changed(key, value);
        if let "test.friction" | "test.drag_mpa_s_per_mm" = key.as_str() {
            // this key is allowed only for platens from which the ends may lift off
            *at(&mut table, key) = 0.1.into();
            *at(&mut table, "test.platens") = "unilateral".into();
        }
        if let "phase_field.drive" | "phase_field.degrade" = key.as_str() {
            // the plastic energy needs a plastic region; a material has the same readers
            let plastic: Table = "yield_mpa = 100.0".parse().unwrap();
            let grain = at(&mut table, "material.grain").as_table_mut().unwrap();
            grain.insert("plastic".to_owned(), plastic.into());
        }
        let other = CaseFile::parse(&table.to_string(), &case.path)
            .unwrap_or_else(|error| panic!("{key}: {error}"));
        assert_ne!(other.case, case.case, "{key}");
        let expected = readers(key).iter().copied().chain(["report"]).collect();
        assert_eq!(due(&other, dir.path()), expected, "{key}");
    }
    assert_eq!(due(&case, dir.path()), BTreeSet::new(), "a case changed back is as it was");

    // regression: with these two changes the ensemble printed "finished before, unchanged"
    let mut loose = case.clone();
    loose.case.solver.tolerance = 1e-2;
    loose.case.solver.iterations = 1;
    let workflow = Workflow::open(&loose, dir.path(), 1, &interrupt).unwrap();
    let why = workflow.due(Stage::named("ensemble").unwrap());
    assert_eq!(why.as_deref(), Some("solver has changed in the case"));
}
