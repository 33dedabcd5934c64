//! Report page of a case with several tests: results of the joint calibration, contribution of each test, and a
//! link to the report of each test.

use maud::{Markup, html};

use super::parts::table;
use super::{
    budget, case_file, correlations, curves, further, misfit, parameters, parts, posterior,
    predictions, sampling, sensitivity, validation, warnings,
};
use crate::report::digits::number;
use crate::report::document::document;
use crate::report::results::Results;

/// Results of a case with several tests.
#[derive(Clone, Debug, Default)]
pub(crate) struct JointResults {
    /// Joint posterior, with the warnings of all tests.
    pub(crate) joint: Results,
    /// Posterior of each parameter without each test.
    pub(crate) without: Vec<WithoutTest>,
    /// Name and results of each test.
    pub(crate) tests: Vec<(String, Results)>,
}

/// Posterior of one parameter without one test.
#[derive(Clone, Debug, Default)]
pub(crate) struct WithoutTest {
    /// Label of the parameter.
    pub(crate) parameter: String,
    /// Name of the test.
    pub(crate) test: String,
    pub(crate) mean: f64,
    pub(crate) sd: f64,
    /// 5 % and 95 % quantiles.
    pub(crate) interval: [f64; 2],
    /// 1 − posterior variance / prior variance.
    pub(crate) contraction: f64,
    /// Shift of the mean, in standard deviations of the posterior with all tests.
    pub(crate) shift_sd: f64,
    /// Posterior standard deviation without the test, divided by the posterior standard deviation
    /// with all tests.
    pub(crate) sd_ratio: f64,
}

/// Returns the HTML of each listed section that has content.
macro_rules! sections {
    ($results:expr, [$($section:ident),*]) => {
        html! { $(@if let Some(values) = $section::collect($results) { ($section::show(&values)) })* }
    };
}

/// The page as HTML, with inline figures.
pub(crate) fn joint_page(results: &JointResults) -> String {
    let joint = &results.joint;
    let content = html! {
        (links(results))
        (sections!(joint, [parameters, warnings]))
        (without_tests(&results.without))
        (sections!(joint, [budget, sensitivity]))
        @for (name, test) in &results.tests {
            section {
                h2 { "Test " (name) }
                p { (count(test.specimens.len(), "specimen")) ", "
                    (count(test.ensemble.len(), "simulation")) ". "
                    a href={ "tests/" (name) "/report.html" } { "All of this test" } "." }
            }
            (sections!(test, [misfit, curves, predictions, validation, further]))
        }
        (sections!(joint, [posterior, correlations, sampling, case_file]))
    };
    parts::numbered(&document(&joint.title, "figure", &content))
}

fn count(n: usize, one: &str) -> String {
    if n == 1 { format!("1 {one}") } else { format!("{n} {one}s") }
}

/// Links to the reports of the tests.
fn links(results: &JointResults) -> Markup {
    html! {
        p { "Each test has a report of its own, with the joint posterior: "
            @for (k, (name, _)) in results.tests.iter().enumerate() {
                @if k > 0 { ", " }
                a href={ "tests/" (name) "/report.html" } { (name) }
            }
            "."
        }
    }
}

/// Section on the contribution of each test: the posterior without the test.
fn without_tests(without: &[WithoutTest]) -> Markup {
    if without.is_empty() {
        return html! {};
    }
    html! {
        section {
            h2 { "What does each test contribute?" }
            (table(
                html! {
                    th { "parameter" } th.text { "without" } th { "mean ± sd" } th { "90 % interval" }
                    th { "contraction" } th { "shift" } th { "wider by" }
                },
                html! { @for row in without { tr {
                    td.name { (row.parameter) }
                    td.name { (row.test) }
                    td { (number(row.mean)) " ± " (number(row.sd)) }
                    td { (number(row.interval[0])) " … " (number(row.interval[1])) }
                    td { (format!("{:.2}", row.contraction)) }
                    td { (format!("{:+.1} sd", row.shift_sd)) }
                    td { (format!("× {:.1}", row.sd_ratio)) }
                } } },
            ))
            p.caption {
                "Posterior of a calibration to all other tests. Shift: of the mean, in standard deviations of the \
                 posterior with all tests. Wider by: standard deviation divided by that with all tests. A shift of \
                 more than two standard deviations, while the interval hardly widens, means that the tests \
                 contradict each other."
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::CalibratedParameter;

    #[test]
    fn the_page_has_a_section_for_each_test_and_what_it_contributes() {
        let parameter = CalibratedParameter {
            label: "Gc (N/mm)".into(),
            chains: vec![(0..100).map(|i| 0.002 + 1e-6 * f64::from(i)).collect()],
            prior: crate::prior::Prior::uniform(0.0, 0.005),
            ..Default::default()
        };
        let joint = Results {
            title: "Two tests".into(),
            parameters: vec![parameter],
            ..Results::default()
        };
        let without = WithoutTest {
            parameter: "Gc (N/mm)".into(),
            test: "slow".into(),
            mean: 0.0025,
            sd: 0.0014,
            contraction: 0.03,
            sd_ratio: 12.5,
            ..WithoutTest::default()
        };
        let tests = ["fast", "slow"].map(|name| (name.to_owned(), Results::default())).to_vec();
        let results = JointResults { joint, without: vec![without], tests };
        let page = joint_page(&results);
        for part in [
            "<h2>Test fast</h2>",
            "<h2>Test slow</h2>",
            "href=\"tests/slow/report.html\"",
            "What does each test contribute?",
            "<td>× 12.5</td>",
            "<td>0.03</td>",
        ] {
            assert!(page.contains(part), "{part}: {page}");
        }
        assert_eq!(page, joint_page(&results), "the same again");
    }
}
