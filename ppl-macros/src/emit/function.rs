//! The function that the user has declared: it binds data to a model, or takes what the statements of a
//! submodel need, which are generic over the numbers of the context that they run in, since its
//! arguments may be unknowns.

use proc_macro2::{Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::{Ident, Type, parse_quote};

use super::data::{Data, add_sync, binding, data, is_number};
use super::names::{cx, table, value as end};
use super::statements::statements;
use crate::ast::{Kind, Model};
use crate::plan::Plan;

pub(crate) fn function(model: &Model, plan: &Plan) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, arguments, errors, .. } = model;
    let mut generics = model.generics.clone();
    match &model.value {
        Some(_) => generics.params.push(parse_quote!(__S: ::ppl::Scalar)),
        None => add_sync(&mut generics),
    }
    let (introduced, _, bounds) = generics.split_for_impl();
    let Data { declaration, applied, given } = data(model);
    let parameters = arguments.iter().map(|argument| {
        let (attrs, name, colon, ty) =
            (&argument.attrs, &argument.name, argument.colon, &argument.ty);
        match is_number(ty) {
            true => quote!(#(#attrs)* #name #colon impl ::core::convert::Into<#ty>),
            false => quote!(#(#attrs)* #name #colon #ty),
        }
    });
    let fields = arguments.iter().map(|argument| {
        let name = &argument.name;
        match is_number(&argument.ty) {
            true => quote!(#name: ::core::convert::Into::into(#name)),
            false => quote!(#name),
        }
    });
    let made = quote!(#given { #(#fields),* });
    let (returned, made) = match &model.value {
        Some(value) => (
            quote!(::ppl::Part<impl ::ppl::Submodel<__S, Value = #value>>),
            quote!(::ppl::Part(#made)),
        ),
        None => (quote!(::ppl::Bound<impl ::ppl::Model>), quote!(::ppl::Bound::new(#made))),
    };
    let (cx, this) = (cx(), Ident::new("self", span));
    let (sites, bindings) = (table(&plan.sites), arguments.iter().map(binding));
    let statements = statements(plan);
    let body = quote!(#sites #(#bindings)* #statements);
    let implementation = match &model.value {
        Some(value) => {
            let end = ending(plan, value);
            quote_spanned! {span=>
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
            }
        }
        None => {
            let is_static = plan.is_static;
            quote_spanned! {span=>
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
            }
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

/// What the statements of a submodel end with.
fn ending(plan: &Plan, value: &Type) -> TokenStream {
    let span = Span::mixed_site();
    match plan.body.statements.last() {
        Some(last) if matches!(last.kind, Kind::End(_)) => {
            // where a wrong type is reported
            let span = span.located_at(last.span);
            let mut end = end();
            end.set_span(span);
            quote_spanned!(span=> ::core::result::Result::Ok(#end))
        }
        _ if matches!(value, Type::Tuple(tuple) if tuple.elems.is_empty()) => {
            quote_spanned!(span=> ::core::result::Result::Ok(()))
        }
        // an error stands in its place
        _ => quote_spanned!(span=> ::core::unreachable!()),
    }
}
