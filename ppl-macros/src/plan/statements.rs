//! What becomes of every statement.

use std::collections::BTreeSet;

use syn::visit_mut::VisitMut;
use syn::{Expr, Pat};

use super::expressions::{Shared, Writer};
use super::literals;
use super::steps::{self, Action, Body, Observation, Plan, Step};
use crate::analyse::{Analysis, Facts, declared};
use crate::ast::{Arm, ArmBody, Block, Flow, For, Id, Init, Kind, Mark, Model, Statement};
use crate::syntax::places::plain_name;

/// The plan of a model, or of a submodel, whose arithmetic goes over a tape.
pub(crate) fn plan(model: &Model, analysis: &Analysis) -> Plan {
    let formulas = model.value.is_none();
    let mut planner = Planner { analysis, formulas, shared: None, summed: None };
    Plan {
        body: planner.body(&model.body, false),
        sites: analysis.sites.clone(),
        is_static: analysis.is_static,
    }
}

struct Planner<'a> {
    analysis: &'a Analysis,
    /// Whether arithmetic becomes formulas.
    formulas: bool,
    /// The plate around.
    shared: Option<Shared>,
    /// The observations so far in the loops around, by their sites.
    summed: Option<Vec<usize>>,
}

impl<'a> Planner<'a> {
    /// In a block that is not itself predicted, `#[predict]` opens the part that runs on finished draws
    /// only.
    fn body(&mut self, block: &Block, is_predicted: bool) -> Body {
        let mut body =
            Body { brace: block.brace, always: Vec::new(), predicted: Vec::new(), value: None };
        let mut is_late = false;
        for statement in &block.statements {
            is_late |= !is_predicted && statement.mark == Mark::Predict;
            let step = self.step(statement);
            match statement.kind {
                Kind::End(_) => body.value = Some(Box::new(step)),
                _ if is_late => body.predicted.push(step),
                _ => body.always.push(step),
            }
        }
        body
    }

    fn step(&mut self, statement: &Statement) -> Step {
        let facts = self.analysis.facts(statement.id);
        let (attrs, names) = (statement.attrs.clone(), declared(&statement.kind));
        let refuse = |error| Action::Refuse { names, error };
        let broken = match &statement.kind {
            Kind::Broken { error, .. } => Some(error.clone()),
            _ => facts.error.clone(),
        };
        if let Some(error) = broken {
            return Step { attrs, labels: Vec::new(), action: refuse(error) };
        }
        let labels = statement.dims.iter().filter_map(|dim| {
            // they are needed in one evaluation only, and may not leave it
            let mut writer = self.writer(&facts, true).inside_closure();
            let labels = writer.value(dim.labels.as_ref()?);
            Some((dim.name.clone(), labels))
        });
        let labels = labels.collect();
        Step { attrs, labels, action: self.action(statement, &facts) }
    }

    fn action(&mut self, statement: &Statement, facts: &Facts) -> Action {
        let Statement { id, mark, kind, .. } = statement;
        let (site, is_predicted) = (facts.site.unwrap_or_default(), facts.is_predicted);
        let is_recorded = is_predicted || *mark != Mark::None;
        match kind {
            Kind::Unknown { let_token, name, tilde, distribution } => Action::Declare {
                let_token: *let_token,
                name: name.clone(),
                tilde: *tilde,
                site,
                distribution: self.writer(facts, is_recorded).distribution(distribution),
                is_predicted,
            },
            Kind::Part { let_token, name, tilde, part } => Action::Part {
                let_token: *let_token,
                name: name.clone(),
                tilde: *tilde,
                site,
                part: self.writer(facts, is_recorded).value(part),
                is_predicted,
                is_tracked: *mark == Mark::Track,
            },
            Kind::Observe { place, tilde, distribution } => {
                let mut observation = self.observation(facts, place, *tilde, distribution);
                if let (Some(summed), true) = (&mut self.summed, self.formulas) {
                    observation.is_summed = true;
                    summed.push(site);
                }
                Action::Observe(observation)
            }
            Kind::Impute { place, tilde, distribution } => Action::Complete {
                name: plain_name(place).cloned(),
                observation: self.observation(facts, place, *tilde, distribution),
            },
            Kind::Let { let_token, pat, init } => {
                let mut shown = pat.clone();
                self.writer(facts, is_recorded).visit_pat_mut(&mut shown);
                Action::Let {
                    let_token: *let_token,
                    init: init.as_ref().map(|init| self.init(*id, facts, pat, init, is_recorded)),
                    pat: shown,
                    recorded: facts.site.filter(|_| *mark != Mark::None),
                    is_predicted,
                }
            }
            Kind::Factor { name, weight } => Action::Factor {
                name: name.clone(),
                site,
                weight: self.writer(facts, is_recorded).value(weight),
            },
            Kind::Flow(Flow::For(plate)) => self.plate(*id, facts, plate),
            Kind::Flow(flow) => Action::Flow(self.flow(facts, flow)),
            Kind::End(init) => Action::Value(self.init(
                *id,
                facts,
                &Pat::Verbatim(Default::default()),
                init,
                false,
            )),
            Kind::Rust(stmt) => Action::Rust(self.writer(facts, is_recorded).statement(stmt)),
            Kind::Broken { names, error } => {
                Action::Refuse { names: names.clone(), error: error.clone() }
            }
        }
    }

    fn writer<'w>(&'w mut self, facts: &'w Facts, is_recorded: bool) -> Writer<'w> {
        let shared = self.shared.as_mut();
        Writer::new(&self.analysis.activity, facts, self.formulas, shared, is_recorded)
    }

    fn observation(
        &mut self,
        facts: &Facts,
        place: &Expr,
        tilde: syn::Token![~],
        distribution: &Expr,
    ) -> Observation {
        // a place is no arithmetic, whatever its index computes
        let shared = self.shared.take();
        let place = Writer::new(&self.analysis.activity, facts, false, None, true).value(place);
        self.shared = shared;
        Observation {
            attrs: Vec::new(),
            place,
            tilde,
            site: facts.site.unwrap_or_default(),
            distribution: self.writer(facts, false).distribution(distribution),
            is_summed: false,
        }
    }

    fn init(
        &mut self,
        id: Id,
        facts: &Facts,
        pat: &Pat,
        init: &Init,
        is_recorded: bool,
    ) -> steps::Init {
        match init {
            Init::Value { eq, value, diverge } => {
                let mut value = value.clone();
                if self.analysis.activity.begins(id) {
                    literals::begin(pat, &mut value);
                }
                let stays_open = self.formulas && self.analysis.stays_open(id);
                let mut writer = self.writer(facts, is_recorded);
                let value = if stays_open { writer.formula(&value) } else { writer.value(&value) };
                let mut other = |value| self.writer(facts, is_recorded).value(value);
                let diverge = diverge.as_ref().map(|(els, value)| (*els, other(value)));
                steps::Init::Value { eq: *eq, value, diverge }
            }
            Init::Flow(eq, flow) => {
                let mut flow = flow.clone();
                literals::align_arms(&mut flow);
                steps::Init::Flow(*eq, self.flow(facts, &flow))
            }
        }
    }

    fn flow(&mut self, facts: &Facts, flow: &Flow) -> steps::Flow {
        match flow {
            Flow::For(plate) => {
                let iter = self.writer(facts, facts.is_predicted).value(&plate.iter);
                steps::Flow::Plate(Box::new(self.for_loop(facts, plate, iter, false)))
            }
            Flow::If { if_token, condition, then, otherwise } => steps::Flow::If {
                if_token: *if_token,
                condition: self.writer(facts, facts.is_predicted).value(condition),
                then: self.body(then, facts.is_predicted),
                otherwise: otherwise
                    .as_ref()
                    .map(|(else_token, flow)| (*else_token, Box::new(self.flow(facts, flow)))),
            },
            Flow::Match { match_token, scrutinee, brace, arms } => steps::Flow::Match {
                match_token: *match_token,
                scrutinee: self.writer(facts, facts.is_predicted).value(scrutinee),
                brace: *brace,
                arms: arms.iter().map(|arm| self.arm(facts, arm)).collect(),
            },
            Flow::Block(block) => steps::Flow::Block(self.body(block, facts.is_predicted)),
        }
    }

    fn arm(&mut self, facts: &Facts, arm: &Arm) -> steps::Arm {
        let Arm { pat, guard, arrow, body } = arm;
        let is_recorded = facts.is_predicted;
        steps::Arm {
            pat: pat.clone(),
            guard: guard
                .as_ref()
                .map(|(if_token, guard)| (*if_token, self.writer(facts, is_recorded).value(guard))),
            arrow: *arrow,
            body: match body {
                ArmBody::Block(block) => {
                    steps::ArmBody::Block(self.body(block, facts.is_predicted))
                }
                ArmBody::Value(value) => {
                    steps::ArmBody::Value(self.writer(facts, is_recorded).value(value))
                }
            },
        }
    }

    /// A loop that stands as a statement.
    fn plate(&mut self, id: Id, facts: &Facts, plate: &For) -> Action {
        let Some(known) = self.analysis.plate(id).filter(|_| self.formulas) else {
            return Action::Flow(self.flow(facts, &Flow::For(Box::new(plate.clone()))));
        };
        if known.is_pooled
            && let [Statement { id, attrs, kind, .. }] = plate.body.statements.as_slice()
            && let Kind::Observe { place, tilde, distribution } = kind
            && let own = self.analysis.facts(*id)
            && own.error.is_none()
        {
            let data = self.writer(facts, facts.is_predicted).value(&plate.iter);
            let observation = self.observation(&own, place, *tilde, distribution);
            let observation = Observation { attrs: attrs.clone(), ..observation };
            return Action::ObserveAll { data, observation };
        }
        let iter = self.writer(facts, facts.is_predicted).value(&plate.iter);
        let is_outermost = known.unwinds && self.shared.is_none();
        if is_outermost {
            let outer = self.analysis.activity.names().filter(|name| !known.bound.contains(name));
            let (outer, used) = (outer.cloned().collect(), BTreeSet::new());
            self.shared = Some(Shared { outer, used });
        }
        let around = self.summed.take();
        let is_first = around.is_none();
        self.summed = Some(around.unwrap_or_default());
        let mut planned = self.for_loop(facts, plate, iter, known.unwinds);
        if is_first {
            planned.summed = self.summed.take().unwrap_or_default();
        }
        if is_outermost {
            let used = self.shared.take().map(|shared| shared.used);
            planned.shared = used.into_iter().flatten().collect();
        }
        Action::Flow(steps::Flow::Plate(Box::new(planned)))
    }

    fn for_loop(&mut self, facts: &Facts, plate: &For, iter: Expr, unwinds: bool) -> steps::Plate {
        let mut pat = plate.pat.clone();
        self.writer(facts, true).visit_pat_mut(&mut pat);
        steps::Plate {
            label: plate.label.clone(),
            for_token: plate.for_token,
            pat,
            in_token: plate.in_token,
            iter,
            body: self.body(&plate.body, facts.is_predicted),
            unwinds,
            shared: Vec::new(),
            summed: Vec::new(),
        }
    }
}
