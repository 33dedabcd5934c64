//! Plates: what a loop leaves to the library.

use std::collections::{HashMap, HashSet};

use quote::ToTokens;
use syn::{Expr, Ident, Pat};

use super::activity::Activity;
use super::writes::{Inside, writes_outside};
use crate::ast::{Block, Flow, For, Id, Kind};
use crate::syntax::expressions::is_consumed;
use crate::syntax::tokens::mentions;

/// What is known of a loop.
pub(crate) struct Plate {
    /// Whether it only says `y ~ D` of its own `y`, with one `D` for all.
    pub(crate) is_pooled: bool,
    /// Whether nothing that an iteration computes outlives it.
    pub(crate) unwinds: bool,
    /// The names that it binds.
    pub(crate) bound: HashSet<Ident>,
}

/// Those of a body, by their statements.
pub(crate) fn plates(body: &Block, activity: &Activity) -> HashMap<Id, Plate> {
    let statements = body.nested().into_iter().flat_map(|block| &block.statements);
    let loops = statements.filter_map(|statement| match &statement.kind {
        Kind::Flow(Flow::For(plate)) => Some((statement.id, known(plate, activity))),
        _ => None,
    });
    loops.collect()
}

fn known(plate: &For, activity: &Activity) -> Plate {
    let is_pooled =
        !activity.mentions(&plate.iter) && !is_consumed(&plate.iter) && observes_all_alike(plate);
    let inside = Inside::of(plate);
    let unwinds = !is_pooled && !inside.jumps_out() && !writes_outside(plate);
    Plate { is_pooled, unwinds, bound: inside.bound }
}

/// Whether the body is `y ~ D` alone, with `y` the loop's own and not in `D`.
fn observes_all_alike(plate: &For) -> bool {
    let Pat::Ident(pat) = &plate.pat else { return false };
    let [statement] = plate.body.statements.as_slice() else { return false };
    let Kind::Observe { place: Expr::Path(place), distribution, .. } = &statement.kind else {
        return false;
    };
    let tokens = distribution.to_token_stream();
    // a distribution that can leave the model has to be asked for every datum
    place.path.is_ident(&pat.ident)
        && !mentions(tokens.clone(), &|found| *found == pat.ident)
        && !tokens.to_string().contains('?')
}
