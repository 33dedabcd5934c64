//! Variables that Rust code may change.

use std::collections::HashSet;

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Macro, Pat, Stmt};

use crate::ast::Statement;
use crate::syntax::expressions::assignment;
use crate::syntax::patterns::bound_names;
use crate::syntax::places::root;
use crate::syntax::tokens::says;
use crate::walk::{self, Walk};

/// The names that a section of the body binds, and the variables that this section may change. An entry `None` in
/// `changed` is a change of a variable that cannot be identified.
#[derive(Default)]
pub(super) struct Changes {
    pub(super) bound: HashSet<Ident>,
    pub(super) changed: Vec<Option<Ident>>,
}

impl Changes {
    /// Returns the identifiable variables that an expression may change.
    pub(super) fn identified(expr: &Expr) -> impl Iterator<Item = Ident> + use<> {
        let mut changes = Self::default();
        changes.visit_expr(expr);
        changes.changed.into_iter().flatten()
    }
}

impl<'a> Walk<'a> for Changes {
    fn statement(&mut self, statement: &'a Statement) {
        self.bound.extend(statement.declared());
        walk::statement(self, statement);
    }
}

impl<'a> Visit<'a> for Changes {
    fn visit_pat(&mut self, pat: &'a Pat) {
        self.bound.extend(bound_names(pat));
        if says(pat.to_token_stream(), "ref") {
            self.changed.push(None);
        }
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        match stmt {
            // a method that is called as a statement may change its receiver
            Stmt::Expr(Expr::MethodCall(call), _) => self.changed.push(root(&call.receiver)),
            Stmt::Expr(Expr::Call(_), _) => self.changed.push(None),
            _ => {}
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        if let Some((place, _)) = assignment(expr) {
            self.changed.push(root(place));
        }
        match expr {
            Expr::Reference(reference) if reference.mutability.is_some() => {
                self.changed.push(root(&reference.expr));
            }
            Expr::MethodCall(call) if changes(&call.method) => {
                self.changed.push(root(&call.receiver))
            }
            _ => {}
        }
        visit::visit_expr(self, expr);
    }

    fn visit_macro(&mut self, mac: &'a Macro) {
        // `reject!` ends the evaluation: no later statement reads a variable that the macro changes
        if !mac.path.is_ident("reject") {
            self.changed.push(None);
        }
    }
}

/// Whether a method may change its receiver even though its result is used.
fn changes(method: &Ident) -> bool {
    method.to_string().ends_with("_mut") || method == "insert" || method == "replace"
}
