//! Table of the files from which the results were computed.

use maud::{Markup, html};

use super::parts::table;
use crate::report::results::{InputFile, Results};

pub(super) fn collect(results: &Results) -> Option<&[InputFile]> {
    let provenance = results.provenance.as_ref()?;
    (!provenance.inputs.is_empty()).then_some(&provenance.inputs)
}

pub(super) fn show(files: &[InputFile]) -> Markup {
    html! {
        section {
            h2 { "Input files" }
            (table(
                html! { th { "file" } th.text { "hash of its content" } },
                html! { @for file in files { tr {
                    td.path { (file.name) } td.name { code { (file.hash) } }
                } } },
            ))
            p.caption { "Hashes by FNV-1a with 64 bits: they detect changes, but do not protect against forgery." }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::Provenance;

    #[test]
    fn every_file_has_its_hash() {
        let file = InputFile { name: "experiments/curves/S-1.csv".into(), hash: "00ff".into() };
        let provenance = Provenance { inputs: vec![file], ..Provenance::default() };
        let results = Results { provenance: Some(provenance), ..Results::default() };
        let html = collect(&results).map(|files| show(files).into_string()).unwrap_or_default();
        assert!(html.contains("experiments/curves/S-1.csv") && html.contains("00ff"), "{html}");
        let nothing = Results { provenance: Some(Provenance::default()), ..Results::default() };
        assert!(collect(&nothing).is_none());
    }
}
