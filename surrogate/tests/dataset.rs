//! Datasets on disk: the contents of the file, and the error messages.

use std::path::Path;

use proptest::prelude::*;
use surrogate::{Dataset, Input, SurrogateError};

fn example() -> Dataset {
    let inputs = vec![
        Input::new("young, \"static\" (MPa)", 250.0, 300.0).unwrap(),
        Input::new("toughness_n_per_mm", 1e-5, 5e-3).unwrap(),
    ];
    let outputs = vec!["force_n".to_owned(), "slope".to_owned()];
    Dataset::new(inputs, outputs, "ensemble of 2 runs\r\nmesh: 3k tets, # seed 1").unwrap()
}

fn round_trip(data: &Dataset) -> Dataset {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs.csv");
    data.write_csv(&path).unwrap();
    Dataset::read_csv(&path).unwrap()
}

#[test]
fn a_file_keeps_names_bounds_provenance_and_every_bit() {
    let mut data = example();
    assert_eq!(round_trip(&data), data);
    data.push(&[275.0, 0.1 + 0.2e-3 - 0.1], &[-0.0, f64::MIN_POSITIVE / 3.0]).unwrap();
    data.push(&[300.0, 1e-5], &[1.0 / 3.0, -f64::MAX]).unwrap();
    let back = round_trip(&data);
    assert_eq!(back, data);
    assert!(back.row(0).1[0].is_sign_negative());
    assert_eq!(back.provenance(), "ensemble of 2 runs\nmesh: 3k tets, # seed 1");
}

proptest! {
    #[test]
    fn any_finite_number_survives_the_file(bits in any::<u64>(), fraction in 0.0..1.0f64) {
        let y = f64::from_bits(bits);
        prop_assume!(y.is_finite());
        let mut data = example();
        data.push(&[250.0 + 50.0 * fraction, 1e-3], &[y, -y]).unwrap();
        prop_assert_eq!(round_trip(&data).row(0).1[0].to_bits(), bits);
    }
}

/// Returns the error message for a file with the given lines.
fn refusal(lines: &[&str]) -> String {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs.csv");
    std::fs::write(&path, lines.join("\n")).unwrap();
    let message = Dataset::read_csv(&path).unwrap_err().to_string();
    assert!(message.contains("runs.csv, line "), "{message}");
    message
}

const HEAD: [&str; 4] = ["# provenance: by hand", "# input,a,0,1", "# output,f", "a,f"];

fn refused_row(row: &str) -> String {
    refusal(&[&HEAD[..], &["0.5,1", row]].concat())
}

#[test]
fn a_bad_row_is_named_by_line_column_and_value() {
    for (row, words) in [
        ("1.5,1", "line 6: column `a` = 1.5 lies outside its bounds [0, 1]"),
        ("0.5,NaN", "line 6: column `f` = NaN is not finite"),
        ("0.5,inf", "line 6: column `f` = inf is not finite"),
        ("0.5,two", "line 6: column `f`: `two` is not a number"),
        ("0.5,", "line 6: column `f`: `` is not a number"),
        ("0.5", "line 6: the row has 1 cells but the header has 2"),
        ("# remark\n\n0.5", "line 8: the row has 1 cells"),
        ("# remark\n\n-1,0", "line 8: column `a` = -1"),
    ] {
        let message = refused_row(row);
        assert!(message.contains(words), "{message}");
        assert!(message.contains(';'), "the message has no advice: {message}");
    }
}

#[test]
fn a_bad_header_is_named_too() {
    for (lines, words) in [
        (
            &["# input,a,0,1", "# output,f", "a,g"][..],
            "line 3: column `f` is missing; the header has: a, g",
        ),
        (&["# input,a,0,1", "# output,f", "a,f,f"], "line 3: the name `f` occurs twice"),
        (&["# input,a,0,1", "# output,a", "a,f"], "the name `a` occurs twice"),
        (&["# input,a,0,1", "a,f"], "line 1: the inputs or the outputs are not declared"),
        (&["a,f", "1,2"], "write"),
        (&["# input,a,0", "# output,f", "a,f"], "line 1: `# input,a,0` is not a declaration"),
        (&["# output,f", "# input,a,0,one", "a,f"], "line 2: column `a`: `one` is not a number"),
        (&["# output,f", "# input,a,2,1", "a,f"], "line 2: input `a` has the bounds [2, 1]"),
    ] {
        let message = refusal(lines);
        assert!(
            message.contains(words) || words == "write" && message.contains("# input,NAME"),
            "{message}"
        );
    }
    let absent = Dataset::read_csv(Path::new("no/such/runs.csv")).unwrap_err();
    assert!(
        matches!(absent, SurrogateError::Io { .. })
            && absent.to_string().contains("no/such/runs.csv")
    );
}

#[test]
fn columns_are_found_by_name_and_others_are_notes() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("runs.csv");
    std::fs::write(&path, "# input,a,0,1\n# a remark\n# output,f\nstatus, f ,a\nok, 3 ,0.25\n# late remark\nok,4,0.5\n").unwrap();
    let data = Dataset::read_csv(&path).unwrap();
    assert_eq!(data.len(), 2);
    assert_eq!(data.row(0), (&[0.25][..], &[3.0][..]));
    assert_eq!((data.notes(), data.note(1, "status")), (&["status".to_owned()][..], Some("ok")));
    assert_eq!((data.note(2, "status"), data.note(0, "a")), (None, None));
    assert_eq!(round_trip(&data), data);
}

#[test]
fn declarations_and_rows_are_checked_in_memory() {
    let a = || Input::new("a", 0.0, 1.0).unwrap();
    for name in ["", " a", "#a", "a\nb"] {
        assert!(matches!(Input::new(name, 0.0, 1.0), Err(SurrogateError::Name { .. })), "{name:?}");
    }
    for (lower, upper) in [(1.0, 1.0), (f64::NAN, 1.0), (0.0, f64::INFINITY), (-f64::MAX, f64::MAX)]
    {
        assert!(matches!(Input::new("a", lower, upper), Err(SurrogateError::Bounds { .. })));
    }
    assert!(matches!(
        Dataset::new(vec![], vec!["f".into()], ""),
        Err(SurrogateError::Count { .. })
    ));
    assert!(matches!(
        Dataset::new(vec![a(), a()], vec!["f".into()], ""),
        Err(SurrogateError::DuplicateName { .. })
    ));
    let mut data = Dataset::new(vec![a()], vec!["f".into()], "").unwrap();
    assert!(matches!(data.push(&[0.5, 0.5], &[1.0]), Err(SurrogateError::Count { .. })));
    assert!(matches!(data.push(&[f64::NAN], &[1.0]), Err(SurrogateError::NotFinite { .. })));
    assert!(data.is_empty());
}
