//! Questions about statements that decide how they are written.

use std::collections::HashSet;

use proc_macro2::{TokenStream, TokenTree};
use quote::ToTokens;
use syn::visit::Visit;
use syn::{BinOp, Error, Expr, ExprMethodCall, Ident, Pat, Stmt};

use crate::arithmetic::{is_function, is_type, operations};
use crate::ast::{Block, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::{emit, errors, scan};

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

/// What is wrong with asking a distribution of unknowns for a probability: it is a plain number.
pub(crate) fn lost_derivatives(
    call: &ExprMethodCall,
    mentions: impl Fn(&Expr) -> bool,
) -> Option<Error> {
    let method = call.method.to_string();
    if !["cdf", "sf", "quantile", "upper_quantile"].contains(&&*method) {
        return None;
    }
    let mut receiver = &*call.receiver;
    while let Expr::MethodCall(inner) = receiver {
        receiver = &inner.receiver;
    }
    let Expr::Call(distribution) = receiver else { return None };
    let lost = is_type(&distribution.func) && mentions(&call.receiver);
    lost.then(|| Error::new(call.method.span(), errors::lost_derivatives(&method)))
}

/// Whether a loop takes its data out of an iterator that others may go on with.
pub(crate) fn is_consumed(iter: &Expr) -> bool {
    ["by_ref", "mut"].iter().any(|word| says(iter.to_token_stream(), word))
}

/// The name of a deterministic number that can stay a formula: `let name = arithmetic;`, used once
/// by what follows.
pub(crate) fn stays_open<'a>(kind: &'a Kind, after: &[Statement]) -> Option<(&'a Ident, &'a Expr)> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = kind else { return None };
    let Some(Init::Value { value, diverge: None, .. }) = init else { return None };
    let holds = pat.mutability.is_none() && operations(value) > 0 && used_once(&pat.ident, after);
    holds.then_some((&pat.ident, value))
}

/// Whether all that follows in the block is observations, of which one uses the name once, and
/// formulas for them, of which one may be what uses it.
pub(crate) fn used_once(name: &Ident, after: &[Statement]) -> bool {
    let mut uses = 0;
    for (i, statement) in after.iter().enumerate() {
        match &statement.kind {
            Kind::Observe { place, distribution, .. } => {
                if count(place.to_token_stream(), name) > 0 {
                    return false;
                }
                let here = count(distribution.to_token_stream(), name);
                if here != parameters(distribution, name) {
                    return false;
                }
                uses += here;
            }
            kind @ Kind::Let { .. } => {
                let Some((_, value)) = stays_open(kind, &after[i + 1..]) else { return false };
                let here = count(value.to_token_stream(), name);
                if here != operands(value, name) {
                    return false;
                }
                uses += here;
            }
            _ => return false,
        }
    }
    uses == 1
}

/// How often the name is an operand in the parameters of a distribution: a function of the user's
/// needs a number.
fn parameters(distribution: &Expr, name: &Ident) -> usize {
    match distribution {
        Expr::Paren(paren) => parameters(&paren.expr, name),
        Expr::Group(group) => parameters(&group.expr, name),
        Expr::MethodCall(call) => parameters(&call.receiver, name),
        Expr::Call(call) if is_type(&call.func) => {
            call.args.iter().map(|part| parameters(part, name) + operands(part, name)).sum()
        }
        _ => 0,
    }
}

/// How often the name is an operand of the arithmetic.
fn operands(expr: &Expr, name: &Ident) -> usize {
    match expr {
        Expr::Path(path) => usize::from(path.path.is_ident(name)),
        Expr::Paren(paren) => operands(&paren.expr, name),
        Expr::Group(group) => operands(&group.expr, name),
        Expr::Unary(unary) => operands(&unary.expr, name),
        Expr::Binary(binary) => operands(&binary.left, name) + operands(&binary.right, name),
        Expr::MethodCall(call) if is_function(call) => operands(&call.receiver, name),
        _ => 0,
    }
}

/// Whether nothing that follows in its block asks for what `#[track] let` records.
pub(crate) fn is_only_recorded(statement: &Statement, after: &[Statement]) -> bool {
    let Kind::Let { pat, init: Some(Init::Value { .. }), .. } = &statement.kind else {
        return false;
    };
    let names = scan::bound_names(pat);
    let asks = |later: &Statement| {
        !later.predicted
            && mentions(emit::statement(later), &|found| names.iter().any(|n| n == found))
    };
    statement.mark == Mark::Track && !after.iter().any(asks)
}

pub(crate) fn count(tokens: TokenStream, name: &Ident) -> usize {
    let mut uses = 0;
    variables(tokens, &mut |found| uses += usize::from(found == name));
    uses
}

/// Whether a stream has a variable that is asked for.
pub(crate) fn mentions(tokens: TokenStream, asked: &impl Fn(&str) -> bool) -> bool {
    let mut found = false;
    variables(tokens, &mut |name| found = found || asked(&name.to_string()));
    found
}

/// Calls `f` for all that may be variables: what follows a dot is a field or a method.
pub(crate) fn variables(tokens: TokenStream, f: &mut impl FnMut(&Ident)) {
    let mut dots = 0;
    for tree in tokens {
        match &tree {
            TokenTree::Ident(name) if dots != 1 => f(name),
            TokenTree::Group(group) => variables(group.stream(), f),
            _ => {}
        }
        dots = match tree {
            TokenTree::Punct(punct) if punct.as_char() == '.' => dots + 1,
            _ => 0,
        };
    }
}

/// Whether a stream has a word, as whatever.
pub(crate) fn says(tokens: TokenStream, word: &str) -> bool {
    tokens.into_iter().any(|tree| match tree {
        TokenTree::Ident(found) => found == word,
        TokenTree::Group(group) => says(group.stream(), word),
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
            // what the branches are is looked at on the way down
            Expr::If(chosen) => chosen.cond.to_token_stream(),
            Expr::Match(chosen) => {
                let mut decides = chosen.expr.to_token_stream();
                // with their guards
                chosen.arms.iter().for_each(|arm| arm.pat.to_tokens(&mut decides));
                decides
            }
            Expr::While(_) | Expr::Loop(_) | Expr::ForLoop(_) => expr.to_token_stream(),
            Expr::Binary(binary) if is_comparison(&binary.op) => expr.to_token_stream(),
            Expr::MethodCall(call) if call.method == "value" => expr.to_token_stream(),
            Expr::Path(path) if path.path.segments.last().is_some_and(|s| s.ident == "value") => {
                expr.to_token_stream()
            }
            _ => TokenStream::new(),
        };
        self.found |=
            says(decides.clone(), "value") || mentions(decides, &|name| self.active.contains(name));
        syn::visit::visit_expr(self, expr);
    }
}

/// Whether a block is `reject!(…);` alone, as that has been written by then.
pub(crate) fn only_rejects(block: &Block) -> bool {
    let [only] = block.statements.as_slice() else { return false };
    matches!(only.kind, Kind::Rust(Stmt::Expr(Expr::Verbatim(_), _)))
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

pub(crate) fn is_comparison(op: &BinOp) -> bool {
    matches!(
        op,
        BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
    )
}
