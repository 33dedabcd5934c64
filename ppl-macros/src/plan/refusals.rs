//! What a model cannot do, said where it is written.

use syn::{Error, Expr, Ident, Macro};

use crate::analyse::Scope;
use crate::errors::{self, at};
use crate::syntax::expressions::{function_of_f64, is_assignment, is_type, plain_function};
use crate::syntax::places::{plain_name, root};

/// Where an expression stands.
pub(crate) struct Place<'a> {
    pub(crate) scope: &'a Scope,
    /// Inside a closure, where `?` and `return` are the closure's own.
    pub(crate) in_closure: bool,
    /// Names that the expression around has bound anew.
    pub(crate) shadowed: &'a [Ident],
    /// Whether results record it, and nobody differentiates it.
    pub(crate) is_recorded: bool,
}

/// Why an expression is refused, what is inside it apart.
pub(crate) fn refused(expr: &Expr, place: &Place) -> Option<Error> {
    let is_unknown = |name: &Ident| place.scope.is_unknown(name) && !place.shadowed.contains(name);
    let assigned = |left: &Expr| {
        let name = root(left).filter(|name| place.scope.is_unknown(name))?;
        Some(at(left, errors::assigned(&name.to_string())))
    };
    match expr {
        Expr::Return(_) if !place.in_closure => Some(at(expr, errors::RETURN)),
        Expr::Await(_) if !place.in_closure => Some(at(expr, errors::AWAIT)),
        Expr::Path(path) if path.path.is_ident("self") => Some(at(path, errors::SELF_VALUE)),
        Expr::Call(call) if plain_function(call).is_some_and(|name| name == "factor") => {
            Some(at(call, errors::FACTOR_INSIDE))
        }
        Expr::Call(call) if !place.is_recorded => {
            let function = function_of_f64(call)?;
            let held = call.args.iter().find(|argument| place.scope.holds(argument))?;
            let error = errors::function_of_f64(&function.to_string(), held);
            place.shadowed.is_empty().then(|| at(call, error))
        }
        Expr::Index(index) => {
            let name = plain_name(&index.index).filter(|name| is_unknown(name))?;
            Some(at(name, errors::unknown_index(&name.to_string())))
        }
        Expr::Assign(assign) => assigned(&assign.left),
        Expr::Binary(binary) if is_assignment(&binary.op) => assigned(&binary.left),
        Expr::MethodCall(call) if !place.is_recorded => {
            let method = call.method.to_string();
            if method == "value" && call.args.is_empty() {
                return place
                    .scope
                    .holds(&call.receiver)
                    .then(|| Error::new(call.method.span(), errors::PLAIN_VALUE));
            }
            lost_derivatives(expr, &method, place.scope)
        }
        _ => None,
    }
}

/// A distribution of unknowns that is asked for a probability, which is a plain number.
fn lost_derivatives(expr: &Expr, method: &str, scope: &Scope) -> Option<Error> {
    let Expr::MethodCall(call) = expr else { return None };
    if !["cdf", "sf", "quantile", "upper_quantile"].contains(&method) {
        return None;
    }
    let mut receiver = &*call.receiver;
    while let Expr::MethodCall(inner) = receiver {
        receiver = &inner.receiver;
    }
    let Expr::Call(distribution) = receiver else { return None };
    let is_lost = is_type(&distribution.func) && scope.holds(&call.receiver);
    is_lost.then(|| Error::new(call.method.span(), errors::lost_derivatives(method)))
}

/// Why a `reject!` is refused.
pub(crate) fn refused_reject(mac: &Macro, place: &Place) -> Option<Error> {
    if place.in_closure {
        return Some(at(&mac.path, errors::REJECT_IN_CLOSURE));
    }
    mac.tokens.is_empty().then(|| at(mac, errors::REJECT_REASON))
}
