//! Loads date, version, machine and input files of the results, and the settings for the methods paragraph.

use std::collections::BTreeMap;
use std::path::Path;
use std::time::SystemTime;

use chrono::{DateTime, Utc};
use fem::Order;
use serde::Serialize;

use super::{left_out, rule_in_words};
use crate::case::Case;
use crate::pipeline::freshness::{Records, finished_in};
use crate::pipeline::inputs::Inputs;
use crate::report::{ChangedKey, DamageModel, InputFile, Methods, Provenance};

/// Stage whose products do not count as results.
const REPORT: &str = "report";

/// Loads date, version, machine and input files.
pub(super) fn provenance(inputs: &Inputs<'_>) -> Provenance {
    let mut records = finished_in(inputs.folder());
    // the report must not depend on whether an earlier report exists
    records.remove(REPORT);
    let threads = std::thread::available_parallelism().map_or(1, usize::from);
    let (system, architecture) = (std::env::consts::OS, std::env::consts::ARCH);
    Provenance {
        date: day(newest(&records, inputs.folder())),
        version: env!("CARGO_PKG_VERSION").to_owned(),
        machine: format!("{system}, {architecture}, {threads} hardware threads"),
        inputs: input_files(&records),
    }
}

/// Time at which the newest product was written; now if there is none.
fn newest(records: &Records, dir: &Path) -> SystemTime {
    let products = records.values().flat_map(|record| record.products());
    let written = |name: &str| dir.join(name).metadata().and_then(|data| data.modified()).ok();
    products.filter_map(written).max().unwrap_or_else(SystemTime::now)
}

/// Files that the stages have read and that no stage has written.
fn input_files(records: &Records) -> Vec<InputFile> {
    let mut files: BTreeMap<&str, &str> = BTreeMap::new();
    for (name, hash) in records.values().flat_map(|record| record.contents_read()) {
        if !records.values().any(|record| record.has_written(name)) {
            files.insert(name, hash);
        }
    }
    let file = |(name, hash): (&str, &str)| {
        let path = Path::new(name);
        let shown = if path.is_absolute() { path.file_name() } else { None };
        let name = shown.map_or_else(
            || name.to_owned(),
            |relative_path| relative_path.to_string_lossy().into_owned(),
        );
        InputFile { name, hash: hash.to_owned() }
    };
    files.into_iter().map(file).collect()
}

/// Returns the day of a time, UTC, as YYYY-MM-DD.
fn day(time: SystemTime) -> String {
    DateTime::<Utc>::from(time).format("%Y-%m-%d").to_string()
}

/// Keys of the case that differ from their defaults.
pub(super) fn changed_keys(case: &Case) -> Vec<ChangedKey> {
    let changed = crate::case::changed_keys(case).into_iter();
    changed
        .map(|(key, value, default)| ChangedKey {
            key,
            value: value.to_string(),
            default: default.map(|value| value.to_string()),
        })
        .collect()
}

/// Settings for the methods paragraph.
pub(super) fn methods(case: &Case) -> Methods {
    let sampler = &case.calibration;
    Methods {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        outside: outside(case),
        damage: case.phase_field.as_ref().map(|damage| DamageModel {
            model: word(&damage.model),
            split: word(&damage.split),
            irreversibility: word(&damage.irreversibility),
            length_mm: damage.length_mm,
        }),
        elements: match case.specimen.order {
            Order::Linear => "linear",
            Order::Quadratic => "quadratic",
        }
        .to_owned(),
        design: match case.design.import {
            Some(_) => String::new(),
            None => word(&case.design.method),
        },
        terms: word(&case.surrogate.terms),
        order_rule: rule_in_words(case.surrogate.rule),
        chains: sampler.chains,
        warmup: sampler.warmup,
        draws: sampler.draws,
        thinning: left_out(sampler),
        target_accept: sampler.target_accept,
        seed: sampler.seed,
    }
}

/// Sentence on the source of runs from outside this program; `None` for the built-in simulation.
fn outside(case: &Case) -> Option<String> {
    if case.design.import.is_some() {
        return Some("The simulations were made outside of Breccia and imported.".to_owned());
    }
    let (program, words) = case.simulator.as_ref()?.command.split_first()?;
    let name = Path::new(program).file_name().unwrap_or_default().display().to_string();
    let command = [&[name][..], words].concat().join(" ");
    Some(format!("Each specimen was simulated with the command {command}."))
}

/// Returns a setting in the words of the case file.
fn word(choice: &impl Serialize) -> String {
    let value = toml::Value::try_from(choice).ok();
    value.and_then(|value| Some(value.as_str()?.to_owned())).unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, UNIX_EPOCH};

    use super::*;
    use crate::case::CaseFile;

    #[test]
    fn days_are_those_of_the_calendar() {
        // days by `date -u -d @SECONDS +%F`
        for (seconds, expected) in [
            (0, "1970-01-01"),
            (951_782_399, "2000-02-28"),
            (951_782_400, "2000-02-29"),
            (951_868_800, "2000-03-01"),
            (1_735_689_599, "2024-12-31"),
            (1_735_689_600, "2025-01-01"),
            (4_107_542_400, "2100-03-01"),
        ] {
            assert_eq!(day(UNIX_EPOCH + Duration::from_secs(seconds)), expected, "{seconds}");
        }
    }

    #[test]
    fn the_methods_are_those_of_the_case() {
        let case = CaseFile::default_case().case;
        let methods = methods(&case);
        let damage = methods.damage.expect("the default case has damage");
        let field = case.phase_field.expect("the default case has damage");
        assert_eq!(damage.length_mm, field.length_mm);
        let words = [
            &damage.model,
            &damage.split,
            &damage.irreversibility,
            &methods.design,
            &methods.terms,
        ];
        for word in words {
            assert!(case_text().contains(&format!("\"{word}\"")), "{word}");
        }
        assert_eq!(
            (methods.chains, methods.draws),
            (case.calibration.chains, case.calibration.draws)
        );
    }

    fn case_text() -> String {
        CaseFile::default_case().case.to_toml()
    }
}
