//! The implementation of `ppl::Model`, written so that `cargo expand` reads well.
//!
//! Names of the macro's own have mixed-site spans: variables of a user called `cx` are others.
//! Tokens of the user are handed on as they are.

use std::collections::HashSet;

use proc_macro2::{Literal, Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{
    Generics, Ident, Lifetime, Type, TypeFnPtr, WherePredicate, parse_quote, parse_quote_spanned,
};

use crate::arithmetic::sum_of;
use crate::attributes::Mark;
use crate::lower::Site;
use crate::parse::{Arm, ArmBody, Block, Flow, Init, Kind, Statement, plain_name};
use crate::scan;
use crate::signature::{Argument, Model};

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
    let (introduced, applied, bounds) = with_sync(&mut owned).split_for_impl();
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
        #[allow(clippy::too_many_arguments)]
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
                    use ::ppl::__private::{Apart as _, At as _, Number as _, Other as _, Together as _};
                    #sites
                    #(#bindings)*
                    #statements
                    ::core::result::Result::Ok(())
                }
            }
            ::ppl::Bound::new(#data { #(#names),* })
        }
    }
}

/// The generics and types of the data: elided lifetimes get names.
pub(crate) fn owned(generics: &Generics, arguments: &[Argument]) -> (Generics, Vec<Type>) {
    let mut named = Named {
        taken: generics.lifetimes().map(|parameter| parameter.lifetime.ident.to_string()).collect(),
        argument: String::new(),
        new: Vec::new(),
    };
    let types = arguments.iter().map(|argument| {
        let mut ty = argument.ty.clone();
        named.argument = argument.name.unraw().to_string();
        named.visit_type_mut(&mut ty);
        ty
    });
    let types = types.collect();
    let mut generics = generics.clone();
    for lifetime in named.new.iter().rev() {
        generics.params.insert(0, parse_quote!(#lifetime));
    }
    (generics, types)
}

/// Type parameters can be shared; the bound goes where the user has put others.
fn with_sync(generics: &mut Generics) -> &mut Generics {
    let mut elsewhere = generics.where_clause.take();
    for parameter in generics.type_params_mut() {
        let name = &parameter.ident;
        let bounds =
            elsewhere.iter_mut().flat_map(|clause| &mut clause.predicates).find_map(|predicate| {
                match predicate {
                    WherePredicate::Type(bound) if bound.bounded_ty == parse_quote!(#name) => {
                        Some(&mut bound.bounds)
                    }
                    _ => None,
                }
            });
        let sync = parse_quote_spanned!(name.span()=> ::core::marker::Sync);
        bounds.unwrap_or(&mut parameter.bounds).push(sync);
    }
    generics.where_clause = elsewhere;
    generics
}

/// Names elided lifetimes after the argument that they stand in.
struct Named {
    taken: HashSet<String>,
    argument: String,
    new: Vec<Lifetime>,
}

impl Named {
    fn next(&mut self, span: Span) -> Lifetime {
        let mut name = self.argument.clone();
        while !self.taken.insert(name.clone()) {
            name.push('_');
        }
        let lifetime = Lifetime::new(&format!("'{name}"), span);
        self.new.push(lifetime.clone());
        lifetime
    }
}

impl VisitMut for Named {
    fn visit_type_reference_mut(&mut self, ty: &mut syn::TypeReference) {
        if ty.lifetime.is_none() {
            ty.lifetime = Some(self.next(ty.and_token.span()));
        }
        visit_mut::visit_type_reference_mut(self, ty);
    }

    fn visit_lifetime_mut(&mut self, lifetime: &mut Lifetime) {
        if lifetime.ident == "_" {
            *lifetime = self.next(lifetime.span());
        }
    }

    // lifetimes in there are bound there
    fn visit_type_fn_ptr_mut(&mut self, _: &mut TypeFnPtr) {}
    fn visit_parenthesized_generic_arguments_mut(
        &mut self,
        _: &mut syn::ParenthesizedGenericArguments,
    ) {
    }
}

/// Data in the body: references and numbers as they are, everything else behind `&`.
pub(crate) fn binding(argument: &Argument) -> TokenStream {
    const NUMBERS: [&str; 16] = [
        "f64", "f32", "usize", "u8", "u16", "u32", "u64", "u128", "isize", "i8", "i16", "i32",
        "i64", "i128", "bool", "char",
    ];
    let span = Span::mixed_site();
    let (name, this) = (&argument.name, Ident::new("self", span));
    let copied = match &argument.ty {
        Type::Reference(_) => true,
        Type::Path(path) => NUMBERS.iter().any(|number| path.path.is_ident(number)),
        _ => false,
    };
    if copied {
        quote_spanned!(span=> let #name = #this.#name;)
    } else {
        quote_spanned!(span=> let #name = &#this.#name;)
    }
}

/// The name of the type that holds the data.
pub(crate) fn data_name(function: &Ident) -> Ident {
    format_ident!("__{}", camel_case(&function.unraw().to_string()), span = function.span())
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
        let in_loop = match &site.plate {
            Some(dimension) => Some(quote!(.along(#dimension))),
            None => site.repeated.then(|| quote!(.in_loop())),
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
    let mut tokens = TokenStream::new();
    block.brace.surround(&mut tokens, |tokens| {
        tokens.extend(statements(block, predicted));
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

fn statement(statement: &Statement) -> TokenStream {
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
        Kind::Rust(stmt) => stmt.to_token_stream(),
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
fn total_of(site: usize) -> Ident {
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
            label, for_token, pat, in_token, iter, body, unwinds, summed, totals, ..
        } => {
            let mut body = block(body, predicted);
            if *unwinds {
                let cx = cx();
                body = quote_spanned!(Span::mixed_site()=> {
                    let mark = #cx.mark();
                    #body
                    #cx.unwind(mark);
                });
            }
            let plate = quote!(#label #for_token #pat #in_token #iter #body);
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
                #(#[allow(unused_mut)] let mut #totals = 0.0f64;)*
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
        ArmBody::Value(value) => quote!(#value,),
    };
    quote!(#pat #guard #arrow #body)
}

fn camel_case(name: &str) -> String {
    let words = name.split('_').filter(|word| !word.is_empty());
    let capital = |word: &str| {
        let mut letters = word.chars();
        let first = letters.next().into_iter().flat_map(char::to_uppercase);
        first.chain(letters).collect::<String>()
    };
    words.map(capital).collect()
}
