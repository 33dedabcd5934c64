//! Formatting of numbers, data and lists in messages.

/// Largest number of values of a datum that are shown.
const SHOWN: usize = 6;
/// Largest number of items of a list that are shown.
const LISTED: usize = 4;

/// Formats a number with four or five significant digits; NaN as `–`.
pub(crate) fn cell(x: f64) -> String {
    match x.abs() {
        size if size.is_nan() => "–".into(),
        0.0 => "0".into(),
        size if !(1e-3..1e5).contains(&size) => format!("{x:.3e}"),
        size => {
            let decimals = (3 - size.log10().floor() as i32).clamp(0, 6) as usize;
            format!("{x:.decimals$}")
        }
    }
}

/// Formats a list: joins the first four items, and appends the number of omitted items.
pub(crate) fn list(items: impl IntoIterator<Item = String>) -> String {
    let items: Vec<String> = items.into_iter().collect();
    let shown = items.iter().take(LISTED).map(String::as_str).collect::<Vec<_>>().join(", ");
    match items.len().checked_sub(LISTED) {
        None | Some(0) => shown,
        Some(more) => format!("{shown} and {more} more"),
    }
}

/// Formats a datum as `y[3] = 0.7`; if it contains NaN, adds advice about missing data.
pub(crate) fn datum(name: &str, index: Option<usize>, values: &[f64]) -> String {
    let advice = match values.iter().any(|value| value.is_nan()) {
        true => format!(
            ". Where data are missing, pass them as `Option<f64>` and write `{name}.impute() ~ …`, which \
             declares the missing ones as unknowns"
        ),
        false => String::new(),
    };
    format!("{}{advice}", place_and_values(name, index, values))
}

fn place_and_values(name: &str, index: Option<usize>, values: &[f64]) -> String {
    let index = index.map_or(String::new(), |index| format!("[{index}]"));
    let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    match values {
        [value] => format!("`{name}{index}` = {value}"),
        few if few.len() <= SHOWN => format!("`{name}{index}` = [{}]", joined(few)),
        many => format!("`{name}{index}` = [{}, …]", joined(&many[..SHOWN])),
    }
}

/// Formats an optional detail as the end of a sentence, after a semicolon.
pub(crate) fn further(detail: &Option<String>) -> String {
    detail.as_ref().map_or(String::new(), |detail| format!("; {detail}"))
}

/// Describes in words how many uniform starting points and prior draws were tried.
pub(crate) fn points_tried(uniform: u32, prior: u32) -> String {
    match (uniform, prior) {
        (uniform, 0) => format!("all {uniform} initial points"),
        (0, prior) => format!("all {prior} draws from the prior"),
        (uniform, prior) => {
            format!("all {uniform} uniform initial points and {prior} draws from the prior")
        }
    }
}

pub(crate) fn first_to_fail(datum: String) -> String {
    format!("the first rejected observation is {datum}")
}

#[cfg(test)]
mod tests {
    use super::cell;

    #[test]
    fn cells_keep_four_digits() {
        assert_eq!(cell(275.1234), "275.1");
        assert_eq!(cell(0.0012345), "0.001234");
        assert_eq!(cell(-1.5e-7), "-1.500e-7");
        assert_eq!(cell(0.0), "0");
        assert_eq!(cell(f64::NAN), "–");
        assert_eq!(cell(12345.678), "12346");
    }
}
