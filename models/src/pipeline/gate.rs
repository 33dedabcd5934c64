//! Check before the calibration that the measured quantities are within the range of the simulations.

use surrogate::Dataset;

use super::inputs::Inputs;
use super::task::Task;
use crate::error::InputError;
use crate::fracture::column_means;
use crate::qoi::{Quantity, Unit};
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::SPECIMENS;

/// Stops a calibration if the mean of a quantity over the specimens is outside the range of the ensemble.
///
/// Writes `range.csv`. With `--accept-out-of-range`, returns one warning per quantity that is out of range instead of
/// an error.
///
/// # Errors
/// Names the table of specimens, the mean, the range and the likely cause.
pub(crate) fn check_range(
    task: &Task<'_>,
    specimens: &[Vec<f64>],
) -> Result<Vec<String>, WorkflowError> {
    let ranges = ranges(&task.inputs, specimens)?;
    let rows = ranges.iter().map(|range| {
        let [low, high] = range.reached.map(|x| x.to_string());
        [range.name.clone(), range.value.to_string(), low, high, range.is_inside().to_string()]
    });
    task.write_csv("range.csv", ["qoi", "experiment_mean", "low", "high", "inside"], rows)?;
    if !task.accept_out_of_range {
        refuse_outside(&ranges, &task.inputs, specimens.len())?;
    }
    let outside = ranges.iter().filter(|range| !range.is_inside());
    let mut outside: Vec<&Range> = outside.collect();
    outside.sort_by_key(|range| range.rank());
    Ok(outside.iter().map(|range| format!("Data out of range: {}", range.warning())).collect())
}

/// Stops a joint calibration if the mean of a quantity over the specimens of a test is outside the range of the runs
/// of this test.
///
/// # Errors
/// The errors of [`check_range`].
pub(crate) fn check_range_of_test(
    inputs: &Inputs<'_>,
    specimens: &[Vec<f64>],
) -> Result<(), WorkflowError> {
    refuse_outside(&ranges(inputs, specimens)?, inputs, specimens.len())
}

/// Returns, for each quantity, the mean over the specimens and the range over the runs.
fn ranges(inputs: &Inputs<'_>, specimens: &[Vec<f64>]) -> Result<Vec<Range>, WorkflowError> {
    let data = Dataset::read_csv(inputs.file("runs.csv")?)?;
    let means = column_means(specimens);
    let reached = |m: usize| {
        let values = data.rows().map(|(_, qois)| qois[m]);
        values.fold([f64::INFINITY, f64::NEG_INFINITY], |[a, b], q| [a.min(q), b.max(q)])
    };
    let named = data.outputs().iter().zip(means).enumerate();
    let range = named.map(|(m, (name, mean))| Range {
        name: name.clone(),
        value: mean,
        reached: reached(m),
    });
    Ok(range.collect())
}

/// Fails if the mean of a quantity over `count` specimens is outside its range.
fn refuse_outside(
    ranges: &[Range],
    inputs: &Inputs<'_>,
    count: usize,
) -> Result<(), WorkflowError> {
    let mut outside: Vec<&Range> = ranges.iter().filter(|range| !range.is_inside()).collect();
    outside.sort_by_key(|range| range.rank());
    let [first, rest @ ..] = &outside[..] else { return Ok(()) };
    let others: Vec<String> = rest.iter().map(|range| format!("; {}", range.words())).collect();
    let cause = outside.iter().find_map(|range| range.cause()).unwrap_or(
        "If the units are correct, widen the box of [prior], or look for effects that the model omits.",
    );
    let [low, high] = first.reached;
    Err(InputError::new(
        &inputs.folder().join(SPECIMENS),
        format!("mean of {} over {count} specimens", first.name),
        format!("{:.4}", first.value),
        format!("is outside the range of the ensemble, {low:.4} to {high:.4}{}", others.concat()),
        format!("{cause} With --accept-out-of-range the calibration continues, and no parameter is called identified."),
    )
    .into())
}

/// Whether the means of the specimens are within the ranges of the runs.
pub(crate) fn is_in_range(runs: &Dataset, means: &[f64]) -> bool {
    means.iter().enumerate().all(|(m, mean)| {
        let values = || runs.rows().map(|(_, qois)| qois[m]);
        values().any(|q| q <= *mean) && values().any(|q| q >= *mean)
    })
}

/// Rank of a quantity by how well it identifies a wrong unit in a table; 0 is best. The slope ranks low because it
/// depends on two units.
pub(crate) fn unit_rank(unit: Unit) -> usize {
    match (unit.newton != 0, unit.millimetre != 0) {
        (true, false) => 0,
        (false, true) => 1,
        (true, true) => 2,
        (false, false) => 3,
    }
}

/// Measured value of a quantity, and the range in which the value is expected.
pub(crate) struct Range {
    pub(crate) name: String,
    pub(crate) value: f64,
    pub(crate) reached: [f64; 2],
}

impl Range {
    /// Rank by how well the quantity identifies a wrong unit; quantities of other programs come first.
    fn rank(&self) -> Option<usize> {
        Quantity::of_column(&self.name).map(|quantity| unit_rank(quantity.unit()))
    }

    pub(crate) fn is_inside(&self) -> bool {
        (self.reached[0]..=self.reached[1]).contains(&self.value)
    }

    fn words(&self) -> String {
        let [low, high] = self.reached;
        format!("{} = {:.4}, outside {low:.4} to {high:.4}", self.name, self.value)
    }

    fn warning(&self) -> String {
        let [low, high] = self.reached;
        format!(
            "the experimental mean of {} is {:.4}, outside the range of the ensemble ({low:.4} to \
             {high:.4}). No parameter is identified: widen the prior, or look for effects that the model \
             omits.",
            self.name, self.value
        )
    }

    /// Returns a question about the unit, if a wrong unit explains why the value is far from the range; `None` unless
    /// the ratio of the value to the middle of the range is close to 1000 or 1/1000.
    pub(crate) fn cause(&self) -> Option<&'static str> {
        let ratio = self.value.abs() / (self.reached[0] * self.reached[1]).sqrt();
        let thousands = ratio.log10() / 3.0;
        let sign = [-1.0, 1.0].into_iter().find(|sign| (thousands - sign).abs() < 0.25)?;
        let is_small = sign < 0.0;
        let unit = Quantity::of_column(&self.name)?.unit();
        Some(match (unit.newton != 0, unit.millimetre != 0) {
            (true, _) if is_small => {
                "Is the force in kN? It is read as N: write force_unit = \"kN\" under [experiments.read], or name the \
                 column force_kN."
            }
            (true, false) => {
                "Is the force in mN? It is read as N: write force_unit = \"mN\" under [experiments.read]."
            }
            (false, true) if is_small => {
                "Is displacement in m? It is read as mm: write displacement_unit = \"m\" under [experiments.read]."
            }
            (false, true) => {
                "Is displacement in µm? It is read as mm: write displacement_unit = \"µm\" under [experiments.read]."
            }
            (true, true) => {
                "Is displacement in m, or force in mN? They are read as mm and N: write displacement_unit or \
                 force_unit under [experiments.read]."
            }
            (false, false) => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_slip_of_a_thousand_is_recognised_and_another_distance_is_not() {
        let cause = |column: &str, value: f64| {
            let name = column.to_owned();
            Range { name, value, reached: [120.0, 180.0] }.cause()
        };
        assert!(cause("peak_force_N", 0.147).unwrap().contains("force_unit = \"kN\""));
        assert!(cause("displacement_at_peak_mm", 0.147).unwrap().contains("in m?"));
        assert!(cause("displacement_at_peak_mm", 147e3).unwrap().contains("µm"));
        assert_eq!(cause("peak_force_N", 250.0), None);
        assert_eq!(cause("peak_force_N", 14.7), None);
    }
}
