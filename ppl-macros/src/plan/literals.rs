//! Types of literals next to numbers of the model: `[0.5, x]`, `if c { x } else { 1.0 }`.
//!
//! The elements of one array must have the same type, and so must the final values of the arms of one branch. A
//! literal has the type `f64`, but the other elements or final values may be unknowns. A literal in such a position
//! therefore takes the type of the other elements or final values, and an assigned literal takes the type of the
//! variable. Arrays, tuples and branches are handled recursively.
//!
//! A variable may begin as a literal, as in `let mut s = 0.0;`. The literal becomes a number of the model if
//! later statements change the variable to a value that may depend on unknowns. The elements of
//! `vec![0.0; n]` are handled in the same way.

use proc_macro2::TokenTree;
use quote::{ToTokens, quote};
use syn::{Expr, Lit, Pat, Stmt, UnOp};

use super::calls::{literal, real};
use crate::analyse::Activity;
use crate::ast::{Block, Flow, Kind};
use crate::syntax::expressions::{is_arithmetic, is_type};

/// Adapts the types of the literals in an array, in the final values of the arms of a branch, or on the right
/// side of an assignment.
pub(super) fn align(expr: &mut Expr, activity: &Activity) {
    match expr {
        Expr::Array(array) => siblings(array.elems.iter_mut().collect(), false, activity),
        Expr::If(_) | Expr::Match(_) => siblings(vec![expr], false, activity),
        // a literal on the right side takes the type of the variable on the left side
        Expr::Assign(assign) if activity.mentions(&assign.left) => {
            siblings(vec![&mut *assign.right], true, activity);
        }
        _ => {}
    }
}

/// Version of [`align`] for an `if`, a `match` or a block that contains statements of the model: adapts the literals in
/// the final values of the arms.
pub(super) fn align_arms(flow: &mut Flow, activity: &Activity) {
    siblings(ends_of_arms(flow), false, activity);
}

/// Adapts the types of the literals in a list of expressions that must have one type. `is_known` means that this type
/// is determined outside the list, by the assigned variable; otherwise literals are adapted only if an expression of
/// the list depends on unknowns. If the expressions have parts of the same kind, such as `Normal(x, 0.5)` and
/// `Normal(0.0, y)`, corresponding parts are handled recursively.
fn siblings(exprs: Vec<&mut Expr>, is_known: bool, activity: &Activity) {
    let mut exprs: Vec<&mut Expr> = exprs.into_iter().flat_map(ends).collect();
    let has_type = |expr: &Expr| {
        !matches!(expr, Expr::Macro(_)) && shape(expr).is_none() && activity.holds(expr)
    };
    let is_known = is_known || exprs.iter().any(|expr| has_type(expr));
    if is_known {
        exprs.iter_mut().filter(|expr| is_literal(expr)).for_each(|expr| **expr = literal(expr));
    }
    let with_parts = |expr: &&mut Expr| shape(expr).is_some();
    let mut with_parts: Vec<_> = exprs.into_iter().filter(with_parts).collect();
    let Some(first) = with_parts.first().and_then(|expr| shape(expr)) else { return };
    with_parts.retain(|expr| shape(expr).as_ref() == Some(&first));
    let mut sub_expressions: Vec<_> =
        with_parts.into_iter().map(|expr| sub_expressions(expr).into_iter()).collect();
    if first == ARRAY {
        return siblings(sub_expressions.into_iter().flatten().collect(), is_known, activity);
    }
    let is_known = is_known && first.starts_with(TUPLE);
    loop {
        let same: Vec<_> = sub_expressions.iter_mut().filter_map(Iterator::next).collect();
        if same.is_empty() {
            return;
        }
        siblings(same, is_known, activity);
    }
}

const ARRAY: &str = "[]";
const TUPLE: &str = "(";

/// Returns a description of the form of an expression with parts: constructor and number of arguments, tuple length,
/// or array. The parts of expressions with the same form correspond. Returns None for an expression without parts.
fn shape(expr: &Expr) -> Option<String> {
    match expr {
        Expr::Call(call) if is_type(&call.func) => {
            Some(format!("{}({})", call.func.to_token_stream(), call.args.len()))
        }
        Expr::MethodCall(call) => Some(format!(".{} {}", call.method, shape(&call.receiver)?)),
        Expr::Tuple(tuple) => Some(format!("{TUPLE}{})", tuple.elems.len())),
        // all elements of an array have one type, so the length does not matter
        Expr::Array(_) | Expr::Repeat(_) => Some(ARRAY.to_owned()),
        _ => None,
    }
}

fn sub_expressions(expr: &mut Expr) -> Vec<&mut Expr> {
    match expr {
        Expr::Call(call) => call.args.iter_mut().collect(),
        Expr::MethodCall(call) => sub_expressions(&mut call.receiver),
        Expr::Tuple(tuple) => tuple.elems.iter_mut().collect(),
        Expr::Array(array) => array.elems.iter_mut().collect(),
        Expr::Repeat(repeat) => vec![&mut *repeat.expr],
        _ => Vec::new(),
    }
}

/// Whether an expression is a floating-point literal, or arithmetic of literals.
fn is_literal(expr: &Expr) -> bool {
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

/// Returns the final values of all arms; an arm without a final value is skipped.
fn ends_of_arms(flow: &mut Flow) -> Vec<&mut Expr> {
    match flow {
        Flow::If { then, otherwise: Some((_, otherwise)), .. } => {
            let mut values = ends_of_block(then);
            values.extend(ends_of_arms(otherwise));
            values
        }
        Flow::Match { arms, .. } => {
            arms.iter_mut().flat_map(|arm| ends_of_arms(&mut arm.body)).collect()
        }
        Flow::Block(block) => ends_of_block(block),
        Flow::Value(value) => ends(value),
        Flow::If { .. } => Vec::new(),
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
            let mut values = last(&mut branch.then_branch);
            if let Some((_, otherwise)) = &mut branch.else_branch {
                values.extend(ends(otherwise));
            }
            values
        }
        Expr::Match(branch) => branch.arms.iter_mut().flat_map(|arm| ends(&mut arm.body)).collect(),
        Expr::Block(block) => last(&mut block.block),
        other => vec![other],
    }
}

/// Converts an initial value that consists only of literals into numbers of the model.
pub(super) fn begin(pat: &Pat, value: &mut Expr) {
    let mut start = value.clone();
    if matches!(pat, Pat::Ident(_)) && is_lifted(&mut start) {
        *value = start;
    }
}

/// Converts the literals of an expression into numbers of the model. Returns whether the expression consists only of
/// literals.
fn is_lifted(expr: &mut Expr) -> bool {
    match expr {
        Expr::Repeat(repeat) => is_lifted(&mut repeat.expr),
        Expr::Array(array) => !array.elems.is_empty() && array.elems.iter_mut().all(is_lifted),
        Expr::Macro(call) if call.mac.path.is_ident("vec") => {
            let tokens = &call.mac.tokens;
            let Ok(mut elements) = syn::parse2(quote!([#tokens])) else { return false };
            let is_lifted = is_lifted(&mut elements);
            // remove the brackets
            if let Some(TokenTree::Group(list)) = elements.to_token_stream().into_iter().next() {
                call.mac.tokens = list.stream();
            }
            is_lifted
        }
        number if is_literal(number) => {
            *number = real(number);
            true
        }
        _ => false,
    }
}
