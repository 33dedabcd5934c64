//! What a loop may change outside, and which names it binds inside.

use std::collections::HashSet;

use syn::visit::Visit;
use syn::{Expr, Ident, Pat, Stmt};

use crate::ast::{ArmBody, Block, Flow, Init, Kind};
use crate::rewrite::is_assignment;
use crate::scan;

/// Whether a loop may change something that outlives an iteration: it assigns, or borrows for
/// change, a name that it has not declared as a variable.
pub(crate) fn writes_outside(pat: &Pat, iter: &Expr, body: &Block) -> bool {
    let mut own: HashSet<Ident> = scan::variables(pat).into_iter().collect();
    expr_writes_outside(iter, &HashSet::new()) || block_writes_outside(body, &mut own)
}

fn block_writes_outside(block: &Block, own: &mut HashSet<Ident>) -> bool {
    block.statements.iter().any(|statement| match &statement.kind {
        Kind::Let { pat, init, .. } => {
            let writes = match init {
                Some(Init::Value { value, diverge, .. }) => {
                    let other = diverge.iter().any(|(_, value)| expr_writes_outside(value, own));
                    other || expr_writes_outside(value, own)
                }
                Some(Init::Flow(_, flow)) => flow_writes_outside(flow, own),
                None => false,
            };
            own.extend(scan::variables(pat));
            writes
        }
        Kind::Rust(stmt) => {
            let mut writes = Writes { own, found: false };
            writes.visit_stmt(stmt);
            writes.found
        }
        Kind::Flow(flow) => flow_writes_outside(flow, own),
        Kind::Unknown { .. }
        | Kind::Part { .. }
        | Kind::Observe { .. }
        | Kind::Impute { .. }
        | Kind::Factor { .. }
        | Kind::End(_)
        | Kind::Broken { .. } => false,
    })
}

fn flow_writes_outside(flow: &Flow, own: &HashSet<Ident>) -> bool {
    let mut inner = own.clone();
    match flow {
        Flow::For { pat, iter, body, .. } => {
            inner.extend(scan::variables(pat));
            expr_writes_outside(iter, own) || block_writes_outside(body, &mut inner)
        }
        Flow::If { condition, then, otherwise, .. } => {
            expr_writes_outside(condition, own)
                || block_writes_outside(then, &mut inner)
                || otherwise.iter().any(|(_, flow)| flow_writes_outside(flow, own))
        }
        Flow::Match { scrutinee, arms, .. } => {
            expr_writes_outside(scrutinee, own)
                || arms.iter().any(|arm| {
                    let mut inner = own.clone();
                    inner.extend(scan::variables(&arm.pat));
                    match &arm.body {
                        ArmBody::Block(block) => block_writes_outside(block, &mut inner),
                        ArmBody::Value(value) => expr_writes_outside(value, &inner),
                    }
                })
        }
        Flow::Block(block) => block_writes_outside(block, &mut inner),
    }
}

fn expr_writes_outside(expr: &Expr, own: &HashSet<Ident>) -> bool {
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
        let root = crate::names::place(place).ok().map(|place| place.root);
        self.found |= root.is_none_or(|root| !self.own.contains(&root));
    }
}

impl<'a> Visit<'a> for Writes<'_> {
    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        self.found |= matches!(stmt, Stmt::Macro(_));
        if let Stmt::Expr(Expr::MethodCall(call), _) = stmt {
            self.target(&call.receiver);
        }
        self.found |= matches!(stmt, Stmt::Expr(Expr::Call(_), _));
        syn::visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Assign(assign) => self.target(&assign.left),
            Expr::Binary(binary) if is_assignment(&binary.op) => self.target(&binary.left),
            Expr::Reference(reference) if reference.mutability.is_some() => {
                self.target(&reference.expr);
            }
            Expr::MethodCall(call) if changes(&call.method) => self.target(&call.receiver),
            Expr::Macro(_) => self.found = true,
            _ => {}
        }
        syn::visit::visit_expr(self, expr);
    }
}

/// The names that the body of a loop binds, wherever in it.
pub(crate) fn bound_inside(pat: &Pat, body: &Block) -> HashSet<String> {
    let mut names = Bound(scan::bound_names(pat).iter().map(Ident::to_string).collect());
    names.block(body);
    names.0
}

struct Bound(HashSet<String>);

impl Bound {
    fn bind(&mut self, names: &[Ident]) {
        self.0.extend(names.iter().map(Ident::to_string));
    }

    fn block(&mut self, block: &Block) {
        for statement in &block.statements {
            match &statement.kind {
                Kind::Unknown { name, .. } | Kind::Part { name, .. } => {
                    self.bind(std::slice::from_ref(name));
                }
                Kind::Let { pat, init, .. } => {
                    self.bind(&scan::bound_names(pat));
                    if let Some(Init::Flow(_, flow)) = init {
                        self.flow(flow);
                    }
                }
                Kind::Impute { place: Expr::Path(place), .. } => {
                    self.0.extend(place.path.get_ident().map(Ident::to_string));
                }
                Kind::Rust(Stmt::Local(local)) => self.bind(&scan::bound_names(&local.pat)),
                Kind::Flow(flow) => self.flow(flow),
                _ => {}
            }
        }
    }

    fn flow(&mut self, flow: &Flow) {
        match flow {
            Flow::For { pat, body, .. } => {
                self.bind(&scan::bound_names(pat));
                self.block(body);
            }
            Flow::If { condition, then, otherwise, .. } => {
                self.bind(&scan::bound_by_condition(condition));
                self.block(then);
                otherwise.iter().for_each(|(_, flow)| self.flow(flow));
            }
            Flow::Match { arms, .. } => {
                for arm in arms {
                    self.bind(&scan::bound_names(&arm.pat));
                    if let ArmBody::Block(block) = &arm.body {
                        self.block(block);
                    }
                }
            }
            Flow::Block(block) => self.block(block),
        }
    }
}
