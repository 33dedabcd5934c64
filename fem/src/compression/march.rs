//! The march through the load steps.

use super::curve::{CurvePoint, End, Fields, Observer, Outcome};
use super::discretisation::Discretisation;
use super::loading::{Loading, Stepping};
use crate::error::FemError;
use crate::material::PointMaterial;
use crate::operator::Span;
use crate::solve::{Solver, SolverOptions, StepFailure};

/// A step that converges lets the next one grow by this factor.
const GROWTH: f64 = 1.5;
/// A step that does not is cut by this one.
const CUT: f64 = 0.5;
/// Least step, as a share of the displacement.
const LEAST: f64 = 1e-6;

/// A run in progress. The clock is the share of the full displacement.
pub(super) struct March<'a> {
    domain: &'a Discretisation,
    materials: &'a [PointMaterial],
    loading: Loading,
    options: SolverOptions,
    observer: &'a mut dyn Observer,
    curve: Vec<CurvePoint>,
    /// The last equilibrium.
    fields: Fields,
    /// Its change over the increment before, and that increment: for the next guess.
    change: Option<(Fields, f64)>,
    state: CurvePoint,
    clock: f64,
}

impl<'a> March<'a> {
    pub(super) fn new(
        domain: &'a Discretisation,
        materials: &'a [PointMaterial],
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
            state: CurvePoint::default(),
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

    fn finish(self, end: End, effort: crate::solve::Effort) -> Outcome {
        Outcome { curve: self.curve, end, fields: self.fields, effort }
    }

    /// Steps until an end is reached.
    fn steps(&mut self, solver: &mut Solver) -> End {
        let (mut step, largest) = match self.loading.stepping {
            Stepping::Fixed(steps) => (1.0 / f64::from(steps), 1.0 / f64::from(steps)),
            Stepping::Adaptive { first, largest } => (first, largest),
        };
        let mut peak = 0.0f64;
        let mut recorded = 0u32;
        loop {
            // the next point to land on: each of the fixed steps, or the end
            let mark = match self.loading.stepping {
                Stepping::Fixed(steps) => f64::from(recorded + 1) / f64::from(steps),
                Stepping::Adaptive { .. } => 1.0,
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
            recorded += 1;
            self.curve.push(self.state);
            if self.observer.step(&self.state, &self.fields).is_break() {
                return End::Interrupted;
            }
            peak = peak.max(self.state.force_n);
            if self
                .loading
                .stop_below_peak
                .is_some_and(|share| self.state.force_n < (1.0 - share) * peak)
            {
                return End::BelowPeak;
            }
            if self.clock >= 1.0 {
                return End::Displacement;
            }
            self.state.newton = 0;
        }
    }

    fn failure(&self, step: f64, reason: StepFailure) -> End {
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
        let span =
            Span { damage_before: &self.fields.damage, duration: step * self.loading.duration_s };
        self.state.newton += solver.solve(&mut fields, span)?;
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
            work_n_mm: self.state.work_n_mm
                + 0.5 * (force + self.state.force_n) * (down - self.state.displacement_mm),
            phi_mean: self.domain.operator.mean(&fields.damage, damaged),
            phi_max: fields.damage.iter().copied().fold(0.0, f64::max),
            newton: self.state.newton,
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
    fn guess(&self, target: f64) -> Fields {
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
        for &n in &self.domain.platens.top {
            fields.displacement[n as usize][2] = -target * self.loading.displacement_mm;
        }
        for &n in &self.domain.platens.bottom {
            fields.displacement[n as usize][2] = 0.0;
        }
        fields
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
