//! Rewrites the Rust code of statements, and collects the sites and the sums over loops that the rewritten code uses.

mod calls;
mod expressions;
mod literals;

use std::collections::{BTreeSet, HashMap, HashSet};

use syn::visit_mut::VisitMut;
use syn::{Expr, Ident, Pat};

use crate::analyse::{Analysis, Plate, Site};
use crate::ast::{Flow, Id};

pub(crate) use calls::{here, shared_name, site};

/// Rewrites the Rust code of the statements, in source order.
pub(crate) struct Plan<'a> {
    analysis: &'a Analysis,
    /// Whether arithmetic is rewritten as formulas. False while the left side of an observation or
    /// of an assignment is rewritten.
    formulas: bool,
    /// The sites to which emitted statements refer. A site is the position and the name of a statement.
    pub(crate) sites: Vec<Site>,
    /// Index into `sites` for each statement. A statement whose emitted code does not refer to its site has no
    /// entry.
    site_index: HashMap<Id, usize>,
    /// The current statement.
    pub(crate) at: Id,
    /// Sums of adjoints and of log density terms over the outermost enclosing loop; None outside loops.
    sums: Option<Sums>,
    /// Names from outside the loop whose values may depend on unknowns and are the same in every iteration. Empty in
    /// code that may bind these names again.
    shared: HashSet<Ident>,
    /// Number of enclosing closures within the statement.
    closures: usize,
}

/// Sums over a loop. The emitted code keeps them in local variables that it declares before the
/// outermost loop and uses in all nested loops.
#[derive(Default)]
pub(crate) struct Sums {
    /// Variables from outside the loop whose adjoints are summed.
    pub(crate) names: BTreeSet<Ident>,
    /// Sites of the observations in the loop whose log density terms are summed.
    pub(crate) terms: Vec<usize>,
}

impl<'a> Plan<'a> {
    pub(crate) fn new(analysis: &'a Analysis) -> Self {
        Self {
            analysis,
            formulas: true,
            sites: Vec::new(),
            site_index: HashMap::new(),
            at: Id(0),
            sums: None,
            shared: HashSet::new(),
            closures: 0,
        }
    }

    /// Returns the index of the site of the current statement in `sites`.
    pub(crate) fn site(&mut self) -> usize {
        let (sites, site) = (&mut self.sites, self.analysis.facts.sites.get(&self.at));
        *self.site_index.entry(self.at).or_insert_with(|| {
            sites.extend(site.cloned());
            sites.len().saturating_sub(1)
        })
    }

    /// Returns a copy of `rust` that `write` has rewritten.
    pub(crate) fn written<T: Clone>(
        &mut self,
        rust: &T,
        write: impl FnOnce(&mut Self, &mut T),
    ) -> T {
        let mut rust = rust.clone();
        write(self, &mut rust);
        rust
    }

    /// Returns the properties of a plate (a `for` loop of the model).
    pub(crate) fn plate(&self, statement: Id) -> Option<&'a Plate> {
        self.analysis.facts.plates.get(&statement)
    }

    /// Starts empty sums of adjoints and log density terms if the loop `plate` is not inside another loop.
    /// Returns whether the sums were started.
    pub(crate) fn begin_sums(&mut self, plate: &Plate) -> bool {
        let is_outermost = self.sums.is_none();
        if is_outermost {
            if let Some(bound) = &plate.bound {
                let outer = self.analysis.activity.names().filter(|name| !bound.contains(name));
                self.shared = outer.cloned().collect();
            }
            self.sums = Some(Sums::default());
        }
        is_outermost
    }

    /// Adds the observation with the index `site` to the sums of the outermost loop. Returns false outside loops.
    pub(crate) fn sums_up(&mut self, site: usize) -> bool {
        self.sums.iter_mut().for_each(|sums| sums.terms.push(site));
        self.sums.is_some()
    }

    /// Ends the outermost loop and returns its sums of adjoints and log density terms.
    pub(crate) fn end_sums(&mut self) -> Sums {
        self.shared.clear();
        self.sums.take().unwrap_or_default()
    }

    /// Returns the rewritten initial value of the current statement, which is a declaration.
    pub(crate) fn declared(&mut self, pat: &Pat, value: &Expr) -> Expr {
        let mut value = value.clone();
        if self.analysis.facts.begins.contains(&self.at) {
            literals::begin(pat, &mut value);
        }
        match self.formulas && self.analysis.facts.symbolic.contains(&self.at) {
            true => self.formula(&mut value),
            false => self.visit_expr_mut(&mut value),
        }
        value
    }

    /// Rewrites the code that computes the labels of a dimension. This code is emitted inside a closure, where
    /// `?` returns from the closure and not from the model.
    pub(crate) fn labels(&mut self, labels: &mut Expr) {
        self.closures += 1;
        self.visit_expr_mut(labels);
        self.closures -= 1;
    }

    /// Rewrites an observed or assigned place. Arithmetic in the index of the place does not become a formula.
    pub(crate) fn rewrite_place(&mut self, place: &mut Expr) {
        let formulas = std::mem::replace(&mut self.formulas, false);
        let shared = std::mem::take(&mut self.shared);
        self.visit_expr_mut(place);
        (self.formulas, self.shared) = (formulas, shared);
    }

    /// Adapts the literals in control flow that returns a value, so that the values of all arms have one type.
    pub(crate) fn align(&mut self, flow: &mut Flow) {
        literals::align_arms(flow, &self.analysis.activity);
    }
}
