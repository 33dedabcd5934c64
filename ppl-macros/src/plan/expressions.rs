//! Rewrites the expressions of a statement. Arithmetic on unknowns becomes formulas, and each formula is
//! differentiated as one operation.
//!
//! `a + b * x` is rewritten as `operand(a) + operand(b) * x`. The types of the operands determine which derivatives
//! are computed, so treating a plain number as an unknown is safe. A formula that is a parameter of a distribution
//! stays a formula; any other formula is evaluated to a number (function `closed`).

use quote::ToTokens;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprAssign, ExprBinary, Ident, Item, Stmt, Type, parse_quote_spanned};

use super::{Plan, calls, literals};
use crate::syntax::expressions::{
    binds_names, dot, is_arithmetic, is_assignment, is_function, is_type, operations,
    without_assignment,
};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::parse_place;
use crate::syntax::tokens::mentions;

/// Largest number of operations in one formula. The type of a longer formula, such as a sum of a hundred terms, would
/// exceed limits of rustc. A longer formula is split into parts, and each part is evaluated to a number.
const LONGEST: usize = 24;

impl Plan<'_> {
    fn is_active(&self, tokens: &impl ToTokens) -> bool {
        self.analysis.activity.mentions(tokens)
    }

    /// Rewrites the right side of `~`. Arithmetic in the parameters of the distribution becomes formulas that are not
    /// evaluated to numbers.
    pub(crate) fn distribution(&mut self, distribution: &mut Expr) {
        match distribution {
            _ if !self.formulas => self.visit_expr_mut(distribution),
            Expr::Paren(paren) => self.distribution(&mut paren.expr),
            Expr::Group(group) => self.distribution(&mut group.expr),
            Expr::MethodCall(call) => {
                self.distribution(&mut call.receiver);
                call.args.iter_mut().for_each(|argument| self.visit_expr_mut(argument));
                if let Some(turbofish) = &mut call.turbofish {
                    self.visit_angle_bracketed_generic_arguments_mut(turbofish);
                }
            }
            Expr::Call(call) if is_type(&call.func) => {
                self.visit_expr_mut(&mut call.func);
                for argument in &mut call.args {
                    if self.is_active(argument) && operations(argument) > 0 {
                        self.formula(argument);
                    } else if let Some(shared) = self.shared(argument) {
                        *argument = calls::operand(&shared);
                    } else {
                        self.visit_expr_mut(argument);
                    }
                }
            }
            other => self.visit_expr_mut(other),
        }
    }

    /// Rewrites arithmetic as a formula whose leaves are operands.
    pub(super) fn formula(&mut self, expr: &mut Expr) {
        if !self.is_active(expr) {
            return self.visit_expr_mut(expr);
        }
        match expr {
            Expr::Paren(paren) => self.formula(&mut paren.expr),
            Expr::Group(group) => self.formula(&mut group.expr),
            Expr::Unary(unary) if matches!(unary.op, syn::UnOp::Neg(_)) => {
                self.formula(&mut unary.expr);
            }
            Expr::Binary(binary) if is_arithmetic(&binary.op) => {
                self.formula(&mut binary.left);
                self.formula(&mut binary.right);
                if operations(expr) >= LONGEST {
                    let part = calls::closed(expr, expr.span());
                    *expr = calls::operand(&part);
                }
            }
            Expr::MethodCall(call) if is_function(call) && self.is_active(&call.receiver) => {
                self.formula(&mut call.receiver);
                call.args.iter_mut().for_each(|argument| self.formula(argument));
            }
            // the receiver of this method is data; only the arguments may depend on unknowns
            Expr::MethodCall(call) if is_function(call) => {
                self.visit_expr_mut(&mut call.receiver);
                call.args.iter_mut().for_each(|argument| self.visit_expr_mut(argument));
                *expr = calls::operand(expr);
            }
            other if dot(other).is_some() => self.dot(other),
            other => {
                self.part(other);
                *other = calls::operand(other);
            }
        }
    }

    /// Rewrites the expression of one operand of a formula.
    fn part(&mut self, expr: &mut Expr) {
        if let Some(shared) = self.shared(expr) {
            *expr = shared;
        } else if let Expr::Index(index) = expr
            && !matches!(&*index.index, Expr::Range(_))
            && !self.is_active(&index.index)
            && let Some(shared) = self.shared(&index.expr)
        {
            self.visit_expr_mut(&mut index.index);
            // a literal index selects the same element in every iteration
            let is_literal = matches!(&*index.index, Expr::Lit(_));
            *expr = calls::element(&shared, index, is_literal);
        } else {
            self.visit_expr_mut(expr);
        }
    }

    /// Rewrites `dot(data, &numbers)` and `dot(data, numbers)`. `numbers` can be a variable that all iterations of a
    /// plate share; if it is written without `&`, the variable itself is a reference.
    fn dot(&mut self, expr: &mut Expr) {
        let Expr::Call(call) = &mut *expr else { return };
        let last = call.args.len().saturating_sub(1);
        for (i, argument) in call.args.iter_mut().enumerate() {
            if i == last
                && let Expr::Reference(array) = argument
                && let Some(shared) = self.shared(&array.expr)
            {
                *array.expr = shared;
            } else if i == last
                && let Some(shared) = self.shared(argument)
            {
                *argument = calls::reference(&shared);
            } else {
                self.visit_expr_mut(argument);
            }
        }
        *expr = match self.closures {
            0 => calls::dot(self.site(), call),
            _ => calls::operand(expr),
        };
    }

    /// Returns the variable that sums the adjoint of `expr` over the iterations of the enclosing plate (`for` loop of
    /// the model); None if `expr` is not a name from outside the plate.
    fn shared(&mut self, expr: &Expr) -> Option<Expr> {
        let Expr::Path(path) = expr else { return None };
        let name = path.path.get_ident()?;
        let sums = self.sums.as_mut().filter(|_| self.shared.contains(name))?;
        sums.names.insert(name.clone());
        Some(Expr::Verbatim(calls::shared_name(name).into_token_stream()))
    }

    /// Rewrites `name += …` as `name = name + …`, so that the new value is one formula. Returns whether `expr` was
    /// rewritten.
    fn step(&mut self, expr: &mut Expr) -> bool {
        let Expr::Binary(ExprBinary { attrs, left, op, right }) = expr else { return false };
        let Some(plain) = without_assignment(op).filter(|_| matches!(&**left, Expr::Path(_)))
        else {
            return false;
        };
        if !self.formulas || !(self.is_active(left) || self.is_active(right)) {
            return false;
        }
        let span = right.span();
        self.formula(right);
        *expr = Expr::Assign(ExprAssign {
            attrs: std::mem::take(attrs),
            left: left.clone(),
            eq_token: Default::default(),
            right: Box::new(calls::closed(&calls::step(left, plain, right), span)),
        });
        true
    }
}

/// Whether an assignment changes an element of a variable that the right side also uses. Only such assignments are
/// rewritten to evaluate their right side first.
fn reads_what_it_changes(binary: &ExprBinary) -> bool {
    let ExprBinary { left, op, right, .. } = binary;
    let reads = |name: &Ident| mentions(right.to_token_stream(), &|variable| variable == name);
    is_assignment(op) && parse_place(left).is_ok_and(|place| place.is_entry && reads(&place.root))
}

impl VisitMut for Plan<'_> {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if let Expr::Macro(call) = expr
            && call.mac.path.is_ident("reject")
        {
            *expr = calls::reject(self.site(), &call.mac);
            return;
        }
        if binds_names(expr) && !self.shared.is_empty() {
            let shared = std::mem::take(&mut self.shared);
            self.visit_expr_mut(expr);
            self.shared = shared;
            return;
        }
        literals::align(expr, &self.analysis.activity);
        if self.step(expr) {
            return;
        }
        let is_formula = dot(expr).is_some() || operations(expr) > 1;
        if self.formulas && is_formula && self.is_active(expr) {
            let span = expr.span();
            self.formula(expr);
            *expr = calls::closed(expr, span);
            return;
        }
        let is_update = matches!(&*expr, Expr::Binary(binary) if reads_what_it_changes(binary));
        // in a closure, `?` returns from the closure and not from the model
        let closures = usize::from(matches!(expr, Expr::Closure(_) | Expr::Async(_)));
        self.closures += closures;
        visit_mut::visit_expr_mut(self, expr);
        self.closures -= closures;
        match expr {
            Expr::Binary(binary) if is_update => *expr = calls::right_side_first(binary),
            Expr::Try(attempt) if self.closures == 0 => {
                *expr = calls::located(self.site(), attempt);
            }
            _ => {}
        }
    }

    fn visit_stmt_mut(&mut self, stmt: &mut Stmt) {
        match stmt {
            Stmt::Macro(call) if call.mac.path.is_ident("reject") => {
                let reject = calls::reject(self.site(), &call.mac);
                *stmt = Stmt::Expr(reject, Some(Default::default()));
                return;
            }
            Stmt::Local(local) => {
                let is_changed = |name: &Ident| self.analysis.activity.is_changed(name);
                if let Some(init) = &mut local.init
                    && bound_names(&local.pat).iter().any(is_changed)
                {
                    literals::begin(&local.pat, &mut init.expr);
                }
            }
            _ => {}
        }
        visit_mut::visit_stmt_mut(self, stmt);
    }

    /// Replaces the type `Real` by `Real<_>`, so that the compiler infers the number type. The user writes `Real`
    /// without a parameter, as in the signatures of submodels.
    fn visit_type_mut(&mut self, ty: &mut Type) {
        match ty {
            Type::Path(path) if path.qself.is_none() && path.path.is_ident("Real") => {
                let real = &path.path;
                *ty = parse_quote_spanned!(path.span()=> #real<_>);
            }
            _ => visit_mut::visit_type_mut(self, ty),
        }
    }

    // functions inside a model are not part of the model
    fn visit_item_mut(&mut self, _: &mut Item) {}
}
