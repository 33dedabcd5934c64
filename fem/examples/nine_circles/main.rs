//! The nine circles of elastic brittle fracture: nine problems that every model of fracture should solve, computed with AT1,
//! AT2 and the law with a strength of its own (Kamarei, Zeng, Dolbow & Lopez-Pamies, Comput. Methods Appl. Mech. Engrg. 448
//! (2026) 118449, doi:10.1016/j.cma.2025.118449).
//!
//! ```text
//! cargo run --release -p fem --example nine_circles -- [NAME ...]
//! ```
//!
//! A name is a problem (`uniaxial`, `biaxial`, `torsion`, `pure-shear`, `double-cantilever`, `trousers`, `edge-notch`,
//! `indentation`, `poker-chip`), or a problem and a law such as `torsion:at1` (laws: `at1`, `at2`, `strength`), or
//! `viscosity`: the J-integral of growing cracks for several viscosities. Without names, all problems run with all laws.
//! With the environment variable `PROGRESS`, most problems print every load step to the standard error output. Results are
//! printed as a Markdown table; the criteria are in `docs/explanation/nine-circles.md`.

mod circles;

use circles::{Law, PROBLEMS, Verdict, viscosity};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut names: Vec<String> = std::env::args().skip(1).collect();
    if names.iter().any(|name| name == "viscosity") {
        viscosity::print_table()?;
        names.retain(|name| name != "viscosity");
        if names.is_empty() {
            return Ok(());
        }
    }
    if names.is_empty() {
        names.extend(PROBLEMS.iter().map(|(name, _)| (*name).to_string()));
    }
    println!("{}", Verdict::HEADER);
    for name in names {
        let (problem, law) = match name.split_once(':') {
            Some((problem, law)) => (problem, Some(law)),
            None => (name.as_str(), None),
        };
        let (problem, run) = PROBLEMS
            .iter()
            .find(|(known, _)| *known == problem)
            .ok_or_else(|| format!("unknown problem '{problem}'"))?;
        let laws: Vec<Law> =
            Law::ALL.into_iter().filter(|l| law.is_none_or(|n| n == l.name())).collect();
        if laws.is_empty() {
            return Err(format!("unknown law in '{name}': use at1, at2 or strength").into());
        }
        for law in laws {
            println!("{}", run(law)?.row(problem, law));
        }
    }
    Ok(())
}
