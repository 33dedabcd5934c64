//! First lines of the page: date, version and machine.

use maud::{Markup, html};

use crate::report::results::{Provenance, Results};

pub(super) fn collect(results: &Results) -> Option<&Provenance> {
    results.provenance.as_ref()
}

pub(super) fn show(Provenance { date, version, machine, .. }: &Provenance) -> Markup {
    html! {
        p.caption { "Results of " (date) ", Breccia " (version) ". This page was written on " (machine) "." }
    }
}
