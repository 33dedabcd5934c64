//! Activity analysis: the names that may hold unknowns or values that depend on unknowns. These include
//! variables and vectors that begin as data and are changed later.

use std::collections::HashSet;

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Item, Local, Pat, PatIdent, Stmt};

use super::changes::Changes;
use crate::ast::{Block, Kind, Left, Statement};
use crate::syntax::expressions::{assignment, is_comparison};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::root;
use crate::syntax::tokens::mentions;
use crate::walk::{self, Walk};

/// The active names of a body. Scopes are ignored: a name is active in the whole body or not at all.
#[derive(Default)]
pub(crate) struct Activity {
    /// Names that may hold values which depend on unknowns.
    active: HashSet<Ident>,
    /// Names of variables to which a statement assigns a value that may depend on unknowns.
    changed: HashSet<Ident>,
}

impl Activity {
    /// Analyses a body. `given` are the names of the arguments that may be unknowns.
    pub(crate) fn new(body: &Block, given: impl IntoIterator<Item = Ident>) -> Self {
        let mut activity = Self { active: given.into_iter().collect(), ..Self::default() };
        activity.read(&body.statements);
        activity
    }

    /// Returns all active names, that is, names whose values may depend on unknowns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &Ident> {
        self.active.iter()
    }

    /// Whether the value of a name may depend on unknowns.
    pub(crate) fn is_active(&self, name: &Ident) -> bool {
        self.active.contains(name)
    }

    /// Whether tokens mention an active name, which may depend on unknowns.
    pub(crate) fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.is_active(name))
    }

    /// Whether the value of an expression may depend on unknowns.
    pub(crate) fn holds(&self, expr: &Expr) -> bool {
        holds(expr, &|name| self.is_active(name))
    }

    /// Whether a statement assigns to the variable a value that may depend on unknowns.
    pub(crate) fn is_changed(&self, name: &Ident) -> bool {
        self.changed.contains(name)
    }

    /// Whether the statements after a declaration assign to the declared variable a value that may depend on
    /// unknowns.
    pub(super) fn begins(&self, pat: &Pat, after: &[Statement]) -> bool {
        let Pat::Ident(PatIdent { ident: name, .. }) = pat else { return false };
        if !self.is_changed(name) {
            return false;
        }
        let mut later = Self { active: self.active.clone(), ..Self::default() };
        later.read(after);
        later.is_changed(name)
    }

    /// Analyses the statements repeatedly until no new names are found, because a statement in a loop can change a
    /// variable that an earlier statement of the loop uses.
    fn read(&mut self, statements: &[Statement]) {
        let size = |activity: &Self| (activity.active.len(), activity.changed.len());
        loop {
            let before = size(self);
            statements.iter().for_each(|statement| self.statement(statement));
            if before == size(self) {
                return;
            }
        }
    }

    fn changes(&mut self, names: impl IntoIterator<Item = Ident>) {
        for name in names {
            self.changed.insert(name.clone());
            self.active.insert(name);
        }
    }

    /// Marks the iterated variable of a loop as changed if the body changes a name of the loop pattern:
    /// `for x in xs.iter_mut() { *x = … }` changes `xs`.
    fn changes_elements(&mut self, pat: &Pat, iter: &Expr) {
        if bound_names(pat).iter().any(|name| self.is_changed(name)) {
            self.changes(Changes::identified(iter));
        }
    }
}

impl<'a> Walk<'a> for Activity {
    fn statement(&mut self, statement: &'a Statement) {
        match &statement.kind {
            Kind::Tilde { left: Left::Missing(place), .. } => self.active.extend(root(place)),
            Kind::Tilde { .. } => self.active.extend(statement.declared()),
            _ => {}
        }
        walk::statement(self, statement);
        if let Kind::For(plate) = &statement.kind {
            self.changes_elements(&plate.pat, &plate.iter);
        }
    }

    fn bind(&mut self, pat: &'a Pat, value: Option<&'a Expr>) {
        if value.is_none_or(|value| self.holds(value)) {
            self.active.extend(bound_names(pat));
        }
    }
}

impl<'a> Visit<'a> for Activity {
    fn visit_local(&mut self, local: &'a Local) {
        visit::visit_local(self, local);
        local.init.iter().for_each(|init| self.bind(&local.pat, Some(&init.expr)));
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        // a method that is called as a statement changes its receiver
        if let Stmt::Expr(Expr::MethodCall(call), Some(_)) = stmt
            && call.args.iter().any(|argument| self.holds(argument))
        {
            self.changes(root(&call.receiver));
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        visit::visit_expr(self, expr);
        match expr {
            Expr::Call(_) if self.holds(expr) => self.changes(Changes::identified(expr)),
            Expr::ForLoop(each) => {
                self.bind(&each.pat, Some(&each.expr));
                self.changes_elements(&each.pat, &each.expr);
            }
            Expr::Let(binding) => self.bind(&binding.pat, Some(&binding.expr)),
            Expr::Match(choice) => {
                choice.arms.iter().for_each(|arm| self.bind(&arm.pat, Some(&choice.expr)));
            }
            _ => {}
        }
        if let Some((place, value)) = assignment(expr)
            && self.holds(value)
        {
            self.changes(root(place));
        }
    }

    // functions inside a model are not part of the model
    fn visit_item(&mut self, _: &'a Item) {}
}

/// Methods of unknowns and of arrays of unknowns that return plain numbers.
const PLAIN: [&str; 4] = ["value", "len", "is_empty", "is_constant"];

/// Whether the value of an expression may depend on the active names. The results of comparisons, casts and
/// the methods in [`PLAIN`] do not count.
pub(crate) fn holds(expr: &Expr, active: &impl Fn(&Ident) -> bool) -> bool {
    struct Holds<'f, F>(&'f F, bool);
    impl<'a, F: Fn(&Ident) -> bool> Visit<'a> for Holds<'_, F> {
        fn visit_expr(&mut self, expr: &'a Expr) {
            match expr {
                Expr::Cast(_) => {}
                Expr::MethodCall(call) if PLAIN.iter().any(|name| call.method == name) => {}
                Expr::Binary(binary) if is_comparison(&binary.op) => {}
                Expr::Path(_) | Expr::Macro(_) => {
                    self.1 |= mentions(expr.to_token_stream(), self.0);
                }
                _ => visit::visit_expr(self, expr),
            }
        }
    }
    let mut asks = Holds(active, false);
    asks.visit_expr(expr);
    asks.1
}
