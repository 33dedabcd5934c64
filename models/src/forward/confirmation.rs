//! Table `confirm.csv`: the simulation at the posterior mode against the means of the specimens.

use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

const FILE: &str = "confirm.csv";
const COLUMNS: [&str; 5] =
    ["qoi", "experiment_mean", "map_simulation", "percent_error", "mesh_error_percent"];

/// A quantity of the simulation at the posterior mode.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct ConfirmedQuantity {
    /// Column of the quantity.
    pub(crate) column: String,
    /// Mean of the specimens.
    pub(crate) experiment_mean: f64,
    /// Value of the simulation.
    pub(crate) map_simulation: f64,
    /// Absolute difference between simulation and mean in % of the mean.
    pub(crate) percent_error: f64,
    /// Error of the mesh in %; `None` if it was not estimated.
    pub(crate) mesh_error_percent: Option<f64>,
}

impl ConfirmedQuantity {
    /// Writes the table.
    ///
    /// # Errors
    /// The errors of [`Task::write_csv`].
    pub(crate) fn write(task: &Task<'_>, quantities: &[Self]) -> Result<(), WorkflowError> {
        let row = |quantity: &Self| {
            let Self { column, experiment_mean, map_simulation, percent_error, .. } = quantity;
            let numbers = [experiment_mean, map_simulation, percent_error].map(f64::to_string);
            let mesh = quantity.mesh_error_percent.map(|error| error.to_string());
            let cells = [column.clone()].into_iter().chain(numbers);
            cells.chain([mesh.unwrap_or_default()]).collect::<Vec<_>>()
        };
        task.write_csv(FILE, COLUMNS, quantities.iter().map(row))
    }

    /// Reads the table, in the order of the compared quantities.
    ///
    /// # Errors
    /// Fails if the table is missing or has an entry that is not a number.
    pub(crate) fn read(inputs: &Inputs<'_>) -> Result<Vec<Self>, WorkflowError> {
        let path = inputs.file(FILE)?;
        let table = CsvTable::read(&path, &COLUMNS)?;
        let quantity = |row: TableRow<'_>| {
            let [column, mean, simulation, error, mesh] = COLUMNS;
            Ok(Self {
                column: row.text(column).to_owned(),
                experiment_mean: row.number(mean)?,
                map_simulation: row.number(simulation)?,
                percent_error: row.number(error)?,
                mesh_error_percent: match row.text(mesh).is_empty() {
                    true => None,
                    false => Some(row.number(mesh)?),
                },
            })
        };
        Ok(table.rows().map(quantity).collect::<Result<_, InputError>>()?)
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::AtomicBool;

    use super::*;
    use crate::case::CaseFile;

    #[test]
    fn the_table_is_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let (file, interrupt) = (CaseFile::default_case(), AtomicBool::new(false));
        let inputs = || Inputs::new(&file, dir.path(), |_| Some("confirm"));
        let task = Task::new("confirm", inputs(), dir.path(), 1, &interrupt);
        let quantity = |column: &str, mesh_error_percent| ConfirmedQuantity {
            column: column.to_owned(),
            experiment_mean: 147.1,
            map_simulation: 1.0 / 3.0,
            percent_error: 5e-3,
            mesh_error_percent,
        };
        let quantities = [quantity("peak_force_N", Some(-0.25)), quantity("slope_N_per_mm", None)];
        ConfirmedQuantity::write(&task, &quantities).unwrap();
        assert_eq!(ConfirmedQuantity::read(&inputs()).unwrap(), quantities);
    }
}
