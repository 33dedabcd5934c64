//! What stands in a loop before its observation: names for data, which stay, and names for what
//! depends on unknowns, whose values are put in their places.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote};
use syn::visit::{self, Visit};
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprCall, ExprMethodCall, Ident, Pat, parse_quote};

use crate::ast::{Init, Kind, Statement};
use crate::attributes::Mark;
use crate::fold::{Term, terms};
use crate::inspect::{count, says, variables};
use crate::linear::sums::{Loop, Names};

pub(super) struct Statements {
    pub(super) data: Vec<TokenStream>,
    /// Names with values that depend on unknowns, in order.
    pub(super) derived: Vec<(Ident, Expr)>,
    /// What the values have for loops.
    pub(super) loops: Vec<Loop>,
}

impl Statements {
    /// Reads declarations; `None` if there is something else, or if a name means two things.
    pub(super) fn read(names: &mut Names, statements: &[Statement]) -> Option<Self> {
        let mut read = Self { data: Vec::new(), derived: Vec::new(), loops: Vec::new() };
        let mut seen = HashSet::new();
        let mut rest = statements;
        while let Some((first, after)) = rest.split_first() {
            let Declaration { name, value, is_mutable } = declaration(first)?;
            let terms = if is_mutable { terms(name, after) } else { Vec::new() };
            rest = &after[terms.len()..];
            let mut note = |name: &Ident| _ = seen.insert(name.to_string());
            variables(value.to_token_stream(), &mut note);
            for term in &terms {
                variables(term.value.to_token_stream(), &mut note);
                if let Some((_, iter)) = &term.over {
                    variables(iter.to_token_stream(), &mut note);
                }
            }
            if names.is_own(name) || !seen.insert(name.to_string()) {
                return None;
            }
            let mut value = constant(value).clone();
            for term in terms {
                value = read.with(term, &value, names);
            }
            if names.has_unknown(&value) {
                names.declare_unknown([name.clone()]);
                read.derived.push((name.clone(), value));
            } else if is_mutable {
                return None;
            } else {
                names.declare_own([name.clone()]);
                read.data.push(quote!(let #name = #value;));
            }
        }
        Some(read)
    }

    /// A value and what is added to it; a loop has a name in it.
    fn with(&mut self, term: Term, value: &Expr, names: &mut Names) -> Expr {
        let Term { is_negative, value: added, over } = term;
        let added = match over {
            None => added,
            Some((pat, iter)) => {
                let name = format_ident!("__loop_{}", self.loops.len(), span = Span::mixed_site());
                names.declare_loop(&name);
                let placed = parse_quote!(#name);
                self.loops.push(Loop { name, pat, iter, value: added });
                placed
            }
        };
        match is_negative {
            true => parse_quote!((#value) - (#added)),
            false => parse_quote!((#value) + (#added)),
        }
    }
}

struct Declaration<'a> {
    name: &'a Ident,
    value: &'a Expr,
    is_mutable: bool,
}

/// `let name = value;`, unmarked.
fn declaration(statement: &Statement) -> Option<Declaration<'_>> {
    let Kind::Let { pat: Pat::Ident(pat), init, .. } = &statement.kind else { return None };
    let Some(Init::Value { value, diverge: None, .. }) = init else { return None };
    let is_plain = pat.by_ref.is_none() && pat.subpat.is_none();
    let is_bare = statement.mark == Mark::None && statement.attrs.is_empty();
    let is_mutable = pat.mutability.is_some();
    (is_plain && is_bare && !leaves(value) && has_type(constant(value))).then_some(Declaration {
        name: &pat.ident,
        value,
        is_mutable,
    })
}

/// A number that is written as if it were unknown.
fn constant(value: &Expr) -> &Expr {
    match value {
        Expr::Call(call) if is_constant(call) => &call.args[0],
        other => other,
    }
}

/// `Real::from(…)`.
fn is_constant(call: &ExprCall) -> bool {
    let Expr::Path(path) = &*call.func else { return false };
    let words: Vec<_> = path.path.segments.iter().map(|segment| &segment.ident).collect();
    let is_from = matches!(words[..], [.., real, from] if real == "Real" && from == "from");
    call.args.len() == 1 && is_from
}

/// Whether data have a type by themselves, wherever they are used.
pub(super) fn has_type(expr: &Expr) -> bool {
    struct Typed(bool);

    impl<'a> Visit<'a> for Typed {
        fn visit_expr_method_call(&mut self, call: &'a ExprMethodCall) {
            let is_asked = OF_MANY_TYPES.iter().any(|name| call.method == name);
            self.0 &= !is_asked || call.turbofish.is_some();
            visit::visit_expr_method_call(self, call);
        }

        fn visit_expr_call(&mut self, call: &'a ExprCall) {
            self.0 &= !is_constant(call) && !says(call.func.to_token_stream(), "default");
            visit::visit_expr_call(self, call);
        }
    }

    let mut typed = Typed(true);
    typed.visit_expr(expr);
    typed.0
}

/// Methods that give what they are asked for.
const OF_MANY_TYPES: [&str; 7] =
    ["collect", "into", "parse", "product", "sum", "try_into", "unwrap_or_default"];

/// Whether an expression may leave the model, or is one that cannot be read.
pub(super) fn leaves(expr: &impl ToTokens) -> bool {
    let text = expr.to_token_stream().to_string();
    text.contains('?') || text.contains('!')
}

/// Puts the values in the places of their names; `None` if one would be computed again and again
/// or come to mean something else.
pub(super) fn substitute(
    derived: Vec<(Ident, Expr)>,
    mean: &mut Expr,
    scale: &mut Expr,
    loops: &mut [Loop],
) -> Option<()> {
    // the last first, as it may use those before it
    for (name, value) in derived.iter().rev() {
        let here = |expr: &Expr| count(expr.to_token_stream(), name);
        let uses = here(mean) + here(scale);
        let inside: usize = loops.iter().map(|sum| here(&sum.value) + here(&sum.iter)).sum();
        let is_place = matches!(value, Expr::Path(_) | Expr::Index(_) | Expr::Field(_));
        if uses + inside > 1 && !is_place {
            return None;
        }
        let mut substitute = Substitute { name, value };
        substitute.visit_expr_mut(mean);
        substitute.visit_expr_mut(scale);
        for sum in loops.iter_mut().filter(|sum| here(&sum.value) + here(&sum.iter) > 0) {
            if sum.hides(name) || sum.hides(value) {
                return None;
            }
            substitute.visit_expr_mut(&mut sum.value);
            substitute.visit_expr_mut(&mut sum.iter);
        }
    }
    Some(())
}

/// Puts a value in the place of its name.
struct Substitute<'a> {
    name: &'a Ident,
    value: &'a Expr,
}

impl VisitMut for Substitute<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if matches!(expr, Expr::Path(path) if path.path.is_ident(self.name)) {
            let value = self.value;
            *expr = match value {
                Expr::Path(_) | Expr::Index(_) | Expr::Field(_) => value.clone(),
                _ => parse_quote!((#value)),
            };
        } else {
            visit_mut::visit_expr_mut(self, expr);
        }
    }
}
