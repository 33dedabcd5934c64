//! `h[t] += a * h[t - 1];` on a vector of unknowns. Their `+=` is a call, which borrows `h` for
//! change before the right side reads it; so the right side comes first, as it does for `f64`.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote_spanned};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprBinary, Ident, Item, Stmt, UnOp};

use crate::inspect::mentions;
use crate::names::place;
use crate::rewrite::is_assignment;

/// A statement as it is emitted.
pub(crate) fn statement(stmt: &Stmt) -> TokenStream {
    let mut stmt = stmt.clone();
    Updates.visit_stmt_mut(&mut stmt);
    stmt.into_token_stream()
}

/// An expression as it is emitted.
pub(crate) fn expression(expr: &Expr) -> TokenStream {
    let mut expr = expr.clone();
    Updates.visit_expr_mut(&mut expr);
    expr.into_token_stream()
}

/// Runs last: nothing else has to know what an update looks like then.
struct Updates;

impl VisitMut for Updates {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        visit_mut::visit_expr_mut(self, expr);
        if let Expr::Binary(binary) = expr
            && is_assignment(&binary.op)
            && reads_what_it_changes(binary)
        {
            *expr = Expr::Verbatim(right_side_first(binary));
        }
    }

    // functions inside a model are functions of their own
    fn visit_item_mut(&mut self, _: &mut Item) {}
}

/// Whether an element is changed of what the right side mentions. All else stays as it is written.
fn reads_what_it_changes(binary: &ExprBinary) -> bool {
    let ExprBinary { left, right, .. } = binary;
    let root = place(left).ok().filter(|_| has_index(left)).map(|place| place.root.to_string());
    root.is_some_and(|root| mentions(right.to_token_stream(), &|name| name == root))
}

fn has_index(place: &Expr) -> bool {
    match place {
        Expr::Index(_) => true,
        Expr::Field(field) => has_index(&field.base),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Deref(_)) => has_index(&unary.expr),
        Expr::Paren(paren) => has_index(&paren.expr),
        Expr::Group(group) => has_index(&group.expr),
        _ => false,
    }
}

/// The effects of an index, if it has any, come after those of the right side, as with `f64`. A
/// `match` keeps what is temporary on the right for as long as the statement, where a `let` would not.
fn right_side_first(binary: &ExprBinary) -> TokenStream {
    let ExprBinary { attrs, left, op, right } = binary;
    let span = Span::mixed_site().located_at(right.span());
    let value = Ident::new("__value", span);
    quote_spanned!(span=> match (#right) { #value => { #(#attrs)* #left #op #value; } })
}
