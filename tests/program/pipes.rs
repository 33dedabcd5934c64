//! Pipes and devices instead of input files, and a standard output to which the program cannot
//! write.
#![cfg(unix)]

use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::{Duration, Instant};

use super::{SMALL, breccia, said};

/// Runs the program; the test fails if the program waits for a pipe.
fn in_time(folder: &Path, arguments: &[&str]) -> (Option<i32>, String) {
    let mut child = Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(arguments)
        .current_dir(folder)
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let deadline = Instant::now() + Duration::from_secs(120);
    while child.try_wait().unwrap().is_none() {
        if Instant::now() > deadline {
            child.kill().unwrap();
            panic!("{arguments:?} waits for a pipe");
        }
        std::thread::sleep(Duration::from_millis(5));
    }
    let output = child.wait_with_output().unwrap();
    (output.status.code(), String::from_utf8_lossy(&output.stderr).into_owned())
}

fn pipe(path: &Path) {
    if path.exists() {
        std::fs::remove_file(path).unwrap();
    }
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

#[test]
fn a_pipe_in_the_place_of_any_input_is_refused_by_its_name() {
    for (file, command) in [
        ("curves/S-02.csv", "experiments"),
        ("specimens.csv", "run"),
        ("case.toml", "run"),
        ("case.toml", "simulate"),
    ] {
        let dir = tempfile::tempdir().unwrap();
        assert_eq!(said(&breccia(dir.path(), &["init", "--own-data", "mine"])).0, Some(0));
        pipe(&dir.path().join("mine").join(file));
        let (code, err) = in_time(dir.path(), &[command, "mine/case.toml", "--out", "out"]);
        let name = file.rsplit('/').next().unwrap();
        assert!(code == Some(1) && err.contains(name) && err.contains("pipe"), "{file}: {err}");
    }

    let rest =
        "[material.matrix]\nyoung_mpa = 275\npoisson = 0.25\n[test]\ndisplacement_mm = 0.2\n";
    let grain = "[material.grain]\nyoung_mpa = 22000\npoisson = 0.25\n";
    let image = format!(
        "[specimen]\nspacing_mm = 0.7\n[specimen.image]\nstack = \"input\"\nvoxel_mm = 0.1\n{grain}{rest}"
    );
    let mesh = format!(
        "[specimen]\nmesh = \"input\"\nregions = {{ matrix = 1 }}\nsurfaces = {{ bottom = 2, top = 3 }}\n{rest}"
    );
    for (case, command) in [(&image, "segment"), (&mesh, "mesh"), (&mesh, "simulate")] {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("my.toml"), case).unwrap();
        pipe(&dir.path().join("input"));
        let (code, err) = in_time(dir.path(), &[command, "my.toml", "--out", "out"]);
        assert!(
            code == Some(1) && err.contains("input") && err.contains("pipe"),
            "{command}: {err}"
        );
    }
    // a pipe among the slices of a folder
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("my.toml"), &image).unwrap();
    std::fs::create_dir(dir.path().join("input")).unwrap();
    pipe(&dir.path().join("input/001.tif"));
    let (code, err) = in_time(dir.path(), &["segment", "my.toml", "--out", "out"]);
    assert!(code == Some(1) && err.contains("001.tif") && err.contains("pipe"), "{err}");

    let study = "title = \"t\"\nbase = \"base.toml\"\n[[case]]\nname = \"a\"\n";
    for file in ["my-study.toml", "base.toml"] {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("my-study.toml"), study).unwrap();
        std::fs::write(dir.path().join("base.toml"), SMALL).unwrap();
        pipe(&dir.path().join(file));
        let (code, err) = in_time(dir.path(), &["study", "my-study.toml", "--out", "out"]);
        assert!(code == Some(1) && err.contains(file) && err.contains("pipe"), "{err}");
    }
}

#[test]
fn a_pipe_in_the_place_of_a_product_is_refused_by_its_name() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("my.toml"), SMALL).unwrap();
    let mesh = ["mesh", "my.toml", "--out", "out"];
    assert_eq!(in_time(dir.path(), &mesh).0, Some(0));
    for name in ["mesh.csv", "report.html", "curve.csv", "case.toml", "stages.toml", "written.csv"]
    {
        let path = dir.path().join("out").join(name);
        let whole = std::fs::read(&path).ok();
        pipe(&path);
        let command = match name {
            "curve.csv" => "simulate",
            "report.html" => "report",
            _ => "mesh",
        };
        let (code, err) = in_time(dir.path(), &[command, "my.toml", "--out", "out"]);
        assert!(code == Some(1) && err.contains(name), "{name}: {err}");
        assert!(in_time(dir.path(), &["status", "out"]).0.is_some());
        std::fs::remove_file(&path).unwrap();
        whole.iter().for_each(|content| std::fs::write(&path, content).unwrap());
    }
}

/// Runs the program by the shell, which redirects its standard output.
fn redirected(folder: &Path, command: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_breccia");
    Command::new("bash")
        .args(["-c", &format!("set -o pipefail; '{program}' {command}")])
        .current_dir(folder)
        .stdin(Stdio::null())
        .output()
        .unwrap()
}

#[cfg(target_os = "linux")]
#[test]
fn standard_output_that_is_full_is_an_error_and_a_closed_one_is_none() {
    let dir = tempfile::tempdir().unwrap();
    std::fs::write(dir.path().join("my.toml"), SMALL).unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["mesh", "my.toml", "--out", "out"]));
    assert_eq!(code, Some(0), "{err}");
    let commands = [
        ("init full.toml", "init closed.toml", 0),
        ("init --own-data full", "init --own-data closed", 0),
        ("simulate my.toml --out full", "simulate my.toml --out closed", 0),
        ("status out", "status out", 3),
        ("--help", "--help", 0),
        ("mesh --help", "mesh --help", 0),
        ("--version", "--version", 0),
    ];
    for (full, closed, code) in commands {
        let (found, _, err) = said(&redirected(dir.path(), &format!("{full} > /dev/full")));
        assert_eq!(found, Some(1), "{full}: {err}");
        assert!(err.contains("error: standard output cannot be written"), "{full}: {err}");
        assert!(!err.contains("panicked"), "{full}: {err}");
        // `true` ends without reading, so that the program finds the pipe closed when it writes
        let (found, _, err) = said(&redirected(dir.path(), &format!("{closed} > >(true)")));
        assert_eq!(found, Some(code), "{closed}: {err}");
        assert!(!err.contains("panicked") && !err.contains("error"), "{closed}: {err}");
    }
    // the results were written nevertheless
    for file in ["full.toml", "full/case.toml", "full/curve.csv", "closed/curve.csv"] {
        let path = dir.path().join(file);
        assert!(path.is_file(), "{file}");
    }
}
