//! Measurements of the held-out specimens of a validation.

use crate::error::InputError;
use crate::experiments::specimen_quantities::read_cell;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::results_folder::error::WorkflowError;
use crate::table::CsvTable;

/// Held-out specimens with their compared quantities.
pub(super) struct HeldOut {
    /// The compared quantities.
    pub(super) quantities: Vec<Quantity>,
    /// Columns of the compared quantities.
    pub(super) columns: Vec<String>,
    /// Names of the specimens.
    ids: Vec<String>,
    /// Measured quantities, one row per specimen; NaN if the specimen lacks the quantity.
    rows: Vec<Vec<f64>>,
}

impl HeldOut {
    /// Reads `experiments.csv` in the folder of the validation.
    ///
    /// # Errors
    /// Fails if the file is missing, or a cell is neither empty nor a number.
    pub(super) fn read(inputs: &Inputs<'_>) -> Result<Self, WorkflowError> {
        let quantities = inputs.qoi().quantities.clone();
        let columns: Vec<String> = quantities.iter().map(|q| q.column().into_owned()).collect();
        let path = inputs.file("experiments.csv")?;
        let required: Vec<&str> =
            ["id"].into_iter().chain(columns.iter().map(String::as_str)).collect();
        let table = CsvTable::read(&path, &required)?;
        let (mut ids, mut rows) = (Vec::new(), Vec::new());
        for row in table.rows() {
            ids.push(row.text("id").to_owned());
            let values = columns.iter().map(|column| read_cell(&row, column, false));
            rows.push(values.collect::<Result<_, InputError>>()?);
        }
        Ok(Self { quantities, columns, ids, rows })
    }

    /// Names of the specimens that have the quantity at the index `m`, with their values.
    pub(super) fn of_quantity(&self, m: usize) -> Vec<(String, f64)> {
        let all = self.ids.iter().cloned().zip(self.rows.iter().map(|row| row[m]));
        all.filter(|(_, value)| !value.is_nan()).collect()
    }
}
