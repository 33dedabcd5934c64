//! Number of digits with which numbers are shown.

/// Formats a number with four significant digits; in scientific notation for very small or large numbers.
pub(crate) fn number(x: f64) -> String {
    let magnitude = x.abs();
    if x == 0.0 || !x.is_finite() {
        return x.to_string();
    }
    if !(1e-3..1e5).contains(&magnitude) {
        return format!("{x:.3e}");
    }
    let decimals = (3 - magnitude.log10().floor() as i32).max(0) as usize;
    format!("{x:.decimals$}")
}

/// Formats a number with the digits that its error supports: the error is at most five units of the last digit. Four
/// significant digits if the error is unknown; at most six in all cases.
pub(super) fn within((x, error): (f64, f64)) -> String {
    if !x.is_finite() {
        return "–".to_owned();
    }
    if !(error.is_finite() && error > 0.0) {
        return number(x);
    }
    // decimal place of the last digit, as a power of ten
    let last = (2.0 * error).log10().floor() as i32;
    let first = if x == 0.0 { last } else { x.abs().log10().floor() as i32 };
    let last = last.max(first - 5);
    if last > 0 && first < 5 {
        // whole numbers are easier to read than scientific notation
        let unit = 10f64.powi(last);
        return format!("{:.0}", (x / unit).round() * unit);
    }
    if !(-4..5).contains(&first) {
        let decimals = (first - last).max(0) as usize;
        return format!("{x:.decimals$e}");
    }
    let decimals = (-last).max(0) as usize;
    let text = format!("{x:.decimals$}");
    match text.strip_prefix('-') {
        Some(zero) if zero.bytes().all(|c| matches!(c, b'0' | b'.')) => zero.to_owned(),
        _ => text,
    }
}

/// Formats a number of the case: all its digits, unless four significant digits are shorter.
pub(super) fn plain(x: f64) -> String {
    let (short, whole) = (number(x), x.to_string());
    if whole.len() <= short.len() { whole } else { short }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn four_digits() {
        assert_eq!(number(275.0), "275.0");
        assert_eq!(number(0.0025), "0.002500");
        assert_eq!(number(-1.0), "-1.000");
        assert_eq!(number(22000.0), "22000");
        assert_eq!(number(0.000_01), "1.000e-5");
        assert_eq!(number(0.0), "0");
    }

    #[test]
    fn the_error_is_at_most_five_units_of_the_last_digit_shown() {
        assert_eq!(within((283.4567, 0.08)), "283.5");
        assert_eq!(within((283.4567, 0.49)), "283.5");
        assert_eq!(within((283.4567, 0.51)), "283");
        assert_eq!(within((283.4567, 12.0)), "280");
        assert_eq!(within((0.298_34, 1.2e-4)), "0.2983");
        assert_eq!(within((0.002_503, 2.3e-5)), "0.00250");
        assert_eq!(within((2.503e-5, 2.3e-7)), "2.50e-5");
        assert_eq!(within((0.0, 0.004)), "0.000");
        assert_eq!(within((-0.4321, 0.004)), "-0.432");
        assert_eq!(within((-0.002, 0.02)), "0.00", "zero has no sign");
        assert_eq!(within((283.4567, 1e-12)), "283.457");
        assert_eq!(within((283.4567, f64::NAN)), "283.5");
        assert_eq!(within((f64::NAN, 0.1)), "–");
    }
}
