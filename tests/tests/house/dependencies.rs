//! Checks the dependency tree: all licences are permissive, and each package whose types occur in public signatures has
//! only one version.

use std::process::Command;

use serde_json::Value;

fn packages() -> Vec<Value> {
    // only the packages of this platform are checked, because others may be absent on this machine
    let rustc = Command::new("rustc").arg("-vV").output().expect("rustc runs");
    let version = String::from_utf8_lossy(&rustc.stdout).into_owned();
    let host = version.lines().find_map(|line| line.strip_prefix("host: ")).expect("a host");
    let output = Command::new(env!("CARGO"))
        .args(["metadata", "--format-version", "1", "--locked", "--filter-platform", host])
        .current_dir(env!("CARGO_MANIFEST_DIR"))
        .output()
        .expect("cargo runs");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let metadata: Value = serde_json::from_slice(&output.stdout).expect("cargo metadata is JSON");
    metadata["packages"].as_array().expect("packages").clone()
}

#[test]
fn one_version_of_what_stands_in_signatures() {
    let packages = packages();
    for name in ["nalgebra", "faer", "rand", "statrs"] {
        let versions: Vec<_> =
            packages.iter().filter(|p| p["name"] == name).map(|p| &p["version"]).collect();
        assert_eq!(versions.len(), 1, "{name} is in the tree as {versions:?}");
    }
}

#[test]
fn licences_are_permissive() {
    // a licence expression with alternatives is accepted if one alternative is permissive
    let permissive =
        ["MIT", "Apache-2.0", "BSD-2-Clause", "BSD-3-Clause", "ISC", "Zlib", "Unlicense", "0BSD"];
    for package in packages() {
        let licence = package["license"].as_str().unwrap_or_default().replace('/', " OR ");
        let allowed = licence
            .split(" OR ")
            .map(|alternative| alternative.trim().trim_matches(['(', ')']))
            .any(|alternative| permissive.contains(&alternative));
        let both = licence == "(MIT OR Apache-2.0) AND Unicode-3.0";
        assert!(allowed || both, "{} has the licence {licence:?}", package["name"]);
    }
}
