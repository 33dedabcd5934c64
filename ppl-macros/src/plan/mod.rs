//! How the Rust of statements will be written, and what that asks of what is around: places in the
//! results, and sums over a loop.

mod calls;
mod expressions;
mod literals;

use std::collections::{BTreeSet, HashMap, HashSet};

use syn::visit_mut::VisitMut;
use syn::{Expr, Ident, Pat};

use crate::analyse::{Analysis, Plate, Site};
use crate::ast::{Flow, Id, Model};

pub(crate) use calls::{here, shared_name, site};

/// Writes Rust anew on the way through the statements.
pub(crate) struct Plan<'a> {
    analysis: &'a Analysis,
    /// Whether arithmetic becomes formulas: that of a submodel goes over a tape.
    formulas: bool,
    /// The places that statements speak of.
    pub(crate) sites: Vec<Site>,
    /// The numbers of the places: statements that never say where they are have none.
    numbers: HashMap<Id, usize>,
    /// The statement around.
    pub(crate) at: Id,
    /// What the outermost loop around sums up apart.
    sums: Option<Sums>,
    /// Active names from outside of it that are the same in every iteration; none where a name may
    /// have come to mean something else.
    shared: HashSet<Ident>,
    /// Closures around in the statement.
    closures: usize,
}

/// What a loop sums up apart for all loops inside.
#[derive(Default)]
pub(crate) struct Sums {
    /// Names from outside whose adjoints it sums up.
    pub(crate) names: BTreeSet<Ident>,
    /// The observations in it whose terms it sums up, by their sites.
    pub(crate) terms: Vec<usize>,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(model: &Model, analysis: &'a Analysis) -> Self {
        Self {
            analysis,
            formulas: model.value.is_none(),
            sites: Vec::new(),
            numbers: HashMap::new(),
            at: Id(0),
            sums: None,
            shared: HashSet::new(),
            closures: 0,
        }
    }

    /// The place of the statement.
    pub(crate) fn site(&mut self) -> usize {
        let (sites, site) = (&mut self.sites, self.analysis.facts.sites.get(&self.at));
        *self.numbers.entry(self.at).or_insert_with(|| {
            sites.extend(site.cloned());
            sites.len().saturating_sub(1)
        })
    }

    /// Rust as `write` writes it.
    pub(crate) fn written<T: Clone>(
        &mut self,
        rust: &T,
        write: impl FnOnce(&mut Self, &mut T),
    ) -> T {
        let mut rust = rust.clone();
        write(self, &mut rust);
        rust
    }

    /// What is known of a loop, if it can be more than a loop of Rust.
    pub(crate) fn plate(&self, statement: Id) -> Option<&'a Plate> {
        self.analysis.facts.plates.get(&statement).filter(|_| self.formulas)
    }

    /// Begins to sum up apart, if this is the outermost loop.
    pub(crate) fn begin_sums(&mut self, plate: &Plate) -> bool {
        let is_outermost = self.sums.is_none();
        if is_outermost {
            if let Some(own) = &plate.own {
                let outer = self.analysis.activity.names().filter(|name| !own.contains(name));
                self.shared = outer.cloned().collect();
            }
            self.sums = Some(Sums::default());
        }
        is_outermost
    }

    /// Whether a loop sums up the terms of the observation with this site.
    pub(crate) fn sums_up(&mut self, site: usize) -> bool {
        self.sums.iter_mut().for_each(|sums| sums.terms.push(site));
        self.sums.is_some()
    }

    /// What the outermost loop has summed up.
    pub(crate) fn end_sums(&mut self) -> Sums {
        self.shared.clear();
        self.sums.take().unwrap_or_default()
    }

    /// What a name is declared with, by the statement around.
    pub(crate) fn declared(&mut self, pat: &Pat, value: &Expr) -> Expr {
        let mut value = value.clone();
        if self.analysis.facts.begins.contains(&self.at) {
            literals::begin(pat, &mut value);
        }
        match self.formulas && self.analysis.facts.open.contains(&self.at) {
            true => self.open(&mut value),
            false => self.visit_expr_mut(&mut value),
        }
        value
    }

    /// Labels are a closure, where `?` is its own.
    pub(crate) fn labels(&mut self, labels: &mut Expr) {
        self.closures += 1;
        self.visit_expr_mut(labels);
        self.closures -= 1;
    }

    /// A place is no arithmetic, whatever its index computes.
    pub(crate) fn place(&mut self, place: &mut Expr) {
        let formulas = std::mem::replace(&mut self.formulas, false);
        let shared = std::mem::take(&mut self.shared);
        self.visit_expr_mut(place);
        (self.formulas, self.shared) = (formulas, shared);
    }

    /// Branches with a value: their arms have one type.
    pub(crate) fn align(&mut self, flow: &mut Flow) {
        literals::align_arms(flow, &self.analysis.activity);
    }
}
