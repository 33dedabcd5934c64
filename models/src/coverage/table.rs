//! Table of a coverage study: how often the intervals of each setting contain the truth.

use ppl::diagnostics::quantile;

/// Probabilities of the central intervals whose coverage is determined.
const NOMINAL: [f64; 3] = [0.5, 0.9, 0.95];

/// Coverage of the intervals of a nominal probability.
#[derive(Clone, Debug, PartialEq)]
pub struct CoverageRow {
    /// Name of the setting.
    pub setting: String,
    /// Name of the parameter.
    pub parameter: String,
    /// Probability of the central interval.
    pub nominal: f64,
    /// Fraction of the laboratories in which the interval contains the truth.
    pub covered: f64,
    /// Number of laboratories.
    pub laboratories: usize,
    /// Mean width of the interval, in the parameter's unit.
    pub mean_width: f64,
    /// Coverage minus the coverage of the first setting on the same laboratories.
    pub difference: f64,
    /// Standard error of `difference`. Laboratories in which both intervals contain the truth, or both miss the truth,
    /// contribute no variance.
    pub difference_error: f64,
}

/// Central intervals of one parameter, for each probability in [`NOMINAL`].
pub(super) type Intervals = [[f64; 2]; NOMINAL.len()];

/// Intervals of all parameters of a laboratory in one setting.
pub(super) struct SettingIntervals {
    pub(super) setting: String,
    pub(super) parameters: Vec<String>,
    pub(super) intervals: Vec<Intervals>,
}

/// Truth and intervals of one laboratory. All laboratories have the same settings in the same order.
pub(super) struct CalibratedLaboratory {
    pub(super) truth: Vec<f64>,
    pub(super) settings: Vec<SettingIntervals>,
}

/// Computes the intervals of each parameter from draws, one row of `parameters` values per draw.
pub(super) fn intervals(draws: &[f64], parameters: usize) -> Vec<Intervals> {
    let interval = |i: usize| {
        let mut own: Vec<f64> = draws.iter().skip(i).step_by(parameters).copied().collect();
        // sort once: `quantile` sorts its argument in each call, which is fast for sorted values
        own.sort_by(f64::total_cmp);
        NOMINAL.map(|p| [quantile(&own, 0.5 * (1.0 - p)), quantile(&own, 0.5 * (1.0 + p))])
    };
    (0..parameters).map(interval).collect()
}

/// Returns a row for each setting, parameter and nominal probability.
pub(super) fn rows(laboratories: &[CalibratedLaboratory]) -> Vec<CoverageRow> {
    let Some(first) = laboratories.first() else { return Vec::new() };
    let mut rows = Vec::new();
    for (s, SettingIntervals { setting, parameters, .. }) in first.settings.iter().enumerate() {
        for (i, parameter) in parameters.iter().enumerate() {
            for (p, nominal) in NOMINAL.into_iter().enumerate() {
                let is_covered = |laboratory: &CalibratedLaboratory, s: usize| {
                    let [low, high] = laboratory.settings[s].intervals[i][p];
                    f64::from(u8::from((low..=high).contains(&laboratory.truth[i])))
                };
                let width = |laboratory: &CalibratedLaboratory| {
                    let [low, high] = laboratory.settings[s].intervals[i][p];
                    high - low
                };
                let gap = |laboratory| is_covered(laboratory, s) - is_covered(laboratory, 0);
                let gaps: Vec<f64> = laboratories.iter().map(gap).collect();
                let (difference, difference_error) = mean_and_error(&gaps);
                let n = laboratories.len() as f64;
                rows.push(CoverageRow {
                    setting: setting.clone(),
                    parameter: parameter.clone(),
                    nominal,
                    covered: laboratories.iter().map(|l| is_covered(l, s)).sum::<f64>() / n,
                    laboratories: laboratories.len(),
                    mean_width: laboratories.iter().map(width).sum::<f64>() / n,
                    difference,
                    difference_error,
                });
            }
        }
    }
    rows
}

/// Mean of values and its standard error; the error of a single value is NaN.
fn mean_and_error(values: &[f64]) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.iter().sum::<f64>() / n;
    let squares: f64 = values.iter().map(|x| (x - mean).powi(2)).sum();
    (mean, (squares / (n - 1.0) / n).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn intervals_are_quantiles_of_each_parameter() {
        // two parameters: 0, 1, …, 100 and −2 times these values
        let draws: Vec<f64> = (0..=100).flat_map(|k| [f64::from(k), -2.0 * f64::from(k)]).collect();
        let found = intervals(&draws, 2);
        let expected = [[25.0, 75.0], [5.0, 95.0], [2.5, 97.5]];
        for (found, [low, high]) in found[0].iter().zip(expected) {
            assert!((found[0] - low).abs() < 1e-12 && (found[1] - high).abs() < 1e-12, "{found:?}");
        }
        for (found, [low, high]) in found[1].iter().zip(expected) {
            let [below, above] = [found[0] + 2.0 * high, found[1] + 2.0 * low];
            assert!(below.abs() < 1e-12 && above.abs() < 1e-12, "{found:?}");
        }
    }

    /// Four laboratories with the truth 0: the first setting covers it in three of them, the second setting in one.
    #[test]
    fn settings_are_compared_on_the_same_laboratories() {
        let laboratory = |ends: [f64; 2]| CalibratedLaboratory {
            truth: vec![0.0],
            settings: ends
                .into_iter()
                .zip(["wide", "narrow"])
                .map(|(end, name)| SettingIntervals {
                    setting: name.to_owned(),
                    parameters: vec!["a".to_owned()],
                    intervals: vec![[[end - 2.0, end]; 3]],
                })
                .collect(),
        };
        let found = rows(&[[1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, -1.0]].map(laboratory));
        assert_eq!(found.len(), 6);
        assert_eq!((found[0].covered, found[0].difference), (0.75, 0.0));
        assert_eq!(found[0].difference_error, 0.0);
        let narrow = &found[3];
        assert_eq!((&*narrow.setting, narrow.covered, narrow.difference), ("narrow", 0.25, -0.5));
        // the differences −1, −1, 0, 0 have the variance 1/3
        assert!((narrow.difference_error - (1.0_f64 / 12.0).sqrt()).abs() < 1e-12, "{narrow:?}");
        assert_eq!(narrow.mean_width, 2.0);
        assert!(rows(&[]).is_empty());
    }
}
