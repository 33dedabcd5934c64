//! Specimens of a material that relaxes: their curves are bent from the start and have no soft start.

use super::{TINY, breccia, table};

/// The extrapolation to zero force finds a toe of more than 2 % in the curves of virtual specimens, but the simulation at the
/// mode has the same toe.
#[test]
fn a_curve_bent_by_relaxation_is_no_toe() {
    let dir = tempfile::tempdir().unwrap();
    let series = "[material.matrix.viscoelastic]\n\
                  shear = [{ fraction = 0.3, time_s = 0.1 }, { fraction = 0.2, time_s = 1.0 }]\n\
                  [material.grain]";
    let case = TINY.replacen("[material.grain]", series, 1);
    std::fs::write(dir.path().join("case.toml"), case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "case.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    let out = dir.path().join("out");
    // the texts of this table contain commas
    let checks = std::fs::read_to_string(out.join("curve_checks.csv")).unwrap();
    let toes: Vec<&str> = checks.lines().filter(|line| line.contains(",toe,")).collect();
    assert_eq!(toes.len(), 3, "{checks}");
    assert!(toes.iter().all(|text| text.contains("-2.") || text.contains("-3.")), "{toes:?}");
    let warnings = std::fs::read_to_string(out.join("warnings.txt")).unwrap();
    assert!(!warnings.contains("toe") && !err.contains("include a toe"), "{warnings}{err}");
    for row in table(&out.join("verdict.csv")) {
        assert!(!row["verdict"].contains("toe"), "{row:?}");
    }
}
