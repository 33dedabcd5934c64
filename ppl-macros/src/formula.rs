//! Arithmetic on unknowns becomes formulas that are differentiated as a whole, and loops say
//! where what an iteration computed is no longer needed.
//!
//! `a + b * x` is written as `operand(a) + operand(b) * x`: the operands decide by their types
//! whether there is anything to differentiate, so that this pass may take a name for an unknown
//! that is none. As a parameter of a distribution a formula stays open, everywhere else it is
//! closed to a number.

use std::collections::HashSet;

use proc_macro2::{Span, TokenStream, TokenTree};
use quote::{ToTokens, quote_spanned};
use syn::spanned::Spanned;
use syn::visit::Visit;
use syn::visit_mut::{self, VisitMut};
use syn::{BinOp, Expr, ExprAssign, ExprBinary, ExprMethodCall, Ident, Item, Pat, Stmt, UnOp};

use crate::parse::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::rewrite::is_assignment;
use crate::scan;

/// Rewrites the body; whether every point runs the same statements.
pub(crate) fn formulas(body: &mut Block) -> bool {
    let mut pass = Formulas { active: HashSet::new(), is_static: true };
    pass.block(body);
    pass.is_static
}

struct Formulas {
    /// Names that may hold unknowns or what follows from them.
    active: HashSet<String>,
    is_static: bool,
}

/// The functions of `ppl::Scalar` that formulas have.
const FUNCTIONS: [&str; 16] = [
    "exp", "exp_m1", "ln", "ln_1p", "sqrt", "square", "recip", "powi", "powf", "pow", "sin", "cos",
    "tanh", "abs", "logistic", "softplus",
];

/// What a plate may do with unknowns on the way in without its length depending on them.
const ITERATION: [&str; 7] = ["iter", "into_iter", "zip", "enumerate", "rev", "len", "copied"];

impl Formulas {
    fn block(&mut self, block: &mut Block) {
        for i in 0..block.statements.len() {
            let (before, after) = block.statements.split_at_mut(i + 1);
            let kind = &mut before[i].kind;
            if !self.leave_open(kind, after) {
                self.statement(kind);
            }
        }
    }

    /// A deterministic number that is used once, as a parameter of an observation that follows,
    /// stays a formula: nothing has to be kept for it.
    fn leave_open(&mut self, kind: &mut Kind, after: &[Statement]) -> bool {
        let Kind::Let { pat: Pat::Ident(pat), init, .. } = kind else { return false };
        let Some(Init::Value { value, diverge: None, .. }) = init else { return false };
        let name = pat.ident.clone();
        if pat.mutability.is_some()
            || operations(value) == 0
            || !self.mentions(value)
            || !used_once(&name, after)
        {
            return false;
        }
        self.check(value);
        self.open(value);
        self.bind([name]);
        true
    }

    fn statement(&mut self, kind: &mut Kind) {
        match kind {
            Kind::Unknown { name, distribution, .. } => {
                self.distribution(distribution);
                self.bind([name.clone()]);
            }
            Kind::Observe { distribution, .. } | Kind::Impute { distribution, .. } => {
                self.distribution(distribution);
            }
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
            Flow::For { pat, iter, body, unwinds, pools, .. } => {
                let derived = self.mentions(iter);
                if derived {
                    self.is_static &= keeps_its_length(iter);
                    self.bind(scan::bound_names(pat));
                }
                self.visit_expr_mut(iter);
                self.block(body);
                *pools = !derived && is_pooled(pat, body);
                *unwinds = !*pools && !writes_outside(pat, body);
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
    fn distribution(&mut self, distribution: &mut Expr) {
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
                    } else {
                        self.visit_expr_mut(argument);
                    }
                }
            }
            other => self.visit_expr_mut(other),
        }
    }

    /// Writes arithmetic over operands.
    fn open(&mut self, expr: &mut Expr) {
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
                visit_mut::visit_expr_mut(self, other);
                *other = operand(other);
            }
        }
    }

    fn mentions(&self, tokens: &impl ToTokens) -> bool {
        mentions(tokens.to_token_stream(), &|name| self.active.contains(name))
    }

    fn bind(&mut self, names: impl IntoIterator<Item = Ident>) {
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
        self.check(expr);
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
        if operations(expr) > 1 && self.mentions(expr) {
            let span = expr.span();
            self.open(expr);
            *expr = closed(expr, span);
        } else {
            visit_mut::visit_expr_mut(self, expr);
        }
    }

    fn visit_stmt_mut(&mut self, stmt: &mut Stmt) {
        if let Stmt::Local(local) = stmt
            && let Some(init) = &local.init
            && self.mentions(&init.expr)
        {
            self.bind(scan::bound_names(&local.pat));
        }
        visit_mut::visit_stmt_mut(self, stmt);
    }

    // functions inside a model are functions of their own
    fn visit_item_mut(&mut self, _: &mut Item) {}
}

/// Whether the body is `y ~ D` alone, with `y` the loop's own and not in `D`.
fn is_pooled(pat: &Pat, body: &Block) -> bool {
    let Pat::Ident(pat) = pat else { return false };
    let [statement] = body.statements.as_slice() else { return false };
    let Kind::Observe { place: Expr::Path(place), distribution, .. } = &statement.kind else {
        return false;
    };
    let asked = |found: &str| pat.ident == found;
    let tokens = distribution.to_token_stream();
    // a distribution that can leave the model has to be asked for every datum
    place.path.is_ident(&pat.ident)
        && !mentions(tokens.clone(), &asked)
        && !tokens.to_string().contains('?')
}

/// Whether all that follows in the block is observations, of which one uses the name once.
fn used_once(name: &Ident, after: &[Statement]) -> bool {
    let mut uses = 0;
    for statement in after {
        let Kind::Observe { place, distribution, .. } = &statement.kind else { return false };
        if mentions(place.to_token_stream(), &|found| name == found) {
            return false;
        }
        uses += count(distribution.to_token_stream(), name);
    }
    uses == 1
}

fn count(tokens: TokenStream, name: &Ident) -> usize {
    let of = |tree| match tree {
        TokenTree::Ident(found) => usize::from(found == *name),
        TokenTree::Group(group) => count(group.stream(), name),
        _ => 0,
    };
    tokens.into_iter().map(of).sum()
}

/// Whether a stream has an identifier that is asked for.
fn mentions(tokens: TokenStream, asked: &impl Fn(&str) -> bool) -> bool {
    tokens.into_iter().any(|tree| match tree {
        TokenTree::Ident(name) => asked(&name.to_string()),
        TokenTree::Group(group) => mentions(group.stream(), asked),
        _ => false,
    })
}

/// Control flow, comparisons and plain values inside expressions.
struct Branches<'a> {
    active: &'a HashSet<String>,
    found: bool,
}

impl<'a> Visit<'a> for Branches<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        let decides = match expr {
            Expr::If(_) | Expr::Match(_) | Expr::While(_) | Expr::Loop(_) | Expr::ForLoop(_) => {
                true
            }
            Expr::Binary(binary) => is_comparison(&binary.op),
            Expr::MethodCall(call) => call.method == "value",
            Expr::Path(path) => path.path.segments.last().is_some_and(|s| s.ident == "value"),
            _ => false,
        };
        self.found |= decides
            && mentions(expr.to_token_stream(), &|name| {
                name == "value" || self.active.contains(name)
            });
        syn::visit::visit_expr(self, expr);
    }
}

/// Whether an iterator over unknowns runs over all of them.
fn keeps_its_length(iter: &Expr) -> bool {
    match iter {
        Expr::Path(_) | Expr::Field(_) | Expr::Lit(_) | Expr::Index(_) => true,
        Expr::Reference(reference) => keeps_its_length(&reference.expr),
        Expr::Paren(paren) => keeps_its_length(&paren.expr),
        Expr::Range(range) => range.start.iter().chain(&range.end).all(|end| keeps_its_length(end)),
        Expr::MethodCall(call) => {
            ITERATION.iter().any(|name| call.method == name)
                && keeps_its_length(&call.receiver)
                && call.args.iter().all(keeps_its_length)
        }
        _ => false,
    }
}

/// Whether the body of a loop may change something that outlives an iteration: it assigns, or
/// borrows for change, a name that it has not declared.
fn writes_outside(pat: &Pat, body: &Block) -> bool {
    let mut own: HashSet<Ident> = scan::bound_names(pat).into_iter().collect();
    block_writes_outside(body, &mut own)
}

fn block_writes_outside(block: &Block, own: &mut HashSet<Ident>) -> bool {
    block.statements.iter().any(|statement| match &statement.kind {
        Kind::Unknown { name, .. } | Kind::Part { name, .. } => {
            own.insert(name.clone());
            false
        }
        Kind::Let { pat, init, .. } => {
            let writes = match init {
                Some(Init::Value { value, diverge, .. }) => {
                    let other = diverge.iter().any(|(_, value)| expr_writes_outside(value, own));
                    other || expr_writes_outside(value, own)
                }
                Some(Init::Flow(_, flow)) => flow_writes_outside(flow, own),
                None => false,
            };
            own.extend(scan::bound_names(pat));
            writes
        }
        Kind::Rust(stmt) => {
            let mut writes = Writes { own, found: false };
            writes.visit_stmt(stmt);
            writes.found
        }
        Kind::Flow(flow) => flow_writes_outside(flow, own),
        Kind::Observe { .. }
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
            inner.extend(scan::bound_names(pat));
            expr_writes_outside(iter, own) || block_writes_outside(body, &mut inner)
        }
        Flow::If { condition, then, otherwise, .. } => {
            inner.extend(scan::bound_by_condition(condition));
            expr_writes_outside(condition, own)
                || block_writes_outside(then, &mut inner)
                || otherwise.iter().any(|(_, flow)| flow_writes_outside(flow, own))
        }
        Flow::Match { scrutinee, arms, .. } => {
            expr_writes_outside(scrutinee, own)
                || arms.iter().any(|arm| {
                    let mut inner = own.clone();
                    inner.extend(scan::bound_names(&arm.pat));
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

/// Assignments, borrows for change, macros, and methods called as statements, which have no
/// other purpose.
struct Writes<'a> {
    own: &'a HashSet<Ident>,
    found: bool,
}

impl Writes<'_> {
    fn target(&mut self, place: &Expr) {
        let root = crate::lower::place(place).ok().map(|place| place.root);
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
            Expr::Macro(_) => self.found = true,
            _ => {}
        }
        syn::visit::visit_expr(self, expr);
    }
}

/// `Normal` is a type, `normal_around` is a function.
fn is_type(function: &Expr) -> bool {
    matches!(function, Expr::Path(path) if path
        .path
        .segments
        .last()
        .is_some_and(|last| last.ident.to_string().starts_with(char::is_uppercase)))
}

/// Number of operations that a formula would join.
fn operations(expr: &Expr) -> usize {
    match expr {
        Expr::Paren(paren) => operations(&paren.expr),
        Expr::Group(group) => operations(&group.expr),
        Expr::Unary(unary) if matches!(unary.op, UnOp::Neg(_)) => 1 + operations(&unary.expr),
        Expr::Binary(binary) if is_arithmetic(&binary.op) => {
            1 + operations(&binary.left) + operations(&binary.right)
        }
        Expr::MethodCall(call) if is_function(call) => 1 + operations(&call.receiver),
        _ => 0,
    }
}

fn is_function(call: &ExprMethodCall) -> bool {
    FUNCTIONS.iter().any(|name| call.method == name)
}

fn is_arithmetic(op: &BinOp) -> bool {
    matches!(op, BinOp::Add(_) | BinOp::Sub(_) | BinOp::Mul(_) | BinOp::Div(_))
}

fn is_comparison(op: &BinOp) -> bool {
    matches!(
        op,
        BinOp::Eq(_) | BinOp::Ne(_) | BinOp::Lt(_) | BinOp::Le(_) | BinOp::Gt(_) | BinOp::Ge(_)
    )
}

/// `+` of `+=`.
fn without_assignment(op: &BinOp) -> Option<BinOp> {
    match op {
        BinOp::AddAssign(_) => Some(BinOp::Add(Default::default())),
        BinOp::SubAssign(_) => Some(BinOp::Sub(Default::default())),
        BinOp::MulAssign(_) => Some(BinOp::Mul(Default::default())),
        BinOp::DivAssign(_) => Some(BinOp::Div(Default::default())),
        _ => None,
    }
}

fn operand(expr: &Expr) -> Expr {
    call(expr, expr.span(), "operand")
}

fn closed(expr: &Expr, span: Span) -> Expr {
    call(expr, span, "closed")
}

fn call(expr: &Expr, span: Span, method: &str) -> Expr {
    let span = Span::mixed_site().located_at(span);
    let method = Ident::new(method, span);
    Expr::Verbatim(quote_spanned!(span=> (&::ppl::__private::Of(&(#expr))).#method()))
}
