//! Bands of curves of new specimens, and the held-out curves inside them.

use super::compared::LEVELS;
use super::predicted::Predicted;
use super::simulated::{ForceScatter, Runs};
use crate::experiment::TestCurve;
use crate::experiments::experiment_inputs;
use crate::forward::predicted_curves::specimen_curves;
use crate::pipeline::inputs::Inputs;
use crate::report::PredictedBand;
use crate::results_folder::error::WorkflowError;
use crate::simulation::recorded::recorded_run;
use crate::table::CsvTable;
use crate::validation::Prediction;

/// Number of displacements of a band.
const PLACES: usize = 60;

/// File with the band that the calibration predicts.
const PREDICTED: &str = "predictive_curves.csv";

/// Band of the curve of a new specimen, and how many held-out curves are inside at each displacement.
pub(super) struct Band {
    band: PredictedBand,
    /// Number of held-out curves that reach each displacement, and how many of them are inside the interval of each of
    /// [`LEVELS`].
    inside: Vec<(usize, [usize; LEVELS.len()])>,
}

impl Band {
    pub(super) const COLUMNS: [&str; 10] = [
        "validation",
        "displacement_mm",
        "force_N_q05",
        "force_N_q25",
        "force_N_q50",
        "force_N_q75",
        "force_N_q95",
        "curves",
        "inside50",
        "inside90",
    ];

    fn new(band: PredictedBand, curves: &[TestCurve]) -> Self {
        let [low, low_half, _, high_half, high] = &band.force_n;
        let at = |(i, u): (usize, &f64)| {
            let forces: Vec<f64> = curves.iter().filter_map(|curve| force_at(curve, *u)).collect();
            let count = |low: f64, high: f64| {
                forces.iter().filter(|force| (low..=high).contains(*force)).count()
            };
            (forces.len(), [count(low_half[i], high_half[i]), count(low[i], high[i])])
        };
        let inside = band.displacement_mm.iter().enumerate().map(at).collect();
        Self { band, inside }
    }

    /// Rows of the band of the validation `name`.
    pub(super) fn rows(&self, name: &str) -> Vec<Vec<String>> {
        let row = |(i, (curves, inside)): (usize, &(usize, [usize; LEVELS.len()]))| {
            let forces = self.band.force_n.iter().map(|quantile| quantile[i]);
            let displacement_and_forces = [self.band.displacement_mm[i]].into_iter().chain(forces);
            let counts = [*curves].into_iter().chain(*inside).map(|n| n.to_string());
            let displacement_and_forces = displacement_and_forces.map(|x| x.to_string());
            [name.to_owned()].into_iter().chain(displacement_and_forces).chain(counts).collect()
        };
        self.inside.iter().enumerate().map(row).collect()
    }
}

/// The band that the calibration predicts for new specimens, and the held-out curves; `None` if there is no band.
///
/// # Errors
/// Fails if a file cannot be read.
pub(super) fn emulated(
    calibration: &Inputs<'_>,
    held_out: &Inputs<'_>,
) -> Result<Option<Band>, WorkflowError> {
    let Some(path) = calibration.file_if_there(PREDICTED) else { return Ok(None) };
    if experiment_inputs::measured_values(held_out).is_some() {
        return Ok(None);
    }
    let table = CsvTable::read(&path, &["displacement_mm"])?;
    let mut band = PredictedBand::default();
    for row in table.rows() {
        band.displacement_mm.push(row.number("displacement_mm")?);
        for (forces, column) in band.force_n.iter_mut().zip(&Band::COLUMNS[2..7]) {
            forces.push(row.number(column)?);
        }
    }
    Ok(Some(Band::new(band, &specimen_curves(held_out)?)))
}

/// The band of the simulated curves, and the held-out curves; `None` if there are no curves, or if the scatter of the force
/// between specimens is unknown.
///
/// At each displacement the force of a new specimen is the force of the simulation at a draw, with the relative scatter
/// of the peak force and with the error that `[calibration.discrepancy]` states for the peak force. The scatter of the
/// displacements is omitted.
///
/// # Errors
/// Fails if a file cannot be read, or if a force is not finite.
pub(super) fn simulated(
    held_out: &Inputs<'_>,
    runs: &Runs<'_>,
) -> Result<Option<Band>, WorkflowError> {
    let has_curves = runs.records.iter().all(|record| !record.curve.is_empty());
    let Some(scatter) = runs.force.as_ref().filter(|_| has_curves) else {
        return Ok(None);
    };
    if experiment_inputs::measured_values(held_out).is_some() {
        return Ok(None);
    }
    let curves: Vec<TestCurve> = runs.records.iter().map(recorded_run).collect();
    let largest = |curve: &TestCurve| curve.displacement_mm.iter().copied().fold(0.0, f64::max);
    let end = curves.iter().map(largest).fold(f64::INFINITY, f64::min);
    let mut band = PredictedBand::default();
    for position in 1..=PLACES {
        let u = end * position as f64 / PLACES as f64;
        let forces: Option<Vec<f64>> = curves.iter().map(|curve| force_at(curve, u)).collect();
        let Some(forces) = forces else { continue };
        let prediction = prediction_of_force(forces, scatter)?;
        band.displacement_mm.push(u);
        for (forces, p) in band.force_n.iter_mut().zip([0.05, 0.25, 0.5, 0.75, 0.95]) {
            forces.push(prediction.quantile(p));
        }
    }
    Ok(Some(Band::new(band, &specimen_curves(held_out)?)))
}

/// Prediction of the force of a new specimen at one displacement, from the forces of the curves at the draws.
fn prediction_of_force(
    forces: Vec<f64>,
    scatter: &ForceScatter,
) -> Result<Prediction, WorkflowError> {
    let sd = |(force, variance): (&f64, &f64)| force.abs() * variance.sqrt();
    let sds = forces.iter().zip(&scatter.variances).map(sd).collect();
    let mean = forces.iter().sum::<f64>() / forces.len() as f64;
    Ok(Predicted::new(
        "the force of the curve",
        forces,
        Some(sds),
        scatter.discrepancy_sd * mean.abs(),
    )?
    .without_relative_variance(scatter.included)
    .prediction)
}

/// Force at a displacement on the loading part of a curve, interpolated linearly; `None` outside the curve.
fn force_at(curve: &TestCurve, u: f64) -> Option<f64> {
    let readings = || curve.displacement_mm.iter().zip(&curve.force_n);
    readings().zip(readings().skip(1)).find_map(|((a, force_a), (b, force_b))| {
        (*a <= u && u <= *b && a < b).then(|| force_a + (force_b - force_a) * (u - a) / (b - a))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(points: &[(f64, f64)]) -> TestCurve {
        TestCurve {
            displacement_mm: points.iter().map(|p| p.0).collect(),
            force_n: points.iter().map(|p| p.1).collect(),
            ..TestCurve::default()
        }
    }

    #[test]
    fn curves_are_counted_where_they_reach() {
        let forces = |x: f64| vec![x; 2];
        let band = PredictedBand {
            displacement_mm: vec![1.0, 3.0],
            force_n: [forces(0.0), forces(8.0), forces(10.0), forces(12.0), forces(20.0)],
            end: None,
        };
        let curves = [
            curve(&[(0.0, 0.0), (2.0, 20.0), (4.0, 60.0)]),
            curve(&[(0.0, 15.0), (2.0, 15.0)]),
            curve(&[(0.0, -1.0), (5.0, -1.0)]),
        ];
        let band = Band::new(band, &curves);
        // at 1 mm the forces are 10, 15 and −1; at 3 mm they are 40 and −1, and the second curve has ended
        assert_eq!(band.inside, [(3, [1, 2]), (2, [0, 0])]);
        assert!(band.rows("a").iter().all(|row| row.len() == Band::COLUMNS.len()));
    }

    /// Scatter 3 %, error of the model 4 %: together 5 %. Scatter between microstructures is removed from the curves.
    #[test]
    fn the_force_has_the_scatter_between_specimens_and_the_error_of_the_model() {
        let scatter =
            |included| ForceScatter { variances: vec![0.0009; 3], included, discrepancy_sd: 0.04 };
        let equal = prediction_of_force(vec![-200.0; 3], &scatter(0.0)).unwrap();
        assert!((equal.sd() - 10.0).abs() < 1e-9, "{}", equal.sd());
        // 190, 200 and 210 have the variance 100
        let forces = vec![190.0, 200.0, 210.0];
        let of_scatter = 0.0009 * (190.0_f64.powi(2) + 200.0_f64.powi(2) + 210.0_f64.powi(2)) / 3.0;
        for (included, remaining) in [(0.0, 100.0), (0.001, 60.0), (0.01, 0.0)] {
            let computed = prediction_of_force(forces.clone(), &scatter(included)).unwrap().sd();
            let exact = (remaining + of_scatter + 64.0_f64).sqrt();
            assert!((computed - exact).abs() < 1e-9, "{included}: {computed} {exact}");
        }
    }
}
