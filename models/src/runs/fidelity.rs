//! Correction of quantities from a cheap mesh, fitted to a few runs that are repeated on a more accurate mesh.

use std::collections::BTreeMap;

use surrogate::{
    Dataset, DynPce, FitOptions, FitReport, Input, PceFit, Scale, Scales, SurrogateError,
};

use super::level_runs::LevelRuns;
use super::made_on::MadeOn;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;

/// Ratio of the quantities on a more accurate mesh to the quantities on a cheaper mesh, as a function of the inputs.
///
/// The logarithm of the ratio is fitted, since mesh errors are relative. Both a constant and a linear function are
/// fitted; the function with the smaller leave-one-out error is used.
pub(crate) struct Correction {
    fit: PceFit,
}

impl Correction {
    /// Fits a correction to runs made on both meshes. Each run is (inputs, quantities on the cheaper mesh, quantities
    /// on the more accurate mesh).
    ///
    /// # Errors
    /// Fails for too few runs, or if all ratios are equal.
    pub(crate) fn of(
        inputs: &[Input],
        quantities: &[String],
        runs: &[(&[f64], &[f64], &[f64])],
    ) -> Result<Self, SurrogateError> {
        let mut ratios = Dataset::new(inputs.to_vec(), quantities.to_vec(), "breccia fidelity")?;
        for (inputs, cheap, better) in runs {
            let ratio: Vec<f64> = better.iter().zip(*cheap).map(|(b, c)| b / c).collect();
            ratios.push(inputs, &ratio)?;
        }
        let scales = Scales::Given {
            inputs: vec![Scale::Linear; inputs.len()],
            outputs: vec![Scale::Log; quantities.len()],
        };
        let options = FitOptions { max_order: 1, scales, ..FitOptions::default() };
        Ok(Self { fit: DynPce::fit(&ratios, &options)? })
    }

    /// Fits a correction to the runs of a level that were repeated on the next level.
    ///
    /// # Errors
    /// Fails if too few runs are usable on both levels.
    pub(crate) fn between(
        inputs: &[Input],
        quantities: &[String],
        cheap: &LevelRuns,
        better: &LevelRuns,
    ) -> Result<Self, WorkflowError> {
        let cheap: BTreeMap<usize, &[f64]> = cheap.usable().map(|(run, q)| (run.id, q)).collect();
        let runs: Vec<(&[f64], &[f64], &[f64])> = better
            .usable()
            .filter_map(|(run, better)| Some((&run.inputs[..], *cheap.get(&run.id)?, better)))
            .collect();
        if runs.len() < LEAST_REPEATS {
            return Err(WorkflowError::Unusable(format!(
                "{} of the {} runs that [fidelity] repeats on a better mesh are usable, which is too few for a \
                 correction; see failed_runs.csv, or repeat more",
                runs.len(),
                better.records.len()
            )));
        }
        Ok(Self::of(inputs, quantities, &runs)?)
    }

    /// Converts quantities on the cheaper mesh, and their derivatives if `jacobian` is not empty (quantities × inputs),
    /// to the more accurate mesh.
    ///
    /// # Errors
    /// Fails for inputs outside the prior box.
    pub(crate) fn apply(
        &self,
        inputs: &[f64],
        quantities: &mut [f64],
        jacobian: &mut [Vec<f64>],
    ) -> Result<(), SurrogateError> {
        let (ratios, slopes) = self.fit.pce.value_and_jacobian(inputs)?;
        // product rule
        for ((rates, quantity), (ratio, slopes)) in
            jacobian.iter_mut().zip(&*quantities).zip(ratios.iter().zip(slopes))
        {
            for (rate, slope) in rates.iter_mut().zip(slopes) {
                *rate = *rate * ratio + quantity * slope;
            }
        }
        quantities.iter_mut().zip(ratios).for_each(|(quantity, ratio)| *quantity *= ratio);
        Ok(())
    }

    /// Fit report, from which the error of the correction is computed.
    pub(crate) fn report(&self) -> &FitReport {
        &self.fit.report
    }

    /// Mean ratio of each quantity over the prior box.
    pub(crate) fn mean_ratios(&self) -> Vec<f64> {
        self.fit.pce.mean()
    }
}

/// Minimum number of repeated runs from which the scatter of the ratios can be estimated.
const LEAST_REPEATS: usize = 3;

/// Writes `fidelity_runs.csv` (the quantities of all levels as simulated), `fidelity.csv` and `fidelity.json` (the
/// corrections and their errors). `data` has the corrected runs.
pub(crate) fn write_corrections(
    task: &Task<'_>,
    data: &Dataset,
    levels: &[LevelRuns],
    corrections: &[Correction],
    made_on: &MadeOn,
) -> Result<(), WorkflowError> {
    let names = data.inputs().iter().map(|input| input.name.as_str());
    let outputs = data.outputs().iter().map(String::as_str);
    let header = ["level", "run"].into_iter().chain(names).chain(outputs).chain(["seconds"]);
    let rows = levels.iter().zip(1..).flat_map(|(runs, level)| {
        runs.usable().map(move |(run, quantities)| {
            let values = run.inputs.iter().chain(quantities).map(f64::to_string);
            let level_and_run = [level, run.id].map(|n: usize| n.to_string());
            let seconds = [format!("{:.3}", run.seconds)];
            level_and_run.into_iter().chain(values).chain(seconds).collect::<Vec<_>>()
        })
    });
    task.write_csv("fidelity_runs.csv", header, rows)?;

    let mut rows = Vec::new();
    for (level, correction) in (1..).zip(corrections) {
        let report = correction.report();
        let scatter = report.scatter(&vec![1.0; report.outputs.len()])?;
        let error = error_of(report, made_on)?;
        for (m, ratio) in correction.mean_ratios().into_iter().enumerate() {
            let percent = |variance: f64| (100.0 * variance.sqrt()).to_string();
            rows.push([
                level.to_string(),
                report.outputs[m].clone(),
                report.order.to_string(),
                ratio.to_string(),
                percent(scatter[m][m]),
                percent(error[m][m]),
                report.rows.to_string(),
            ]);
        }
    }
    let header = ["level", "qoi", "order", "ratio", "scatter_percent", "error_percent", "runs"];
    task.write_csv("fidelity.csv", header, rows)?;
    let reports: Vec<&FitReport> = corrections.iter().map(Correction::report).collect();
    task.write_json("fidelity.json", &reports)
}

/// Covariance of the relative error of a correction (quantities × quantities).
///
/// N is the number of repeated runs, s² the variance of the logarithm of the ratio, h the mean leverage of the fit:
/// - Each run has its own packing: the ratios scatter between packings and equally between specimens. The error that
///   all specimens share is the error of the mean ratio, s² h.
/// - All runs share one specimen: the error is the lack of fit of the ratio.
/// - Runs share n specimens: the error is the error of a mean over n specimens, which more repeated runs do not
///   reduce. The error is s² (h + 1/n − 1/N), if all scatter of the ratios is between specimens and the repeated runs
///   are spread evenly over the specimens.
///
/// # Errors
/// Fails only if the report was not written by this program.
pub(crate) fn error_of(
    report: &FitReport,
    made_on: &MadeOn,
) -> Result<Vec<Vec<f64>>, SurrogateError> {
    let ones = vec![1.0; report.outputs.len()];
    match (made_on, made_on.several()) {
        (MadeOn::One, _) => report.lack_of_fit(&ones),
        (_, None) => report.mean_error(&ones),
        (_, Some(count)) => {
            let few = (count.min(report.rows) as f64).recip() - (report.rows as f64).recip();
            let times = |row: Vec<f64>| row.into_iter().map(|c| c * few).collect();
            let of_few: Vec<Vec<f64>> = report.scatter(&ones)?.into_iter().map(times).collect();
            Ok(added(&report.mean_error(&ones)?, &of_few))
        }
    }
}

/// Relative error covariance of all corrections together (the sum of their covariances); `None` without corrections.
///
/// # Errors
/// The errors of [`error_of`].
pub(crate) fn error_of_all(
    reports: &[FitReport],
    made_on: &MadeOn,
) -> Result<Option<Vec<Vec<f64>>>, WorkflowError> {
    let mut sum: Option<Vec<Vec<f64>>> = None;
    for report in reports {
        let error = error_of(report, made_on)?;
        sum = Some(match sum {
            None => error,
            Some(sum) => added(&sum, &error),
        });
    }
    Ok(sum)
}

/// Sum of two matrices of the same shape, stored by rows.
pub(crate) fn added(a: &[Vec<f64>], b: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let row = |(a, b): (&Vec<f64>, &Vec<f64>)| a.iter().zip(b).map(|(a, b)| a + b).collect();
    a.iter().zip(b).map(row).collect()
}

/// Returns the indices of `count` points that fill the box evenly. The first point is nearest to the centre. Each next
/// point belongs to a specimen with the fewest chosen points; among these candidates, its distance to the chosen points
/// is largest. The first n indices do not depend on `count`.
pub(crate) fn spread(
    inputs: &[Input],
    parameter_points: &[&[f64]],
    specimens: &[usize],
    count: usize,
) -> Vec<usize> {
    let unit: Vec<Vec<f64>> = parameter_points
        .iter()
        .map(|point| {
            let position =
                |(input, x): (&Input, &f64)| (x - input.lower) / (input.upper - input.lower);
            inputs.iter().zip(*point).map(position).collect()
        })
        .collect();
    let squared = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum::<f64>();
    let middle = vec![0.5; inputs.len()];
    let nearest = (0..unit.len())
        .min_by(|&a, &b| squared(&unit[a], &middle).total_cmp(&squared(&unit[b], &middle)));
    let mut chosen: Vec<usize> = nearest.into_iter().collect();
    // distance of each point to the nearest chosen point
    let mut gap = vec![f64::INFINITY; unit.len()];
    let mut taken: BTreeMap<usize, usize> =
        specimens.iter().map(|&specimen| (specimen, 0)).collect();
    while let Some(&last) = chosen.last().filter(|_| chosen.len() < count.min(unit.len())) {
        gap.iter_mut().zip(&unit).for_each(|(gap, at)| *gap = gap.min(squared(at, &unit[last])));
        taken.entry(specimens[last]).and_modify(|taken| *taken += 1);
        let rest = || (0..unit.len()).rev().filter(|i| !chosen.contains(i));
        let fewest = rest().map(|i| taken[&specimens[i]]).min();
        let next = rest().filter(|&i| Some(taken[&specimens[i]]) == fewest);
        let farthest = next.max_by(|&a, &b| gap[a].total_cmp(&gap[b]));
        chosen.extend(farthest);
    }
    chosen.truncate(count);
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn input(name: &str) -> Input {
        Input::new(name, 0.0, 2.0).unwrap()
    }

    #[test]
    fn chosen_points_are_the_middle_and_then_the_corners() {
        let inputs = [input("a"), input("b")];
        let parameter_points: Vec<[f64; 2]> =
            (0..25).map(|i| [(i % 5) as f64 * 0.5, (i / 5) as f64 * 0.5]).collect();
        let parameter_points: Vec<&[f64]> = parameter_points.iter().map(|p| &p[..]).collect();
        // one specimen for all points, or a separate specimen for each point: the specimens do not affect the choice
        for specimens in [vec![0; 25], (0..25).collect()] {
            let spread = |count| spread(&inputs, &parameter_points, &specimens, count);
            let mut five = spread(5);
            assert_eq!(five[0], 12);
            assert_eq!(spread(3), five[..3]);
            five.sort_unstable();
            assert_eq!(five, [0, 4, 12, 20, 24]);
            assert_eq!(spread(99).len(), 25);
        }
        assert_eq!(spread(&inputs, &[], &[], 2), Vec::<usize>::new());
        // the four corners belong to the same specimen
        let specimens: Vec<usize> =
            (0..25).map(|i| usize::from([0, 4, 20, 24].contains(&i))).collect();
        let four = spread(&inputs, &parameter_points, &specimens, 4);
        let of_corners = four.iter().filter(|&&i| specimens[i] == 1).count();
        assert_eq!(of_corners, 2, "{four:?}");
    }

    /// A ratio that is the exponential of a linear function is recovered exactly. A constant ratio with scatter has the
    /// error of a mean of logarithms.
    #[test]
    fn ratios_are_found_again_with_their_errors() {
        let inputs = [input("a"), input("b")];
        let names = ["q".to_owned(), "r".to_owned()];
        let parameter_points: Vec<[f64; 2]> =
            (0..9).map(|i| [(i % 3) as f64, (i / 3) as f64]).collect();
        let plane = |x: &[f64]| (0.2 - 0.1 * x[0] + 0.03 * x[1]).exp();
        let cheap: Vec<[f64; 2]> = parameter_points.iter().map(|x| [3.0 + x[0], 5.0]).collect();
        let better: Vec<[f64; 2]> = parameter_points
            .iter()
            .zip(&cheap)
            .map(|(x, cheap)| [cheap[0] * plane(x), cheap[1] * plane(x).powi(2)])
            .collect();
        let runs: Vec<(&[f64], &[f64], &[f64])> = parameter_points
            .iter()
            .zip(cheap.iter().zip(&better))
            .map(|(x, (c, b))| (&x[..], &c[..], &b[..]))
            .collect();
        let correction = Correction::of(&inputs, &names, &runs).unwrap();
        assert_eq!(correction.report().order, 1);
        let at = [0.4, 1.7];
        // quantities q = 2 x₀ and r = 7 on the cheap mesh: test the derivatives of the corrected quantities
        let (mut corrected, mut rates) = ([2.0 * at[0], 7.0], [vec![2.0, 0.0], vec![0.0, 0.0]]);
        correction.apply(&at, &mut corrected, &mut rates).unwrap();
        let (one, two) = (plane(&at), plane(&at).powi(2));
        let exact = [
            [2.0 * one - 0.1 * 2.0 * at[0] * one, 0.03 * 2.0 * at[0] * one],
            [-0.2 * 7.0 * two, 0.06 * 7.0 * two],
        ];
        for (rate, exact) in rates.iter().flatten().zip(exact.as_flattened()) {
            assert!((rate - exact).abs() < 1e-11, "{rates:?}");
        }
        assert!((corrected[0] / (2.0 * at[0] * plane(&at)) - 1.0).abs() < 1e-12, "{corrected:?}");
        assert!((corrected[1] / (7.0 * plane(&at).powi(2)) - 1.0).abs() < 1e-12, "{corrected:?}");
        assert!(error_of(correction.report(), &MadeOn::Each).unwrap()[0][0].abs() < 1e-20);

        let noise: [f64; 9] = [0.02, -0.01, 0.0, 0.013, -0.02, 0.01, -0.03, 0.007, 0.01];
        let better: Vec<[f64; 2]> = cheap
            .iter()
            .zip(noise)
            .map(|(cheap, e)| [cheap[0] * 0.8 * e.exp(), cheap[1] * 1.1 * (-2.0 * e).exp()])
            .collect();
        let runs: Vec<(&[f64], &[f64], &[f64])> = parameter_points
            .iter()
            .zip(cheap.iter().zip(&better))
            .map(|(x, (c, b))| (&x[..], &c[..], &b[..]))
            .collect();
        let correction = Correction::of(&inputs, &names, &runs).unwrap();
        assert_eq!(correction.report().order, 0);
        let mean = noise.iter().sum::<f64>() / 9.0;
        let mut corrected = [1.0, 1.0];
        correction.apply(&at, &mut corrected, &mut []).unwrap();
        assert!((corrected[0] / (0.8 * mean.exp()) - 1.0).abs() < 1e-12);
        let variance = noise.iter().map(|e| (e - mean).powi(2)).sum::<f64>() / 8.0;
        let error = error_of(correction.report(), &MadeOn::Each).unwrap();
        assert!((error[0][0] / (variance / 9.0) - 1.0).abs() < 1e-9);
        assert!((error[0][1] / (-2.0 * variance / 9.0) - 1.0).abs() < 1e-9);
        let twice = error_of_all(
            &[correction.report().clone(), correction.report().clone()],
            &MadeOn::Each,
        );
        assert!((twice.unwrap().unwrap()[0][0] / (2.0 * error[0][0]) - 1.0).abs() < 1e-12);
        // nine runs on three specimens: the error of a mean over three specimens
        let shared = MadeOn::Several((0..9).map(|i| i % 3).collect());
        let error = error_of(correction.report(), &shared).unwrap();
        assert!((error[0][0] / (variance / 3.0) - 1.0).abs() < 1e-9);
        // all runs on one specimen: the error of a prediction, by leave-one-out
        let left_out = error_of(correction.report(), &MadeOn::One).unwrap();
        assert!((left_out[0][0] / (variance * (9.0f64 / 8.0).powi(2)) - 1.0).abs() < 1e-9);
    }
}
