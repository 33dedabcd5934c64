//! The calls of `ppl` that the macro writes into expressions. Nothing looks at them again.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::{Expr, ExprBinary, ExprCall, ExprIndex, ExprTry, Ident, Macro};

/// A name of the macro's own where `tokens` stand.
pub(crate) fn here(tokens: &impl Spanned) -> Span {
    Span::mixed_site().located_at(tokens.span())
}

/// What a formula is made of: an unknown as such, anything else as it is.
pub(crate) fn operand(expr: &Expr) -> Expr {
    asked(expr, expr.span(), "operand")
}

/// A formula as a number, where `span` is.
pub(crate) fn closed(expr: &Expr, span: Span) -> Expr {
    asked(expr, span, "closed")
}

fn asked(expr: &Expr, span: Span, method: &str) -> Expr {
    let span = Span::mixed_site().located_at(span);
    let method = Ident::new(method, span);
    // a name needs no parentheses
    let tokens = match expr {
        Expr::Path(_) | Expr::Verbatim(_) | Expr::Lit(_) => quote_spanned!(span=> #expr),
        _ => quote_spanned!(span=> (#expr)),
    };
    Expr::Verbatim(quote_spanned!(span=> (&__Of(&#tokens)).#method()))
}

/// The variable of a plate that sums up the adjoint of `name`.
pub(crate) fn shared_name(name: &Ident) -> Ident {
    format_ident!("shared_{}", name.unraw(), span = here(name))
}

/// An element of what a plate shares: `all` iterations use the same, or each its own.
pub(crate) fn element(shared: &Expr, index: &ExprIndex, all: bool) -> Expr {
    let at = &index.index;
    let element = Ident::new(if all { "__element" } else { "__own" }, here(index));
    Expr::Verbatim(quote_spanned!(index.span()=> #shared.#element(#at)))
}

/// A literal that takes its type from what is around it.
pub(crate) fn literal(expr: &Expr) -> Expr {
    Expr::Verbatim(quote_spanned!(here(expr)=> ::ppl::__private::literal(#expr)))
}

/// A literal that is a number of the model: with the type in full, as all that is added may be plain.
pub(crate) fn real(expr: &Expr) -> Expr {
    Expr::Verbatim(quote_spanned! {here(expr)=>
        ::ppl::Real::<<__C as ::ppl::Context>::Number>::from(#expr)
    })
}

/// `name = name + sum` of `name += sum`, as the right side.
pub(crate) fn step(name: &Expr, op: syn::BinOp, sum: &Expr) -> Expr {
    let before = operand(name);
    Expr::Verbatim(quote_spanned!(sum.span()=> (#before #op (#sum))))
}

/// `h[t] += a * h[t - 1]` on a vector of unknowns, whose `+=` is a call, which borrows `h` for change
/// before the right side reads it: so the right side comes first, as it does for `f64`. The effects of
/// an index, if it has any, come after those of the right side, as with `f64`. A `match` keeps what is
/// temporary on the right for as long as the statement, where a `let` would not.
pub(crate) fn right_side_first(binary: &ExprBinary) -> Expr {
    let ExprBinary { attrs, left, op, right } = binary;
    let span = here(right);
    let value = Ident::new("value", span);
    Expr::Verbatim(quote_spanned! {span=>
        match (#right) { #value => { #(#attrs)* #left #op #value; } }
    })
}

/// The place of a statement.
pub(crate) fn site(number: usize) -> TokenStream {
    let number = Literal::usize_unsuffixed(number);
    quote_spanned!(Span::mixed_site()=> __SITES[#number])
}

/// `expr?` with the place of the statement in the error.
pub(crate) fn located(site_number: usize, attempt: &ExprTry) -> Expr {
    let ExprTry { attrs, expr, question_token } = attempt;
    let site = site(site_number);
    let locate = Ident::new("locate", here(question_token));
    Expr::Verbatim(quote!(#(#attrs)* #site.#locate(#expr)#question_token))
}

/// `dot(data, numbers)` as an operand; if their lengths differ, the error says at which statement.
pub(crate) fn dot(site_number: usize, call: &ExprCall) -> Expr {
    let site = site(site_number);
    Expr::Verbatim(quote_spanned!(here(call)=> (&__Of(&#call)).same_length(&#site)?))
}

/// `reject!(reason)`.
pub(crate) fn reject(site_number: usize, mac: &Macro) -> Expr {
    let (site, reason) = (site(site_number), &mac.tokens);
    Expr::Verbatim(quote_spanned! {here(&mac.path)=>
        return ::core::result::Result::Err(#site.reject(::std::format!(#reason)))
    })
}
