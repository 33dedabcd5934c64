//! Cases with several tests.

use std::path::Path;

use super::*;
use crate::case::{CovarianceCase, Likelihood};

const SHIPPED: &str = include_str!("../../../cases/fast-and-slow.toml");
const SPECIMENS_OF_SLOW: &str =
    "set.experiments.virtual = { specimens = 6, noise.displacement_mm = 0.00005 }";

const CASE_WITH_ONE_TEST: &str = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 0.7\n\
    [material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n\
    [prior]\nmatrix.young_mpa = [250.0, 300.0]\n";

fn read(text: &str) -> (Option<CaseFile>, Vec<String>) {
    let (file, mistakes) = CaseFile::parse_all(text, Path::new("case.toml"));
    (file, mistakes.iter().map(ToString::to_string).collect())
}

fn with(changes: &[(&str, &str)]) -> String {
    let mut text = SHIPPED.to_owned();
    for (from, to) in changes {
        assert!(text.contains(from), "the case has no {from:?}");
        text = text.replacen(from, to, 1);
    }
    text
}

#[test]
fn each_test_is_the_case_with_its_keys_and_seeds_of_its_own() {
    let (file, mistakes) = read(SHIPPED);
    assert_eq!(mistakes, [""; 0]);
    let tests = single_tests(&file.unwrap()).unwrap();
    let names: Vec<&str> = tests.iter().map(|test| test.name.as_str()).collect();
    assert_eq!(names, ["fast", "slow"]);
    let of = |test: &SingleTest| {
        let case = &test.file.case;
        let specimens = case.experiments.clone().unwrap().virtual_specimens.unwrap();
        (
            case.test.duration_s,
            case.test.steps,
            specimens.specimens,
            specimens.seed,
            case.design.seed,
        )
    };
    assert_eq!(of(&tests[0]), (Some(1.0), Some(44), 8, 2026, 1));
    assert_eq!(of(&tests[1]), (Some(16.0), Some(44), 6, 2027, 2));
    assert!(tests.iter().all(|test| test.file.case.tests.is_empty() && test.own.is_empty()));
}

/// Tests that differ only in their specimens have the same simulations, and share the runs of
/// these simulations.
#[test]
fn equal_simulations_have_one_design() {
    let text = with(&[(
        "displacement_mm = 0.06, duration_s = 16.0",
        "displacement_mm = 0.22, duration_s = 1.0",
    )]);
    let tests = single_tests(&read(&text).0.unwrap()).unwrap();
    let seeds: Vec<u64> = tests.iter().map(|test| test.file.case.design.seed).collect();
    assert_eq!(seeds, [1, 1]);
}

#[test]
fn a_prior_of_one_test_is_in_this_test_alone() {
    let own = "prior.test.friction = { distribution = \"beta\", a = 2.0, b = 18.0 }\n\
               set.experiments.virtual.truth.test.friction = 0.1";
    let text = with(&[
        (SPECIMENS_OF_SLOW, own),
        ("duration_s = 16.0 }", "duration_s = 16.0, platens = \"unilateral\" }"),
    ]);
    let (file, mistakes) = read(&text);
    assert_eq!(mistakes, [""; 0]);
    let file = file.unwrap();
    let tests = single_tests(&file).unwrap();
    let has = |test: &SingleTest| {
        test.file.case.prior.as_ref().unwrap().names().any(|name| name == "test.friction")
    };
    assert_eq!((has(&tests[0]), has(&tests[1])), (false, true));
    assert_eq!(tests[1].own, ["test.friction"]);
    // the case that is written with all defaults equals the original case
    let (again, mistakes) = read(&file.case.to_toml());
    assert_eq!(mistakes, [""; 0]);
    assert_eq!(again.unwrap().case, file.case);
}

#[test]
fn a_table_of_specimens_is_divided_by_test() {
    let start = SHIPPED.find("[experiments.virtual]").unwrap();
    let end = SHIPPED.find("[calibration]").unwrap();
    let measured = "[experiments]\ntable = \"specimens.csv\"\n";
    let text = format!("{}{measured}{}", &SHIPPED[..start], &SHIPPED[end..])
        .replace(SPECIMENS_OF_SLOW, "");
    let (file, mistakes) = read(&text);
    assert_eq!(mistakes, [""; 0]);
    let tests = single_tests(&file.unwrap()).unwrap();
    let of = |test: &SingleTest| test.file.case.experiments.clone().unwrap().test;
    assert_eq!((of(&tests[0]).as_deref(), of(&tests[1]).as_deref()), (Some("fast"), Some("slow")));
    // a test may state another name of its specimens; a name that is stated for all tests would have no effect
    let named =
        text.replacen("name = \"slow\"", "name = \"slow\"\nset.experiments.test = \"creep\"", 1);
    let (file, mistakes) = read(&named);
    assert_eq!(mistakes, [""; 0]);
    let tests = single_tests(&file.unwrap()).unwrap();
    assert_eq!(of(&tests[1]).as_deref(), Some("creep"));
    let unused = text.replacen(measured, &format!("{measured}test = \"fast\"\n"), 1);
    let (_, mistakes) = read(&unused);
    assert_eq!(mistakes.len(), 1, "{mistakes:?}");
    assert!(mistakes[0].contains("experiments.test = fast: is not used"), "{mistakes:?}");
}

/// One table of measured quantities has the specimens of all tests, by its column `test`.
#[test]
fn a_table_of_quantities_is_divided_by_test() {
    let dir = tempfile::tempdir().unwrap();
    for file in ["runs.csv", "measured.csv"] {
        std::fs::write(dir.path().join(file), "").unwrap();
    }
    let text = "[parameters]\nk = { unit = \"MPa\", prior = [1.0, 2.0] }\n\
                [design]\nimport = \"runs.csv\"\n[qoi]\nquantities = [\"peak-force\"]\n\
                [experiments]\nvalues = \"measured.csv\"\n\
                [[tests]]\nname = \"fast\"\n[[tests]]\nname = \"slow\"\n";
    let (file, mistakes) = CaseFile::parse_all(text, &dir.path().join("case.toml"));
    assert!(mistakes.is_empty(), "{mistakes:?}");
    let tests = single_tests(&file.unwrap()).unwrap();
    let names = tests.iter().map(|test| test.file.case.experiments.clone().unwrap().test);
    assert_eq!(names.collect::<Vec<_>>(), [Some("fast".to_owned()), Some("slow".to_owned())]);
}

const BUILT_IN_AND_OUTSIDE: &str = "[prior]\nmatrix.young_mpa = [250.0, 300.0]\n\
    [[tests]]\nname = \"bar\"\nset.specimen = { radius_mm = 2.5, height_mm = 4.4, spacing_mm = 0.7 }\n\
    set.material.matrix = { young_mpa = 275, poisson = 0.25 }\nset.test.displacement_mm = 0.2\n\
    set.qoi.quantities = [\"force-at-0.1-mm\"]\n\
    set.experiments.virtual = { specimens = 3, seed = 1, truth.matrix.young_mpa = 275.0 }\n\
    [[tests]]\nname = \"rates\"\n\
    set.simulator = { command = [\"sh\", \"rates.sh\", \"{matrix.young_mpa}\", \"{offset}\"] }\n\
    set.qoi.quantities = [\"column:yield_mpa\"]\nset.experiments.values = \"measured.csv\"\n";

/// A free parameter belongs to the tests whose runs come from outside; one test can have its own free parameters.
#[test]
fn tests_of_the_built_in_simulation_have_no_free_parameters() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("measured.csv"), "").unwrap();
    let declared = "offset = { unit = \"1\", prior = [0.5, 1.75] }\n";
    let of_all = format!("{BUILT_IN_AND_OUTSIDE}[parameters]\n{declared}");
    let of_one = format!("{BUILT_IN_AND_OUTSIDE}parameters.{declared}");
    let read = |text: &str| CaseFile::parse_all(text, &dir.path().join("case.toml"));
    for (text, is_own) in [(&of_all, false), (&of_one, true)] {
        let (file, mistakes) = read(text);
        assert!(mistakes.is_empty(), "{mistakes:?}");
        let file = file.unwrap();
        let (again, _) = read(&file.case.to_toml());
        assert_eq!(again.unwrap().case, file.case);
        let tests = single_tests(&file).unwrap();
        let names = |test: &SingleTest| -> Vec<String> {
            test.file.case.prior.iter().flat_map(|prior| prior.names()).collect()
        };
        assert_eq!(names(&tests[0]), ["matrix.young_mpa"]);
        assert_eq!(names(&tests[1]).len(), 2, "{:?}", names(&tests[1]));
        assert!(tests[0].own.is_empty());
        assert_eq!(tests[1].own.contains(&"offset".to_owned()), is_own);
    }
    for (text, fragment) in [
        (of_one.replace("\nparameters.", "\nset.parameters."), "Write parameters.… beside set"),
        (format!("{of_one}[parameters]\n{declared}"), "(rates).parameters = offset"),
        // a free parameter of a test of the built-in simulation
        (
            BUILT_IN_AND_OUTSIDE.replacen("set.test", &format!("parameters.{declared}set.test"), 1),
            "(bar).parameters.offset",
        ),
    ] {
        let (_, mistakes) = read(&text);
        let all: Vec<String> = mistakes.iter().map(ToString::to_string).collect();
        assert!(all.join("\n").contains(fragment), "{fragment}: {all:?}");
    }
    // without a test from outside, the free parameters are refused
    let (_, mistakes) = self::read(&format!("{SHIPPED}\n[parameters]\n{declared}"));
    assert!(mistakes.join("\n").contains("not a parameter of the built-in"), "{mistakes:?}");
}

/// A test can change the likelihood and the discrepancy, which belong to its own quantities.
#[test]
fn a_test_has_its_own_likelihood_and_discrepancy() {
    let own = "set.calibration = { likelihood = \"curve\", discrepancy.percent.peak-force = 3.0 }";
    let text = with(&[(SPECIMENS_OF_SLOW, own)]);
    let (file, mistakes) = read(&text);
    assert_eq!(mistakes, [""; 0]);
    let tests = single_tests(&file.unwrap()).unwrap();
    let of = |test: &SingleTest| test.file.case.calibration.clone();
    assert_eq!(of(&tests[0]).likelihood, Likelihood::Quantities);
    assert_eq!(of(&tests[1]).likelihood, Likelihood::Curve);
    assert_eq!(of(&tests[1]).discrepancy.percent.len(), 1);
    assert_eq!(of(&tests[0]).seed, of(&tests[1]).seed);
}

#[test]
fn a_relation_between_tests_needs_several_tests() {
    let text = format!(
        "{}\n[calibration]\nbetween_tests.matrix.young_mpa = \"own\"\n",
        CASE_WITH_ONE_TEST
    );
    let (_, mistakes) = read(&text);
    assert_eq!(mistakes.len(), 1, "{mistakes:?}");
    for part in ["calibration.between_tests = matrix.young_mpa", "[[tests]]"] {
        assert!(mistakes[0].contains(part), "{mistakes:?}");
    }
}

#[test]
fn a_pooled_covariance_needs_several_tests() {
    let pooled = "[calibration]\ncovariance = \"pooled\"\n";
    let (_, mistakes) = read(&format!("{CASE_WITH_ONE_TEST}{pooled}"));
    assert_eq!(mistakes.len(), 1, "{mistakes:?}");
    for part in ["calibration.covariance = pooled", "[[tests]]"] {
        assert!(mistakes[0].contains(part), "{mistakes:?}");
    }
    let (file, mistakes) = read(&with(&[("[calibration]\n", pooled)]));
    assert_eq!(mistakes, [""; 0]);
    let file = file.unwrap();
    assert_eq!(file.case.calibration.covariance, CovarianceCase::Pooled);
    for test in single_tests(&file).unwrap() {
        assert_eq!(test.file.case.calibration.covariance, CovarianceCase::Independent);
    }
    let own = "set.calibration.covariance = \"pooled\"";
    let (_, mistakes) = read(&with(&[(SPECIMENS_OF_SLOW, own)]));
    assert!(mistakes[0].contains("in [calibration], once"), "{mistakes:?}");
}

#[test]
fn mistakes_have_the_name_of_their_test_and_the_remedy() {
    let between = |relation: &str| format!("[calibration]\nbetween_tests.{relation}\n");
    // replacements in the text of the case, and texts that the error message must contain
    type Mistake<'a> = (&'a [(&'a str, &'a str)], &'a [&'a str]);
    let cases: [Mistake<'_>; 21] = [
        (&[("name = \"slow\"", "name = \"fast\"")], &["tests[1].name", "two tests"]),
        (&[("name = \"slow\"", "name = \"../slow\"")], &["tests[1].name", "letters, digits"]),
        (&[("name = \"slow\"", "name = \"machine\"")], &["tests[1].name", "table of parameters"]),
        (&[("name = \"slow\"", "nam = \"slow\"")], &["unknown key \"nam\"", "mean \"name\"?"]),
        (
            &[("set.test = { displacement_mm = 0.06", "set.prior = { displacement_mm = 0.06")],
            &["tests (slow).set = prior", "beside set"],
        ),
        (
            &[(SPECIMENS_OF_SLOW, "set.further_tests.specimens = [1]")],
            &["tests (slow).set = further_tests", "once for all tests"],
        ),
        (
            &[(SPECIMENS_OF_SLOW, "without = [\"test.stepz\"]")],
            &["tests (slow).without = test.stepz", "not in the case"],
        ),
        (
            &[(SPECIMENS_OF_SLOW, "set.calibration.between_tests.matrix.young_mpa = \"own\"")],
            &["tests (slow).set = calibration.between_tests", "in [calibration], once"],
        ),
        (
            &[(SPECIMENS_OF_SLOW, "set.calibration = { seed = 3, likelihood = \"curve\" }")],
            &["tests (slow).set = calibration.seed", "calibration.likelihood and"],
        ),
        (
            &[(SPECIMENS_OF_SLOW, "without = [\"calibration.chains\"]")],
            &["tests (slow).without = calibration.chains", "belongs to all tests"],
        ),
        (&[(SPECIMENS_OF_SLOW, "set.calibration.chians = 3")], &["chians", "mean \"chains\"?"]),
        (&[("duration_s = 16.0", "duration_s = -16.0")], &["tests (slow).test.duration_s"]),
        (&[("duration_s = 16.0", "duratoin_s = 16.0")], &["duratoin_s", "mean \"duration_s\"?"]),
        (&[("radius_mm = 2.5", "radius_mm = -2.5")], &["specimen.radius_mm = -2.5"]),
        (&[("[calibration]\n", &between("matrix.young_mpa = \"onw\""))], &["onw", "mean \"own\"?"]),
        (
            &[("[calibration]\n", &between("grain.young_mpa = \"own\""))],
            &["calibration.between_tests.grain.young_mpa", "not a parameter of [prior]"],
        ),
        (
            &[("[calibration]\n", &between("matrix.young_mpa = { varies-percent = 500.0 }"))],
            &["calibration.between_tests.matrix.young_mpa = 500"],
        ),
        (
            &[("[calibration]\n", &between("matrix.young_mpa = { trend = \"temperature\" }"))],
            &[
                "calibration.between_tests.matrix.young_mpa",
                "follows the temperature, but fast has none",
                "set.test.temperature_celsius",
            ],
        ),
        (
            &[
                ("[calibration]\n", &between("matrix.young_mpa = { trend = \"rate\" }")),
                (
                    "displacement_mm = 0.06, duration_s = 16.0",
                    "displacement_mm = 0.44, duration_s = 2.0",
                ),
            ],
            &["follows the rate, but all tests have"],
        ),
        (
            &[("[calibration]\n", &between("matrix.young_mpa = { trend = \"tempo\" }"))],
            &["tempo", "temperature"],
        ),
        (
            &[(
                "[material.grain]",
                "[material.machine]\nyoung_mpa = 1.0\npoisson = 0.2\n[material.grain]",
            )],
            &["material.machine", "not the name of a region"],
        ),
    ];
    for (changes, fragments) in cases {
        let (_, mistakes) = read(&with(changes));
        let all = mistakes.join("\n");
        for fragment in fragments {
            assert!(all.contains(fragment), "{fragment:?} is not in {all:?}");
        }
    }
    // a mistake of the case itself is reported once, without the name of a test
    let (_, mistakes) = read(&with(&[("radius_mm = 2.5", "radius_mm = -2.5")]));
    assert_eq!(mistakes.len(), 1, "{mistakes:?}");
    assert!(!mistakes[0].contains("tests ("), "{mistakes:?}");
}
