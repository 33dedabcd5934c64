//! Activity: which names may hold unknowns, or what follows from them; also those of variables and
//! vectors that begin as data and are changed later.

use std::collections::{HashMap, HashSet};

use quote::ToTokens;
use syn::visit::{self, Visit};
use syn::{Expr, Ident, Item, Local, Pat, Stmt};

use crate::ast::{Block, Id, Init, Kind, Left, Statement};
use crate::syntax::expressions::{is_assignment, is_comparison};
use crate::syntax::patterns::{bindings, bound_names};
use crate::syntax::places::root;
use crate::syntax::tokens::mentions;
use crate::walk::{self, Walk};

/// The active names of a body, wherever in it.
#[derive(Default)]
pub(crate) struct Activity {
    /// All that may hold unknowns.
    active: HashSet<Ident>,
    /// Those that are changed to something that does.
    changed: HashSet<Ident>,
    /// Those that are changed so by `=` and its kind.
    assigned: HashSet<Ident>,
    /// Declarations whose names are changed so by what follows in their block, and whether by `=` and
    /// its kind.
    begins: HashMap<Id, bool>,
}

impl Activity {
    /// Of a body whose arguments `given` may hold unknowns.
    pub(crate) fn of(body: &Block, given: impl IntoIterator<Item = Ident>) -> Self {
        let mut activity = Self::default();
        activity.active.extend(given);
        activity.read(&body.statements);
        let mut begins = Begins { activity: &activity, found: HashMap::new() };
        begins.block(body);
        activity.begins = begins.found;
        activity
    }

    /// All names that may hold unknowns.
    pub(crate) fn names(&self) -> impl Iterator<Item = &Ident> {
        self.active.iter()
    }

    /// Whether Rust mentions a name that may hold unknowns.
    pub(crate) fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.active.contains(name))
    }

    /// Whether the value of an expression may hold unknowns.
    pub(crate) fn holds(&self, expr: &Expr) -> bool {
        holds(expr, &|name| self.active.contains(name))
    }

    /// Whether a name is changed to something that may hold unknowns.
    pub(crate) fn is_changed(&self, name: &Ident) -> bool {
        self.changed.contains(name)
    }

    /// Whether the name that a statement declares is changed so by what follows in its block.
    pub(crate) fn begins(&self, statement: Id) -> bool {
        self.begins.contains_key(&statement)
    }

    /// Whether it is assigned so.
    pub(crate) fn is_overwritten(&self, statement: Id) -> bool {
        self.begins.get(&statement) == Some(&true)
    }

    /// Reads until nothing new is found: what a loop changes is read at its begin too.
    fn read(&mut self, statements: &[Statement]) {
        loop {
            let before = (self.active.len(), self.changed.len(), self.assigned.len());
            statements.iter().for_each(|statement| self.statement(statement));
            if before == (self.active.len(), self.changed.len(), self.assigned.len()) {
                return;
            }
        }
    }

    fn derive(&mut self, pat: &Pat, value: &Expr) {
        if self.holds(value) {
            self.active.extend(bound_names(pat));
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

impl<'a> Walk<'a> for Activity {
    fn statement(&mut self, statement: &'a Statement) {
        match &statement.kind {
            Kind::Tilde { left: Left::Unknown(_, name) | Left::Part(_, name), .. } => {
                self.active.insert(name.clone());
            }
            Kind::Tilde { left: Left::Missing(place), .. } => self.active.extend(root(place)),
            Kind::Let { pat, init: Some(Init::Flow(..)), .. } => {
                self.active.extend(bound_names(pat));
            }
            _ => {}
        }
        walk::statement(self, statement);
        if let Kind::For(plate) = &statement.kind {
            self.changed_elements(&plate.pat, &plate.iter);
        }
    }

    fn bind(&mut self, pat: &'a Pat, value: &'a Expr) {
        self.derive(pat, value);
    }
}

impl<'a> Visit<'a> for Activity {
    fn visit_local(&mut self, local: &'a Local) {
        visit::visit_local(self, local);
        local.init.iter().for_each(|init| self.derive(&local.pat, &init.expr));
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
        bindings(expr).into_iter().for_each(|(pat, value)| self.derive(pat, value));
        match expr {
            Expr::Assign(assign) if self.holds(&assign.right) => self.assign(&assign.left),
            Expr::Binary(binary) if is_assignment(&binary.op) && self.holds(&binary.right) => {
                self.assign(&binary.left);
            }
            Expr::Call(_) if self.holds(expr) => self.change(borrowed(expr)),
            Expr::ForLoop(each) => self.changed_elements(&each.pat, &each.expr),
            _ => {}
        }
    }

    // functions inside a model are functions of their own
    fn visit_item(&mut self, _: &'a Item) {}
}

/// Finds which declarations begin what is changed after them.
struct Begins<'a> {
    activity: &'a Activity,
    found: HashMap<Id, bool>,
}

impl<'a> Walk<'a> for Begins<'_> {
    fn block(&mut self, block: &'a Block) {
        for (i, statement) in block.statements.iter().enumerate() {
            if let Kind::Let { pat: Pat::Ident(pat), .. } = &statement.kind
                && self.activity.is_changed(&pat.ident)
            {
                let mut after =
                    Activity { active: self.activity.active.clone(), ..Activity::default() };
                after.read(&block.statements[i + 1..]);
                if after.is_changed(&pat.ident) {
                    self.found.insert(statement.id, after.assigned.contains(&pat.ident));
                }
            }
        }
        walk::block(self, block);
    }
}

impl<'a> Visit<'a> for Begins<'_> {}

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
