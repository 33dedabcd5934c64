//! Variables that begin as literals: `let mut s = 0.0;` is a number of the model if what follows
//! changes it to something that may hold unknowns, and so are the elements of `vec![0.0; n]`.

use std::collections::HashSet;

use proc_macro2::Span;
use quote::{ToTokens, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{Expr, Pat};

use crate::literals::is_literal;

/// Writes the literals that a variable begins with as numbers of the model, if it is `assigned` more.
pub(crate) fn begin(pat: &Pat, value: &mut Expr, assigned: impl FnOnce() -> HashSet<String>) {
    let Pat::Ident(pat) = pat else { return };
    let mut start = value.clone();
    if lifted(&mut start) && assigned().contains(&pat.ident.to_string()) {
        *value = start;
    }
}

/// Whether there was nothing but literals, now numbers of the model.
fn lifted(expr: &mut Expr) -> bool {
    match expr {
        Expr::Repeat(repeat) => lifted(&mut repeat.expr),
        Expr::Array(array) => !array.elems.is_empty() && array.elems.iter_mut().all(lifted),
        Expr::Macro(call) if call.mac.path.is_ident("vec") => {
            let tokens = &call.mac.tokens;
            let Ok(mut elements) = syn::parse2(quote!([#tokens])) else { return false };
            let is_lifted = lifted(&mut elements);
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
        literal if is_literal(literal) => {
            let span = Span::mixed_site().located_at(literal.span());
            // the type in full: all that is added may be plain numbers
            *literal = Expr::Verbatim(quote_spanned! {span=>
                ::ppl::Real::<<__C as ::ppl::Context>::Number>::from(#literal)
            });
            true
        }
        _ => false,
    }
}
