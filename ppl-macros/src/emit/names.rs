//! Names of the macro's own.

use proc_macro2::Span;
use quote::format_ident;
use syn::Ident;

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

/// The variable that sums up the terms of an observation in a loop.
pub(super) fn sum_of(site: usize) -> Ident {
    format_ident!("terms_{site}", span = Span::mixed_site())
}
