//! The names that patterns bind.

use syn::visit::{self, Visit};
use syn::{Expr, Ident, Pat, PatIdent};

/// The names that a pattern binds.
pub(crate) fn bound_names(pat: &Pat) -> Vec<Ident> {
    struct Names(Vec<Ident>);
    impl<'a> Visit<'a> for Names {
        fn visit_pat_ident(&mut self, pat: &'a PatIdent) {
            // a capital letter is a constant or a variant
            if !pat.ident.to_string().starts_with(char::is_uppercase) {
                self.0.push(pat.ident.clone());
            }
            visit::visit_pat_ident(self, pat);
        }
    }
    let mut names = Names(Vec::new());
    names.visit_pat(pat);
    names.0
}

/// The name, if a pattern is nothing else.
pub(crate) fn only_name(pat: &Pat) -> Option<&Ident> {
    let Pat::Ident(PatIdent { by_ref: None, mutability: None, subpat: None, ident, .. }) = pat
    else {
        return None;
    };
    Some(ident)
}

/// What an expression of Rust binds, with what its patterns take apart.
pub(crate) fn bindings(expr: &Expr) -> Vec<(&Pat, &Expr)> {
    match expr {
        Expr::ForLoop(each) => vec![(&*each.pat, &*each.expr)],
        Expr::Let(binding) => vec![(&*binding.pat, &*binding.expr)],
        Expr::Match(choice) => choice.arms.iter().map(|arm| (&arm.pat, &*choice.expr)).collect(),
        _ => Vec::new(),
    }
}

/// The names that `if let` conditions bind.
pub(crate) fn bound_by_condition(condition: &Expr) -> Vec<Ident> {
    match condition {
        Expr::Let(binding) => bound_names(&binding.pat),
        Expr::Binary(both) => {
            let mut names = bound_by_condition(&both.left);
            names.extend(bound_by_condition(&both.right));
            names
        }
        _ => Vec::new(),
    }
}
