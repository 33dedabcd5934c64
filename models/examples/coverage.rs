//! How often do the 90 % intervals of the calibration cover the truth?
//!
//! ```text
//! breccia run                                                  # leaves breccia-out/surrogate.json
//! cargo run --release -p models --example coverage             # 40 laboratories on it
//! cargo run --release -p models --example coverage -- results 100
//! ```
//! Arguments: the directory of a finished run, and the number of virtual laboratories.

use std::path::PathBuf;

use models::{CaseFile, CoverageStudy, PriorCase};
use surrogate::Pce;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1);
    let dir = PathBuf::from(arguments.next().unwrap_or_else(|| "breccia-out".into()));
    let laboratories = arguments.next().map_or(Ok(40), |n| n.parse())?;
    let case = CaseFile::read(&dir.join("case.toml"))?.case;
    let prior = case.prior.ok_or("the case has no [prior]")?;
    let virtual_laboratory = case.experiments.and_then(|e| e.laboratory);
    let text = std::fs::read_to_string(dir.join("surrogate.json"))?;
    let pce: Pce<3, 3> = serde_json::from_str(&text)?;

    let mut study = CoverageStudy { laboratories, ..CoverageStudy::default() };
    if let Some(laboratory) = virtual_laboratory {
        study.specimens = laboratory.specimens;
        study.scatter = laboratory.scatter;
    }
    let found = study.run(&pce, &prior, |done| {
        if done % 10 == 0 {
            eprintln!("{done} of {laboratories} laboratories");
        }
    })?;
    println!("{laboratories} laboratories; at least {:.3} is expected", found.least());
    for (i, name) in PriorCase::NAMES.iter().enumerate() {
        println!(
            "{name:<20} covered {:.3}   mean contraction {:.3}",
            found.covered[i], found.contraction[i]
        );
    }
    Ok(())
}
