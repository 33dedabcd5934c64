//! The implementation of `ppl::Model`.

use proc_macro2::{Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::Ident;

use super::data::{applied, binding, data_name, given, owned, with_sync};
use super::names::{cx, table};
use super::statements::statements;
use crate::ast::{Argument, Model};
use crate::plan::Plan;

/// A function that binds its data to a model.
pub(super) fn model(model: &Model, plan: &Plan) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, generics, arguments, errors, .. } = model;
    let parameters = arguments.iter().map(|argument| {
        let Argument { attrs, name, colon, ty } = argument;
        quote!(#(#attrs)* #name #colon #ty)
    });
    let names: Vec<_> = arguments.iter().map(|argument| &argument.name).collect();
    let (mut owned, types) = owned(generics, arguments);
    let applied = applied(&owned);
    let (introduced, _, bounds) = with_sync(&mut owned).split_for_impl();
    // not all of them need be in the type of some data
    let given = given(generics);
    let data = data_name(name);
    let bindings = arguments.iter().map(binding);
    let (sites, is_static) = (table(&plan.sites), plan.is_static);
    let (cx, statements) = (cx(), statements(&plan.body));
    let errors = errors.iter().map(syn::Error::to_compile_error);
    let mut shown = generics.clone();
    let shown_bounds = with_sync(&mut shown).where_clause.take();
    let this = Ident::new("self", span);
    quote_spanned! {span=>
        #(#errors)*
        #(#attrs)*
        // what is emitted is not what was written: braces around a loop, names for lifetimes
        #[allow(clippy::too_many_arguments, single_use_lifetimes, unused_braces)]
        #vis #fn_token #name #shown(#(#parameters),*) -> ::ppl::Bound<impl ::ppl::Model>
        #shown_bounds
        {
            struct #data #introduced #bounds {
                #(#names: #types,)*
            }
            impl #introduced ::ppl::Model for #data #applied #bounds {
                const STATIC: bool = #is_static;

                fn run<__C: ::ppl::Context>(
                    &#this,
                    #cx: &mut __C,
                ) -> ::core::result::Result<(), ::ppl::Rejection> {
                    #[allow(unused_imports)]
                    use ::ppl::__private::{
                        Apart as _, At as _, Number as _, Of as __Of, Other as _, Together as _,
                    };
                    #sites
                    #(#bindings)*
                    #statements
                    ::core::result::Result::Ok(())
                }
            }
            ::ppl::Bound::new(#data #given { #(#names),* })
        }
    }
}
