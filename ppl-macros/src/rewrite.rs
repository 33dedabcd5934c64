//! Expressions inside statements: `?` and `reject!` get the place of the statement, and what a
//! model cannot do is refused.

use std::collections::HashMap;

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, quote, quote_spanned};
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Expr, Ident, Item, Macro, Stmt, Type, parse_quote_spanned};

use crate::emit;
use crate::errors::{self, at};
use crate::lower::Binding;
use crate::names::place;
use crate::parse;

/// Rewrites the expressions of one statement.
pub(crate) struct Rewrite<'a> {
    /// Number of the statement's place.
    site: usize,
    /// Whether the place is used.
    pub(crate) used: bool,
    scope: &'a HashMap<Ident, Binding>,
    /// How many closures deep: there, `?` and `return` are the closure's own.
    closures: usize,
}

impl<'a> Rewrite<'a> {
    pub(crate) fn new(site: usize, scope: &'a HashMap<Ident, Binding>) -> Self {
        Self { site, used: false, scope, closures: 0 }
    }

    /// For what is evaluated in a closure that the macro writes.
    pub(crate) fn inside_closure(mut self) -> Self {
        self.closures = 1;
        self
    }

    /// The unknown that an assignment would change.
    fn assigned(&self, left: &Expr) -> Option<String> {
        let place = place(left).ok()?;
        (self.scope.get(&place.root) == Some(&Binding::Unknown)).then(|| place.root.to_string())
    }

    fn reject(&mut self, mac: &Macro) -> TokenStream {
        if self.closures > 0 {
            return at(&mac.path, errors::REJECT_IN_CLOSURE).to_compile_error();
        }
        if mac.tokens.is_empty() {
            return at(mac, errors::REJECT_REASON).to_compile_error();
        }
        self.used = true;
        let site = emit::site(self.site);
        let reason = &mac.tokens;
        let span = Span::mixed_site().located_at(mac.path.span());
        quote_spanned! {span=>
            return ::core::result::Result::Err(#site.reject(::std::format!(#reason)))
        }
    }
}

impl VisitMut for Rewrite<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        match expr {
            Expr::Closure(_) | Expr::Async(_) => {
                self.closures += 1;
                visit_mut::visit_expr_mut(self, expr);
                self.closures -= 1;
                return;
            }
            Expr::Macro(mac) if mac.mac.path.is_ident("reject") => {
                *expr = Expr::Verbatim(self.reject(&mac.mac));
                return;
            }
            _ => visit_mut::visit_expr_mut(self, expr),
        }
        let error = match &*expr {
            Expr::Return(_) if self.closures == 0 => at(&*expr, errors::RETURN),
            Expr::Await(_) if self.closures == 0 => at(&*expr, errors::AWAIT),
            Expr::Path(path) if path.path.is_ident("self") => at(path, errors::SELF_VALUE),
            Expr::Call(call) if parse::factor(call).is_some() => at(call, errors::FACTOR_INSIDE),
            Expr::Assign(assign) => match self.assigned(&assign.left) {
                Some(name) => at(&assign.left, errors::assigned(&name)),
                None => return,
            },
            Expr::Binary(binary) if is_assignment(&binary.op) => {
                match self.assigned(&binary.left) {
                    Some(name) => at(&binary.left, errors::assigned(&name)),
                    None => return,
                }
            }
            _ => {
                if let Expr::Try(attempt) = expr
                    && self.closures == 0
                {
                    self.used = true;
                    let site = emit::site(self.site);
                    let span = Span::mixed_site().located_at(attempt.question_token.span());
                    let inner = &attempt.expr;
                    let located = quote_spanned!(span=> locate);
                    *attempt.expr = Expr::Verbatim(quote!(#site.#located(#inner)));
                }
                return;
            }
        };
        *expr = Expr::Verbatim(error.to_compile_error());
    }

    fn visit_stmt_mut(&mut self, stmt: &mut Stmt) {
        if let Stmt::Macro(mac) = stmt
            && mac.mac.path.is_ident("reject")
        {
            let tokens = self.reject(&mac.mac);
            *stmt = Stmt::Expr(Expr::Verbatim(tokens), Some(Default::default()));
            return;
        }
        visit_mut::visit_stmt_mut(self, stmt);
    }

    /// `Real` is the number of the reading here as it is in signatures of submodels.
    fn visit_type_mut(&mut self, ty: &mut Type) {
        match ty {
            Type::Path(path) if path.qself.is_none() && path.path.is_ident("Real") => {
                let real = &path.path;
                *ty = parse_quote_spanned!(path.span()=> #real<_>);
            }
            _ => visit_mut::visit_type_mut(self, ty),
        }
    }

    // functions inside a model are functions of their own
    fn visit_item_mut(&mut self, _: &mut Item) {}
}

/// `+=` and its kind.
pub(crate) fn is_assignment(op: &BinOp) -> bool {
    let text = op.to_token_stream().to_string();
    text.ends_with('=') && !matches!(op, BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Le(_) | BinOp::Ge(_))
}
