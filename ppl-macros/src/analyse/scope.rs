//! What the names in scope stand for.

use std::collections::HashMap;

use syn::{Expr, Ident};

use super::activity::holds;

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Meaning {
    /// Data, or what follows from them.
    Known,
    Unknown,
    /// What may follow from unknowns.
    Derived,
}

/// The names at one place of a body.
#[derive(Clone, Default)]
pub(crate) struct Scope(HashMap<Ident, Meaning>);

impl Scope {
    pub(super) fn bind(&mut self, names: impl IntoIterator<Item = Ident>, meaning: Meaning) {
        self.0.extend(names.into_iter().map(|name| (name, meaning)));
    }

    pub(crate) fn contains(&self, name: &Ident) -> bool {
        self.0.contains_key(name)
    }

    /// Whether it was declared by `let name ~ …`.
    pub(crate) fn is_unknown(&self, name: &Ident) -> bool {
        self.0.get(name) == Some(&Meaning::Unknown)
    }

    /// Whether it may hold unknowns.
    pub(crate) fn is_active(&self, name: &Ident) -> bool {
        self.0.get(name).is_some_and(|meaning| *meaning != Meaning::Known)
    }

    /// What the value of an expression is called.
    pub(super) fn meaning(&self, expr: &Expr) -> Meaning {
        match holds(expr, &|name| self.is_active(name)) {
            true => Meaning::Derived,
            false => Meaning::Known,
        }
    }

    /// All names, in order.
    pub(super) fn names(&self) -> Vec<String> {
        let mut names: Vec<_> = self.0.keys().map(Ident::to_string).collect();
        names.sort();
        names
    }
}
