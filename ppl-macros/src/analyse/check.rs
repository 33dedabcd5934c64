//! Whether the parts of a statement go together.

use proc_macro2::Span;
use syn::{Error, Ident, Pat, Result};

use crate::ast::Left::{Part, Unknown};
use crate::ast::{Dim, Kind, Mark};
use crate::errors::{self, at};

/// Whether the mark goes with the statement.
pub(crate) fn check_mark(mark: Mark, kind: &Kind, span: Span) -> Result<()> {
    let message = match (mark, kind) {
        (Mark::Track, Kind::Tilde { left: Unknown(..), .. }) => errors::TRACK_UNKNOWN,
        (Mark::None, _) | (_, Kind::Let { .. }) | (Mark::Predict, Kind::For(_)) => return Ok(()),
        (_, Kind::Tilde { left: Unknown(..) | Part(..), .. }) => return Ok(()),
        (Mark::Predict, Kind::Tilde { .. }) => errors::PREDICT_PLACE,
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
        Kind::For(_) if dims.len() > 1 => errors::DIMS_PLATE,
        Kind::Tilde { left: Part(..), .. } => errors::DIMS_PART,
        Kind::For(_) | Kind::Tilde { .. } => return Ok(()),
        Kind::Let { .. } if mark != Mark::None => return Ok(()),
        _ => errors::DIMS_WHAT,
    };
    Err(at(&first.name, message))
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
