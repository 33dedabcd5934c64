//! The page: one self-contained HTML file.

use maud::{DOCTYPE, Markup, PreEscaped, html};
use ppl::diagnostics::Identification;

use super::results::{CalibratedParameter, PictureContent, Results, Verdict, mean};
use super::{data_uri, figures};

const STYLE: &str = include_str!("style.css");

/// The report as HTML, figures inline.
pub(crate) fn page(results: &Results) -> String {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (results.title) }
                style { (PreEscaped(STYLE)) }
            }
            body {
                main {
                    h1 { (results.title) }
                    (answer(results))
                    (warnings(results))
                    (specimen(results))
                    (curves(results))
                    (surrogate(results))
                    (posterior(results))
                    (confirmation(results))
                    (details(results))
                }
            }
        }
    }
    .into_string()
}

fn answer(results: &Results) -> Markup {
    let with_truth = results.parameters.iter().any(|p| p.truth.is_some());
    html! {
        section {
            h2 { "Calibrated parameters" }
            table {
                thead {
                    tr {
                        th { "parameter" } th { "MAP" } th { "mean ± sd" } th { "90 % interval" }
                        th { "prior" } th { "contraction" } th { "from the data" }
                        @if with_truth { th { "truth" } }
                    }
                }
                tbody {
                    @for p in &results.parameters {
                        tr {
                            td.name { (p.label) }
                            td { (number(p.map)) }
                            td { (number(p.mean)) " ± " (number(p.sd)) }
                            td { (number(p.q05)) " … " (number(p.q95)) }
                            td { (number(p.prior.0)) " … " (number(p.prior.1)) }
                            td { (format!("{:.2}", p.contraction)) }
                            td { (verdict(p)) }
                            @if with_truth { td { @if let Some(t) = p.truth { (number(t)) } } }
                        }
                    }
                }
            }
            p.caption {
                "Contraction is 1 − posterior variance / prior variance: 0 where the data taught \
                 nothing, 1 where they fixed the parameter. MAP is the joint mode over the \
                 constrained parameters; for a parameter that is not identified it is as good as \
                 any other point of its posterior."
            }
        }
    }
}

fn verdict(p: &CalibratedParameter) -> Markup {
    let identified = p.verdict() == Verdict::Learnt(Identification::Identified);
    let class = if identified { "verdict good" } else { "verdict weak" };
    html! { span class=(class) { (p.verdict()) } }
}

fn warnings(results: &Results) -> Markup {
    html! {
        section {
            h2 { "What to know before using them" }
            @if results.warnings.is_empty() {
                p.good { "The sampler found nothing to warn about." }
            } @else {
                ul.warnings { @for text in &results.warnings { li { (text) } } }
            }
            @if !results.notes.is_empty() {
                ul { @for text in &results.notes { li { (text) } } }
            }
        }
    }
}

fn specimen(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Specimen" }
            @for picture in &results.pictures {
                figure {
                    @match &picture.content {
                        PictureContent::Svg(svg) => { (PreEscaped(svg)) }
                        PictureContent::Png(bytes) => {
                            img src=(data_uri::of_png(bytes)) alt=(picture.caption);
                        }
                    }
                }
                p.caption { (picture.caption) }
            }
            @if !results.image_facts.is_empty() {
                h3 { "Image" }
                (facts(&results.image_facts))
                h3 { "Mesh" }
            }
            (facts(&results.mesh_facts))
        }
    }
}

fn curves(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Curves and quantities of interest" }
            figure { (PreEscaped(figures::curves(results))) }
            p.caption {
                (results.ensemble.len()) " simulated tests over the prior box ("
                (format!("{:.0}", results.ensemble_seconds)) " s of processor time), "
                (results.experiments.len()) " measured ones. The ensemble has to bound the \
                experiments."
            }
            @if !results.failures.is_empty() {
                p { "Runs that failed and are left out:" }
                ul { @for (id, reason) in &results.failures { li { "run " (id) ": " (reason) } } }
            }
            figure { (PreEscaped(figures::qois(results))) }
            p.caption {
                "Bars: ensemble. Dots: experiments; dashed: their mean. Red: simulation at the MAP."
            }
        }
    }
}

fn surrogate(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Surrogate" }
            p { "Polynomial chaos of order " strong { (results.chosen_order) } ": "
                (results.order_rule) }
            figure { (PreEscaped(figures::orders(results))) }
            p.caption {
                "Errors relative to the variance of each quantity, averaged over them. Orders \
                 with more terms than runs are not estimable."
            }
            table {
                thead { tr {
                    th { "total Sobol index" }
                    @for p in &results.parameters { th { (p.label) } }
                    @for name in &results.known_inputs { th { (name) } }
                } }
                tbody { @for qoi in &results.qois { tr {
                    td.name { (qoi.label) }
                    @for s in &qoi.sobol_total { td { (format!("{s:.3}")) } }
                } } }
            }
            p.caption { "Fraction of each quantity's variance over the prior box that involves the \
                         parameter: a parameter with small indices cannot be identified." }
        }
    }
}

fn posterior(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Posterior" }
            figure { (PreEscaped(figures::pairs(&results.parameters))) }
            p.caption {
                "Axes span the prior box. Diagonal: posterior (red) and prior (dashed), MAP \
                 dotted. Below: contours that enclose 10, 50 and 90 % of the mass. Above: draws. "
                @if results.parameters.iter().any(|p| p.truth.is_some()) {
                    "Green: the truth of the virtual specimens."
                }
            }
            figure { (PreEscaped(figures::traces(&results.parameters))) }
            p.caption { "Draws in order, one colour a chain." }
            @if let Some((header, rows)) = results.summary.split_first() {
                table.small {
                    thead { tr { @for cell in header { th { (cell) } } } }
                    tbody { @for row in rows { tr {
                        @for (i, cell) in row.iter().enumerate() {
                            @if i == 0 { td.name { (cell) } } @else { td { (cell) } }
                        }
                    } } }
                }
            }
        }
    }
}

fn confirmation(results: &Results) -> Markup {
    html! {
        section {
            h2 { "Confirming simulation" }
            figure { (PreEscaped(figures::confirmation(results))) }
            table {
                thead { tr {
                    th { "quantity" } th { "experimental mean" } th { "simulation at the MAP" }
                    th { "error" }
                } }
                tbody { @for qoi in &results.qois { tr {
                    td.name { (qoi.label) }
                    td { (number(mean(&qoi.experiments))) }
                    td { (number(qoi.map)) }
                    td { (format!("{:.2} %", qoi.percent_error)) }
                } } }
            }
        }
    }
}

fn details(results: &Results) -> Markup {
    html! {
        section {
            h2 { "How it was made" }
            (facts(&results.settings))
            details {
                summary { "The case file, with every default filled in" }
                pre { (results.case_toml) }
            }
        }
    }
}

fn facts(pairs: &[(String, String)]) -> Markup {
    html! {
        table.facts { tbody {
            @for (name, value) in pairs { tr { td.name { (name) } td { (value) } } }
        } }
    }
}

/// Four significant digits, scientific where that is shorter to read.
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

#[cfg(test)]
mod tests {
    use super::number;

    #[test]
    fn four_digits() {
        assert_eq!(number(275.0), "275.0");
        assert_eq!(number(0.0025), "0.002500");
        assert_eq!(number(-1.0), "-1.000");
        assert_eq!(number(22000.0), "22000");
        assert_eq!(number(0.000_01), "1.000e-5");
        assert_eq!(number(0.0), "0");
    }
}
