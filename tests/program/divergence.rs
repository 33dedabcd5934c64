//! A run that diverges in spite of all fallbacks keeps its results up to the last equilibrium.

use super::{breccia, said};

/// Stiff grains in a Saint-Venant–Kirchhoff solid, which a finite force compresses to zero volume: elements between the
/// grains are inverted for any step size.
const CASE: &str = r#"
[specimen]
radius_mm = 2.5
height_mm = 4.4
spacing_mm = 1.5
order = 1
grain_mode = "whole"
grains = { fraction = 0.2, seed = 1 }
[material.matrix]
law = "saint-venant-kirchhoff"
young_mpa = 275.0
poisson = 0.25
[material.grain]
young_mpa = 22000.0
poisson = 0.25
[test]
displacement_mm = 2.2
steps = 10
"#;

#[test]
fn a_run_that_diverges_leaves_curve_reason_and_last_state() {
    let dir = tempfile::tempdir().unwrap();
    let simulate = |case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &["simulate", "case.toml", "--out", "out"]));
        (code, err)
    };
    let read = |name: &str| std::fs::read_to_string(dir.path().join("out").join(name));
    let resumable = format!("{CASE}[output]\nfields_every = 1\ncheckpoint_every = 2\n");

    let (code, err) = simulate(&resumable);
    assert_eq!(code, Some(1), "{err}");
    let curve = read("curve.csv").unwrap();
    let steps = curve.lines().count() - 1;
    assert!((2..10).contains(&steps), "{curve}");
    let last: Vec<f64> =
        curve.lines().last().unwrap().split(',').map(|cell| cell.parse().unwrap()).collect();
    assert!((last[1] - 0.22 * steps as f64).abs() < 1e-9 && last[2] > 0.0, "{curve}");
    let reason = read("failure.txt").unwrap();
    for part in ["no equilibrium after", "inside out", "smaller steps"] {
        assert!(reason.contains(part) && err.contains(part), "{part:?}: {reason} {err}");
    }
    // the last equilibrium is at or after the last row of the curve, and before the next step
    let after = reason.split("after ").nth(1).and_then(|text| text.split(" mm").next()).unwrap();
    let after: f64 = after.parse().unwrap();
    assert!(after >= last[1] && after < last[1] + 0.22, "{after} after {}", last[1]);
    let state = read("fields/last.vtu").unwrap();
    assert!(state.contains("displacement_mm"), "the last state has its displacements");
    assert!(state != read(&format!("fields/step-{steps:05}.vtu")).unwrap(), "it is a later one");

    // the same command resumes from the saved state and fails again
    let (code, again) = simulate(&resumable);
    assert!(code == Some(1) && again.contains(&reason.trim().to_string()), "{again}");
    assert_eq!(read("curve.csv").unwrap(), curve);
    assert_eq!(read("fields/last.vtu").unwrap(), state);

    // a run of another case does not resume from this state, and does not remove the files of the
    // failed run
    let sound = CASE.replace("displacement_mm = 2.2", "displacement_mm = 0.2");
    let (code, err) = simulate(&sound);
    assert!(code == Some(1) && err.contains("state of another test: delete the file"), "{err}");
    assert!(read("failure.txt").unwrap() == reason && read("curve.csv").unwrap() == curve);

    // a completed run removes both of these files
    std::fs::remove_file(dir.path().join("out/simulate.state")).unwrap();
    let (code, err) = simulate(&sound);
    assert_eq!(code, Some(0), "{err}");
    assert!(read("failure.txt").is_err() && read("fields/last.vtu").is_err());
    assert_eq!(read("curve.csv").unwrap().lines().count(), 11);
}
