//! Proposals for an extended prior, if the prior truncates the posterior.

use ppl::Univariate;
use ppl::diagnostics::Identifiability;
use surrogate::Input;

use crate::prior::Prior;

/// Number of quantiles that represent a prior.
const QUANTILES: u32 = 1000;

/// Returns a warning for each parameter whose posterior is truncated at a bound of the prior. The warning states the
/// entry of the case that adds `runs` runs beyond the bound to the existing runs; if `can_extend` is false, the
/// warning contains no entry, because the source of the runs cannot compute further runs. `draws` returns the
/// posterior draws of a parameter.
pub(crate) fn offers(
    inputs: &[Input],
    priors: &[Prior],
    draws: &dyn Fn(&str) -> Vec<f64>,
    runs: usize,
    can_extend: bool,
) -> Vec<String> {
    let offer = |(Input { name, lower, upper }, prior): (&Input, &Prior)| {
        let at = |i| prior.quantile((f64::from(i) + 0.5) / f64::from(QUANTILES));
        let before: Vec<f64> = (0..QUANTILES).map(at).collect();
        let bounds = Some((*lower, *upper));
        let row = Identifiability::of_draws(name.as_str(), &before, &draws(name), bounds);
        if !row.truncated() {
            return None;
        }
        let width = upper - lower;
        // the bound that is closer to the posterior mean truncates the posterior
        let is_upper = row.posterior[0] - lower > upper - row.posterior[0];
        let (word, bound, [from, to]) = match is_upper {
            true => ("upper", upper, [*upper, upper + width]),
            // material constants are positive, so that the extended range must stay above zero
            false if *lower >= 0.0 => ("lower", lower, [(lower - width).max(0.5 * lower), *lower]),
            false => ("lower", lower, [lower - width, *lower]),
        };
        let [from, to] = [from, to].map(shown);
        if !can_extend {
            return Some(format!(
                "the prior truncates the posterior of {name} at its {word} bound {bound}; to extend the prior, import \
                 runs from {from} to {to}, too, and widen the prior"
            ));
        }
        let written =
            format!("extend = [{{ runs = {runs}, prior = {{ {name} = [{from}, {to}] }} }}]");
        Some(format!(
            "the prior truncates the posterior of {name} at its {word} bound {bound}; to extend the prior beyond this bound \
             with {runs} further runs and keep the existing runs, write at the top of the case: {written}"
        ))
    };
    inputs.iter().zip(priors).filter_map(offer).collect()
}

/// Formats a bound as TOML, rounded so that the rounding error of a sum is not shown.
fn shown(x: f64) -> String {
    let digits = 10f64.powi(9 - x.abs().max(1e-12).log10().floor() as i32);
    format!("{:?}", (x * digits).round() / digits)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn draws_that_pile_up_at_a_bound_are_offered_what_lies_beyond() {
        let prior = [
            Input::new("matrix.young_mpa", 250.0, 300.0).unwrap(),
            Input::new("matrix.viscosity_mpa_s", 0.05, 0.55).unwrap(),
            Input::new("matrix.toughness_n_per_mm", 0.001, 0.005).unwrap(),
        ];
        let draws = |low: f64, high: f64, power: f64| -> Vec<f64> {
            (0..1000).map(|i| low + (high - low) * (f64::from(i) / 999.0).powf(power)).collect()
        };
        let after = |name: &str| match name {
            // posterior truncated at the upper bound, in the middle of the prior, and uniform over the prior
            "matrix.young_mpa" => draws(250.0, 300.0, 0.05),
            "matrix.viscosity_mpa_s" => draws(0.2, 0.3, 1.0),
            _ => draws(0.001, 0.005, 1.0),
        };
        let offers = offers(&prior, &Prior::uniform_on(&prior), &after, 100, true);
        assert_eq!(offers.len(), 1, "{offers:?}");
        let written = "extend = [{ runs = 100, prior = { matrix.young_mpa = [300.0, 350.0] } }]";
        assert!(
            offers[0].contains("upper bound 300;") && offers[0].ends_with(written),
            "{offers:?}"
        );
        assert_eq!((shown(0.35 + 0.3), shown(300.0 + 50.0)), ("0.65".into(), "350.0".into()));
    }
}
