//! The march through the load steps.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::checkpoint::Checkpoint;
use super::curve::{CurvePoint, End, Observer, Outcome};
use super::discretisation::Discretisation;
use super::loading::{Schedule, Stepping};
use super::memory::Memory;
use crate::boundary::Applied;
use crate::error::FemError;
use crate::fields::Fields;
use crate::material::{PhaseField, PointMaterial};
use crate::solve::{Effort, Solver, SolverOptions, StepFailure};

/// A step that converges lets the next one grow by this factor.
const GROWTH: f64 = 1.5;
/// A step that does not is cut by this one.
const CUT: f64 = 0.5;
/// Least step, as a share of the duration.
const LEAST: f64 = 1e-6;

/// A run in progress. The clock is the share of the whole duration.
pub(crate) struct March<'a> {
    pub(super) domain: &'a Discretisation,
    pub(super) materials: &'a [PointMaterial],
    pub(super) schedule: Schedule,
    pub(super) options: SolverOptions,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) state: State,
    checkpoint: Option<(&'a Checkpoint, u64)>,
}

/// All that a run carries from step to step.
#[derive(Clone, Debug, Default)]
pub(crate) struct State {
    pub(crate) curve: Vec<CurvePoint>,
    pub(crate) reactions: BTreeMap<String, Vec<[f64; 3]>>,
    /// The last equilibrium.
    pub(crate) fields: Fields,
    /// Its change over the increment before, and that increment: for the next guess.
    pub(crate) change: Option<(Fields, f64)>,
    /// Stress forces at its nodes, N: for the work of the next increment.
    pub(crate) forces: Vec<[f64; 3]>,
    /// Reactions at it, N.
    pub(crate) reaction: BTreeMap<String, [f64; 3]>,
    /// What damage remembers.
    pub(crate) memory: Memory,
    /// What steps of prescribed release remember.
    pub(crate) arc: ArcState,
    /// Contact pressures, platen by platen, MPa; empty before the first increment.
    pub(crate) pressures: Vec<Vec<f64>>,
    pub(crate) point: CurvePoint,
    pub(crate) clock: f64,
    /// The next increment to try.
    pub(crate) step: f64,
    pub(crate) recorded: u32,
    pub(crate) peak: f64,
    pub(crate) effort: Effort,
}

/// Where steps of prescribed release stand.
#[derive(Clone, Copy, Debug, Default, Serialize, Deserialize)]
pub(crate) struct ArcState {
    /// Whether the release leads, and not the position of the ends.
    pub(crate) leads: bool,
    /// The next release to try, N mm.
    pub(crate) release: f64,
    /// What the last such step released, N mm.
    pub(crate) released: Option<f64>,
}

impl<'a> March<'a> {
    pub(crate) fn new(
        domain: &'a Discretisation,
        materials: &'a [PointMaterial],
        phase_field: Option<&PhaseField>,
        schedule: Schedule,
        options: SolverOptions,
        observer: &'a mut dyn Observer,
    ) -> Self {
        let state = State {
            fields: Fields::zero(domain.nodes().len()),
            memory: Memory::new(phase_field, domain.operator.as_ref(), domain.nodes().len()),
            forces: vec![[0.0; 3]; domain.nodes().len()],
            reactions: domain.boundary.surfaces.keys().map(|k| (k.clone(), vec![])).collect(),
            step: match schedule.stepping {
                Stepping::Fixed(steps) => 1.0 / f64::from(steps),
                Stepping::Adaptive { first, .. } => first,
                Stepping::ArcLength { step, .. } => step,
            },
            arc: match schedule.stepping {
                Stepping::ArcLength { release_n_mm, .. } => {
                    ArcState { release: release_n_mm, ..ArcState::default() }
                }
                _ => ArcState::default(),
            },
            ..State::default()
        };
        Self { domain, materials, schedule, options, observer, state, checkpoint: None }
    }

    /// The same run with its state on disk, or continued from there; `fingerprint` is the test's.
    pub(crate) fn with_checkpoint(
        mut self,
        checkpoint: &'a Checkpoint,
        fingerprint: u64,
    ) -> Result<Self, FemError> {
        if checkpoint.load(fingerprint, &mut self.state)? {
            self.observer.resumed(&self.state.curve);
        }
        self.checkpoint = Some((checkpoint, fingerprint));
        Ok(self)
    }

    pub(crate) fn run(mut self) -> Outcome {
        let mut solver = self.solver();
        let end = self.steps(&mut solver);
        let fields = self.state.fields;
        let contact = solver.applied.contacts.iter();
        Outcome {
            curve: self.state.curve,
            end,
            contact: contact.map(|c| (c.surface.clone(), c.points(&fields))).collect(),
            fields,
            reactions: self.state.reactions,
            effort: solver.effort,
        }
    }

    /// A solver that remembers nothing but the work done.
    fn solver(&self) -> Solver<'a> {
        let (domain, operator) = (self.domain, self.domain.operator.as_ref());
        let linear = domain.linear.solver(operator);
        let mut solver =
            Solver::new(operator, &domain.unknowns, self.materials, self.options, linear);
        solver.effort = self.state.effort;
        solver
    }

    /// Saves the state where one is due.
    fn save(&mut self, solver: &mut Solver<'a>) -> Result<(), FemError> {
        let Some((checkpoint, fingerprint)) = self.checkpoint else { return Ok(()) };
        if self.state.recorded.is_multiple_of(checkpoint.every) {
            self.state.effort = solver.effort;
            checkpoint.save(&self.state, fingerprint)?;
            *solver = self.solver();
        }
        Ok(())
    }

    /// Steps until an end is reached.
    fn steps(&mut self, solver: &mut Solver<'a>) -> End {
        let largest = match self.schedule.stepping {
            Stepping::Fixed(steps) => 1.0 / f64::from(steps),
            Stepping::Adaptive { largest, .. } => largest,
            Stepping::ArcLength { step, release_n_mm } => {
                return self.follow(solver, step, release_n_mm);
            }
        };
        loop {
            // the next point to land on: each of the fixed steps, or the end
            let mark = match self.schedule.stepping {
                Stepping::Fixed(steps) => f64::from(self.state.recorded + 1) / f64::from(steps),
                _ => 1.0,
            };
            let (clock, step) = (self.state.clock, self.state.step);
            // no sliver of a step before the mark
            let target = if clock + 1.01 * step >= mark { mark } else { clock + step };
            match self.advance(solver, target) {
                Err(_) if step > LEAST => {
                    solver.effort.cuts += 1;
                    self.state.step = CUT * (target - clock);
                    continue;
                }
                Err(reason) => return self.failure(reason),
                Ok(()) => self.state.step = largest.min(GROWTH * step),
            }
            if matches!(self.schedule.stepping, Stepping::Fixed(_)) && target < mark {
                continue;
            }
            if let Some(end) = self.record(solver) {
                return end;
            }
        }
    }

    /// Puts the state on the curve, and on disk where it is due unless the run has reached its end.
    pub(super) fn record(&mut self, solver: &mut Solver<'a>) -> Option<End> {
        let end = self.observe();
        if matches!(end, None | Some(End::Interrupted))
            && let Err(error) = self.save(solver)
        {
            return Some(End::Failed(error));
        }
        end
    }

    /// Puts the state on the curve; the end, if it is one.
    fn observe(&mut self) -> Option<End> {
        let state = &mut self.state;
        state.recorded += 1;
        state.curve.push(state.point);
        for (surface, &force) in &state.reaction {
            state.reactions.entry(surface.clone()).or_default().push(force);
        }
        state.peak = state.peak.max(state.point.force_n);
        let below = |share| state.point.force_n < (1.0 - share) * state.peak;
        let below_peak = self.schedule.stop_below_peak.is_some_and(below);
        let stop = self.observer.step(&state.point, &state.fields).is_break();
        (state.point.newton, state.point.linear) = (0, 0);
        if below_peak {
            return Some(End::BelowPeak);
        }
        if state.clock >= 1.0 {
            return Some(End::Displacement);
        }
        stop.then_some(End::Interrupted)
    }

    pub(super) fn failure(&self, reason: StepFailure) -> End {
        End::Failed(FemError::NotConverged {
            displacement_mm: self.state.point.displacement_mm,
            time_s: self.state.clock * self.schedule.duration_s,
            step_s: self.state.step * self.schedule.duration_s,
            reason: reason.to_string(),
        })
    }

    /// One increment, to the share `target` of the duration.
    fn advance(&mut self, solver: &mut Solver, target: f64) -> Result<(), StepFailure> {
        let (domain, state) = (self.domain, &self.state);
        let time_s = target * self.schedule.duration_s;
        let duration = (target - state.clock) * self.schedule.duration_s;
        let span = state.memory.span(&state.fields.damage, duration);
        let young = self.materials.iter().map(|m| m.moduli.young()).fold(0.0, f64::max);
        let (space, pressures) = (domain.operator.domain(), &state.pressures);
        solver.applied =
            Applied::new(&domain.boundary, space, time_s, &state.fields, span, pressures, young);
        let mut fields = self.guess(target);
        let before = solver.effort;
        solver.equilibrium(&mut fields, span)?;
        self.accept(solver, before, fields, target)
    }

    /// Takes the equilibrium that the solver found at `target` as the state.
    pub(super) fn accept(
        &mut self,
        solver: &Solver,
        before: Effort,
        fields: Fields,
        target: f64,
    ) -> Result<(), StepFailure> {
        let (domain, state) = (self.domain, &mut self.state);
        let step = target - state.clock;
        let time_s = target * self.schedule.duration_s;
        state.memory.record(domain.operator.as_ref(), self.materials, &fields)?;
        let (applied, residual) = (&solver.applied, &solver.residual);
        let reactions = applied.reactions(&domain.boundary, &fields, residual);
        let forces = applied.stress_forces(&fields, residual);
        let friction = applied.dissipated(&fields);
        let [displacement_mm, force_n] =
            domain.boundary.measure(time_s, &fields.displacement, &reactions);
        let mut change = fields.clone();
        subtract(&mut change, &state.fields);
        // what acts from outside balances the stress forces node by node; what friction takes from
        // the platens does not reach the body
        let work: f64 = forces
            .iter()
            .zip(&state.forces)
            .zip(&change.displacement)
            .map(|((f, g), du)| (0..3).map(|k| 0.5 * (f[k] + g[k]) * du[k]).sum::<f64>())
            .sum();
        let last = &state.point;
        state.point = CurvePoint {
            time_s,
            displacement_mm,
            force_n,
            elastic_n_mm: residual.elastic,
            fracture_n_mm: residual.fracture,
            viscous_n_mm: last.viscous_n_mm + residual.viscous,
            friction_n_mm: last.friction_n_mm + friction,
            work_n_mm: last.work_n_mm + work + friction,
            phi_mean: domain.operator.domain().mean(&fields.damage, &domain.damaged),
            phi_max: fields.damage.iter().copied().fold(0.0, f64::max),
            newton: last.newton + solver.effort.iterations - before.iterations,
            linear: last.linear + solver.effort.linear - before.linear,
            residual: solver.relative,
        };
        state.reaction = reactions;
        state.pressures = applied.contacts.iter().map(|c| c.pressures()).collect();
        state.forces = forces;
        state.change = Some((change, step));
        state.fields = fields;
        state.clock = target;
        Ok(())
    }

    /// Where the next increment is started: the last one continued, with the held values put where
    /// they belong.
    pub(super) fn guess(&self, target: f64) -> Fields {
        let (domain, state) = (self.domain, &self.state);
        let mut fields = state.fields.clone();
        match &state.change {
            Some((change, step)) => {
                let ratio = (target - state.clock) / step;
                for (u, du) in fields.displacement.iter_mut().zip(&change.displacement) {
                    for k in 0..3 {
                        u[k] += ratio * du[k];
                    }
                }
                fields.damage.iter_mut().zip(&change.damage).for_each(|(phi, d)| *phi += ratio * d);
            }
            None => {
                let time_s = target * self.schedule.duration_s;
                domain.boundary.start(domain.nodes(), time_s, &mut fields);
            }
        }
        self.place(&mut fields, target);
        fields
    }

    /// Puts the held values where they belong.
    pub(super) fn place(&self, fields: &mut Fields, target: f64) {
        let time_s = target * self.schedule.duration_s;
        self.domain.boundary.impose(self.domain.nodes(), time_s, fields);
    }
}

fn subtract(a: &mut Fields, b: &Fields) {
    for (u, v) in a.displacement.iter_mut().zip(&b.displacement) {
        for k in 0..3 {
            u[k] -= v[k];
        }
    }
    a.damage.iter_mut().zip(&b.damage).for_each(|(x, y)| *x -= y);
}
