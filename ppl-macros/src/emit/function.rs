//! The function that the user has declared: it binds data to a model, or takes what the statements of a
//! submodel need, which are generic over the numbers of the context that they run in, since its
//! arguments may be unknowns.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::{Ident, Type, parse_quote};

use super::data::{Data, add_sync, binding, data, is_number};
use super::names::{cx, value as end};
use super::statements::statements;
use crate::analyse::{Analysis, Site};
use crate::ast::{Argument, Kind, Model, Statement};
use crate::syntax::tokens::line;

pub(crate) fn function(model: &Model, analysis: &Analysis) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, arguments, errors, .. } = model;
    let mut generics = model.generics.clone();
    match &model.value {
        Some(_) => generics.params.push(parse_quote!(__S: ::ppl::Scalar)),
        None => add_sync(&mut generics),
    }
    let (introduced, _, bounds) = generics.split_for_impl();
    let parameters = arguments.iter().map(|Argument { attrs, name, colon, ty }| {
        let ty = if is_number(ty) { quote!(impl ::core::convert::Into<#ty>) } else { quote!(#ty) };
        quote!(#(#attrs)* #name #colon #ty)
    });
    let Data { declaration, applied, made } = data(model);
    let (cx, this) = (cx(), Ident::new("self", span));
    let (statements, sites) = statements(model, analysis);
    let (sites, bindings) = (table(&sites), arguments.iter().map(binding));
    let body = quote!(#sites #(#bindings)* #statements);
    let (returned, made, implementation) = match &model.value {
        Some(value) => {
            let end = ending(model, analysis, value);
            let implementation = quote_spanned! {span=>
                impl #introduced ::ppl::Submodel<__S> for #applied #bounds {
                    type Value = #value;
                    fn run<__C: ::ppl::Context<Number = __S>>(
                        &#this,
                        #cx: &mut __C,
                    ) -> ::core::result::Result<Self::Value, ::ppl::Rejection> {
                        #body
                        #end
                    }
                }
            };
            let returned = quote!(::ppl::Part<impl ::ppl::Submodel<__S, Value = #value>>);
            (returned, quote!(::ppl::Part(#made)), implementation)
        }
        None => {
            let is_static = analysis.is_static;
            let implementation = quote_spanned! {span=>
                impl #introduced ::ppl::Model for #applied #bounds {
                    const STATIC: bool = #is_static;
                    fn run<__C: ::ppl::Context>(
                        &#this,
                        #cx: &mut __C,
                    ) -> ::core::result::Result<(), ::ppl::Rejection> {
                        #[allow(unused_imports)]
                        use ::ppl::__private::{
                            Apart as _, At as _, Number as _, Of as __Of, Other as _, Together as _,
                        };
                        #body
                        ::core::result::Result::Ok(())
                    }
                }
            };
            let returned = quote!(::ppl::Bound<impl ::ppl::Model>);
            (returned, quote!(::ppl::Bound::new(#made)), implementation)
        }
    };
    let errors = errors.iter().map(syn::Error::to_compile_error);
    quote_spanned! {span=>
        #(#errors)*
        #(#attrs)*
        // what is emitted is not what was written: bounds in two places, braces around a loop
        #[allow(
            clippy::multiple_bound_locations,
            clippy::too_many_arguments,
            single_use_lifetimes,
            unused_braces
        )]
        #vis #fn_token #name #introduced(#(#parameters),*) -> #returned #bounds {
            #declaration
            #implementation
            #made
        }
    }
}

/// The places of a model.
fn table(sites: &[Site]) -> Option<TokenStream> {
    let span = Span::mixed_site();
    let count = Literal::usize_unsuffixed(sites.len());
    let entries = sites.iter().map(|Site { name, text, span: place, repeated, plates, dims }| {
        let line = Literal::usize_unsuffixed(line(*place));
        let in_loop = match plates.is_empty() {
            false => Some(quote!(.along(&[#(#plates),*]))),
            true => repeated.then(|| quote!(.in_loop())),
        };
        let dims = (!dims.is_empty()).then(|| quote!(.dims(&[#(#dims),*])));
        quote_spanned!(span=> ::ppl::Site::at(#name, #text, ::core::file!(), #line)#in_loop #dims)
    });
    let table = quote_spanned! {span=>
        static __SITES: [::ppl::Site; #count] = [#(#entries),*];
    };
    (!sites.is_empty()).then_some(table)
}

/// What the statements of a submodel end with.
fn ending(model: &Model, analysis: &Analysis, value: &Type) -> TokenStream {
    let span = Span::mixed_site();
    let is_end = |last: &&Statement| {
        matches!(last.kind, Kind::End(_)) && !analysis.facts.errors.contains_key(&last.id)
    };
    match model.body.statements.last().filter(is_end) {
        Some(last) => {
            // where a wrong type is reported
            let span = span.located_at(last.span);
            let mut end = end();
            end.set_span(span);
            quote_spanned!(span=> ::core::result::Result::Ok(#end))
        }
        None if matches!(value, Type::Tuple(tuple) if tuple.elems.is_empty()) => {
            quote_spanned!(span=> ::core::result::Result::Ok(()))
        }
        // an error stands in its place
        None => quote_spanned!(span=> ::core::unreachable!()),
    }
}
