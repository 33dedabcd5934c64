//! Calls of functions of `ppl` that the macro inserts into expressions. These calls are not rewritten again.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::{Expr, ExprBinary, ExprCall, ExprIndex, ExprTry, Ident, Macro};

/// Returns a mixed-site span at the location of `tokens`, for names that the macro introduces.
pub(crate) fn here(tokens: &impl Spanned) -> Span {
    Span::mixed_site().located_at(tokens.span())
}

/// Converts an expression into an operand of a formula. At run time, a number of the model becomes an operand, and
/// any other value is unchanged.
pub(crate) fn operand(expr: &Expr) -> Expr {
    method_call(expr, expr.span(), "operand")
}

/// Emits the evaluation of a formula to a number, with the source location of `span`.
pub(crate) fn closed(expr: &Expr, span: Span) -> Expr {
    method_call(expr, span, "closed")
}

fn method_call(expr: &Expr, span: Span, method: &str) -> Expr {
    let span = Span::mixed_site().located_at(span);
    let method = Ident::new(method, span);
    // a single token needs no parentheses
    let tokens = match expr {
        Expr::Path(_) | Expr::Verbatim(_) | Expr::Lit(_) => quote_spanned!(span=> #expr),
        _ => quote_spanned!(span=> (#expr)),
    };
    Expr::Verbatim(quote_spanned!(span=> (&__Of(&#tokens)).#method()))
}

/// Returns the name of the variable that sums the adjoint of `name` over the iterations of a plate (a `for` loop of
/// the model).
pub(crate) fn shared_name(name: &Ident) -> Ident {
    format_ident!("shared_{}", name.unraw(), span = here(name))
}

/// Emits the access to an element of an array that all iterations of a plate (a `for` loop of the model) use. With
/// `is_same_element`, every iteration uses the same element; otherwise each iteration uses a different element.
pub(crate) fn element(shared: &Expr, index: &ExprIndex, is_same_element: bool) -> Expr {
    let at = &index.index;
    let element = Ident::new(if is_same_element { "__element" } else { "__own" }, here(index));
    Expr::Verbatim(quote_spanned!(index.span()=> #shared.#element(#at)))
}

/// Emits a reference to a variable.
pub(crate) fn reference(name: &Expr) -> Expr {
    Expr::Verbatim(quote_spanned!(here(name)=> &#name))
}

/// Converts a literal into an expression whose type the compiler infers from the context.
pub(crate) fn literal(expr: &Expr) -> Expr {
    Expr::Verbatim(quote_spanned!(here(expr)=> ::ppl::__private::literal(#expr)))
}

/// Converts a literal into a number of the model. The type is explicit, because type inference fails if only plain
/// numbers are added to the literal.
pub(crate) fn real(expr: &Expr) -> Expr {
    Expr::Verbatim(quote_spanned! {here(expr)=>
        ::ppl::Real::<<__C as ::ppl::Context>::Number>::from(#expr)
    })
}

/// Returns the right side of `name = name + sum`, which replaces the statement `name += sum`.
pub(crate) fn step(name: &Expr, op: syn::BinOp, sum: &Expr) -> Expr {
    let before = operand(name);
    Expr::Verbatim(quote_spanned!(sum.span()=> (#before #op (#sum))))
}

/// Rewrites a statement such as `h[t] += a * h[t - 1]` so that its right side is evaluated first, as Rust does for
/// `f64`. For a vector of unknowns, `+=` is a call that borrows `h` mutably before the right side reads `h`. Side
/// effects of the index expression occur after side effects of the right side, as for `f64`. The rewritten code uses
/// a `match`, because a `match` keeps temporaries of the right side alive until the end of the statement; a `let`
/// would drop them.
pub(crate) fn right_side_first(binary: &ExprBinary) -> Expr {
    let ExprBinary { attrs, left, op, right } = binary;
    let span = here(right);
    let value = Ident::new("value", span);
    Expr::Verbatim(quote_spanned! {span=>
        match (#right) { #value => { #(#attrs)* #left #op #value; } }
    })
}

/// Emits the reference to the site with the given index in the emitted table of sites.
pub(crate) fn site(number: usize) -> TokenStream {
    let number = Literal::usize_unsuffixed(number);
    quote_spanned!(Span::mixed_site()=> __SITES[#number])
}

/// Emits `expr?`, with the site of the statement added to the error.
pub(crate) fn located(site_number: usize, attempt: &ExprTry) -> Expr {
    let ExprTry { attrs, expr, question_token } = attempt;
    let site = site(site_number);
    let locate = Ident::new("locate", here(question_token));
    Expr::Verbatim(quote!(#(#attrs)* #site.#locate(#expr)#question_token))
}

/// Converts `dot(data, numbers)` into an operand. If the lengths differ at run time, the error contains the site of
/// the statement.
pub(crate) fn dot(site_number: usize, call: &ExprCall) -> Expr {
    let site = site(site_number);
    Expr::Verbatim(quote_spanned!(here(call)=> (&__Of(&#call)).same_length(&#site)?))
}

/// Expands `reject!(reason)` to a `return` of an error that contains the site of the statement.
pub(crate) fn reject(site_number: usize, mac: &Macro) -> Expr {
    let (site, reason) = (site(site_number), &mac.tokens);
    Expr::Verbatim(quote_spanned! {here(&mac.path)=>
        return ::core::result::Result::Err(#site.reject(::std::format!(#reason)))
    })
}
