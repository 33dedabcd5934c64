//! Held-out measurements with their predictions: the rows of `validation.csv`, and scores over several rows.

use super::{Coverage, Prediction};

/// Levels of the predictive intervals in a table of held-out measurements.
pub const LEVELS: [f64; 2] = [0.5, 0.9];

/// A held-out measurement and its prediction.
///
/// # Example
/// ```
/// use breccia_calibration::{HeldOutValue, HeldOutScores, Prediction};
///
/// let prediction = Prediction::new(vec![10.0, 10.2], vec![0.5; 2], 0.0)?;
/// let value = |specimen, measured| HeldOutValue {
///     validation: "slow",
///     quantity: "peak_force_N",
///     specimen,
///     measured,
///     prediction: &prediction,
/// };
/// let values = [value("S-1", 10.3), value("S-2", 12.0)];
/// print!("{}", HeldOutValue::csv(&values));
/// let scores = HeldOutScores::of(&values);
/// assert_eq!((scores.inside90.inside, scores.inside90.total), (1, 2));
/// # Ok::<(), breccia_calibration::PredictionError>(())
/// ```
#[derive(Clone, Copy, Debug)]
pub struct HeldOutValue<'a> {
    /// Name of the validation.
    pub validation: &'a str,
    /// Column of the quantity.
    pub quantity: &'a str,
    /// Name of the specimen.
    pub specimen: &'a str,
    /// Measured value.
    pub measured: f64,
    /// Predictive distribution of the quantity.
    pub prediction: &'a Prediction,
}

impl HeldOutValue<'_> {
    /// Columns of `validation.csv`.
    pub const COLUMNS: [&'static str; 13] = [
        "validation",
        "qoi",
        "specimen",
        "measured",
        "median",
        "q05",
        "q25",
        "q75",
        "q95",
        "inside50",
        "inside90",
        "pit",
        "crps",
    ];

    /// Cells of the row, in the order of [`HeldOutValue::COLUMNS`].
    pub fn cells(&self) -> [String; 13] {
        let Self { validation, quantity, specimen, measured, prediction } = *self;
        let [narrow, wide] = LEVELS.map(|level| prediction.interval(level));
        let number = |x: f64| x.to_string();
        let is_inside = |[low, high]: [f64; 2]| (low..=high).contains(&measured).to_string();
        [
            validation.to_owned(),
            quantity.to_owned(),
            specimen.to_owned(),
            number(measured),
            number(prediction.quantile(0.5)),
            number(wide[0]),
            number(narrow[0]),
            number(narrow[1]),
            number(wide[1]),
            is_inside(narrow),
            is_inside(wide),
            number(prediction.pit(measured)),
            number(prediction.crps(measured)),
        ]
    }

    /// Text of `validation.csv`: a line of columns and a line per value. Names must not contain commas.
    pub fn csv(values: &[Self]) -> String {
        let rows = values.iter().map(|value| value.cells().join(",") + "\n");
        std::iter::once(Self::COLUMNS.join(",") + "\n").chain(rows).collect()
    }
}

/// Scores of several held-out measurements.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HeldOutScores {
    /// Measurements inside their 50 % intervals.
    pub inside50: Coverage,
    /// Measurements inside their 90 % intervals.
    pub inside90: Coverage,
    /// Mean of the continuous ranked probability scores; NaN without measurements.
    pub mean_crps: f64,
}

impl HeldOutScores {
    /// Computes the scores of some measurements, each with its own prediction.
    pub fn of(values: &[HeldOutValue<'_>]) -> Self {
        let total = values.len();
        let [inside50, inside90] = LEVELS.map(|level| {
            let is_inside = |value: &&HeldOutValue<'_>| {
                let [low, high] = value.prediction.interval(level);
                (low..=high).contains(&value.measured)
            };
            Coverage { inside: values.iter().filter(is_inside).count(), total }
        });
        let sum: f64 = values.iter().map(|value| value.prediction.crps(value.measured)).sum();
        Self { inside50, inside90, mean_crps: sum / total as f64 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The prediction is the standard normal distribution: quantiles, PIT and CRPS are known (Gneiting & Raftery 2007: the
    /// score of Normal(0, 1) is y (2Φ(y) − 1) + 2φ(y) − 1/√π).
    #[test]
    fn a_row_has_the_statistics_of_its_prediction() {
        let prediction = Prediction::new(vec![0.0; 2], vec![1.0; 2], 0.0).unwrap();
        let value = |specimen, measured| HeldOutValue {
            validation: "v",
            quantity: "q",
            specimen,
            measured,
            prediction: &prediction,
        };
        let values = [value("a", 0.0), value("b", 1.0), value("c", 2.0)];
        let cells = values[1].cells();
        let numbers: Vec<f64> =
            [4, 5, 6, 7, 8, 11, 12].iter().map(|&i| cells[i].parse().unwrap()).collect();
        let phi = 0.841_344_746_068_543;
        let density = (-0.5_f64).exp() / (2.0 * std::f64::consts::PI).sqrt();
        let crps = 2.0 * phi - 1.0 + 2.0 * density - 1.0 / std::f64::consts::PI.sqrt();
        let expected =
            [0.0, -1.644_853_627, -0.674_489_750, 0.674_489_750, 1.644_853_627, phi, crps];
        for (number, expected) in numbers.iter().zip(expected) {
            assert!((number - expected).abs() < 1e-8, "{number} {expected}");
        }
        assert_eq!([&*cells[9], &*cells[10]], ["false", "true"]);
        let scores = HeldOutScores::of(&values);
        assert_eq!([scores.inside50.inside, scores.inside90.inside], [1, 2]);
        let mean = values.iter().map(|value| prediction.crps(value.measured)).sum::<f64>() / 3.0;
        assert_eq!((scores.inside90.total, scores.mean_crps), (3, mean));
        let text = HeldOutValue::csv(&values);
        assert_eq!(text.lines().count(), 4);
        assert!(
            text.starts_with("validation,qoi,specimen,measured,median,q05,")
                && text.contains("\nv,q,b,1,")
        );
    }
}
