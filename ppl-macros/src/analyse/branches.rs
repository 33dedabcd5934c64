//! Determines whether the model runs the same statements at every point of the parameter space.

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Stmt};

use super::activity::Activity;
use crate::ast::{Block, Flow, Init, Kind, Mark, Statement};
use crate::syntax::expressions::{ends_with, is_comparison, keeps_its_length};
use crate::syntax::patterns::bound_names;
use crate::syntax::tokens::{mentions, says};
use crate::walk::{self, Walk};

/// Whether the model runs the same statements and uses the same data at every point of the parameter space. The
/// statements of called submodels are not considered: the library checks at run time whether each submodel runs
/// the same statements at every point.
pub(super) fn is_static(body: &Block, activity: &Activity) -> bool {
    let mut branches = Branches { activity, is_static: true };
    branches.block(body);
    branches.is_static
}

struct Branches<'a> {
    activity: &'a Activity,
    is_static: bool,
}

impl Branches<'_> {
    /// Handles tokens that select the statements to run or the data to use. Clears `is_static` if the tokens mention
    /// a name that may depend on unknowns.
    fn decides(&mut self, tokens: &impl ToTokens) {
        self.is_static &= !self.activity.mentions(tokens);
    }
}

impl<'a> Walk<'a> for Branches<'_> {
    fn block(&mut self, block: &'a Block) {
        for (i, statement) in block.statements.iter().enumerate() {
            // skip these statements: no density depends on them
            let is_unread = statement.mark == Mark::Predict
                || is_only_recorded(statement, &block.statements[i + 1..]);
            if !is_unread {
                self.statement(statement);
            }
        }
    }

    fn statement(&mut self, statement: &'a Statement) {
        match &statement.kind {
            Kind::Let { init: Some(Init { value, diverge: Some(_), .. }), .. } => {
                value.rust().iter().for_each(|value| self.decides(value));
            }
            Kind::For(plate) if !keeps_its_length(&plate.iter) => self.decides(&plate.iter),
            _ => {}
        }
        walk::statement(self, statement);
    }

    fn flow(&mut self, flow: &'a Flow) {
        match flow {
            // a branch that only rejects does not affect later statements
            Flow::If { then, otherwise: None, .. } if only_rejects(then) => return,
            Flow::If { condition, .. } => self.decides(condition),
            Flow::Match { scrutinee, arms, .. } => {
                self.decides(scrutinee);
                arms.iter().flat_map(|arm| &arm.guard).for_each(|(_, guard)| self.decides(guard));
            }
            Flow::Block(_) | Flow::Value(_) => {}
        }
        walk::flow(self, flow);
    }
}

impl<'a> Visit<'a> for Branches<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::If(chosen) => self.decides(&chosen.cond),
            Expr::Match(chosen) => {
                self.decides(&chosen.expr);
                // in syn 3 the pattern of an arm includes its guard
                chosen.arms.iter().for_each(|arm| self.decides(&arm.pat));
            }
            Expr::While(_) | Expr::Loop(_) | Expr::ForLoop(_) => self.decides(expr),
            Expr::Binary(binary) if is_comparison(&binary.op) => self.decides(expr),
            // the method `value` returns a plain number, and the analysis cannot follow the uses of
            // this number
            Expr::MethodCall(call) if call.method == "value" => self.is_static = false,
            Expr::Path(path) if ends_with(&path.path, &["value"]) => self.is_static = false,
            Expr::Macro(call) if says(call.mac.tokens.clone(), "value") => self.is_static = false,
            Expr::Call(call) if is_conversion(&call.func) => self.decides(&call.args),
            _ => {}
        }
        visit::visit_expr(self, expr);
    }
}

fn is_conversion(function: &Expr) -> bool {
    matches!(function, Expr::Path(path) if ends_with(&path.path, &["Real", "from"]))
}

/// Whether a block contains only `reject!(…);`.
fn only_rejects(block: &Block) -> bool {
    match block.statements.as_slice() {
        [Statement { kind: Kind::Rust(Stmt::Expr(Expr::Macro(only), _)), .. }] => {
            only.mac.path.is_ident("reject")
        }
        _ => false,
    }
}

/// Whether a statement is a `#[track] let` whose names are used by predictions only, if at all.
fn is_only_recorded(statement: &Statement, after: &[Statement]) -> bool {
    let Kind::Let { pat, init: Some(Init { value: Flow::Value(_), .. }), .. } = &statement.kind
    else {
        return false;
    };
    let names = bound_names(pat);
    let asks = |later: &Statement| {
        later.mark != Mark::Predict && mentions(later.tokens.clone(), &|name| names.contains(name))
    };
    statement.mark == Mark::Track && !after.iter().any(asks)
}
