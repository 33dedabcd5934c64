//! Specimens with scans: the stiffness of their own microstructures enters the calibration.

use super::{TINY, breccia, number, table};

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
    // as for the runs, which have the same grains, or a little more
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
    // it is known, and not calibrated
    assert_eq!(table(&results.join("map.csv")).len(), 3);
    assert!(
        table(&results.join("uncertainty.csv"))
            .iter()
            .all(|row| row["parameter"] != "stiffness_ratio")
    );
    let page = std::fs::read_to_string(results.join("report.html")).unwrap();
    assert!(page.contains("<th>stiffness ratio</th>"));

    // the same as measured specimens, of which one has no scan
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
    std::fs::write(dir.path().join("measured.toml"), case).unwrap();
    for (table_text, known) in [(written.clone(), 3), (written.replace("scans/V-02.tif", ""), 2)] {
        std::fs::write(measured.join("specimens.csv"), table_text).unwrap();
        let stage = |name| breccia(dir.path(), &[name, "measured.toml", "--out", "own"]);
        let (_, _, (code, _, err)) = (stage("segment"), stage("mesh"), stage("experiments"));
        assert_eq!(code, Some(0), "{err}");
        let rows = table(&dir.path().join("own/experiments.csv"));
        let found: Vec<&str> = rows.iter().map(|row| row["stiffness_ratio"].as_str()).collect();
        assert_eq!(found.iter().filter(|ratio| !ratio.is_empty()).count(), known);
        // a scan is a scan, wherever it lies
        assert_eq!(found[0].parse::<f64>().unwrap(), specimens[0]);
    }
    // what its grains do is taken from the packings of the runs and from the others
    let (code, _, err) = breccia(dir.path(), &["run", "measured.toml", "--out", "own"]);
    assert_eq!(code, Some(0), "{err}");
    let own = dir.path().join("own");
    let told =
        "1 of 3 specimens have no image: the stiffness ratio of their grains is taken from 14 ";
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
