//! Names in the results, and the places that are observed under them.

use std::collections::{HashMap, HashSet};

use quote::ToTokens;
use syn::ext::IdentExt;
use syn::{Expr, Ident, Member, Result, UnOp};

use crate::errors::{self, at};
use crate::lower::Site;

/// Something that can stand on the left of `~`.
pub(crate) struct Place {
    /// The variable that it belongs to.
    pub(crate) root: Ident,
    /// In results: with its fields, without indices.
    pub(crate) name: String,
    /// Whether it is an entry of something.
    is_entry: bool,
}

pub(crate) fn place(expr: &Expr) -> Result<Place> {
    match expr {
        Expr::Path(path) if path.qself.is_none() => {
            let root = path.path.segments.last().map(|segment| &segment.ident);
            let root = root.ok_or_else(|| at(expr, errors::NOT_A_PLACE))?;
            Ok(Place { root: root.clone(), name: root.unraw().to_string(), is_entry: false })
        }
        Expr::Field(field) => {
            let mut place = place(&field.base)?;
            place.name.push('.');
            match &field.member {
                Member::Named(name) => place.name.push_str(&name.unraw().to_string()),
                Member::Unnamed(index) => place.name.push_str(&index.index.to_string()),
            }
            Ok(place)
        }
        Expr::Index(index) => Ok(Place { is_entry: true, ..place(&index.expr)? }),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Deref(_)) => place(&unary.expr),
        Expr::Paren(paren) => place(&paren.expr),
        Expr::Group(group) => place(&group.expr),
        _ => Err(at(expr, errors::NOT_A_PLACE)),
    }
}

/// The names taken on the way to a statement.
#[derive(Clone, Default)]
pub(crate) struct Names {
    taken: HashMap<String, Taken>,
    /// Those that several statements observe, each some entries.
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
    pub(crate) fn declare(&mut self, name: &str, tokens: impl ToTokens) -> Result<()> {
        match self.taken.insert(name.to_owned(), Taken::Whole) {
            None => Ok(()),
            Some(_) => Err(at(tokens, errors::declared_twice(name))),
        }
    }

    /// Takes the name of a place in the loop of this number. Statements may observe entries of
    /// one name in turn, but not the same entry twice.
    pub(crate) fn observe(
        &mut self,
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
        if !is_first {
            self.shared.insert(name.clone());
        }
        Ok(())
    }

    /// Adds what another arm of a branch took.
    pub(crate) fn merge(&mut self, other: Self) {
        self.shared.extend(other.shared);
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
    pub(crate) fn stack(&self, sites: &mut [Site]) {
        for name in &self.shared {
            let own = |site: &Site| site.name == *name;
            let own_plates = sites.iter().filter(|site| own(site)).map(|site| &site.plates);
            let mut plates = own_plates.filter(|plates| !plates.is_empty());
            let first = plates.next().cloned().unwrap_or_default();
            let same = plates.all(|plates| *plates == first);
            let plates = if same { first } else { Vec::new() };
            for site in sites.iter_mut().filter(|site| own(site)) {
                site.repeated = true;
                site.plates.clone_from(&plates);
            }
        }
    }
}
