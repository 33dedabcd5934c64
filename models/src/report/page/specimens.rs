//! Table of the specimens.

use maud::{Markup, html};

use super::parts::table;
use crate::report::digits::{number, plain};
use crate::report::results::{Results, SpecimenFacts, mean};

/// The specimens with the names of their quantities.
pub(super) struct Specimens<'a> {
    labels: Vec<&'a str>,
    specimens: &'a [SpecimenFacts],
}

pub(super) fn collect(results: &Results) -> Option<Specimens<'_>> {
    let labels = results.qois.iter().map(|qoi| qoi.label.as_str()).collect();
    (!results.specimens.is_empty()).then_some(Specimens { labels, specimens: &results.specimens })
}

pub(super) fn show(Specimens { labels, specimens }: &Specimens<'_>) -> Markup {
    let with_size = specimens.iter().any(|specimen| specimen.size_mm.is_some());
    let column = |m: usize| {
        let values = specimens.iter().map(|s| s.values[m]);
        values.filter(|value| !value.is_nan()).collect::<Vec<f64>>()
    };
    let cell = |value: f64| if value.is_nan() { "–".to_owned() } else { number(value) };
    let deviation = |values: &[f64]| match values.len() {
        0 | 1 => "–".to_owned(),
        _ => format!("{:.1} %", deviation_percent(values)),
    };
    let lacks = specimens.iter().flat_map(|s| &s.values).any(|value| value.is_nan());
    html! {
        section {
            h2 { "Specimens" }
            (table(
                html! {
                    th { "specimen" } th.text { "group" }
                    @if with_size { th { "height (mm)" } th { "radius (mm)" } }
                    @for label in labels { th { (label) } }
                },
                html! {
                    @for specimen in *specimens { tr {
                        td.name { (specimen.id) } td.name { (specimen.group) }
                        @if with_size {
                            @for size in specimen.size_mm.unwrap_or([f64::NAN; 2]) { td { (plain(size)) } }
                        }
                        @for value in &specimen.values { td { (cell(*value)) } }
                    } }
                    tr {
                        td.name { "mean" } td {} @if with_size { td {} td {} }
                        @for m in 0..labels.len() { td { (number(mean(&column(m)))) } }
                    }
                    @if specimens.len() > 1 { tr {
                        td.name { "standard deviation" } td {} @if with_size { td {} td {} }
                        @for m in 0..labels.len() { td { (deviation(&column(m))) } }
                    } }
                },
            ))
            @if with_size { p.caption {
                "Quantities are scaled to the size of the mesh, as in the likelihood. Compressive force and shortening \
                 are positive."
            } }
            @if lacks { p.caption {
                "–: the specimen lacks the quantity. The likelihood uses its other quantities; means and standard \
                 deviations are over the specimens that have the quantity."
            } }
        }
    }
}

/// Standard deviation between specimens, in % of their mean.
fn deviation_percent(values: &[f64]) -> f64 {
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean).powi(2)).sum();
    100.0 * (squares / (values.len() as f64 - 1.0)).sqrt() / mean.abs()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::Qoi;

    #[test]
    fn every_specimen_has_a_row_and_their_mean_and_deviation_follow() {
        let specimen = |id: &str, value| SpecimenFacts {
            id: id.into(),
            group: "A".into(),
            size_mm: Some([4.4, 2.5]),
            values: vec![value],
        };
        let qoi = Qoi { label: "peak force (N)".into(), ..Qoi::default() };
        let results = Results {
            qois: vec![qoi],
            specimens: vec![specimen("S-1", 90.0), specimen("S-2", 110.0)],
            ..Results::default()
        };
        let html = collect(&results).map(|table| show(&table).into_string()).unwrap_or_default();
        for part in ["S-1", "S-2", "peak force (N)", ">4.4</td><td>2.5</td>"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        // sample standard deviation of 90 and 110: √200 = 14.1
        assert!(html.contains("<td>14.1 %</td>"), "{html}");
        assert!(!html.contains("lacks"), "{html}");
        let lacking = Results {
            specimens: [results.specimens.clone(), vec![specimen("S-3", f64::NAN)]].concat(),
            ..results
        };
        let html = collect(&lacking).map(|table| show(&table).into_string()).unwrap_or_default();
        assert!(html.contains("<td>–</td>") && html.contains("<td>14.1 %</td>"), "{html}");
        assert!(html.contains("lacks the quantity") && !html.contains("NaN"), "{html}");
        assert!(collect(&Results::default()).is_none());
        let results = Results {
            specimens: vec![SpecimenFacts { id: "beam".into(), ..SpecimenFacts::default() }],
            ..Results::default()
        };
        let html = collect(&results).map(|table| show(&table).into_string()).unwrap_or_default();
        assert!(html.contains("beam") && !html.contains("height"), "{html}");
    }
}
