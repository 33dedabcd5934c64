//! Report page of a case. A section is one file with `collect`, which takes its values from the results, and `show`,
//! which writes them as HTML; the order of the sections is the list in [`page`].
//!
//! 1. `parts`: tables, figures and captions
//! 2. `made`, `unfinished`, `parameters`, `warnings`, `misfit`, `budget`, `sensitivity`: the conclusions
//! 3. `specimens`, `curves`, `surrogate`, `posterior`, `correlations`, `sampling`: data, surrogate and posterior
//! 4. `predictions`, `confirmation`, `validation`, `damage`, `further`, `further_sections`: predictions, further tests, and
//!    the sections of a user's program
//! 5. `specimen`, `methods`, `inputs`, `case_file`: how the results were made
//! 6. `several_tests`: the page of a case with several tests, from these sections

mod budget;
mod case_file;
mod confirmation;
mod correlations;
mod curves;
mod damage;
mod further;
mod further_sections;
mod inputs;
mod made;
mod methods;
mod misfit;
mod parameters;
pub(super) mod parts;
mod posterior;
mod predictions;
mod sampling;
mod sensitivity;
mod several_tests;
mod specimen;
mod specimens;
mod surrogate;
mod unfinished;
mod validation;
mod warnings;

use maud::{Markup, html};

use super::document::document;
use super::results::Results;
pub(crate) use several_tests::{JointResults, WithoutTest, joint_page};

/// Returns the HTML of each listed section, `None` for a section without content.
macro_rules! sections {
    ($results:expr, [$($section:ident,)*]) => {
        [$($section::collect($results).map(|values| $section::show(&values)),)*]
    };
}

/// Returns the report as HTML, with inline figures.
pub(crate) fn page(results: &Results) -> String {
    let sections: [Option<Markup>; 23] = sections!(
        results,
        [
            made,
            unfinished,
            parameters,
            warnings,
            misfit,
            budget,
            sensitivity,
            specimens,
            curves,
            surrogate,
            posterior,
            correlations,
            sampling,
            predictions,
            confirmation,
            validation,
            damage,
            further,
            further_sections,
            specimen,
            methods,
            inputs,
            case_file,
        ]
    );
    let content = html! { @for section in sections.into_iter().flatten() { (section) } };
    parts::numbered(&document(&results.title, "figure", &content))
}
