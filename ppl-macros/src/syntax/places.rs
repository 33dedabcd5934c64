//! Places: variables, their fields and elements.

use syn::ext::IdentExt;
use syn::{Expr, Ident, Member, Result, UnOp};

use crate::errors::{self, at};

/// A place: an expression that can be on the left of `~`, or be assigned to.
pub(crate) struct Place {
    /// The variable to which the place belongs.
    pub(crate) root: Ident,
    /// Name of the place in the results: the variable with its fields, without indices.
    pub(crate) name: String,
    /// Whether the place is written with an index, as in `y[i]`.
    pub(crate) is_entry: bool,
}

pub(crate) fn parse_place(expr: &Expr) -> Result<Place> {
    match expr {
        Expr::Path(path) if path.qself.is_none() => {
            let root = path.path.segments.last().map(|segment| &segment.ident);
            let root = root.ok_or_else(|| at(expr, errors::NOT_A_PLACE))?;
            Ok(Place { root: root.clone(), name: root.unraw().to_string(), is_entry: false })
        }
        Expr::Field(field) => {
            let mut place = parse_place(&field.base)?;
            place.name.push('.');
            match &field.member {
                Member::Named(name) => place.name.push_str(&name.unraw().to_string()),
                Member::Unnamed(index) => place.name.push_str(&index.index.to_string()),
            }
            Ok(place)
        }
        Expr::Index(index) => Ok(Place { is_entry: true, ..parse_place(&index.expr)? }),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Deref(_)) => parse_place(&unary.expr),
        Expr::Paren(paren) => parse_place(&paren.expr),
        Expr::Group(group) => parse_place(&group.expr),
        _ => Err(at(expr, errors::NOT_A_PLACE)),
    }
}

/// Returns the variable to which a place belongs.
pub(crate) fn root(expr: &Expr) -> Option<Ident> {
    parse_place(expr).ok().map(|place| place.root)
}

/// Returns the variable if the place is only a variable, without fields and indices; None otherwise.
pub(crate) fn plain_name(place: &Expr) -> Option<&Ident> {
    match place {
        Expr::Path(path) => path.path.get_ident(),
        _ => None,
    }
}
