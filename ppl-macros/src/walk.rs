//! Traversal of a body, statement by statement in source order. Each analysis overrides the methods for the
//! nodes that it needs; syn's visitor continues into the Rust expressions.

use syn::visit::Visit;
use syn::{Expr, Pat};

use crate::ast::{Block, Flow, Init, Kind, Left, Statement};

pub(crate) trait Walk<'a>: Visit<'a> {
    fn block(&mut self, block: &'a Block) {
        self::block(self, block);
    }

    fn statement(&mut self, statement: &'a Statement) {
        self::statement(self, statement);
    }

    fn flow(&mut self, flow: &'a Flow) {
        self::flow(self, flow);
    }

    fn labels(&mut self, labels: &'a Expr) {
        self.visit_expr(labels);
    }

    /// Visits a pattern of `let`, `for` or an arm of `match`. `value` is the expression that the pattern
    /// destructures; None if statements of the model compute the value.
    fn bind(&mut self, pat: &'a Pat, value: Option<&'a Expr>) {
        let _ = value;
        self.visit_pat(pat);
    }
}

pub(crate) fn block<'a>(walk: &mut (impl Walk<'a> + ?Sized), block: &'a Block) {
    block.statements.iter().for_each(|statement| walk.statement(statement));
}

pub(crate) fn statement<'a>(walk: &mut (impl Walk<'a> + ?Sized), statement: &'a Statement) {
    let labels = statement.dims.iter().filter_map(|dim| dim.labels.as_ref());
    labels.for_each(|labels| walk.labels(labels));
    match &statement.kind {
        Kind::Tilde { left, right, .. } => {
            if let Left::Place(place) | Left::Missing(place) = left {
                walk.visit_expr(place);
            }
            walk.visit_expr(right);
        }
        Kind::Let { pat, init: Some(Init { value, diverge, .. }), .. } => {
            walk.flow(value);
            diverge.iter().for_each(|(_, block)| walk.block(block));
            walk.bind(pat, value.rust());
        }
        Kind::Let { pat, init: None, .. } => walk.visit_pat(pat),
        Kind::For(plate) => {
            walk.visit_expr(&plate.iter);
            plate.label.iter().for_each(|label| walk.visit_label(label));
            walk.bind(&plate.pat, Some(&plate.iter));
            walk.block(&plate.body);
        }
        Kind::Factor { weight, .. } => walk.visit_expr(weight),
        Kind::Flow(flow) | Kind::End(flow) => walk.flow(flow),
        Kind::Rust(stmt) => walk.visit_stmt(stmt),
        Kind::Broken { .. } => {}
    }
}

pub(crate) fn flow<'a>(walk: &mut (impl Walk<'a> + ?Sized), flow: &'a Flow) {
    match flow {
        Flow::If { condition, then, otherwise, .. } => {
            walk.visit_expr(condition);
            walk.block(then);
            otherwise.iter().for_each(|(_, flow)| walk.flow(flow));
        }
        Flow::Match { scrutinee, arms, .. } => {
            walk.visit_expr(scrutinee);
            for arm in arms {
                walk.bind(&arm.pat, Some(scrutinee));
                arm.guard.iter().for_each(|(_, guard)| walk.visit_expr(guard));
                walk.flow(&arm.body);
            }
        }
        Flow::Block(block) => walk.block(block),
        Flow::Value(value) => walk.visit_expr(value),
    }
}
