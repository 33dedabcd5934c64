//! Arithmetic, calls and iterators as they are written.

use quote::ToTokens;
use syn::ext::IdentExt;
use syn::{BinOp, Expr, ExprCall, ExprMethodCall, Ident, Path, UnOp};

use crate::syntax::tokens::says;

/// The functions of `ppl::Scalar` that formulas have.
const FUNCTIONS: [&str; 16] = [
    "exp", "exp_m1", "ln", "ln_1p", "sqrt", "square", "recip", "powi", "powf", "pow", "sin", "cos",
    "tanh", "abs", "logistic", "softplus",
];

/// What a plate may do with unknowns on the way in without its length depending on them.
const ITERATION: [&str; 7] = ["iter", "into_iter", "zip", "enumerate", "rev", "len", "copied"];

/// `Beta` is a type, `beta_around` is a function.
pub(crate) fn is_type(function: &Expr) -> bool {
    last_word(function).is_some_and(|word| word.starts_with(char::is_uppercase))
}

/// Whether a function is called, by its Rust name: constructors of distributions are types.
pub(crate) fn calls_function(expr: &Expr) -> bool {
    let Expr::Call(call) = expr else { return false };
    let word = last_word(&call.func);
    word.is_some_and(|word| word.starts_with(|c: char| c.is_lowercase() || c == '_'))
}

fn last_word(function: &Expr) -> Option<String> {
    let Expr::Path(path) = function else { return None };
    Some(path.path.segments.last()?.ident.unraw().to_string())
}

/// Whether a path ends with these words.
pub(crate) fn ends_with(path: &Path, words: &[&str]) -> bool {
    let mut named = path.segments.iter().rev().map(|segment| &segment.ident);
    words.iter().rev().all(|word| named.next().is_some_and(|name| name == word))
}

/// Number of operations that a formula would join.
pub(crate) fn operations(expr: &Expr) -> usize {
    formula(expr, &mut Vec::new())
}

/// Adds what a formula is made of; returns the number of operations that join it.
pub(crate) fn formula<'a>(expr: &'a Expr, operands: &mut Vec<&'a Expr>) -> usize {
    match expr {
        Expr::Paren(paren) => formula(&paren.expr, operands),
        Expr::Group(group) => formula(&group.expr, operands),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => {
            1 + formula(&unary.expr, operands)
        }
        Expr::Binary(binary) if is_arithmetic(&binary.op) => {
            1 + formula(&binary.left, operands) + formula(&binary.right, operands)
        }
        Expr::MethodCall(call) if is_function(call) => 1 + formula(&call.receiver, operands),
        other => {
            operands.push(other);
            usize::from(dot(other).is_some())
        }
    }
}

/// Rust in which a name may come to mean something else.
pub(crate) fn binds_names(expr: &Expr) -> bool {
    matches!(
        expr,
        Expr::Block(_)
            | Expr::Closure(_)
            | Expr::ForLoop(_)
            | Expr::If(_)
            | Expr::Let(_)
            | Expr::Loop(_)
            | Expr::Match(_)
            | Expr::Unsafe(_)
            | Expr::While(_)
    )
}

/// `dot(data, numbers)`, a formula by itself.
pub(crate) fn dot(expr: &Expr) -> Option<&ExprCall> {
    match expr {
        Expr::Call(call) if plain_function(call).is_some_and(|name| name == "dot") => Some(call),
        _ => None,
    }
}

/// The name of what is called, if that is a name alone.
pub(crate) fn plain_function(call: &ExprCall) -> Option<&Ident> {
    match &*call.func {
        Expr::Path(path) => path.path.get_ident(),
        _ => None,
    }
}

pub(crate) fn is_function(call: &ExprMethodCall) -> bool {
    FUNCTIONS.iter().any(|name| call.method == name)
}

pub(crate) fn is_arithmetic(op: &BinOp) -> bool {
    matches!(op, BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_))
}

pub(crate) fn is_comparison(op: &BinOp) -> bool {
    matches!(
        op,
        BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
    )
}

/// The place that is changed by `place = value` or `place += value`, and the value.
pub(crate) fn assignment(expr: &Expr) -> Option<(&Expr, &Expr)> {
    match expr {
        Expr::Assign(assign) => Some((&assign.left, &assign.right)),
        Expr::Binary(update) if is_assignment(&update.op) => Some((&update.left, &update.right)),
        _ => None,
    }
}

/// `+=` and its kind.
pub(crate) fn is_assignment(op: &BinOp) -> bool {
    let text = op.to_token_stream().to_string();
    text.ends_with('=') && !is_comparison(op)
}

/// `+` of `+=`.
pub(crate) fn without_assignment(op: &BinOp) -> Option<BinOp> {
    let text = op.to_token_stream().to_string();
    let plain = syn::parse_str(text.strip_suffix('=')?).ok()?;
    is_arithmetic(&plain).then_some(plain)
}

/// Whether an iterator over unknowns runs over all of them.
pub(crate) fn keeps_its_length(iter: &Expr) -> bool {
    match iter {
        Expr::Path(_) | Expr::Field(_) | Expr::Lit(_) | Expr::Index(_) => true,
        Expr::Reference(reference) => keeps_its_length(&reference.expr),
        Expr::Paren(paren) => keeps_its_length(&paren.expr),
        Expr::Range(range) => range.start.iter().chain(&range.end).all(|end| keeps_its_length(end)),
        Expr::MethodCall(call) => {
            ITERATION.iter().any(|name| call.method == name)
                && keeps_its_length(&call.receiver)
                && call.args.iter().all(keeps_its_length)
        }
        _ => false,
    }
}

/// Whether a loop takes its data out of an iterator that others may go on with.
pub(crate) fn is_consumed(iter: &Expr) -> bool {
    ["by_ref", "mut"].iter().any(|word| says(iter.to_token_stream(), word))
}
