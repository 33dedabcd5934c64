//! Formulas that one observation uses once: they need not become numbers before it.

use std::collections::HashSet;

use syn::visit::Visit;
use syn::{Expr, Ident, Pat};

use super::activity::Activity;
use crate::ast::{Block, Id, Init, Kind, Left, Statement};
use crate::syntax::expressions::{is_function, is_type, operations};
use crate::syntax::tokens::count;
use crate::walk::{self, Walk};

/// The declarations of a body that can stay formulas.
pub(super) fn open(body: &Block, activity: &Activity) -> HashSet<Id> {
    let mut uses = Uses { activity, open: HashSet::new() };
    uses.block(body);
    uses.open
}

struct Uses<'a> {
    activity: &'a Activity,
    open: HashSet<Id>,
}

impl<'a> Walk<'a> for Uses<'_> {
    fn block(&mut self, block: &'a Block) {
        for (i, statement) in block.statements.iter().enumerate() {
            if let Some((name, value)) = formula(statement)
                && self.activity.mentions(value)
                && is_used_once(name, &block.statements[i + 1..])
            {
                self.open.insert(statement.id);
            }
        }
        walk::block(self, block);
    }
}

impl<'a> Visit<'a> for Uses<'_> {}

/// `let name = arithmetic;`.
fn formula(statement: &Statement) -> Option<(&Ident, &Expr)> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = &statement.kind else { return None };
    let Some(Init::Value { value, diverge: None, .. }) = init else { return None };
    (pat.mutability.is_none() && operations(value) > 0).then_some((&pat.ident, value))
}

/// Whether what follows uses the name once, as an operand: in an observation, or in a formula of which
/// the same holds.
fn is_used_once(name: &Ident, after: &[Statement]) -> bool {
    let uses = |statement: &Statement| count(statement.tokens.clone(), name);
    let mut using = after.iter().enumerate().filter(|(_, statement)| uses(statement) > 0);
    let (Some((i, user)), None) = (using.next(), using.next()) else { return false };
    let as_operand = match (&user.kind, formula(user)) {
        (Kind::Tilde { left: Left::Place(_), right, .. }, _) => parameters(right, name),
        (_, Some((next, value))) if is_used_once(next, &after[i + 1..]) => operands(value, name),
        _ => 0,
    };
    uses(user) == 1 && as_operand == 1
}

/// How often the name is an operand in the parameters of a distribution: a function of the user's
/// needs a number.
fn parameters(distribution: &Expr, name: &Ident) -> usize {
    match distribution {
        Expr::Paren(paren) => parameters(&paren.expr, name),
        Expr::Group(group) => parameters(&group.expr, name),
        Expr::MethodCall(call) => parameters(&call.receiver, name),
        Expr::Call(call) if is_type(&call.func) => {
            call.args.iter().map(|argument| operands(argument, name)).sum()
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
