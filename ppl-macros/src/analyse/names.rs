//! Names in the results, taken on the way from statement to statement.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use proc_macro2::Span;
use quote::ToTokens;
use syn::{Expr, Result};

use crate::ast::Id;
use crate::errors::{self, about};
use crate::syntax::places::Place;

/// A place of the model, as `ppl::Site` will hold it.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) span: Span,
    pub(crate) repeated: bool,
    /// Names of the dimensions along which the plates around stack, the innermost last.
    pub(crate) plates: Vec<String>,
    /// Names of the value's own dimensions.
    pub(crate) dims: Vec<String>,
}

/// The names taken on the way to a statement.
#[derive(Clone, Default)]
pub(super) struct Names(HashMap<String, Taken>);

/// By what a name is taken.
#[derive(Clone, Default)]
struct Taken {
    /// By one statement, for all of it.
    is_whole: bool,
    /// By observations of entries: as written, and in which loop.
    entries: HashSet<(String, Option<Id>)>,
    /// The statements with these.
    observed: BTreeSet<Id>,
    /// Whether there are several of them on one way.
    is_shared: bool,
}

impl Names {
    /// Takes all of a name, if nothing has it.
    fn take(&mut self, name: &str) -> bool {
        let taken = self.0.entry(name.to_owned()).or_default();
        !std::mem::replace(&mut taken.is_whole, true) && taken.entries.is_empty()
    }

    /// Takes a name for one statement.
    pub(super) fn declare(&mut self, name: &str, tokens: impl ToTokens) -> Result<()> {
        match self.take(name) {
            true => Ok(()),
            false => Err(about(name, tokens, errors::DECLARED_TWICE)),
        }
    }

    /// Takes the name of a place in this innermost loop. Statements may observe entries of
    /// one name in turn, but not the same entry twice.
    pub(super) fn observe(
        &mut self,
        statement: Id,
        place: &Place,
        written: &Expr,
        innermost: Option<Id>,
    ) -> Result<()> {
        let is_new = if place.is_entry {
            let taken = self.0.entry(place.name.clone()).or_default();
            taken.is_shared |= !taken.entries.is_empty();
            taken.observed.insert(statement);
            let entry = (written.to_token_stream().to_string(), innermost);
            !taken.is_whole && taken.entries.insert(entry)
        } else {
            self.take(&place.name)
        };
        match is_new {
            true => Ok(()),
            false => Err(about(&place.name, written, errors::OBSERVED_TWICE)),
        }
    }

    /// Adds what another arm of a branch took.
    pub(super) fn merge(&mut self, other: Self) {
        for (name, theirs) in other.0 {
            let taken = self.0.entry(name).or_default();
            taken.is_whole |= theirs.is_whole;
            taken.is_shared |= theirs.is_shared;
            taken.entries.extend(theirs.entries);
            taken.observed.extend(theirs.observed);
        }
    }

    /// Where several statements observe entries of one name, these stack in the order in which
    /// they run, along the dimension that all their loops name.
    pub(super) fn stack(&self, sites: &mut BTreeMap<Id, Site>) {
        for Taken { observed, .. } in self.0.values().filter(|taken| taken.is_shared) {
            let own = observed.iter().filter_map(|id| sites.get(id));
            let mut plates = own.map(|site| &site.plates).filter(|plates| !plates.is_empty());
            let first = plates.next().cloned().unwrap_or_default();
            let is_same = plates.all(|plates| *plates == first);
            let plates = if is_same { first } else { Vec::new() };
            for id in observed {
                if let Some(site) = sites.get_mut(id) {
                    site.repeated = true;
                    site.plates.clone_from(&plates);
                }
            }
        }
    }
}
