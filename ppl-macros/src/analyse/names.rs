//! Names in the results, taken on the way from statement to statement.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use quote::ToTokens;
use syn::{Expr, Result};

use super::site::Site;
use crate::ast::Id;
use crate::errors::{self, at};
use crate::syntax::places::Place;

/// The names taken on the way to a statement.
#[derive(Clone, Default)]
pub(super) struct Names {
    taken: HashMap<String, Taken>,
    /// The statements that observe entries, by name.
    observed: HashMap<String, BTreeSet<Id>>,
    /// Names of which several do on one way.
    shared: HashSet<String>,
}

#[derive(Clone)]
enum Taken {
    Whole,
    /// By observations of entries: as written, and in which loop.
    Entries(HashSet<(String, Option<usize>)>),
}

impl Names {
    /// Takes a name for one statement.
    pub(super) fn declare(&mut self, name: &str, tokens: impl ToTokens) -> Result<()> {
        match self.taken.insert(name.to_owned(), Taken::Whole) {
            None => Ok(()),
            Some(_) => Err(at(tokens, errors::declared_twice(name))),
        }
    }

    /// Takes the name of a place in the loop of this number. Statements may observe entries of
    /// one name in turn, but not the same entry twice.
    pub(super) fn observe(
        &mut self,
        statement: Id,
        place: &Place,
        written: &Expr,
        innermost: Option<usize>,
    ) -> Result<()> {
        let name = &place.name;
        if !place.is_entry {
            return match self.taken.insert(name.clone(), Taken::Whole) {
                None => Ok(()),
                Some(_) => Err(at(written, errors::observed_twice(name))),
            };
        }
        let is_first = !self.taken.contains_key(name);
        let taken = self.taken.entry(name.clone()).or_insert(Taken::Entries(HashSet::new()));
        let entry = (written.to_token_stream().to_string(), innermost);
        let is_new = match taken {
            Taken::Whole => false,
            Taken::Entries(entries) => entries.insert(entry),
        };
        if !is_new {
            return Err(at(written, errors::observed_twice(name)));
        }
        self.observed.entry(name.clone()).or_default().insert(statement);
        if !is_first {
            self.shared.insert(name.clone());
        }
        Ok(())
    }

    /// Adds what another arm of a branch took.
    pub(super) fn merge(&mut self, other: Self) {
        self.shared.extend(other.shared);
        for (name, statements) in other.observed {
            self.observed.entry(name).or_default().extend(statements);
        }
        for (name, theirs) in other.taken {
            match (self.taken.get_mut(&name), theirs) {
                (Some(Taken::Entries(entries)), Taken::Entries(theirs)) => entries.extend(theirs),
                (_, theirs) => {
                    self.taken.insert(name, theirs);
                }
            }
        }
    }

    /// Where several statements observe entries of one name, these stack in the order in which
    /// they run, along the dimension that all their loops name.
    pub(super) fn stack(&self, sites: &mut BTreeMap<Id, Site>) {
        for statements in self.shared.iter().filter_map(|name| self.observed.get(name)) {
            let own = statements.iter().filter_map(|id| sites.get(id));
            let mut plates = own.map(|site| &site.plates).filter(|plates| !plates.is_empty());
            let first = plates.next().cloned().unwrap_or_default();
            let is_same = plates.all(|plates| *plates == first);
            let plates = if is_same { first } else { Vec::new() };
            for id in statements {
                if let Some(site) = sites.get_mut(id) {
                    site.repeated = true;
                    site.plates.clone_from(&plates);
                }
            }
        }
    }
}
