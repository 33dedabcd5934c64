//! Mistakes in cases of a program or of imported runs, and the single run that tries a program.

use super::super::breccia;
use super::{CASE, SOLVER, folder, work};

/// A script whose interpreter does not exist ends the stage at its first run, and no run counts as failed.
#[cfg(unix)]
#[test]
fn a_program_that_cannot_be_started_ends_the_stage() {
    use std::os::unix::fs::PermissionsExt;
    let case = CASE.replacen("\"sh\", ", "\"./broken\", ", 1);
    let dir = folder(&case, SOLVER);
    let program = dir.path().join("broken");
    std::fs::write(&program, "#!/no/such/interpreter\n").unwrap();
    std::fs::set_permissions(&program, std::fs::Permissions::from_mode(0o755)).unwrap();
    let arguments = ["run", "bar.toml", "--out", "results", "--threads", "1"];
    let (code, _, err) = breccia(dir.path(), &arguments);
    assert_ne!(code, Some(0), "{err}");
    for part in ["simulator.command = ", "broken", "cannot be started", "interpreter"] {
        assert!(err.contains(part), "{part}: {err}");
    }
    assert_eq!(work(dir.path()).len(), 1, "{err}");
    // the runs are computed once the program can be started
    std::fs::write(&program, "#!/bin/sh\nexec sh \"$@\"\n").unwrap();
    let (code, _, err) = breccia(dir.path(), &arguments);
    assert_eq!(code, Some(0), "{err}");
}

#[test]
fn mistakes_are_named_with_their_remedy() {
    let dir = folder(CASE, SOLVER);
    for (from, to, parts) in [
        ("k1 = {", "k2 = {", ["bar.txt: line 2 = {k1}", "Placeholders are: k2, run"]),
        (
            "{ unit = \"MPa\", prior = [1.0, 2.0] }",
            "{ prior = [1.0, 2.0] }\nk2 = { prior = [0.0, 1.0] }",
            ["parameters.k2: has no placeholder", "Write {k2} in simulator.input"],
        ),
        ("\"bar.txt\"", "\"car.txt\"", ["simulator.input = car.txt", "looks for it at"]),
        (
            "[\"sh\", ",
            "[\"./no-such-program\", ",
            ["simulator.command = ./no-such-program", "no such file"],
        ),
        (
            "\"sh\", \"solver.sh\"",
            "\"./solver.sh\"",
            ["simulator.command = ./solver.sh", "is not executable"],
        ),
        (
            "[parameters]",
            "[prior]\nmachine.force_offset_n = [0.0, 1.0]\n[parameters]",
            ["prior.machine.force_offset_n: is calibrated by built-in", "in [machine]"],
        ),
        (
            "[experiments]",
            "[machine]\nforce_offset_n = 2.0\n[experiments]",
            ["machine: corrects measured curves", "Correct the quantities"],
        ),
        (
            "\"solver.sh\"]\n[",
            "\"solver.sh\", \"bar.txt\"]\n[",
            ["simulator.files = bar.txt", "another name"],
        ),
        (
            "column:extension_mm",
            "colum:extension_mm",
            ["colum:extension_mm", "column:deflection_mm"],
        ),
        (
            "[simulator]",
            "[material.matrix]\nyoung_mpa = 1.0\n[simulator]",
            ["material: is of the built-in", "Keep one"],
        ),
        ("runs = 10", "import = \"measured.csv\"", ["simulator: makes new runs", "Keep one"]),
        ("[1.0, 2.0]", "[2.0, 1.0]", ["parameters.k1.prior", "not below the upper"]),
        ("k1 = {", "run = {", ["parameters.run", "Choose another name"]),
        (
            "\"measured.csv\"",
            "\"none.csv\"",
            ["experiments.values = none.csv", "there is no such file"],
        ),
    ] {
        assert!(CASE.contains(from), "{from}");
        std::fs::write(dir.path().join("bar.toml"), CASE.replacen(from, to, 1)).unwrap();
        let (code, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
        assert_ne!(code, Some(0), "{to}");
        let all = format!("{told}{err}");
        assert!(parts.iter().all(|part| all.contains(part)), "{parts:?}: {all}");
    }
    // a program that is not on this machine stops the ensemble before its first run
    let absent = CASE.replace("\"sh\"", "\"no-such-solver-7\"");
    std::fs::write(dir.path().join("bar.toml"), absent).unwrap();
    let (code, _, err) = breccia(dir.path(), &["run", "bar.toml", "--out", "results"]);
    assert_ne!(code, Some(0));
    assert!(err.contains("no-such-solver-7") && err.contains("PATH"), "{err}");
    // the built-in simulation has no parameters with free names
    let built_in = "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n[material.matrix]\nyoung_mpa = 275\n\
                    poisson = 0.25\n[test]\ndisplacement_mm = 0.2\n[parameters]\nk1 = { prior = [1.0, 2.0] }\n";
    std::fs::write(dir.path().join("bar.toml"), built_in).unwrap();
    let (_, told, err) = breccia(dir.path(), &["check", "bar.toml"]);
    assert!(
        format!("{told}{err}").contains("is not a parameter of the built-in simulation"),
        "{told}{err}"
    );
    // `breccia simulate` runs the program once, as a trial
    let bar = dir.path().join("bar.toml");
    std::fs::write(&bar, CASE).unwrap();
    let one = ["simulate", "bar.toml", "--out", "one"];
    let (code, out, err) = breccia(dir.path(), &one);
    assert_eq!(code, Some(0), "{err}");
    assert!(err.contains("k1 = 1.5") && err.contains("extension_mm = 4.5"), "{out}{err}");
    let result = dir.path().join(out.trim()).join("work/run-001/result.csv");
    assert!(result.is_file(), "{}", result.display());
    std::fs::write(&bar, CASE.replace("\"sh\"", "\"false\"")).unwrap();
    let (code, _, err) = breccia(dir.path(), &one);
    assert_ne!(code, Some(0));
    assert!(err.contains("the run failed: the program"), "{err}");
}
