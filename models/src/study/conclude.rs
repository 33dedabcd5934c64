//! Conclusions of a study as sentences, and whether each is confirmed under the other settings.

use crate::report::{
    CalibratedParameter, ComparedCase, Conclusion, Pair, REPRODUCED, StudyResults, Verdict, number,
};

/// Probability with which a correct 90 % interval contains the truth.
const NOMINAL: f64 = 0.9;
/// Significance level. A hit is an interval that contains the truth. Intervals count as too narrow if correct
/// intervals would have so few hits with a probability below this level.
const CHANCE: f64 = 0.05;

/// A result of the calibrations: a claim as a sentence, and the numbers that support it.
struct Shown {
    claim: String,
    evidence: String,
}

/// Returns the conclusions of the first setting, each with the corresponding result of every setting. Only cases that
/// were calibrated under all settings are used.
pub(super) fn conclusions(settings: &[StudyResults]) -> Vec<Conclusion> {
    let missing: Vec<&String> = settings.iter().flat_map(|setting| &setting.missing).collect();
    let settings: Vec<StudyResults> =
        settings.iter().map(|setting| without(setting, &missing)).collect();
    let settings = settings.as_slice();
    let shown: Vec<Vec<Shown>> = settings.iter().map(|setting| shown(setting, settings)).collect();
    let Some(first) = shown.first() else { return Vec::new() };
    let conclusion = |(k, first_shown): (usize, &Shown)| {
        let evidence_of =
            |all: &Vec<Shown>| (all[k].evidence.clone(), all[k].claim == first_shown.claim);
        Conclusion {
            claim: first_shown.claim.clone(),
            evidence: shown.iter().map(evidence_of).collect(),
        }
    };
    first.iter().enumerate().map(conclusion).collect()
}

/// Returns a copy of a setting without the cases whose names are in `names`.
fn without(setting: &StudyResults, names: &[&String]) -> StudyResults {
    let mut rest = setting.clone();
    rest.cases.retain(|case| !names.contains(&&case.name));
    rest.pairs.retain(|pair| pair.cases.iter().all(|name| !names.contains(&name)));
    rest
}

/// Results of one setting, in the same order for all settings.
fn shown(setting: &StudyResults, all: &[StudyResults]) -> Vec<Shown> {
    let cases = &setting.cases;
    let mut shown: Vec<Shown> =
        labels(cases).into_iter().map(|label| identification(cases, label)).collect();
    // parameters that are not identified under any setting are not compared
    let learnt: Vec<&str> = labels(cases)
        .into_iter()
        .filter(|label| all.iter().any(|s| is_learnt_in(s, label)))
        .collect();
    for laboratory in laboratories(cases) {
        shown.extend(learnt.iter().filter_map(|label| agreement(setting, laboratory, label)));
    }
    let pairs = setting.pairs.iter().filter(|pair| is_of_one_specimen(cases, pair));
    let of_learnt = pairs.filter(|pair| learnt.contains(&pair.label.as_str()));
    shown.extend(of_learnt.map(|pair| difference(cases, pair)));
    shown.push(reproduction(cases));
    shown.extend(coverage(cases));
    shown
}

/// Labels of all parameters, in order of first occurrence.
fn labels(cases: &[ComparedCase]) -> Vec<&str> {
    let mut labels: Vec<&str> = Vec::new();
    for p in cases.iter().flat_map(|case| &case.parameters) {
        if !labels.contains(&p.label.as_str()) {
            labels.push(&p.label);
        }
    }
    labels
}

/// Names of the laboratories in the order of the cases.
fn laboratories(cases: &[ComparedCase]) -> Vec<&str> {
    let mut names: Vec<&str> = cases.iter().filter_map(|case| case.laboratory.as_deref()).collect();
    names.dedup();
    names
}

fn parameter<'c>(case: &'c ComparedCase, label: &str) -> Option<&'c CalibratedParameter> {
    case.parameters.iter().find(|p| p.label == label)
}

/// Whether the data narrowed the distribution of the parameter, even if the posterior is truncated by a bound of the
/// prior.
fn is_learnt(p: &CalibratedParameter) -> bool {
    let verdict = p.verdict();
    verdict.is_identified() || verdict == Verdict::AtBound
}

fn is_learnt_in(setting: &StudyResults, label: &str) -> bool {
    setting.cases.iter().filter_map(|case| parameter(case, label)).any(is_learnt)
}

/// States the cases in which a parameter is identified.
fn identification(cases: &[ComparedCase], label: &str) -> Shown {
    let all: Vec<&CalibratedParameter> =
        cases.iter().filter_map(|case| parameter(case, label)).collect();
    let learnt = all.iter().filter(|p| is_learnt(p)).count();
    let at_bound = all.iter().filter(|p| p.verdict() == Verdict::AtBound).count();
    let claim = match learnt {
        0 => format!("{label} is identified in no case"),
        n if n == all.len() => format!("{label} is identified in every case"),
        _ => format!("{label} is identified in some cases"),
    };
    let cut =
        if at_bound > 0 { format!(", {at_bound} at a bound of its prior") } else { String::new() };
    Shown { claim, evidence: format!("{learnt} of {}{cut}", all.len()) }
}

/// States whether cases with the specimens of one laboratory agree on a parameter.
fn agreement(setting: &StudyResults, laboratory: &str, label: &str) -> Option<Shown> {
    let is_there = |name: &String| {
        let case = setting.cases.iter().find(|case| case.name == *name);
        case.is_some_and(|case| case.laboratory.as_deref() == Some(laboratory))
    };
    let pairs: Vec<&Pair> = setting
        .pairs
        .iter()
        .filter(|pair| pair.label == label && pair.cases.iter().all(is_there))
        .collect();
    let farthest =
        pairs.iter().max_by(|a, b| a.ratio[0].ln().abs().total_cmp(&b.ratio[0].ln().abs()))?;
    let differ = pairs.iter().filter(|pair| pair.differ()).count();
    let overlaps = || pairs.iter().map(|pair| 100.0 * pair.overlap);
    let (least, most) = overlaps().fold((f64::INFINITY, 0.0_f64), |(a, b), x| (a.min(x), b.max(x)));
    let range = if pairs.len() > 1 {
        format!("{least:.0} to {most:.0} %")
    } else {
        format!("{least:.0} %")
    };
    let does = if differ == 0 { "agree" } else { "do not agree" };
    let evidence = format!(
        "{differ} of {} pairs differ; overlap {range}; largest difference between {} and {}: {}",
        pairs.len(),
        farthest.cases[0],
        farthest.cases[1],
        ratio(farthest)
    );
    Some(Shown {
        claim: format!("The cases of laboratory {laboratory} {does} on {label}"),
        evidence,
    })
}

/// Whether the two cases of a pair have the same specimen geometry but different laboratories.
fn is_of_one_specimen(cases: &[ComparedCase], pair: &Pair) -> bool {
    let case_named = |name: &String| cases.iter().find(|case| case.name == *name);
    match (case_named(&pair.cases[0]), case_named(&pair.cases[1])) {
        (Some(a), Some(b)) => a.specimen == b.specimen && a.laboratory != b.laboratory,
        _ => false,
    }
}

/// States the difference of a parameter between two laboratories, for equal specimen geometry.
fn difference(cases: &[ComparedCase], pair: &Pair) -> Shown {
    let ([a, b], label) = (&pair.cases, &pair.label);
    let claim = match (pair.differ(), pair.ratio[0] > 1.0) {
        (false, _) => format!("{label} is not distinguishable between {b} and {a}"),
        (true, true) => format!("{label} is larger in {b} than in {a}"),
        (true, false) => format!("{label} is smaller in {b} than in {a}"),
    };
    let truth = |name: &String| {
        let case = cases.iter().find(|case| case.name == *name)?;
        parameter(case, label)?.truth
    };
    let truth = truth(b).zip(truth(a)).map(|(b, a)| format!("; true ratio {}", number(b / a)));
    Shown { claim, evidence: ratio(pair) + &truth.unwrap_or_default() }
}

fn ratio(pair: &Pair) -> String {
    let [median, low, high] = pair.ratio;
    format!("ratio {median:.3} ({low:.3} … {high:.3})")
}

/// States whether simulations at the posterior mode reproduce the experiments.
fn reproduction(cases: &[ComparedCase]) -> Shown {
    let errors: Vec<f64> =
        cases.iter().flat_map(|case| &case.qois).map(|qoi| qoi.percent_error).collect();
    let good = errors.iter().filter(|error| **error <= REPRODUCED).count();
    let worst = errors.iter().copied().fold(0.0, f64::max);
    let which = if good == errors.len() { "all quantities" } else { "not all quantities" };
    Shown {
        claim: format!("Simulations at the MAP reproduce {which} within {REPRODUCED} %"),
        evidence: format!("{good} of {}; largest difference {worst:.1} %", errors.len()),
    }
}

/// States whether the intervals of identified parameters contain the true values; `None` if no truth is known.
fn coverage(cases: &[ComparedCase]) -> Option<Shown> {
    let identified = |p: &&CalibratedParameter| p.verdict().is_identified() && p.truth.is_some();
    let all: Vec<_> = cases.iter().flat_map(|case| &case.parameters).collect();
    if all.iter().all(|p| p.truth.is_none()) {
        return None;
    }
    let with_truth: Vec<_> = all.into_iter().filter(identified).collect();
    let holds = |p: &&&CalibratedParameter| {
        p.truth.is_some_and(|truth| (p.q05.0..=p.q95.0).contains(&truth))
    };
    let hits = with_truth.iter().filter(holds).count();
    let often = if at_most(hits, with_truth.len()) >= CHANCE { "as" } else { "less" };
    let than = if often == "as" { "as" } else { "than" };
    Some(Shown {
        claim: format!(
            "90 % intervals of identified parameters include the truth {often} often {than} stated"
        ),
        evidence: format!("{hits} of {}", with_truth.len()),
    })
}

/// Probability that at most `hits` of `n` intervals contain the truth, if each interval contains it with the nominal
/// probability (binomial distribution).
fn at_most(hits: usize, n: usize) -> f64 {
    let mut term = (1.0 - NOMINAL).powi(n as i32);
    let mut sum = 0.0;
    for k in 0..=hits {
        sum += term;
        term *= (n as f64 - k as f64) / (k as f64 + 1.0) * NOMINAL / (1.0 - NOMINAL);
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::prior::Prior;
    use crate::report::Qoi;

    #[test]
    fn chances_are_those_of_the_binomial_distribution() {
        // probability of seven hits in seven intervals: 0.9⁷ = 0.47830; of six hits: 7 · 0.9⁶ · 0.1 = 0.37201
        assert!((at_most(7, 7) - 1.0).abs() < 1e-12);
        assert!((at_most(5, 7) - (1.0 - 0.478_296_9 - 0.372_008_7)).abs() < 1e-6);
        assert_eq!(at_most(0, 0), 1.0);
    }

    fn case(
        name: &str,
        laboratory: &str,
        specimen: &str,
        mean: f64,
        sd: f64,
        truth: f64,
    ) -> ComparedCase {
        let draws = (0..200).map(|i| mean + sd * (0.01 * f64::from(i) - 1.0)).collect();
        ComparedCase {
            name: name.into(),
            laboratory: Some(laboratory.into()),
            specimen: specimen.into(),
            parameters: vec![CalibratedParameter {
                label: "E (MPa)".into(),
                prior: Prior::uniform(200.0, 500.0),
                map: mean,
                q05: (mean - sd, 0.0),
                q95: (mean + sd, 0.0),
                chains: vec![draws],
                contraction: 0.99,
                truth: Some(truth),
                ..Default::default()
            }],
            qois: vec![Qoi { percent_error: 2.5, ..Default::default() }],
            ..Default::default()
        }
    }

    fn setting(sd: f64, contraction: f64) -> StudyResults {
        let mut cases = vec![
            case("A", "50C", "a", 290.0, sd, 270.0),
            case("B", "50C", "b", 260.0, sd, 270.0),
            case("C", "90C", "b", 380.0, sd, 400.0),
        ];
        cases.iter_mut().for_each(|case| case.parameters[0].contraction = contraction);
        let pair = |a: &str, b: &str, ratio: f64| Pair {
            cases: [a.into(), b.into()],
            label: "E (MPa)".into(),
            overlap: 0.0,
            ratio: [ratio, ratio - 0.01 * sd, ratio + 0.01 * sd],
        };
        let pairs = vec![pair("A", "B", 0.897), pair("A", "C", 1.310), pair("B", "C", 1.462)];
        StudyResults { cases, pairs, ..Default::default() }
    }

    /// Three settings: narrow posteriors that differ, wide posteriors that do not differ, and posteriors that are not
    /// identified.
    #[test]
    fn a_conclusion_survives_where_the_other_setting_shows_the_same() {
        let confirmed = conclusions(&[setting(5.0, 0.99), setting(25.0, 0.95), setting(5.0, 0.1)]);
        let rows: Vec<(&str, Vec<bool>)> = confirmed
            .iter()
            .map(|c| (c.claim.as_str(), c.evidence.iter().map(|evidence| evidence.1).collect()))
            .collect();
        let expected: Vec<(&str, Vec<bool>)> = vec![
            ("E (MPa) is identified in every case", vec![true, true, false]),
            ("The cases of laboratory 50C do not agree on E (MPa)", vec![true, false, true]),
            ("E (MPa) is larger in C than in B", vec![true, true, true]),
            ("Simulations at the MAP reproduce all quantities within 10 %", vec![true, true, true]),
            (
                "90 % intervals of identified parameters include the truth less often than stated",
                vec![true, false, false],
            ),
        ];
        assert_eq!(rows, expected);
        // a case that is missing under one setting is not compared under any setting
        let mut incomplete = setting(5.0, 0.99);
        incomplete.cases.remove(0);
        incomplete.pairs.retain(|pair| pair.cases[0] != "A");
        incomplete.missing = vec!["A".into()];
        let claims: Vec<Conclusion> = conclusions(&[setting(5.0, 0.99), incomplete]);
        assert!(claims.iter().all(|c| c.evidence[0] == c.evidence[1]), "{claims:?}");
        assert!(claims.iter().all(|c| !c.claim.contains("do not agree")), "{claims:?}");
        assert_eq!(claims[0].evidence[0].0, "2 of 2");
        assert_eq!(confirmed[2].evidence[0].0, "ratio 1.462 (1.412 … 1.512); true ratio 1.481");
        assert_eq!(confirmed[4].evidence[0].0, "0 of 3");
        assert_eq!(confirmed[4].evidence[2].0, "0 of 0");
        assert!(
            confirmed[1].evidence[0].0.starts_with(
                "1 of 1 pairs differ; overlap 0 %; largest difference between A and B"
            )
        );
    }
}
