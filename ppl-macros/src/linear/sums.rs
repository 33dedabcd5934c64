//! Sums that are written as loops, as parts of means: every turn has its coefficients.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote_spanned};
use syn::visit_mut::VisitMut;
use syn::{Expr, Ident, Pat};

use crate::fold::{Replay, replay};
use crate::formula::Formulas;
use crate::inspect::{mentions, says};
use crate::linear::parts::{Multiplied, Parts, group};
use crate::scan::bound_names;

/// A loop that adds to the mean.
#[derive(Clone)]
pub(super) struct Loop {
    /// What stands for the sum.
    pub(super) name: Ident,
    pub(super) pat: Pat,
    pub(super) iter: Expr,
    pub(super) value: Expr,
}

impl Loop {
    /// Whether a name means something else inside.
    pub(super) fn hides(&self, tokens: &impl ToTokens) -> bool {
        let names = bound_names(&self.pat);
        mentions(tokens.to_token_stream(), &|found| names.iter().any(|name| name == found))
    }
}

/// A loop taken apart.
pub(super) struct Sum {
    pub(super) pat: Pat,
    pub(super) iter: Expr,
    /// The coefficients of a turn, and what they multiply.
    pub(super) terms: Vec<(TokenStream, Expr)>,
    pub(super) offsets: Vec<TokenStream>,
}

/// What a loop tells of an observation.
pub(crate) struct Told {
    pub(crate) pat: Pat,
    pub(crate) iter: Expr,
    pub(crate) coefficients: Vec<TokenStream>,
    pub(crate) offsets: Vec<TokenStream>,
}

/// What a name stands for in a loop over observations.
enum Meaning {
    /// An unknown, or what follows from some.
    Unknown,
    /// Data that differ from one observation to the next.
    Own,
    /// The same data for all.
    Shared,
}

/// What names stand for in a loop over observations.
#[derive(Clone)]
pub(super) struct Names {
    /// Unknowns, or what follows from them.
    unknown: HashSet<String>,
    /// Data that differ from one observation to the next.
    own: HashSet<String>,
}

impl Names {
    pub(super) fn has_unknown(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.unknown.contains(name))
    }

    pub(super) fn has_own(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.own.contains(name))
    }

    pub(super) fn is_own(&self, name: &Ident) -> bool {
        self.own.contains(&name.to_string())
    }

    pub(super) fn declare_unknown(&mut self, names: impl IntoIterator<Item = Ident>) {
        for name in names {
            self.own.remove(&name.to_string());
            self.unknown.insert(name.to_string());
        }
    }

    pub(super) fn declare_own(&mut self, names: impl IntoIterator<Item = Ident>) {
        for name in names {
            self.unknown.remove(&name.to_string());
            self.own.insert(name.to_string());
        }
    }

    fn declare_shared(&mut self, names: impl IntoIterator<Item = Ident>) {
        for name in names {
            self.unknown.remove(&name.to_string());
            self.own.remove(&name.to_string());
        }
    }

    /// A sum is an unknown, and no two observations share it.
    pub(super) fn declare_loop(&mut self, name: &Ident) {
        self.unknown.insert(name.to_string());
        self.own.insert(name.to_string());
    }
}

impl Parts {
    /// Takes a loop apart, times `factors`.
    pub(super) fn take_loop(
        &mut self,
        Loop { pat, iter, value, .. }: Loop,
        factors: &[(bool, Expr)],
        is_negative: bool,
    ) -> Option<()> {
        // a turn of another sum has no coefficients of its own
        if self.inner.is_some() {
            return None;
        }
        let names = self.names.clone();
        let around = (std::mem::take(&mut self.terms), std::mem::take(&mut self.offsets));
        let is_reversed = says(iter.to_token_stream(), "rev");
        let mut bound = Vec::new();
        self.enter(&pat, &iter, is_reversed, &mut bound)?;
        for (pat, meaning) in bound {
            match meaning {
                Meaning::Unknown => self.names.declare_unknown(bound_names(pat)),
                Meaning::Own => self.names.declare_own(bound_names(pat)),
                Meaning::Shared => self.names.declare_shared(bound_names(pat)),
            }
        }
        self.inner = Some(bound_names(&pat).iter().map(Ident::to_string).collect());
        self.add(&value, factors, is_negative)?;
        self.inner = None;
        self.names = names;
        let terms = std::mem::replace(&mut self.terms, around.0);
        let offsets = std::mem::replace(&mut self.offsets, around.1);
        let terms = group(terms).into_iter().map(|(factor, of)| match of {
            Multiplied::One(atom) => Some((factor, atom)),
            Multiplied::Dot { .. } => None,
        });
        let terms = terms.collect::<Option<_>>()?;
        self.sums.push(Sum { pat, iter, terms, offsets });
        Some(())
    }

    /// What the names mean that a loop binds. An index is the same for all observations if it begins
    /// with the same number; how many turns there are tells groups of observations apart.
    fn enter<'a>(
        &mut self,
        pat: &'a Pat,
        iter: &Expr,
        is_reversed: bool,
        bound: &mut Vec<(&'a Pat, Meaning)>,
    ) -> Option<()> {
        match (iter, pat) {
            (Expr::Paren(paren), _) => self.enter(pat, &paren.expr, is_reversed, bound),
            (Expr::Group(group), _) => self.enter(pat, &group.expr, is_reversed, bound),
            (Expr::MethodCall(call), Pat::Tuple(pair))
                if call.method == "zip" && call.args.len() == 1 && pair.elems.len() == 2 =>
            {
                self.enter(&pair.elems[0], &call.receiver, is_reversed, bound)?;
                self.enter(&pair.elems[1], &call.args[0], is_reversed, bound)
            }
            (Expr::MethodCall(call), Pat::Tuple(pair))
                if call.method == "enumerate" && pair.elems.len() == 2 =>
            {
                if is_reversed && self.names.has_own(&call.receiver) {
                    return None;
                }
                bound.push((&pair.elems[0], Meaning::Shared));
                self.enter(&pair.elems[1], &call.receiver, is_reversed, bound)
            }
            (Expr::MethodCall(call), _) if call.method == "zip" || call.method == "enumerate" => {
                None
            }
            (Expr::MethodCall(call), _) if call.args.is_empty() && call.method != "len" => {
                self.enter(pat, &call.receiver, is_reversed, bound)
            }
            _ => {
                bound.push((pat, self.meaning(iter, is_reversed)?));
                Some(())
            }
        }
    }

    /// What a loop over `iter` yields.
    fn meaning(&mut self, iter: &Expr, is_reversed: bool) -> Option<Meaning> {
        if let Expr::Range(range) = iter {
            let moves = range.start.as_ref().is_some_and(|start| self.names.has_own(start));
            let is_own = moves || (is_reversed && self.names.has_own(range));
            return Some(if is_own { Meaning::Own } else { Meaning::Shared });
        }
        if self.names.has_unknown(iter) {
            return self.is_shared(iter).then_some(Meaning::Unknown);
        }
        Some(if self.names.has_own(iter) { Meaning::Own } else { Meaning::Shared })
    }
}

impl Formulas {
    /// The names in a loop over observations.
    pub(super) fn names(&self, pat: &Pat) -> Names {
        let mut names = Names { unknown: self.active.clone(), own: HashSet::new() };
        names.declare_own(bound_names(pat));
        names
    }

    /// What is told of a sum, and how it is written over the coefficients of a row.
    pub(super) fn sum(&mut self, sum: Sum) -> (Told, Option<Replay>) {
        let Sum { pat, iter, terms, offsets } = sum;
        let (coefficients, atoms): (Vec<_>, Vec<_>) = terms.into_iter().unzip();
        let count = coefficients.len();
        let told = Told { pat: pat.clone(), iter: iter.clone(), coefficients, offsets };
        if count == 0 {
            return (told, None);
        }
        let span = Span::mixed_site();
        let mut iter = iter;
        if self.mentions(&iter) {
            self.bind(bound_names(&pat));
        }
        self.visit_expr_mut(&mut iter);
        let outer = self.inner.clone();
        self.inner.extend(bound_names(&pat));
        let names: Vec<_> =
            (0..count).map(|k| format_ident!("coefficient_{k}", span = span)).collect();
        let products = names.iter().zip(atoms).map(|(name, mut atom)| {
            self.operand(&mut atom);
            quote_spanned!(span=> #atom * #name)
        });
        let each = Expr::Verbatim(quote_spanned!(span=> #(#products)+*));
        self.inner = outer;
        self.sums += 1;
        let pat = Pat::Verbatim(quote_spanned!(span=> (#pat, [#(#names),*])));
        let over = Expr::Verbatim(quote_spanned!(span=> row.along(#iter)));
        (told, Some(replay(self.sums, &pat, &over, &each)))
    }
}
