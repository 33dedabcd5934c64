//! Whether the parts of a statement go together.

use proc_macro2::Span;
use syn::{Error, Ident, Pat, Result};

use crate::ast::{Dim, Flow, Kind, Mark};
use crate::errors::{self, at};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::plain_name;

/// Whether the mark goes with the statement.
pub(crate) fn check_mark(mark: Mark, kind: &Kind, span: Span) -> Result<()> {
    let message = match (mark, kind) {
        (Mark::Track, Kind::Unknown { .. }) => errors::TRACK_UNKNOWN,
        (Mark::None, _) | (_, Kind::Let { .. } | Kind::Unknown { .. } | Kind::Part { .. }) => {
            return Ok(());
        }
        (Mark::Predict, Kind::Flow(Flow::For(_))) => return Ok(()),
        (Mark::Predict, Kind::Observe { .. } | Kind::Impute { .. }) => errors::PREDICT_PLACE,
        (Mark::Predict, _) => errors::PREDICT_WHAT,
        (Mark::Track, _) => errors::TRACK_WHAT,
    };
    Err(Error::new(span, message))
}

/// Whether dimensions can be named there.
pub(crate) fn check_dims(dims: &[Dim], mark: Mark, kind: &Kind) -> Result<()> {
    let Some(first) = dims.first() else {
        return Ok(());
    };
    let message = match kind {
        Kind::Flow(Flow::For(_)) if dims.len() > 1 => errors::DIMS_PLATE,
        Kind::Flow(Flow::For(_)) | Kind::Unknown { .. } => return Ok(()),
        Kind::Observe { .. } | Kind::Impute { .. } => return Ok(()),
        Kind::Let { .. } if mark != Mark::None => return Ok(()),
        Kind::Part { .. } => errors::DIMS_PART,
        _ => errors::DIMS_WHAT,
    };
    Err(at(&first.name, message))
}

/// The names that a statement puts into scope.
pub(crate) fn declared(kind: &Kind) -> Vec<Ident> {
    match kind {
        Kind::Unknown { name, .. } | Kind::Part { name, .. } => vec![name.clone()],
        Kind::Impute { place, .. } => plain_name(place).cloned().into_iter().collect(),
        Kind::Let { pat, .. } => bound_names(pat),
        Kind::Broken { names, .. } => names.clone(),
        _ => Vec::new(),
    }
}

/// The one name that a recorded statement needs.
pub(crate) fn recorded_name(pat: &Pat, has_value: bool) -> Result<&Ident> {
    let plain = match pat {
        Pat::Type(typed) => &*typed.pat,
        other => other,
    };
    match plain {
        _ if !has_value => Err(at(pat, errors::RECORDED_NOTHING)),
        Pat::Ident(name)
            if name.mutability.is_none() && name.by_ref.is_none() && name.subpat.is_none() =>
        {
            Ok(&name.ident)
        }
        _ => Err(at(pat, errors::RECORDED_PATTERN)),
    }
}
