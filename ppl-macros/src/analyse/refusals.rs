//! Finds Rust code that a model cannot contain. Each error is reported at the position of the invalid code.

use std::collections::HashMap;

use quote::quote;
use syn::visit::{self, Visit};
use syn::{
    AngleBracketedGenericArguments, Error, Expr, GenericArgument, Ident, Item, Macro, Path,
    PathArguments, Stmt, Type,
};

use super::activity::{Activity, holds};
use crate::ast::{Block, Statement};
use crate::errors::{self, about, at};
use crate::syntax::expressions::{assignment, ends_with, is_type, plain_function};
use crate::syntax::patterns::bound_names;
use crate::syntax::places::root;
use crate::walk::Walk;

/// The names in scope. The value is true if `let name ~ …` declared the name.
pub(super) type Scope = HashMap<Ident, bool>;

/// Returns the errors in the Rust code of a statement; nested statements are not checked. `is_recorded` means that
/// the values of the statement are only recorded, so that the values need no derivatives.
pub(super) fn refusals(
    statement: &Statement,
    activity: &Activity,
    scope: &Scope,
    is_recorded: bool,
) -> Option<Error> {
    let derived = Vec::new();
    let mut search = Refusals { activity, scope, is_recorded, closures: 0, derived, error: None };
    search.statement(statement);
    search.error
}

struct Refusals<'a> {
    activity: &'a Activity,
    scope: &'a Scope,
    is_recorded: bool,
    /// Number of enclosing closures. Inside a closure, `?` and `return` return from the closure and not from the
    /// model.
    closures: usize,
    /// Names of closure parameters whose values may depend on unknowns.
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

    /// Returns the first generic argument in `<…>` that is a name in scope. Such an argument is an error, because its
    /// value is known only at run time.
    fn size<'t>(&self, arguments: &'t AngleBracketedGenericArguments) -> Option<&'t Ident> {
        let name = |argument: &'t GenericArgument| match argument {
            GenericArgument::Type(Type::Path(path)) => path.path.get_ident(),
            GenericArgument::Const(Expr::Path(path)) => path.path.get_ident(),
            GenericArgument::Const(Expr::Block(block)) => match &block.block.stmts[..] {
                [Stmt::Expr(Expr::Path(path), None)] => path.path.get_ident(),
                _ => None,
            },
            _ => None,
        };
        let mut names = arguments.args.iter().filter_map(name);
        names.find(|name| self.scope.contains_key(*name))
    }

    fn run_time_size<'t>(&self, path: &'t Path) -> Option<&'t Ident> {
        path.segments.iter().find_map(|segment| match &segment.arguments {
            PathArguments::AngleBracketed(arguments) => self.size(arguments),
            _ => None,
        })
    }

    fn holds(&self, expr: &Expr) -> bool {
        holds(expr, &|name| self.activity.is_active(name) || self.derived.contains(name))
    }

    /// Returns the error in an expression, without checking the subexpressions of the expression.
    fn refused(&self, expr: &Expr) -> Option<Error> {
        match expr {
            Expr::Return(_) if self.closures == 0 => Some(at(expr, errors::RETURN)),
            Expr::Call(call) if plain_function(call).is_some_and(|name| name == "factor") => {
                Some(at(call, errors::FACTOR))
            }
            Expr::Assign(_) | Expr::Binary(_) => {
                let (place, _) = assignment(expr)?;
                let name = root(place).filter(|name| self.scope.get(name) == Some(&true))?;
                Some(about(name, place, errors::ASSIGNED))
            }
            Expr::Index(index) => {
                let name = root(&index.index).filter(|name| self.scope.get(name) == Some(&true))?;
                Some(about(&name, &name, errors::UNKNOWN_INDEX))
            }
            Expr::Path(path) if self.run_time_size(&path.path).is_some() => {
                let name = self.run_time_size(&path.path)?;
                Some(about(name, name, errors::RUN_TIME_SIZE))
            }
            Expr::MethodCall(call)
                if call.turbofish.as_ref().and_then(|t| self.size(t)).is_some() =>
            {
                let name = call.turbofish.as_ref().and_then(|t| self.size(t))?;
                Some(about(name, name, errors::RUN_TIME_SIZE))
            }
            _ if self.is_recorded => None,
            Expr::Call(call) if call.args.iter().any(|argument| self.holds(argument)) => {
                let Expr::Path(function) = &*call.func else { return None };
                let mut words = function.path.segments.iter().map(|segment| &segment.ident);
                let method = words.next().filter(|word| *word == "f64").and(words.next())?;
                Some(about(method, call, errors::FUNCTION_OF_F64))
            }
            Expr::Path(path) => ["Real", "Scalar"]
                .iter()
                .any(|number| ends_with(&path.path, &[number, "value"]))
                .then(|| at(path, errors::PLAIN_VALUE)),
            Expr::MethodCall(call) if self.holds(&call.receiver) => {
                let method = &call.method;
                match method.to_string().as_str() {
                    "value" if call.args.is_empty() => Some(at(method, errors::PLAIN_VALUE)),
                    "cdf" | "sf" | "quantile" | "upper_quantile"
                        if is_distribution(&call.receiver) =>
                    {
                        Some(about(method, method, errors::LOST_DERIVATIVES))
                    }
                    _ => None,
                }
            }
            _ => None,
        }
    }
}

/// Whether an expression is a constructor of a distribution, possibly with methods called on it.
fn is_distribution(mut expr: &Expr) -> bool {
    while let Expr::MethodCall(call) = expr {
        expr = &call.receiver;
    }
    matches!(expr, Expr::Call(call) if is_type(&call.func))
}

impl<'a> Walk<'a> for Refusals<'_> {
    // nested statements are analysed separately
    fn block(&mut self, _: &'a Block) {}

    // the code that computes the labels of a dimension is emitted inside a closure, so that it cannot reject the
    // point; the labels are only recorded
    fn labels(&mut self, labels: &'a Expr) {
        let is_recorded = std::mem::replace(&mut self.is_recorded, true);
        self.closures += 1;
        self.visit_expr(labels);
        (self.is_recorded, self.closures) = (is_recorded, 0);
    }
}

impl<'a> Visit<'a> for Refusals<'_> {
    fn visit_expr(&mut self, expr: &'a Expr) {
        if let Some(error) = self.refused(expr) {
            return self.add(error);
        }
        if let Expr::MethodCall(call) = expr
            && self.holds(&call.receiver)
        {
            let closures = call.args.iter().filter_map(|argument| match argument {
                Expr::Closure(closure) => Some(closure),
                _ => None,
            });
            self.derived.extend(closures.flat_map(|closure| &closure.inputs).flat_map(bound_names));
        }
        let closures = self.closures;
        self.closures += usize::from(matches!(expr, Expr::Closure(_) | Expr::Async(_)));
        visit::visit_expr(self, expr);
        self.closures = closures;
    }

    fn visit_macro(&mut self, mac: &'a Macro) {
        if mac.path.is_ident("reject") && self.closures > 0 {
            self.add(at(&mac.path, errors::REJECT_IN_CLOSURE));
        } else if mac.path.is_ident("reject") && mac.tokens.is_empty() {
            self.add(at(mac, errors::REJECT_REASON));
        }
        if mac.path.is_ident("vec") {
            let tokens = &mac.tokens;
            let elements = syn::parse2::<Expr>(quote!([#tokens]));
            elements.iter().for_each(|elements| Refusals::visit_expr(self, elements));
        }
    }

    // functions inside a model are not part of the model
    fn visit_item(&mut self, _: &'a Item) {}
}
