//! The implementation of `ppl::Model`, written so that `cargo expand` reads well.
//!
//! Names of the macro's own have mixed-site spans: variables of a user called `cx` are others.
//! Tokens of the user are handed on as they are.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::Ident;
use syn::ext::IdentExt;
use syn::spanned::Spanned;

use crate::arithmetic::sum_of;
use crate::ast::{Arm, ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::data::{applied, binding, data_name, given, owned, with_sync};
use crate::lower::Site;
use crate::parse::plain_name;
use crate::rows;
use crate::scan;
use crate::signature::{Argument, Model};
use crate::updates;

/// A function that binds its data to a model.
pub(crate) fn model(model: &Model, sites: &[Site], is_static: bool) -> TokenStream {
    let span = Span::mixed_site();
    let Model { attrs, vis, fn_token, name, generics, arguments, body, errors, .. } = model;
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
    let sites = table(sites);
    let cx = cx();
    let statements = statements(body, false);
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
                        Apart as _, At as _, Coefficient as _, Number as _, Other as _, Place as _,
                        Together as _, Unread as _,
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

/// The places of a model.
pub(crate) fn table(sites: &[Site]) -> TokenStream {
    let span = Span::mixed_site();
    if sites.is_empty() {
        return TokenStream::new();
    }
    let count = Literal::usize_unsuffixed(sites.len());
    let entries = sites.iter().map(|site| {
        let (name, text) = (&site.name, &site.text);
        let line = Literal::usize_unsuffixed(scan::position(site.span).0);
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

/// The place of a statement.
pub(crate) fn site(number: usize) -> TokenStream {
    let number = Literal::usize_unsuffixed(number);
    quote_spanned!(Span::mixed_site()=> __SITES[#number])
}

pub(crate) fn cx() -> Ident {
    Ident::new("cx", Span::mixed_site())
}

fn block(block: &Block, predicted: bool) -> TokenStream {
    block_and(block, predicted, None)
}

/// A block with more at its end.
fn block_and(block: &Block, predicted: bool, more: Option<TokenStream>) -> TokenStream {
    let mut tokens = TokenStream::new();
    block.brace.surround(&mut tokens, |tokens| {
        tokens.extend(statements(block, predicted));
        tokens.extend(more);
    });
    tokens
}

/// Statements in order; in a block that is not itself predicted, `#[predict]` opens the part that
/// runs on finished draws only.
pub(crate) fn statements(block: &Block, predicted: bool) -> TokenStream {
    let is_first = |s: &Statement| !predicted && s.mark == Mark::Predict;
    let split = block.statements.iter().position(is_first);
    let is_end = |s: &&Statement| matches!(s.kind, Kind::End(_));
    let end = block.statements.last().filter(is_end);
    let (rest, _) = block.statements.split_at(block.statements.len() - end.iter().len());
    let (always, late) = rest.split_at(split.unwrap_or(rest.len()));
    let mut tokens: TokenStream = always.iter().map(statement).collect();
    if !late.is_empty() {
        let (cx, late) = (cx(), late.iter().map(statement));
        tokens.extend(quote_spanned!(Span::mixed_site()=> if #cx.predicts() { #(#late)* }));
    }
    tokens.extend(end.map(statement));
    tokens
}

pub(crate) fn statement(statement: &Statement) -> TokenStream {
    let attrs = &statement.attrs;
    let (cx, span) = (cx(), Span::mixed_site());
    let site = site(statement.site.unwrap_or_default());
    let tokens = match &statement.kind {
        Kind::Unknown { let_token, name, tilde, distribution } => {
            let span = span.located_at(tilde.span());
            let method = if statement.predicted {
                Ident::new("predict", span)
            } else {
                Ident::new("unknown", span)
            };
            // it counts as used: it is in the results
            quote_spanned! {span=>
                #[allow(unused_variables)]
                #let_token #name = #cx.#method(&#site, #distribution)?;
            }
        }
        Kind::Observe { place, tilde, distribution, apart } => {
            let span = span.located_at(tilde.span());
            let datum = quote_spanned!(place.span()=> &#place);
            match statement.site.filter(|_| *apart).map(total_of) {
                Some(total) => quote_spanned! {span=>
                    #cx.condition_in_loop(&#site, #distribution, #datum, &mut #total)?;
                },
                None => quote_spanned!(span=> #cx.condition(&#site, #distribution, #datum)?;),
            }
        }
        Kind::Part { let_token, name, tilde, part } => {
            let span = span.located_at(tilde.span());
            let method = if statement.predicted {
                quote_spanned!(span=> ::ppl::Prediction::predict)
            } else {
                quote_spanned!(span=> ::ppl::Declaration::declare)
            };
            let value = quote_spanned!(span=> #method(#part, &#site, #cx)?);
            let record = (statement.mark == Mark::Track).then(|| record(statement, name));
            quote_spanned! {span=>
                #[allow(unused_variables)]
                #let_token #name = #value; #record
            }
        }
        Kind::Impute { place, tilde, distribution } => {
            let span = span.located_at(tilde.span());
            let datum = quote_spanned!(place.span()=> &#place);
            // afterwards the name stands for what is complete
            let name = plain_name(place).map(|name| quote!(#[allow(unused_variables)] let #name =));
            quote_spanned!(span=> #name #cx.complete(&#site, #distribution, #datum)?;)
        }
        Kind::Let { let_token, pat, init } => {
            let init = init.as_ref().map(|init| initialiser(init, statement.predicted));
            let name = match pat {
                syn::Pat::Type(typed) => &*typed.pat,
                other => other,
            };
            let record = (statement.mark != Mark::None).then(|| record(statement, name));
            quote!(#let_token #pat #init; #record)
        }
        Kind::Factor { name, weight } => {
            let span = span.located_at(name.span());
            let weight = quote_spanned!(weight.span()=> &(#weight));
            quote_spanned!(span=> #cx.factor(&#site, ::ppl::Datum::lift(#weight))?;)
        }
        Kind::Flow(inner) => flow(inner, statement.predicted),
        Kind::End(value) => {
            let (name, value) = (end(), initialiser(value, false));
            quote_spanned!(span=> let #name #value;)
        }
        Kind::Rust(stmt) => updates::statement(stmt),
        Kind::Broken { names, error } => {
            let error = error.to_compile_error();
            match names.as_slice() {
                [] => quote!(#error),
                [first, rest @ ..] => {
                    quote!(let #first = #error; #(#[allow(unused_variables)] let #rest = #first;)*)
                }
            }
        }
    };
    let labels = statement.dims.iter().filter_map(|dim| {
        let (name, labels) = (dim.name.unraw().to_string(), dim.labels.as_ref()?);
        let span = span.located_at(dim.name.span());
        Some(quote_spanned!(span=> #cx.coordinates(#name, || #labels);))
    });
    quote!(#(#labels)* #(#attrs)* #tokens)
}

/// The variable that sums up the terms of an observation in a loop.
pub(crate) fn total_of(site: usize) -> Ident {
    format_ident!("total_{site}", span = Span::mixed_site())
}

/// The variable that holds the value of a submodel.
pub(crate) fn end() -> Ident {
    Ident::new("value", Span::mixed_site())
}

fn initialiser(init: &Init, predicted: bool) -> TokenStream {
    match init {
        Init::Value { eq, value, diverge } => {
            let diverge = diverge.as_ref().map(|(els, value)| quote!(#els #value));
            let value = updates::expression(value);
            quote!(#eq #value #diverge)
        }
        Init::Flow(eq, inner) => {
            let inner = flow(inner, predicted);
            quote!(#eq #inner)
        }
    }
}

fn record(statement: &Statement, name: impl ToTokens + Spanned) -> TokenStream {
    let (cx, span) = (cx(), Span::mixed_site());
    let site = site(statement.site.unwrap_or_default());
    let span = span.located_at(name.span());
    let value = quote_spanned!(name.span()=> &#name);
    if statement.predicted {
        quote_spanned!(span=> #cx.track_prediction(&#site, #value)?;)
    } else {
        quote_spanned!(span=> #cx.track(&#site, #value)?;)
    }
}

fn flow(inner: &Flow, predicted: bool) -> TokenStream {
    match inner {
        Flow::For { iter, body, pools: true, .. } => {
            let statements = body.statements.iter().filter_map(|s| match &s.kind {
                Kind::Observe { tilde, distribution, .. } => Some((s, tilde, distribution)),
                _ => None,
            });
            let cx = cx();
            let calls = statements.map(|(statement, tilde, distribution)| {
                let attrs = &statement.attrs;
                let site = site(statement.site.unwrap_or_default());
                let span = Span::mixed_site().located_at(tilde.span());
                quote_spanned!(span=> #(#attrs)* #cx.condition_all(&#site, #distribution, #iter)?;)
            });
            quote!(#(#calls)*)
        }
        Flow::For {
            label,
            for_token,
            pat,
            in_token,
            iter,
            body,
            unwinds,
            summed,
            totals,
            linear,
            ..
        } => {
            let rows = linear.as_ref().zip(body.statements.last().and_then(|last| last.site));
            let (replaced, told) = rows
                .map(|(rows, site)| {
                    (rows::replacement(rows, pat, iter, site), rows::told(rows, body))
                })
                .unzip();
            let mut body = block_and(body, predicted, told);
            if *unwinds {
                let cx = cx();
                body = quote_spanned!(Span::mixed_site()=> {
                    let mark = #cx.mark();
                    #body
                    #cx.unwind(mark);
                });
            }
            let mut plate = quote!(#label #for_token #pat #in_token #iter #body);
            if let Some(replaced) = replaced {
                let end = rows::end();
                plate = quote!(if !(#replaced) { #plate #end });
            }
            if summed.is_empty() && totals.is_empty() {
                return plate;
            }
            let sums = summed.iter().map(|name| {
                let sum = sum_of(name);
                quote_spanned!(name.span()=> let #sum = (&::ppl::__private::Of(&#name)).sum();)
            });
            let deposits = summed.iter().map(|name| {
                let sum = sum_of(name);
                quote_spanned!(name.span()=> #sum.deposit();)
            });
            let (cx, span) = (cx(), Span::mixed_site());
            let places: Vec<_> = totals.iter().map(|&number| site(number)).collect();
            let totals: Vec<_> = totals.iter().map(|&number| total_of(number)).collect();
            quote_spanned! {span=> {
                #(#sums)*
                #(#[allow(unused_mut)] let mut #totals = #cx.total();)*
                #plate
                #(#deposits)*
                #(#cx.add_total(&#places, #totals)?;)*
            }}
        }
        Flow::If { if_token, condition, then, otherwise } => {
            let then = block(then, predicted);
            let otherwise = otherwise.as_ref().map(|(else_token, other)| {
                let other = flow(other, predicted);
                quote!(#else_token #other)
            });
            quote!(#if_token #condition #then #otherwise)
        }
        Flow::Match { match_token, scrutinee, brace, arms } => {
            let mut tokens = quote!(#match_token #scrutinee);
            brace.surround(&mut tokens, |tokens| {
                tokens.extend(arms.iter().map(|inner| arm(inner, predicted)));
            });
            tokens
        }
        Flow::Block(inner) => block(inner, predicted),
    }
}

fn arm(arm: &Arm, predicted: bool) -> TokenStream {
    let Arm { pat, guard, arrow, body } = arm;
    let guard = guard.as_ref().map(|(if_token, guard)| quote!(#if_token #guard));
    let body = match body {
        ArmBody::Block(inner) => block(inner, predicted),
        ArmBody::Value(value) => {
            let value = updates::expression(value);
            quote!(#value,)
        }
    };
    quote!(#pat #guard #arrow #body)
}
