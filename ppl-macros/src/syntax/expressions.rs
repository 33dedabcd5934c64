//! Arithmetic, calls and iterators in expressions.

use quote::ToTokens;
use syn::ext::IdentExt;
use syn::{BinOp, Expr, ExprCall, ExprMethodCall, Ident, Path, UnOp};

use crate::syntax::tokens::says;

/// Methods of `ppl::Scalar` that a formula can contain.
const FUNCTIONS: [&str; 16] = [
    "exp", "exp_m1", "ln", "ln_1p", "sqrt", "square", "recip", "powi", "powf", "pow", "sin", "cos",
    "tanh", "abs", "logistic", "softplus",
];

/// Iterator methods that keep the length, so that the number of iterations of a plate (a `for` loop of the model)
/// over unknowns does not depend on the values of the unknowns.
const ITERATION: [&str; 7] = ["iter", "into_iter", "zip", "enumerate", "rev", "len", "copied"];

/// Whether a called function has an upper-case name like a type: `Beta` is a type, `beta_around` is a function.
pub(crate) fn is_type(function: &Expr) -> bool {
    last_word(function).is_some_and(|word| word.starts_with(char::is_uppercase))
}

/// Whether an expression calls a function with a lower-case name. Constructors of distributions are named
/// like types.
pub(crate) fn calls_function(expr: &Expr) -> bool {
    let Expr::Call(call) = expr else { return false };
    let word = last_word(&call.func);
    word.is_some_and(|word| word.starts_with(|c: char| c.is_lowercase() || c == '_'))
}

fn last_word(function: &Expr) -> Option<String> {
    let Expr::Path(path) = function else { return None };
    Some(path.path.segments.last()?.ident.unraw().to_string())
}

/// Whether a path ends with the given words.
pub(crate) fn ends_with(path: &Path, words: &[&str]) -> bool {
    let mut named = path.segments.iter().rev().map(|segment| &segment.ident);
    words.iter().rev().all(|word| named.next().is_some_and(|name| name == word))
}

/// Number of operations in the formula of an expression.
pub(crate) fn operations(expr: &Expr) -> usize {
    formula(expr, &mut Vec::new())
}

/// Adds the operands of a formula to `operands`; returns the number of operations.
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

/// Whether an expression may bind names, so that a name inside the expression may refer to a different variable than
/// outside.
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

/// Returns the call if an expression is `dot(data, numbers)`.
pub(crate) fn dot(expr: &Expr) -> Option<&ExprCall> {
    match expr {
        Expr::Call(call) if plain_function(call).is_some_and(|name| name == "dot") => Some(call),
        _ => None,
    }
}

/// Returns the name of the called function; None if the function is written with a path, such as `a::f`.
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

/// Returns the place and the value of an assignment `place = value` or `place += value`; None for any other
/// expression.
pub(crate) fn assignment(expr: &Expr) -> Option<(&Expr, &Expr)> {
    match expr {
        Expr::Assign(assign) => Some((&assign.left, &assign.right)),
        Expr::Binary(update) if is_assignment(&update.op) => Some((&update.left, &update.right)),
        _ => None,
    }
}

/// Whether an operator is a compound assignment such as `+=`.
pub(crate) fn is_assignment(op: &BinOp) -> bool {
    let text = op.to_token_stream().to_string();
    text.ends_with('=') && !is_comparison(op)
}

/// Returns the arithmetic operator of a compound assignment, such as `+` for `+=`.
pub(crate) fn without_assignment(op: &BinOp) -> Option<BinOp> {
    let text = op.to_token_stream().to_string();
    let plain = syn::parse_str(text.strip_suffix('=')?).ok()?;
    is_arithmetic(&plain).then_some(plain)
}

/// Whether the length of an iterator over unknowns does not depend on the values of the unknowns.
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

/// Whether a loop may consume items of an iterator that the model uses again after the loop.
pub(crate) fn is_consumed(iter: &Expr) -> bool {
    ["by_ref", "mut"].iter().any(|word| says(iter.to_token_stream(), word))
}
