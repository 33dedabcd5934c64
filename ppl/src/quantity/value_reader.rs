//! Reader of named values, in the order of the model's statements.

use crate::quantity::datum::Recordable;

/// Named values: name, numbers, and count of the numbers that have been read.
pub(crate) struct ValueReader<'y> {
    values: Vec<(&'y str, &'y [f64], usize)>,
    /// Description of the first named value that does not fit the model; `None` if all values fit so far.
    pub(crate) problem: Option<String>,
}

impl<'y> ValueReader<'y> {
    pub(crate) fn new(values: &'y [(String, Vec<f64>)]) -> Self {
        let values = values.iter().map(|(name, elements)| (name.as_str(), elements.as_slice(), 0));
        Self { values: values.collect(), problem: None }
    }

    /// Overwrites `value` with the next numbers of the named quantity. Has no effect if no values were
    /// given for this name.
    pub(crate) fn overwrite<V: Recordable>(&mut self, name: &str, value: &mut V) {
        let Some((_, elements, read)) = self.values.iter_mut().rev().find(|(key, ..)| *key == name)
        else {
            return;
        };
        let count: usize = value.shape().iter().product();
        let next_elements = elements.get(*read..*read + count);
        *read += count;
        if !next_elements.is_some_and(|elements| value.overwrite(&mut elements.iter().copied())) {
            self.problem.get_or_insert_with(|| {
                format!("`{name}`: {} number(s) are given, and more are needed", elements.len())
            });
        }
    }

    /// Checks that all values were read completely.
    pub(crate) fn check(self, names: &str) -> Result<(), String> {
        if let Some(problem) = self.problem {
            return Err(problem);
        }
        for (name, elements, read) in self.values {
            if read == 0 {
                return Err(format!(
                    "`{name}`: no unknown has this name; the unknowns are {names}"
                ));
            }
            if read != elements.len() {
                let given = elements.len();
                return Err(format!(
                    "`{name}`: {given} number(s) are given, and {read} are needed"
                ));
            }
        }
        Ok(())
    }
}
