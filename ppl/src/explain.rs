//! Why a point has no density: the datum at fault.

use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::Role;
use crate::entry::Entry;
use crate::prior::Statements;
use crate::trace::{Source, Trace};

/// Most numbers of a datum that are shown.
const SHOWN: usize = 6;

/// A sentence about the first observation without density, if that is where the model fails.
pub(crate) fn explain(model: &dyn Statements, unknowns: Source<'_>) -> Option<String> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(0);
    let mut trace = Trace::new(unknowns, &mut rng);
    let outcome = model.trace(&mut trace);
    let datum = match outcome {
        Err(_) => trace.failing,
        Ok(()) => {
            let entries = &trace.record.entries;
            entries.iter().filter(|e| e.variable.role == Role::Observed).find_map(first_without)
        }
    };
    datum.map(first_to_fail)
}

pub(crate) fn first_to_fail(datum: String) -> String {
    format!("the first observation to fail is {datum}")
}

fn first_without(entry: &Entry) -> Option<String> {
    let index = entry.log_likelihood.iter().position(|value| !value.is_finite())?;
    let size = entry.values.len() / entry.log_likelihood.len();
    let values = &entry.values[index * size..(index + 1) * size];
    Some(datum(&entry.variable.name, (entry.log_likelihood.len() > 1).then_some(index), values))
}

/// `y[3] = 0.7`.
pub(crate) fn datum(name: &str, index: Option<usize>, values: &[f64]) -> String {
    let index = index.map_or(String::new(), |index| format!("[{index}]"));
    let numbers = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(", ");
    match values {
        [value] => format!("`{name}{index}` = {value}"),
        few if few.len() <= SHOWN => format!("`{name}{index}` = [{}]", numbers(few)),
        many => format!("`{name}{index}` = [{}, …]", numbers(&many[..SHOWN])),
    }
}

/// The rest of a sentence.
pub(crate) fn further(detail: &Option<String>) -> String {
    detail.as_ref().map_or(String::new(), |detail| format!("; {detail}"))
}
