//! Whether every point runs the same statements.

use proc_macro2::TokenStream;
use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Stmt};

use super::activity::Activity;
use super::uses::Uses;
use crate::ast::{ArmBody, Block, Flow, Init, Kind, Mark};
use crate::syntax::expressions::{is_comparison, keeps_its_length};
use crate::syntax::tokens::says;

/// Whether every point runs the same statements, and none takes data from a point.
pub(crate) fn is_static(body: &Block, activity: &Activity, uses: &Uses) -> bool {
    let mut branches = Branches { activity, uses, is_static: true };
    branches.block(body, false);
    branches.is_static
}

struct Branches<'a> {
    activity: &'a Activity,
    uses: &'a Uses,
    is_static: bool,
}

impl Branches<'_> {
    fn block(&mut self, block: &Block, is_predicted: bool) {
        for statement in &block.statements {
            let is_predicted = is_predicted || statement.mark == Mark::Predict;
            // no density depends on it
            let is_unread = is_predicted || self.uses.never.contains(&statement.id);
            match &statement.kind {
                Kind::Unknown { distribution: expr, .. }
                | Kind::Observe { distribution: expr, .. }
                | Kind::Impute { distribution: expr, .. }
                | Kind::Factor { weight: expr, .. } => self.expr(expr, is_unread),
                // what it runs is not seen here
                Kind::Part { .. } => self.vary(is_unread),
                Kind::Let { init: Some(Init::Value { value, diverge, .. }), .. } => {
                    if diverge.is_some() && self.activity.mentions(value) {
                        self.vary(is_unread);
                    }
                    self.expr(value, is_unread);
                }
                Kind::Flow(flow) | Kind::Let { init: Some(Init::Flow(_, flow)), .. } => {
                    self.flow(flow, is_unread, is_predicted);
                }
                Kind::Rust(stmt) => {
                    let mut decides = Decides { activity: self.activity, found: false };
                    decides.visit_stmt(stmt);
                    if decides.found {
                        self.vary(is_unread);
                    }
                }
                Kind::Let { init: None, .. } | Kind::End(_) | Kind::Broken { .. } => {}
            }
        }
    }

    fn flow(&mut self, flow: &Flow, is_unread: bool, is_predicted: bool) {
        match flow {
            Flow::For(plate) => {
                if self.activity.mentions(&plate.iter) && !keeps_its_length(&plate.iter) {
                    self.vary(is_unread);
                }
                self.expr(&plate.iter, is_unread);
                self.block(&plate.body, is_predicted);
            }
            Flow::If { condition, then, otherwise, .. } => {
                // behind what only rejects all is as it was
                let rejects = otherwise.is_none() && only_rejects(then);
                self.condition(condition, is_unread || rejects);
                self.block(then, is_predicted);
                if let Some((_, otherwise)) = otherwise {
                    self.flow(otherwise, is_unread, is_predicted);
                }
            }
            Flow::Match { scrutinee, arms, .. } => {
                self.condition(scrutinee, is_unread);
                for arm in arms {
                    if let Some((_, guard)) = &arm.guard {
                        self.condition(guard, is_unread);
                    }
                    match &arm.body {
                        ArmBody::Block(block) => self.block(block, is_predicted),
                        ArmBody::Value(value) => self.expr(value, is_unread),
                    }
                }
            }
            Flow::Block(block) => self.block(block, is_predicted),
        }
    }

    fn condition(&mut self, condition: &Expr, is_unread: bool) {
        if self.activity.mentions(condition) {
            self.vary(is_unread);
        }
        self.expr(condition, is_unread);
    }

    fn expr(&mut self, expr: &Expr, is_unread: bool) {
        let mut decides = Decides { activity: self.activity, found: false };
        decides.visit_expr(expr);
        if decides.found {
            self.vary(is_unread);
        }
    }

    fn vary(&mut self, is_unread: bool) {
        self.is_static &= is_unread;
    }
}

/// Control flow, comparisons and plain values inside expressions, that depend on unknowns.
struct Decides<'a> {
    activity: &'a Activity,
    found: bool,
}

impl<'a> Visit<'a> for Decides<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        let decides = match expr {
            // what the branches are is looked at on the way down
            Expr::If(chosen) => chosen.cond.to_token_stream(),
            Expr::Match(chosen) => {
                let mut decides = chosen.expr.to_token_stream();
                // with their guards
                chosen.arms.iter().for_each(|arm| arm.pat.to_tokens(&mut decides));
                decides
            }
            Expr::While(_) | Expr::Loop(_) | Expr::ForLoop(_) => expr.to_token_stream(),
            Expr::Binary(binary) if is_comparison(&binary.op) => expr.to_token_stream(),
            Expr::MethodCall(call) if call.method == "value" => expr.to_token_stream(),
            // a number without its derivative, if it follows from unknowns
            Expr::Call(call) if is_conversion(&call.func) => call.args.to_token_stream(),
            Expr::Path(path) if path.path.segments.last().is_some_and(|s| s.ident == "value") => {
                expr.to_token_stream()
            }
            _ => TokenStream::new(),
        };
        self.found |= says(decides.clone(), "value") || self.activity.mentions(&decides);
        visit::visit_expr(self, expr);
    }
}

/// `Real::from`.
fn is_conversion(function: &Expr) -> bool {
    let Expr::Path(path) = function else { return false };
    let words: Vec<_> = path.path.segments.iter().map(|segment| &segment.ident).collect();
    matches!(words[..], [.., real, from] if real == "Real" && from == "from")
}

/// Whether a block is `reject!(…);` alone.
fn only_rejects(block: &Block) -> bool {
    let [only] = block.statements.as_slice() else { return false };
    let mac = match &only.kind {
        Kind::Rust(Stmt::Macro(call)) => &call.mac,
        Kind::Rust(Stmt::Expr(Expr::Macro(call), _)) => &call.mac,
        _ => return false,
    };
    mac.path.is_ident("reject")
}
