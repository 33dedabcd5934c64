//! Resolution of the numbers in a file: the unit of their last printed digit, also after a conversion of units.

/// Largest number of significant digits of numbers in scientific notation whose digits are detected.
const DIGITS: i32 = 6;
/// Relative round-off of a number with few significant digits after a conversion of units.
const ROUND_OFF: f64 = 1e-12;
/// Finest unit that is detected, as a fraction of the largest number. Numbers with more digits count as numbers with this
/// unit.
const FINEST: f64 = 1e-6;
/// Largest distance of a number from a multiple of the unit, in units.
const NEAR: f64 = 0.01;

/// Resolution of the numbers of one column.
pub(super) struct Resolution {
    /// Unit of which all numbers are multiples, such as 0.01 for numbers with two decimals.
    unit: f64,
    /// Number of significant digits, if all numbers have few.
    digits: Option<i32>,
}

impl Resolution {
    /// Detects the resolution of numbers.
    pub(super) fn of(values: &[f64]) -> Self {
        let largest = values.iter().fold(0.0, |largest: f64, value| value.abs().max(largest));
        let unit = common_unit(values, FINEST * largest).unwrap_or(FINEST * largest);
        let digits = (1..=DIGITS).find(|&digits| values.iter().all(|&x| has_digits(x, digits)));
        Self { unit, digits }
    }

    /// The unit of the last printed digit of a number.
    pub(super) fn at(&self, value: f64) -> f64 {
        self.digits.map_or(self.unit, |digits| last_digit(value, digits).max(self.unit))
    }
}

/// Unit of the last of the significant digits of a number; 0 for the number 0.
fn last_digit(value: f64, digits: i32) -> f64 {
    if value == 0.0 { 0.0 } else { 10_f64.powi(value.abs().log10().floor() as i32 + 1 - digits) }
}

fn has_digits(value: f64, digits: i32) -> bool {
    let unit = last_digit(value, digits);
    let rounded = (value / unit).round() * unit;
    value == 0.0 || (value - rounded).abs() <= ROUND_OFF * value.abs()
}

/// Largest unit of which all numbers are multiples; `None` if it is finer than `finest`.
fn common_unit(values: &[f64], finest: f64) -> Option<f64> {
    let (mut unit, mut largest) = (0.0, 0.0_f64);
    for &value in values.iter().filter(|value| **value != 0.0) {
        // Euclid's algorithm; a remainder that is much smaller than the finest unit is round-off
        let (mut greater, mut less) = (value.abs().max(unit), value.abs().min(unit));
        while less > NEAR * finest {
            let remainder = greater - (greater / less).round() * less;
            (greater, less) = (less, remainder.abs());
        }
        if greater < finest {
            return None;
        }
        // the largest number so far gives the unit with the smallest round-off
        largest = value.abs().max(largest);
        unit = largest / (largest / greater).round();
    }
    let is_multiple = |value: &f64| (value / unit - (value / unit).round()).abs() <= NEAR;
    (unit > 0.0 && values.iter().all(is_multiple)).then_some(unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn values() -> impl Iterator<Item = f64> {
        (1..400).map(|i| 150.0 * (0.37 * f64::from(i)).sin().abs() * f64::from(i) / 400.0)
    }

    #[test]
    fn decimals_are_detected_in_any_unit() {
        for factor in [1.0, 1e3, 4.448_221_615_260_5, 19.634_954, 25.4] {
            for decimals in [0, 1, 3] {
                let printed = |x: f64| format!("{x:.decimals$}").parse::<f64>().unwrap() * factor;
                let read = Resolution::of(&values().map(printed).collect::<Vec<_>>());
                let unit = 10_f64.powi(-(decimals as i32)) * factor;
                let found = read.at(1.0);
                assert!((found / unit - 1.0).abs() < 1e-6, "{factor}, {decimals}: {found}");
            }
        }
    }

    #[test]
    fn significant_digits_are_detected() {
        for digits in [3, 4] {
            let printed = |x: f64| format!("{x:.*e}", digits - 1).parse::<f64>().unwrap() * 1e3;
            let read = Resolution::of(&values().map(printed).collect::<Vec<_>>());
            let last = |power: i32| 10_f64.powi(power + 1 - digits as i32);
            assert!((read.at(1.234e5) / last(5) - 1.0).abs() < 1e-9, "{digits}");
            assert!((read.at(9.87e3) / last(3) - 1.0).abs() < 1e-9, "{digits}");
        }
    }

    #[test]
    fn numbers_with_all_digits_have_the_finest_unit() {
        let all: Vec<f64> = values().collect();
        let largest = all.iter().copied().fold(0.0, f64::max);
        assert!(Resolution::of(&all).at(70.0) <= 1.000_1e-6 * largest);
        assert_eq!(Resolution::of(&[0.0, 0.0]).at(0.0), 0.0);
    }
}
