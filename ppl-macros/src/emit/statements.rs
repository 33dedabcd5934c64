//! Statements as Rust, by what the plan says of them.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote, quote_spanned};
use syn::Ident;
use syn::ext::IdentExt;
use syn::spanned::Spanned;

use super::names::{cx, cx_at, site, sum_of, value};
use crate::ast::{Arm, ArmBody, Block, Flow, For, Id, Init, Kind, Left, Mark, Statement};
use crate::plan::{Plan, shared_name};

/// The statements of a body in order.
pub(super) fn statements(plan: &Plan) -> TokenStream {
    Emitter { plan, is_predicted: false }.statements(&plan.body)
}

#[derive(Clone, Copy)]
struct Emitter<'a> {
    plan: &'a Plan,
    /// Inside what runs on finished draws only.
    is_predicted: bool,
}

impl Emitter<'_> {
    fn block(self, block: &Block) -> TokenStream {
        let mut tokens = TokenStream::new();
        block.brace.surround(&mut tokens, |tokens| tokens.extend(self.statements(block)));
        tokens
    }

    /// In a block that is not itself predicted, `#[predict]` opens the part that runs on finished draws
    /// only.
    fn statements(self, block: &Block) -> TokenStream {
        let is_late = |statement: &Statement| !self.is_predicted && statement.mark == Mark::Predict;
        let is_end = |statement: &&Statement| matches!(statement.kind, Kind::End(_));
        let late = block.statements.iter().position(is_late).unwrap_or(block.statements.len());
        let (always, predicted) = block.statements.split_at(late);
        let mut tokens: TokenStream = always.iter().map(|step| self.statement(step)).collect();
        let (end, predicted): (Vec<_>, Vec<_>) = predicted.iter().partition(is_end);
        if !predicted.is_empty() {
            let (cx, own) = (cx(), Self { is_predicted: true, ..self });
            let predicted = predicted.into_iter().map(|statement| own.statement(statement));
            tokens
                .extend(quote_spanned!(Span::mixed_site()=> if #cx.predicts() { #(#predicted)* }));
        }
        tokens.extend(end.into_iter().map(|value| self.statement(value)));
        tokens
    }

    fn statement(self, statement: &Statement) -> TokenStream {
        let (cx, attrs) = (cx(), &statement.attrs);
        let labels = statement.dims.iter().filter_map(|dim| {
            let span = Span::mixed_site().located_at(dim.name.span());
            let (name, labels) = (dim.name.unraw().to_string(), dim.labels.as_ref()?);
            Some(quote_spanned!(span=> #cx.coordinates(#name, || #labels);))
        });
        let action = self.action(statement);
        quote!(#(#labels)* #(#attrs)* #action)
    }

    fn action(self, statement: &Statement) -> TokenStream {
        let (number, is_recorded) = (self.plan.site(statement.id), statement.mark != Mark::None);
        match &statement.kind {
            Kind::Tilde { left, tilde, right } => {
                self.tilde(statement, left, right, Span::mixed_site().located_at(tilde.span()))
            }
            Kind::Let { let_token, pat, init } => {
                let init = init.as_ref().map(|init| self.init(init));
                let name = match pat {
                    syn::Pat::Type(typed) => &*typed.pat,
                    other => other,
                };
                let record = is_recorded.then(|| self.record(number, name));
                quote!(#let_token #pat #init; #record)
            }
            Kind::Factor { name, weight } => {
                let span = Span::mixed_site().located_at(name.span());
                let (cx, site) = (cx_at(name.span()), site(number));
                let weight = quote_spanned!(weight.span()=> &(#weight));
                quote_spanned!(span=> #cx.factor(#site, ::ppl::Datum::lift(#weight))?;)
            }
            Kind::For(plate) => self.plate(statement.id, plate),
            Kind::Flow(flow) => self.flow(flow),
            Kind::End(init) => {
                let (name, init) = (value(), self.init(init));
                quote_spanned!(Span::mixed_site()=> let #name #init;)
            }
            Kind::Rust(stmt) => stmt.to_token_stream(),
            Kind::Broken { names, error } => {
                let mut errors = error.clone().into_iter().map(|error| error.to_compile_error());
                // what the names stand for
                let value = names.first().map(|first| (first, errors.next()));
                let value = value.map(|(first, error)| quote!(let #first = #error;));
                let (first, others) = (names.first(), names.iter().skip(1));
                quote!(#value #(#errors)* #(#[allow(unused_variables)] let #others = #first;)*)
            }
        }
    }

    /// `span` is where the `~` stands: there is reported what does not fit together.
    fn tilde(
        self,
        statement: &Statement,
        left: &Left,
        right: &syn::Expr,
        span: Span,
    ) -> TokenStream {
        let number = self.plan.site(statement.id);
        let (cx, site) = (cx_at(span), site(number));
        match left {
            // it counts as used: it is in the results
            Left::Unknown(let_token, name) => {
                let method =
                    Ident::new(if self.is_predicted { "predict" } else { "unknown" }, span);
                quote_spanned! {span=>
                    #[allow(unused_variables)]
                    #let_token #name = #cx.#method(#site, #right)?;
                }
            }
            Left::Part(let_token, name) => {
                let method = match self.is_predicted {
                    true => quote_spanned!(span=> ::ppl::Prediction::predict),
                    false => quote_spanned!(span=> ::ppl::Declaration::declare),
                };
                let record = (statement.mark == Mark::Track).then(|| self.record(number, name));
                quote_spanned! {span=>
                    #[allow(unused_variables)]
                    #let_token #name = #method(#right, #site, #cx)?; #record
                }
            }
            Left::Place(place) => {
                let datum = quote_spanned!(place.span()=> &#place);
                if self.plan.is_summed(number) {
                    let sum = sum_of(number);
                    return quote_spanned! {span=>
                        #cx.condition_in_loop(#site, #right, #datum, &mut #sum)?;
                    };
                }
                quote_spanned!(span=> #cx.condition(#site, #right, #datum)?;)
            }
            Left::Missing(place) => {
                let datum = quote_spanned!(place.span()=> &#place);
                // afterwards the name stands for what is complete
                let names = statement.declared();
                let names = names.iter().map(|name| quote!(#[allow(unused_variables)] let #name =));
                quote_spanned!(span=> #(#names)* #cx.complete(#site, #right, #datum)?;)
            }
        }
    }

    fn record(self, number: usize, name: impl ToTokens + Spanned) -> TokenStream {
        let (cx, site) = (cx(), site(number));
        let span = Span::mixed_site().located_at(name.span());
        let value = quote_spanned!(name.span()=> &#name);
        let method = if self.is_predicted { "track_prediction" } else { "track" };
        let method = Ident::new(method, span);
        quote_spanned!(span=> #cx.#method(#site, #value)?;)
    }

    fn init(self, init: &Init) -> TokenStream {
        match init {
            Init::Value { eq, value, diverge } => {
                let diverge = diverge.as_ref().map(|(els, value)| quote!(#els #value));
                quote!(#eq #value #diverge)
            }
            Init::Flow(eq, flow) => {
                let flow = self.flow(flow);
                quote!(#eq #flow)
            }
        }
    }

    fn flow(self, flow: &Flow) -> TokenStream {
        match flow {
            Flow::If { if_token, condition, then, otherwise } => {
                let then = self.block(then);
                let otherwise = otherwise.as_ref().map(|(else_token, other)| {
                    let other = self.flow(other);
                    quote!(#else_token #other)
                });
                quote!(#if_token #condition #then #otherwise)
            }
            Flow::Match { match_token, scrutinee, brace, arms } => {
                let mut tokens = quote!(#match_token #scrutinee);
                let arms = arms.iter().map(|arm| self.arm(arm));
                brace.surround(&mut tokens, |tokens| tokens.extend(arms));
                tokens
            }
            Flow::Block(block) => self.block(block),
        }
    }

    fn arm(self, arm: &Arm) -> TokenStream {
        let Arm { pat, guard, arrow, body } = arm;
        let guard = guard.as_ref().map(|(if_token, guard)| quote!(#if_token #guard));
        let body = match body {
            ArmBody::Block(block) => self.block(block),
            ArmBody::Value(value) => quote!(#value,),
        };
        quote!(#pat #guard #arrow #body)
    }

    /// A loop, between the declarations of what it sums up apart and their additions.
    fn plate(self, id: Id, plate: &For) -> TokenStream {
        let For { label, for_token, pat, in_token, iter, body } = plate;
        let (cx, span) = (cx(), Span::mixed_site());
        let Some(planned) = self.plan.plate(id) else {
            let body = self.block(body);
            return quote!(#label #for_token #pat #in_token #iter #body);
        };
        if planned.is_pooled
            && let [Statement { id, attrs, kind, .. }] = body.statements.as_slice()
            && let Kind::Tilde { tilde, right, .. } = kind
        {
            let (span, site) = (span.located_at(tilde.span()), site(self.plan.site(*id)));
            let cx = cx_at(span);
            return quote_spanned!(span=> #(#attrs)* #cx.condition_all(#site, #right, #iter)?;);
        }
        let mut body = self.block(body);
        if planned.unwinds {
            body = quote_spanned!(span=> {
                let mark = #cx.mark();
                #body
                #cx.unwind(mark);
            });
        }
        let tokens = quote!(#label #for_token #pat #in_token #iter #body);
        let (names, terms) = (&planned.sums.names, &planned.sums.terms);
        if names.is_empty() && terms.is_empty() {
            return tokens;
        }
        let declared = names.iter().map(|name| {
            let sum = shared_name(name);
            quote_spanned!(name.span()=> let #sum = (&__Of(&#name)).sum();)
        });
        let added = names.iter().map(|name| {
            let sum = shared_name(name);
            quote_spanned!(name.span()=> #sum.deposit();)
        });
        let sites = terms.iter().map(|&number| site(number));
        let sums: Vec<_> = terms.iter().map(|&number| sum_of(number)).collect();
        quote_spanned! {span=> {
            #(#declared)*
            #(#[allow(unused_mut)] let mut #sums = #cx.total();)*
            #tokens
            #(#added)*
            #(#cx.add_total(#sites, #sums)?;)*
        }}
    }
}
