//! Prediction and measurements of one quantity of the held-out specimens, as rows of the products.

use super::predicted::Predicted;
use crate::report::ValidationVerdict;
use crate::validation::{Coverage, Deviation, HeldOutValue};

pub(super) use crate::validation::LEVELS;

/// Probability that at least one of the comparisons contradicts a correct calibration.
const SIGNIFICANCE: f64 = 0.01;

/// A difference between the means below this fraction of the predicted mean does not contradict the prediction, as in the rule
/// on misfits of the calibrated specimens.
const NEGLIGIBLE: f64 = 0.02;

/// Prediction and measurements of one quantity.
pub(super) struct Compared {
    /// Name of the validation.
    pub(super) validation: String,
    /// Column of the quantity.
    pub(super) column: String,
    /// Source of the prediction.
    pub(super) method: &'static str,
    /// Names of the specimens and their measured values.
    pub(super) specimens: Vec<(String, f64)>,
    pub(super) predicted: Predicted,
}

impl Compared {
    pub(super) const SPECIMEN_COLUMNS: [&str; 13] = HeldOutValue::COLUMNS;

    pub(super) const SUMMARY_COLUMNS: [&str; 15] = [
        "validation",
        "qoi",
        "method",
        "draws",
        "specimens",
        "scatter_is_predicted",
        "inside50",
        "inside90",
        "mean_crps",
        "measured_mean",
        "predicted_mean",
        "predicted_sd",
        "deviation",
        "p_value",
        "verdict",
    ];

    /// Rows of the specimens. Without a scatter between specimens there are a median and no intervals.
    pub(super) fn specimen_rows(&self) -> Vec<Vec<String>> {
        let row = |(specimen, measured): &(String, f64)| {
            let (validation, quantity) = (&*self.validation, &*self.column);
            let prediction = &self.predicted.prediction;
            let measured = *measured;
            let value = HeldOutValue { validation, quantity, specimen, measured, prediction };
            let mut row = value.cells().to_vec();
            if !self.predicted.is_scatter_known {
                let is_of_scatter = |column: &&str| {
                    !["validation", "qoi", "specimen", "measured", "median"].contains(column)
                };
                let columns = Self::SPECIMEN_COLUMNS.iter().zip(&mut row);
                columns
                    .filter(|(column, _)| is_of_scatter(column))
                    .for_each(|(_, cell)| cell.clear());
            }
            row
        };
        self.specimens.iter().map(row).collect()
    }

    /// Row of the quantity.
    pub(super) fn summary_row(&self, verdict: ValidationVerdict) -> Vec<String> {
        let prediction = &self.predicted.prediction;
        let measured = self.measured();
        let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
        let scores: Vec<f64> = measured.iter().map(|y| prediction.crps(*y)).collect();
        let is_known = self.predicted.is_scatter_known;
        let if_known = |text: String| if is_known { text } else { String::new() };
        let inside = self.coverage().map(|levels| levels.map(|level| level.inside.to_string()));
        let [narrow, wide] = inside.unwrap_or_default();
        let deviation = prediction.deviation(&measured);
        let text = |x: Option<f64>| x.map(|x| x.to_string()).unwrap_or_default();
        vec![
            self.validation.clone(),
            self.column.clone(),
            self.method.to_owned(),
            prediction.draws().to_string(),
            measured.len().to_string(),
            is_known.to_string(),
            narrow,
            wide,
            if_known(mean(&scores).to_string()),
            mean(&measured).to_string(),
            prediction.mean().to_string(),
            if_known(prediction.sd().to_string()),
            text(deviation.standardised()),
            text(self.p_values(&deviation).into_iter().reduce(f64::min)),
            verdict.name().to_owned(),
        ]
    }

    /// Number of specimens inside the interval of each of [`LEVELS`]; `None` without a scatter between specimens.
    pub(super) fn coverage(&self) -> Option<[Coverage; 2]> {
        let measured = self.measured();
        let counts = self.intervals().map(|interval| Coverage::of(&measured, interval));
        self.predicted.is_scatter_known.then_some(counts)
    }

    fn measured(&self) -> Vec<f64> {
        self.specimens.iter().map(|(_, y)| *y).collect()
    }

    fn intervals(&self) -> [[f64; 2]; 2] {
        LEVELS.map(|level| self.predicted.prediction.interval(level))
    }

    /// Probabilities under the assumption that the prediction is right: the probability of a difference of the means
    /// that is at least as large as the observed difference, and, for each interval, the probability of at least the
    /// observed number of specimens outside. The probability of a negligible difference is 1. A negligible difference
    /// is subtracted from the measurements before specimens outside are counted, so that it does not contradict the
    /// prediction either way.
    fn p_values(&self, deviation: &Deviation) -> Vec<f64> {
        let least = NEGLIGIBLE * self.predicted.prediction.mean().abs();
        let is_negligible = deviation.difference.abs() < least;
        let of_means = deviation.p_value().map(|p| if is_negligible { 1.0 } else { p });
        let mut all: Vec<f64> = of_means.into_iter().collect();
        if self.predicted.is_scatter_known {
            let removed = if is_negligible { deviation.difference } else { 0.0 };
            let judged: Vec<f64> = self.measured().iter().map(|y| y - removed).collect();
            for interval in self.intervals() {
                let Coverage { inside, total } = Coverage::of(&judged, interval);
                let prediction = &self.predicted.prediction;
                all.push(prediction.probability_outside(interval, total - inside, total));
            }
        }
        all
    }

    /// Probability of at least the observed number of specimens inside the 50 % interval, if the prediction is right.
    fn probability_of_inside(&self) -> Option<f64> {
        let [Coverage { inside, total }, _] = self.coverage()?;
        let prediction = &self.predicted.prediction;
        Some(prediction.probability_inside(prediction.interval(LEVELS[0]), inside, total))
    }
}

/// Verdict on each quantity. The probabilities of all comparisons are compared with one [`SIGNIFICANCE`], which is divided by
/// their number (Bonferroni), so that many quantities do not contradict a right prediction by chance.
pub(super) fn verdicts(all: &[Compared]) -> Vec<ValidationVerdict> {
    let p_values: Vec<Vec<f64>> = all
        .iter()
        .map(|compared| {
            compared.p_values(&compared.predicted.prediction.deviation(&compared.measured()))
        })
        .collect();
    let too_wide: Vec<Option<f64>> = all.iter().map(Compared::probability_of_inside).collect();
    let count = p_values.iter().map(Vec::len).sum::<usize>() + too_wide.iter().flatten().count();
    let limit = SIGNIFICANCE / count.max(1) as f64;
    let verdict = |(p_values, inside): (&Vec<f64>, &Option<f64>)| match p_values[..] {
        [] => ValidationVerdict::NotJudged,
        _ if p_values.iter().any(|p| *p < limit) => ValidationVerdict::Contradicted,
        _ if inside.is_some_and(|p| p < limit) => ValidationVerdict::TooWide,
        _ => ValidationVerdict::Consistent,
    };
    p_values.iter().zip(&too_wide).map(verdict).collect()
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_distr::StandardNormal;
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    /// A prediction Normal(100, 0.01² + 2²) with the given measurements.
    fn compared(measured: &[f64], is_scatter_known: bool) -> Compared {
        let means = (0..40).map(|k| 100.0 + 0.01 * f64::from(k % 3 - 1)).collect();
        let predicted =
            Predicted::new("peak_force_N", means, is_scatter_known.then(|| vec![2.0; 40]), 0.0)
                .unwrap();
        let specimens = measured.iter().enumerate().map(|(k, y)| (format!("H-{k}"), *y)).collect();
        Compared {
            validation: "held-out".to_owned(),
            column: "peak_force_N".to_owned(),
            method: "simulations",
            specimens,
            predicted,
        }
    }

    #[test]
    fn predictions_are_judged_by_means_by_outliers_and_by_width() {
        let verdict = |single: Compared| verdicts(&[single])[0];
        let usual = [98.0, 99.0, 100.5, 101.0, 102.5, 97.0];
        assert_eq!(verdict(compared(&usual, true)), ValidationVerdict::Consistent);
        let shifted = usual.map(|y| 1.06 * y);
        assert_eq!(verdict(compared(&shifted, true)), ValidationVerdict::Contradicted);
        // means agree, but all specimens are outside
        let spread = [90.0, 110.0, 91.0, 109.0];
        assert_eq!(verdict(compared(&spread, true)), ValidationVerdict::Contradicted);
        // (1/2)¹² is smaller than 0.01/4, (1/2)⁵ is not
        assert_eq!(verdict(compared(&[100.0; 12], true)), ValidationVerdict::TooWide);
        assert_eq!(verdict(compared(&[100.0; 5], true)), ValidationVerdict::Consistent);
        // without a predicted scatter, the difference of the means is compared with the scatter of the specimens; a
        // single specimen has no scatter and cannot be judged
        assert_eq!(verdict(compared(&shifted, false)), ValidationVerdict::Contradicted);
        assert_eq!(verdict(compared(&usual, false)), ValidationVerdict::Consistent);
        assert_eq!(verdict(compared(&[150.0], false)), ValidationVerdict::NotJudged);
        // a difference of 1 % is negligible, although it is many standard errors
        let [near, far] = [1.01, 1.03].map(|factor| {
            let specimens: Vec<f64> =
                (0..8).map(|k| factor * (100.0 + 0.01 * f64::from(k))).collect();
            verdict(compared(&specimens, false))
        });
        assert_eq!([near, far], [ValidationVerdict::Consistent, ValidationVerdict::Contradicted]);
    }

    /// A prediction of 100 ± 0.3. Six specimens at 101 are all outside its intervals, but their difference is negligible. Specimens
    /// at 103, and specimens that scatter by 2 % about 101, contradict it.
    #[test]
    fn a_negligible_difference_does_not_contradict_by_specimens_outside() {
        let verdict = |measured: &[f64]| {
            let means = (0..40).map(|k| 100.0 + 0.01 * f64::from(k % 3 - 1)).collect();
            let predicted =
                Predicted::new("peak_force_N", means, Some(vec![0.3; 40]), 0.0).unwrap();
            let negligible = Compared { predicted, ..compared(measured, true) };
            assert_eq!(negligible.coverage().unwrap()[1].inside, 0);
            verdicts(&[negligible])[0]
        };
        assert_eq!(verdict(&[101.0; 6]), ValidationVerdict::Consistent);
        assert_eq!(verdict(&[103.0; 6]), ValidationVerdict::Contradicted);
        let spread = [99.0, 103.0, 99.0, 103.0, 99.0, 103.0];
        assert_eq!(verdict(&spread), ValidationVerdict::Contradicted);
    }

    /// Laboratories whose parameters and specimens are drawn from the prediction: at most 1 % of them are contradicted, and
    /// likewise at most 1 % are called too wide, within the standard error of these frequencies.
    #[test]
    fn right_predictions_are_rarely_contradicted() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let mut normal = |mean: f64, sd: f64| mean + sd * rng.sample::<f64, _>(StandardNormal);
        let (laboratories, draws, shared_sd) = (600, 24, 0.7);
        let mut counts = [0_u32; 2];
        for _ in 0..laboratories {
            let means = (0..draws).map(|_| normal(20.0, 1.0)).collect();
            let middle = normal(20.0, 1.0) + normal(0.0, shared_sd);
            let measured: Vec<f64> = (0..6).map(|_| normal(middle, 2.0)).collect();
            let predicted =
                Predicted::new("peak_force_N", means, Some(vec![2.0; draws]), shared_sd).unwrap();
            match verdicts(&[Compared { predicted, ..compared(&measured, true) }])[0] {
                ValidationVerdict::Contradicted => counts[0] += 1,
                ValidationVerdict::TooWide => counts[1] += 1,
                _ => {}
            }
        }
        let n = f64::from(laboratories);
        let most = SIGNIFICANCE * n + 3.0 * (SIGNIFICANCE * (1.0 - SIGNIFICANCE) * n).sqrt();
        assert!(counts.iter().all(|count| f64::from(*count) < most), "{counts:?} {most}");
    }

    #[test]
    fn rows_have_every_column() {
        for is_known in [true, false] {
            let comparison = compared(&[98.0, 107.0], is_known);
            let rows = comparison.specimen_rows();
            assert!(rows.iter().all(|row| row.len() == Compared::SPECIMEN_COLUMNS.len()));
            let column = |name: &str, row: &[String]| {
                row[Compared::SPECIMEN_COLUMNS.iter().position(|c| *c == name).unwrap()].clone()
            };
            let expected = if is_known { ["true", "false"] } else { ["", ""] };
            assert_eq!([0, 1].map(|k| column("inside90", &rows[k])), expected);
            let summary = comparison.summary_row(ValidationVerdict::Consistent);
            assert_eq!(summary.len(), Compared::SUMMARY_COLUMNS.len());
        }
    }
}
