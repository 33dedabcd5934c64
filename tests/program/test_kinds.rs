//! `breccia check` accepts every kind of test of the page `docs/how-to/test-kinds.md`.

use super::{breccia, said};

const PAGE: &str = include_str!("../../docs/how-to/test-kinds.md");

const MATERIAL: &str = "\n[material.matrix]\nyoung_mpa = 1000.0\npoisson = 0.3\n";

/// Examples of a page that are cases: TOML blocks with a test.
fn examples(page: &str) -> Vec<String> {
    let blocks = page.split("```toml\n").skip(1).filter_map(|block| block.split("```").next());
    blocks
        .filter(|block| block.contains("[specimen]") && block.contains("[test]"))
        .map(str::to_owned)
        .collect()
}

/// A case with a specimen and a value of `test.kind`.
fn case(specimen: &str, kind: &str) -> String {
    format!(
        "[specimen]\n{specimen}spacing_mm = 1.0\n[test]\nkind = {kind}\ndisplacement_mm = 0.1\nsteps = 4\n"
    )
}

#[test]
fn check_accepts_every_kind_of_test() {
    let cylinder = "radius_mm = 2.5\nheight_mm = 5.0\n";
    let beam = "block_mm = [44.0, 5.0, 10.0]\nnotch = { depth_mm = 3.0, width_mm = 0.5 }\n";
    let mut cases = examples(PAGE);
    assert_eq!(cases.len(), 2, "the page shows a disc and a beam");
    cases.extend([
        case(cylinder, "\"tension-bar\""),
        case("block_mm = [4.0, 4.0, 8.0]\n", "\"tension-bar\""),
        case(cylinder, "{ confined-compression = { pressure_mpa = 0.5, confinement_s = 0.5 } }"),
        case(beam, "{ notched-beam = { span_mm = 40.0 } }"),
        // arcs that are narrower and wider than an element
        case("radius_mm = 10.0\nheight_mm = 3.0\n", "{ brazilian-disc = { contact_deg = 6.0 } }"),
        case("radius_mm = 10.0\nheight_mm = 3.0\n", "{ brazilian-disc = { contact_deg = 90.0 } }"),
    ]);
    let kinds = ["tension-bar", "brazilian-disc", "notched-beam", "confined-compression"];
    for kind in kinds {
        assert!(PAGE.contains(&format!("{kind}\"")) || PAGE.contains(&format!("{kind} =")));
        assert!(cases.iter().any(|case| case.contains(kind)), "{kind} has no case");
    }
    let dir = tempfile::tempdir().unwrap();
    for text in cases {
        std::fs::write(dir.path().join("case.toml"), format!("{text}{MATERIAL}")).unwrap();
        let (code, out, err) = said(&breccia(dir.path(), &["check", "case.toml"]));
        assert_eq!(code, Some(0), "{text}{out}{err}");
        assert!(out.contains("no mistakes"), "{text}{out}");
    }
}
