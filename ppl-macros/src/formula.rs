//! Arithmetic on unknowns becomes formulas that are differentiated as a whole, and loops say
//! where what an iteration computed is no longer needed.
//!
//! `a + b * x` is written as `operand(a) + operand(b) * x`: the operands decide by their types
//! whether there is anything to differentiate, so that this pass may take a name for an unknown
//! that is none. As a parameter of a distribution a formula stays open, everywhere else it is
//! closed to a number.

use std::collections::{BTreeSet, HashSet};

use quote::ToTokens;
use syn::visit::Visit;
use syn::visit_mut::VisitMut;
use syn::{Expr, Ident};

use crate::arithmetic::operand;
use crate::ast::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::derived::Derived;
use crate::effects::{bound_inside, writes_outside};
use crate::inspect::{
    Branches, is_consumed, is_only_recorded, is_pooled, keeps_its_length, mentions, only_rejects,
    stays_open,
};
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
        unread: false,
    };
    pass.block(body);
    pass.is_static
}

pub(crate) struct Formulas {
    /// Names that may hold unknowns or what follows from them.
    pub(crate) active: HashSet<String>,
    /// As far as the whole body tells.
    pub(crate) derived: Derived,
    is_static: bool,
    /// Loops that have become sums.
    pub(crate) sums: usize,
    /// Variables of such loops around.
    pub(crate) inner: Vec<Ident>,
    /// The plate around, if adjoints of what is outside can be summed up apart.
    pub(crate) plate: Option<Plate>,
    /// The observations in the loop around, by their sites.
    totals: Option<Vec<usize>>,
    /// Whether the statement is one that results record, which nobody differentiates.
    pub(crate) recorded: bool,
    /// Whether no density depends on the statement: a prediction, or what is recorded and no more.
    unread: bool,
}

/// Names from outside that a plate does not change.
pub(crate) struct Plate {
    pub(crate) outer: HashSet<String>,
    /// Those that are parameters of densities in it.
    pub(crate) summed: BTreeSet<Ident>,
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
            self.unread = statement.predicted || is_only_recorded(statement, after);
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
                self.vary();
                self.visit_expr_mut(part);
                self.bind([name.clone()]);
            }
            Kind::Let { pat, init, .. } => {
                let derived = match init {
                    Some(Init::Value { value, diverge, .. }) => {
                        let derived = self.mentions(value);
                        if derived && diverge.is_some() {
                            self.vary();
                        }
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
                if derived && !keeps_its_length(iter) {
                    self.vary();
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
                // behind what only rejects all is as it was
                let before = self.unread;
                self.unread |= otherwise.is_none() && only_rejects(then);
                self.branch(condition, &scan::bound_by_condition(condition));
                self.unread = before;
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
            self.vary();
            self.bind(names.iter().cloned());
        }
        self.visit_expr_mut(condition);
    }

    pub(crate) fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.active.contains(name))
    }

    pub(crate) fn bind(&mut self, names: impl IntoIterator<Item = Ident>) {
        self.active.extend(names.into_iter().map(|name| name.to_string()));
    }

    /// Looks for what could make the statements that run depend on the point.
    pub(crate) fn check(&mut self, expr: &Expr) {
        let mut branches = Branches { active: &self.active, found: false };
        branches.visit_expr(expr);
        if branches.found {
            self.vary();
        }
    }

    /// The statements that run, or their constants, may depend on the point.
    fn vary(&mut self) {
        self.is_static &= self.unread;
    }
}
