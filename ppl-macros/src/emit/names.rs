//! Names of the macro's own.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{format_ident, quote, quote_spanned};
use syn::Ident;

use crate::analyse::Site;
use crate::syntax::tokens::line;

/// The context.
pub(super) fn cx() -> Ident {
    cx_at(Span::mixed_site())
}

/// The context, asked where the user wrote something: there errors are reported.
pub(super) fn cx_at(place: Span) -> Ident {
    Ident::new("cx", Span::mixed_site().located_at(place))
}

/// The value of a submodel.
pub(super) fn value() -> Ident {
    Ident::new("value", Span::mixed_site())
}

/// The place of a statement.
pub(super) fn site(number: usize) -> TokenStream {
    let number = Literal::usize_unsuffixed(number);
    quote_spanned!(Span::mixed_site()=> &__SITES[#number])
}

/// The variable that sums up the terms of an observation in a loop.
pub(super) fn sum_of(site: usize) -> Ident {
    format_ident!("terms_{site}", span = Span::mixed_site())
}

/// The places of a model.
pub(super) fn table(sites: &[Site]) -> TokenStream {
    let span = Span::mixed_site();
    if sites.is_empty() {
        return TokenStream::new();
    }
    let count = Literal::usize_unsuffixed(sites.len());
    let entries = sites.iter().map(|site| {
        let (name, text) = (&site.name, &site.text);
        let line = Literal::usize_unsuffixed(line(site.span));
        let plates = &site.plates;
        let in_loop = match plates.is_empty() {
            false => Some(quote!(.along(&[#(#plates),*]))),
            true => site.repeated.then(|| quote!(.in_loop())),
        };
        let names = &site.dims;
        let dims = (!names.is_empty()).then(|| quote!(.dims(&[#(#names),*])));
        quote_spanned!(span=> ::ppl::Site::at(#name, #text, ::core::file!(), #line)#in_loop #dims)
    });
    quote_spanned! {span=>
        static __SITES: [::ppl::Site; #count] = [#(#entries),*];
    }
}
