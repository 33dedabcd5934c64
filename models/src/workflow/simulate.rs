//! One simulation with the case's own parameters.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};

use fem::{CurvePoint, Fields, write_curve};

use super::WorkflowError;
use super::simulation::{Simulator, build_mesh, failure, share_done};
use crate::case::CaseFile;
use crate::progress::Bar;

/// Runs the case's compression test and writes `curve.csv` to `dir`.
///
/// # Errors
/// A mesh or a test that cannot be set up. A run that fails on its way is an error too, after its
/// curve so far is written.
pub fn simulate(
    file: &CaseFile,
    dir: &Path,
    interrupt: &AtomicBool,
) -> Result<PathBuf, WorkflowError> {
    std::fs::create_dir_all(dir).map_err(|e| WorkflowError::results(dir, &e))?;
    let simulator = Simulator::new(file, build_mesh(file)?)?;
    let bar = Bar::new("simulate");
    let outcome = simulator.run_case(&mut |point: &CurvePoint, _: &Fields| {
        let state = format!("{:.4} mm, {:.2} N", point.displacement_mm, point.force_n);
        bar.set(share_done(point, &file.case), &state);
        if interrupt.load(Ordering::Relaxed) {
            ControlFlow::Break(())
        } else {
            ControlFlow::Continue(())
        }
    });
    drop(bar);
    let path = dir.join("curve.csv");
    write_curve(&path, &outcome.curve)?;
    match failure(&outcome.end) {
        Some(error) => Err(error.into()),
        None if interrupt.load(Ordering::Relaxed) => Err(WorkflowError::Interrupted),
        None => Ok(path),
    }
}
