//! ArviZ opens the posteriors of `ppl` without conversion, and the summaries of ArviZ and `ppl` agree.
//!
//! The test needs Python with ArviZ 1 or later: `python3`, or the interpreter that BRECCIA_PYTHON names. Otherwise the
//! test prints that it was skipped.

use std::env;
use std::fs;
use std::io::Write;
use std::path::Path;
use std::process::Command;

use ppl::prelude::*;

ppl::model! {
    /// Pairs with a common mean and a common scale. The data do not depend on the second scale.
    fn pairs(y: &[[f64; 2]]) {
        let mu ~ Normal(0.0, 5.0);
        let sd ~ Uniform(0.1, 3.0).array::<2>();
        for y in y {
            y ~ Normal(mu, sd[0]).array::<2>();
        }
    }
}

fn python() -> Option<String> {
    let interpreter = env::var("BRECCIA_PYTHON").unwrap_or_else(|_| "python3".into());
    let probe = "import arviz, zarr; assert int(arviz.__version__.split('.')[0]) >= 1";
    let found = Command::new(&interpreter).args(["-c", probe]).output();
    found.is_ok_and(|output| output.status.success()).then_some(interpreter)
}

#[test]
fn arviz_opens_a_posterior_and_agrees_with_the_summary() {
    let Some(python) = python() else {
        // written to standard error directly, because the test harness hides the output of a passing test
        let note = "SKIPPED: no Python with ArviZ 1 (set BRECCIA_PYTHON to one that has it)";
        writeln!(std::io::stderr(), "{note}").expect("stderr is open");
        return;
    };
    let sampler = Nuts::default().chains(4).warmup(400).draws(501).seed(7);
    let mut posterior =
        sampler.sample(&pairs(&[[0.3, 0.9], [1.6, -0.2], [0.8, 1.1]])).expect("runs");
    posterior.label("sd", 0, &["slope", "peak force"]).expect("two entries");

    let folder = tempfile::tempdir().expect("a folder");
    let store = folder.path().join("posterior.zarr");
    let table = folder.path().join("summary.csv");
    posterior.write_zarr(&store).expect("written");
    posterior.summary().write_csv(&table).expect("written");

    let scaling = posterior.power_scaling().expect("prior and likelihood are finite");
    let sensitivity = folder.path().join("sensitivity.csv");
    let rows = scaling.rows.iter().map(|r| format!("{},{},{}\n", r.name, r.prior, r.likelihood));
    let rows = std::iter::once("parameter,prior,likelihood\n".to_owned()).chain(rows);
    fs::write(&sensitivity, rows.collect::<String>()).expect("written");

    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("python/arviz_roundtrip.py");
    let output = Command::new(python)
        .arg(script)
        .args([store, table, sensitivity])
        .output()
        .expect("starts");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{errors}");
}
