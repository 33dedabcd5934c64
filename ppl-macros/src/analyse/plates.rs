//! Plates: what a loop leaves to the library.

use std::collections::{HashMap, HashSet};

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Macro, Pat, Stmt};

use super::activity::Activity;
use crate::ast::{Block, For, Id, Kind, Left, Statement};
use crate::syntax::expressions::{is_assignment, is_consumed};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::root;
use crate::syntax::tokens::{mentions, says};
use crate::walk::{self, Walk};

/// What is known of a loop.
pub(crate) struct Plate {
    /// Whether it only says `y ~ D` of its own `y`, with one `D` for all.
    pub(crate) is_pooled: bool,
    /// Whether nothing that an iteration computes outlives it.
    pub(crate) unwinds: bool,
    /// The names that it binds, if it changes no others.
    pub(crate) own: Option<HashSet<Ident>>,
}

/// Those of a body, by their statements.
pub(super) fn plates(body: &Block, activity: &Activity) -> HashMap<Id, Plate> {
    let mut plates = Plates { activity, found: HashMap::new() };
    plates.block(body);
    plates.found
}

struct Plates<'a> {
    activity: &'a Activity,
    found: HashMap<Id, Plate>,
}

impl<'a> Walk<'a> for Plates<'_> {
    fn statement(&mut self, statement: &'a Statement) {
        if let Kind::For(plate) = &statement.kind {
            let mut inside = Inside::default();
            inside.statement(statement);
            let is_own = |name: &Option<Ident>| {
                name.as_ref().is_some_and(|name| inside.bound.contains(name))
            };
            let unwinds = inside.changed.is_empty();
            let own = inside.changed.iter().all(is_own).then_some(inside.bound);
            let is_pooled = !self.activity.mentions(&plate.iter)
                && !is_consumed(&plate.iter)
                && observes_all_alike(plate);
            self.found.insert(statement.id, Plate { is_pooled, unwinds, own });
        }
        walk::statement(self, statement);
    }
}

impl<'a> Visit<'a> for Plates<'_> {}

/// Whether the body is `y ~ D` alone, with `y` the loop's own and not in `D`.
fn observes_all_alike(plate: &For) -> bool {
    let Pat::Ident(pat) = &plate.pat else { return false };
    let [statement] = plate.body.statements.as_slice() else { return false };
    let Kind::Tilde { left: Left::Place(Expr::Path(place)), right, .. } = &statement.kind else {
        return false;
    };
    let tokens = right.to_token_stream();
    // a distribution that can leave the model has to be asked for every datum
    place.path.is_ident(&pat.ident)
        && !mentions(tokens.clone(), &|found| *found == pat.ident)
        && !tokens.to_string().contains('?')
}

/// The names that a loop binds, and what it may change: of none is known which.
#[derive(Default)]
struct Inside {
    bound: HashSet<Ident>,
    changed: Vec<Option<Ident>>,
}

impl<'a> Walk<'a> for Inside {
    fn statement(&mut self, statement: &'a Statement) {
        self.bound.extend(statement.declared());
        walk::statement(self, statement);
    }
}

impl<'a> Visit<'a> for Inside {
    fn visit_pat(&mut self, pat: &'a Pat) {
        self.bound.extend(bound_names(pat));
        if says(pat.to_token_stream(), "ref") {
            self.changed.push(None);
        }
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        match stmt {
            // what else would it be called for?
            Stmt::Expr(Expr::MethodCall(call), _) => self.changed.push(root(&call.receiver)),
            Stmt::Expr(Expr::Call(_), _) => self.changed.push(None),
            _ => {}
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Assign(assign) => self.changed.push(root(&assign.left)),
            Expr::Binary(binary) if is_assignment(&binary.op) => {
                self.changed.push(root(&binary.left))
            }
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
        // what is rejected leaves nothing behind
        if !mac.path.is_ident("reject") {
            self.changed.push(None);
        }
    }
}

/// Whether a method with a result may leave something behind too.
fn changes(method: &Ident) -> bool {
    method.to_string().ends_with("_mut") || method == "insert" || method == "replace"
}
