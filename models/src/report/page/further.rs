//! Section on the expected benefit of further tests.

use maud::{Markup, html};

use super::parts::{figure, table};
use crate::further_test::FurtherTest;
use crate::report::digits::{plain, within};
use crate::report::figures;
use crate::report::results::{FurtherNeeded, FurtherParameter, IDENTIFIED, Results};

pub(super) fn collect(results: &Results) -> Option<&Results> {
    let is_computed = !results.map_curve.is_empty() && !results.further.is_empty();
    is_computed.then_some(results)
}

pub(super) fn show(results: &Results) -> Markup {
    let Results { further: parameters, failed_candidates, .. } = results;
    html! {
        section {
            h2 { "Expected benefit of further tests" }
            p {
                "Expected contraction, 1 − posterior variance / prior variance, for each number of further \
                 specimens, and the smallest number with which a parameter is expected to be identified \
                 (contraction " (IDENTIFIED) ") or its 90 % interval to be as narrow as stated. A further \
                 quantity of the present curves may increase the contraction without any further specimen."
            }
            @if !failed_candidates.is_empty() {
                p { "These further tests are omitted, because they cannot be predicted:" }
                ul.warnings { @for (name, reason) in failed_candidates { li { (name) ": " (reason) } } }
            }
            @for parameter in parameters { (parameter_section(parameter)) }
            p.caption {
                "Linear and Gaussian approximation at draws of the posterior, averaged over the draws. Specimens of another \
                 test have the relative scatter of the present specimens, or the scatter that the case states. More \
                 specimens do not reduce the error that all specimens share: the error of surrogate, mesh and model."
            }
        }
    }
}

fn parameter_section(parameter: &FurtherParameter) -> Markup {
    let specimen_counts: Vec<usize> = parameter
        .tests
        .first()
        .map_or(Vec::new(), |test| test.expected.iter().map(|e| e.specimens).collect());
    let goals: Vec<&FurtherNeeded> =
        parameter.tests.first().map_or(Vec::new(), |test| test.needed.iter().collect());
    html! {
        h3 { (parameter.label) }
        (table(
            html! {
                th { "further test" }
                @for n in &specimen_counts { th { (n) } }
                @for goal in &goals { th { (wanted(goal)) } }
            },
            html! { @for test in &parameter.tests { tr {
                td.name { (test.name) }
                @for expected in &test.expected { td { (format!("{:.2}", expected.contraction)) } }
                @for needed in &test.needed { td { (answer(needed)) } }
            } } },
        ))
        (figure(&figures::further(parameter), html! {
            "Expected contraction of " (parameter.label) " by further specimens. Dashed: present contraction."
        }, "a test whose curve stays near the dashed line has no information on this parameter: choose another \
            candidate in [further_tests]."))
    }
}

/// Heading of a column with numbers of specimens.
fn wanted(goal: &FurtherNeeded) -> String {
    match goal.is_width {
        true => format!("until the interval is {}", plain(goal.value)),
        false => "until identified".to_owned(),
    }
}

/// Text of the number of specimens that a goal needs. If the goal cannot be reached, the text contains the best
/// possible value. If the number is not known, the text is "more than" [`FurtherTest::MOST`].
fn answer(needed: &FurtherNeeded) -> String {
    let FurtherNeeded { is_width, value, specimens, limit } = *needed;
    match specimens {
        Some(n) => n.to_string(),
        None if is_width && limit > value => {
            format!("never: {} at best", within((limit, 0.05 * limit)))
        }
        None if !is_width && limit < value => format!("never: {limit:.2} at best"),
        None => format!("more than {}", FurtherTest::MOST),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::{FurtherExpected, FurtherTestResult};

    #[test]
    fn a_number_of_specimens_or_that_none_suffices_is_said() {
        let needed = |specimens, is_width, limit| FurtherNeeded {
            specimens,
            is_width,
            value: if is_width { 0.002 } else { 0.5 },
            limit,
        };
        let test = |name: &str, needed| FurtherTestResult {
            name: name.into(),
            expected: vec![FurtherExpected { specimens: 8, contraction: 0.523 }],
            needed,
        };
        let slow = test("slow", vec![needed(Some(7), false, 0.9), needed(None, true, 0.0021)]);
        let more = test("more", vec![needed(None, false, 0.04), needed(None, true, 0.0043)]);
        let parameter =
            FurtherParameter { label: "Gc (N/mm)".into(), now: 0.01, tests: vec![more, slow] };
        let failed_candidates = vec![("short".to_owned(), "6 of 6 runs have no peak".to_owned())];
        let further = vec![parameter];
        let results = Results { further, failed_candidates, ..Results::default() };
        let page = show(&results).into_string();
        for part in [
            "<td>7</td>",
            "never: 0.04 at best",
            "never: 0.0021 at best",
            "until identified",
            "until the interval is 0.002",
            "<td>0.52</td>",
            "<li>short: 6 of 6 runs have no peak</li>",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert!(collect(&Results::default()).is_none());
    }
}
