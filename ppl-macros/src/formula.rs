//! Arithmetic on unknowns becomes formulas that are differentiated as a whole, and loops say
//! where what an iteration computed is no longer needed.
//!
//! `a + b * x` is written as `operand(a) + operand(b) * x`: the operands decide by their types
//! whether there is anything to differentiate, so that this pass may take a name for an unknown
//! that is none. As a parameter of a distribution a formula stays open, everywhere else it is
//! closed to a number.

use std::collections::{BTreeSet, HashSet};

use proc_macro2::Span;
use quote::{ToTokens, quote_spanned};
use syn::spanned::Spanned;
use syn::visit::Visit;
use syn::visit_mut::{self, VisitMut};
use syn::{Expr, ExprAssign, ExprBinary, Ident, Item, Stmt, UnOp};

use crate::arithmetic::{
    LONGEST, binds_names, closed, is_arithmetic, is_dot, is_function, is_type, numbers_of_dot,
    operand, operations, sum_of, without_assignment,
};
use crate::ast::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::derived::Derived;
use crate::effects::{bound_inside, writes_outside};
use crate::inspect::{
    Branches, is_consumed, is_pooled, keeps_its_length, lost_derivatives, mentions, stays_open,
};
use crate::rewrite::is_assignment;
use crate::{literals, scan, starts};

/// Rewrites the body; whether every point runs the same statements.
pub(crate) fn formulas(body: &mut Block) -> bool {
    let mut pass = Formulas {
        active: HashSet::new(),
        derived: Derived::of(body, []),
        is_static: true,
        sums: 0,
        inner: Vec::new(),
        plate: None,
        totals: None,
        recorded: false,
    };
    pass.block(body);
    pass.is_static
}

pub(crate) struct Formulas {
    /// Names that may hold unknowns or what follows from them.
    pub(crate) active: HashSet<String>,
    /// As far as the whole body tells.
    derived: Derived,
    is_static: bool,
    /// Loops that have become sums.
    pub(crate) sums: usize,
    /// Variables of such loops around.
    pub(crate) inner: Vec<Ident>,
    /// The plate around, if adjoints of what is outside can be summed up apart.
    plate: Option<Plate>,
    /// The observations in the loop around, by their sites.
    totals: Option<Vec<usize>>,
    /// Whether the statement is one that results record, which nobody differentiates.
    recorded: bool,
}

/// Names from outside that a plate does not change.
struct Plate {
    outer: HashSet<String>,
    /// Those that are parameters of densities in it.
    summed: BTreeSet<Ident>,
}

impl Formulas {
    fn block(&mut self, block: &mut Block) {
        let mut i = 0;
        while i < block.statements.len() {
            let variables = self.fold(i, &mut block.statements);
            if variables > 0 {
                i += variables;
                continue;
            }
            let (before, after) = block.statements.split_at_mut(i + 1);
            let statement = &mut before[i];
            self.recorded = statement.predicted || statement.mark != Mark::None;
            self.begin(&mut statement.kind, after);
            if !self.leave_open(&mut statement.kind, after) {
                self.statement(&mut statement.kind, statement.site);
            }
            i += 1;
        }
    }

    /// An operand of a formula, itself a formula where it computes something.
    pub(crate) fn operand(&mut self, expr: &mut Expr) {
        self.check(expr);
        self.open(expr);
        *expr = operand(expr);
    }

    /// A deterministic number that is used once, as a parameter of an observation that follows,
    /// stays a formula: nothing has to be kept for it.
    fn leave_open(&mut self, kind: &mut Kind, after: &[Statement]) -> bool {
        let Some((name, _)) = stays_open(kind, after) else { return false };
        let name = name.clone();
        let Kind::Let { init: Some(Init::Value { value, .. }), .. } = kind else { return false };
        if !self.mentions(value) {
            return false;
        }
        self.check(value);
        self.open(value);
        self.bind([name]);
        true
    }

    /// What is changed later to something that may hold unknowns may hold them from its begin.
    fn begin(&mut self, kind: &mut Kind, after: &[Statement]) {
        let Kind::Let { pat, init, .. } = kind else { return };
        let names = scan::bound_names(pat);
        let is_changed = |name: &Ident| self.derived.assigned.contains(&name.to_string());
        if names.iter().any(is_changed) {
            if let Some(Init::Value { value, .. }) = init {
                starts::begin(pat, value, || self.derived.assigned_in(after));
            }
            self.bind(names);
        }
    }

    fn statement(&mut self, kind: &mut Kind, site: Option<usize>) {
        match kind {
            Kind::Unknown { name, distribution, .. } => {
                self.distribution(distribution);
                self.bind([name.clone()]);
            }
            Kind::Observe { distribution, apart, .. } => {
                self.distribution(distribution);
                if let (Some(totals), Some(site)) = (&mut self.totals, site) {
                    *apart = true;
                    totals.push(site);
                }
            }
            Kind::Impute { distribution, .. } => self.distribution(distribution),
            // what it runs is not seen here
            Kind::Part { name, part, .. } => {
                self.is_static = false;
                self.visit_expr_mut(part);
                self.bind([name.clone()]);
            }
            Kind::Let { pat, init, .. } => {
                let derived = match init {
                    Some(Init::Value { value, diverge, .. }) => {
                        let derived = self.mentions(value);
                        self.is_static &= !(derived && diverge.is_some());
                        self.visit_expr_mut(value);
                        derived
                    }
                    Some(Init::Flow(_, flow)) => {
                        literals::align_arms(flow);
                        self.flow(flow);
                        true
                    }
                    None => false,
                };
                if derived {
                    self.bind(scan::bound_names(pat));
                }
            }
            Kind::Factor { weight, .. } => self.visit_expr_mut(weight),
            Kind::Flow(flow) => self.flow(flow),
            Kind::Rust(stmt) => self.visit_stmt_mut(stmt),
            Kind::End(_) | Kind::Broken { .. } => {}
        }
    }

    fn flow(&mut self, flow: &mut Flow) {
        match flow {
            Flow::For {
                pat, iter, body, leaves, unwinds, pools, summed, totals, linear, ..
            } => {
                let derived = self.mentions(iter);
                if derived {
                    self.is_static &= keeps_its_length(iter);
                }
                self.visit_expr_mut(iter);
                *pools = !derived && !is_consumed(iter) && is_pooled(pat, body);
                *unwinds = !*pools && !*leaves && !writes_outside(pat, iter, body);
                let outermost = *unwinds && self.plate.is_none();
                if outermost {
                    let bound = bound_inside(pat, body);
                    let outer = self.active.difference(&bound).cloned().collect();
                    self.plate = Some(Plate { outer, summed: BTreeSet::new() });
                }
                if derived {
                    self.bind(scan::bound_names(pat));
                }
                let around = self.totals.take();
                let is_first = around.is_none();
                self.totals = (!*pools).then(|| around.clone().unwrap_or_default());
                if *unwinds && !derived && !is_consumed(iter) {
                    *linear = self.linear(pat, body).map(Box::new);
                }
                self.block(body);
                if is_first {
                    totals.extend(self.totals.take().into_iter().flatten());
                } else {
                    self.totals = self.totals.take().or(around);
                }
                if outermost {
                    summed.extend(self.plate.take().into_iter().flat_map(|plate| plate.summed));
                }
            }
            Flow::If { condition, then, otherwise, .. } => {
                self.branch(condition, &scan::bound_by_condition(condition));
                self.block(then);
                if let Some((_, otherwise)) = otherwise {
                    self.flow(otherwise);
                }
            }
            Flow::Match { scrutinee, arms, .. } => {
                let names: Vec<_> =
                    arms.iter().flat_map(|arm| scan::bound_names(&arm.pat)).collect();
                self.branch(scrutinee, &names);
                for arm in arms {
                    if let Some((_, guard)) = &mut arm.guard {
                        self.branch(guard, &[]);
                    }
                    match &mut arm.body {
                        ArmBody::Block(block) => self.block(block),
                        ArmBody::Value(value) => self.visit_expr_mut(value),
                    }
                }
            }
            Flow::Block(block) => self.block(block),
        }
    }

    /// A condition, and the names that it binds.
    fn branch(&mut self, condition: &mut Expr, names: &[Ident]) {
        if self.mentions(condition) {
            self.is_static = false;
            self.bind(names.iter().cloned());
        }
        self.visit_expr_mut(condition);
    }

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

    pub(crate) fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.active.contains(name))
    }

    pub(crate) fn bind(&mut self, names: impl IntoIterator<Item = Ident>) {
        self.active.extend(names.into_iter().map(|name| name.to_string()));
    }

    /// Looks for what could make the statements that run depend on the point.
    fn check(&mut self, expr: &Expr) {
        let mut branches = Branches { active: &self.active, found: false };
        branches.visit_expr(expr);
        self.is_static &= !branches.found;
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
