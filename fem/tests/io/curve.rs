//! Curve files with derivatives, and errors of invalid curve files.

use fem::{CurvePoint, CurveWriter, read_curve};

#[test]
fn errors_name_the_line_and_the_column() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("curve.csv");
    let refused = |text: &str, fragments: [&str; 3]| {
        std::fs::write(&path, text).unwrap();
        let message = read_curve(&path).unwrap_err().to_string();
        for fragment in fragments {
            assert!(message.contains(fragment), "'{fragment}' is not in: {message}");
        }
    };
    refused(
        "time_s,displacement_mm\n0,0\n",
        ["curve.csv", "no column 'force_N'", "its header must contain"],
    );
    let header = "time_s,displacement_mm,force_N,elastic_N_mm,fracture_N_mm,viscous_N_mm,phi_mean,\
                  phi_max";
    refused(
        &format!("{header}\n0,0,0,0,0,0,0,0\n1,0,high,0,0,0,0,0\n"),
        ["line 3", "'force_N'", "high"],
    );
    refused(&format!("{header}\n0,0\n"), ["curve.csv", "not a table", "2 fields"]);
    assert!(read_curve(dir.path().join("absent.csv")).is_err());
}

#[test]
fn derivatives_are_the_last_columns() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let names = ["young_mpa", "Gc, N/mm"].map(String::from);
    let mut writer = CurveWriter::with_parameters(file.path(), &names).unwrap();
    let curve = [1.0, 2.0, 3.0].map(|time_s| CurvePoint { time_s, ..CurvePoint::default() });
    writer.push_differentiated(&curve[0], &[0.1, 1.0 / 3.0]).unwrap();
    writer.push_differentiated(&curve[1], &[-2.5, 4.0]).unwrap();
    // write a point without derivatives
    writer.push(&curve[2]).unwrap();
    drop(writer);
    let mut reader = csv::Reader::from_path(file.path()).unwrap();
    let header = reader.headers().unwrap().clone();
    let places = ["d_force_d_young_mpa", "d_force_d_Gc, N/mm"]
        .map(|name| header.iter().position(|h| h == name).unwrap());
    assert_eq!(places, [header.len() - 2, header.len() - 1]);
    let cells: Vec<[String; 2]> = reader
        .records()
        .map(|record| places.map(|k| record.as_ref().unwrap()[k].to_owned()))
        .collect();
    let number = |k: usize, j: usize| cells[k][j].parse::<f64>().unwrap();
    assert_eq!([number(0, 0), number(0, 1), number(1, 0)], [0.1, 1.0 / 3.0, -2.5]);
    assert_eq!(cells[2], ["", ""]);
    assert_eq!(read_curve(file.path()).unwrap(), curve);
}
