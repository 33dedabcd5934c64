//! Section with pictures of the specimen, cut along its axis, at increasing damage.

use fem_pictures::LEGEND;
use maud::{Markup, html};

use super::parts::{caption, image};
use crate::report::digits::number;
use crate::report::results::{DamageState, Results};

pub(super) fn collect(results: &Results) -> Option<&[DamageState]> {
    (!results.map_curve.is_empty() && !results.damage.is_empty()).then_some(&results.damage)
}

pub(super) fn show(states: &[DamageState]) -> Markup {
    html! {
        section {
            h2 { "Damage at the MAP" }
            figure {
                div.panels {
                    @for state in states {
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
                (caption(html! {
                    "The deformed specimen, cut along its axis; grains are grey. Displacement, \
                     damage, energy density and stress of these states are in "
                    code { "fields/map.pvd" } " for ParaView."
                }, "damage that starts at a platen or follows the edges of elements is an effect of the platens or \
                    of the mesh: compare with other test.platens and with a smaller specimen.spacing_mm."))
            }
        }
    }
}
