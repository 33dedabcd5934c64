//! Which names may hold unknowns, or what follows from them: also those of variables and vectors that
//! begin as data and are changed later.

use std::collections::HashSet;

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Item, Local, Pat, Stmt};

use crate::ast::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::inspect::{is_comparison, mentions};
use crate::names::place;
use crate::rewrite::is_assignment;
use crate::scan;

/// Names in a body, wherever in it.
#[derive(Default)]
pub(crate) struct Derived {
    /// All that may hold unknowns.
    pub(crate) unknown: HashSet<String>,
    /// Those that are changed to something that does.
    pub(crate) assigned: HashSet<String>,
}

impl Derived {
    /// Of a body whose arguments `given` may hold unknowns.
    pub(crate) fn of(body: &Block, given: impl IntoIterator<Item = Ident>) -> Self {
        let mut derived = Self::default();
        derived.bind(given);
        derived.read(&body.statements);
        derived
    }

    /// The names that these statements change to something that may hold unknowns.
    pub(crate) fn assigned_in(&self, statements: &[Statement]) -> HashSet<String> {
        let mut inside = Self { unknown: self.unknown.clone(), assigned: HashSet::new() };
        inside.read(statements);
        inside.assigned
    }

    /// Reads until nothing new is found: what a loop changes is read at its begin too.
    fn read(&mut self, statements: &[Statement]) {
        loop {
            let before = (self.unknown.len(), self.assigned.len());
            self.statements(statements);
            if before == (self.unknown.len(), self.assigned.len()) {
                return;
            }
        }
    }

    fn bind(&mut self, names: impl IntoIterator<Item = Ident>) {
        self.unknown.extend(names.into_iter().map(|name| name.to_string()));
    }

    /// Whether an expression may hold unknowns.
    pub(crate) fn mentions(&self, expr: &Expr) -> bool {
        let mut asks = Asks { derived: self, found: false };
        asks.visit_expr(expr);
        asks.found
    }

    fn names(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.unknown.contains(name))
    }

    fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            match &statement.kind {
                Kind::Unknown { name, .. } | Kind::Part { name, .. } => self.bind([name.clone()]),
                Kind::Impute { place, .. } => self.bind(place_root(place)),
                Kind::Let { pat, init, .. } => match init {
                    Some(Init::Value { value, .. }) => self.value(pat, value),
                    Some(Init::Flow(_, flow)) => {
                        self.flow(flow);
                        self.bind(scan::bound_names(pat));
                    }
                    None => {}
                },
                Kind::Flow(flow) | Kind::End(Init::Flow(_, flow)) => self.flow(flow),
                Kind::Rust(stmt) => self.visit_stmt(stmt),
                Kind::End(Init::Value { value, .. }) => self.visit_expr(value),
                Kind::Observe { .. } | Kind::Factor { .. } | Kind::Broken { .. } => {}
            }
        }
    }

    fn value(&mut self, pat: &Pat, value: &Expr) {
        self.visit_expr(value);
        if self.mentions(value) {
            self.bind(scan::bound_names(pat));
        }
    }

    fn flow(&mut self, flow: &Flow) {
        match flow {
            Flow::For { pat, iter, body, .. } => {
                self.value(pat, iter);
                self.statements(&body.statements);
                self.changed_elements(pat, iter);
            }
            Flow::If { condition, then, otherwise, .. } => {
                if self.mentions(condition) {
                    self.bind(scan::bound_by_condition(condition));
                }
                self.statements(&then.statements);
                otherwise.iter().for_each(|(_, flow)| self.flow(flow));
            }
            Flow::Match { scrutinee, arms, .. } => {
                for arm in arms {
                    self.value(&arm.pat, scrutinee);
                    match &arm.body {
                        ArmBody::Block(block) => self.statements(&block.statements),
                        ArmBody::Value(value) => self.visit_expr(value),
                    }
                }
            }
            Flow::Block(block) => self.statements(&block.statements),
        }
    }

    fn assign(&mut self, roots: impl IntoIterator<Item = Ident>) {
        for root in roots {
            self.assigned.insert(root.to_string());
            self.bind([root]);
        }
    }

    /// `for x in xs.iter_mut() { *x = … }` changes `xs`.
    fn changed_elements(&mut self, pat: &Pat, iter: &Expr) {
        let changed = |name: &Ident| self.assigned.contains(&name.to_string());
        if scan::bound_names(pat).iter().any(changed) {
            self.assign(borrowed(iter));
        }
    }
}

fn place_root(expr: &Expr) -> Option<Ident> {
    place(expr).ok().map(|place| place.root)
}

impl<'a> Visit<'a> for Derived {
    fn visit_local(&mut self, local: &'a Local) {
        visit::visit_local(self, local);
        if local.init.as_ref().is_some_and(|init| self.mentions(&init.expr)) {
            self.bind(scan::bound_names(&local.pat));
        }
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        // what else would it be called for?
        if let Stmt::Expr(Expr::MethodCall(call), Some(_)) = stmt
            && call.args.iter().any(|argument| self.mentions(argument))
        {
            self.assign(place_root(&call.receiver));
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        visit::visit_expr(self, expr);
        match expr {
            Expr::Assign(assign) if self.mentions(&assign.right) => {
                self.assign(place_root(&assign.left));
            }
            Expr::Binary(binary) if is_assignment(&binary.op) && self.mentions(&binary.right) => {
                self.assign(place_root(&binary.left));
            }
            Expr::Call(_) if self.mentions(expr) => self.assign(borrowed(expr)),
            Expr::ForLoop(each) => {
                if self.mentions(&each.expr) {
                    self.bind(scan::bound_names(&each.pat));
                }
                self.changed_elements(&each.pat, &each.expr);
            }
            _ => {}
        }
    }

    // functions inside a model are functions of their own
    fn visit_item(&mut self, _: &'a Item) {}
}

/// Methods of unknowns, and of arrays of them, whose results are plain numbers.
const PLAIN: [&str; 4] = ["value", "len", "is_empty", "is_constant"];

/// Looks for unknowns that an expression holds and not just asks.
struct Asks<'a> {
    derived: &'a Derived,
    found: bool,
}

impl<'a> Visit<'a> for Asks<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        match expr {
            Expr::Cast(_) => {}
            Expr::MethodCall(call) if PLAIN.iter().any(|name| call.method == name) => {}
            Expr::Binary(binary) if is_comparison(&binary.op) => {}
            Expr::Path(_) | Expr::Verbatim(_) | Expr::Macro(_) => {
                self.found |= self.derived.names(expr);
            }
            _ => visit::visit_expr(self, expr),
        }
    }
}

/// What an expression borrows for change.
fn borrowed(expr: &Expr) -> Vec<Ident> {
    struct Borrowed(Vec<Ident>);
    impl<'a> Visit<'a> for Borrowed {
        fn visit_expr(&mut self, expr: &'a Expr) {
            match expr {
                Expr::Reference(reference) if reference.mutability.is_some() => {
                    self.0.extend(place_root(&reference.expr));
                }
                Expr::MethodCall(call) if call.method == "iter_mut" => {
                    self.0.extend(place_root(&call.receiver));
                }
                _ => {}
            }
            visit::visit_expr(self, expr);
        }
    }
    let mut borrowed = Borrowed(Vec::new());
    borrowed.visit_expr(expr);
    borrowed.0
}
