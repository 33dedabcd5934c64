//! Literals beside numbers of the model: `[0.5, x]`, `if c { x } else { 1.0 }`.
//!
//! What stands in one array, or ends the arms of one branch, has one type, and that of a literal is
//! `f64` where the others may be unknowns. So a literal in such a place takes its type from them, and
//! one that is assigned takes that of the variable. What has parts, as arrays, tuples and branches
//! within, is taken apart.
//!
//! A variable that begins as a literal, as in `let mut s = 0.0;`, is a number of the model if what follows
//! changes it to something that may hold unknowns, and so are the elements of `vec![0.0; n]`.

use proc_macro2::TokenTree;
use quote::{ToTokens, quote};
use syn::{Expr, Lit, Pat, Stmt, UnOp};

use super::calls::{literal, real};
use crate::analyse::Activity;
use crate::ast::{Block, Flow, Kind};
use crate::syntax::expressions::{is_arithmetic, is_type};

/// Literals in an array, at the ends of the arms of a branch in an expression, or assigned.
pub(super) fn align(expr: &mut Expr, activity: &Activity) {
    match expr {
        Expr::Array(array) => siblings(array.elems.iter_mut().collect(), false, activity),
        Expr::If(_) | Expr::Match(_) => siblings(vec![expr], false, activity),
        // whose type is that of the place
        Expr::Assign(assign) if activity.mentions(&assign.left) => {
            siblings(vec![&mut *assign.right], true, activity);
        }
        _ => {}
    }
}

/// Literals at the ends of arms.
pub(super) fn align_arms(flow: &mut Flow, activity: &Activity) {
    siblings(ends_of_arms(flow), false, activity);
}

/// What must have one type, which is known, or that of what holds unknowns: literals take it. Where all
/// have parts, as `Normal(x, 0.5)` and `Normal(0.0, y)` do, these are siblings in turn.
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
    let mut parts: Vec<_> = with_parts.into_iter().map(|expr| parts(expr).into_iter()).collect();
    if first == ARRAY {
        return siblings(parts.into_iter().flatten().collect(), is_known, activity);
    }
    let is_known = is_known && first.starts_with(TUPLE);
    loop {
        let same: Vec<_> = parts.iter_mut().filter_map(Iterator::next).collect();
        if same.is_empty() {
            return;
        }
        siblings(same, is_known, activity);
    }
}

const ARRAY: &str = "[]";
const TUPLE: &str = "(";

/// What expressions with parts of one kind have in common.
fn shape(expr: &Expr) -> Option<String> {
    match expr {
        Expr::Call(call) if is_type(&call.func) => {
            Some(format!("{}({})", call.func.to_token_stream(), call.args.len()))
        }
        Expr::MethodCall(call) => Some(format!(".{} {}", call.method, shape(&call.receiver)?)),
        Expr::Tuple(tuple) => Some(format!("{TUPLE}{})", tuple.elems.len())),
        // all elements have one type
        Expr::Array(_) | Expr::Repeat(_) => Some(ARRAY.to_owned()),
        _ => None,
    }
}

fn parts(expr: &mut Expr) -> Vec<&mut Expr> {
    match expr {
        Expr::Call(call) => call.args.iter_mut().collect(),
        Expr::MethodCall(call) => parts(&mut call.receiver),
        Expr::Tuple(tuple) => tuple.elems.iter_mut().collect(),
        Expr::Array(array) => array.elems.iter_mut().collect(),
        Expr::Repeat(repeat) => vec![&mut *repeat.expr],
        _ => Vec::new(),
    }
}

/// A number that is written out.
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

/// What the arms end with; one that ends with none is left out.
fn ends_of_arms(flow: &mut Flow) -> Vec<&mut Expr> {
    match flow {
        Flow::If { then, otherwise: Some((_, otherwise)), .. } => {
            let mut found = ends_of_block(then);
            found.extend(ends_of_arms(otherwise));
            found
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

/// Writes the literals that a variable begins with as numbers of the model.
pub(super) fn begin(pat: &Pat, value: &mut Expr) {
    let mut start = value.clone();
    if matches!(pat, Pat::Ident(_)) && is_lifted(&mut start) {
        *value = start;
    }
}

/// Whether there was nothing but literals, now numbers of the model.
fn is_lifted(expr: &mut Expr) -> bool {
    match expr {
        Expr::Repeat(repeat) => is_lifted(&mut repeat.expr),
        Expr::Array(array) => !array.elems.is_empty() && array.elems.iter_mut().all(is_lifted),
        Expr::Macro(call) if call.mac.path.is_ident("vec") => {
            let tokens = &call.mac.tokens;
            let Ok(mut elements) = syn::parse2(quote!([#tokens])) else { return false };
            let is_lifted = is_lifted(&mut elements);
            // without the brackets
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
