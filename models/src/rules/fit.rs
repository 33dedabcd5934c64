//! Rule: the model at the posterior mode must reproduce the means of the specimens.

use super::rule::{Rule, Warning, qualified};
use crate::error::InputError;
use crate::pipeline::inputs::Inputs;
use crate::qoi::Quantity;
use crate::report;
use crate::report::{Qualifier, QuantityMisfit};
use crate::results_folder::error::WorkflowError;
use crate::table::{CsvTable, TableRow};

/// A misfit is poor if it exceeds this number of its standard deviations.
const DEVIATIONS: f64 = 3.0;
/// A misfit smaller than this value is never poor, %.
const NEGLIGIBLE: f64 = 2.0;
/// A misfit larger than this value is always poor, %.
const LARGEST: f64 = 10.0;

/// Column of `fit.csv` with the bound from the scatter of the sample.
const SAMPLE_BOUND: &str = "sample_bound_percent";

/// Rule on the misfit of the surrogate. The surrogate is the mean response over all microstructures of the runs.
pub(super) const AT_THE_SURROGATE: Rule =
    Rule { reads: &["calibrate"], check: |inputs| Ok(surrogate(&misfits(inputs)?)) };

/// Rule on the misfit of the simulation at the posterior mode. The simulation uses a single microstructure.
pub(super) const SIMULATED: Rule = Rule {
    reads: &["calibrate", "confirm"],
    check: |inputs| {
        // imported runs cannot be repeated at the mode
        match inputs.imports_runs() {
            true => Ok(Vec::new()),
            false => Ok(simulation(&misfits(inputs)?, &simulated(inputs)?)),
        }
    },
};

/// Misfit between the model at the posterior mode and the mean of the specimens in one quantity, %.
#[derive(Clone, Debug)]
struct Misfit {
    quantity: String,
    /// Misfit of the surrogate, %.
    percent: f64,
    /// Standard deviation of the surrogate's misfit, √((Σ/n + S)_mm) in %. Σ is the covariance between the n specimens,
    /// S the covariance of the errors that all specimens share.
    sd_percent: f64,
    /// Standard deviation of the misfit of a simulation on a single microstructure, %.
    simulation_sd_percent: f64,
    /// Bound from the scatter of the sample, %; `None` for a single specimen. The posterior of Σ, and with it `sd_percent`,
    /// is wider if there are few specimens and the model misses them.
    sample_bound_percent: Option<f64>,
}

impl Misfit {
    /// Largest misfit of the surrogate that is not poor, %: the smaller of two bounds, one from the posterior and one
    /// from the sample.
    fn threshold(&self) -> f64 {
        let of_sample = self.sample_bound_percent.unwrap_or(f64::INFINITY);
        threshold(self.sd_percent).min(of_sample.max(NEGLIGIBLE))
    }

    fn is_poor(&self) -> bool {
        self.percent.abs() > self.threshold()
    }
}

/// Whether a misfit is statistically significant, or so large that the result cannot be used.
fn is_poor(percent: f64, sd_percent: f64) -> bool {
    percent.abs() > threshold(sd_percent)
}

/// Largest misfit that is not poor, %.
fn threshold(sd_percent: f64) -> f64 {
    (DEVIATIONS * sd_percent).clamp(NEGLIGIBLE, LARGEST)
}

fn misfits(inputs: &Inputs<'_>) -> Result<Vec<Misfit>, WorkflowError> {
    let path = inputs.file("fit.csv")?;
    let columns = ["qoi", "percent_error", "sd_percent", "simulation_sd_percent", SAMPLE_BOUND];
    let table = CsvTable::read(&path, &columns)?;
    let misfit = |row: TableRow<'_>| {
        Ok(Misfit {
            quantity: quantity_name(row.text("qoi")),
            percent: row.number("percent_error")?,
            sd_percent: row.number("sd_percent")?,
            simulation_sd_percent: row.number("simulation_sd_percent")?,
            sample_bound_percent: match row.text(SAMPLE_BOUND).is_empty() {
                true => None,
                false => Some(row.number(SAMPLE_BOUND)?),
            },
        })
    };
    Ok(table.rows().map(misfit).collect::<Result<_, InputError>>()?)
}

/// Reads the misfit of the simulation at the posterior mode, %, in the order of the quantities.
fn simulated(inputs: &Inputs<'_>) -> Result<Vec<f64>, WorkflowError> {
    let path = inputs.file("confirm.csv")?;
    let table = CsvTable::read(&path, &["experiment_mean", "map_simulation"])?;
    let percent = |row: TableRow<'_>| {
        let [mean, simulation] = ["experiment_mean", "map_simulation"].map(|c| row.number(c));
        Ok(100.0 * (simulation? / mean? - 1.0))
    };
    Ok(table.rows().map(percent).collect::<Result<_, InputError>>()?)
}

/// Misfit of each compared quantity with its threshold; if `confirmed`, also the misfit of the
/// simulation.
pub(crate) fn verdicts(
    inputs: &Inputs<'_>,
    confirmed: bool,
) -> Result<Vec<QuantityMisfit>, WorkflowError> {
    let simulated = if confirmed { simulated(inputs)? } else { Vec::new() };
    let misfit =
        |percent, sd_percent| report::Misfit { percent, threshold_percent: threshold(sd_percent) };
    let verdict = |(m, misfit_of_quantity): (usize, Misfit)| QuantityMisfit {
        surrogate: report::Misfit {
            percent: misfit_of_quantity.percent,
            threshold_percent: misfit_of_quantity.threshold(),
        },
        simulation: simulated
            .get(m)
            .map(|&percent| misfit(percent, misfit_of_quantity.simulation_sd_percent)),
        quantity: misfit_of_quantity.quantity,
    };
    Ok(misfits(inputs)?.into_iter().enumerate().map(verdict).collect())
}

fn quantity_name(column: &str) -> String {
    Quantity::of_column(column).map_or_else(|| column.to_owned(), |quantity| quantity.to_string())
}

fn words(quantity: &str, percent: f64, bound: f64) -> String {
    format!("{quantity} is {percent:+.1} % from the mean of the specimens (bound {bound:.1} %)")
}

/// Returns a warning about the quantities that the surrogate does not fit.
fn surrogate(misfits: &[Misfit]) -> Vec<Warning> {
    let poor = misfits.iter().filter(|misfit| misfit.is_poor());
    let poor: Vec<String> =
        poor.map(|misfit| words(&misfit.quantity, misfit.percent, misfit.threshold())).collect();
    if poor.is_empty() {
        return Vec::new();
    }
    let text = format!(
        "The fit is poor: at the MAP {}. The calibrated values compensate an error of the curves or of the model. Check \
         the curves (toe, zero of force and displacement, rate of the test), and look for effects that [material] and \
         [test] omit.",
        poor.join(", ")
    );
    qualified(Qualifier::PoorFit, text)
}

/// Returns a warning about the quantities that the surrogate fits but the simulation does not.
fn simulation(misfits: &[Misfit], simulated: &[f64]) -> Vec<Warning> {
    let is_worse = |(misfit, percent): &(&Misfit, &f64)| {
        is_poor(**percent, misfit.simulation_sd_percent) && !misfit.is_poor()
    };
    let poor = misfits.iter().zip(simulated).filter(is_worse);
    let poor: Vec<String> = poor
        .map(|(misfit, percent)| {
            words(&misfit.quantity, *percent, threshold(misfit.simulation_sd_percent))
        })
        .collect();
    if poor.is_empty() {
        return Vec::new();
    }
    let text = format!(
        "The fit is poor: in the simulation at the MAP {}, although the surrogate fits. The surrogate is \
         inaccurate at the MAP (surrogate_orders.csv), or the microstructure of the case differs from the specimens.",
        poor.join(", ")
    );
    qualified(Qualifier::PoorFit, text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misfit_is_poor_beyond_three_deviations_two_percent_and_ten() {
        // 3 sd = 4.5 %
        assert!(!is_poor(4.49, 1.5) && is_poor(4.51, 1.5) && is_poor(-4.51, 1.5));
        // 3 sd = 0.3 %, which is negligible
        assert!(!is_poor(1.99, 0.1) && is_poor(2.01, 0.1));
        // 3 sd = 24 %: a misfit of 10 % is always too large, even if the mean is this uncertain
        assert!(!is_poor(9.99, 8.0) && is_poor(10.01, 8.0) && is_poor(-10.01, 8.0));
    }

    fn misfit(percent: f64) -> Misfit {
        let quantity = "slope".to_owned();
        let sample_bound_percent = Some(20.0);
        Misfit {
            quantity,
            percent,
            sd_percent: 1.0,
            simulation_sd_percent: 2.0,
            sample_bound_percent,
        }
    }

    /// Five specimens whose mean has a standard error of 1.06 %: the misfit of −7.1 % widens the posterior of Σ to an sd of
    /// 3.66 %, so that the bound of the posterior is above the misfit.
    #[test]
    fn a_misfit_that_widens_the_scatter_is_found_by_the_sample() {
        let few = |sample_bound_percent| Misfit {
            sd_percent: 3.66,
            sample_bound_percent,
            ..misfit(-7.1)
        };
        assert!(!few(None).is_poor() && !few(Some(7.2)).is_poor() && few(Some(7.0)).is_poor());
        let warnings = surrogate(&[few(Some(4.9))]);
        assert!(warnings[0].text.contains("(bound 4.9 %)"), "{warnings:?}");
        // a misfit below 2 % is negligible
        assert!(!Misfit { sample_bound_percent: Some(0.5), ..misfit(1.9) }.is_poor());
    }

    /// Misfits in reported cases: 20.3 % for a toe of 0.02 mm that was not removed, 13.7 % for a load cell with an
    /// offset of −20 N.
    #[test]
    fn poor_fits_are_named_with_their_bound_and_qualify_the_result() {
        for percent in [20.3, 13.7, -3.1] {
            let warnings = surrogate(&[misfit(0.2), misfit(percent)]);
            assert_eq!(warnings.len(), 1);
            assert_eq!(warnings[0].qualifier, Some(Qualifier::PoorFit));
            let part =
                format!("slope is {percent:+.1} % from the mean of the specimens (bound 3.0 %)");
            assert!(warnings[0].text.contains(&part), "{warnings:?}");
        }
        assert!(surrogate(&[misfit(0.2), misfit(2.9)]).is_empty());
    }

    /// A simulation uses a single microstructure and therefore deviates from the surrogate, which is the mean response.
    #[test]
    fn a_simulation_may_be_off_by_what_its_microstructure_scatters() {
        assert!(simulation(&[misfit(0.2)], &[5.9]).is_empty());
        let warnings = simulation(&[misfit(0.2)], &[6.1]);
        assert!(warnings[0].text.contains("although the surrogate fits"), "{warnings:?}");
        // the rule on the surrogate already warns of this quantity
        assert!(simulation(&[misfit(7.0)], &[7.0]).is_empty());
    }
}
