//! Stage `next-test`: predicts by how much further tests would reduce the uncertainty of the parameters, and how many
//! specimens are needed.

mod again;
mod elsewhere;
mod other;
mod present;

use crate::case::{CandidateCase, PRESENT};
use crate::further_test::{Belief, Expected, FurtherTest, FurtherTestError, Goal};
use crate::pipeline::task::Task;
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use present::Present;

/// Contraction (1 − posterior variance/prior variance) above which a parameter is called identified.
const IDENTIFIED: f64 = 0.5;

/// A candidate test, and the belief about the parameters before this test.
struct Candidate {
    name: String,
    /// Belief about the parameters: the posterior of the calibration. If the test takes further quantities from
    /// existing curves, the belief is the narrower posterior that also includes these quantities. Parameters with other
    /// values in the test follow the parameters of the calibration.
    belief: Belief,
    test: FurtherTest,
}

pub(crate) fn run(task: &Task<'_>) -> Result<String, WorkflowError> {
    let inputs = &task.inputs;
    let further = inputs.further_tests();
    let present = Present::read(task)?;
    let named = |name: &str, error: FurtherTestError| {
        WorkflowError::Unusable(format!("the further test {name:?}: {error}"))
    };
    let belief = present.belief().map_err(|error| named(PRESENT, error))?;
    let test = present.test()?;
    let mut failed: Vec<[String; 2]> = Vec::new();
    let mut candidates = vec![Candidate { name: PRESENT.to_owned(), belief, test }];
    for (number, case) in (1..).zip(&further.candidate) {
        task.check_interrupt()?;
        say("next-test", &case.name);
        let made = match case.is_another_test() {
            true => other::test(task, &present, &candidates[0].belief, case, number),
            false => again::test(task, case, number),
        };
        match made.and_then(|(belief, test)| usable(case, belief, test)) {
            Ok(candidate) => candidates.push(candidate),
            Err(error) if stops_the_stage(&error) => return Err(error),
            Err(error) => {
                let text = format!(
                    "The further test {:?} is omitted from the comparison of further tests: {error}",
                    case.name
                );
                say("warning", &text);
                failed.push([case.name.clone(), error.to_string()]);
            }
        }
    }
    let mut specimen_counts = further.specimens.clone();
    specimen_counts.sort_unstable();
    specimen_counts.dedup();
    let specimen_counts: Vec<usize> = [0].into_iter().chain(specimen_counts).collect();
    let parameters: Vec<&str> = present.prior.iter().map(|input| input.name.as_str()).collect();
    let mut rows = Vec::new();
    let mut needed = Vec::new();
    for Candidate { name, belief, test } in &candidates {
        for &specimens in &specimen_counts {
            let expected = test.expected(belief, specimens).map_err(|error| named(name, error))?;
            rows.extend(parameters.iter().zip(expected).map(|(parameter, expected)| {
                let Expected { contraction, range: [low, high], width90 } = expected;
                let statistics = [contraction, low, high, width90].map(|x| x.to_string());
                let key = [name.clone(), (*parameter).to_owned(), specimens.to_string()];
                key.into_iter().chain(statistics).collect::<Vec<_>>()
            }));
        }
        for (i, parameter) in parameters.iter().enumerate() {
            let mut goals = vec![Goal::Contraction(IDENTIFIED)];
            let width = further.width90.iter().find(|(path, _)| path.to_string() == **parameter);
            goals.extend(width.map(|(_, &width)| Goal::Width90(width)));
            for goal in goals {
                let requirement =
                    test.specimens_for(belief, i, goal).map_err(|e| named(name, e))?;
                let (what, value) = match goal {
                    Goal::Contraction(value) => ("contraction", value),
                    Goal::Width90(value) => ("width90", value),
                };
                needed.push([
                    name.clone(),
                    (*parameter).to_owned(),
                    what.to_owned(),
                    value.to_string(),
                    requirement.specimens.map(|n| n.to_string()).unwrap_or_default(),
                    requirement.limit.to_string(),
                ]);
            }
        }
    }
    let header = [
        "candidate",
        "parameter",
        "specimens",
        "contraction",
        "contraction_q05",
        "contraction_q95",
        "width90",
    ];
    task.write_csv("next-test.csv", header, rows)?;
    let header = ["candidate", "parameter", "goal", "value", "specimens", "limit"];
    task.write_csv("next-test-specimens.csv", header, needed)?;
    let omitted = match failed.len() {
        0 => String::new(),
        count => format!(", {count} omitted"),
    };
    task.write_csv("next-test-failed.csv", ["candidate", "reason"], failed)?;
    Ok(format!("{} further tests{omitted}", candidates.len()))
}

/// Whether an error concerns the whole stage, and not only one candidate: an interrupt, or a file that cannot be read or
/// written.
fn stops_the_stage(error: &WorkflowError) -> bool {
    matches!(error, WorkflowError::Interrupted | WorkflowError::Io { .. })
}

/// Checks that the benefit of a candidate can be computed.
fn usable(
    case: &CandidateCase,
    belief: Belief,
    test: FurtherTest,
) -> Result<Candidate, WorkflowError> {
    match test.expected(&belief, 1) {
        Ok(_) => Ok(Candidate { name: case.name.clone(), belief, test }),
        Err(error) => Err(WorkflowError::Unusable(error.to_string())),
    }
}
