//! Sections on the simulations at the posterior mode: curves, quantities, damage.

use maud::{Markup, html};

use super::parts::{figure, image, panels, table};
use crate::report::digits::number;
use crate::report::figures;
use crate::report::results::{Results, mean};
use fem_pictures::LEGEND;

pub(super) fn confirmation(results: &Results) -> Markup {
    let with_mesh = results.qois.iter().any(|qoi| qoi.mesh_error_percent.is_some());
    html! {
        section {
            h2 { "Confirming simulation" }
            (figure(&figures::confirmation(results), html! {
                @if results.baseline_curve.is_some() {
                    "Baseline: the materials as the case has them, before calibration. "
                }
                "MAP: the calibrated ones, simulated and not taken from the surrogate."
            }))
            (table(
                html! {
                    th { "quantity" } th { "experimental mean" } th { "simulation at the MAP" }
                    th { "difference" }
                    @if with_mesh { th { "error of the mesh, estimated" } }
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
            }))
        }
    }
}

/// Section with pictures of the specimen, cut along its axis, at increasing damage.
pub(super) fn damage(results: &Results) -> Markup {
    if results.damage.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "Damage at the MAP" }
            figure {
                div.panels {
                    @for state in &results.damage {
                        @let shows = format!(
                            "{:.3} mm, {} N", state.displacement_mm, number(state.force_n)
                        );
                        figure { (image(&state.picture, &shows)) figcaption { (shows) } }
                    }
                }
                div.scale {
                    span { "0" }
                    span.ramp style={ "background: linear-gradient(to right, " (LEGEND.join(", ")) ")" } {}
                    span { "1" }
                    span { "damage of the matrix" }
                }
                figcaption {
                    "The specimen cut along its axis, displaced as computed; grains are grey. Displacement, \
                     damage, energy density and stress of these states are in "
                    code { "fields/map.pvd" } " for ParaView."
                }
            }
        }
    }
}
