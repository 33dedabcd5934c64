//! Every step of a plan as Rust.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote, quote_spanned};
use syn::Ident;
use syn::ext::IdentExt;
use syn::spanned::Spanned;

use super::names::{cx, cx_at, site, sum_of, value};
use crate::plan::{Action, Arm, ArmBody, Body, Flow, Init, Observation, Plate, Step, shared_name};

fn block(body: &Body) -> TokenStream {
    let mut tokens = TokenStream::new();
    body.brace.surround(&mut tokens, |tokens| tokens.extend(statements(body)));
    tokens
}

/// Statements in order.
pub(super) fn statements(body: &Body) -> TokenStream {
    let mut tokens: TokenStream = body.always.iter().map(step).collect();
    if !body.predicted.is_empty() {
        let (cx, predicted) = (cx(), body.predicted.iter().map(step));
        tokens.extend(quote_spanned!(Span::mixed_site()=> if #cx.predicts() { #(#predicted)* }));
    }
    tokens.extend(body.value.iter().map(|value| step(value)));
    tokens
}

fn step(step: &Step) -> TokenStream {
    let Step { attrs, labels, action } = step;
    let (cx, span) = (cx(), Span::mixed_site());
    let labels = labels.iter().map(|(name, labels)| {
        let span = span.located_at(name.span());
        let name = name.unraw().to_string();
        quote_spanned!(span=> #cx.coordinates(#name, || #labels);)
    });
    let action = self::action(action);
    quote!(#(#labels)* #(#attrs)* #action)
}

fn action(action: &Action) -> TokenStream {
    let (cx, span) = (cx(), Span::mixed_site());
    match action {
        Action::Declare { let_token, name, tilde, site: number, distribution, is_predicted } => {
            let (span, site) = (span.located_at(tilde.span()), site(*number));
            let method = Ident::new(if *is_predicted { "predict" } else { "unknown" }, span);
            // it counts as used: it is in the results
            quote_spanned! {span=>
                #[allow(unused_variables)]
                #let_token #name = #cx.#method(#site, #distribution)?;
            }
        }
        Action::Part { let_token, name, tilde, site: number, part, is_predicted, is_tracked } => {
            let (span, site) = (span.located_at(tilde.span()), site(*number));
            let method = if *is_predicted {
                quote_spanned!(span=> ::ppl::Prediction::predict)
            } else {
                quote_spanned!(span=> ::ppl::Declaration::declare)
            };
            let value = quote_spanned!(span=> #method(#part, #site, #cx)?);
            let record = is_tracked.then(|| record(*number, name, *is_predicted));
            quote_spanned! {span=>
                #[allow(unused_variables)]
                #let_token #name = #value; #record
            }
        }
        Action::Observe(observation) => {
            let Observation { place, tilde, distribution, .. } = observation;
            let (span, site) = (span.located_at(tilde.span()), site(observation.site));
            let cx = cx_at(span);
            let datum = quote_spanned!(place.span()=> &#place);
            if observation.is_summed {
                let sum = sum_of(observation.site);
                return quote_spanned! {span=>
                    #cx.condition_in_loop(#site, #distribution, #datum, &mut #sum)?;
                };
            }
            quote_spanned!(span=> #cx.condition(#site, #distribution, #datum)?;)
        }
        Action::ObserveAll { data, observation } => {
            let Observation { attrs, tilde, distribution, .. } = observation;
            let (span, site) = (span.located_at(tilde.span()), site(observation.site));
            let cx = cx_at(span);
            quote_spanned!(span=> #(#attrs)* #cx.condition_all(#site, #distribution, #data)?;)
        }
        Action::Complete { name, observation } => {
            let Observation { place, tilde, distribution, .. } = observation;
            let (span, site) = (span.located_at(tilde.span()), site(observation.site));
            let cx = cx_at(span);
            let datum = quote_spanned!(place.span()=> &#place);
            // afterwards the name stands for what is complete
            let name = name.as_ref().map(|name| quote!(#[allow(unused_variables)] let #name =));
            quote_spanned!(span=> #name #cx.complete(#site, #distribution, #datum)?;)
        }
        Action::Factor { name, site: number, weight } => {
            let (span, site) = (span.located_at(name.span()), site(*number));
            let weight = quote_spanned!(weight.span()=> &(#weight));
            quote_spanned!(span=> #cx.factor(#site, ::ppl::Datum::lift(#weight))?;)
        }
        Action::Let { let_token, pat, init, recorded, is_predicted } => {
            let init = init.as_ref().map(initialiser);
            let name = match pat {
                syn::Pat::Type(typed) => &*typed.pat,
                other => other,
            };
            let record = recorded.map(|number| record(number, name, *is_predicted));
            quote!(#let_token #pat #init; #record)
        }
        Action::Flow(inner) => flow(inner),
        Action::Value(init) => {
            let (name, init) = (value(), initialiser(init));
            quote_spanned!(span=> let #name #init;)
        }
        Action::Rust(stmt) => stmt.to_token_stream(),
        Action::Refuse { names, error } => {
            let error = error.to_compile_error();
            match names.as_slice() {
                [] => quote!(#error),
                [first, rest @ ..] => {
                    quote!(let #first = #error; #(#[allow(unused_variables)] let #rest = #first;)*)
                }
            }
        }
    }
}

fn record(number: usize, name: impl ToTokens + Spanned, is_predicted: bool) -> TokenStream {
    let (cx, site) = (cx(), site(number));
    let span = Span::mixed_site().located_at(name.span());
    let value = quote_spanned!(name.span()=> &#name);
    let method = Ident::new(if is_predicted { "track_prediction" } else { "track" }, span);
    quote_spanned!(span=> #cx.#method(#site, #value)?;)
}

fn initialiser(init: &Init) -> TokenStream {
    match init {
        Init::Value { eq, value, diverge } => {
            let diverge = diverge.as_ref().map(|(els, value)| quote!(#els #value));
            quote!(#eq #value #diverge)
        }
        Init::Flow(eq, inner) => {
            let inner = flow(inner);
            quote!(#eq #inner)
        }
    }
}

fn flow(inner: &Flow) -> TokenStream {
    match inner {
        Flow::Plate(inner) => plate(inner),
        Flow::If { if_token, condition, then, otherwise } => {
            let then = block(then);
            let otherwise = otherwise.as_ref().map(|(else_token, other)| {
                let other = flow(other);
                quote!(#else_token #other)
            });
            quote!(#if_token #condition #then #otherwise)
        }
        Flow::Match { match_token, scrutinee, brace, arms } => {
            let mut tokens = quote!(#match_token #scrutinee);
            brace.surround(&mut tokens, |tokens| tokens.extend(arms.iter().map(arm)));
            tokens
        }
        Flow::Block(inner) => block(inner),
    }
}

fn arm(arm: &Arm) -> TokenStream {
    let Arm { pat, guard, arrow, body } = arm;
    let guard = guard.as_ref().map(|(if_token, guard)| quote!(#if_token #guard));
    let body = match body {
        ArmBody::Block(inner) => block(inner),
        ArmBody::Value(value) => quote!(#value,),
    };
    quote!(#pat #guard #arrow #body)
}

/// A loop, between the declarations of what it sums up apart and their additions.
fn plate(plate: &Plate) -> TokenStream {
    let Plate { label, for_token, pat, in_token, iter, unwinds, shared, summed, body } = plate;
    let (cx, span) = (cx(), Span::mixed_site());
    let mut body = block(body);
    if *unwinds {
        body = quote_spanned!(span=> {
            let mark = #cx.mark();
            #body
            #cx.unwind(mark);
        });
    }
    let tokens = quote!(#label #for_token #pat #in_token #iter #body);
    if shared.is_empty() && summed.is_empty() {
        return tokens;
    }
    let declared = shared.iter().map(|name| {
        let sum = shared_name(name);
        quote_spanned!(name.span()=> let #sum = (&__Of(&#name)).sum();)
    });
    let added = shared.iter().map(|name| {
        let sum = shared_name(name);
        quote_spanned!(name.span()=> #sum.deposit();)
    });
    let sites = summed.iter().map(|&number| site(number));
    let sums: Vec<_> = summed.iter().map(|&number| sum_of(number)).collect();
    quote_spanned! {span=> {
        #(#declared)*
        #(#[allow(unused_mut)] let mut #sums = #cx.total();)*
        #tokens
        #(#added)*
        #(#cx.add_total(#sites, #sums)?;)*
    }}
}
