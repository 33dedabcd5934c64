//! Contradictions: cases that are calibrated against the same specimens but disagree, although one material cannot have
//! two values.

use crate::report::{ComparedCase, Pair, StudyResults};

/// Returns a sentence for each parameter that cases with the same specimens identify with contradictory values. At
/// least one of the intervals is then too narrow.
pub(super) fn contradictions(results: &StudyResults) -> Vec<String> {
    let mut labels: Vec<&str> = Vec::new();
    let contradicting = |pair: &&Pair| pair.differ() && are_comparable(&results.cases, pair);
    let pairs: Vec<&Pair> = results.pairs.iter().filter(contradicting).collect();
    for pair in &pairs {
        if !labels.contains(&pair.label.as_str()) {
            labels.push(&pair.label);
        }
    }
    let sentence = |label: &str| {
        let all = pairs.iter().filter(|pair| pair.label == label);
        let words: Vec<String> = all
            .map(|pair| {
                let [a, b] = &pair.cases;
                let [median, low, high] = pair.ratio;
                format!("{b} to {a} {median:.3} ({low:.3} to {high:.3})")
            })
            .collect();
        format!(
            "The intervals of {label} are too narrow: cases that are calibrated against the same specimens disagree. \
             Ratios with their 90 % intervals: {}.{}",
            words.join("; "),
            remedy(&results.cases)
        )
    };
    labels.into_iter().map(sentence).collect()
}

/// Sentence that recommends several microstructures, if the intervals of a case exclude the scatter of microstructures;
/// otherwise empty.
fn remedy(cases: &[ComparedCase]) -> &'static str {
    use crate::report::Qualifier::OneMicrostructure;
    let mut parameters = cases.iter().flat_map(|case| &case.parameters);
    match parameters.any(|p| p.qualifiers.contains(&OneMicrostructure)) {
        true => {
            " The intervals omit the scatter between microstructures: use design.microstructure = \"per-run\", or an image \
             of each specimen."
        }
        false => "",
    }
}

/// Whether both cases have the same specimens and identify the parameter.
fn are_comparable(cases: &[ComparedCase], pair: &Pair) -> bool {
    let [a, b] = pair.cases.each_ref().map(|name| cases.iter().find(|case| case.name == *name));
    let (Some(a), Some(b)) = (a, b) else { return false };
    let is_identified = |case: &ComparedCase| {
        let parameter = case.parameters.iter().find(|p| p.label == pair.label);
        parameter.is_some_and(|p| p.verdict().is_identified())
    };
    a.specimens_from.is_some()
        && a.specimens_from == b.specimens_from
        && is_identified(a)
        && is_identified(b)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;
    use crate::report::{CalibratedParameter, Qualifier};

    fn case(name: &str, specimens: Option<&str>, contraction: f64) -> ComparedCase {
        let draws = (0..200).map(|i| 289.0 + 0.01 * f64::from(i)).collect();
        ComparedCase {
            name: name.into(),
            specimens_from: specimens.map(str::to_owned),
            parameters: vec![CalibratedParameter {
                label: "E (MPa)".into(),
                prior: Prior::uniform(200.0, 500.0),
                map: 290.0,
                chains: vec![draws],
                contraction,
                qualifiers: [Qualifier::OneMicrostructure].into(),
                ..Default::default()
            }],
            ..Default::default()
        }
    }

    fn contradictions_in(cases: Vec<ComparedCase>, ratio: [f64; 3]) -> Vec<String> {
        let cases_of_pair = [cases[0].name.clone(), cases[1].name.clone()];
        let label = "E (MPa)".to_owned();
        let pair = Pair { cases: cases_of_pair, label, overlap: 0.0, ratio };
        contradictions(&StudyResults { cases, pairs: vec![pair], ..StudyResults::default() })
    }

    #[test]
    fn cases_that_share_specimens_and_disagree_have_too_narrow_intervals() {
        let two = |a: Option<&str>, b: Option<&str>, contraction: f64| {
            vec![case("A", a, 0.99), case("B", b, contraction)]
        };
        let (same, apart, alike) = (Some("L"), [0.88, 0.86, 0.999], [0.88, 0.86, 1.001]);
        let said = contradictions_in(two(same, same, 0.99), apart);
        assert_eq!(said.len(), 1);
        for part in ["intervals of E (MPa) are too narrow", "B to A 0.880", "\"per-run\""] {
            assert!(said[0].contains(part), "{part}: {said:?}");
        }
        assert!(
            contradictions_in(two(same, same, 0.99), alike).is_empty(),
            "the interval includes 1"
        );
        assert!(contradictions_in(two(same, Some("M"), 0.99), apart).is_empty(), "other specimens");
        assert!(
            contradictions_in(two(None, None, 0.99), apart).is_empty(),
            "each has specimens of its own"
        );
        assert!(
            contradictions_in(two(same, same, 0.05), apart).is_empty(),
            "one is not identified"
        );
    }
}
