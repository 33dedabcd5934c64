//! The expressions of a statement: arithmetic over operands, in parameters of distributions left
//! open, everywhere else closed to a number.

use proc_macro2::Span;
use quote::quote_spanned;
use syn::spanned::Spanned;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprAssign, ExprBinary, Ident, Item, Stmt, UnOp};

use crate::arithmetic::{
    LONGEST, binds_names, closed, is_arithmetic, is_dot, is_function, is_type, numbers_of_dot,
    operand, operations, sum_of, without_assignment,
};
use crate::formula::Formulas;
use crate::inspect::lost_derivatives;
use crate::rewrite::is_assignment;
use crate::{literals, scan, starts};

impl Formulas {
    /// The right-hand side of `~`: arithmetic in its parameters stays open.
    pub(crate) fn distribution(&mut self, distribution: &mut Expr) {
        match distribution {
            Expr::Paren(paren) => self.distribution(&mut paren.expr),
            Expr::Group(group) => self.distribution(&mut group.expr),
            Expr::MethodCall(call) => {
                self.distribution(&mut call.receiver);
                call.args.iter_mut().for_each(|argument| self.visit_expr_mut(argument));
            }
            Expr::Call(call) if is_type(&call.func) => {
                for argument in &mut call.args {
                    if self.mentions(argument) && operations(argument) > 0 {
                        self.check(argument);
                        self.open(argument);
                    } else if let Some(sum) = self.summed(argument) {
                        *argument = operand(&sum);
                    } else {
                        self.visit_expr_mut(argument);
                    }
                }
            }
            other => self.visit_expr_mut(other),
        }
    }

    /// Writes arithmetic over operands.
    pub(crate) fn open(&mut self, expr: &mut Expr) {
        if !self.mentions(expr) {
            return;
        }
        match expr {
            Expr::Paren(paren) => self.open(&mut paren.expr),
            Expr::Group(group) => self.open(&mut group.expr),
            Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => self.open(&mut unary.expr),
            Expr::Binary(binary) if is_arithmetic(&binary.op) => {
                self.open(&mut binary.left);
                self.open(&mut binary.right);
                if operations(expr) >= LONGEST {
                    let part = closed(expr, expr.span());
                    *expr = operand(&part);
                }
            }
            Expr::MethodCall(call) if is_function(call) && self.mentions(&call.receiver) => {
                self.open(&mut call.receiver);
                let is_pow = call.method == "pow";
                for argument in &mut call.args {
                    match is_pow {
                        true if operations(argument) > 0 => self.open(argument),
                        true => *argument = operand(argument),
                        false => self.visit_expr_mut(argument),
                    }
                }
            }
            other => {
                if let Expr::Index(index) = other
                    && !matches!(&*index.index, Expr::Range(_))
                    && !self.mentions(&index.index)
                    && let Some(sum) = self.summed(&index.expr)
                {
                    let at = &index.index;
                    let element = Ident::new(
                        if self.is_shared(at) { "__element" } else { "__own" },
                        Span::mixed_site().located_at(index.span()),
                    );
                    *other = Expr::Verbatim(quote_spanned!(index.span()=> #sum.#element(#at)));
                } else if let Some(sum) = self.summed(other) {
                    *other = sum;
                } else if let Some(numbers) = numbers_of_dot(other)
                    && let Some(sum) = self.summed(numbers)
                {
                    *numbers = sum;
                } else if is_dot(other) {
                    visit_mut::visit_expr_mut(self, other);
                } else {
                    self.visit_expr_mut(other);
                }
                *other = operand(other);
            }
        }
    }

    /// Whether an index finds the same elements in every iteration of the plate: a literal, or the
    /// variable of a loop inside.
    fn is_shared(&self, index: &Expr) -> bool {
        match index {
            Expr::Lit(_) => true,
            Expr::Path(path) => path.path.get_ident().is_some_and(|name| self.inner.contains(name)),
            _ => false,
        }
    }

    /// A name from outside the plate, as the sum that its adjoint has there.
    pub(crate) fn summed(&mut self, expr: &Expr) -> Option<Expr> {
        let Expr::Path(path) = expr else { return None };
        let name = path.path.get_ident()?;
        let plate = self.plate.as_mut().filter(|plate| plate.outer.contains(&name.to_string()))?;
        plate.summed.insert(name.clone());
        let sum = sum_of(name);
        Some(Expr::Verbatim(quote_spanned!(name.span()=> #sum)))
    }
}

impl VisitMut for Formulas {
    fn visit_expr_mut(&mut self, expr: &mut Expr) {
        if binds_names(expr) && self.plate.is_some() {
            let plate = self.plate.take();
            self.visit_expr_mut(expr);
            self.plate = plate;
            return;
        }
        self.check(expr);
        if literals::can_align(expr) && self.mentions(expr) {
            literals::align(expr);
        }
        if let Expr::MethodCall(call) = expr
            && let Some(error) = lost_derivatives(call, |call| self.mentions(call))
            && !self.recorded
        {
            *expr = Expr::Verbatim(error.to_compile_error());
            return;
        }
        if let Expr::Binary(ExprBinary { attrs, left, op, right }) = expr
            && is_assignment(op)
            && matches!(&**left, Expr::Path(_))
            && let Some(plain) = without_assignment(op)
            && (self.mentions(left) || self.mentions(right))
        {
            let name = left.clone();
            let (mut sum, span) = ((**right).clone(), right.span());
            self.open(&mut sum);
            let before = operand(&name);
            let sum = closed(&Expr::Verbatim(quote_spanned!(span=> #before #plain (#sum))), span);
            *expr = Expr::Assign(ExprAssign {
                attrs: std::mem::take(attrs),
                left: name,
                eq_token: Default::default(),
                right: Box::new(sum),
            });
            return;
        }
        if (is_dot(expr) || operations(expr) > 1) && self.mentions(expr) {
            let span = expr.span();
            self.open(expr);
            *expr = closed(expr, span);
        } else {
            visit_mut::visit_expr_mut(self, expr);
        }
    }

    fn visit_stmt_mut(&mut self, stmt: &mut Stmt) {
        if let Stmt::Local(local) = stmt {
            let names = scan::bound_names(&local.pat);
            let is_changed = |name: &Ident| self.derived.assigned.contains(&name.to_string());
            let changed = names.iter().any(is_changed);
            if let Some(init) = &mut local.init
                && changed
            {
                starts::begin(&local.pat, &mut init.expr, || self.derived.assigned.clone());
            }
            if changed || local.init.iter().any(|init| self.mentions(&init.expr)) {
                self.bind(names);
            }
        }
        visit_mut::visit_stmt_mut(self, stmt);
    }

    // functions inside a model are functions of their own
    fn visit_item_mut(&mut self, _: &mut Item) {}
}
