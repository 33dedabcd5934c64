//! `simulate --device`: the device that solves the linear systems, and the messages about this device.

use super::{SMALL, breccia, said};

#[test]
fn the_host_in_the_place_of_a_card_gives_the_curve_of_the_processor() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), SMALL).unwrap();
    let forces = |device: &str| -> Option<Vec<f64>> {
        let arguments = ["simulate", "case.toml", "--out", device, "--device", device];
        let (code, _, err) = said(&breccia(dir.path(), &arguments));
        if err.contains("the C compiler") && code == Some(1) {
            println!("SKIPPED: {err}");
            return None;
        }
        assert_eq!(code, Some(0), "{err}");
        let machine = if device == "host" { "by this machine by" } else { "by the processor" };
        assert!(err.contains(&format!("linear systems were solved {machine}")), "{err}");
        let curve = std::fs::read_to_string(dir.path().join(device).join("curve.csv")).unwrap();
        let force = |line: &str| line.split(',').nth(2).unwrap().parse().unwrap();
        Some(curve.lines().skip(1).map(force).collect())
    };
    let here = forces("cpu").expect("it needs no compiler");
    assert_eq!((here.len(), forces("auto")), (4, Some(here.clone())));
    let Some(there) = forces("host") else { return };
    let highest = here.iter().copied().fold(0.0, f64::max);
    for (a, b) in here.iter().zip(&there) {
        assert!((a - b).abs() < 1e-6 * highest, "{here:?} {there:?}");
    }
}

#[test]
fn a_card_that_is_not_there_is_an_error_with_the_mend() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("case.toml"), SMALL).unwrap();
    let arguments = ["simulate", "case.toml", "--device", "cuda"];
    let (code, _, err) = said(&breccia(dir.path(), &arguments));
    // a program with the feature `cuda` may find a card
    if code != Some(0) {
        assert!(err.contains("--device") && err.contains("CUDA"), "{err}");
    }
}
