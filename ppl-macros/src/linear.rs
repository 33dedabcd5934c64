//! Loops whose observations are normal about means that are linear in unknowns: once the data are
//! bound, few rows can stand for them (`ppl/src/rows`).
//!
//! A mean such as `a + tau * z[group[i]] + b * x[i]` is taken apart into coefficients, of data
//! alone, and what they multiply, which the data enter as indices at most: rows that share these
//! indices share their unknowns.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Expr, ExprCall, Ident, Pat, UnOp, parse_quote};

use crate::arithmetic::{is_arithmetic, is_dot, is_function, operand};
use crate::ast::{Block, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::formula::Formulas;
use crate::inspect::{count, mentions, stays_open};
use crate::scan;

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
    /// The distribution with a row's coefficients.
    pub(crate) distribution: Expr,
    /// The distribution of what the rows leave.
    pub(crate) rest: Expr,
}

/// A coefficient, or several with their unknowns.
pub(crate) enum Column {
    One(TokenStream),
    Dot { factor: TokenStream, data: TokenStream, unknowns: TokenStream },
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
        if !is_normal || last.mark != Mark::None || self.mentions(place) || leaves(call) {
            return None;
        }
        let mut parts = Parts {
            own: scan::bound_names(pat).iter().map(Ident::to_string).collect(),
            places: Vec::new(),
            terms: Vec::new(),
            offsets: Vec::new(),
        };
        let (mut mean, mut scale) = (call.args[0].clone(), call.args[1].clone());
        let mut data = Vec::new();
        // the last first, as it may use those before it
        for (i, statement) in before.iter().enumerate().rev() {
            let (name, value) = plain(statement)?;
            let is_shadow = body.statements[..=i].iter().any(|s| uses(s, name));
            if is_shadow || parts.own.contains(&name.to_string()) {
                return None;
            }
            if self.mentions(value) {
                stays_open(&statement.kind, &body.statements[i + 1..])?;
                let mut substitute = Substitute { name, value };
                substitute.visit_expr_mut(&mut mean);
                substitute.visit_expr_mut(&mut scale);
            } else {
                parts.own.insert(name.to_string());
                data.push(quote!(let #name = #value;));
            }
        }
        data.reverse();
        parts.take(self, &mean, &[], false)?;
        if parts.terms.is_empty() || !parts.is_shared(self, &scale) || parts.own_in(&scale) {
            return None;
        }
        let Parts { places, terms, offsets, .. } = parts;
        let (mut columns, mut sum, mut formulas) = (Vec::new(), Vec::new(), Vec::new());
        let span = Span::mixed_site();
        for (factor, of) in group(terms) {
            match of {
                Multiplied::One(mut atom) => {
                    self.open(&mut atom);
                    let name = format_ident!("unknown_{}", formulas.len(), span = span);
                    let operand = operand(&parse_quote!(#name));
                    sum.push(quote_spanned!(span=> #operand * row.coefficient()));
                    formulas.push((name, atom));
                    columns.push(Column::One(factor));
                }
                Multiplied::Dot { data, mut unknowns } => {
                    let raw = unknowns.to_token_stream();
                    match &mut unknowns {
                        Expr::Reference(reference) => {
                            if let Some(sum) = self.summed(&reference.expr) {
                                *reference.expr = sum;
                            }
                        }
                        other => self.visit_expr_mut(other),
                    }
                    sum.push(quote_spanned!(span=> row.dot(#unknowns)));
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
        let distribution = distribution(quote!(#(#sum)+*));
        Some(Linear { data, places, columns, offsets, unknowns: formulas, distribution, rest })
    }
}

/// `let name = value;`, unmarked.
fn plain(statement: &Statement) -> Option<(&Ident, &Expr)> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = &statement.kind else { return None };
    let Some(Init::Value { value, diverge: None, .. }) = init else { return None };
    let is_plain = pat.by_ref.is_none() && pat.mutability.is_none() && pat.subpat.is_none();
    let is_bare = statement.mark == Mark::None && statement.attrs.is_empty();
    (is_plain && is_bare && !leaves(value)).then_some((&pat.ident, value))
}

/// Whether an expression may leave the model, or is one that cannot be read.
fn leaves(expr: &impl ToTokens) -> bool {
    let text = expr.to_token_stream().to_string();
    text.contains('?') || text.contains('!')
}

/// Whether a statement uses a name otherwise than by declaring it.
fn uses(statement: &Statement, name: &Ident) -> bool {
    match &statement.kind {
        Kind::Let { init: Some(Init::Value { value, .. }), .. } => {
            count(value.to_token_stream(), name) > 0
        }
        _ => true,
    }
}

/// Puts a value in the place of its name.
struct Substitute<'a> {
    name: &'a Ident,
    value: &'a Expr,
}

impl VisitMut for Substitute<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if matches!(expr, Expr::Path(path) if path.path.is_ident(self.name)) {
            let value = self.value;
            *expr = parse_quote!((#value));
        } else {
            visit_mut::visit_expr_mut(self, expr);
        }
    }
}

/// What a coefficient multiplies.
enum Multiplied {
    One(Expr),
    Dot { data: Expr, unknowns: Expr },
}

/// A summand of the mean.
struct Term {
    /// Data that multiply it, and whether they divide.
    factors: Vec<(bool, Expr)>,
    is_negative: bool,
    of: Multiplied,
}

/// A mean in parts.
struct Parts {
    /// Names of the loop's own.
    own: HashSet<String>,
    places: Vec<Expr>,
    terms: Vec<Term>,
    offsets: Vec<TokenStream>,
}

impl Parts {
    fn own_in(&self, expr: &Expr) -> bool {
        mentions(expr.to_token_stream(), &|name| self.own.contains(name))
    }

    /// Adds the summands of `expr`, times `factors`; `None` if it is not linear.
    fn take(
        &mut self,
        of: &Formulas,
        expr: &Expr,
        factors: &[(bool, Expr)],
        is_negative: bool,
    ) -> Option<()> {
        if !of.mentions(expr) {
            self.offsets.push(times(factors, is_negative, Some(coefficient(expr))));
            return Some(());
        }
        let with = |divides: bool, factor: &Expr| {
            let mut factors = factors.to_vec();
            factors.push((divides, factor.clone()));
            factors
        };
        match expr {
            Expr::Paren(paren) => return self.take(of, &paren.expr, factors, is_negative),
            Expr::Group(group) => return self.take(of, &group.expr, factors, is_negative),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => {
                return self.take(of, &unary.expr, factors, !is_negative);
            }
            Expr::Binary(binary) => {
                let (left, right) = (&*binary.left, &*binary.right);
                match binary.op {
                    BinOp::Add(_) => {
                        self.take(of, left, factors, is_negative)?;
                        return self.take(of, right, factors, is_negative);
                    }
                    BinOp::Sub(_) => {
                        self.take(of, left, factors, is_negative)?;
                        return self.take(of, right, factors, !is_negative);
                    }
                    BinOp::Mul(_) if !of.mentions(left) => {
                        return self.take(of, right, &with(false, left), is_negative);
                    }
                    BinOp::Mul(_) if !of.mentions(right) => {
                        return self.take(of, left, &with(false, right), is_negative);
                    }
                    BinOp::Div(_) if !of.mentions(right) => {
                        return self.take(of, left, &with(true, right), is_negative);
                    }
                    _ => {}
                }
            }
            _ => {}
        }
        let of = match expr {
            Expr::Call(ExprCall { args, .. }) if is_dot(expr) && args.len() == 2 => {
                let (data, unknowns) = (args[0].clone(), args[1].clone());
                if of.mentions(&data) || !self.is_shared(of, &unknowns) {
                    return None;
                }
                Multiplied::Dot { data, unknowns }
            }
            _ if self.is_shared(of, expr) => Multiplied::One(expr.clone()),
            _ => return None,
        };
        self.terms.push(Term { factors: factors.to_vec(), is_negative, of });
        Some(())
    }

    /// Whether the loop's own data enter only as places of unknowns, which are noted.
    fn is_shared(&mut self, of: &Formulas, expr: &Expr) -> bool {
        match expr {
            Expr::Lit(_) => true,
            Expr::Path(_) => !self.own_in(expr),
            Expr::Paren(paren) => self.is_shared(of, &paren.expr),
            Expr::Group(group) => self.is_shared(of, &group.expr),
            Expr::Reference(reference) if reference.mutability.is_none() => {
                self.is_shared(of, &reference.expr)
            }
            Expr::Field(field) => self.is_shared(of, &field.base),
            Expr::Unary(unary) => self.is_shared(of, &unary.expr),
            Expr::Binary(binary) if is_arithmetic(&binary.op) => {
                self.is_shared(of, &binary.left) && self.is_shared(of, &binary.right)
            }
            Expr::MethodCall(call) if is_function(call) => {
                self.is_shared(of, &call.receiver)
                    && call.args.iter().all(|argument| self.is_shared(of, argument))
            }
            Expr::Index(index) => {
                let is_place = self.own_in(&index.index);
                let is_known = is_place && of.mentions(&index.expr) && !of.mentions(&index.index);
                if is_known {
                    self.places.push((*index.index).clone());
                }
                (is_known || !is_place) && self.is_shared(of, &index.expr)
            }
            _ => false,
        }
    }
}

/// Data as a number.
fn coefficient(data: &Expr) -> TokenStream {
    quote_spanned!(data.span()=> (&::ppl::__private::Of(&(#data))).coefficient())
}

/// The product of factors, and of `value` if there is one.
fn times(factors: &[(bool, Expr)], is_negative: bool, value: Option<TokenStream>) -> TokenStream {
    let span = Span::mixed_site();
    let mut product = quote!(1.0f64);
    for (divides, factor) in factors {
        let factor = coefficient(factor);
        product = match divides {
            true => quote_spanned!(span=> #product / #factor),
            false => quote_spanned!(span=> #product * #factor),
        };
    }
    product.extend(value.map(|value| quote_spanned!(span=> * #value)));
    if is_negative { quote_spanned!(span=> -(#product)) } else { product }
}

/// Joins what has the same coefficients.
fn group(terms: Vec<Term>) -> Vec<(TokenStream, Multiplied)> {
    let mut groups: Vec<(String, TokenStream, Multiplied)> = Vec::new();
    for Term { factors, is_negative, of } in terms {
        match of {
            Multiplied::Dot { .. } => {
                groups.push((String::new(), times(&factors, is_negative, None), of));
            }
            Multiplied::One(atom) => {
                let factor = times(&factors, false, None);
                let key = factor.to_string();
                let found = groups.iter_mut().find(|(name, ..)| *name == key);
                match found {
                    Some((_, _, Multiplied::One(sum))) => {
                        *sum = match is_negative {
                            true => parse_quote!(#sum - (#atom)),
                            false => parse_quote!(#sum + (#atom)),
                        }
                    }
                    _ => {
                        let atom = if is_negative { parse_quote!(-(#atom)) } else { atom };
                        groups.push((key, factor, Multiplied::One(atom)));
                    }
                }
            }
        }
    }
    groups.into_iter().map(|(_, factor, of)| (factor, of)).collect()
}
