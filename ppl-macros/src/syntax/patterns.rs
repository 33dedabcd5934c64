//! Finds the names that patterns bind.

use syn::visit::{self, Visit};
use syn::{Expr, ExprClosure, Ident, Pat, PatIdent};

struct Names(Vec<Ident>);

impl<'a> Visit<'a> for Names {
    fn visit_pat_ident(&mut self, pat: &'a PatIdent) {
        if !is_constant(&pat.ident) {
            self.0.push(pat.ident.clone());
        }
        visit::visit_pat_ident(self, pat);
    }

    // a closure binds names only in its own body
    fn visit_expr_closure(&mut self, _: &'a ExprClosure) {}
}

/// Whether a name begins with a capital letter, as constants and enum variants do.
pub(crate) fn is_constant(name: &Ident) -> bool {
    name.to_string().starts_with(char::is_uppercase)
}

/// Returns the names that a pattern binds.
pub(crate) fn bound_names(pat: &Pat) -> Vec<Ident> {
    let mut names = Names(Vec::new());
    names.visit_pat(pat);
    names.0
}

/// Returns the names that the `if let` patterns of a condition bind.
pub(crate) fn bound_by_condition(condition: &Expr) -> Vec<Ident> {
    let mut names = Names(Vec::new());
    names.visit_expr(condition);
    names.0
}

/// Returns the name if the pattern is a single name, with or without a type; None for any other pattern.
pub(crate) fn only_name(pat: &Pat) -> Option<&Ident> {
    match pat {
        Pat::Type(typed) => only_name(&typed.pat),
        Pat::Ident(PatIdent { by_ref: None, mutability: None, subpat: None, ident, .. }) => {
            Some(ident)
        }
        _ => None,
    }
}
