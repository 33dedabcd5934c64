//! Arithmetic as it is written in a model, and the calls that make formulas of it.

use proc_macro2::Span;
use quote::{format_ident, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::{BinOp, Expr, ExprMethodCall, Ident, UnOp};

/// The functions of `ppl::Scalar` that formulas have.
const FUNCTIONS: [&str; 16] = [
    "exp", "exp_m1", "ln", "ln_1p", "sqrt", "square", "recip", "powi", "powf", "pow", "sin", "cos",
    "tanh", "abs", "logistic", "softplus",
];

/// Operations that one formula joins: the type of a longer one, as of a sum of a hundred terms, would
/// pass rustc's limits. Its parts are numbers.
pub(crate) const LONGEST: usize = 24;

/// `Normal` is a type, `normal_around` is a function.
pub(crate) fn is_type(function: &Expr) -> bool {
    matches!(function, Expr::Path(path) if path
        .path
        .segments
        .last()
        .is_some_and(|last| last.ident.to_string().starts_with(char::is_uppercase)))
}

/// Number of operations that a formula would join.
pub(crate) fn operations(expr: &Expr) -> usize {
    match expr {
        Expr::Paren(paren) => operations(&paren.expr),
        Expr::Group(group) => operations(&group.expr),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => 1 + operations(&unary.expr),
        Expr::Binary(binary) if is_arithmetic(&binary.op) => {
            1 + operations(&binary.left) + operations(&binary.right)
        }
        Expr::MethodCall(call) if is_function(call) => 1 + operations(&call.receiver),
        other => usize::from(is_dot(other)),
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

/// The numbers in `dot(data, &numbers)`.
pub(crate) fn numbers_of_dot(expr: &mut Expr) -> Option<&mut Expr> {
    let is_dot = is_dot(expr);
    match expr {
        Expr::Call(call) if is_dot => match call.args.last_mut() {
            Some(Expr::Reference(numbers)) => Some(&mut *numbers.expr),
            _ => None,
        },
        _ => None,
    }
}

/// `dot(…)`, a formula by itself.
pub(crate) fn is_dot(expr: &Expr) -> bool {
    matches!(expr, Expr::Call(call) if matches!(&*call.func, Expr::Path(path) if path.path.is_ident("dot")))
}

/// The variable that sums up the adjoint of `name` in a plate.
pub(crate) fn sum_of(name: &Ident) -> Ident {
    format_ident!("__sum_{}", name.unraw(), span = Span::mixed_site().located_at(name.span()))
}

pub(crate) fn is_function(call: &ExprMethodCall) -> bool {
    FUNCTIONS.iter().any(|name| call.method == name)
}

pub(crate) fn is_arithmetic(op: &BinOp) -> bool {
    matches!(op, BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_))
}

/// `+` of `+=`.
pub(crate) fn without_assignment(op: &BinOp) -> Option<BinOp> {
    match op {
        BinOp::AddAssign(_) => Some(BinOp::Add(Default::default())),
        BinOp::SubAssign(_) => Some(BinOp::Sub(Default::default())),
        BinOp::MulAssign(_) => Some(BinOp::Mul(Default::default())),
        BinOp::DivAssign(_) => Some(BinOp::Div(Default::default())),
        _ => None,
    }
}

pub(crate) fn operand(expr: &Expr) -> Expr {
    call(expr, expr.span(), "operand")
}

pub(crate) fn closed(expr: &Expr, span: Span) -> Expr {
    call(expr, span, "closed")
}

fn call(expr: &Expr, span: Span, method: &str) -> Expr {
    let span = Span::mixed_site().located_at(span);
    let method = Ident::new(method, span);
    Expr::Verbatim(quote_spanned!(span=> (&::ppl::__private::Of(&(#expr))).#method()))
}
