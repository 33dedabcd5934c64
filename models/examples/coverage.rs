//! How often do the 90 % intervals of the calibration cover the truth?
//!
//! ```text
//! breccia run                                                  # leaves breccia-out/surrogate.json
//! cargo run --release -p models --example coverage             # 40 experiments on it
//! cargo run --release -p models --example coverage -- results 100
//! ```
//! Arguments: the directory of a finished run, and the number of virtual experiments.

use std::path::PathBuf;

use models::{CaseFile, CoverageStudy};
use surrogate::DynPce;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let dir = PathBuf::from(arguments.next().unwrap_or_else(|| "breccia-out".into()));
    let repeats = arguments.next().map_or(Ok(40), |n| n.parse())?;
    let case = CaseFile::read(&dir.join("case.toml"))?.case;
    let pce = DynPce::read(dir.join("surrogate.json"))?;

    let mut study = CoverageStudy { repeats, ..CoverageStudy::default() };
    if let Some(specimens) = case.experiments.and_then(|e| e.virtual_specimens) {
        study.specimens = specimens.specimens;
        study.scatter = specimens.scatter;
    }
    let found = study.run(&pce, |done| {
        if done % 10 == 0 {
            eprintln!("{done} of {repeats} experiments");
        }
    })?;
    println!("{repeats} experiments; at least {:.3} is expected", found.least());
    for (i, input) in pce.inputs().iter().enumerate() {
        println!(
            "{:<26} covered {:.3}   mean contraction {:.3}",
            input.name, found.covered[i], found.contraction[i]
        );
    }
    Ok(())
}
