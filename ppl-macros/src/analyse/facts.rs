//! Determines the errors, the properties and the site of each statement. A site is the position of the statement in
//! the source and its name in the results.

use std::collections::{BTreeMap, HashMap, HashSet};

use quote::ToTokens;
use syn::ext::IdentExt;
use syn::{Error, Expr, Ident, Pat, Result};

use super::activity::Activity;
use super::names::{Names, Site};
use super::plates::Plate;
use super::refusals::{Scope, refusals};
use super::uses::stays_symbolic;
use crate::ast::{Block, Flow, Id, Init, Kind, Left, Mark, Statement};
use crate::errors::{self, about, at};
use crate::syntax::patterns::{bound_by_condition, bound_names, is_constant, only_name};
use crate::syntax::places::{Place, parse_place, plain_name, root};

/// Results of the analysis. The key of each table is the number of a statement.
#[derive(Default)]
pub(crate) struct Facts {
    /// The sites of the statements: their positions and names in the model.
    pub(crate) sites: BTreeMap<Id, Site>,
    /// The errors of invalid statements.
    pub(crate) errors: HashMap<Id, Error>,
    /// Declarations of variables to which later statements assign a value that may depend on
    /// unknowns.
    pub(crate) begins: HashSet<Id>,
    /// Declarations `let name = arithmetic;` whose value can stay a symbolic formula until it is used, instead of
    /// being evaluated to a number.
    pub(crate) symbolic: HashSet<Id>,
    /// Properties of the plates (`for` loops in the body of a model).
    pub(crate) plates: HashMap<Id, Plate>,
}

/// Analyses all statements of a body. `scope` contains the names of the arguments.
pub(super) fn facts(body: &Block, activity: &Activity, scope: Scope) -> Facts {
    let mut reader = Reader {
        activity,
        facts: Facts::default(),
        scope,
        recorded: Names::default(),
        plates: Vec::new(),
        is_predicted: false,
    };
    reader.block(body);
    reader.recorded.stack(&mut reader.facts.sites);
    reader.facts
}

struct Reader<'a> {
    activity: &'a Activity,
    facts: Facts,
    scope: Scope,
    /// Names in the results that statements on the execution path to the current statement already use.
    recorded: Names,
    /// The enclosing plates (`for` loops of the model), the innermost last. Each has the name of the dimension along
    /// which it stacks the values of its iterations, or None if the dimension has no name.
    plates: Vec<(Id, Option<String>)>,
    /// Whether the current statement is inside `#[predict] for`.
    is_predicted: bool,
}

impl Reader<'_> {
    fn bind(&mut self, names: impl IntoIterator<Item = Ident>, is_unknown: bool) {
        self.scope.extend(names.into_iter().map(|name| (name, is_unknown)));
    }

    fn block(&mut self, block: &Block) {
        let scope = self.scope.clone();
        let mut is_ending = false;
        for (i, statement) in block.statements.iter().enumerate() {
            let is_marked = statement.mark == Mark::Predict;
            is_ending |= is_marked;
            let is_late = is_ending && !is_marked && !matches!(statement.kind, Kind::End(_));
            let outer = self.is_predicted;
            self.is_predicted |= is_marked;
            let result = match &statement.kind {
                Kind::Broken { error, .. } => Err(error.clone()),
                _ if is_late && !outer => Err(Error::new(statement.span, errors::PREDICT_LAST)),
                _ => self.statement(statement, &block.statements[i + 1..]),
            };
            self.is_predicted = outer;
            if let Err(error) = result {
                self.bind(statement.declared(), false);
                self.facts.errors.insert(statement.id, error);
            }
        }
        self.scope = scope;
    }

    /// Analyses a statement; `after` are the statements after it in its block.
    fn statement(&mut self, statement: &Statement, after: &[Statement]) -> Result<()> {
        let Statement { id, mark, dims, kind, .. } = statement;
        check(statement, self.is_predicted)?;
        let is_recorded = self.is_predicted || *mark != Mark::None;
        let refused = refusals(statement, self.activity, &self.scope, is_recorded);
        let first = statement.declared().first().map(|name| name.unraw().to_string());
        let mut name = first.unwrap_or_default();
        match kind {
            Kind::Tilde { left, .. } => name = self.tilde(*id, left)?,
            Kind::Let { pat, init, .. } => {
                self.declaration(statement, pat, init.as_ref(), after)?;
            }
            Kind::Factor { name: factor, .. } => name = factor.to_string(),
            Kind::For(plate) => {
                self.facts.plates.insert(*id, Plate::new(statement, plate, self.activity));
                let dimension = dims.first().map(|dim| dim.name.unraw().to_string());
                self.plates.push((*id, dimension));
                self.within(bound_names(&plate.pat), |reader| reader.block(&plate.body));
                self.plates.pop();
            }
            Kind::Flow(flow) | Kind::End(flow) => self.flow(flow),
            Kind::Rust(_) | Kind::Broken { .. } => {}
        }
        if let Some(error) = refused {
            return Err(error);
        }
        self.facts.sites.insert(*id, self.site(statement, name));
        Ok(())
    }

    /// Analyses the left side of `~` and returns the name of the quantity in the results.
    fn tilde(&mut self, id: Id, left: &Left) -> Result<String> {
        match left {
            Left::Unknown(_, name) | Left::Part(_, name) => {
                let plain = name.unraw().to_string();
                self.recorded.declare(&plain, name)?;
                if self.scope.contains_key(name) {
                    return Err(about(plain, name, errors::DECLARED_DATA));
                }
                self.bind([name.clone()], true);
                Ok(plain)
            }
            Left::Place(written) | Left::Missing(written) => {
                let place = self.in_scope(written)?;
                let plate = self.plates.last().map(|(id, _)| *id);
                self.recorded.observe(id, &place, written, plate)?;
                if let (Left::Missing(_), Some(name)) = (left, plain_name(written)) {
                    self.bind([name.clone()], true);
                }
                Ok(place.name)
            }
        }
    }

    fn declaration(
        &mut self,
        statement: &Statement,
        pat: &Pat,
        init: Option<&Init>,
        after: &[Statement],
    ) -> Result<()> {
        if statement.mark != Mark::None {
            let name = only_name(pat).filter(|_| init.is_some());
            let name = name.ok_or_else(|| at(pat, errors::RECORDED_NAME))?;
            self.recorded.declare(&name.unraw().to_string(), name)?;
        }
        if self.activity.begins(pat, after) {
            if let Some(value) = init.and_then(|init| init.value.rust())
                && root(value).is_some_and(|root| !is_constant(&root))
                && !self.activity.mentions(value)
            {
                let written = value.to_token_stream().to_string().replace(' ', "");
                return Err(about(written, value, errors::BEGINS_AS_DATA));
            }
            self.facts.begins.insert(statement.id);
        }
        if stays_symbolic(statement, after, self.activity) {
            self.facts.symbolic.insert(statement.id);
        }
        if let Some(Init { value, diverge, .. }) = init {
            self.flow(value);
            diverge.iter().for_each(|(_, block)| self.block(block));
        }
        self.bind(bound_names(pat), false);
        Ok(())
    }

    /// Parses an observed place. Returns an error if the variable of the place is not in scope or already has a
    /// distribution.
    fn in_scope(&self, left: &Expr) -> Result<Place> {
        let place = parse_place(left)?;
        match self.scope.get(&place.root) {
            Some(true) => Err(about(place.name, left, errors::OBSERVED_UNKNOWN)),
            None if !is_constant(&place.root) => {
                Err(about(&place.root, &place.root, errors::NOT_IN_SCOPE))
            }
            _ => Ok(place),
        }
    }

    /// Returns the site of a statement. `name` is the name of the quantity in the results.
    fn site(&self, statement: &Statement, name: String) -> Site {
        let unnamed = self.plates.iter().rposition(|(_, dimension)| dimension.is_none());
        let named = &self.plates[unnamed.map_or(0, |innermost| innermost + 1)..];
        Site {
            name,
            text: statement.text.clone(),
            span: statement.span,
            repeated: !self.plates.is_empty(),
            plates: named.iter().filter_map(|(_, dimension)| dimension.clone()).collect(),
            dims: statement.dims.iter().map(|dim| dim.name.unraw().to_string()).collect(),
        }
    }

    /// Analyses the statements inside control flow. Two arms may use the same name in the results, because only one
    /// arm runs.
    fn flow(&mut self, flow: &Flow) {
        match flow {
            Flow::If { condition, then, otherwise, .. } => {
                let before = self.recorded.clone();
                self.within(bound_by_condition(condition), |reader| reader.block(then));
                if let Some((_, flow)) = otherwise {
                    let then = std::mem::replace(&mut self.recorded, before);
                    self.flow(flow);
                    self.recorded.merge(then);
                }
            }
            Flow::Match { arms, .. } => {
                let before = self.recorded.clone();
                let mut after = before.clone();
                for arm in arms {
                    self.within(bound_names(&arm.pat), |reader| reader.flow(&arm.body));
                    after.merge(std::mem::replace(&mut self.recorded, before.clone()));
                }
                self.recorded = after;
            }
            Flow::Block(block) => self.block(block),
            Flow::Value(_) => {}
        }
    }

    /// Calls `read` while the additional `names` are in scope.
    fn within(&mut self, names: Vec<Ident>, read: impl FnOnce(&mut Self)) {
        let scope = self.scope.clone();
        self.bind(names, false);
        read(self);
        self.scope = scope;
    }
}

/// Checks that a statement of this kind may have the mark (`#[track]` or `#[predict]`) and the dimensions that the
/// user gave it. Also checks that a statement that adds to the density is not inside a prediction.
fn check(statement: &Statement, is_predicted: bool) -> Result<()> {
    let Statement { mark, dims, kind, span, .. } = statement;
    let takes_mark = match kind {
        Kind::Let { .. } | Kind::Tilde { left: Left::Part(..), .. } => true,
        Kind::For(_) | Kind::Tilde { left: Left::Unknown(..), .. } => *mark != Mark::Track,
        _ => *mark == Mark::None,
    };
    if !takes_mark {
        let is_track = *mark == Mark::Track;
        let message = if is_track { errors::TRACK_WHAT } else { errors::PREDICT_WHAT };
        return Err(Error::new(*span, message));
    }
    let is_in_density = match kind {
        Kind::Tilde { left, .. } => matches!(left, Left::Place(_) | Left::Missing(_)),
        other => matches!(other, Kind::Factor { .. }),
    };
    if is_predicted && is_in_density {
        return Err(Error::new(*span, errors::OBSERVE_IN_PREDICTION));
    }
    let takes_dims = match kind {
        Kind::For(_) => dims.len() == 1,
        Kind::Tilde { left, .. } => !matches!(left, Left::Part(..)),
        Kind::Let { .. } => *mark != Mark::None,
        _ => false,
    };
    match dims.first() {
        Some(first) if !takes_dims => Err(at(&first.name, errors::DIMS_WHAT)),
        _ => Ok(()),
    }
}
