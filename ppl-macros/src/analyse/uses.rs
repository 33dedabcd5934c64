//! Who asks for what a `let` declares.

use std::collections::HashSet;

use quote::ToTokens;
use syn::{Expr, Ident, Pat};

use super::activity::Activity;
use crate::ast::{Block, Id, Init, Kind, Mark, Statement};
use crate::syntax::expressions::{is_function, is_type, operations};
use crate::syntax::patterns::bound_names;
use crate::syntax::tokens::{count, mentions};

/// Declarations by who asks for them.
#[derive(Default)]
pub(crate) struct Uses {
    /// Arithmetic on unknowns that one observation after it uses once: it can stay a formula.
    pub(crate) once: HashSet<Id>,
    /// `#[track] let` for which nothing else asks.
    pub(crate) never: HashSet<Id>,
}

impl Uses {
    pub(crate) fn of(body: &Block, activity: &Activity) -> Self {
        let mut uses = Self::default();
        for block in body.nested() {
            for (i, statement) in block.statements.iter().enumerate() {
                let after = &block.statements[i + 1..];
                if let Some((_, value)) = used_once(&statement.kind, after)
                    && activity.mentions(value)
                {
                    uses.once.insert(statement.id);
                }
                if is_only_recorded(statement, after) {
                    uses.never.insert(statement.id);
                }
            }
        }
        uses
    }
}

/// `let name = arithmetic;`, if all that follows in the block is observations, of which one uses the
/// name once, and formulas for them, of which one may be what uses it.
fn used_once<'a>(kind: &'a Kind, after: &[Statement]) -> Option<(&'a Ident, &'a Expr)> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = kind else { return None };
    let Some(Init::Value { value, diverge: None, .. }) = init else { return None };
    let holds = pat.mutability.is_none() && operations(value) > 0;
    (holds && is_used_once(&pat.ident, after)).then_some((&pat.ident, value))
}

fn is_used_once(name: &Ident, after: &[Statement]) -> bool {
    let mut uses = 0;
    for (i, statement) in after.iter().enumerate() {
        let (used, as_operand) = match &statement.kind {
            Kind::Observe { place, .. } if count(place.to_token_stream(), name) > 0 => {
                return false;
            }
            Kind::Observe { distribution, .. } => {
                (count(distribution.to_token_stream(), name), parameters(distribution, name))
            }
            kind => {
                let Some((_, value)) = used_once(kind, &after[i + 1..]) else { return false };
                (count(value.to_token_stream(), name), operands(value, name))
            }
        };
        if used != as_operand {
            return false;
        }
        uses += used;
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
fn is_only_recorded(statement: &Statement, after: &[Statement]) -> bool {
    let Kind::Let { pat, init: Some(Init::Value { .. }), .. } = &statement.kind else {
        return false;
    };
    let names = bound_names(pat);
    let asks = |later: &Statement| {
        later.mark != Mark::Predict && mentions(later.tokens.clone(), &|name| names.contains(name))
    };
    statement.mark == Mark::Track && !after.iter().any(asks)
}
