//! Stage `experiments`: quantities of interest of measured or virtual specimens.

use std::borrow::Cow;

use fem::{RunInput, RunRecord, RunStatus, gmsh};
use rayon::prelude::*;

use crate::case::{ByParameter, Parameter, QoiComparison};
use crate::experiment::{Specimen, SpecimenTable, TestCurve};
use crate::experiments::measured_values::write_measured;
use crate::experiments::mesh_scale::{MeshScale, MeshSize};
use crate::experiments::specimen_checks::checked;
use crate::experiments::specimen_quantities::{cell, compared};
use crate::experiments::{experiment_inputs, virtual_inputs};
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::qoi::Qois;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;
use crate::runs::ensemble_runs::{NamedRuns, run_named};
use crate::simulation::recorded::recorded_run;
use crate::simulation::simulator::Simulator;
use crate::simulation::stiffness::STIFFNESS_RATIO;
use crate::specimen::specimen_images::{scan, stiffness_ratios};
use crate::specimen::virtual_bodies::VirtualBodies;
use crate::virtual_specimen::VirtualSpecimen;

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    if let Some(values) = experiment_inputs::measured_values(inputs) {
        return write_measured(task, &values);
    }
    let table = match experiment_inputs::are_specimens_virtual(inputs)? {
        true => test_virtual_specimens(task)?,
        false => experiment_inputs::specimen_table(inputs)?,
    };
    let mesh = match inputs.is_built_in() {
        true => {
            let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
            Some(MeshSize::of(&mesh).measured_by(inputs.conditions().as_ref()))
        }
        false => None,
    };
    let comparison = Comparison { mesh, qoi: inputs.qoi() };
    let table = checked(task, experiment_inputs::chosen(inputs, table)?, mesh)?;
    let specimens = table.specimens.iter();
    let mut rows: Vec<Vec<String>> = specimens.map(|specimen| comparison.row(specimen)).collect();
    let ratios = stiffness_ratios(task, &table)?;
    for (row, ratio) in rows.iter_mut().zip(&ratios) {
        row.push(ratio.map(|ratio| ratio.to_string()).unwrap_or_default());
    }
    let [displacement, force] = MeshScale::COLUMNS;
    let header = ["id", "group", "height_mm", "radius_mm", displacement, force, "slope_fraction"];
    let columns: Vec<_> =
        comparison.qoi.quantities.iter().map(|quantity| quantity.column()).collect();
    let columns = columns.iter().map(AsRef::as_ref);
    let header = header.into_iter().chain(columns).chain([STIFFNESS_RATIO]);
    task.write_csv("experiments.csv", header, rows)?;
    Ok(format!("{} specimens", table.specimens.len()))
}

/// Size of the mesh, if there is one, and the quantities that are compared between specimens and simulations.
struct Comparison<'a> {
    mesh: Option<MeshSize>,
    qoi: &'a QoiComparison,
}

impl Comparison<'_> {
    /// Returns the row of a specimen in `experiments.csv`, with quantities scaled to the size of the mesh. A quantity that
    /// the curve cannot give has an empty cell.
    fn row(&self, specimen: &Specimen) -> Vec<String> {
        let Specimen { id, group, height_mm, radius_mm, .. } = specimen;
        let scale = MeshScale::of(specimen, self.mesh);
        let fraction = specimen.slope_fraction.unwrap_or(self.qoi.slope_fraction);
        let values = compared(specimen, self.mesh, self.qoi, &self.qoi.quantities).values;
        [id.clone(), group.clone()]
            .into_iter()
            .chain(
                [*height_mm, *radius_mm, scale.displacement, scale.force, fraction]
                    .map(|x| x.to_string()),
            )
            .chain(values.into_iter().map(cell))
            .collect()
    }
}

/// Simulates the virtual specimens, and writes their curves in the format of measured specimens.
fn test_virtual_specimens(task: &Task<'_>) -> Result<SpecimenTable, WorkflowError> {
    let inputs = &task.inputs;
    inputs.check_steps()?;
    let geometry = inputs.geometry()?;
    let bodies = VirtualBodies::of(inputs, &geometry)?;
    let (setup, truth) = (inputs.setup(), virtual_inputs::truth(inputs)?);
    let spacing_mm = bodies.spacing_mm();
    let spacing = virtual_inputs::spacing_mm(inputs)?.or(spacing_mm);
    let grains = bodies.grains();
    let specimens = VirtualSpecimen::draw(
        *virtual_inputs::specimens(inputs)?,
        *virtual_inputs::seed(inputs)?,
        truth,
        virtual_inputs::scatter(inputs)?,
        grains.map(|g| g.seed),
    );
    let parameters: Vec<Parameter> = truth.parameters().cloned().collect();
    let simulator = |seed: Option<u64>, spacing: Option<f64>| {
        let mesh = bodies.mesh(setup.path, seed, spacing)?;
        Simulator::new(&setup, mesh, parameters.clone())
    };
    let mut tests: Vec<(Simulator, Vec<f64>)> = specimens
        .par_iter()
        .map(|v| Ok((simulator(Some(v.packing_seed), spacing)?, v.parameters.clone())))
        .collect::<Result<_, WorkflowError>>()?;
    if spacing != spacing_mm {
        // simulate the packing of the case with the true parameters on both meshes, to determine the bias of the
        // coarse mesh
        let truth: Vec<f64> = truth.iter().map(|(_, &value)| value).collect();
        for spacing in [spacing_mm, spacing] {
            tests.push((simulator(None, spacing)?, truth.clone()));
        }
    }
    let runs: Vec<RunInput> = (1..)
        .zip(&tests)
        .map(|(id, (_, parameters))| RunInput { id, inputs: parameters.clone() })
        .collect();
    let names: Vec<String> = truth.names().collect();
    let named = NamedRuns {
        folder: "experiments/runs",
        label: "virtual specimens",
        key: &RunKey::of_simulations(inputs, &["experiments.virtual"], &[]).and_specimen(inputs)?,
        names: &names,
        runs: &runs,
        wait: true,
    };
    let records = run_named(task, named, &|run| Ok(Cow::Borrowed(&tests[run.id - 1].0)))?;
    for (record, name) in
        records.iter().zip(specimens.iter().map(|v| v.id.as_str()).chain(["bias", "bias"]))
    {
        if let RunStatus::Failed(reason) = &record.status {
            return Err(WorkflowError::Unusable(format!(
                "the virtual specimen {name} failed: {reason}; take another seed, fewer grains or more load steps"
            )));
        }
    }
    if let ([coarse, fine], Some(spacing_mm), Some(spacing)) =
        (&records[specimens.len()..], spacing_mm, spacing)
    {
        write_bias(task, [spacing_mm, spacing], [coarse, fine])?;
    }
    let [radius_mm, height_mm] = bodies.size_mm();
    if *virtual_inputs::scans(inputs)? {
        scan(task, &specimens, grains, [radius_mm, height_mm])?;
    }
    write_specimens(task, truth, &specimens, &records, [height_mm, radius_mm])
}

fn write_specimens(
    task: &Task<'_>,
    truth: &ByParameter<f64>,
    specimens: &[VirtualSpecimen],
    records: &[RunRecord],
    [height_mm, radius_mm]: [f64; 2],
) -> Result<SpecimenTable, WorkflowError> {
    let (group, noise) =
        (virtual_inputs::group(&task.inputs)?, virtual_inputs::noise(&task.inputs)?);
    let scanned = *virtual_inputs::scans(&task.inputs)?;
    let machine = experiment_inputs::known_machine(&task.inputs).machine();
    let quantities = &task.inputs.qoi().quantities;
    let needs_time =
        task.inputs.test().program.is_some() || quantities.iter().any(|q| q.needs_time());
    let timed = |curve: TestCurve| match needs_time {
        true => curve,
        false => TestCurve { time_s: Vec::new(), ..curve },
    };
    let image = |id: &str| scanned.then(|| format!("scans/{id}.tif").into());
    let measured = specimens.iter().zip(records).map(|(v, record)| Specimen {
        id: v.id.clone(),
        height_mm,
        radius_mm,
        group: group.clone(),
        slope_fraction: None,
        image: image(&v.id),
        test: None,
        rate_mm_per_s: None,
        curve: timed(v.measure(&machine.record(&recorded_run(record)), noise)),
    });
    let table = SpecimenTable { specimens: measured.collect() };
    let files = table.to_files().map_err(|e| WorkflowError::io(&task.path(SPECIMENS), e))?;
    for (path, text) in files {
        task.write(&format!("experiments/{}", path.display()), text)?;
    }
    let rows = specimens.iter().map(|v| {
        let values = v.parameters.iter().map(f64::to_string);
        [v.id.clone(), v.packing_seed.to_string()].into_iter().chain(values).collect::<Vec<_>>()
    });
    let header = ["id".to_owned(), "packing_seed".to_owned()].into_iter().chain(truth.names());
    task.write_csv("experiments/truth.csv", header, rows)?;
    Ok(table)
}

/// Writes the quantities of one microstructure on the mesh of the surrogate's runs and on the mesh of the virtual
/// specimens.
fn write_bias(
    task: &Task<'_>,
    spacing_mm: [f64; 2],
    runs: [&RunRecord; 2],
) -> Result<(), WorkflowError> {
    let qoi = task.inputs.qoi();
    let qois = |record: &RunRecord| {
        Qois::values_of(&recorded_run(record), qoi.slope_fraction, &qoi.quantities)
            .map_err(|e| WorkflowError::Unusable(format!("the comparison of the two meshes: {e}")))
    };
    let (coarse, fine) = (qois(runs[0])?, qois(runs[1])?);
    let row = |name: &str, a: f64, b: f64| {
        [name.to_owned(), a.to_string(), b.to_string(), (100.0 * (a / b - 1.0)).to_string()]
    };
    let mut rows = vec![row("spacing_mm", spacing_mm[0], spacing_mm[1])];
    let both = coarse.into_iter().zip(fine);
    rows.extend(qoi.quantities.iter().zip(both).map(|(q, (a, b))| row(&q.column(), a, b)));
    let header = ["quantity", "surrogate_mesh", "experiments_mesh", "percent_bias"];
    task.write_csv("experiments/bias.csv", header, rows)
}
