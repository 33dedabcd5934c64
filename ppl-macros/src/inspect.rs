//! Questions about statements that decide how they are written.

use std::collections::HashSet;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::visit::Visit;
use syn::{BinOp, Expr, Ident, Pat};

use crate::parse::{Block, Kind, Statement};

/// What a plate may do with unknowns on the way in without its length depending on them.
const ITERATION: [&str; 7] = ["iter", "into_iter", "zip", "enumerate", "rev", "len", "copied"];

/// Whether the body is `y ~ D` alone, with `y` the loop's own and not in `D`.
pub(crate) fn is_pooled(pat: &Pat, body: &Block) -> bool {
    let Pat::Ident(pat) = pat else { return false };
    let [statement] = body.statements.as_slice() else { return false };
    let Kind::Observe { place: Expr::Path(place), distribution, .. } = &statement.kind else {
        return false;
    };
    let asked = |found: &str| pat.ident == found;
    let tokens = distribution.to_token_stream();
    // a distribution that can leave the model has to be asked for every datum
    place.path.is_ident(&pat.ident)
        && !mentions(tokens.clone(), &asked)
        && !tokens.to_string().contains('?')
}

/// Whether all that follows in the block is observations, of which one uses the name once.
pub(crate) fn used_once(name: &Ident, after: &[Statement]) -> bool {
    let mut uses = 0;
    for statement in after {
        let Kind::Observe { place, distribution, .. } = &statement.kind else { return false };
        if mentions(place.to_token_stream(), &|found| name == found) {
            return false;
        }
        uses += count(distribution.to_token_stream(), name);
    }
    uses == 1
}

fn count(tokens: TokenStream, name: &Ident) -> usize {
    let of = |tree| match tree {
        TokenTree::Ident(found) => usize::from(found == *name),
        TokenTree::Group(group) => count(group.stream(), name),
        _ => 0,
    };
    tokens.into_iter().map(of).sum()
}

/// Whether a stream has an identifier that is asked for.
pub(crate) fn mentions(tokens: TokenStream, asked: &impl Fn(&str) -> bool) -> bool {
    tokens.into_iter().any(|tree| match tree {
        TokenTree::Ident(name) => asked(&name.to_string()),
        TokenTree::Group(group) => mentions(group.stream(), asked),
        _ => false,
    })
}

/// Control flow, comparisons and plain values inside expressions.
pub(crate) struct Branches<'a> {
    pub(crate) active: &'a HashSet<String>,
    pub(crate) found: bool,
}

impl<'a> Visit<'a> for Branches<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        let decides = match expr {
            Expr::If(_) | Expr::Match(_) | Expr::While(_) | Expr::Loop(_) | Expr::ForLoop(_) => {
                true
            }
            Expr::Binary(binary) => is_comparison(&binary.op),
            Expr::MethodCall(call) => call.method == "value",
            Expr::Path(path) => path.path.segments.last().is_some_and(|s| s.ident == "value"),
            _ => false,
        };
        self.found |= decides
            && mentions(expr.to_token_stream(), &|name| {
                name == "value" || self.active.contains(name)
            });
        syn::visit::visit_expr(self, expr);
    }
}

/// Whether an iterator over unknowns runs over all of them.
pub(crate) fn keeps_its_length(iter: &Expr) -> bool {
    match iter {
        Expr::Path(_) | Expr::Field(_) | Expr::Lit(_) | Expr::Index(_) => true,
        Expr::Reference(reference) => keeps_its_length(&reference.expr),
        Expr::Paren(paren) => keeps_its_length(&paren.expr),
        Expr::Range(range) => range.start.iter().chain(&range.end).all(|end| keeps_its_length(end)),
        Expr::MethodCall(call) => {
            ITERATION.iter().any(|name| call.method == name)
                && keeps_its_length(&call.receiver)
                && call.args.iter().all(keeps_its_length)
        }
        _ => false,
    }
}

fn is_comparison(op: &BinOp) -> bool {
    matches!(
        op,
        BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
    )
}
