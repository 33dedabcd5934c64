//! Section with a verdict on the misfit of each compared quantity.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::{Misfit, QuantityMisfit, Results};

pub(super) fn collect(results: &Results) -> Option<&[QuantityMisfit]> {
    (!results.misfits.is_empty()).then_some(&results.misfits)
}

pub(super) fn show(misfits: &[QuantityMisfit]) -> Markup {
    let is_simulated = misfits.iter().any(|misfit| misfit.simulation.is_some());
    html! {
        section {
            h2 { "Does the model reproduce the specimens?" }
            (table(
                html! {
                    th { "quantity" } th { "surrogate at the MAP" } th { "threshold" } th {}
                    @if is_simulated { th { "simulation at the MAP" } th { "threshold" } th {} }
                },
                html! { @for misfit in misfits { tr {
                    td.name { (misfit.quantity) }
                    (cells(Some(misfit.surrogate)))
                    @if is_simulated { (cells(misfit.simulation)) }
                } } },
            ))
            p.caption {
                "Differences from the mean of the specimens. The threshold is three standard deviations of the \
                 difference, but at least 2 % and at most 10 %. The standard deviation includes the error of the \
                 specimens' mean and the error that all specimens share. For a simulation it also includes the scatter between \
                 microstructures. If a quantity is beyond its threshold, check the curves first (toe, zero of force and \
                 displacement, rate of the test), and then effects that [material] and [test] omit."
            }
        }
    }
}

/// Table cells with the difference, the threshold and the verdict; empty cells if there is no
/// misfit.
fn cells(misfit: Option<Misfit>) -> Markup {
    let Some(misfit) = misfit else { return html! { td {} td {} td {} } };
    let (class, verdict) = match misfit.is_poor() {
        true => ("bad", "too large"),
        false => ("good", "fits"),
    };
    html! {
        td { (format!("{:+.1} %", misfit.percent)) }
        td { (format!("± {:.1} %", misfit.threshold_percent)) }
        td { span class=(class) { (verdict) } }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_misfit_beyond_its_threshold_is_too_large() {
        let misfit = |percent| Misfit { percent, threshold_percent: 3.0 };
        let quantity = |surrogate, simulation| QuantityMisfit {
            quantity: "slope".into(),
            surrogate: misfit(surrogate),
            simulation,
        };
        let html = show(&[quantity(2.9, None), quantity(-3.1, None)]).into_string();
        assert_eq!(html.matches("class=\"good\">fits").count(), 1, "{html}");
        assert_eq!(html.matches("class=\"bad\">too large").count(), 1, "{html}");
        assert!(
            html.contains("-3.1 %</td><td>± 3.0 %") && !html.contains("simulation at"),
            "{html}"
        );
        let html = show(&[quantity(0.1, Some(misfit(4.0)))]).into_string();
        assert!(html.contains("simulation at") && html.contains("+4.0 %"), "{html}");
    }
}
