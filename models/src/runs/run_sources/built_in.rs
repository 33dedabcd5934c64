//! The built-in source: tests that this program simulates with finite elements.

use std::borrow::Cow;

use fem::RunRecord;

use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::runs::ensemble_runs::run_named;
use crate::runs::microstructures::Microstructures;
use crate::runs::run_source::{RequestedRuns, RunSource};
use crate::simulation::simulator::Simulator;
use crate::specimen::images;

/// The simulated tests of a case.
struct BuiltIn;

/// Opens the source, which is used in every case without another source.
pub(super) fn open(_: &Inputs<'_>) -> Result<Option<Box<dyn RunSource>>, WorkflowError> {
    Ok(Some(Box::new(BuiltIn)))
}

impl RunSource for BuiltIn {
    fn specimens(
        &self,
        inputs: &Inputs<'_>,
        runs: usize,
    ) -> Result<Option<Microstructures>, WorkflowError> {
        Microstructures::of(inputs, runs)
    }

    fn meshes(&self) -> usize {
        1
    }

    fn records(&self, requested: &RequestedRuns<'_>) -> Result<Vec<RunRecord>, WorkflowError> {
        let RequestedRuns { task, level, specimens, named } = requested;
        let Some(level) = level else {
            return Err(WorkflowError::Unusable("simulated runs need a mesh level".to_owned()));
        };
        if let Some(specimens) = specimens {
            if let Some(packings) = specimens.packing_of_each() {
                let parameters = task.inputs.parameters()?;
                return run_named(task, *named, &|run| {
                    packings.simulator(run.id - 1, level, &parameters).map(Cow::Owned)
                });
            }
            let simulators = specimens.shared_simulators(&task.inputs, level, named.runs)?;
            return run_named(task, *named, &|run| {
                Ok(Cow::Borrowed(&simulators[&specimens.of_run(run.id)]))
            });
        }
        let mesh = level.mesh(&task.inputs, images::FIRST)?;
        let simulator = Simulator::new(&level.setup, mesh, task.inputs.parameters()?)?;
        if let Some(run) = named.runs.first() {
            simulator.check(&level.setup, &run.inputs)?;
        }
        run_named(task, *named, &|_| Ok(Cow::Borrowed(&simulator)))
    }
}
