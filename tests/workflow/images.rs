//! Specimens with scans: the stiffness of the microstructure of each specimen is used in the
//! calibration.

use std::sync::OnceLock;

use super::{TINY, breccia, copy, number, table};

#[test]
fn the_stiffness_of_scanned_specimens_is_an_input_of_the_surrogate() {
    let dir = tempfile::tempdir().unwrap();
    let case = TINY
        .replace("spacing_mm = 1.25\n", "scans = true\n")
        .replace("spacing_mm = 1.5", "spacing_mm = 1.4")
        .replace("fraction = 0.05", "fraction = 0.12");
    std::fs::write(dir.path().join("tiny.toml"), &case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "tiny.toml", "--out", "results"]);
    assert_eq!(code, Some(0), "{err}");
    let results = dir.path().join("results");
    // the ratios of runs with the same grains are equal or slightly larger
    let ratios = |file: &str| -> Vec<f64> {
        table(&results.join(file)).iter().map(|row| number(row, "stiffness_ratio")).collect()
    };
    let (runs, specimens) = (ratios("runs.csv"), ratios("experiments.csv"));
    assert_eq!((runs.len(), specimens.len()), (12, 3));
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    assert!(
        runs.iter().chain(&specimens).all(|&k| (1.05..1.6).contains(&k)),
        "{runs:?} {specimens:?}"
    );
    assert!((mean(&runs) / mean(&specimens) - 1.0).abs() < 0.05, "{runs:?} {specimens:?}");
    let surrogate = std::fs::read_to_string(results.join("surrogate.json")).unwrap();
    assert!(surrogate.contains("\"stiffness_ratio\""), "{surrogate}");
    // the stiffness ratio is known, and not a calibrated parameter
    assert_eq!(table(&results.join("map.csv")).len(), 3);
    assert!(
        table(&results.join("uncertainty.csv"))
            .iter()
            .all(|row| row["parameter"] != "stiffness_ratio")
    );
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("<th>stiffness ratio</th>"));

    // the same specimens as a measured table, in which one specimen has no scan
    let scans = results.join("experiments/scans");
    let written = std::fs::read_to_string(results.join("experiments/specimens.csv")).unwrap();
    assert!(written.starts_with("id,height_mm,radius_mm,group,image\n"), "{written}");
    assert!(scans.join("V-01.tif").is_file());
    let measured = dir.path().join("measured");
    let copy = |from: &str| {
        let to = measured.join(from);
        std::fs::create_dir_all(&to).unwrap();
        for file in std::fs::read_dir(results.join("experiments").join(from)).unwrap() {
            let file = file.unwrap();
            std::fs::copy(file.path(), to.join(file.file_name())).unwrap();
        }
    };
    ["curves", "scans"].into_iter().for_each(copy);
    let start = case.find("[experiments.virtual]").unwrap();
    let end = case.find("[calibration]").unwrap();
    let case = format!(
        "{}[experiments]\ntable = \"measured/specimens.csv\"\n{}",
        &case[..start],
        &case[end..]
    );
    let case = case.replace("runs = 12", "runs = 8");
    std::fs::write(dir.path().join("measured.toml"), case).unwrap();
    for (table_text, known) in [(written.clone(), 3), (written.replace("scans/V-02.tif", ""), 2)] {
        std::fs::write(measured.join("specimens.csv"), table_text).unwrap();
        let stage = |name| breccia(dir.path(), &[name, "measured.toml", "--out", "own"]);
        let (_, _, (code, _, err)) = (stage("segment"), stage("mesh"), stage("experiments"));
        assert_eq!(code, Some(0), "{err}");
        let rows = table(&dir.path().join("own/experiments.csv"));
        let found: Vec<&str> = rows.iter().map(|row| row["stiffness_ratio"].as_str()).collect();
        assert_eq!(found.iter().filter(|ratio| !ratio.is_empty()).count(), known);
        // the ratio does not depend on the folder of the scan
        assert_eq!(found[0].parse::<f64>().unwrap(), specimens[0]);
    }
    // the population of ratios is estimated from the packings of the runs and from the other specimens
    let (code, _, err) = breccia(dir.path(), &["run", "measured.toml", "--out", "own"]);
    assert_eq!(code, Some(0), "{err}");
    let own = dir.path().join("own");
    let told =
        "1 of 3 specimens have no image: the stiffness ratio of their grains is estimated from 10 ";
    assert!(err.contains(told), "{err}");
    let page = std::fs::read_to_string(own.join("report.html")).unwrap();
    assert!(page.contains(told) && page.contains("<th>stiffness ratio</th>"));
    let budget = table(&own.join("uncertainty.csv"));
    let geometry: Vec<f64> = budget
        .iter()
        .filter(|row| row["source"] == "geometry")
        .map(|row| number(row, "share"))
        .collect();
    assert!(geometry.len() == 3 && geometry.iter().all(|share| (0.0..1.0).contains(share)));
    let of_young = budget.iter().filter(|row| row["parameter"] == "matrix.young_mpa");
    let sum: f64 = of_young.map(|row| number(row, "share")).sum();
    assert!((sum - 1.0).abs() < 1e-9, "{budget:?}");

    std::fs::write(measured.join("specimens.csv"), written.replace("V-03.tif", "V-04.tif"))
        .unwrap();
    let (code, _, err) = breccia(dir.path(), &["experiments", "measured.toml", "--out", "own"]);
    assert_ne!(code, Some(0));
    assert!(err.contains("V-04.tif") && err.contains("specimens.csv"), "{err}");
}

/// Writes a case of virtual specimens with scans. Returns a case that uses these scans as images, and the curves of the
/// specimens as measured curves.
fn with_images_of_virtual_specimens(dir: &std::path::Path, further: &str) -> String {
    let case = TINY
        .replace("spacing_mm = 1.25\n", "scans = true\n")
        .replace("spacing_mm = 1.5", "spacing_mm = 1.4")
        .replace("fraction = 0.05", "fraction = 0.12")
        .replace("specimens = 3", "specimens = 4");
    static ONCE: OnceLock<tempfile::TempDir> = OnceLock::new();
    let made = ONCE.get_or_init(|| {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("virtual.toml"), &case).unwrap();
        for stage in ["segment", "mesh", "experiments"] {
            let (code, _, err) = breccia(dir.path(), &[stage, "virtual.toml", "--out", "virtual"]);
            assert_eq!(code, Some(0), "{err}");
        }
        dir
    });
    copy(made.path(), dir);
    let cut = |from: &str, to: &str, text: &str, by: &str| {
        let (start, end) = (text.find(from).unwrap(), text.find(to).unwrap());
        format!("{}{by}{}", &text[..start], &text[end..])
    };
    let image = format!(
        "[specimen.image]\nstack = \"virtual/experiments/scans/V-01.tif\"\nfurther_stacks = [{further}]\n"
    );
    let case = cut("grains = {", "[material.matrix]", &case, &image);
    let case = case.replace("radius_mm = 2.5\nheight_mm = 4.4\n", "");
    let table = "[experiments]\ntable = \"virtual/experiments/specimens.csv\"\n";
    cut("[experiments.virtual]", "[calibration]", &case, table)
}

fn scans(numbers: &[usize]) -> String {
    let name = |n: &usize| format!("\"virtual/experiments/scans/V-0{n}.tif\"");
    numbers.iter().map(name).collect::<Vec<_>>().join(", ")
}

#[test]
fn runs_are_spread_over_the_images_of_several_specimens() {
    let dir = tempfile::tempdir().unwrap();
    let case = with_images_of_virtual_specimens(dir.path(), &scans(&[2, 3, 4]));
    let case = case.replace(
        "[design]\nruns = 12",
        "[fidelity]\nlevels = [{ spacing_mm = 1.4, repeats = 4 }]\n[design]\nruns = 12",
    );
    let case = case.replacen("spacing_mm = 1.4", "spacing_mm = 1.0", 1);
    std::fs::write(dir.path().join("case.toml"), &case).unwrap();
    let run = || breccia(dir.path(), &["run", "case.toml", "--out", "out"]);
    let (code, _, err) = run();
    assert_eq!(code, Some(0), "{err}");
    let out = dir.path().join("out");
    for name in ["images/2-labels.tif", "images/4-segment.csv", "meshes/3.msh", "meshes/2.csv"] {
        assert!(out.join(name).is_file(), "{name}");
    }
    // each image has three runs, which have its stiffness ratio, and one repeat on the better mesh
    let runs = table(&out.join("runs.csv"));
    let of = |image: usize| {
        runs.iter().filter(move |row| row["image"] == image.to_string()).collect::<Vec<_>>()
    };
    let mut ratios = Vec::new();
    for image in 1..=4 {
        let rows = of(image);
        assert_eq!(rows.len(), 3, "{runs:?}");
        assert!(rows.iter().all(|row| row["stiffness_ratio"] == rows[0]["stiffness_ratio"]));
        ratios.push(number(rows[0], "stiffness_ratio"));
    }
    ratios.sort_by(f64::total_cmp);
    assert!(ratios.windows(2).all(|pair| pair[0] < pair[1]), "{ratios:?}");
    let better = table(&out.join("fidelity_runs.csv"));
    let image_of = |run: &str| runs.iter().find(|row| row["run"] == run).unwrap()["image"].clone();
    let better = better.iter().filter(|row| row["level"] == "2");
    let mut better: Vec<String> = better.map(|row| image_of(&row["run"])).collect();
    better.sort();
    assert_eq!(better, ["1", "2", "3", "4"]);
    // the ratios equal the ratios of the specimens, because the images are scans of the specimens
    for (row, image) in table(&out.join("experiments.csv")).iter().zip(1..) {
        assert_eq!(row["stiffness_ratio"], of(image)[0]["stiffness_ratio"]);
    }
    // with four images the ratio is an input with a linear effect, and two degrees of freedom remain
    let surrogate = std::fs::read_to_string(out.join("surrogate.json")).unwrap();
    assert!(surrogate.contains("\"stiffness_ratio\""), "{surrogate}");
    let specimens = std::fs::read_to_string(out.join("surrogate_specimens.json")).unwrap();
    let specimens: serde_json::Value = serde_json::from_str(&specimens).unwrap();
    assert_eq!(specimens["groups"], 4);
    assert_eq!(specimens["between"]["freedom"], 2.0);
    let budget = table(&out.join("uncertainty.csv"));
    let geometry = budget.iter().filter(|row| row["source"] == "geometry");
    let geometry: Vec<f64> = geometry.map(|row| number(row, "share")).collect();
    assert!(geometry.len() == 3 && geometry.iter().all(|share| *share > 0.0), "{budget:?}");
    let warning =
        "The runs are on 4 images only, so that the scatter between specimens is poorly known";
    let page = std::fs::read_to_string(out.join("report.html")).unwrap();
    assert!(err.contains(warning) && page.contains(warning), "{err}");
    assert!((2..=4).all(|image| page.contains(&format!("image {image}, V-0{image}.tif"))));

    // no product is made again, and `status` does not need the images
    let (code, _, err) = run();
    assert!(code == Some(0) && !err.contains("again"), "{err}");
    let (code, text, _) = breccia(dir.path(), &["status", "out"]);
    assert!(code == Some(0) && text.contains("16 of 16"), "{text}");
    // if the content of an image file changes, its labels, its mesh and the runs are made again
    let scans = dir.path().join("virtual/experiments/scans");
    std::fs::copy(scans.join("V-02.tif"), scans.join("V-04.tif")).unwrap();
    let (code, _, err) = breccia(dir.path(), &["mesh", "case.toml", "--out", "out"]);
    assert!(code == Some(1) && err.contains("V-04.tif has changed"), "{err}");
    for stage in ["segment", "mesh"] {
        let (code, _, err) = breccia(dir.path(), &[stage, "case.toml", "--out", "out"]);
        assert_eq!(code, Some(0), "{err}");
    }
    let bytes = |name: &str| std::fs::read(out.join(name)).unwrap();
    assert_eq!(bytes("meshes/2.msh"), bytes("meshes/4.msh"));
    let (_, text, _) = breccia(dir.path(), &["status", "out"]);
    assert!(text.contains("0 of 16"), "{text}");
}

#[test]
fn images_of_several_specimens_are_refused_with_what_helps() {
    let dir = tempfile::tempdir().unwrap();
    let with = |further: &str| with_images_of_virtual_specimens(dir.path(), further);
    let segment = |case: &str| {
        std::fs::write(dir.path().join("case.toml"), case).unwrap();
        let (code, _, err) = breccia(dir.path(), &["segment", "case.toml", "--out", "out"]);
        (code, err)
    };
    let case = with(&scans(&[2]));
    for (further, parts) in [
        (scans(&[2, 7]), ["V-07.tif: there is no such file", "The program looks for it at"]),
        (scans(&[2, 3, 2]), ["V-02.tif: is named twice", "Name each image once"]),
        (scans(&[1]), ["V-01.tif: is named twice", "Name each image once"]),
        (String::new(), ["specimen.image.further_stacks", "names no image"]),
    ] {
        let (code, err) = segment(&case.replace(&scans(&[2]), &further));
        assert_eq!(code, Some(1), "{err}");
        assert!(parts.iter().all(|part| err.contains(part)), "{parts:?} in {err}");
        assert!(err.contains("specimen.image.further_stacks"), "{err}");
    }
    // an image that cannot be read, and an image of a specimen of another size, are refused with the name of the file
    let other = dir.path().join("virtual/experiments/scans/V-02.tif");
    let good = std::fs::read(&other).unwrap();
    std::fs::write(&other, b"II*\0 a photograph").unwrap();
    let (code, err) = segment(&case);
    assert!(code == Some(1) && err.contains("V-02.tif"), "{err}");
    let small = fem::tiff::read_labels(&other, None);
    assert!(small.is_err());
    std::fs::write(&other, &good).unwrap();
    let mut scan = fem::tiff::read_labels(&other, None).unwrap();
    scan.voxel_mm *= 0.8;
    fem::tiff::write_labels(&other, &scan).unwrap();
    let (code, err) = segment(&case);
    assert_eq!(code, Some(1), "{err}");
    for part in ["V-02.tif", "shows a specimen of", "Give specimen.radius_mm"] {
        assert!(err.contains(part), "{part} in {err}");
    }
    // with microstructure = "one" the further images are not used
    let (code, err) = segment(&case.replace("[design]", "[design]\nmicrostructure = \"one\""));
    assert_eq!(code, Some(0), "{err}");
    assert!(!dir.path().join("out/images").exists());
}

#[test]
fn runs_share_fewer_packings() {
    let dir = tempfile::tempdir().unwrap();
    let case = TINY.replace("runs = 12", "runs = 12\npackings = 3");
    std::fs::write(dir.path().join("case.toml"), &case).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "case.toml", "--out", "out"]);
    assert_eq!(code, Some(0), "{err}");
    let out = dir.path().join("out");
    let runs = table(&out.join("runs.csv"));
    let mut seeds: Vec<&str> = runs.iter().map(|row| row["packing_seed"].as_str()).collect();
    seeds.sort_unstable();
    assert!(seeds.chunks(4).all(|four| four.iter().all(|seed| *seed == four[0])), "{seeds:?}");
    seeds.dedup();
    assert_eq!(seeds.len(), 3);
    assert!(out.join("surrogate_specimens.json").is_file());
    assert!(err.contains("The runs are on 3 packings"), "{err}");
    // one image does not show the scatter between specimens, and a warning reports this
    let scans =
        with_images_of_virtual_specimens(dir.path(), "").replace("further_stacks = []\n", "");
    std::fs::write(dir.path().join("one.toml"), scans).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "one.toml", "--out", "one"]);
    assert_eq!(code, Some(0), "{err}");
    let warning =
        "All runs are on one image, so that the scatter between microstructures is unknown";
    let page = std::fs::read_to_string(dir.path().join("one/report.html")).unwrap();
    assert!(err.contains(warning) && page.contains(warning), "{err}");
    assert!(!dir.path().join("one/surrogate_specimens.json").exists());
}
