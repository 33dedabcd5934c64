//! What is written for loops whose observations rows may stand for: how they are told when the
//! data are bound, and what runs in their place.

use proc_macro2::{Literal, Span, TokenStream};
use quote::{quote, quote_spanned};
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, Ident, Pat};

use crate::ast::{Block, Kind};
use crate::emit::{cx, total_of};
use crate::linear::{Column, Linear, Told};

/// Whether rows stand for the observations of the loop, having been run if so.
pub(crate) fn replacement(linear: &Linear, pat: &Pat, iter: &Expr, site: usize) -> TokenStream {
    let (cx, total) = (cx(), total_of(site));
    let Linear { data, unknowns, variables, distribution, rest, .. } = linear;
    let (names, formulas): (Vec<_>, Vec<_>) = unknowns.iter().map(|(n, f)| (n, f)).unzip();
    let is_fixed = names.len() == linear.columns.len();
    let width = Literal::usize_unsuffixed(if is_fixed { names.len() + 1 } else { 0 });
    let mut iter = iter.clone();
    Zips.visit_expr_mut(&mut iter);
    quote_spanned! {Span::mixed_site()=>
        <Self as ::ppl::Model>::STATIC && __C::REPLACES && 'rows: {
            let ::core::option::Option::Some(rows) = #cx.rows() else { break 'rows false };
            let mut iterations = ::core::iter::IntoIterator::into_iter(#iter);
            for (gap, group) in rows.groups::<#width>() {
                #[allow(unused_variables)]
                let ::core::option::Option::Some(#pat) = iterations.nth(gap) else {
                    break 'rows true;
                };
                #(#[allow(unused_variables)] #data)*
                #(let #names = (&::ppl::__private::Of(&(#formulas))).sum();)*
                for mut row in group {
                    #(#[allow(unused_variables)] #variables)*
                    ::ppl::__private::settle::<::ppl::Real<__C::Number>, _>(
                        &#distribution, row, &mut #total,
                    );
                }
                #(#names.deposit();)*
            }
            rows.settle_rest::<::ppl::Real<__C::Number>, _>(&#rest, &mut #total);
            true
        }
    }
}

/// Tells the row of an iteration, at its end.
pub(crate) fn told(linear: &Linear, body: &Block) -> TokenStream {
    let Some(Kind::Observe { place, distribution, .. }) = body.statements.last().map(|s| &s.kind)
    else {
        return TokenStream::new();
    };
    let (cx, row) = (cx(), Ident::new("row", Span::mixed_site()));
    let Linear { places, columns, offsets, .. } = linear;
    let columns = columns.iter().map(|column| match column {
        Column::One(factor) => quote!(#row.coefficient(#factor);),
        Column::Dot { factor, data, unknowns } => quote!(#row.dot(#factor, #data, #unknowns);),
        Column::Sum(told) => {
            let Told { pat, iter, coefficients, offsets } = &**told;
            quote_spanned! {Span::mixed_site()=>
                let mut turns = 0;
                #[allow(unused_variables)]
                for #pat in #iter {
                    turns += 1;
                    #(#row.coefficient(#coefficients);)*
                    #(#row.offset(#offsets);)*
                }
                #row.index(turns);
            }
        }
    });
    quote_spanned! {Span::mixed_site()=>
        if <Self as ::ppl::Model>::STATIC && __C::BINDS {
            #cx.add_row(&#distribution, ::ppl::Datum::lift(&#place), |#row| {
                #(#row.index((&::ppl::__private::Of(&(#places))).place());)*
                #(#columns)*
                #(#row.offset(#offsets);)*
            });
        }
    }
}

/// After the loop.
pub(crate) fn end() -> TokenStream {
    let cx = cx();
    quote_spanned! {Span::mixed_site()=>
        if <Self as ::ppl::Model>::STATIC && __C::BINDS {
            #cx.end_rows();
        }
    }
}

/// Iterations can be left out of zipped data without looking at them.
struct Zips;

impl VisitMut for Zips {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        visit_mut::visit_expr_mut(self, expr);
        if let Expr::MethodCall(call) = expr
            && call.method == "zip"
            && call.args.len() == 1
        {
            let (first, second) = (&call.receiver, &call.args[0]);
            *expr = Expr::Verbatim(
                quote_spanned!(Span::mixed_site()=> ::ppl::__private::zip(#first, #second)),
            );
        }
    }

    // what closures do to elements is not seen here
    fn visit_expr_closure_mut(&mut self, _: &mut syn::ExprClosure) {}
}
