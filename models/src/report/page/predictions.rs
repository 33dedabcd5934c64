//! Section that compares predictions for a new specimen with the experiments.

use maud::{Markup, html};

use super::parts::{figure, panels, table};
use crate::report::figures;
use crate::report::results::{BandEnd, LeftOut, MOST_SHIFT, PredictedBand, Results};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    let is_predicted = results.qois.iter().any(|qoi| !qoi.predictive.is_empty())
        || results.predicted_curves.is_some()
        || !results.loo.is_empty();
    (!results.parameters.is_empty() && is_predicted).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let predicted = figures::predictive(results);
    let curves = figures::predicted(results);
    html! {
        section {
            h2 { "Prediction against experiment" }
            @if let Some(svg) = &curves {
                (figure(svg, html! {
                    "Predicted curve of a new specimen: at each displacement the bands contain 50 and 90 % of the \
                     predictions. Height and width are drawn from the posterior, with the scatter between \
                     specimens and the error that all specimens share. The shape comes from the runs, at the same parameters, with \
                     the scatter of the experiments' shapes. Dashed: the experiments. "
                    @if let Some(band) = &results.predicted_curves { (end_of(band)) }
                }, "experiments outside the 90 % band differ from the others or from the model: check the leave-one-out \
                    table below and the misfits."))
            }
            @if !predicted.is_empty() {
                (panels(&predicted, html! {
                    "Bars: predictions for a new specimen, 99 % of the draws. Outline and dots: the \
                     experiments; dashed: their mean."
                }, "for dots in the tails of the bars, see above. If the bars are far wider than the dots, the shared error of \
                    surrogate and mesh dominates: see where the uncertainty comes from."))
            }
            (left_out(&results.loo))
        }
    }
}

/// Sentences on where the band ends, and why.
fn end_of(band: &PredictedBand) -> Markup {
    let last_mm = band.displacement_mm.last().copied().unwrap_or(0.0);
    html! {
        "The band ends at " (format!("{last_mm:.3}")) " mm, which nine of ten predicted curves reach. "
        @match &band.end {
            Some(BandEnd { percent, shortest: Some(curve) }) => {
                "Shapes are known up to " (percent) " % of the displacement at peak, because " (curve)
                " ends there. Curves that end later (test.displacement_mm, test.stop_below_peak, or the \
                 measurement) lengthen the band."
            }
            Some(BandEnd { percent, shortest: None }) => {
                "Shapes are not compared beyond " (percent) " % of the displacement at peak."
            }
            None => {}
        }
    }
}

/// Table of leave-one-out predictions of the specimens.
fn left_out(loo: &[LeftOut]) -> Markup {
    if loo.is_empty() {
        return html! {};
    }
    let total: f64 = loo.iter().map(|one| one.elpd).sum();
    let sampled = loo.iter().filter(|one| one.is_sampled).count();
    html! {
        h3 { "Leave-one-out cross-validation" }
        (table(
            html! {
                th { "specimen" } th { "log predictive density" } th { "Pareto k̂" }
                th { "largest shift, sd" } th.text { "parameter" } th {}
            },
            html! {
                @for one in loo { tr {
                    td.name { (one.specimen) }
                    td { (format!("{:.2}", one.elpd)) }
                    td { (format!("{:.2}", one.pareto_k)) }
                    @if let Some((parameter, shift)) = &one.moved {
                        td { (format!("{shift:+.2}")) }
                        td.name { (parameter) }
                        td { @if shift.abs() > MOST_SHIFT { span.verdict.weak { "check" } } }
                    } @else { td {} td {} td {} }
                } }
                tr { td.name { "all" } td { (format!("{total:.2}")) } td {} td {} td {} td {} }
            },
        ))
        p.caption {
            "A specimen whose density is far below the other densities differs from the other specimens. The shift is the \
             change of a parameter's posterior mean if the specimen is removed, in posterior standard deviations. "
            @if sampled == 0 {
                "Computed by Pareto-smoothed importance weights (PSIS-LOO)."
            } @else {
                "Computed by Pareto-smoothed importance weights (PSIS-LOO), or by a calibration without the specimen \
                 if k̂ is too large for the weights (" (sampled) " of " (loo.len()) ")."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn left(shift: f64, is_sampled: bool) -> LeftOut {
        LeftOut {
            specimen: "V-01".into(),
            elpd: 4.25,
            pareto_k: 0.9,
            moved: Some(("E (MPa)".into(), shift)),
            is_sampled,
        }
    }

    #[test]
    fn a_specimen_that_moves_a_parameter_is_marked_whatever_its_k() {
        let html = left_out(&[left(-0.99, true), left(-1.01, true)]).into_string();
        assert_eq!(html.matches(">check<").count(), 1, "{html}");
        assert!(html.contains("8.50"), "the sum: {html}");
        assert!(html.contains("(2 of 2)"), "{html}");
        assert!(
            left_out(&[left(0.3, false)])
                .into_string()
                .contains("Computed by Pareto-smoothed importance weights (PSIS-LOO).")
        );
        assert_eq!(left_out(&[]).into_string(), "");
    }

    #[test]
    fn the_end_of_the_band_has_its_reason() {
        let end = Some(BandEnd { percent: 115, shortest: Some("curves/run-004.csv".into()) });
        let band = PredictedBand { displacement_mm: vec![0.0, 0.1234], end, ..Default::default() };
        let text = end_of(&band).into_string();
        assert!(text.contains("ends at 0.123 mm") && text.contains("115 %"), "{text}");
        assert!(text.contains("because curves/run-004.csv ends there"), "{text}");
        let end = Some(BandEnd { percent: 195, shortest: None });
        let text = end_of(&PredictedBand { end, ..band }).into_string();
        assert!(text.contains("not compared beyond 195 %") && !text.contains("because"), "{text}");
    }
}
