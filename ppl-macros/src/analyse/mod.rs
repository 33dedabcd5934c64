//! What follows from what was written: tables by statement, found by reading alone.

mod activity;
mod branches;
mod check;
mod facts;
mod names;
mod plates;
mod refusals;
mod scope;
mod site;
mod uses;

use std::collections::{HashMap, HashSet};

use quote::ToTokens;
use syn::Error;

use crate::ast::{Argument, Id, Model};
use crate::syntax::tokens::says;
use facts::{Facts, facts};
use scope::{Meaning, Scope};

pub(crate) use activity::Activity;
pub(crate) use plates::Plate;
pub(crate) use site::Site;

/// All that is known of a body.
pub(crate) struct Analysis {
    pub(crate) activity: Activity,
    facts: Facts,
    plates: HashMap<Id, Plate>,
    open: HashSet<Id>,
    /// Whether every point runs the same statements, and none takes data from a point.
    pub(crate) is_static: bool,
}

impl Analysis {
    pub(crate) fn of(model: &Model) -> Self {
        // arguments of submodels may be unknown
        let is_number =
            |data: &&Argument| model.value.is_some() && says(data.ty.to_token_stream(), "Real");
        let (numbers, data): (Vec<_>, Vec<_>) = model.arguments.iter().partition(is_number);
        let numbers: Vec<_> = numbers.iter().map(|number| number.name.clone()).collect();
        let mut scope = Scope::default();
        scope.bind(data.iter().map(|data| data.name.clone()), Meaning::Known);
        scope.bind(numbers.clone(), Meaning::Derived);
        let activity = Activity::of(&model.body, numbers);
        Self {
            is_static: branches::is_static(&model.body, &activity),
            facts: facts(&model.body, &activity, scope),
            plates: plates::plates(&model.body, &activity),
            open: uses::open(&model.body, &activity),
            activity,
        }
    }

    /// Where a statement stands.
    pub(crate) fn site(&self, statement: Id) -> Option<&Site> {
        self.facts.sites.get(&statement)
    }

    /// Why it is refused.
    pub(crate) fn refused(&self, statement: Id) -> Option<&Error> {
        self.facts.errors.get(&statement)
    }

    /// What is known of a loop.
    pub(crate) fn plate(&self, statement: Id) -> Option<&Plate> {
        self.plates.get(&statement)
    }

    /// Whether a declaration can stay a formula.
    pub(crate) fn stays_open(&self, statement: Id) -> bool {
        self.open.contains(&statement)
    }
}
