//! Tests that run the compiler: its messages for mistakes in models, and randomly written models. They link the `ppl`
//! that this test was built with, so that `ppl` is not compiled again.

mod first_crate;
mod random_models;
mod ui;

use std::path::PathBuf;
use std::process::Command;
use std::time::SystemTime;

fn rustc() -> Command {
    Command::new(std::env::var_os("RUSTC").unwrap_or_else(|| "rustc".into()))
}

/// The compiler with the newest `ppl` in the folder of compiled dependencies, which was built for this test.
fn rustc_with_ppl() -> Command {
    let folder = std::env::current_exe().unwrap().parent().unwrap().to_owned();
    let is_ppl = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        name.starts_with("libppl-") && name.ends_with(".rlib")
    };
    let age = |path: &PathBuf| -> SystemTime { path.metadata().unwrap().modified().unwrap() };
    let files = std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().path());
    let newest = files.filter(is_ppl).max_by_key(age).expect("this test is linked with it");
    let mut rustc = rustc();
    rustc.args(["--edition=2024", "--extern"]);
    rustc.arg(format!("ppl={}", newest.display()));
    rustc.arg("-L").arg(format!("dependency={}", folder.display()));
    rustc
}
