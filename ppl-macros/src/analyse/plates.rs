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
use crate::syntax::tokens::{mentions, variables};
use crate::walk::{self, Walk};

/// What is known of a loop.
pub(crate) struct Plate {
    /// Whether it only says `y ~ D` of its own `y`, with one `D` for all.
    pub(crate) is_pooled: bool,
    /// Whether nothing that an iteration computes outlives it.
    pub(crate) unwinds: bool,
    /// The names that it binds or changes.
    pub(crate) own: HashSet<Ident>,
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
            let mut inside = Inside { own: HashSet::new(), writes: false };
            inside.statement(statement);
            let is_pooled = !self.activity.mentions(&plate.iter)
                && !is_consumed(&plate.iter)
                && observes_all_alike(plate);
            let plate = Plate { is_pooled, unwinds: !inside.writes, own: inside.own };
            self.found.insert(statement.id, plate);
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

/// The names that a loop binds or may change, and whether it may change any.
struct Inside {
    own: HashSet<Ident>,
    writes: bool,
}

impl Inside {
    fn changes(&mut self, place: &Expr) {
        self.writes = true;
        self.own.extend(root(place));
    }
}

impl<'a> Walk<'a> for Inside {
    fn statement(&mut self, statement: &'a Statement) {
        self.own.extend(statement.declared());
        walk::statement(self, statement);
    }
}

impl<'a> Visit<'a> for Inside {
    fn visit_pat(&mut self, pat: &'a Pat) {
        self.own.extend(bound_names(pat));
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        match stmt {
            // what else would it be called for?
            Stmt::Expr(Expr::MethodCall(call), _) => self.changes(&call.receiver),
            Stmt::Expr(Expr::Call(_), _) => self.writes = true,
            _ => {}
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Assign(assign) => self.changes(&assign.left),
            Expr::Binary(binary) if is_assignment(&binary.op) => self.changes(&binary.left),
            Expr::Reference(reference) if reference.mutability.is_some() => {
                self.changes(&reference.expr);
            }
            Expr::MethodCall(call) if changes(&call.method) => self.changes(&call.receiver),
            _ => {}
        }
        visit::visit_expr(self, expr);
    }

    fn visit_macro(&mut self, mac: &'a Macro) {
        // what is rejected leaves nothing behind
        if !mac.path.is_ident("reject") {
            self.writes = true;
            variables(mac.tokens.clone(), &mut |name| self.own.extend([name.clone()]));
        }
    }
}

/// Whether a method with a result may leave something behind too.
fn changes(method: &Ident) -> bool {
    method.to_string().ends_with("_mut") || method == "insert" || method == "replace"
}
