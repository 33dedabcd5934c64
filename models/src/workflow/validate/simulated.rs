//! Mesh, held-out specimens and runs of one entry of `[[validation]]`.

use fem::{RunInput, RunRecord, write_curve};

use super::super::inputs::Inputs;
use super::super::levels::Level;
use super::super::measured_values::read_measured;
use super::super::microstructures::Microstructures;
use super::super::posterior_draws::Draw;
use super::super::run_source::RequestedRuns;
use super::super::run_sources::source_of;
use super::super::runs::NamedRuns;
use super::super::simulator::quantities;
use super::super::task::Task;
use super::super::validation_folders::folder_of;
use super::super::{WorkflowError, experiments, mesh, segment};
use crate::case::{CaseFile, ValidationCase};
use crate::error::InputError;
use crate::qoi::Quantity;
use crate::table::CsvTable;

/// Subfolder with the records of the runs, in the folder of the validation.
const FOLDER: &str = "runs";

/// Measured and simulated quantities of an entry.
pub(super) struct Simulated {
    pub(super) quantities: Vec<Quantity>,
    pub(super) columns: Vec<String>,
    /// Names of the specimens.
    pub(super) specimens: Vec<String>,
    /// Measured quantities of each specimen.
    pub(super) measured: Vec<Vec<f64>>,
    /// Quantities of each usable run.
    pub(super) runs: Vec<Vec<f64>>,
    /// Place of the draw of each usable run.
    pub(super) usable: Vec<usize>,
    /// Whether the runs have different microstructures.
    pub(super) has_microstructures: bool,
}

type StageFunction = fn(&Task<'_>) -> Result<String, WorkflowError>;

/// Stages that prepare the specimen and the held-out specimens.
const PREPARATION: [(&str, StageFunction); 3] =
    [("segment", segment::run), ("mesh", mesh::run), ("experiments", experiments::run)];

impl Simulated {
    /// Prepares the folder of the entry and simulates its test at the draws. Finished runs are reused.
    pub(super) fn of(
        task: &Task<'_>,
        entry: &ValidationCase,
        names: &[String],
        draws: &[&Draw],
    ) -> Result<Self, WorkflowError> {
        let folder = folder_of(&entry.name);
        let dir = task.path(&folder);
        let file = CaseFile::read(&dir.join("case.toml"))?;
        let inputs = || task.inputs.of_folder(&file, &dir).of_held_out();
        for (stage, run) in PREPARATION {
            let own = task.in_folder(stage, inputs(), &dir);
            run(&own)?;
            task.adopt_warnings(&own, &format!("Validation {}: ", entry.name));
            task.inputs.reads_in_folder(&own.inputs, &folder);
        }
        let own = task.in_folder(task.stage(), inputs(), &dir);
        refuse_calibrated(task, &own.inputs)?;
        let (records, has_microstructures) = runs_at(&own, names, draws)?;
        let qoi = own.inputs.qoi();
        let columns: Vec<String> =
            qoi.quantities.iter().map(|q| q.column().into_owned()).collect();
        let (mut runs, mut usable, mut failed) = (Vec::new(), Vec::new(), Vec::new());
        for (k, record) in records.iter().enumerate() {
            if !record.curve.is_empty() {
                let name = format!("{folder}/curves/draw-{}.csv", k + 1);
                task.product(&name, |path| write_curve(path, &record.curve))?;
            }
            match quantities(record, qoi) {
                Ok(values) => {
                    runs.push(values);
                    usable.push(k);
                }
                Err(reason) => failed.push(format!("draw {}: {reason}", k + 1)),
            }
        }
        if let Some(first) = failed.first() {
            task.warn(&format!(
                "The prediction of the validation {} omits {} of {} draws, whose simulations have no quantities. {first}.",
                entry.name,
                failed.len(),
                records.len()
            ));
        }
        if runs.len() < 2 {
            let first = failed.first().map_or("", String::as_str);
            let text = format!("{} of {} simulations are usable; {first}", runs.len(), records.len());
            return Err(WorkflowError::Unusable(text));
        }
        let (specimens, measured) = measured(&own.inputs, &columns)?;
        let quantities = qoi.quantities.clone();
        task.inputs.reads_in_folder(&own.inputs, &folder);
        Ok(Self { quantities, columns, specimens, measured, runs, usable, has_microstructures })
    }
}

/// Runs the test of the entry at the draws. Returns the records, and whether the runs have different microstructures.
fn runs_at(
    own: &Task<'_>,
    names: &[String],
    draws: &[&Draw],
) -> Result<(Vec<RunRecord>, bool), WorkflowError> {
    let inputs = &own.inputs;
    // the runs depend on the geometry even if no mesh file is read: reading it adds it to the identity of the runs
    inputs.geometry()?;
    let parameters: Vec<String> = inputs.parameters()?.iter().map(ToString::to_string).collect();
    let source = source_of(inputs)?;
    let specimens = source.specimens(inputs, draws.len())?;
    let meshes = specimens.as_ref().map_or(source.meshes(), Microstructures::meshes);
    let mut levels = Level::all(inputs, meshes)?;
    let Some(level) = levels.pop() else {
        return Err(WorkflowError::Unusable("the case has no mesh".to_owned()));
    };
    source.read_rest(inputs);
    let place = |name: &String| {
        let place = names.iter().position(|own| own == name);
        place.ok_or_else(|| WorkflowError::Unusable(format!("{name} is not calibrated")))
    };
    let order: Vec<usize> = parameters.iter().map(place).collect::<Result<_, _>>()?;
    let point = |draw: &&Draw| order.iter().map(|&i| draw.theta[i]).collect::<Vec<f64>>();
    let points = draws.iter().map(point);
    let run = |(i, inputs)| RunInput { id: i + 1, inputs };
    let runs: Vec<RunInput> = points.enumerate().map(run).collect();
    // other draws are other runs
    let points: String = runs.iter().map(|run| format!("draw = {:?}\n", run.inputs)).collect();
    let manifest = format!("{}{points}", level.manifest);
    let named = NamedRuns {
        folder: FOLDER,
        manifest: &manifest,
        names: &parameters,
        runs: &runs,
        wait: true,
    };
    let requested =
        RequestedRuns { task: own, level: Some(&level), specimens: specimens.as_ref(), named };
    Ok((source.records(&requested)?, specimens.is_some()))
}

/// Names and measured quantities of the held-out specimens.
fn measured(
    inputs: &Inputs<'_>,
    columns: &[String],
) -> Result<(Vec<String>, Vec<Vec<f64>>), WorkflowError> {
    let table = CsvTable::read(&inputs.file("experiments.csv")?, &["id"])?;
    let (mut names, mut rows) = (Vec::new(), Vec::new());
    for row in table.rows() {
        names.push(row.text("id").to_owned());
        let values = columns.iter().map(|column| row.number(column));
        rows.push(values.collect::<Result<_, InputError>>()?);
    }
    Ok((names, rows))
}

/// Refuses held-out specimens whose curve or values the calibration uses.
fn refuse_calibrated(task: &Task<'_>, held_out: &Inputs<'_>) -> Result<(), WorkflowError> {
    let calibration = &task.inputs;
    let refuse = |path: std::path::PathBuf, id: &str, other: &str| {
        let problem = format!("has the data of {other}, which the calibration uses");
        let help = "Hold the specimen out of the calibration: remove its line from the table of [experiments], or give \
                    it another group; or leave it out of the validation.";
        Err(InputError::new(&path, "specimen", id, problem, help).into())
    };
    if let Some(path) = held_out.measured_values() {
        let quantities = &held_out.qoi().quantities;
        let Some(calibrated) = calibration.measured_values() else { return Ok(()) };
        // tables of other quantities cannot be compared
        let Ok(calibrated) = read_measured(&calibrated, quantities) else { return Ok(()) };
        for own in read_measured(&path, quantities)? {
            let is_same = |other: &&_| {
                let other: &super::super::measured_values::MeasuredSpecimen = other;
                other.id == own.id && other.values == own.values
            };
            if let Some(other) = calibrated.iter().find(is_same) {
                return refuse(path, &own.id, &other.id);
            }
        }
        return Ok(());
    }
    if held_out.are_specimens_virtual()? || calibration.are_specimens_virtual()? {
        // virtual specimens with different seeds are different; the check of the case refuses equal seeds
        return Ok(());
    }
    if calibration.measured_values().is_some() {
        return Ok(());
    }
    let own = held_out.chosen(held_out.specimen_table()?)?;
    let calibrated = calibration.chosen(calibration.specimen_table()?)?;
    for specimen in &own.specimens {
        let is_same = |other: &&crate::experiment::Specimen| other.curve == specimen.curve;
        if let Some(other) = calibrated.specimens.iter().find(is_same) {
            let path = held_out.folder().join(super::super::files::SPECIMENS);
            return refuse(path, &specimen.id, &other.id);
        }
    }
    Ok(())
}
