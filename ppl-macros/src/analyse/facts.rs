//! Statement by statement: what is wrong with it, where it stands, and what its names mean.

use std::collections::HashMap;

use syn::ext::IdentExt;
use syn::visit::{self, Visit};
use syn::{Error, Expr, Ident, Item, Macro, Result, Stmt};

use super::activity::Activity;
use super::check::{check_dims, check_mark, declared, recorded_name};
use super::names::Names;
use super::scope::{Meaning, Scope};
use super::site::Site;
use crate::ast::{ArmBody, Block, Flow, Id, Init, Kind, Mark, Model, Statement};
use crate::errors::{self, at};
use crate::syntax::expressions::dot;
use crate::syntax::patterns::{bound_by_condition, bound_names};
use crate::syntax::places::{Place, place, plain_name};

/// What is known of a statement.
#[derive(Clone, Default)]
pub(crate) struct Facts {
    /// Its number among the places of the model, if it needs one.
    pub(crate) site: Option<usize>,
    /// Whether it runs on finished draws only.
    pub(crate) is_predicted: bool,
    /// What the names in it mean.
    pub(crate) scope: Scope,
    /// Why it is refused.
    pub(crate) error: Option<Error>,
}

/// The places of a model, and the facts of its statements.
pub(crate) fn facts(model: &Model, activity: &Activity) -> (Vec<Site>, HashMap<Id, Facts>) {
    let mut walk = Walk {
        activity,
        sites: Vec::new(),
        facts: HashMap::new(),
        scope: Scope::default(),
        recorded: Names::default(),
        around: Vec::new(),
        loops: 0,
        plates: Vec::new(),
        is_predicted: false,
        has_items: false,
    };
    walk.bind(model.arguments.iter().map(|data| data.name.clone()), Meaning::Known);
    walk.block(&model.body);
    walk.recorded.stack(&mut walk.sites);
    (walk.sites, walk.facts)
}

struct Walk<'a> {
    activity: &'a Activity,
    sites: Vec<Site>,
    facts: HashMap<Id, Facts>,
    scope: Scope,
    /// Names in the results so far, on the way to here.
    recorded: Names,
    /// The plates around, by their numbers.
    around: Vec<usize>,
    /// How many plates there were so far.
    loops: usize,
    /// Names of the dimensions along which they stack.
    plates: Vec<Option<String>>,
    /// Inside `#[predict] for`.
    is_predicted: bool,
    /// Whether items or macros may have declared names.
    has_items: bool,
}

impl Walk<'_> {
    fn block(&mut self, block: &Block) {
        let scope = self.scope.clone();
        let mut is_ending = false;
        for statement in &block.statements {
            let Statement { id, mark, kind, span, .. } = statement;
            is_ending |= *mark == Mark::Predict;
            let is_late = is_ending && *mark != Mark::Predict && !self.is_predicted;
            let is_predicted = self.is_predicted || *mark == Mark::Predict;
            let facts = Facts { is_predicted, scope: self.scope.clone(), ..Facts::default() };
            self.facts.insert(*id, facts);
            let result = match kind {
                Kind::Broken { .. } => {
                    self.bind(declared(kind), Meaning::Known);
                    continue;
                }
                Kind::End(_) => self.statement(statement),
                _ if is_late => Err(Error::new(*span, errors::PREDICT_LAST)),
                _ => self.statement(statement),
            };
            if let Err(error) = result {
                self.bind(declared(kind), Meaning::Known);
                self.facts.entry(*id).or_default().error = Some(error);
            }
        }
        self.scope = scope;
    }

    fn statement(&mut self, statement: &Statement) -> Result<()> {
        let Statement { mark, dims, kind, span, .. } = statement;
        check_mark(*mark, kind, *span)?;
        check_dims(dims, *mark, kind)?;
        let is_predicted = self.is_predicted || *mark == Mark::Predict;
        match kind {
            Kind::Unknown { name, .. } | Kind::Part { name, .. } => {
                let plain = name.unraw().to_string();
                self.recorded.declare(&plain, name)?;
                if self.scope.contains(name) {
                    return Err(at(name, errors::declared_data(&plain)));
                }
                self.bind([name.clone()], Meaning::Unknown);
                self.new_site(statement, plain);
            }
            Kind::Observe { place: left, tilde, .. } | Kind::Impute { place: left, tilde, .. } => {
                if is_predicted {
                    return Err(at(tilde, errors::OBSERVE_IN_PREDICTION));
                }
                let place = self.in_scope(left)?;
                self.recorded.observe(&place, left, self.around.last().copied())?;
                self.new_site(statement, place.name);
                if let (Kind::Impute { .. }, Some(name)) = (kind, plain_name(left)) {
                    self.bind([name.clone()], Meaning::Unknown);
                }
            }
            Kind::Let { pat, init, .. } => self.declaration(statement, pat, init.as_ref())?,
            Kind::Factor { name, .. } => {
                if is_predicted {
                    return Err(at(name, errors::OBSERVE_IN_PREDICTION));
                }
                self.new_site(statement, "factor".to_owned());
            }
            Kind::Flow(flow) => {
                // the header comes before the statements inside
                if header_leaves(flow) {
                    self.new_site(statement, String::new());
                }
                let outer = self.plates.len();
                if let Flow::For(_) = flow {
                    self.plates.push(dims.first().map(|dim| dim.name.unraw().to_string()));
                }
                self.inside(flow, is_predicted);
                self.plates.truncate(outer);
            }
            Kind::End(init) => {
                if leaves(init) {
                    self.new_site(statement, String::new());
                }
                if let Init::Flow(_, flow) = init {
                    self.inside(flow, is_predicted);
                }
            }
            Kind::Rust(stmt) => {
                self.has_items |= matches!(stmt, Stmt::Item(_) | Stmt::Macro(_));
                let mut asks = Leaves(false);
                asks.visit_stmt(stmt);
                if asks.0 {
                    self.new_site(statement, String::new());
                }
            }
            Kind::Broken { .. } => {}
        }
        Ok(())
    }

    fn declaration(
        &mut self,
        statement: &Statement,
        pat: &syn::Pat,
        init: Option<&Init>,
    ) -> Result<()> {
        let mut name = None;
        if statement.mark != Mark::None {
            let plain = recorded_name(pat, init.is_some())?.unraw().to_string();
            self.recorded.declare(&plain, pat)?;
            name = Some(plain);
        }
        let names = bound_names(pat);
        if let (Some(Init::Value { value, .. }), [only]) = (init, &*names)
            && self.activity.is_overwritten(statement.id)
            && is_datum(value)
            && !self.activity.mentions(value)
        {
            return Err(at(value, errors::begins_as_data(&only.to_string(), value)));
        }
        if name.is_some() || init.is_some_and(leaves) {
            let first = names.first().map(Ident::to_string);
            self.new_site(statement, name.or(first).unwrap_or_default());
        }
        let meaning = match init {
            Some(Init::Flow(_, flow)) => {
                self.inside(flow, self.is_predicted || statement.mark == Mark::Predict);
                Meaning::Derived
            }
            _ if self.activity.begins(statement.id) => Meaning::Derived,
            Some(Init::Value { value, .. }) => self.scope.meaning(value),
            None => Meaning::Known,
        };
        self.bind(names, meaning);
        Ok(())
    }

    /// What is observed has to be there, and without a distribution.
    fn in_scope(&self, left: &Expr) -> Result<Place> {
        let place = place(left)?;
        let name = place.root.to_string();
        if self.scope.is_unknown(&place.root) {
            return Err(at(left, errors::observed_unknown(&place.name)));
        }
        let is_variable = !place.is_path && !name.starts_with(char::is_uppercase);
        if is_variable && !self.has_items && name != "self" && !self.scope.contains(&place.root) {
            return Err(at(&place.root, errors::not_in_scope(&name, &self.scope.names())));
        }
        Ok(place)
    }

    /// Gives the statement a place under this name.
    fn new_site(&mut self, statement: &Statement, name: String) {
        self.facts.entry(statement.id).or_default().site = Some(self.sites.len());
        self.sites.push(Site {
            name,
            text: statement.text.clone(),
            span: statement.span,
            repeated: !self.around.is_empty(),
            plates: named(&self.plates),
            dims: statement.dims.iter().map(|dim| dim.name.unraw().to_string()).collect(),
        });
    }

    fn inside(&mut self, flow: &Flow, is_predicted: bool) {
        let outer = std::mem::replace(&mut self.is_predicted, is_predicted);
        self.flow(flow);
        self.is_predicted = outer;
    }

    /// The statements inside control flow. Of several arms one runs: each may use a name.
    fn flow(&mut self, flow: &Flow) {
        let scope = self.scope.clone();
        match flow {
            Flow::For(plate) => {
                self.bind(bound_names(&plate.pat), scope.meaning(&plate.iter));
                self.around.push(self.loops);
                self.loops += 1;
                self.block(&plate.body);
                self.around.pop();
            }
            Flow::If { condition, then, otherwise, .. } => {
                let before = self.recorded.clone();
                self.bind(bound_by_condition(condition), scope.meaning(condition));
                self.block(then);
                self.scope.clone_from(&scope);
                if let Some((_, flow)) = otherwise {
                    let then = std::mem::replace(&mut self.recorded, before);
                    self.flow(flow);
                    self.recorded.merge(then);
                }
            }
            Flow::Match { scrutinee, arms, .. } => {
                let before = self.recorded.clone();
                let mut after = before.clone();
                for arm in arms {
                    self.bind(bound_names(&arm.pat), scope.meaning(scrutinee));
                    if let ArmBody::Block(block) = &arm.body {
                        self.block(block);
                    }
                    self.scope.clone_from(&scope);
                    after.merge(std::mem::replace(&mut self.recorded, before.clone()));
                }
                self.recorded = after;
            }
            Flow::Block(block) => self.block(block),
        }
        self.scope = scope;
    }

    fn bind(&mut self, names: impl IntoIterator<Item = Ident>, meaning: Meaning) {
        self.scope.bind(names, meaning);
    }
}

/// Whether an expression is a place, whose value is that of data where it mentions no unknowns.
fn is_datum(value: &Expr) -> bool {
    place(value).is_ok_and(|place| !place.is_path)
}

/// The names of the innermost plates, as far as they have some.
fn named(plates: &[Option<String>]) -> Vec<String> {
    let first = plates.iter().rposition(Option::is_none).map_or(0, |unnamed| unnamed + 1);
    plates[first..].iter().flatten().cloned().collect()
}

fn leaves(init: &Init) -> bool {
    match init {
        Init::Value { value, diverge, .. } => {
            may_leave(value) || diverge.iter().any(|(_, value)| may_leave(value))
        }
        Init::Flow(_, flow) => header_leaves(flow),
    }
}

/// Whether what is evaluated on the way into control flow may leave the model.
fn header_leaves(flow: &Flow) -> bool {
    match flow {
        Flow::For(plate) => may_leave(&plate.iter),
        Flow::If { condition, otherwise, .. } => {
            may_leave(condition) || otherwise.iter().any(|(_, flow)| header_leaves(flow))
        }
        Flow::Match { scrutinee, arms, .. } => {
            may_leave(scrutinee)
                || arms.iter().any(|arm| {
                    arm.guard.iter().any(|(_, guard)| may_leave(guard))
                        || matches!(&arm.body, ArmBody::Value(value) if may_leave(value))
                })
        }
        Flow::Block(_) => false,
    }
}

fn may_leave(expr: &Expr) -> bool {
    let mut asks = Leaves(false);
    asks.visit_expr(expr);
    asks.0
}

/// Whether Rust may leave the model, by `?`, `reject!` or lengths in `dot`: it needs a place to say so.
struct Leaves(bool);

impl<'a> Visit<'a> for Leaves {
    fn visit_expr(&mut self, expr: &'a Expr) {
        self.0 |= matches!(expr, Expr::Try(_)) || dot(expr).is_some();
        // there, `?` is the closure's own
        if !matches!(expr, Expr::Closure(_) | Expr::Async(_)) {
            visit::visit_expr(self, expr);
        }
    }

    fn visit_macro(&mut self, mac: &'a Macro) {
        self.0 |= mac.path.is_ident("reject");
    }

    // functions inside a model are functions of their own
    fn visit_item(&mut self, _: &'a Item) {}
}
