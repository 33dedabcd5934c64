//! How the Rust code of statements is rewritten, and what the rewritten code needs: sites, and sums over
//! loops.

mod calls;
mod expressions;
mod literals;

use std::collections::{BTreeSet, HashMap, HashSet};

use syn::visit_mut::VisitMut;
use syn::{Expr, Ident, Pat};

use crate::analyse::{Analysis, Plate, Site};
use crate::ast::{Flow, Id, Model};

pub(crate) use calls::{here, shared_name, site};

/// Rewrites the Rust code of the statements, in source order.
pub(crate) struct Plan<'a> {
    analysis: &'a Analysis,
    /// Whether arithmetic becomes formulas. False in a submodel, whose arithmetic is recorded on the tape one
    /// operation at a time.
    formulas: bool,
    /// The sites that statements refer to.
    pub(crate) sites: Vec<Site>,
    /// Indices into `sites`; statements that never refer to their site have none.
    numbers: HashMap<Id, usize>,
    /// The current statement.
    pub(crate) at: Id,
    /// Sums of the outermost enclosing loop; None outside loops.
    sums: Option<Sums>,
    /// Active names from outside the loop that have the same value in every iteration. Empty in code that may
    /// rebind names.
    shared: HashSet<Ident>,
    /// Number of enclosing closures within the statement.
    closures: usize,
}

/// Sums in local variables of the outermost loop, used by all loops inside.
#[derive(Default)]
pub(crate) struct Sums {
    /// Names from outside the loop whose adjoints are summed.
    pub(crate) names: BTreeSet<Ident>,
    /// Sites of the observations in the loop whose log density terms are summed.
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

    /// Index of the site of the current statement.
    pub(crate) fn site(&mut self) -> usize {
        let (sites, site) = (&mut self.sites, self.analysis.facts.sites.get(&self.at));
        *self.numbers.entry(self.at).or_insert_with(|| {
            sites.extend(site.cloned());
            sites.len().saturating_sub(1)
        })
    }

    /// A copy of Rust code, rewritten by `write`.
    pub(crate) fn written<T: Clone>(
        &mut self,
        rust: &T,
        write: impl FnOnce(&mut Self, &mut T),
    ) -> T {
        let mut rust = rust.clone();
        write(self, &mut rust);
        rust
    }

    /// Properties of a plate. None in a submodel, where a plate is a plain Rust loop.
    pub(crate) fn plate(&self, statement: Id) -> Option<&'a Plate> {
        self.analysis.facts.plates.get(&statement).filter(|_| self.formulas)
    }

    /// Begins the sums if no enclosing loop has any; returns whether it did.
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

    /// Adds the observation with this site to the sums of the outermost loop; false outside loops.
    pub(crate) fn sums_up(&mut self, site: usize) -> bool {
        self.sums.iter_mut().for_each(|sums| sums.terms.push(site));
        self.sums.is_some()
    }

    /// Ends the outermost loop and returns its sums.
    pub(crate) fn end_sums(&mut self) -> Sums {
        self.shared.clear();
        self.sums.take().unwrap_or_default()
    }

    /// The rewritten initial value of the current statement, a declaration.
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

    /// Rewrites labels, which are emitted in a closure: `?` leaves only the closure.
    pub(crate) fn labels(&mut self, labels: &mut Expr) {
        self.closures += 1;
        self.visit_expr_mut(labels);
        self.closures -= 1;
    }

    /// Rewrites a place. Arithmetic in its index does not become a formula.
    pub(crate) fn place(&mut self, place: &mut Expr) {
        let formulas = std::mem::replace(&mut self.formulas, false);
        let shared = std::mem::take(&mut self.shared);
        self.visit_expr_mut(place);
        (self.formulas, self.shared) = (formulas, shared);
    }

    /// Adapts literals in control flow with a value, so that all arms have one type.
    pub(crate) fn align(&mut self, flow: &mut Flow) {
        literals::align_arms(flow, &self.analysis.activity);
    }
}
