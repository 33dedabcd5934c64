//! `breccia check` prints the inputs of a run, its cost and every mistake. The command computes nothing and writes
//! nothing.

use std::path::{Path, PathBuf};

use super::{breccia, said};

/// All files below a folder with their contents.
fn files(folder: &Path) -> Vec<(PathBuf, Vec<u8>)> {
    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        match path.is_dir() {
            true => found.extend(files(&path)),
            false => found.push((path.clone(), std::fs::read(&path).unwrap())),
        }
    }
    found.sort();
    found
}

fn own_data() -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["init", "--own-data", "mine"]));
    assert_eq!(code, Some(0), "{err}");
    dir
}

fn edit(path: &Path, from: &str, to: &str) {
    let text = std::fs::read_to_string(path).unwrap();
    assert!(text.contains(from), "{}: {from:?}", path.display());
    std::fs::write(path, text.replacen(from, to, 1)).unwrap();
}

#[test]
fn a_right_case_is_described_with_its_cost_and_nothing_is_written() {
    let dir = own_data();
    let before = files(dir.path());
    let (code, out, err) = said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    assert_eq!(code, Some(0), "{out}{err}");
    for part in [
        "radius 2.5 mm and height 4.4 mm, 20.0 % of grains",
        "5 readable in mine/specimens.csv",
        "displacement_mm,force_N without conversion",
        "peak_force_N: mean 1",
        "matrix.young_mpa: uniform between 220 and 340 MPa",
        "24 runs of the design",
        "5 of them repeated on the next mesh",
        "3 to confirm the posterior",
        "33 simulations, about ",
        "estimated from",
        "no mistakes",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    assert!(files(dir.path()) == before, "files have changed");
    // the stage `mesh` of the same case accepts the same input
    let (code, _, err) = said(&breccia(dir.path(), &["mesh", "mine/case.toml", "--out", "out"]));
    assert_eq!(code, Some(0), "{err}");
}

#[test]
fn every_mistake_of_every_file_is_named_at_once() {
    let dir = own_data();
    let mine = dir.path().join("mine");
    // mistakes in the case: a misspelt key, a value outside its range, a prior with exchanged bounds
    edit(&mine.join("case.toml"), "max_order = 3", "max_ordr = 3");
    edit(&mine.join("case.toml"), "runs = 24", "runs = 1");
    edit(&mine.join("case.toml"), "[220.0, 340.0]", "[340.0, 220.0]");
    // mistake in the table: a size that is not a number
    edit(&mine.join("specimens.csv"), "S-01,4.4", "S-01,four");
    // mistakes in curves: no file, a cell that is not a number in a file with CRLF line endings, forces in kN
    std::fs::remove_file(mine.join("curves/S-02.csv")).unwrap();
    let curve = mine.join("curves/S-03.csv");
    let text = std::fs::read_to_string(&curve).unwrap().replace('\n', "\r\n");
    let line = text.lines().position(|line| line.starts_with("0.05")).unwrap();
    let cell = text.lines().nth(line).unwrap().to_owned();
    std::fs::write(&curve, text.replacen(&cell, "0.05,n/a", 1)).unwrap();
    let curve = mine.join("curves/S-04.csv");
    let text = std::fs::read_to_string(&curve).unwrap();
    let in_kn = |line: &str| match line.split_once(',') {
        Some((u, force)) if force.parse::<f64>().is_ok() => {
            format!("{u},{}\n", 0.001 * force.parse::<f64>().unwrap())
        }
        _ => format!("{line}\n"),
    };
    std::fs::write(&curve, text.lines().map(in_kn).collect::<String>()).unwrap();

    let before = files(dir.path());
    let (code, out, err) = said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    assert_eq!(code, Some(1), "{out}{err}");
    let expected = [
        "surrogate.max_ordr = 3: unknown key \"max_ordr\".".to_owned(),
        " | max_ordr = 3\n".to_owned(),
        "help: Did you mean \"max_order\"?".to_owned(),
        "design.runs = 1: must lie between 4".to_owned(),
        "prior.matrix.young_mpa = [340.0, 220.0]".to_owned(),
        "mine/specimens.csv: line ".to_owned(),
        "column height_mm = four".to_owned(),
        "mine/curves/S-02.csv: cannot be read".to_owned(),
        format!("mine/curves/S-03.csv: line {}, column force_N = n/a", line + 1),
        "mine/curves/S-04.csv: peak_force_N = 0.1".to_owned(),
        "7 mistakes".to_owned(),
    ];
    for part in expected {
        assert!(err.contains(&part), "{part:?} is not in {err}");
    }
    assert_eq!(err.matches("error: ").count(), 7, "{err}");
    assert!(files(dir.path()) == before, "files have changed");
}

#[test]
fn images_are_checked_by_their_headers_and_meshes_by_their_files() {
    let dir = own_data();
    let mine = dir.path().join("mine");
    let whole = fem::Volume { shape: [40, 40, 50], voxel_mm: 0.1, values: vec![7_u32; 80_000] };
    fem::tiff::write_labels(&mine.join("scan.tif"), &whole).unwrap();
    let image = "spacing_mm = 1.2\n[specimen.image]\nstack = \"scan.tif\"\nvoxel_mm = 0.1\n#";
    // a case with a mesh file cannot have `[fidelity]`
    let text = std::fs::read_to_string(mine.join("case.toml")).unwrap();
    let (levels, rest) = (text.find("[fidelity]").unwrap(), text.find("[surrogate]").unwrap());
    let text = format!("{}{}", &text[..levels], &text[rest..]);
    let (start, end) =
        (text.find("radius_mm = ").unwrap(), text.find("[material.matrix]").unwrap());
    let case = |specimen: &str| format!("{}{specimen}\n{}", &text[..start], &text[end..]);
    std::fs::write(mine.join("case.toml"), case(image)).unwrap();
    let (code, out, err) = said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(
        out.contains(
            "40 × 40 × 50 voxels of 0.100000 mm (voxel_mm as given), 4.000 × 4.000 × 5.000 mm"
        ),
        "{out}"
    );
    assert!(out.contains("once it has been segmented"), "{out}");

    // the mask is read, too: one value for each voxel of the image
    let key = "voxel_mm = 0.1\nregion.mask = \"mask.tif\"";
    std::fs::write(mine.join("case.toml"), case(&image.replace("voxel_mm = 0.1", key))).unwrap();
    let check = || said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    let mask = |shape: [usize; 3]| {
        let values = vec![1_u32; shape.iter().product()];
        let volume = fem::Volume { shape, voxel_mm: 0.1, values };
        fem::tiff::write_labels(&mine.join("mask.tif"), &volume).unwrap();
    };
    mask([40, 40, 50]);
    let (code, out, err) = check();
    assert!(code == Some(0) && out.contains("mask.tif: "), "{out}{err}");
    mask([40, 40, 49]);
    let (code, _, err) = check();
    assert!(code == Some(1) && err.contains("40 × 40 × 49 voxels, but the image has"), "{err}");
    std::fs::write(mine.join("mask.tif"), "no image").unwrap();
    let (code, _, err) = check();
    assert!(code == Some(1) && err.contains("mask.tif"), "{err}");
    std::fs::remove_file(mine.join("mask.tif")).unwrap();
    #[cfg(unix)]
    {
        let pipe = std::process::Command::new("mkfifo").arg(mine.join("mask.tif")).status();
        assert!(pipe.unwrap().success());
        let (code, _, err) = check();
        assert!(code == Some(1) && err.contains("mask.tif") && err.contains("pipe"), "{err}");
    }
    std::fs::write(mine.join("case.toml"), case(image)).unwrap();

    let bytes = std::fs::read(mine.join("scan.tif")).unwrap();
    std::fs::write(mine.join("scan.tif"), &bytes[..bytes.len() / 3]).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    assert!(code == Some(1) && err.contains("scan.tif"), "{err}");

    let cylinder = fem::CylinderLattice { radius_mm: 2.0, height_mm: 4.4, spacing_mm: 1.0 };
    fem::gmsh::write(mine.join("cylinder.msh"), &cylinder.build().unwrap()).unwrap();
    let mesh = "mesh = \"cylinder.msh\"\nregions = { matrix = \"matrix\" }\n\
                surfaces = { bottom = \"bottom\", top = \"top\" }";
    std::fs::write(mine.join("case.toml"), case(mesh)).unwrap();
    let (code, out, err) = said(&breccia(dir.path(), &["check", "mine/case.toml"]));
    assert_eq!(code, Some(0), "{out}{err}");
    assert!(out.contains("height 4.4000 mm, radius 2.0000 mm"), "{out}");
    // equal stress: forces are scaled by (2 / 2.5)²
    let scaled =
        "warning  S-01 has a radius of 2.5 mm, the mesh 2.0000 mm: its forces are scaled by 0.6400";
    assert!(out.contains(scaled), "{out}");
}

/// Lines that apply to all cases of the study are printed once, and nothing is written.
#[test]
fn all_cases_of_a_study_are_checked_at_once() {
    let dir = own_data();
    let study = dir.path().join("study.toml");
    let text = r#"
title = "Two materials"
base = "mine/case.toml"
[[case]]
name = "stiff"
set.prior.matrix.young_mpa = [300.0, 340.0]
[[case]]
name = "soft"
set.prior.matrix.young_mpa = [220.0, 300.0]
"#;
    std::fs::write(&study, text).unwrap();
    let before = files(dir.path());
    let (code, out, err) = said(&breccia(dir.path(), &["check", "study.toml"]));
    assert_eq!(code, Some(0), "{out}{err}");
    for part in [
        "study  Two materials: 2 cases",
        "5 readable in",
        "at most 66 simulations, about ",
        "no mistakes",
    ] {
        assert_eq!(out.matches(part).count(), 1, "{part:?} once in {out}");
    }
    let (_, parts) = out.split_once("\nstiff\n").unwrap();
    let (stiff, soft) = parts.split_once("\nsoft\n").unwrap();
    assert!(stiff.contains("uniform between 300 and 340 MPa"), "{out}");
    assert!(soft.contains("uniform between 220 and 300 MPa"), "{out}");

    // mistakes in the base, in each of two cases, and in a file that both cases name
    edit(&dir.path().join("mine/case.toml"), "max_order = 3", "max_ordr = 3");
    edit(&study, "[300.0, 340.0]", "[340.0, 300.0]");
    std::fs::write(
        &study,
        std::fs::read_to_string(&study).unwrap()
            + "set.design.runs = 1\nwithout = [\"nothing\"]\nlaboratory = \"elsewhere\"\n",
    )
    .unwrap();
    std::fs::remove_file(dir.path().join("mine/curves/S-02.csv")).unwrap();
    let before_mistakes = files(dir.path());
    let (code, out, err) = said(&breccia(dir.path(), &["check", "study.toml"]));
    assert_eq!(code, Some(1), "{out}{err}");
    for part in [
        "error: mine/case.toml:",
        "surrogate.max_ordr = 3",
        "error: stiff: study.toml: prior.matrix.young_mpa = [340.0, 300.0]",
        "error: soft: study.toml: design.runs = 1",
        "error: soft: study.toml: without = nothing",
        "error: soft: study.toml: there is no laboratory \"elsewhere\"",
        "curves/S-02.csv: cannot be read",
        "6 mistakes",
    ] {
        assert_eq!(err.matches(part).count(), 1, "{part:?} once in {err}");
    }
    assert!(files(dir.path()) == before_mistakes, "files have changed");
    assert!(before.len() == before_mistakes.len() + 1);
}

/// Laboratories are checked. Cases of a laboratory are checked without its specimens, which do not exist yet. Variants
/// are checked separately.
#[test]
fn laboratories_and_variants_of_a_study_are_checked() {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["init", "base.toml"]));
    assert_eq!(code, Some(0), "{err}");
    let text = r#"
title = "Grains"
base = "base.toml"
[[laboratory]]
name = "50C"
set.experiments.virtual.specimens = 3
[[case]]
name = "few"
laboratory = "50C"
[[variant]]
name = "coarse"
title = "Coarse"
set.specimen.spacing_mm = 9.0
"#;
    std::fs::write(dir.path().join("study.toml"), text).unwrap();
    let (code, out, err) = said(&breccia(dir.path(), &["check", "study.toml"]));
    for part in [
        "study  Grains: 1 case, 1 laboratory, 1 variant of all of them",
        "\nlaboratories/50C\n",
        "3 virtual specimens, simulated first",
        "\nfew\n",
        "those of the laboratory 50C",
        "\ncoarse/few\n",
    ] {
        assert!(out.contains(part), "{part:?} is not in {out}");
    }
    assert_eq!(code, Some(1), "{out}{err}");
    assert!(err.contains("error: coarse/few: study.toml: specimen.spacing_mm = 9"), "{err}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 2);
}

#[test]
fn a_missing_case_and_a_study_are_named() {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["check", "gone.toml"]));
    assert!(code == Some(1) && err.contains("gone.toml") && err.contains("breccia init"), "{err}");
    let study = "title = \"Two\"\nbase = \"case.toml\"\n[[case]]\nname = \"a\"\n";
    std::fs::write(dir.path().join("study.toml"), study).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["run", "study.toml"]));
    assert_eq!(code, Some(1), "{err}");
    assert!(err.contains("is a study") && err.contains("breccia study study.toml"), "{err}");
    assert!(!err.contains("phase_field"), "{err}");
    let (code, out, err) = said(&breccia(dir.path(), &["check", "study.toml"]));
    assert!(code == Some(1) && err.contains("case.toml: cannot be read"), "{out}{err}");
    assert!(err.contains("1 mistake\n"), "{err}");
}
