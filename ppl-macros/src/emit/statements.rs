//! Emits the statements of a model as Rust code, using the results of the analyses.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::ext::IdentExt;
use syn::spanned::Spanned;
use syn::visit_mut::VisitMut;
use syn::{Error, Expr, Ident};

use crate::analyse::{Analysis, Site};
use crate::ast::{Arm, Block, Flow, For, Id, Kind, Left, Mark, Model, Statement};
use crate::plan::{Plan, Sums, here, shared_name, site};
use crate::syntax::patterns::only_name;

/// Emits the statements of a body in order. Returns the code and the sites to which the code refers.
pub(super) fn statements(model: &Model, analysis: &Analysis) -> (TokenStream, Vec<Site>) {
    let plan = Plan::new(analysis);
    let mut emitter = Emitter { analysis, plan, is_predicted: false };
    (emitter.statements(&model.body), emitter.plan.sites)
}

struct Emitter<'a> {
    analysis: &'a Analysis,
    plan: Plan<'a>,
    /// Whether the current statement is part of a prediction, which runs on finished draws only.
    is_predicted: bool,
}

impl Emitter<'_> {
    fn block(&mut self, block: &Block) -> TokenStream {
        let (mut tokens, statements) = (TokenStream::new(), self.statements(block));
        block.brace.surround(&mut tokens, |tokens| tokens.extend(statements));
        tokens
    }

    /// Emits the statements of a block. The first `#[predict]` statement and all following statements form
    /// the prediction, which runs on finished draws only; a block inside a prediction is not divided.
    fn statements(&mut self, block: &Block) -> TokenStream {
        let [mut always, mut predicted, mut end] = [(); 3].map(|()| TokenStream::new());
        let outer = self.is_predicted;
        for statement in &block.statements {
            let is_end = matches!(statement.kind, Kind::End(_));
            let is_late = self.is_predicted || statement.mark == Mark::Predict;
            self.is_predicted = if is_end { outer } else { is_late };
            let part = match is_end {
                true => &mut end,
                false if is_late && !outer => &mut predicted,
                false => &mut always,
            };
            part.extend(self.statement(statement));
        }
        self.is_predicted = outer;
        if !predicted.is_empty() {
            let cx = cx();
            predicted = quote_spanned!(Span::mixed_site()=> if #cx.predicts() { #predicted });
        }
        quote!(#always #predicted #end)
    }

    fn statement(&mut self, statement: &Statement) -> TokenStream {
        let (cx, attrs) = (cx(), &statement.attrs);
        if let Some(error) = self.analysis.facts.errors.get(&statement.id) {
            let error = broken(&statement.declared(), error);
            return quote!(#(#attrs)* #error);
        }
        let around = std::mem::replace(&mut self.plan.at, statement.id);
        let labels = statement.dims.iter().filter_map(|dim| {
            let (name, labels) = (dim.name.unraw().to_string(), dim.labels.as_ref()?);
            let labels = self.plan.written(labels, Plan::labels);
            Some(quote_spanned!(here(&dim.name)=> #cx.coordinates(#name, || #labels);))
        });
        let labels: TokenStream = labels.collect();
        let action = self.action(statement);
        self.plan.at = around;
        quote!(#labels #(#attrs)* #action)
    }

    fn action(&mut self, statement: &Statement) -> TokenStream {
        match &statement.kind {
            Kind::Tilde { left, tilde, right } => self.tilde(statement, left, right, here(tilde)),
            Kind::Let { let_token, pat, init } => {
                let site = (statement.mark != Mark::None).then(|| self.plan.site());
                let pat = self.plan.written(pat, Plan::visit_pat_mut);
                let init = init.as_ref().map(|init| {
                    let (eq, diverge) = (&init.eq, init.diverge.as_ref());
                    let value = match &init.value {
                        Flow::Value(value) => self.plan.declared(&pat, value).to_token_stream(),
                        flow => self.value(flow),
                    };
                    let diverge = diverge.map(|(els, block)| (els, self.block(block)));
                    let diverge = diverge.map(|(els, block)| quote!(#els #block));
                    quote!(#eq #value #diverge)
                });
                let recorded = site.zip(only_name(&pat));
                let record = recorded.map(|(site, name)| self.record(site, name));
                quote!(#let_token #pat #init; #record)
            }
            Kind::Factor { name, weight } => {
                let (cx, site) = (cx_at(name.span()), site(self.plan.site()));
                let weight = self.plan.written(weight, Plan::visit_expr_mut);
                let weight = quote_spanned!(weight.span()=> &(#weight));
                quote_spanned!(here(name)=> #cx.factor(&#site, ::ppl::Datum::lift(#weight))?;)
            }
            Kind::For(plate) => self.plate(statement.id, plate),
            Kind::Flow(flow) => self.flow(flow),
            Kind::End(flow) => {
                let end = self.value(flow);
                // the compiler reports type errors of the final value at this span
                let span = Span::mixed_site().located_at(statement.span);
                quote_spanned!(span=> ::core::result::Result::Ok(#end))
            }
            Kind::Rust(stmt) => self.plan.written(stmt, Plan::visit_stmt_mut).to_token_stream(),
            Kind::Broken { names, error } => broken(names, error),
        }
    }

    /// Emits a `~` statement. `span` is the span of `~`, where type errors are reported.
    fn tilde(
        &mut self,
        statement: &Statement,
        left: &Left,
        right: &Expr,
        span: Span,
    ) -> TokenStream {
        let number = self.plan.site();
        let (cx, site) = (cx_at(span), site(number));
        match left {
            // the variable is recorded in the results, so the lint `unused_variables` does not apply
            Left::Unknown(let_token, name) => {
                let right = self.plan.written(right, Plan::distribution);
                let method = if self.is_predicted { "predict" } else { "unknown" };
                let method = Ident::new(method, span);
                quote_spanned! {span=>
                    #[allow(unused_variables)]
                    #let_token #name = #cx.#method(&#site, #right)?;
                }
            }
            Left::Part(let_token, name) => {
                let right = self.plan.written(right, Plan::visit_expr_mut);
                let method = match self.is_predicted {
                    true => quote_spanned!(span=> ::ppl::Prediction::predict),
                    false => quote_spanned!(span=> ::ppl::Declaration::declare),
                };
                let record = (statement.mark == Mark::Track).then(|| self.record(number, name));
                quote_spanned! {span=>
                    #[allow(unused_variables)]
                    #let_token #name = #method(#right, &#site, #cx)?; #record
                }
            }
            Left::Place(place) | Left::Missing(place) => {
                let place = self.plan.written(place, Plan::rewrite_place);
                let right = self.plan.written(right, Plan::distribution);
                let datum = quote_spanned!(place.span()=> &#place);
                if let Left::Missing(_) = left {
                    // after this statement, the name of the place refers to the data in which the
                    // missing values have been replaced by unknowns
                    let names = statement.declared();
                    return quote_spanned! {span=>
                        #(#[allow(unused_variables)] let #names =)*
                        #cx.complete(&#site, #right, #datum)?;
                    };
                }
                if self.plan.sums_up(number) {
                    let sum = sum_of(number);
                    return quote_spanned! {span=>
                        #cx.condition_in_loop(&#site, #right, #datum, &mut #sum)?;
                    };
                }
                quote_spanned!(span=> #cx.condition(&#site, #right, #datum)?;)
            }
        }
    }

    fn record(&self, number: usize, name: &Ident) -> TokenStream {
        let (cx, site) = (cx(), site(number));
        let value = quote_spanned!(name.span()=> &#name);
        let method = if self.is_predicted { "track_prediction" } else { "track" };
        let method = Ident::new(method, here(name));
        quote_spanned!(here(name)=> #cx.#method(&#site, #value)?;)
    }

    /// Emits the control flow that computes the initial value of a declaration or the final value of a submodel.
    fn value(&mut self, flow: &Flow) -> TokenStream {
        let aligned = self.plan.written(flow, Plan::align);
        self.flow(&aligned)
    }

    fn flow(&mut self, flow: &Flow) -> TokenStream {
        match flow {
            Flow::If { if_token, condition, then, otherwise } => {
                let condition = self.plan.written(condition, Plan::visit_expr_mut);
                let then = self.block(then);
                let otherwise = otherwise.as_ref().map(|(else_token, other)| {
                    let other = self.flow(other);
                    quote!(#else_token #other)
                });
                quote!(#if_token #condition #then #otherwise)
            }
            Flow::Match { match_token, scrutinee, brace, arms } => {
                let scrutinee = self.plan.written(scrutinee, Plan::visit_expr_mut);
                let mut tokens = quote!(#match_token #scrutinee);
                let arms = arms.iter().map(|arm| self.arm(arm));
                brace.surround(&mut tokens, |tokens| tokens.extend(arms));
                tokens
            }
            Flow::Block(block) => self.block(block),
            Flow::Value(value) => self.plan.written(value, Plan::visit_expr_mut).to_token_stream(),
        }
    }

    fn arm(&mut self, arm: &Arm) -> TokenStream {
        let Arm { pat, guard, arrow, body } = arm;
        let guard = guard.as_ref().map(|(if_token, guard)| {
            let guard = self.plan.written(guard, Plan::visit_expr_mut);
            quote!(#if_token #guard)
        });
        let body = self.flow(body);
        quote!(#pat #guard #arrow #body,)
    }

    /// Emits a plate (a `for` loop of the model) as a Rust loop. The variables that sum log density terms and
    /// adjoints over the iterations are declared before the loop, and are added to the totals after the loop.
    fn plate(&mut self, statement: Id, plate: &For) -> TokenStream {
        let For { label, for_token, pat, in_token, iter, body } = plate;
        let (cx, span) = (cx(), Span::mixed_site());
        let iter = self.plan.written(iter, Plan::visit_expr_mut);
        let pat = self.plan.written(pat, Plan::visit_pat_mut);
        let facts = self.plan.plate(statement);
        if facts.is_some_and(|facts| facts.is_pooled)
            && let [Statement { id, attrs, kind: Kind::Tilde { tilde, right, .. }, .. }] =
                body.statements.as_slice()
            && !self.analysis.facts.errors.contains_key(id)
        {
            let around = std::mem::replace(&mut self.plan.at, *id);
            let (cx, site) = (cx_at(tilde.span()), site(self.plan.site()));
            let right = self.plan.written(right, Plan::distribution);
            self.plan.at = around;
            let all = quote_spanned!(here(tilde)=> #cx.condition_all(&#site, #right, #iter)?;);
            return quote!(#(#attrs)* #all);
        }
        let is_outermost = facts.is_some_and(|facts| self.plan.begin_sums(facts));
        let mut body = self.block(body);
        if facts.is_some_and(|facts| facts.unwinds) {
            body = quote_spanned!(span=> {
                let mark = #cx.mark();
                #body
                #cx.unwind(mark);
            });
        }
        let tokens = quote!(#label #for_token #pat #in_token #iter #body);
        let Sums { names, terms } = match is_outermost {
            true => self.plan.end_sums(),
            false => Sums::default(),
        };
        if names.is_empty() && terms.is_empty() {
            return tokens;
        }
        let shared: Vec<_> = names.iter().map(shared_name).collect();
        let sites = terms.iter().map(|&number| site(number));
        let sums: Vec<_> = terms.iter().map(|&number| sum_of(number)).collect();
        quote_spanned! {span=> {
            #(let #shared = (&__Of(&#names)).sum();)*
            #(#[allow(unused_mut)] let mut #sums = #cx.total();)*
            #tokens
            #(#shared.deposit();)*
            #(#cx.add_total(&#sites, #sums)?;)*
        }}
    }
}

/// Returns the identifier of the context variable, `cx`.
pub(super) fn cx() -> Ident {
    cx_at(Span::mixed_site())
}

/// Returns the identifier `cx` with the source location of `place`, where the compiler reports errors.
fn cx_at(place: Span) -> Ident {
    Ident::new("cx", Span::mixed_site().located_at(place))
}

/// Returns the name of the variable that sums the log density terms of an observation over the iterations of a loop.
fn sum_of(site: usize) -> Ident {
    format_ident!("terms_{site}", span = Span::mixed_site())
}

/// Emits a compile error instead of a statement. Also declares the names of the statement, so that later uses of
/// these names cause no further errors.
fn broken(names: &[Ident], error: &Error) -> TokenStream {
    let mut errors = error.clone().into_iter().map(|error| error.to_compile_error());
    let value = names.first().map(|first| (first, errors.next()));
    let value = value.map(|(first, error)| quote!(let #first = #error;));
    let (first, others) = (names.first(), names.iter().skip(1));
    quote!(#value #(#errors)* #(#[allow(unused_variables)] let #others = #first;)*)
}
