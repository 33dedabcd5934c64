//! Statement by statement: what is wrong with it, and where it stands.

use std::collections::{BTreeMap, HashMap, HashSet};

use proc_macro2::Span;
use quote::ToTokens;
use syn::ext::IdentExt;
use syn::{Error, Expr, Ident, Pat, Result, Stmt, Token};

use super::activity::Activity;
use super::check::check;
use super::names::{Names, Site};
use super::plates::Plate;
use super::refusals::{Scope, refusals};
use super::uses::stays_open;
use crate::ast::{Block, Flow, Id, Init, Kind, Left, Mark, Statement};
use crate::errors::{self, about, at};
use crate::syntax::patterns::{bound_by_condition, bound_names, only_name};
use crate::syntax::places::{Place, place, plain_name};

/// What is known of statements.
#[derive(Default)]
pub(crate) struct Facts {
    /// Where they stand.
    pub(crate) sites: BTreeMap<Id, Site>,
    /// Why they are refused.
    pub(crate) errors: HashMap<Id, Error>,
    /// Declarations whose names are changed by what follows to something that may hold unknowns.
    pub(crate) begins: HashSet<Id>,
    /// Declarations that can stay formulas.
    pub(crate) open: HashSet<Id>,
    /// What is known of loops.
    pub(crate) plates: HashMap<Id, Plate>,
}

/// Of all statements of a body whose arguments are in scope.
pub(super) fn facts(body: &Block, activity: &Activity, scope: Scope) -> Facts {
    let mut reader = Reader {
        activity,
        facts: Facts::default(),
        scope,
        recorded: Names::default(),
        plates: Vec::new(),
        loops: 0,
        is_predicted: false,
        has_items: false,
    };
    reader.block(body);
    reader.recorded.stack(&mut reader.facts.sites);
    reader.facts
}

struct Reader<'a> {
    activity: &'a Activity,
    facts: Facts,
    scope: Scope,
    /// Names in the results so far, on the way to here.
    recorded: Names,
    /// The plates around: their numbers, and the dimension along which each stacks.
    plates: Vec<(usize, Option<String>)>,
    /// How many plates there were so far.
    loops: usize,
    /// Inside `#[predict] for`.
    is_predicted: bool,
    /// Whether items may have declared names.
    has_items: bool,
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

    /// `after` is what follows in its block.
    fn statement(&mut self, statement: &Statement, after: &[Statement]) -> Result<()> {
        let Statement { id, mark, dims, kind, .. } = statement;
        check(statement)?;
        let is_recorded = self.is_predicted || *mark != Mark::None;
        let refused = refusals(statement, self.activity, &self.scope, is_recorded);
        let (names, mut name) = (statement.declared(), None);
        match kind {
            Kind::Tilde { left, tilde, .. } => name = Some(self.tilde(*id, left, tilde)?),
            Kind::Let { pat, init, .. } => {
                self.declaration(statement, pat, init.as_ref(), after)?;
            }
            Kind::Factor { name: factor, .. } => {
                self.in_density(factor.span())?;
                name = Some(factor.to_string());
            }
            Kind::For(plate) => {
                self.facts.plates.insert(*id, Plate::of(statement, plate, self.activity));
                let dimension = dims.first().map(|dim| dim.name.unraw().to_string());
                self.plates.push((self.loops, dimension));
                self.loops += 1;
                self.within(bound_names(&plate.pat), |reader| reader.block(&plate.body));
                self.plates.pop();
            }
            Kind::Flow(flow) | Kind::End(flow) => self.flow(flow),
            Kind::Rust(Stmt::Item(_)) => self.has_items = true,
            Kind::Rust(_) | Kind::Broken { .. } => {}
        }
        if let Some(error) = refused {
            return Err(error);
        }
        let first = names.first().map(|name| name.unraw().to_string());
        let site = self.site(statement, name.or(first).unwrap_or_default());
        self.facts.sites.insert(*id, site);
        Ok(())
    }

    /// What stands before `~`, and its name in the results.
    fn tilde(&mut self, id: Id, left: &Left, tilde: &Token![~]) -> Result<String> {
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
                self.in_density(tilde.span)?;
                let place = self.in_scope(written)?;
                let plate = self.plates.last().map(|(number, _)| *number);
                self.recorded.observe(id, &place, written, plate)?;
                if let (Left::Missing(_), Some(name)) = (left, plain_name(written)) {
                    self.bind([name.clone()], true);
                }
                Ok(place.name)
            }
        }
    }

    /// Predictions have no density.
    fn in_density(&self, span: Span) -> Result<()> {
        match self.is_predicted {
            true => Err(Error::new(span, errors::OBSERVE_IN_PREDICTION)),
            false => Ok(()),
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
            let pat = match pat {
                Pat::Type(typed) => &*typed.pat,
                other => other,
            };
            let name = only_name(pat).filter(|_| init.is_some());
            let name = name.ok_or_else(|| at(pat, errors::RECORDED_NAME))?;
            self.recorded.declare(&name.unraw().to_string(), pat)?;
        }
        let (names, change) = (bound_names(pat), self.activity.change(pat, after));
        let value = init.and_then(|init| init.value.rust());
        if let (Some(value), Some(true)) = (value, change)
            && place(value).is_ok_and(|place| !place.is_path)
            && !self.activity.mentions(value)
        {
            let written = value.to_token_stream().to_string().replace(' ', "");
            return Err(about(written, value, errors::BEGINS_AS_DATA));
        }
        if change.is_some() {
            self.facts.begins.insert(statement.id);
        }
        if stays_open(statement, after, self.activity) {
            self.facts.open.insert(statement.id);
        }
        if let Some(Init { value, diverge, .. }) = init {
            self.flow(value);
            diverge.iter().for_each(|(_, block)| self.block(block));
        }
        self.bind(names, false);
        Ok(())
    }

    /// What is observed has to be there, and without a distribution.
    fn in_scope(&self, left: &Expr) -> Result<Place> {
        let place = place(left)?;
        let name = place.root.to_string();
        if self.scope.get(&place.root) == Some(&true) {
            return Err(about(place.name, left, errors::OBSERVED_UNKNOWN));
        }
        let is_variable = !place.is_path && !name.starts_with(char::is_uppercase);
        if is_variable && !self.has_items && name != "self" && !self.scope.contains_key(&place.root)
        {
            return Err(about(name, &place.root, errors::NOT_IN_SCOPE));
        }
        Ok(place)
    }

    /// The place of a statement under this name.
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

    /// The statements inside control flow. Of several arms one runs: each may use a name.
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

    /// Reads where names are in scope that were not before.
    fn within(&mut self, names: Vec<Ident>, read: impl FnOnce(&mut Self)) {
        let scope = self.scope.clone();
        self.bind(names, false);
        read(self);
        self.scope = scope;
    }
}
