//! Properties of plates (`for` loops in the body of a model). The properties determine how the library evaluates a
//! plate.

use std::collections::HashSet;

use quote::ToTokens;
use syn::{Expr, Ident, Pat};

use super::activity::Activity;
use super::changes::Changes;
use crate::ast::{For, Kind, Left, Statement};
use crate::syntax::expressions::is_consumed;
use crate::syntax::tokens::mentions;
use crate::walk::Walk;

/// Properties of a plate (a `for` loop of the model).
pub(crate) struct Plate {
    /// Whether the body consists only of `y ~ D`, with the loop variable `y` and the same distribution
    /// `D` in all iterations.
    pub(crate) is_pooled: bool,
    /// Whether the body changes no variable that exists before the iteration, so that the operations of an iteration
    /// can be removed from the tape at the end of the iteration.
    pub(crate) unwinds: bool,
    /// The names that the plate binds; None if the plate may change variables that are bound outside the plate.
    pub(crate) bound: Option<HashSet<Ident>>,
}

impl Plate {
    pub(super) fn new(statement: &Statement, plate: &For, activity: &Activity) -> Self {
        let mut inside = Changes::default();
        inside.statement(statement);
        let Changes { bound, changed } = inside;
        let is_own = |name: &Option<Ident>| name.as_ref().is_some_and(|name| bound.contains(name));
        Self {
            is_pooled: !activity.mentions(&plate.iter)
                && !is_consumed(&plate.iter)
                && observes_all_alike(plate),
            unwinds: changed.is_empty(),
            bound: changed.iter().all(is_own).then_some(bound),
        }
    }
}

/// Whether the body consists only of `y ~ D`, where `y` is the loop variable and does not occur in
/// `D`.
fn observes_all_alike(plate: &For) -> bool {
    let Pat::Ident(pat) = &plate.pat else { return false };
    let [statement] = plate.body.statements.as_slice() else { return false };
    let Kind::Tilde { left: Left::Place(Expr::Path(place)), right, .. } = &statement.kind else {
        return false;
    };
    let tokens = right.to_token_stream();
    // a distribution `D` that contains `?` can end the evaluation, so `D` must be evaluated for
    // every datum
    place.path.is_ident(&pat.ident)
        && !mentions(tokens.clone(), &|name| *name == pat.ident)
        && !tokens.to_string().contains('?')
}
