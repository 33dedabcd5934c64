//! Sums that are written as loops: `let mut mean = a; for x in xs { mean += b * x; }` is one
//! formula, whose loop runs once for the value and once more for the derivative.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote_spanned};
use syn::visit::{self, Visit};
use syn::{BinOp, Expr, Ident, Pat, Stmt};

use crate::arithmetic::{is_dot, is_function};
use crate::attributes::Mark;
use crate::inspect::{keeps_its_length, mentions};
use crate::parse::{Flow, Kind, Statement};

/// What is added to a sum.
pub(crate) struct Term {
    pub(crate) is_negative: bool,
    pub(crate) value: Expr,
    /// The loop that adds it again and again.
    pub(crate) over: Option<(Pat, Expr)>,
}

/// The summands that follow the declaration of `name` without a gap.
pub(crate) fn terms(name: &Ident, after: &[Statement]) -> Vec<Term> {
    after.iter().map_while(|statement| term(name, statement)).collect()
}

fn term(name: &Ident, statement: &Statement) -> Option<Term> {
    if !is_bare(statement) {
        return None;
    }
    match &statement.kind {
        Kind::Rust(stmt) => step(name, stmt),
        Kind::Flow(Flow::For { label: None, pat, iter, body, .. }) => {
            let [inner] = body.statements.as_slice() else { return None };
            let Kind::Rust(stmt) = &inner.kind else { return None };
            let repeats = keeps_its_length(iter) && !matches!(iter, Expr::Path(_));
            if !is_bare(inner) || !repeats || names(iter, name) || names(pat, name) {
                return None;
            }
            Some(Term { over: Some(((**pat).clone(), iter.clone())), ..step(name, stmt)? })
        }
        _ => None,
    }
}

/// Nothing but what it says.
fn is_bare(statement: &Statement) -> bool {
    statement.attrs.is_empty() && statement.mark == Mark::None && statement.site.is_none()
}

/// `name += value;` or `name -= value;` with a value that can be computed twice.
fn step(name: &Ident, stmt: &Stmt) -> Option<Term> {
    let Stmt::Expr(Expr::Binary(binary), _) = stmt else { return None };
    let is_negative = match binary.op {
        BinOp::AddAssign(_) => false,
        BinOp::SubAssign(_) => true,
        _ => return None,
    };
    let own = matches!(&*binary.left, Expr::Path(path) if path.path.is_ident(name));
    let mut pure = Pure(true);
    pure.visit_expr(&binary.right);
    let holds = own && pure.0 && binary.attrs.is_empty() && !names(&*binary.right, name);
    holds.then(|| Term { is_negative, value: (*binary.right).clone(), over: None })
}

fn names(tokens: impl ToTokens, name: &Ident) -> bool {
    mentions(tokens.to_token_stream(), &|found| name == found)
}

/// Arithmetic, fields and indices: what has no effect and does not leave the loop.
struct Pure(bool);

impl<'a> Visit<'a> for Pure {
    fn visit_expr(&mut self, expr: &'a Expr) {
        self.0 &= match expr {
            Expr::Binary(_)
            | Expr::Cast(_)
            | Expr::Field(_)
            | Expr::Group(_)
            | Expr::Index(_)
            | Expr::Lit(_)
            | Expr::Paren(_)
            | Expr::Path(_)
            | Expr::Unary(_) => true,
            Expr::Reference(reference) => reference.mutability.is_none(),
            Expr::Call(call) => is_dot(call),
            Expr::MethodCall(call) => is_function(call) || call.method == "len",
            _ => false,
        };
        visit::visit_expr(self, expr);
    }
}

/// The loop of a summand as two variables and the sum over them.
pub(crate) struct Replay {
    pub(crate) variables: [Stmt; 2],
    pub(crate) sum: TokenStream,
}

/// Writes a loop of a sum: `each` is its summand as a formula.
pub(crate) fn replay(number: usize, pat: &Pat, iter: &Expr, each: &Expr) -> Replay {
    let span = Span::mixed_site();
    let over = format_ident!("__over_{number}", span = span);
    let summand = format_ident!("__summand_{number}", span = span);
    let local = |tokens: TokenStream| -> Stmt {
        Stmt::Expr(Expr::Verbatim(tokens), Some(Default::default()))
    };
    Replay {
        variables: [
            local(quote_spanned!(span=> let #over = ::core::iter::IntoIterator::into_iter(#iter))),
            local(quote_spanned! {span=>
                let #summand = ::ppl::__private::summand(&#over, |#pat| #each)
            }),
        ],
        sum: quote_spanned!(span=> ::ppl::__private::total(&#over, &#summand)),
    }
}
