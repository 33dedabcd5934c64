//! Literals beside numbers of the model: `[0.5, x]`, `if c { x } else { 1.0 }`.
//!
//! What stands in one array, or ends the arms of one branch, has one type, and that of a literal is
//! `f64` where the others may be unknowns. So a literal in such a place takes its type from them, and
//! one that is assigned takes that of the variable. What has parts, as arrays, tuples and branches
//! within, is taken apart.

//!
//! A variable that begins as a literal, as in `let mut s = 0.0;`, is a number of the model if what follows
//! changes it to something that may hold unknowns, and so are the elements of `vec![0.0; n]`.

use quote::{ToTokens, quote};
use syn::{Expr, Lit, Pat, Stmt, UnOp};

use super::calls::{literal, real};
use crate::ast::{ArmBody, Block, Flow, Kind};
use crate::syntax::expressions::{is_arithmetic, is_type};

/// Methods that leave their type to what is done with it.
const OPEN: [&str; 6] = ["sum", "product", "into", "parse", "collect", "unwrap"];

/// Literals in an array, at the ends of the arms of a branch in an expression, or assigned.
pub(super) fn align(expr: &mut Expr) {
    match expr {
        Expr::Array(array) => siblings(array.elems.iter_mut().collect(), false),
        Expr::If(_) | Expr::Match(_) => siblings(vec![expr], false),
        // whose type is that of the place
        Expr::Assign(assign) => siblings(vec![&mut *assign.right], true),
        _ => {}
    }
}

pub(super) fn can_align(expr: &Expr) -> bool {
    matches!(expr, Expr::Array(_) | Expr::Assign(_) | Expr::If(_) | Expr::Match(_))
}

/// Literals at the ends of arms.
pub(super) fn align_arms(flow: &mut Flow) {
    siblings(ends_of_arms(flow), false);
}

/// What must have one type, which may be known: literals take that of the others; where all have
/// parts, as `Normal(x, 0.5)` and `Normal(0.0, y)` do, these are siblings in turn.
fn siblings(exprs: Vec<&mut Expr>, is_known: bool) {
    let mut exprs: Vec<&mut Expr> = exprs.into_iter().flat_map(ends).collect();
    let is_known = is_known || exprs.iter().any(|expr| has_type(expr));
    if is_known {
        exprs.iter_mut().filter(|expr| is_literal(expr)).for_each(|expr| **expr = literal(expr));
    }
    let mut with_parts: Vec<_> =
        exprs.into_iter().filter_map(|expr| Some((shape(expr)?, expr))).collect();
    let Some((first, _)) = with_parts.first() else { return };
    let first = first.clone();
    with_parts.retain(|(shape, _)| *shape == first);
    let exprs = with_parts.into_iter().map(|(_, expr)| expr);
    if first == ARRAY {
        return siblings(exprs.flat_map(parts).collect(), is_known);
    }
    let is_known = is_known && first.starts_with(TUPLE);
    let mut parts: Vec<_> = exprs.map(|expr| parts(expr).into_iter()).collect();
    loop {
        let same: Vec<_> = parts.iter_mut().filter_map(Iterator::next).collect();
        if same.is_empty() {
            return;
        }
        siblings(same, is_known);
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
        Expr::Try(attempt) => has_type(&attempt.expr),
        Expr::Call(call) => is_function(&call.func),
        _ => false,
    }
}

/// Not one of a type, as `Real::from` or `Default::default`, which may leave open what it returns.
fn is_function(function: &Expr) -> bool {
    let Expr::Path(path) = function else { return false };
    let is_small = |segment: &syn::PathSegment| {
        segment.ident.to_string().starts_with(|c: char| c.is_lowercase() || c == '_')
    };
    path.qself.is_none() && path.path.segments.iter().all(is_small)
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
            call.mac.tokens = match elements {
                Expr::Repeat(repeat) => {
                    let (element, length) = (&repeat.expr, &repeat.len);
                    quote!(#element; #length)
                }
                Expr::Array(array) => array.elems.to_token_stream(),
                _ => return false,
            };
            is_lifted
        }
        number if is_literal(number) => {
            *number = real(number);
            true
        }
        _ => false,
    }
}
