//! The march through the load steps.

use super::curve::{CurvePoint, End, Fields, Observer, Outcome};
use super::discretisation::Discretisation;
use super::loading::{Loading, Stepping};
use super::memory::Memory;
use crate::error::FemError;
use crate::material::{PhaseField, PointMaterial};
use crate::solve::{Effort, Solver, SolverOptions, StepFailure};

/// A step that converges lets the next one grow by this factor.
const GROWTH: f64 = 1.5;
/// A step that does not is cut by this one.
const CUT: f64 = 0.5;
/// Least step, as a share of the displacement.
const LEAST: f64 = 1e-6;

/// A run in progress. The clock is the share of the full displacement.
pub(super) struct March<'a> {
    pub(super) domain: &'a Discretisation,
    pub(super) materials: &'a [PointMaterial],
    pub(super) loading: Loading,
    pub(super) options: SolverOptions,
    pub(super) observer: &'a mut dyn Observer,
    pub(super) curve: Vec<CurvePoint>,
    /// The last equilibrium.
    pub(super) fields: Fields,
    /// Its change over the increment before, and that increment: for the next guess.
    pub(super) change: Option<(Fields, f64)>,
    pub(super) memory: Memory,
    /// What the last step of prescribed release released, N mm.
    pub(super) released: Option<f64>,
    pub(super) state: CurvePoint,
    /// Largest force so far, N.
    pub(super) peak: f64,
    pub(super) clock: f64,
}

impl<'a> March<'a> {
    pub(super) fn new(
        domain: &'a Discretisation,
        materials: &'a [PointMaterial],
        phase_field: Option<&PhaseField>,
        loading: Loading,
        options: SolverOptions,
        observer: &'a mut dyn Observer,
    ) -> Self {
        Self {
            domain,
            materials,
            loading,
            options,
            observer,
            curve: Vec::new(),
            fields: Fields::zero(domain.nodes.len()),
            change: None,
            memory: Memory::new(phase_field, domain.operator.as_ref(), domain.nodes.len()),
            state: CurvePoint::default(),
            peak: 0.0,
            released: None,
            clock: 0.0,
        }
    }

    pub(super) fn run(mut self) -> Outcome {
        let domain = self.domain;
        let operator = domain.operator.as_ref();
        let linear = domain.linear.solver(operator);
        let mut solver =
            Solver::new(operator, &domain.unknowns, self.materials, self.options, linear);
        let end = self.steps(&mut solver);
        self.finish(end, solver.effort)
    }

    fn finish(self, end: End, effort: Effort) -> Outcome {
        Outcome { curve: self.curve, end, fields: self.fields, effort }
    }

    /// Steps until an end is reached.
    fn steps(&mut self, solver: &mut Solver) -> End {
        let (mut step, largest) = match self.loading.stepping {
            Stepping::Fixed(steps) => (1.0 / f64::from(steps), 1.0 / f64::from(steps)),
            Stepping::Adaptive { first, largest } => (first, largest),
            Stepping::ArcLength { step, release_n_mm } => {
                return self.follow(solver, step, release_n_mm);
            }
        };
        loop {
            // the next point to land on: each of the fixed steps, or the end
            let mark = match self.loading.stepping {
                Stepping::Fixed(steps) => (self.curve.len() + 1) as f64 / f64::from(steps),
                _ => 1.0,
            };
            // no sliver of a step before the mark
            let target = if self.clock + 1.01 * step >= mark { mark } else { self.clock + step };
            match self.advance(solver, target) {
                Err(_) if step > LEAST => {
                    solver.effort.cuts += 1;
                    step = CUT * (target - self.clock);
                    continue;
                }
                Err(reason) => return self.failure(step, reason),
                Ok(()) => step = largest.min(GROWTH * step),
            }
            if matches!(self.loading.stepping, Stepping::Fixed(_)) && target < mark {
                continue;
            }
            if let Some(end) = self.observe() {
                return end;
            }
        }
    }

    /// Puts the state on the curve; the end, if it is one.
    pub(super) fn observe(&mut self) -> Option<End> {
        self.curve.push(self.state);
        if self.observer.step(&self.state, &self.fields).is_break() {
            return Some(End::Interrupted);
        }
        self.peak = self.peak.max(self.state.force_n);
        let below = |share| self.state.force_n < (1.0 - share) * self.peak;
        if self.loading.stop_below_peak.is_some_and(below) {
            return Some(End::BelowPeak);
        }
        if self.clock >= 1.0 {
            return Some(End::Displacement);
        }
        (self.state.newton, self.state.linear) = (0, 0);
        None
    }

    pub(super) fn failure(&self, step: f64, reason: StepFailure) -> End {
        let full = self.loading.displacement_mm;
        End::Failed(FemError::NotConverged {
            displacement_mm: self.clock * full,
            step_mm: step * full,
            reason: reason.to_string(),
        })
    }

    /// One increment, to the share `target` of the displacement.
    fn advance(&mut self, solver: &mut Solver, target: f64) -> Result<(), StepFailure> {
        let step = target - self.clock;
        let mut fields = self.guess(target);
        let span = self.memory.span(&self.fields.damage, step * self.loading.duration_s);
        let before = solver.effort;
        solver.solve(&mut fields, span)?;
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
        let step = target - self.clock;
        self.memory.record(self.domain.operator.as_ref(), self.materials, &fields)?;
        let force = -self
            .domain
            .platens
            .top
            .iter()
            .map(|&n| solver.residual.nodal[n as usize][2])
            .sum::<f64>();
        let down = target * self.loading.displacement_mm;
        let damaged = &self.domain.damaged;
        self.state = CurvePoint {
            time_s: target * self.loading.duration_s,
            displacement_mm: down,
            force_n: force,
            elastic_n_mm: solver.residual.elastic,
            fracture_n_mm: solver.residual.fracture,
            viscous_n_mm: self.state.viscous_n_mm + solver.residual.viscous,
            friction_n_mm: self.state.friction_n_mm,
            work_n_mm: self.state.work_n_mm
                + 0.5 * (force + self.state.force_n) * (down - self.state.displacement_mm),
            phi_mean: self.domain.operator.mean(&fields.damage, damaged),
            phi_max: fields.damage.iter().copied().fold(0.0, f64::max),
            newton: self.state.newton + solver.effort.iterations - before.iterations,
            linear: self.state.linear + solver.effort.linear - before.linear,
        };
        let mut change = fields.clone();
        subtract(&mut change, &self.fields);
        self.change = Some((change, step));
        self.fields = fields;
        self.clock = target;
        Ok(())
    }

    /// Where the next increment is started: the last one continued, or at first a uniform
    /// shortening; the platens are put where they belong.
    pub(super) fn guess(&self, target: f64) -> Fields {
        let mut fields = self.fields.clone();
        let bottom = self.domain.nodes[self.domain.platens.pivot as usize][2];
        match &self.change {
            Some((change, step)) => {
                let ratio = (target - self.clock) / step;
                for (u, du) in fields.displacement.iter_mut().zip(&change.displacement) {
                    for k in 0..3 {
                        u[k] += ratio * du[k];
                    }
                }
                fields.damage.iter_mut().zip(&change.damage).for_each(|(phi, d)| *phi += ratio * d);
            }
            None => {
                let shortening = target * self.loading.displacement_mm / self.domain.height;
                for (u, x) in fields.displacement.iter_mut().zip(&self.domain.nodes) {
                    u[2] = -shortening * (x[2] - bottom);
                }
            }
        }
        self.place(&mut fields, target);
        fields
    }

    /// Puts the platens where they belong.
    pub(super) fn place(&self, fields: &mut Fields, target: f64) {
        for &n in &self.domain.platens.top {
            fields.displacement[n as usize][2] = -target * self.loading.displacement_mm;
        }
        for &n in &self.domain.platens.bottom {
            fields.displacement[n as usize][2] = 0.0;
        }
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
