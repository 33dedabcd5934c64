//! Statement by statement.

use syn::Expr;
use syn::visit_mut::VisitMut;

use super::{Planner, Plate, Sums, literals};
use crate::ast::{ArmBody, Block, Flow, For, Id, Init, Kind, Left, Mark, Statement};

impl Planner<'_> {
    pub(super) fn block(&mut self, block: &mut Block) {
        block.statements.iter_mut().for_each(|statement| self.statement(statement));
    }

    fn statement(&mut self, statement: &mut Statement) {
        if let Some(error) = self.analysis.refused(statement.id) {
            let (names, error) = (statement.declared(), error.clone());
            statement.kind = Kind::Broken { names, error };
            statement.dims.clear();
            return;
        }
        let around = std::mem::replace(&mut self.at, statement.id);
        for labels in statement.dims.iter_mut().filter_map(|dim| dim.labels.as_mut()) {
            self.closures += 1;
            self.visit_expr_mut(labels);
            self.closures -= 1;
        }
        match &mut statement.kind {
            Kind::Tilde { left, right, .. } => {
                self.site();
                match left {
                    Left::Part(..) => self.visit_expr_mut(right),
                    Left::Unknown(..) => self.distribution(right),
                    Left::Place(place) | Left::Missing(place) => {
                        self.place(place);
                        self.distribution(right);
                        if matches!(left, Left::Place(_)) && self.sums.is_some() {
                            let site = self.site();
                            self.sums.iter_mut().for_each(|sums| sums.terms.push(site));
                        }
                    }
                }
            }
            Kind::Let { pat, init, .. } => {
                if statement.mark != Mark::None {
                    self.site();
                }
                if let Some(Init::Value { value, .. }) = init
                    && self.analysis.activity.begins(statement.id)
                {
                    literals::begin(pat, value);
                }
                self.visit_pat_mut(pat);
                match init {
                    Some(Init::Value { value, .. })
                        if self.formulas && self.analysis.stays_open(statement.id) =>
                    {
                        self.open(value);
                    }
                    _ => init.iter_mut().for_each(|init| self.init(init)),
                }
            }
            Kind::Factor { weight, .. } => {
                self.site();
                self.visit_expr_mut(weight);
            }
            Kind::For(plate) => self.plate(statement.id, plate),
            Kind::Flow(flow) => self.flow(flow),
            Kind::End(init) => self.init(init),
            Kind::Rust(stmt) => self.visit_stmt_mut(stmt),
            Kind::Broken { .. } => {}
        }
        self.at = around;
    }

    /// A place is no arithmetic, whatever its index computes.
    fn place(&mut self, place: &mut Expr) {
        let formulas = std::mem::replace(&mut self.formulas, false);
        let shared = std::mem::take(&mut self.shared);
        self.visit_expr_mut(place);
        (self.formulas, self.shared) = (formulas, shared);
    }

    fn init(&mut self, init: &mut Init) {
        match init {
            Init::Value { value, diverge, .. } => {
                self.visit_expr_mut(value);
                diverge.iter_mut().for_each(|(_, value)| self.visit_expr_mut(value));
            }
            Init::Flow(_, flow) => {
                literals::align_arms(flow, &self.analysis.activity);
                self.flow(flow);
            }
        }
    }

    fn flow(&mut self, flow: &mut Flow) {
        match flow {
            Flow::If { condition, then, otherwise, .. } => {
                self.visit_expr_mut(condition);
                self.block(then);
                otherwise.iter_mut().for_each(|(_, flow)| self.flow(flow));
            }
            Flow::Match { scrutinee, arms, .. } => {
                self.visit_expr_mut(scrutinee);
                for arm in arms {
                    arm.guard.iter_mut().for_each(|(_, guard)| self.visit_expr_mut(guard));
                    match &mut arm.body {
                        ArmBody::Block(block) => self.block(block),
                        ArmBody::Value(value) => self.visit_expr_mut(value),
                    }
                }
            }
            Flow::Block(block) => self.block(block),
        }
    }

    fn plate(&mut self, id: Id, plate: &mut For) {
        self.visit_expr_mut(&mut plate.iter);
        self.visit_pat_mut(&mut plate.pat);
        let Some(known) = self.analysis.plate(id).filter(|_| self.formulas) else {
            return self.block(&mut plate.body);
        };
        let mut planned = Plate { is_pooled: known.is_pooled, ..Plate::default() };
        if known.is_pooled {
            let terms = self.sums.as_ref().map(|sums| sums.terms.len());
            self.block(&mut plate.body);
            // its own are no terms of a loop
            self.sums.iter_mut().zip(terms).for_each(|(sums, before)| sums.terms.truncate(before));
        } else {
            planned.unwinds = known.unwinds;
            let is_outermost = self.sums.is_none();
            if is_outermost {
                if let Some(own) = &known.own {
                    let outer = self.analysis.activity.names().filter(|name| !own.contains(name));
                    self.shared = outer.cloned().collect();
                }
                self.sums = Some(Sums::default());
            }
            self.block(&mut plate.body);
            if is_outermost {
                planned.sums = self.sums.take().unwrap_or_default();
                self.shared.clear();
            }
        }
        self.plates.insert(id, planned);
    }
}
