//! What a model cannot do, said where it is written.

use quote::quote;
use syn::visit::{self, Visit};
use syn::{Error, Expr, Ident, Item, Local, Macro, Pat};

use super::activity::holds;
use super::scope::Scope;
use crate::ast::{Block, Statement};
use crate::errors::{self, at};
use crate::syntax::expressions::{
    assignment, binds_names, ends_with, function_of_f64, is_type, plain_function,
};
use crate::syntax::patterns::{bindings, bound_inside, bound_names};
use crate::syntax::places::{plain_name, root};
use crate::walk::Walk;

/// Why the Rust of a statement is refused, that of statements inside apart. `is_recorded` says that
/// nobody differentiates what it computes.
pub(super) fn refusals(statement: &Statement, scope: &Scope, is_recorded: bool) -> Option<Error> {
    let mut found = Refusals {
        scope,
        is_recorded,
        closures: 0,
        shadowed: Vec::new(),
        derived: Vec::new(),
        error: None,
    };
    found.statement(statement);
    found.error
}

struct Refusals<'a> {
    scope: &'a Scope,
    is_recorded: bool,
    /// Closures around, where `?` and `return` are their own.
    closures: usize,
    /// Names that the expression around has bound anew.
    shadowed: Vec<Ident>,
    /// Names in the statement that stand for what follows from unknowns.
    derived: Vec<Ident>,
    error: Option<Error>,
}

impl Refusals<'_> {
    fn add(&mut self, error: Error) {
        match &mut self.error {
            Some(first) => first.combine(error),
            none => *none = Some(error),
        }
    }

    fn is_unknown(&self, name: &Ident) -> bool {
        self.scope.is_unknown(name) && !self.shadowed.contains(name)
    }

    fn holds(&self, expr: &Expr) -> bool {
        holds(expr, &|name| self.scope.is_active(name) || self.derived.contains(name))
    }

    /// What a pattern takes apart may follow from unknowns.
    fn derive(&mut self, pat: &Pat, value: &Expr) {
        if self.holds(value) {
            self.derived.extend(bound_names(pat));
        }
    }

    /// Why an expression is refused, what is inside it apart.
    fn refused(&self, expr: &Expr) -> Option<Error> {
        match expr {
            Expr::Return(_) if self.closures == 0 => Some(at(expr, errors::RETURN)),
            Expr::Await(_) if self.closures == 0 => Some(at(expr, errors::AWAIT)),
            Expr::Path(path) if path.path.is_ident("self") => Some(at(path, errors::SELF_VALUE)),
            Expr::Path(path)
                if !self.is_recorded
                    && (ends_with(&path.path, &["Real", "value"])
                        || ends_with(&path.path, &["Scalar", "value"])) =>
            {
                Some(at(path, errors::PLAIN_VALUE))
            }
            Expr::Call(call) if plain_function(call).is_some_and(|name| name == "factor") => {
                Some(at(call, errors::FACTOR_INSIDE))
            }
            Expr::Call(call) if !self.is_recorded && self.shadowed.is_empty() => {
                let function = function_of_f64(call)?;
                let held = call.args.iter().find(|argument| self.holds(argument))?;
                Some(at(call, errors::function_of_f64(&function.to_string(), held)))
            }
            Expr::Index(index) => {
                let name = plain_name(&index.index).filter(|name| self.is_unknown(name))?;
                Some(at(name, errors::unknown_index(&name.to_string())))
            }
            Expr::Assign(_) | Expr::Binary(_) => {
                let (place, _) = assignment(expr)?;
                let name = root(place).filter(|name| self.scope.is_unknown(name))?;
                Some(at(place, errors::assigned(&name.to_string())))
            }
            Expr::MethodCall(call) if !self.is_recorded && self.holds(&call.receiver) => {
                let method = call.method.to_string();
                let message = match method.as_str() {
                    "value" if call.args.is_empty() => errors::PLAIN_VALUE.to_owned(),
                    "cdf" | "sf" | "quantile" | "upper_quantile"
                        if is_distribution(&call.receiver) =>
                    {
                        errors::lost_derivatives(&method)
                    }
                    _ => return None,
                };
                Some(Error::new(call.method.span(), message))
            }
            _ => None,
        }
    }
}

/// Whether it is a constructor with its variations.
fn is_distribution(mut expr: &Expr) -> bool {
    while let Expr::MethodCall(call) = expr {
        expr = &call.receiver;
    }
    matches!(expr, Expr::Call(call) if is_type(&call.func))
}

impl<'a> Walk<'a> for Refusals<'_> {
    // statements inside are asked on their own
    fn block(&mut self, _: &'a Block) {}

    // they are needed in one evaluation only, and may not leave it
    fn labels(&mut self, labels: &'a Expr) {
        let is_recorded = std::mem::replace(&mut self.is_recorded, true);
        self.closures += 1;
        self.visit_expr(labels);
        (self.is_recorded, self.closures) = (is_recorded, 0);
    }

    fn bind(&mut self, pat: &'a Pat, _: Option<&'a Expr>) {
        self.shadowed.extend(bound_names(pat));
    }
}

impl<'a> Visit<'a> for Refusals<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        if let Some(error) = self.refused(expr) {
            return self.add(error);
        }
        let (closures, shadowed) = (self.closures, self.shadowed.len());
        if binds_names(expr) {
            self.shadowed.extend(bound_inside(expr));
        }
        bindings(expr).into_iter().for_each(|(pat, value)| self.derive(pat, value));
        if let Expr::MethodCall(call) = expr {
            for argument in &call.args {
                if let Expr::Closure(closure) = argument {
                    closure.inputs.iter().for_each(|input| self.derive(input, &call.receiver));
                }
            }
        }
        self.closures += usize::from(matches!(expr, Expr::Closure(_) | Expr::Async(_)));
        visit::visit_expr(self, expr);
        self.closures = closures;
        self.shadowed.truncate(shadowed);
    }

    fn visit_local(&mut self, local: &'a Local) {
        visit::visit_local(self, local);
        local.init.iter().for_each(|init| self.derive(&local.pat, &init.expr));
    }

    fn visit_macro(&mut self, mac: &'a Macro) {
        if mac.path.is_ident("reject") {
            if self.closures > 0 {
                self.add(at(&mac.path, errors::REJECT_IN_CLOSURE));
            } else if mac.tokens.is_empty() {
                self.add(at(mac, errors::REJECT_REASON));
            }
        }
        if mac.path.is_ident("vec") {
            let tokens = &mac.tokens;
            let elements = syn::parse2::<Expr>(quote!([#tokens]));
            elements.iter().for_each(|elements| Refusals::visit_expr(self, elements));
        }
    }

    // functions inside a model are functions of their own
    fn visit_item(&mut self, _: &'a Item) {}
}
