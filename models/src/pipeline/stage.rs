//! Definition of a stage of the workflow.

use super::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::files::warnings_of;
use crate::results_folder::pattern::matches;

/// Function for the part of a stage's work that several processes do together.
pub(crate) type Share = fn(&Task<'_>) -> Result<(), WorkflowError>;

/// What a stage may read. While the stage runs, it records what it has read, which is a part of this declaration.
#[derive(Clone, Copy, Debug)]
pub struct Reads {
    /// Keys of the case. A table stands for all its keys, and the empty key for the whole case. The files that the case
    /// names belong to the keys.
    pub keys: &'static [&'static str],
    /// Names of the products of other stages: `#` stands for a number, `*` for any text without a slash.
    pub products: &'static [&'static str],
}

impl Reads {
    /// The whole case and all products.
    const EVERYTHING: Self = Self { keys: &[""], products: &["*", "*/*", "*/*/*"] };

    /// Whether a key of the case, such as `specimen.order`, is declared.
    pub fn has_key(&self, key: &str) -> bool {
        let covers = |name: &&str| {
            let rest = key.strip_prefix(*name);
            rest.is_some_and(|rest| name.is_empty() || rest.is_empty() || rest.starts_with('.'))
        };
        self.keys.iter().any(covers)
    }

    /// Whether a product of another stage is declared.
    pub fn has_product(&self, name: &str) -> bool {
        self.products.iter().any(|pattern| matches(pattern, name))
    }
}

/// A step of the workflow; [`STAGES`](crate::STAGES) lists all stages in order.
#[derive(Clone, Copy, Debug)]
pub struct Stage {
    /// Name of the subcommand that runs the stage.
    pub name: &'static str,
    /// Description of the stage in one line.
    pub about: &'static str,
    /// Names of the files that the stage writes: `#` stands for a number, `*` for any text without a slash.
    pub products: &'static [&'static str],
    /// What the stage may read.
    pub reads: Reads,
    /// Part of the stage's work that several processes can do together before one process executes `run`; `None` if the
    /// work cannot be shared.
    pub(crate) share: Option<Share>,
    pub(crate) run: fn(&Task<'_>) -> Result<String, WorkflowError>,
}

impl Stage {
    /// Creates a stage of a user's program, which [`Registry::with_stage`](crate::Registry::with_stage) adds. `name` is
    /// also the subcommand that runs the stage, and `about` its description in one line. `products` are the names of all
    /// files that the stage may write (`#` stands for a number, `*` for any text without a slash). `run` reads the case and
    /// the results of earlier stages through the [`Task`], which records them: a stage is run again if any of them has
    /// changed. `run` returns a line for the screen.
    pub fn new(
        name: &'static str,
        about: &'static str,
        products: &[&'static str],
        run: fn(&Task<'_>) -> Result<String, WorkflowError>,
    ) -> Self {
        // a process has few stages, which live until the process ends
        let warnings: &'static str = Box::leak(warnings_of(name).into_boxed_str());
        let products = Box::leak([products, &[warnings]].concat().into_boxed_slice());
        Self { name, about, products, reads: Reads::EVERYTHING, share: None, run }
    }

    /// Whether the stage makes the specimen. The cases of a study can share the results of such a stage.
    pub(crate) fn is_of_the_specimen(&self) -> bool {
        matches!(self.name, "segment" | "mesh")
    }

    /// Whether several processes can do the stage's work together.
    pub fn is_shared(&self) -> bool {
        self.share.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_table_stands_for_its_keys_and_a_pattern_for_its_names() {
        let reads = Reads { keys: &["test", "specimen.order"], products: &["curves/run-#.csv"] };
        for (key, is_declared) in [
            ("test", true),
            ("test.steps", true),
            ("tests", false),
            ("specimen", false),
            ("specimen.order", true),
            ("", false),
        ] {
            assert_eq!(reads.has_key(key), is_declared, "{key}");
            assert!(Reads::EVERYTHING.has_key(key));
        }
        assert!(reads.has_product("curves/run-012.csv") && !reads.has_product("curves/map.csv"));
        assert!(Reads::EVERYTHING.has_product("curves/map.csv"));
    }
}
