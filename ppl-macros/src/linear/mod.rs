//! Loops whose observations are normal about means that are linear in unknowns: once the data are
//! bound, few rows can stand for them (`ppl/src/rows`).
//!
//! A mean such as `a + tau * z[group[i]] + b * x[i]` is taken apart into coefficients, of data
//! alone, and what they multiply, which the data enter as indices at most: rows that share these
//! indices share their unknowns.

mod parts;
mod statements;
mod sums;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::visit_mut::VisitMut;
use syn::{Expr, Ident, Pat, Stmt, parse_quote};

use crate::arithmetic::operand;
use crate::ast::{Block, Kind};
use crate::attributes::Mark;
use crate::formula::Formulas;
use crate::linear::parts::{Multiplied, Parts, group};
use crate::linear::statements::Statements;
pub(crate) use crate::linear::sums::Told;

/// What a loop says about its observations.
pub(crate) struct Linear {
    /// Statements about data, which the rest may use.
    pub(crate) data: Vec<TokenStream>,
    /// Where the unknowns of an observation stand.
    pub(crate) places: Vec<Expr>,
    pub(crate) columns: Vec<Column>,
    /// What the mean has besides, with signs.
    pub(crate) offsets: Vec<TokenStream>,
    /// What the coefficients multiply, where it is a formula, by its variable.
    pub(crate) unknowns: Vec<(Ident, Expr)>,
    /// What the distribution needs of a row.
    pub(crate) variables: Vec<Stmt>,
    /// The distribution with a row's coefficients.
    pub(crate) distribution: Expr,
    /// The distribution of what the rows leave.
    pub(crate) rest: Expr,
}

/// A coefficient, or several with their unknowns.
pub(crate) enum Column {
    One(TokenStream),
    Dot { factor: TokenStream, data: TokenStream, unknowns: TokenStream },
    Sum(Box<Told>),
}

impl Formulas {
    /// Takes the loop apart, if it is of that kind; `body` as it was written.
    pub(crate) fn linear(&mut self, pat: &Pat, body: &Block) -> Option<Linear> {
        let (last, before) = body.statements.split_last()?;
        let Kind::Observe { place, distribution: Expr::Call(call), .. } = &last.kind else {
            return None;
        };
        let Expr::Path(path) = &*call.func else { return None };
        let is_normal = path.path.segments.last()?.ident == "Normal" && call.args.len() == 2;
        let is_read = !statements::leaves(call) && call.args.iter().all(statements::has_type);
        if !is_normal || last.mark != Mark::None || !is_read {
            return None;
        }
        let mut names = self.names(pat);
        let Statements { data, derived, mut loops } = Statements::read(&mut names, before)?;
        let (mut mean, mut scale) = (call.args[0].clone(), call.args[1].clone());
        statements::substitute(derived, &mut mean, &mut scale, &mut loops)?;
        if names.has_unknown(place) {
            return None;
        }
        let mut parts = Parts::new(names, loops);
        parts.take(&mean)?;
        if parts.is_empty() || !parts.is_shared(&scale) || parts.names.has_own(&scale) {
            return None;
        }
        let Parts { places, terms, offsets, sums, .. } = parts;
        let (mut columns, mut summands, mut unknowns) = (Vec::new(), Vec::new(), Vec::new());
        let (mut variables, span) = (Vec::new(), Span::mixed_site());
        for sum in sums {
            let (told, written) = self.sum(sum);
            columns.push(Column::Sum(Box::new(told)));
            if let Some(written) = written {
                variables.extend(written.variables);
                summands.push(written.sum);
            }
        }
        for (factor, of) in group(terms) {
            match of {
                Multiplied::One(mut atom) => {
                    self.open(&mut atom);
                    let name = format_ident!("unknown_{}", unknowns.len(), span = span);
                    let operand = operand(&parse_quote!(#name));
                    summands.push(quote_spanned!(span=> #operand * row.coefficient()));
                    unknowns.push((name, atom));
                    columns.push(Column::One(factor));
                }
                Multiplied::Dot { data, unknowns: mut numbers } => {
                    let raw = numbers.to_token_stream();
                    match &mut numbers {
                        Expr::Reference(reference) => {
                            if let Some(sum) = self.summed(&reference.expr) {
                                *reference.expr = sum;
                            }
                        }
                        other => self.visit_expr_mut(other),
                    }
                    summands.push(quote_spanned!(span=> row.dot(#numbers)));
                    let data = data.into_token_stream();
                    columns.push(Column::Dot { factor, data, unknowns: raw });
                }
            }
        }
        let func = &call.func;
        let mut distribution = |mean: TokenStream| {
            let mean = Expr::Verbatim(mean);
            let mut call: Expr = parse_quote!(#func(__mean, #scale));
            if let Expr::Call(call) = &mut call {
                call.args[0] = mean;
            }
            self.distribution(&mut call);
            call
        };
        let rest = distribution(quote!(0.0));
        let distribution = distribution(quote!(#(#summands)+*));
        Some(Linear { data, places, columns, offsets, unknowns, variables, distribution, rest })
    }
}
