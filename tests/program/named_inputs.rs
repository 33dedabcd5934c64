//! Files that a case names in any key are inputs: no command replaces them, also not with `--replace`.

use super::{SMALL, breccia, said};

const IMAGE: &str = "[specimen]\nspacing_mm = 0.7\n[specimen.image]\nstack = \"own.tif\"\nvoxel_mm = 0.1\n\
    region.mask = \"scan.tif\"\n[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[material.grain]\n\
    young_mpa = 22000\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";

#[test]
fn tables_and_a_mask_are_not_replaced() {
    let rows = "plastic_strain,yield_mpa\n0,5\n0.1,6\n";
    let plastic = "plastic = { yield_mpa = 5.0, hardening = { table = \"curve.csv\" } }";
    let named = format!("[material.matrix]\n{plastic}\n");
    let plain = SMALL.replace("[material.matrix]\n", &named);
    let times = "time_s,factor\n0,0\n1,1\n";
    let conditions = "[conditions]\nprescribe = [{ surface = \"bottom\", x_mm = 0.0, y_mm = 0.0, z_mm = 0.0 }, \
        { surface = \"top\", z_mm = -0.1 }]\ntable = \"curve.csv\"\n\
        measure = { surface = \"top\", direction = [0.0, 0.0, -1.0] }\n";
    let loaded = format!(
        "{}\n{conditions}",
        IMAGE
            .split("[specimen.image]")
            .next()
            .unwrap()
            .replace("spacing_mm = 0.7", "spacing_mm = 1.5\nradius_mm = 2.5\nheight_mm = 4.4",)
    ) + "[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\nduration_s = 1.0\nsteps = 2\n";
    let segment = &["segment", "mesh", "run", "simulate"][..];
    for (case, file, text, key, commands) in [
        (plain.as_str(), "curve.csv", rows, "matrix.plastic.hardening.table", &["simulate"][..]),
        (loaded.as_str(), "curve.csv", times, "conditions.table", &["simulate"][..]),
        (IMAGE, "scan.tif", "of the user", "specimen.image.region.mask", segment),
    ] {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join(file), text).unwrap();
        std::fs::write(dir.path().join("own.tif"), text).unwrap();
        std::fs::write(dir.path().join("my.toml"), case).unwrap();
        for command in commands {
            for extra in [&[][..], &["--replace", file]] {
                let command = [&[*command, "my.toml", "--out", "."], extra].concat();
                let (code, _, err) = said(&breccia(dir.path(), &command));
                assert_eq!(code, Some(1), "{command:?}: {err}");
                for part in ["my.toml", key, file, "is in the results folder", "--out"] {
                    assert!(err.contains(part), "{command:?}: {part:?} is not in {err:?}");
                }
            }
        }
        assert_eq!(std::fs::read_to_string(dir.path().join(file)).unwrap(), text);
    }
}
