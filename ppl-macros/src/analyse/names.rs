//! Checks that no two statements on one execution path use the same name in the results.

use std::collections::{BTreeMap, BTreeSet, HashMap, HashSet};

use proc_macro2::Span;
use quote::ToTokens;
use syn::{Expr, Result};

use crate::ast::Id;
use crate::errors::{self, about};
use crate::syntax::places::Place;

/// The site of a statement: its position and name in the model, with the fields of `ppl::Site`.
#[derive(Clone)]
pub(crate) struct Site {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) span: Span,
    pub(crate) repeated: bool,
    /// Names of the dimensions along which the enclosing plates (`for` loops of the model) stack the values, the
    /// innermost last.
    pub(crate) plates: Vec<String>,
    /// Names of the dimensions that the value of the statement has in a single iteration.
    pub(crate) dims: Vec<String>,
}

/// The names of quantities in the results that are already taken: the names of all statements on
/// the execution paths to the current statement.
#[derive(Clone, Default)]
pub(super) struct Names(HashMap<String, Taken>);

/// Describes the statements that declare or observe the quantity with one name.
#[derive(Clone, Default)]
struct Taken {
    /// Whether a statement declares or observes the quantity with this name without an index: `y ~
    /// …`, not `y[i] ~ …`.
    is_whole: bool,
    /// The observed entries of the quantity with this name, such as `y[i]`. An entry consists of its expression as
    /// written, and of the innermost plate (`for` loop of the model) that contains the statement.
    entries: HashSet<(String, Option<Id>)>,
    /// The statements that observe an entry of the quantity with this name, such as `y[i] ~ …`.
    observed: BTreeSet<Id>,
    /// Whether several statements on one execution path observe entries of the quantity with this
    /// name.
    is_shared: bool,
}

impl Names {
    /// Registers that a statement uses a name without an index. Returns false if another statement already uses the
    /// name.
    fn take(&mut self, name: &str) -> bool {
        let taken = self.0.entry(name.to_owned()).or_default();
        !std::mem::replace(&mut taken.is_whole, true) && taken.entries.is_empty()
    }

    /// Registers the name that a statement declares.
    pub(super) fn declare(&mut self, name: &str, tokens: impl ToTokens) -> Result<()> {
        match self.take(name) {
            true => Ok(()),
            false => Err(about(name, tokens, errors::DECLARED_TWICE)),
        }
    }

    /// Registers the name of a place that a statement observes. `innermost` is the innermost plate (`for` loop of the
    /// model) around the statement. Several statements may observe different entries of one quantity, but not the
    /// same entry.
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

    /// Adds the names that another arm of the same `if` or `match` uses.
    pub(super) fn merge(&mut self, other: Self) {
        for (name, theirs) in other.0 {
            let taken = self.0.entry(name).or_default();
            taken.is_whole |= theirs.is_whole;
            taken.is_shared |= theirs.is_shared;
            taken.entries.extend(theirs.entries);
            taken.observed.extend(theirs.observed);
        }
    }

    /// Sets the sites of statements that observe entries of one quantity. The entries of all these statements form
    /// one array in the results, in the order in which the statements run. The dimensions of the array have the names
    /// of the plates' dimensions if these names are the same for all statements; otherwise the dimensions have no
    /// names.
    pub(super) fn stack(&self, sites: &mut BTreeMap<Id, Site>) {
        for Taken { observed, .. } in self.0.values().filter(|taken| taken.is_shared) {
            let named_sites = observed.iter().filter_map(|id| sites.get(id));
            let mut plates =
                named_sites.map(|site| &site.plates).filter(|plates| !plates.is_empty());
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
