//! Activity: which names may hold unknowns, or what follows from them; also those of variables and
//! vectors that begin as data and are changed later.

use std::collections::HashSet;

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Item, Local, Pat, Stmt};

use crate::ast::{ArmBody, Block, Flow, Id, Init, Kind, Statement};
use crate::syntax::expressions::{is_assignment, is_comparison};
use crate::syntax::patterns::{bound_by_condition, bound_names};
use crate::syntax::places::root;
use crate::syntax::tokens::mentions;

/// The active names of a body, wherever in it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Activity {
    /// All that may hold unknowns.
    active: HashSet<Ident>,
    /// Those that are changed to something that does.
    changed: HashSet<Ident>,
    /// Those that are changed so by `=` and its kind.
    assigned: HashSet<Ident>,
    /// Declarations whose names are changed so by what follows in their block.
    begins: HashSet<Id>,
    /// Those whose names are assigned so.
    overwritten: HashSet<Id>,
}

impl Activity {
    /// Of a body whose arguments `given` may hold unknowns.
    pub(crate) fn of(body: &Block, given: impl IntoIterator<Item = Ident>) -> Self {
        let mut activity = Self::default();
        activity.active.extend(given);
        activity.read(&body.statements);
        activity.find_begins(body);
        activity
    }

    /// All names that may hold unknowns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &Ident> {
        self.active.iter()
    }

    /// Whether a name may hold unknowns.
    fn is_active(&self, name: &Ident) -> bool {
        self.active.contains(name)
    }

    /// Whether Rust mentions a name that may hold unknowns.
    pub(crate) fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.is_active(name))
    }

    /// Whether the value of an expression may hold unknowns.
    pub(crate) fn holds(&self, expr: &Expr) -> bool {
        holds(expr, &|name| self.is_active(name))
    }

    /// Whether a name is changed to something that may hold unknowns.
    pub(crate) fn is_changed(&self, name: &Ident) -> bool {
        self.changed.contains(name)
    }

    /// Whether the name that a statement declares is changed so by what follows in its block.
    pub(crate) fn begins(&self, statement: Id) -> bool {
        self.begins.contains(&statement)
    }

    /// Whether it is assigned so.
    pub(crate) fn is_overwritten(&self, statement: Id) -> bool {
        self.overwritten.contains(&statement)
    }

    /// Which declarations begin what is changed after them.
    fn find_begins(&mut self, body: &Block) {
        for block in body.nested() {
            for (i, statement) in block.statements.iter().enumerate() {
                let Kind::Let { pat: Pat::Ident(pat), .. } = &statement.kind else { continue };
                if !self.is_changed(&pat.ident) {
                    continue;
                }
                let mut after = Self { active: self.active.clone(), ..Self::default() };
                after.read(&block.statements[i + 1..]);
                if after.changed.contains(&pat.ident) {
                    self.begins.insert(statement.id);
                }
                if after.assigned.contains(&pat.ident) {
                    self.overwritten.insert(statement.id);
                }
            }
        }
    }

    /// Reads until nothing new is found: what a loop changes is read at its begin too.
    fn read(&mut self, statements: &[Statement]) {
        loop {
            let before = (self.active.len(), self.changed.len(), self.assigned.len());
            self.statements(statements);
            if before == (self.active.len(), self.changed.len(), self.assigned.len()) {
                return;
            }
        }
    }

    fn statements(&mut self, statements: &[Statement]) {
        for statement in statements {
            match &statement.kind {
                Kind::Unknown { name, .. } | Kind::Part { name, .. } => {
                    self.active.insert(name.clone());
                }
                Kind::Impute { place, .. } => self.active.extend(root(place)),
                Kind::Let { pat, init, .. } => match init {
                    Some(Init::Value { value, .. }) => self.value(pat, value),
                    Some(Init::Flow(_, flow)) => {
                        self.flow(flow);
                        self.active.extend(bound_names(pat));
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
        if self.holds(value) {
            self.active.extend(bound_names(pat));
        }
    }

    fn flow(&mut self, flow: &Flow) {
        match flow {
            Flow::For(plate) => {
                self.value(&plate.pat, &plate.iter);
                self.statements(&plate.body.statements);
                self.changed_elements(&plate.pat, &plate.iter);
            }
            Flow::If { condition, then, otherwise, .. } => {
                if self.holds(condition) {
                    self.active.extend(bound_by_condition(condition));
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

    fn change(&mut self, names: impl IntoIterator<Item = Ident>) {
        for name in names {
            self.changed.insert(name.clone());
            self.active.insert(name);
        }
    }

    fn assign(&mut self, place: &Expr) {
        self.assigned.extend(root(place));
        self.change(root(place));
    }

    /// `for x in xs.iter_mut() { *x = … }` changes `xs`.
    fn changed_elements(&mut self, pat: &Pat, iter: &Expr) {
        if bound_names(pat).iter().any(|name| self.is_changed(name)) {
            self.change(borrowed(iter));
        }
    }
}

impl<'a> Visit<'a> for Activity {
    fn visit_local(&mut self, local: &'a Local) {
        visit::visit_local(self, local);
        if local.init.as_ref().is_some_and(|init| self.holds(&init.expr)) {
            self.active.extend(bound_names(&local.pat));
        }
    }

    fn visit_stmt(&mut self, stmt: &'a Stmt) {
        // what else would it be called for?
        if let Stmt::Expr(Expr::MethodCall(call), Some(_)) = stmt
            && call.args.iter().any(|argument| self.holds(argument))
        {
            self.change(root(&call.receiver));
        }
        visit::visit_stmt(self, stmt);
    }

    fn visit_expr(&mut self, expr: &'a Expr) {
        visit::visit_expr(self, expr);
        match expr {
            Expr::Assign(assign) if self.holds(&assign.right) => self.assign(&assign.left),
            Expr::Binary(binary) if is_assignment(&binary.op) && self.holds(&binary.right) => {
                self.assign(&binary.left);
            }
            Expr::Call(_) if self.holds(expr) => self.change(borrowed(expr)),
            Expr::ForLoop(each) => {
                if self.holds(&each.expr) {
                    self.active.extend(bound_names(&each.pat));
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

/// Whether the value of an expression may hold what these names hold, and is not just asked of it.
pub(crate) fn holds(expr: &Expr, active: &impl Fn(&Ident) -> bool) -> bool {
    struct Holds<'f, F>(&'f F, bool);
    impl<'a, F: Fn(&Ident) -> bool> Visit<'a> for Holds<'_, F> {
        fn visit_expr(&mut self, expr: &'a Expr) {
            match expr {
                Expr::Cast(_) => {}
                Expr::MethodCall(call) if PLAIN.iter().any(|name| call.method == name) => {}
                Expr::Binary(binary) if is_comparison(&binary.op) => {}
                Expr::Path(_) | Expr::Macro(_) => {
                    self.1 |= mentions(expr.to_token_stream(), self.0);
                }
                _ => visit::visit_expr(self, expr),
            }
        }
    }
    let mut asks = Holds(active, false);
    asks.visit_expr(expr);
    asks.1
}

/// What an expression borrows for change.
fn borrowed(expr: &Expr) -> Vec<Ident> {
    struct Borrowed(Vec<Ident>);
    impl<'a> Visit<'a> for Borrowed {
        fn visit_expr(&mut self, expr: &'a Expr) {
            match expr {
                Expr::Reference(reference) if reference.mutability.is_some() => {
                    self.0.extend(root(&reference.expr));
                }
                Expr::MethodCall(call) if call.method == "iter_mut" => {
                    self.0.extend(root(&call.receiver));
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
