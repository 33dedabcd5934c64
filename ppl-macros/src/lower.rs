//! From statements as written to statements that can run: names are checked, `?` gets its place,
//! and every statement that can reject a point gets a number.

use std::collections::HashMap;

use proc_macro2::Span;
use syn::ext::IdentExt;
use syn::visit_mut::VisitMut;
use syn::{Error, Expr, Ident, Result, Stmt, Type};

use crate::ast::{ArmBody, Block, Flow, Init, Kind, Statement};
use crate::attributes::Mark;
use crate::check::{check_dims, check_mark, declared, recorded_name};
use crate::errors::{self, at};
use crate::names::{Names, place};
use crate::parse::plain_name;
use crate::rewrite::{Rewrite, is_assignment};
use crate::scan;
use crate::signature::Model;

/// A place of the model, as `ppl::Site` will hold it.
pub(crate) struct Site {
    pub(crate) name: String,
    pub(crate) text: String,
    pub(crate) span: Span,
    pub(crate) repeated: bool,
    /// Names of the dimensions along which the plates around stack, the innermost last.
    pub(crate) plates: Vec<String>,
    /// Names of the value's own dimensions.
    pub(crate) dims: Vec<String>,
}

/// Checks and prepares the body in place.
pub(crate) fn lower(model: &mut Model) -> Vec<Site> {
    let mut lower = Lower {
        sites: Vec::new(),
        scope: HashMap::new(),
        recorded: Names::default(),
        around: Vec::new(),
        loops: 0,
        plates: Vec::new(),
        predicted: false,
    };
    lower.bind(model.arguments.iter().map(|data| data.name.clone()));
    match &model.value {
        Some(ty) => {
            if let Err(error) = end(&mut model.body, ty) {
                model.errors.push(error);
            }
        }
        None => {
            if let Some(last) = model.body.statements.last_mut()
                && let Kind::Rust(Stmt::Expr(value, None)) = &last.kind
                && is_value(value)
            {
                let (names, error) = (Vec::new(), at(value, errors::VALUE_AT_END));
                last.kind = Kind::Broken { names, error };
            }
        }
    }
    // `Ok(())` follows what is not the value
    if let Some(Statement { kind: Kind::Rust(Stmt::Expr(_, semi)), .. }) =
        model.body.statements.last_mut()
    {
        semi.get_or_insert_default();
    }
    lower.block(&mut model.body);
    lower.recorded.stack(&mut lower.sites);
    lower.sites
}

/// Makes the last statement of a submodel its value.
fn end(body: &mut Block, ty: &Type) -> Result<()> {
    let is_unit = matches!(ty, Type::Tuple(tuple) if tuple.elems.is_empty());
    let Some(last) = body.statements.last_mut() else {
        return if is_unit { Ok(()) } else { Err(at(ty, errors::NO_VALUE)) };
    };
    let kind = std::mem::replace(&mut last.kind, Kind::Flow(Flow::Block(Block::empty())));
    let is_unmarked = last.mark == Mark::None && last.dims.is_empty();
    last.kind = match kind {
        Kind::Flow(
            flow @ (Flow::Match { .. } | Flow::Block(_) | Flow::If { otherwise: Some(_), .. }),
        ) if is_unmarked && !is_unit => Kind::End(Init::Flow(Default::default(), flow)),
        Kind::Rust(Stmt::Expr(value, None))
            if is_unmarked && !matches!(value, Expr::While(_) | Expr::Loop(_)) =>
        {
            Kind::End(Init::Value { eq: Default::default(), value, diverge: None })
        }
        other => {
            // what is broken may have been the value
            let is_broken = matches!(other, Kind::Broken { .. });
            last.kind = other;
            return if is_unit || is_broken { Ok(()) } else { Err(at(ty, errors::NO_VALUE)) };
        }
    };
    Ok(())
}

#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Binding {
    /// Data or a deterministic value.
    Known,
    Unknown,
}

struct Lower {
    sites: Vec<Site>,
    scope: HashMap<Ident, Binding>,
    /// Names in the results so far, on the way to here.
    recorded: Names,
    /// The plates around, by their numbers.
    around: Vec<usize>,
    /// How many plates there were so far.
    loops: usize,
    /// Names of the dimensions along which they stack.
    plates: Vec<Option<String>>,
    /// Inside `#[predict] for`.
    predicted: bool,
}

impl Lower {
    fn block(&mut self, block: &mut Block) {
        let scope = self.scope.clone();
        let mut ending = false;
        for statement in &mut block.statements {
            ending |= statement.mark == Mark::Predict;
            let is_late = !matches!(statement.kind, Kind::End(_));
            let late = is_late && ending && statement.mark != Mark::Predict && !self.predicted;
            let declared = declared(&statement.kind);
            let result = match &statement.kind {
                Kind::Broken { .. } => {
                    self.bind(declared);
                    continue;
                }
                _ if late => Err(Error::new(statement.span, errors::PREDICT_LAST)),
                _ => self.statement(statement),
            };
            if let Err(error) = result {
                self.bind(declared.iter().cloned());
                let names = declared;
                statement.kind = Kind::Broken { names, error };
            }
        }
        self.scope = scope;
    }

    fn statement(&mut self, statement: &mut Statement) -> Result<()> {
        let is_imputed = matches!(statement.kind, Kind::Impute { .. });
        let Statement { mark, dims, kind, text, span, site, predicted, .. } = statement;
        check_mark(*mark, kind, *span)?;
        check_dims(dims, *mark, kind)?;
        *predicted = self.predicted || *mark == Mark::Predict;
        let number = self.sites.len();
        for labels in dims.iter_mut().filter_map(|dim| dim.labels.as_mut()) {
            // labels are needed in one reading only, and may not leave it
            let mut rewrite = Rewrite::new(number, &self.scope).inside_closure();
            rewrite.visit_expr_mut(labels);
        }
        let names: Vec<_> = dims.iter().map(|dim| dim.name.unraw().to_string()).collect();
        let mut new = |name: String, lower: &mut Self| {
            *site = Some(number);
            lower.sites.push(Site {
                name,
                text: std::mem::take(text),
                span: *span,
                repeated: !lower.around.is_empty(),
                plates: named(&lower.plates),
                dims: names.clone(),
            });
        };
        match kind {
            Kind::Unknown { name, distribution, .. }
            | Kind::Part { name, part: distribution, .. } => {
                let plain = name.unraw().to_string();
                self.recorded.declare(&plain, &*name)?;
                if self.scope.contains_key(name) {
                    return Err(at(name, errors::declared_data(&plain)));
                }
                self.rewrite(distribution, number);
                self.scope.insert(name.clone(), Binding::Unknown);
                new(plain, self);
            }
            Kind::Observe { place: left, tilde, distribution, .. }
            | Kind::Impute { place: left, tilde, distribution } => {
                if *predicted {
                    return Err(at(tilde, errors::OBSERVE_IN_PREDICTION));
                }
                let place = place(left)?;
                if self.is_unknown(&place.root) {
                    return Err(at(left, errors::observed_unknown(&place.name)));
                }
                self.recorded.observe(&place, left, self.around.last().copied())?;
                let completed = is_imputed.then(|| plain_name(left).cloned()).flatten();
                self.rewrite(left, number);
                self.rewrite(distribution, number);
                new(place.name, self);
                if let Some(name) = completed {
                    self.scope.insert(name, Binding::Unknown);
                }
            }
            Kind::Let { pat, init, .. } => {
                let mut name = None;
                if *mark != Mark::None {
                    let plain = recorded_name(pat, init.is_some())?.unraw().to_string();
                    self.recorded.declare(&plain, &*pat)?;
                    name = Some(plain);
                }
                let used = match init {
                    Some(Init::Value { value, diverge, .. }) => {
                        let used = self.rewrite(value, number);
                        let diverge = diverge.as_mut();
                        diverge.is_some_and(|(_, value)| self.rewrite(value, number)) || used
                    }
                    Some(Init::Flow(_, flow)) => self.header(flow, number),
                    None => false,
                };
                Rewrite::new(number, &self.scope).visit_pat_mut(pat);
                if used || name.is_some() {
                    let first = scan::bound_names(pat).first().map(Ident::to_string);
                    new(name.or(first).unwrap_or_default(), self);
                }
                if let Some(Init::Flow(_, flow)) = init {
                    self.inside(flow, *predicted);
                }
                self.bind(scan::bound_names(pat));
            }
            Kind::Factor { name, weight } => {
                if *predicted {
                    return Err(at(name, errors::OBSERVE_IN_PREDICTION));
                }
                self.rewrite(weight, number);
                new("factor".to_owned(), self);
            }
            Kind::Flow(flow) => {
                // the header comes before the statements inside
                if self.header(flow, number) {
                    new(String::new(), self);
                }
                let outer = self.plates.len();
                if let Flow::For { .. } = flow {
                    self.plates.push(names.first().cloned());
                }
                self.inside(flow, *predicted);
                self.plates.truncate(outer);
            }
            Kind::End(init) => {
                let used = match init {
                    Init::Value { value, .. } => self.rewrite(value, number),
                    Init::Flow(_, flow) => self.header(flow, number),
                };
                if used {
                    new(String::new(), self);
                }
                if let Init::Flow(_, flow) = init {
                    self.inside(flow, *predicted);
                }
            }
            Kind::Rust(stmt) => {
                let mut rewrite = Rewrite::new(number, &self.scope);
                rewrite.visit_stmt_mut(stmt);
                if rewrite.used {
                    new(String::new(), self);
                }
            }
            Kind::Broken { .. } => {}
        }
        Ok(())
    }

    /// Rewrites what is evaluated on the way into control flow; whether that needs a place.
    fn header(&mut self, flow: &mut Flow, site: usize) -> bool {
        match flow {
            Flow::For { iter, .. } => self.rewrite(iter, site),
            Flow::If { condition, otherwise, .. } => {
                let used = self.rewrite(condition, site);
                let other = otherwise.as_mut();
                other.is_some_and(|(_, flow)| self.header(flow, site)) || used
            }
            Flow::Match { scrutinee, arms, .. } => {
                let mut used = self.rewrite(scrutinee, site);
                for arm in arms {
                    if let Some((_, guard)) = &mut arm.guard {
                        used |= self.rewrite(guard, site);
                    }
                    if let ArmBody::Value(value) = &mut arm.body {
                        used |= self.rewrite(value, site);
                    }
                }
                used
            }
            Flow::Block(_) => false,
        }
    }

    fn inside(&mut self, flow: &mut Flow, predicted: bool) {
        let outer = std::mem::replace(&mut self.predicted, predicted);
        self.flow(flow);
        self.predicted = outer;
    }

    /// The statements inside control flow. Of several arms one runs: each may use a name.
    fn flow(&mut self, flow: &mut Flow) {
        let scope = self.scope.clone();
        match flow {
            Flow::For { pat, body, .. } => {
                self.bind(scan::bound_names(pat));
                self.around.push(self.loops);
                self.loops += 1;
                self.block(body);
                self.around.pop();
            }
            Flow::If { condition, then, otherwise, .. } => {
                let before = self.recorded.clone();
                self.bind(scan::bound_by_condition(condition));
                self.block(then);
                self.scope.clone_from(&scope);
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
                    self.bind(scan::bound_names(&arm.pat));
                    if let ArmBody::Block(block) = &mut arm.body {
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

    fn bind(&mut self, names: impl IntoIterator<Item = Ident>) {
        let known = names.into_iter().map(|name| (name, Binding::Known));
        self.scope.extend(known);
    }

    fn is_unknown(&self, name: &Ident) -> bool {
        self.scope.get(name) == Some(&Binding::Unknown)
    }

    fn rewrite(&self, expr: &mut Expr, site: usize) -> bool {
        let mut rewrite = Rewrite::new(site, &self.scope);
        rewrite.visit_expr_mut(expr);
        rewrite.used
    }
}

/// The names of the innermost plates, as far as they have some.
fn named(plates: &[Option<String>]) -> Vec<String> {
    let first = plates.iter().rposition(Option::is_none).map_or(0, |unnamed| unnamed + 1);
    plates[first..].iter().flatten().cloned().collect()
}

/// Whether an expression at the end of the model is certainly not a statement.
fn is_value(expr: &Expr) -> bool {
    match expr {
        Expr::Binary(binary) => !is_assignment(&binary.op),
        Expr::Path(_) | Expr::Lit(_) | Expr::Tuple(_) | Expr::Array(_) | Expr::Unary(_) => true,
        Expr::Field(_) | Expr::Index(_) => true,
        _ => false,
    }
}
