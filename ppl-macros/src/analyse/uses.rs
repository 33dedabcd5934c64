//! Finds formulas that a single observation uses exactly once. Such a formula is inserted into the observation as a
//! symbolic expression and need not be evaluated to a number first.

use syn::{Expr, Ident, Pat};

use super::activity::Activity;
use crate::ast::{Flow, Init, Kind, Left, Statement};
use crate::syntax::expressions::{formula, is_type, operations};
use crate::syntax::places::plain_name;
use crate::syntax::tokens::count;

/// Whether the value of a declaration can stay a symbolic formula. `after` are the statements that follow the
/// declaration in its block.
pub(super) fn stays_symbolic(
    statement: &Statement,
    after: &[Statement],
    activity: &Activity,
) -> bool {
    arithmetic(statement)
        .is_some_and(|(name, value)| activity.mentions(value) && is_used_once(name, after))
}

/// Returns the name and the value of a declaration `let name = arithmetic;`; None for any other statement.
fn arithmetic(statement: &Statement) -> Option<(&Ident, &Expr)> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = &statement.kind else { return None };
    let Some(Init { value: Flow::Value(value), diverge: None, .. }) = init else { return None };
    (pat.mutability.is_none() && operations(value) > 0).then_some((&pat.ident, value))
}

/// Whether the statements `after` a declaration use the declared name exactly once, as an operand. The use must be in
/// an observation, or in another declaration whose name is also used exactly once in this way.
fn is_used_once(name: &Ident, after: &[Statement]) -> bool {
    let uses = |statement: &Statement| count(statement.tokens.clone(), name);
    let mut using = after.iter().enumerate().filter(|(_, statement)| uses(statement) > 0);
    let (Some((i, user)), None) = (using.next(), using.next()) else { return false };
    let as_operand = match (&user.kind, arithmetic(user)) {
        (Kind::Tilde { left: Left::Place(_), right, .. }, _) => parameters(right, name),
        (_, Some((next, value))) if is_used_once(next, &after[i + 1..]) => operands(value, name),
        _ => 0,
    };
    uses(user) == 1 && as_operand == 1
}

/// Returns how many times the name is an operand in the parameters of a distribution. Arguments of user-defined
/// functions do not count, because such a function takes a number and not a formula.
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

/// Returns how many times the name is an operand in the arithmetic of `expr`.
fn operands(expr: &Expr, name: &Ident) -> usize {
    let mut operands = Vec::new();
    formula(expr, &mut operands);
    operands.into_iter().filter(|operand| plain_name(operand) == Some(name)).count()
}
