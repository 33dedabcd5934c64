//! Files of the results that the user edits are detected, named and never lost.

use super::{breccia, said};

/// Any file of a killed run that was edited before the next run is refused by name.
#[test]
fn an_edited_file_of_a_killed_simulation_is_refused() {
    let dir = tempfile::tempdir().unwrap();
    let case = super::SMALL.replace("steps = 4", "steps = 4000");
    let case = format!("{case}[output]\nfields_every = 1\ncheckpoint_every = 1\n");
    std::fs::write(dir.path().join("my.toml"), case).unwrap();
    let out = dir.path().join("out");
    let simulate = ["simulate", "my.toml", "--out", "out"];
    let mut child = std::process::Command::new(env!("CARGO_BIN_EXE_breccia"))
        .args(simulate)
        .current_dir(dir.path())
        .stdout(std::process::Stdio::null())
        .stderr(std::process::Stdio::null())
        .spawn()
        .unwrap();
    let files = ["curve.csv", "effort.csv", "fields.pvd", "simulate.state"];
    let start = std::time::Instant::now();
    while !files.iter().all(|name| out.join(name).is_file()) {
        assert!(start.elapsed().as_secs() < 300, "no first step");
        std::thread::sleep(std::time::Duration::from_millis(20));
    }
    child.kill().unwrap();
    child.wait().unwrap();
    for name in files {
        let path = out.join(name);
        let before = std::fs::read(&path).unwrap();
        let edited = [&before[..], b"of a person\n"].concat();
        std::fs::write(&path, &edited).unwrap();
        let (code, _, err) = said(&breccia(dir.path(), &simulate));
        assert!(code == Some(1) && err.contains(name), "{name}: {err}");
        assert!(std::fs::read(&path).unwrap() == edited, "{name} was replaced");
        std::fs::write(&path, before).unwrap();
    }
}

/// The report names edited files, and names none if no file was edited.
#[test]
fn the_report_names_edited_files_that_were_used() {
    let dir = tempfile::tempdir().unwrap();
    let (code, _, err) = said(&breccia(dir.path(), &["init", "--own-data", "mine"]));
    assert_eq!(code, Some(0), "{err}");
    let run = |command: &str| {
        let (code, _, err) =
            said(&breccia(dir.path(), &[command, "mine/case.toml", "--out", "out"]));
        assert_eq!(code, Some(0), "{command}: {err}");
    };
    let page = || std::fs::read_to_string(dir.path().join("out/report.html")).unwrap();
    run("mesh");
    run("report");
    assert!(!page().contains("was edited"));
    for (name, line) in [("mesh.msh", "\n"), ("experiments/curves/S-02.csv", "# mine\n")] {
        let path = dir.path().join("out").join(name);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text + line).unwrap();
        run("report");
        assert!(page().contains(&format!("{name} was edited")), "{name}");
    }
}
