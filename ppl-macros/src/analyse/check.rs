//! Whether the parts of a statement go together.

use syn::{Error, Result};

use crate::ast::{Kind, Left, Mark, Statement};
use crate::errors::{self, at};

/// Whether the mark and the dimensions of a statement go with the rest of it.
pub(super) fn check(statement: &Statement) -> Result<()> {
    let Statement { mark, dims, kind, span, .. } = statement;
    let takes_mark = match kind {
        Kind::Let { .. } | Kind::Tilde { left: Left::Part(..), .. } => true,
        Kind::For(_) | Kind::Tilde { left: Left::Unknown(..), .. } => *mark != Mark::Track,
        _ => *mark == Mark::None,
    };
    if !takes_mark {
        let is_track = *mark == Mark::Track;
        let message = if is_track { errors::TRACK_WHAT } else { errors::PREDICT_WHAT };
        return Err(Error::new(*span, message));
    }
    let takes_dims = match kind {
        Kind::For(_) => dims.len() == 1,
        Kind::Tilde { left, .. } => !matches!(left, Left::Part(..)),
        Kind::Let { .. } => *mark != Mark::None,
        _ => false,
    };
    match dims.first() {
        Some(first) if !takes_dims => Err(at(&first.name, errors::DIMS_WHAT)),
        _ => Ok(()),
    }
}
