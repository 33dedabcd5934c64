//! Section that compares cases with the same specimens and quantities by their predictions: held-out density and evidence.

use maud::{Markup, html};

use super::ComparedCase;
use crate::report::page::parts::table;

/// Comparison of a case with the case that has the largest held-out density.
#[derive(Clone, Debug, PartialEq)]
struct Compared {
    name: String,
    /// Sum over the specimens of the leave-one-out log densities.
    density: f64,
    /// Difference of the sum from the sum of the best case, and its standard error; `None` for the best case.
    behind: Option<[f64; 2]>,
    /// Logarithm of the evidence and its error.
    evidence: Option<[f64; 2]>,
}

/// Section with one table for each group of cases that are calibrated to the same quantities of the same specimens.
pub(super) fn models(cases: &[ComparedCase]) -> Markup {
    let groups = groups(cases);
    if groups.is_empty() {
        return html! {};
    }
    let with_evidence = groups.iter().flatten().any(|one| one.evidence.is_some());
    html! {
        section {
            h2 { "Which model predicts new specimens best?" }
            (table(
                html! {
                    th { "case" } th { "held-out log density" } th { "difference from the best" }
                    @if with_evidence { th { "ln evidence" } }
                },
                html! { @for one in groups.iter().flatten() { tr {
                    td.name { (one.name) }
                    td { (format!("{:.2}", one.density)) }
                    td { @if let Some([difference, error]) = one.behind {
                        (format!("{difference:.2} ± {error:.2}"))
                    } @else { "best" } }
                    @if with_evidence { td { @if let Some([ln, error]) = one.evidence {
                        (format!("{ln:.2} ± {error:.2}"))
                    } } }
                } } },
            ))
            p.caption {
                "Cases with the same specimens and quantities. The log density of each specimen is predicted by a calibration to the other \
                 specimens. The standard error of a difference is √n times the standard deviation of the differences of n specimens: with \
                 few specimens it is rough, and differences of less than four are small (Sivula et al. 2020, arXiv:2008.10296)."
                @if with_evidence {
                    " The evidence depends on the priors, also on the bounds of uniform ones."
                }
            }
        }
    }
}

/// Groups of at least two cases with the same specimens and quantities; each group is sorted by its held-out density.
fn groups(cases: &[ComparedCase]) -> Vec<Vec<Compared>> {
    let key = |case: &ComparedCase| {
        let specimens: Vec<&str> = case.densities.iter().map(|(name, _)| name.as_str()).collect();
        let quantities: Vec<&str> = case.qois.iter().map(|qoi| qoi.label.as_str()).collect();
        (case.specimens_from.clone(), specimens.join("\n"), quantities.join("\n"))
    };
    let is_compared = |case: &&ComparedCase| {
        let is_finite = |(_, elpd): &(String, f64)| elpd.is_finite();
        case.specimens_from.is_some()
            && !case.densities.is_empty()
            && case.densities.iter().all(is_finite)
    };
    let mut groups: Vec<Vec<&ComparedCase>> = Vec::new();
    for case in cases.iter().filter(is_compared) {
        match groups.iter_mut().find(|group| key(group[0]) == key(case)) {
            Some(group) => group.push(case),
            None => groups.push(vec![case]),
        }
    }
    groups.into_iter().filter(|group| group.len() > 1).map(|group| compared(&group)).collect()
}

fn compared(cases: &[&ComparedCase]) -> Vec<Compared> {
    let density = |case: &ComparedCase| case.densities.iter().map(|(_, elpd)| elpd).sum::<f64>();
    let mut sorted: Vec<&ComparedCase> = cases.to_vec();
    sorted.sort_by(|a, b| density(b).total_cmp(&density(a)));
    let best = sorted[0];
    let one = |(place, case): (usize, &&ComparedCase)| {
        let pairs = case.densities.iter().zip(&best.densities);
        let differences: Vec<f64> = pairs.map(|((_, own), (_, best))| own - best).collect();
        let n = differences.len() as f64;
        let sum: f64 = differences.iter().sum();
        let squares: f64 = differences.iter().map(|d| (d - sum / n).powi(2)).sum();
        let error = (n * squares / (n - 1.0)).sqrt();
        Compared {
            name: case.name.clone(),
            density: density(case),
            behind: (place > 0).then_some([sum, error]),
            evidence: case.evidence,
        }
    };
    sorted.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::results::Qoi;

    fn case(name: &str, from: Option<&str>, densities: &[f64]) -> ComparedCase {
        let named = |(k, elpd): (usize, &f64)| (format!("S-{k}"), *elpd);
        ComparedCase {
            name: name.into(),
            specimens_from: from.map(str::to_owned),
            densities: densities.iter().enumerate().map(named).collect(),
            qois: vec![Qoi { label: "peak force (N)".into(), ..Qoi::default() }],
            ..ComparedCase::default()
        }
    }

    /// Differences −1, −2 and −3: their sum is −6 and its standard error √(3 · 1).
    #[test]
    fn cases_with_the_same_specimens_are_compared() {
        let mut worse = case("AT2", Some("table"), &[1.0, 1.0, 1.0]);
        worse.evidence = Some([-3.0, 0.1]);
        let other = ComparedCase { qois: Vec::new(), ..case("curve", Some("table"), &[9.0; 3]) };
        let cases = [
            worse,
            case("AT1", Some("table"), &[2.0, 3.0, 4.0]),
            other,
            case("own", None, &[5.0; 3]),
            case("group B", Some("other table"), &[5.0; 3]),
            case("failed", Some("table"), &[f64::NAN; 3]),
        ];
        let found = groups(&cases);
        assert_eq!(found.len(), 1, "{found:?}");
        let [best, second] = &found[0][..] else { panic!("{found:?}") };
        assert_eq!((best.name.as_str(), best.density, best.behind), ("AT1", 9.0, None));
        let [difference, error] = second.behind.unwrap();
        assert!((difference + 6.0).abs() < 1e-12 && (error - 3f64.sqrt()).abs() < 1e-12);
        let html = models(&cases).into_string();
        for part in ["-6.00 ± 1.73", "-3.00 ± 0.10", "best"] {
            assert!(html.contains(part), "{part}: {html}");
        }
        assert!(models(&cases[1..2]).into_string().is_empty());
    }
}
