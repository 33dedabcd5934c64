//! Curves that are not what they should be.

use fem::read_curve;

#[test]
fn errors_name_the_line_and_the_column() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("curve.csv");
    let refused = |text: &str, parts: [&str; 3]| {
        std::fs::write(&path, text).unwrap();
        let message = read_curve(&path).unwrap_err().to_string();
        for part in parts {
            assert!(message.contains(part), "'{part}' is not in: {message}");
        }
    };
    refused(
        "time_s,displacement_mm\n0,0\n",
        ["curve.csv", "no column 'force_N'", "the header must hold"],
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
