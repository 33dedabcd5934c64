//! What follows from what was written: tables by statement, found by reading alone.

mod activity;
mod branches;
mod check;
mod facts;
mod names;
mod plates;
mod scope;
mod site;
mod uses;
mod writes;

use std::collections::HashMap;

use quote::ToTokens;

use crate::ast::{Id, Model};
use crate::syntax::tokens::says;
use facts::facts;
use uses::Uses;

pub(crate) use activity::Activity;
pub(crate) use check::declared;
pub(crate) use facts::Facts;
pub(crate) use plates::Plate;
pub(crate) use scope::Scope;
pub(crate) use site::Site;

/// All that is known of a body.
pub(crate) struct Analysis {
    pub(crate) activity: Activity,
    pub(crate) sites: Vec<Site>,
    facts: HashMap<Id, Facts>,
    plates: HashMap<Id, Plate>,
    uses: Uses,
    /// Whether every point runs the same statements, and none takes data from a point.
    pub(crate) is_static: bool,
}

impl Analysis {
    pub(crate) fn of(model: &Model) -> Self {
        // arguments of submodels may be unknown
        let numbers = model
            .arguments
            .iter()
            .filter(|data| model.value.is_some() && says(data.ty.to_token_stream(), "Real"));
        let activity = Activity::of(&model.body, numbers.map(|data| data.name.clone()));
        let (sites, facts) = facts(model, &activity);
        let uses = Uses::of(&model.body, &activity);
        Self {
            is_static: branches::is_static(&model.body, &activity, &uses),
            plates: plates::plates(&model.body, &activity),
            activity,
            sites,
            facts,
            uses,
        }
    }

    pub(crate) fn facts(&self, statement: Id) -> Facts {
        self.facts.get(&statement).cloned().unwrap_or_default()
    }

    /// What is known of a statement that is a loop.
    pub(crate) fn plate(&self, statement: Id) -> Option<&Plate> {
        self.plates.get(&statement)
    }

    /// Whether a declaration can stay a formula.
    pub(crate) fn stays_open(&self, statement: Id) -> bool {
        self.uses.once.contains(&statement)
    }
}
