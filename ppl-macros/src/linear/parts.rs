//! Means taken apart: sums of what data multiply.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::{BinOp, Expr, ExprCall, UnOp, parse_quote};

use crate::arithmetic::{is_arithmetic, is_dot, is_function};
use crate::inspect::mentions;
use crate::linear::sums::{Loop, Names, Sum};

/// What a coefficient multiplies.
pub(super) enum Multiplied {
    One(Expr),
    Dot { data: Expr, unknowns: Expr },
}

/// A summand of the mean.
pub(super) struct Term {
    /// Data that multiply it, and whether they divide.
    factors: Vec<(bool, Expr)>,
    is_negative: bool,
    of: Multiplied,
}

/// A mean in parts.
pub(super) struct Parts {
    pub(super) names: Names,
    /// What the loop binds that is being taken apart.
    pub(super) inner: Option<HashSet<String>>,
    loops: Vec<Loop>,
    pub(super) places: Vec<Expr>,
    pub(super) terms: Vec<Term>,
    pub(super) sums: Vec<Sum>,
    pub(super) offsets: Vec<TokenStream>,
}

impl Parts {
    pub(super) fn new(names: Names, loops: Vec<Loop>) -> Self {
        Self {
            names,
            inner: None,
            loops,
            places: Vec::new(),
            terms: Vec::new(),
            sums: Vec::new(),
            offsets: Vec::new(),
        }
    }

    /// Takes apart the mean; `None` if it is not linear.
    pub(super) fn take(&mut self, mean: &Expr) -> Option<()> {
        self.add(mean, &[], false)
    }

    /// Whether there is nothing that data multiply.
    pub(super) fn is_empty(&self) -> bool {
        self.terms.is_empty() && self.sums.iter().all(|sum| sum.terms.is_empty())
    }

    /// Adds the summands of `expr`, times `factors`.
    pub(super) fn add(
        &mut self,
        expr: &Expr,
        factors: &[(bool, Expr)],
        is_negative: bool,
    ) -> Option<()> {
        if !self.names.has_unknown(expr) {
            self.offsets.push(times(factors, is_negative, Some(coefficient(expr))));
            return Some(());
        }
        let with = |divides: bool, factor: &Expr| {
            let mut factors = factors.to_vec();
            factors.push((divides, factor.clone()));
            factors
        };
        match expr {
            Expr::Paren(paren) => return self.add(&paren.expr, factors, is_negative),
            Expr::Group(group) => return self.add(&group.expr, factors, is_negative),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => {
                return self.add(&unary.expr, factors, !is_negative);
            }
            Expr::Binary(binary) => {
                let (left, right) = (&*binary.left, &*binary.right);
                match binary.op {
                    BinOp::Add(_) => {
                        self.add(left, factors, is_negative)?;
                        return self.add(right, factors, is_negative);
                    }
                    BinOp::Sub(_) => {
                        self.add(left, factors, is_negative)?;
                        return self.add(right, factors, !is_negative);
                    }
                    BinOp::Mul(_) if !self.names.has_unknown(left) => {
                        return self.add(right, &with(false, left), is_negative);
                    }
                    BinOp::Mul(_) if !self.names.has_unknown(right) => {
                        return self.add(left, &with(false, right), is_negative);
                    }
                    BinOp::Div(_) if !self.names.has_unknown(right) => {
                        return self.add(left, &with(true, right), is_negative);
                    }
                    _ => {}
                }
            }
            Expr::Path(path) => {
                let is_sum = |sum: &&Loop| path.path.is_ident(&sum.name);
                if let Some(sum) = self.loops.iter().find(is_sum) {
                    let is_hidden = factors.iter().any(|(_, factor)| sum.hides(factor));
                    let sum = (!is_hidden).then(|| sum.clone())?;
                    return self.take_loop(sum, factors, is_negative);
                }
            }
            _ => {}
        }
        let of = match expr {
            Expr::Call(ExprCall { args, .. }) if is_dot(expr) && args.len() == 2 => {
                let (data, unknowns) = (args[0].clone(), args[1].clone());
                if self.names.has_unknown(&data) || !self.is_shared(&unknowns) {
                    return None;
                }
                Multiplied::Dot { data, unknowns }
            }
            _ if self.is_shared(expr) => Multiplied::One(expr.clone()),
            _ => return None,
        };
        self.terms.push(Term { factors: factors.to_vec(), is_negative, of });
        Some(())
    }

    /// Whether the loop's own data enter only as places of unknowns, which are noted.
    pub(super) fn is_shared(&mut self, expr: &Expr) -> bool {
        match expr {
            Expr::Lit(_) => true,
            Expr::Path(_) => !self.names.has_own(expr),
            Expr::Paren(paren) => self.is_shared(&paren.expr),
            Expr::Group(group) => self.is_shared(&group.expr),
            Expr::Reference(reference) if reference.mutability.is_none() => {
                self.is_shared(&reference.expr)
            }
            Expr::Field(field) => self.is_shared(&field.base),
            Expr::Unary(unary) => self.is_shared(&unary.expr),
            Expr::Binary(binary) if is_arithmetic(&binary.op) => {
                self.is_shared(&binary.left) && self.is_shared(&binary.right)
            }
            Expr::MethodCall(call) if is_function(call) => {
                self.is_shared(&call.receiver)
                    && call.args.iter().all(|argument| self.is_shared(argument))
            }
            Expr::Index(index) => {
                let (of, at) = (&index.expr, &index.index);
                let is_place = self.names.has_own(at);
                let is_known =
                    is_place && self.names.has_unknown(of) && !self.names.has_unknown(at);
                if is_known {
                    // a place is one for the whole observation
                    let inner = |name: &str| self.inner.iter().any(|inner| inner.contains(name));
                    if mentions(at.to_token_stream(), &inner) {
                        return false;
                    }
                    self.places.push((**at).clone());
                }
                (is_known || !is_place) && self.is_shared(of)
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
pub(super) fn group(terms: Vec<Term>) -> Vec<(TokenStream, Multiplied)> {
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
