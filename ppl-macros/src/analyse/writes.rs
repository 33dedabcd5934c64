//! What a loop may change outside, and which names it binds inside.

use std::collections::HashSet;

use syn::visit::{self, Visit};
use syn::{Expr, Ident, Lifetime, Stmt};

use crate::ast::{ArmBody, Block, Flow, For, Init, Kind};
use crate::syntax::expressions::is_assignment;
use crate::syntax::patterns::{bound_by_condition, bound_names, variables};
use crate::syntax::places::root;

/// Whether a loop may change something that outlives an iteration: it assigns, or borrows for
/// change, a name that it has not declared as a variable.
pub(crate) fn writes_outside(plate: &For) -> bool {
    let mut own: HashSet<Ident> = variables(&plate.pat).into_iter().collect();
    in_expr(&plate.iter, &HashSet::new()) || in_block(&plate.body, &mut own)
}

fn in_block(block: &Block, own: &mut HashSet<Ident>) -> bool {
    block.statements.iter().any(|statement| match &statement.kind {
        Kind::Let { pat, init, .. } => {
            let writes = match init {
                Some(Init::Value { value, diverge, .. }) => {
                    let other = diverge.iter().any(|(_, value)| in_expr(value, own));
                    other || in_expr(value, own)
                }
                Some(Init::Flow(_, flow)) => in_flow(flow, own),
                None => false,
            };
            own.extend(variables(pat));
            writes
        }
        Kind::Rust(stmt) => {
            let mut writes = Writes { own, found: false };
            writes.visit_stmt(stmt);
            writes.found
        }
        Kind::Flow(flow) => in_flow(flow, own),
        Kind::Unknown { .. }
        | Kind::Part { .. }
        | Kind::Observe { .. }
        | Kind::Impute { .. }
        | Kind::Factor { .. }
        | Kind::End(_)
        | Kind::Broken { .. } => false,
    })
}

fn in_flow(flow: &Flow, own: &HashSet<Ident>) -> bool {
    let mut inner = own.clone();
    match flow {
        Flow::For(plate) => {
            inner.extend(variables(&plate.pat));
            in_expr(&plate.iter, own) || in_block(&plate.body, &mut inner)
        }
        Flow::If { condition, then, otherwise, .. } => {
            in_expr(condition, own)
                || in_block(then, &mut inner)
                || otherwise.iter().any(|(_, flow)| in_flow(flow, own))
        }
        Flow::Match { scrutinee, arms, .. } => {
            in_expr(scrutinee, own)
                || arms.iter().any(|arm| {
                    let mut inner = own.clone();
                    inner.extend(variables(&arm.pat));
                    match &arm.body {
                        ArmBody::Block(block) => in_block(block, &mut inner),
                        ArmBody::Value(value) => in_expr(value, &inner),
                    }
                })
        }
        Flow::Block(block) => in_block(block, &mut inner),
    }
}

fn in_expr(expr: &Expr, own: &HashSet<Ident>) -> bool {
    let mut writes = Writes { own, found: false };
    writes.visit_expr(expr);
    writes.found
}

/// Assignments, borrows for change, macros, methods called as statements, which have no other
/// purpose, and those that say what they are for, as `iter_mut` and `get_mut`.
struct Writes<'a> {
    own: &'a HashSet<Ident>,
    found: bool,
}

/// Whether a method with a result may leave something behind too.
fn changes(method: &Ident) -> bool {
    method.to_string().ends_with("_mut") || method == "insert" || method == "replace"
}

impl Writes<'_> {
    fn target(&mut self, place: &Expr) {
        self.found |= root(place).is_none_or(|root| !self.own.contains(&root));
    }
}

impl<'a> Visit<'a> for Writes<'_> {
    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        match stmt {
            // what is rejected leaves nothing behind
            Stmt::Macro(call) if call.mac.path.is_ident("reject") => {}
            Stmt::Macro(_) | Stmt::Expr(Expr::Call(_), _) => self.found = true,
            Stmt::Expr(Expr::MethodCall(call), _) => self.target(&call.receiver),
            _ => {}
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Assign(assign) => self.target(&assign.left),
            Expr::Binary(binary) if is_assignment(&binary.op) => self.target(&binary.left),
            Expr::Reference(reference) if reference.mutability.is_some() => {
                self.target(&reference.expr);
            }
            Expr::MethodCall(call) if changes(&call.method) => self.target(&call.receiver),
            Expr::Macro(call) => self.found |= !call.mac.path.is_ident("reject"),
            _ => {}
        }
        visit::visit_expr(self, expr);
    }
}

/// The names that the body of a loop binds, and the labels that its jumps go to.
pub(crate) struct Inside {
    pub(crate) bound: HashSet<Ident>,
    /// Labels of loops, its own too.
    known: HashSet<Ident>,
    targets: HashSet<Ident>,
}

impl Inside {
    pub(crate) fn of(plate: &For) -> Self {
        let none = HashSet::new;
        let mut inside = Self { bound: none(), known: none(), targets: none() };
        inside.plate(plate);
        inside
    }

    /// Whether a jump goes on in a loop around this one.
    pub(crate) fn jumps_out(&self) -> bool {
        !self.targets.is_subset(&self.known)
    }

    fn plate(&mut self, plate: &For) {
        self.known.extend(plate.label.as_ref().map(|label| label.name.ident.clone()));
        self.bound.extend(bound_names(&plate.pat));
        self.visit_expr(&plate.iter);
        self.block(&plate.body);
    }

    fn block(&mut self, block: &Block) {
        for statement in &block.statements {
            match &statement.kind {
                Kind::Unknown { name, .. } | Kind::Part { name, .. } => {
                    self.bound.insert(name.clone());
                }
                Kind::Let { pat, init, .. } => {
                    self.bound.extend(bound_names(pat));
                    self.init(init.as_ref());
                }
                Kind::Impute { place: Expr::Path(place), .. } => {
                    self.bound.extend(place.path.get_ident().cloned());
                }
                Kind::Rust(stmt) => {
                    if let Stmt::Local(local) = stmt {
                        self.bound.extend(bound_names(&local.pat));
                    }
                    self.visit_stmt(stmt);
                }
                Kind::Flow(flow) => self.flow(flow),
                Kind::End(init) => self.init(Some(init)),
                Kind::Observe { .. }
                | Kind::Impute { .. }
                | Kind::Factor { .. }
                | Kind::Broken { .. } => {}
            }
        }
    }

    fn init(&mut self, init: Option<&Init>) {
        match init {
            Some(Init::Value { value, diverge, .. }) => {
                self.visit_expr(value);
                diverge.iter().for_each(|(_, value)| self.visit_expr(value));
            }
            Some(Init::Flow(_, flow)) => self.flow(flow),
            None => {}
        }
    }

    fn flow(&mut self, flow: &Flow) {
        match flow {
            Flow::For(plate) => self.plate(plate),
            Flow::If { condition, then, otherwise, .. } => {
                self.bound.extend(bound_by_condition(condition));
                self.block(then);
                otherwise.iter().for_each(|(_, flow)| self.flow(flow));
            }
            Flow::Match { arms, .. } => {
                for arm in arms {
                    self.bound.extend(bound_names(&arm.pat));
                    match &arm.body {
                        ArmBody::Block(block) => self.block(block),
                        ArmBody::Value(value) => self.visit_expr(value),
                    }
                }
            }
            Flow::Block(block) => self.block(block),
        }
    }

    fn target(&mut self, label: Option<&Lifetime>) {
        self.targets.extend(label.map(|label| label.ident.clone()));
    }
}

impl<'a> Visit<'a> for Inside {
    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Break(jump) => self.target(jump.label.as_ref()),
            Expr::Continue(jump) => self.target(jump.label.as_ref()),
            _ => {}
        }
        visit::visit_expr(self, expr);
    }

    fn visit_label(&mut self, label: &'a syn::Label) {
        self.known.insert(label.name.ident.clone());
    }
}
