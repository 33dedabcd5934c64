//! Sums that are written as loops: `let mut mean = a; for x in xs { mean += b * x; }` is one
//! formula, whose loop runs once for the value and once more for the derivative.

use proc_macro2::{Span, TokenStream};
use quote::{ToTokens, format_ident, quote_spanned};
use syn::spanned::Spanned;
use syn::visit::{self, Visit};
use syn::visit_mut::VisitMut;
use syn::{BinOp, Expr, Ident, Pat, Stmt, parse_quote};

use crate::arithmetic::{closed, is_dot, is_function};
use crate::ast::{Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::formula::Formulas;
use crate::inspect::{keeps_its_length, mentions, used_once};
use crate::scan;

impl Formulas {
    /// Joins the summands that follow `let mut name = …;` at `i` to one formula; how many
    /// statements that makes, or none if there is nothing to join.
    pub(crate) fn fold(&mut self, i: usize, statements: &mut Vec<Statement>) -> usize {
        let Kind::Let { pat: Pat::Ident(pat), init, .. } = &statements[i].kind else { return 0 };
        let Some(Init::Value { value, diverge: None, .. }) = init else { return 0 };
        if pat.mutability.is_none() || pat.by_ref.is_some() {
            return 0;
        }
        let (name, span, mut start) = (pat.ident.clone(), value.span(), value.clone());
        let mut terms = terms(&name, &statements[i + 1..]);
        let used = terms.len();
        let derived = |of: &Self| {
            terms.iter().any(|term| {
                of.mentions(&term.value) || term.over.iter().any(|(_, iter)| of.mentions(iter))
            })
        };
        if used == 0 || !derived(self) {
            return 0;
        }
        self.operand(&mut start);
        let (mut sum, mut variables) = (start.into_token_stream(), Vec::new());
        for term in &mut terms {
            let added = match &mut term.over {
                None => {
                    self.operand(&mut term.value);
                    term.value.to_token_stream()
                }
                Some((pat, iter)) => {
                    if self.mentions(iter) {
                        self.bind(scan::bound_names(pat));
                    }
                    self.visit_expr_mut(iter);
                    let outer = self.inner.clone();
                    self.inner.extend(scan::bound_names(pat));
                    self.operand(&mut term.value);
                    self.inner = outer;
                    self.sums += 1;
                    let replay = replay(self.sums, pat, iter, &term.value);
                    variables.extend(replay.variables);
                    replay.sum
                }
            };
            sum = match term.is_negative {
                true => quote_spanned!(span=> #sum - (#added)),
                false => quote_spanned!(span=> #sum + (#added)),
            };
        }
        let after = &statements[i + 1 + used..];
        let is_open = used_once(&name, after);
        let sum = Expr::Verbatim(sum);
        let sum = if is_open { sum } else { closed(&sum, span) };
        self.bind([name]);
        let new = variables.len();
        let declaration = &mut statements[i];
        if let Kind::Let { pat: Pat::Ident(pat), init: Some(Init::Value { value, .. }), .. } =
            &mut declaration.kind
        {
            *value = sum;
            if is_open {
                pat.mutability = None;
            }
        }
        if !is_open {
            declaration.attrs.push(parse_quote!(#[allow(unused_mut)]));
        }
        let predicted = declaration.predicted;
        statements.drain(i + 1..i + 1 + used);
        let variables = variables.into_iter().map(|stmt| Statement::rust(stmt, span, predicted));
        statements.splice(i..i, variables);
        new + 1
    }
}

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
            if !is_bare(inner) || !is_repeated(iter) || names(iter, name) || names(pat, name) {
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
    let holds =
        own && is_pure(&binary.right) && binary.attrs.is_empty() && !names(&*binary.right, name);
    holds.then(|| Term { is_negative, value: (*binary.right).clone(), over: None })
}

fn names(tokens: impl ToTokens, name: &Ident) -> bool {
    mentions(tokens.to_token_stream(), &|found| name == found)
}

/// Whether a loop over it can run again.
pub(crate) fn is_repeated(iter: &Expr) -> bool {
    keeps_its_length(iter) && !matches!(iter, Expr::Path(_))
}

/// Whether an expression can be computed again.
pub(crate) fn is_pure(expr: &Expr) -> bool {
    let mut pure = Pure(true);
    pure.visit_expr(expr);
    pure.0
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
            Expr::Call(_) => is_dot(expr),
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
