//! Section on the simulations at the posterior mode: curves and quantities.

use maud::{Markup, html};

use super::parts::{figure, panels, table};
use crate::report::digits::number;
use crate::report::figures;
use crate::report::results::{Results, mean};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    (results.is_confirmed || !results.map_curve.is_empty()).then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let with_mesh = results.qois.iter().any(|qoi| qoi.mesh_error_percent.is_some());
    html! {
        section {
            h2 { "Confirming simulation" }
            @if !results.map_curve.is_empty() {
                (figure(&figures::confirmation(results), html! {
                    @if results.baseline_curve.is_some() {
                        "Baseline: simulation with the materials of the case, before calibration. "
                    }
                    "MAP: simulation (not surrogate) with the calibrated parameters."
                }, "if the curve at the MAP differs from the experiments although the misfit above is small, the compared \
                    quantities do not depend on that part of the curve: calibrate with likelihood = \"curve\"."))
            }
            (table(
                html! {
                    th { "quantity" } th { "experimental mean" } th { "simulation at the MAP" }
                    th { "difference" }
                    @if with_mesh { th { "estimated error of the mesh" } }
                },
                html! { @for qoi in &results.qois { tr {
                    td.name { (qoi.label) }
                    td { (number(mean(&qoi.experiments))) }
                    td { (number(qoi.map)) }
                    td { (format!("{:.2} %", qoi.percent_error)) }
                    @if with_mesh {
                        td { @if let Some(e) = qoi.mesh_error_percent { (format!("{e:+.1} %")) } }
                    }
                } } },
            ))
            (panels(&figures::map_beside_experiments(results), html! {
                "Outline and dots: experiments; dashed: their mean. Red: simulation at the MAP."
            }, "a red line outside the dots is a misfit: see the threshold and the advice at the table of misfits."))
        }
    }
}
