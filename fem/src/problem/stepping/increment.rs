//! One increment, from one equilibrium to the next.

use crate::boundary::ExternalForces;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::parallel::Ranks;
use crate::problem::control::{PlatenLoad, Step};
use crate::problem::curve::CurvePoint;
use crate::problem::definition::Setup;
use crate::problem::sensitivity::carry_rates;
use crate::problem::state::RunState;
use crate::solve::{ArcLengthControl, Effort, Solver};

/// Finite-difference step for the derivative of the residual with respect to the position of the loaded ends, as a
/// fraction of the duration.
const NUDGE: f64 = 1e-6;
/// Prescribed displacements count as a jump if they differ from the extrapolated displacements by more than this
/// fraction of their increment.
const JUMP: f64 = 0.1;
/// A difference between prescribed and extrapolated displacements below this fraction of the largest prescribed
/// displacement counts as a rounding error, not as a jump.
const ROUNDED: f64 = 1e-9;

/// State and solver of a run, which increments advance.
pub(super) struct Increments<'a> {
    pub(super) setup: &'a Setup,
    pub(super) solver: Solver<'a>,
    /// The last equilibrium; with several ranks, the part of this rank.
    pub(super) state: RunState,
    /// Loads and contact of the last equilibrium. The solver stores the loads and contact of the last attempt, which
    /// may have failed.
    pub(super) accepted: ExternalForces,
}

impl<'a> Increments<'a> {
    /// Creates the increments of a run from the unloaded body.
    pub(super) fn new(setup: &'a Setup) -> Self {
        let field = setup.definition.phase_field.as_ref();
        let state =
            RunState::new(&setup.discretisation, field, &setup.point_materials, setup.shifts.len());
        let accepted = ExternalForces::none(&setup.discretisation.boundary);
        Self { setup, solver: setup.solver(), state, accepted }
    }

    /// Replaces the solver by a new solver without tangents and factors of earlier steps. The counters and scales of
    /// the state continue.
    pub(super) fn renew_solver(&mut self) {
        self.solver = self.setup.solver();
        self.solver.newton.resume(self.state.effort);
        self.solver.newton.scales = self.state.scales;
    }

    /// Computes the loads and the contact of the last equilibrium from a saved state, which does not contain them.
    pub(super) fn renew_contact(&mut self) {
        let (setup, state) = (self.setup, &self.state);
        let (Some(change), Some(step)) = (state.past.change(), state.past.step()) else { return };
        let domain = setup.discretisation.as_ref();
        if domain.boundary.contacts.is_empty() {
            return;
        }
        let duration_s = setup.definition.schedule.duration_s;
        let mut before = state.fields.without_state();
        before.add_scaled(-1.0, change);
        let context = state.memory.context(&before.damage, step * duration_s);
        self.accepted = ExternalForces::new(
            &domain.boundary,
            domain.operator.domain(),
            state.clock * duration_s,
            &before,
            context,
            &state.pressures,
            self.modulus_mpa(),
        );
    }

    /// Returns the largest modulus λ + 2μ of the materials, MPa.
    fn modulus_mpa(&self) -> f64 {
        self.setup.point_materials.iter().map(|m| m.moduli.longitudinal()).fold(0.0, f64::max)
    }

    pub(super) fn ranks(&self) -> &'a Ranks {
        &self.setup.definition.ranks
    }

    /// Returns the counters of the work that the solver has done so far.
    pub(super) fn effort(&self) -> Effort {
        self.solver.newton.effort
    }

    /// Increments the counter of reduced load steps.
    pub(super) fn count_cut(&mut self) {
        self.solver.newton.effort.cuts += 1;
    }

    /// Takes one step. If the step prescribes the position of the loaded ends, it ends at the time that `target`
    /// gives as a fraction of the duration.
    pub(super) fn take(&mut self, step: Step, target: f64) -> Result<(), StepFailure> {
        match step {
            Step::Advance(_) => self.advance(target),
            Step::AdvanceWithin { most_n_mm, .. } => self.advance_within(target, most_n_mm),
            Step::Release { n_mm, guess } => self.release(n_mm, self.state.clock + guess),
        }
    }

    fn advance(&mut self, target: f64) -> Result<(), StepFailure> {
        let (setup, state) = (self.setup, &self.state);
        let domain = setup.discretisation.as_ref();
        let time_s = target * setup.definition.schedule.duration_s;
        let duration = (target - state.clock) * setup.definition.schedule.duration_s;
        let context = state.memory.context(&state.fields.damage, duration);
        let modulus = self.modulus_mpa();
        let (space, pressures) = (domain.operator.domain(), &state.pressures);
        let fields = &state.fields;
        self.solver.newton.external = ExternalForces::new(
            &domain.boundary,
            space,
            time_s,
            fields,
            context,
            pressures,
            modulus,
        );
        let (mut fields, jumps) = self.guess(target)?;
        if !self.solver.newton.external.is_finite() {
            return Err(StepFailure::Condition);
        }
        let before = self.effort();
        if jumps && let Ok(predicted) = self.solver.predict(&self.state.fields, &fields, context) {
            fields = predicted;
        }
        match self.prescribed_force_n(target) {
            Some(force_n) => self.carry(&mut fields, force_n, duration)?,
            None => drop(self.solver.equilibrium(&mut fields, context)?),
        }
        self.accept(before, fields, target)
    }

    /// Displacement or force of the platen at `target`; `None` unless the load program prescribes a force.
    fn platen_load(&self, target: f64) -> Option<PlatenLoad> {
        let schedule = &self.setup.definition.schedule;
        let program = schedule.force_program.as_ref()?;
        Some(program.load_at(target * schedule.duration_s, self.state.corner))
    }

    /// Force of the platen at `target`, N, if the load program prescribes the force there.
    fn prescribed_force_n(&self, target: f64) -> Option<f64> {
        match self.platen_load(target)? {
            PlatenLoad::Displacement(_) => None,
            PlatenLoad::Force(force_n) => Some(force_n),
        }
    }

    /// Takes a step; returns an error if the step adds more than `most_n_mm` to the crack energy.
    fn advance_within(&mut self, target: f64, most_n_mm: f64) -> Result<(), StepFailure> {
        let (mut fields, _) = self.guess(target)?;
        let before = self.effort();
        let context = self.state.memory.context(&self.state.fields.damage, 1.0);
        self.solver.newton.solve_both(&mut fields, context)?;
        let released_n_mm = self.solver.newton.residual.fracture - self.state.point.fracture_n_mm;
        if released_n_mm > most_n_mm {
            return Err(StepFailure::Release { released_n_mm, allowed_n_mm: most_n_mm });
        }
        self.accept(before, fields, target)
    }

    /// Takes a step that adds `n_mm` to the crack energy. The position of the loaded ends is an unknown, with the
    /// initial value `guess`.
    fn release(&mut self, n_mm: f64, guess: f64) -> Result<(), StepFailure> {
        let (mut fields, _) = self.guess(guess)?;
        let before = self.effort();
        let setup = self.setup;
        let control = ArcLengthControl {
            place: &|fields: &mut Fields, position| setup.impose(fields, position),
            nudge: NUDGE,
            fracture: self.state.point.fracture_n_mm + n_mm,
            release: n_mm,
        };
        let context = self.state.memory.context(&self.state.fields.damage, 1.0);
        let position = self.solver.release(&mut fields, guess, &control, context)?;
        self.accept(before, fields, position)
    }

    /// Stores the equilibrium that the solver found at `target` as the new state. After an error, the state is
    /// unchanged.
    fn accept(&mut self, before: Effort, fields: Fields, target: f64) -> Result<(), StepFailure> {
        let domain = self.setup.discretisation.as_ref();
        let time_s = target * self.setup.definition.schedule.duration_s;
        let (external, residual) = (&self.solver.newton.external, &self.solver.newton.residual);
        let reactions = external.reactions(&domain.boundary, &fields, residual);
        let [displacement_mm, force_n] = domain.boundary.measure(time_s, &fields, &reactions);
        if !displacement_mm.is_finite() {
            return Err(StepFailure::Condition);
        }
        let force_is_prescribed = self.prescribed_force_n(target).is_some();
        let step = target - self.state.clock;
        let duration = step * self.setup.definition.schedule.duration_s;
        let (operator, materials) = (domain.operator.as_ref(), &self.setup.point_materials);
        let law_state = self.state.memory.law_state_at(operator, materials, &fields, duration)?;
        // all operations that can fail are before this line, so that a failed increment does not change the state
        carry_rates(self.setup, &mut self.solver, &mut self.state, &fields, target);
        let (newton, state) = (&self.solver.newton, &mut self.state);
        let (external, residual) = (&newton.external, &newton.residual);
        let forces = external.outer_forces(&domain.boundary, &fields, residual);
        let friction = external.dissipated(&fields);
        let law_state = state.memory.record(law_state, materials, &fields, duration);
        let mut change = fields.clone();
        change.add_scaled(-1.0, &state.fields);
        // compute the work of the external forces, which balance the forces of the stress at each node; the energy that
        // friction dissipates at the platens is not part of this work and is added below
        let (part, ranks) = (domain.operator.part(), domain.operator.part().ranks());
        let halo = &part.halo;
        let moved = halo.own_of(&change.displacement).zip(halo.own_of(&change.damage));
        let work: f64 = (halo.own_of(&forces).zip(halo.own_of(&state.forces)).zip(moved))
            .map(|((f, g), (&[x, y, z], &phi))| {
                let moved = [x, y, z, phi];
                (0..4).map(|k| 0.5 * (f[k] + g[k]) * moved[k]).sum::<f64>()
            })
            .sum();
        let [integral, volume] = domain.operator.domain().integral(&fields.damage, &domain.damaged);
        let mut sums = [work, integral, volume];
        ranks.sum(&mut sums);
        let [work, integral, volume] = sums;
        let mut phi_max = [fields.damage.iter().copied().fold(0.0, f64::max)];
        ranks.max(&mut phi_max);
        let last = &state.point;
        state.point = CurvePoint {
            time_s,
            displacement_mm,
            force_n,
            elastic_n_mm: residual.elastic,
            fracture_n_mm: residual.fracture,
            viscous_n_mm: last.viscous_n_mm + residual.viscous,
            force_is_prescribed,
            friction_n_mm: last.friction_n_mm + friction,
            work_n_mm: last.work_n_mm + work + friction,
            phi_mean: if volume > 0.0 { integral / volume } else { 0.0 },
            phi_max: phi_max[0],
            newton: last.newton + newton.effort.iterations - before.iterations,
            linear: last.linear + newton.effort.linear - before.linear,
            residual: newton.relative,
        };
        state.reaction = reactions;
        state.pressures = external.pressures();
        state.forces = forces;
        state.past.add(change, step);
        state.fields = Fields { state: law_state, ..fields };
        state.clock = target;
        if self.setup.definition.schedule.is_corner(target) {
            self.state.corner = [displacement_mm, force_n];
        }
        self.state.scales = self.solver.newton.keep_scales();
        self.accepted = self.solver.newton.external.clone();
        Ok(())
    }

    /// Returns the initial guess of the equilibrium at `target`: the extrapolated fields, with the prescribed values of
    /// the increment. The flag is true if the prescribed displacements jump, i.e. differ much from the extrapolated
    /// displacements. Returns an error if a prescribed value or the guess is not finite.
    fn guess(&self, target: f64) -> Result<(Fields, bool), StepFailure> {
        let (setup, state) = (self.setup, &self.state);
        let boundary = &setup.discretisation.boundary;
        let mut fields = state.fields.without_state();
        if setup.definition.schedule.is_corner(state.clock) {
            // do not extrapolate past a corner, where the speed of the load changes
        } else if state.past.step().is_some() {
            let part = setup.discretisation.operator.part();
            let size = |term: &Fields| {
                let moved = part.halo.own_of(&term.displacement).flatten().map(|u| u * u).sum();
                let mut size = [moved, part.halo.own_of(&term.damage).map(|d| d * d).sum()];
                part.ranks().sum(&mut size);
                size.map(f64::sqrt)
            };
            let since_corner = setup.definition.schedule.since_corner(state.clock);
            state.past.continue_by(target - state.clock, since_corner, &mut fields, size);
        } else {
            let time_s = target * setup.definition.schedule.duration_s;
            boundary.start(setup.discretisation.nodes(), time_s, &mut fields);
        }
        match self.platen_load(target) {
            Some(PlatenLoad::Displacement(platen_mm)) => fields.platen_mm = platen_mm,
            // the extrapolated displacement of the platen is the initial guess
            Some(PlatenLoad::Force(_)) | None => {}
        }
        let continued = fields.clone();
        setup.impose(&mut fields, target);
        if self.ranks().any(!fields.is_finite()) {
            return Err(StepFailure::Condition);
        }
        let [off, step, largest] = boundary.jump(&continued, &state.fields, &fields);
        Ok((fields, off > JUMP * step && off > ROUNDED * largest))
    }
}
