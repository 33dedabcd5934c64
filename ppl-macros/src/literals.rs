//! Literals beside numbers of the model: `[0.5, x]`, `if c { x } else { 1.0 }`.
//!
//! What stands in one array, or ends the arms of one branch, has one type, and that of a literal is
//! `f64` where the others may be unknowns. So a literal in such a place takes its type from them, and
//! one that is assigned takes that of the variable.

use proc_macro2::Span;
use quote::{ToTokens, quote_spanned};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, Item, Lit, Stmt, UnOp};

use crate::arithmetic::{is_arithmetic, is_type};
use crate::ast::{ArmBody, Block, Flow, Init, Kind};
use crate::derived::Derived;
use crate::starts;

/// Methods that leave their type to what is done with it.
const OPEN: [&str; 6] = ["sum", "product", "into", "parse", "collect", "unwrap"];

/// Literals in an array, at the ends of the arms of a branch in an expression, or assigned.
pub(crate) fn align(expr: &mut Expr) {
    match expr {
        Expr::Array(array) => siblings(array.elems.iter_mut().collect()),
        Expr::If(_) | Expr::Match(_) => siblings(ends(expr)),
        // whose type is that of the place
        Expr::Assign(assign) => {
            ends(&mut assign.right).into_iter().filter(|expr| is_literal(expr)).for_each(wrap);
        }
        _ => {}
    }
}

pub(crate) fn can_align(expr: &Expr) -> bool {
    matches!(expr, Expr::Array(_) | Expr::Assign(_) | Expr::If(_) | Expr::Match(_))
}

/// Literals at the ends of arms.
pub(crate) fn align_arms(flow: &mut Flow) {
    siblings(ends_of_arms(flow));
}

/// All of them in a submodel.
pub(crate) fn align_all(block: &mut Block, derived: &Derived) {
    for i in 0..block.statements.len() {
        let (before, after) = block.statements.split_at_mut(i + 1);
        let kind = &mut before[i].kind;
        if let Kind::Let { pat, init: Some(Init::Value { value, .. }), .. } = kind {
            starts::begin(pat, value, || derived.assigned_in(after));
        }
        match kind {
            Kind::Unknown { distribution: expr, .. }
            | Kind::Observe { distribution: expr, .. }
            | Kind::Impute { distribution: expr, .. }
            | Kind::Part { part: expr, .. }
            | Kind::Factor { weight: expr, .. }
            | Kind::Let { init: Some(Init::Value { value: expr, .. }), .. }
            | Kind::End(Init::Value { value: expr, .. }) => {
                Everywhere(derived).visit_expr_mut(expr)
            }
            Kind::Let { init: Some(Init::Flow(_, flow)), .. } | Kind::End(Init::Flow(_, flow)) => {
                align_arms(flow);
                inside(flow, derived);
            }
            Kind::Flow(flow) => inside(flow, derived),
            Kind::Rust(stmt) => Everywhere(derived).visit_stmt_mut(stmt),
            Kind::Let { init: None, .. } | Kind::Broken { .. } => {}
        }
    }
}

fn inside(flow: &mut Flow, derived: &Derived) {
    match flow {
        Flow::For { body, .. } => align_all(body, derived),
        Flow::If { then, otherwise, .. } => {
            align_all(then, derived);
            if let Some((_, otherwise)) = otherwise {
                inside(otherwise, derived);
            }
        }
        Flow::Match { arms, .. } => {
            for arm in arms {
                match &mut arm.body {
                    ArmBody::Block(block) => align_all(block, derived),
                    ArmBody::Value(value) => Everywhere(derived).visit_expr_mut(value),
                }
            }
        }
        Flow::Block(block) => align_all(block, derived),
    }
}

struct Everywhere<'a>(&'a Derived);

impl VisitMut for Everywhere<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if can_align(expr) && self.0.mentions(expr) {
            align(expr);
        }
        visit_mut::visit_expr_mut(self, expr);
    }

    // functions inside a model are functions of their own
    fn visit_item_mut(&mut self, _: &mut Item) {}
}

/// What must have one type: literals take that of the others; where all have parts, as
/// `Normal(x, 0.5)` and `Normal(0.0, y)` do, these are siblings in turn.
fn siblings(mut exprs: Vec<&mut Expr>) {
    if exprs.iter().any(|expr| is_literal(expr)) {
        if exprs.iter().any(|expr| has_type(expr)) {
            exprs.into_iter().filter(|expr| is_literal(expr)).for_each(wrap);
        }
        return;
    }
    let Some(first) = exprs.first() else { return };
    let shape = shape(first);
    if shape.is_none() || exprs.iter().any(|expr| self::shape(expr) != shape) {
        return;
    }
    let mut parts: Vec<_> = exprs.iter_mut().map(|expr| parts(expr).into_iter()).collect();
    loop {
        let same: Vec<_> = parts.iter_mut().filter_map(Iterator::next).collect();
        if same.is_empty() {
            return;
        }
        siblings(same);
    }
}

/// What expressions with parts of one kind have in common.
fn shape(expr: &Expr) -> Option<String> {
    match expr {
        Expr::Call(call) if is_type(&call.func) => {
            Some(format!("{}({})", call.func.to_token_stream(), call.args.len()))
        }
        Expr::MethodCall(call) => Some(format!(".{} {}", call.method, shape(&call.receiver)?)),
        Expr::Tuple(tuple) => Some(format!("({})", tuple.elems.len())),
        Expr::Array(array) => Some(format!("[{}]", array.elems.len())),
        _ => None,
    }
}

fn parts(expr: &mut Expr) -> Vec<&mut Expr> {
    match expr {
        Expr::Call(call) => call.args.iter_mut().collect(),
        Expr::MethodCall(call) => parts(&mut call.receiver),
        Expr::Tuple(tuple) => tuple.elems.iter_mut().collect(),
        Expr::Array(array) => array.elems.iter_mut().collect(),
        _ => Vec::new(),
    }
}

/// A number that is written out.
pub(crate) fn is_literal(expr: &Expr) -> bool {
    match expr {
        Expr::Lit(lit) => matches!(&lit.lit, Lit::Float(number) if number.suffix().is_empty()),
        Expr::Paren(paren) => is_literal(&paren.expr),
        Expr::Group(group) => is_literal(&group.expr),
        Expr::Unary(unary) => matches!(unary.op, UnOp::Neg(_)) && is_literal(&unary.expr),
        Expr::Binary(binary) => {
            is_arithmetic(&binary.op) && is_literal(&binary.left) && is_literal(&binary.right)
        }
        _ => false,
    }
}

/// Whether the type of an expression that is no literal stands firm without what is around it.
fn has_type(expr: &Expr) -> bool {
    match expr {
        Expr::Paren(paren) => has_type(&paren.expr),
        Expr::Group(group) => has_type(&group.expr),
        Expr::Unary(unary) => has_type(&unary.expr),
        Expr::Binary(binary) => {
            is_arithmetic(&binary.op) && (has_type(&binary.left) || has_type(&binary.right))
        }
        Expr::MethodCall(call) => {
            call.turbofish.is_some() || !OPEN.iter().any(|name| call.method == name)
        }
        Expr::Path(_) | Expr::Field(_) | Expr::Index(_) | Expr::Cast(_) => true,
        _ => false,
    }
}

fn wrap(expr: &mut Expr) {
    let span = Span::mixed_site().located_at(expr.span());
    *expr = Expr::Verbatim(quote_spanned!(span=> ::ppl::__private::literal(#expr)));
}

/// What the arms end with; one that ends with none is left out.
fn ends_of_arms(flow: &mut Flow) -> Vec<&mut Expr> {
    match flow {
        Flow::If { then, otherwise: Some((_, otherwise)), .. } => {
            let mut found = ends_of_block(then);
            found.extend(ends_of_arms(otherwise));
            found
        }
        Flow::Match { arms, .. } => arms
            .iter_mut()
            .flat_map(|arm| match &mut arm.body {
                ArmBody::Block(block) => ends_of_block(block),
                ArmBody::Value(value) => ends(value),
            })
            .collect(),
        Flow::Block(block) => ends_of_block(block),
        Flow::If { .. } | Flow::For { .. } => Vec::new(),
    }
}

fn ends_of_block(block: &mut Block) -> Vec<&mut Expr> {
    match block.statements.last_mut().map(|last| &mut last.kind) {
        Some(Kind::Rust(Stmt::Expr(value, None))) => ends(value),
        Some(Kind::Flow(flow)) => ends_of_arms(flow),
        _ => Vec::new(),
    }
}

fn ends(expr: &mut Expr) -> Vec<&mut Expr> {
    fn last(block: &mut syn::Block) -> Vec<&mut Expr> {
        match block.stmts.last_mut() {
            Some(Stmt::Expr(value, None)) => ends(value),
            _ => Vec::new(),
        }
    }
    match expr {
        Expr::If(branch) => {
            let mut found = last(&mut branch.then_branch);
            if let Some((_, otherwise)) = &mut branch.else_branch {
                found.extend(ends(otherwise));
            }
            found
        }
        Expr::Match(branch) => branch.arms.iter_mut().flat_map(|arm| ends(&mut arm.body)).collect(),
        Expr::Block(block) => last(&mut block.block),
        other => vec![other],
    }
}
