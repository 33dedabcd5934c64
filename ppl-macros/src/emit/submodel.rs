//! The implementation of `ppl::Submodel`: as that of a model, but generic over the numbers of the
//! context that it runs in, since its arguments may be unknowns.

use proc_macro2::{Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::{Ident, Type, parse_quote};

use super::data;
use super::names::{cx, table, value as end};
use super::statements::statements;
use crate::ast::{Argument, Kind, Model};
use crate::plan::Plan;

/// A function that takes what its statements need and returns a part of a model.
pub(super) fn submodel(model: &Model, value: &Type, plan: &Plan) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, generics, arguments, body, errors, .. } = model;
    let is_number = |ty: &Type| *ty == parse_quote!(::ppl::Real<__S>);
    let parameters = arguments.iter().map(|argument| {
        let Argument { attrs, name, colon, ty } = argument;
        if is_number(ty) {
            quote!(#(#attrs)* #name #colon impl ::core::convert::Into<#ty>)
        } else {
            quote!(#(#attrs)* #name #colon #ty)
        }
    });
    let fields = arguments.iter().map(|argument| {
        let name = &argument.name;
        if is_number(&argument.ty) {
            quote!(#name: ::core::convert::Into::into(#name))
        } else {
            quote!(#name)
        }
    });
    let names: Vec<_> = arguments.iter().map(|argument| &argument.name).collect();
    let mut shown = generics.clone();
    shown.params.push(parse_quote!(__S: ::ppl::Scalar));
    let (owned, types) = data::owned(&shown, arguments);
    let (applied, (introduced, _, bounds)) = (data::applied(&owned), owned.split_for_impl());
    let shown_bounds = shown.where_clause.take();
    let data = data::data_name(name);
    let bindings = arguments.iter().map(|argument| {
        if is_number(&argument.ty) {
            let (name, this) = (&argument.name, Ident::new("self", span));
            quote_spanned!(span=> let #name = #this.#name;)
        } else {
            data::binding(argument)
        }
    });
    let sites = table(&plan.sites);
    let (cx, statements) = (cx(), statements(&plan.body));
    let is_unit = matches!(value, Type::Tuple(tuple) if tuple.elems.is_empty());
    let end = match body.statements.last() {
        Some(last) if matches!(last.kind, Kind::End(_)) => {
            // where a wrong type is reported
            let span = span.located_at(last.span);
            let mut end = end();
            end.set_span(span);
            quote_spanned!(span=> ::core::result::Result::Ok(#end))
        }
        _ if is_unit => quote_spanned!(span=> ::core::result::Result::Ok(())),
        // an error stands in its place
        _ => quote_spanned!(span=> ::core::unreachable!()),
    };
    let errors = errors.iter().map(syn::Error::to_compile_error);
    let this = Ident::new("self", span);
    quote_spanned! {span=>
        #(#errors)*
        #(#attrs)*
        // what is emitted is not what was written: braces around a loop, names for lifetimes
        #[allow(clippy::too_many_arguments, single_use_lifetimes, unused_braces)]
        #vis #fn_token #name #shown(#(#parameters),*)
            -> ::ppl::Part<impl ::ppl::Submodel<__S, Value = #value>>
        #shown_bounds
        {
            struct #data #introduced #bounds {
                #(#names: #types,)*
                __number: ::core::marker::PhantomData<__S>,
            }
            impl #introduced ::ppl::Submodel<__S> for #data #applied #bounds {
                type Value = #value;
                fn run<__C: ::ppl::Context<Number = __S>>(
                    &#this,
                    #cx: &mut __C,
                ) -> ::core::result::Result<Self::Value, ::ppl::Rejection> {
                    #sites
                    #(#bindings)*
                    #statements
                    #end
                }
            }
            ::ppl::Part(#data { #(#fields,)* __number: ::core::marker::PhantomData })
        }
    }
}
