//! Newton's method with line search, for both fields together or for one field.
//!
//! A tangent and its factor (a *linearisation*) are reused, also in later increments, while each solve reduces the
//! residual at least to a tenth. The reason is that the assembly and factorisation of a new tangent cost more than an
//! additional solve.

mod force_step;

use rayon::prelude::*;

use crate::boundary::ExternalForces;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::material::PointMaterial;
use crate::operator::{Coupling, Increment, NONE, Operator, Residual, StepContext, Unknowns};
use crate::solve::effort::Effort;
use crate::solve::force_control::ForceControl;
use crate::solve::linear::{CHUNK, LinearSolver, Nodal, Singular};
use crate::solve::norms::{Equations, Norms, Rounding, Scales};

/// Settings of Newton's method.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NewtonSettings {
    /// Largest relative residual of an equilibrium.
    pub(crate) tolerance: f64,
    /// Relative residual of a linear solution.
    pub(crate) linear_tolerance: f64,
    /// Limit of iterations.
    pub(crate) iterations: u32,
}

/// State of the stored tangent and its factor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Linearisation {
    /// There is no factor, or the factor must not be used.
    Absent,
    /// The factor belongs to an earlier iterate.
    Kept,
    /// The factor belongs to the current iterate.
    Fresh,
}

/// Newton's method with the data that it reuses from increment to increment of a run.
pub(crate) struct Newton<'a> {
    pub(super) operator: &'a dyn Operator,
    pub(super) materials: &'a [PointMaterial],
    pub(super) settings: NewtonSettings,
    pub(crate) effort: Effort,
    /// Relative residual at the fields evaluated last.
    pub(crate) relative: f64,
    /// Largest reference values of the residuals at all equilibria so far.
    pub(crate) scales: Scales,
    /// Reference values of the residuals at the fields evaluated last.
    reached: Scales,
    /// For each residual, the larger of two reference values: the value at the fields evaluated last, and the
    /// largest value of all equilibria so far.
    beside: Scales,
    /// Size of the residuals that rounding errors cause.
    rounding: Rounding,
    /// Loads and contact of the current increment.
    pub(crate) external: ExternalForces,
    /// Platen whose load program prescribes a force in some of the increments.
    pub(crate) control: Option<ForceControl>,
    /// Residual and energies at the fields evaluated last.
    pub(crate) residual: Residual,
    pub(super) linear: Box<dyn LinearSolver + 'a>,
    /// Marks the values that are not prescribed.
    pub(super) unknown: Vec<[bool; 4]>,
    /// Marks the unknown values that do not lie at an active bound, for the fields evaluated last. A bound is active if
    /// its reaction keeps the value at the bound.
    pub(super) free: Vec<[bool; 4]>,
    /// Marks the values that were free when the current tangent was computed.
    linearised: Vec<[bool; 4]>,
    factor: Linearisation,
    coupling: Coupling,
    pub(super) step: Vec<Nodal>,
    trial: Fields,
}

/// Error of a line search that found no step length with a smaller residual.
struct Stalled;

/// A tangent with its factor is reused while each solve reduces the residual to at most this fraction.
const KEEP: f64 = 0.1;
/// Largest number of step lengths that a line search tries.
const BACKTRACKS: u32 = 8;
/// Largest number of iterations that change the active set (the values at active bounds). These iterations do not count
/// towards `iterations`.
const MOST_CHANGES: u32 = 300;

impl<'a> Newton<'a> {
    /// Describes the hardware that solves linear systems, as text.
    pub(crate) fn machine(&self) -> String {
        let lost = self.operator.on_device().and_then(|equations| equations.lost());
        let machine = self.linear.machine();
        match lost {
            Some(error) if self.linear.is_on_device() => {
                format!(
                    "{machine}, residuals by the processor because the device failed to compute residuals: {error}"
                )
            }
            _ => machine,
        }
    }

    /// Continues the counters `effort` of an earlier solver of the run. If the earlier solver had replaced multigrid by
    /// a sparse factor, this solver uses a sparse factor, too.
    pub(crate) fn resume(&mut self, effort: Effort) {
        self.effort = effort;
        if effort.slow_solution > 0 {
            self.linear.give_way(effort.slow_solution);
        }
    }

    #[allow(clippy::too_many_arguments)]
    pub(crate) fn new(
        operator: &'a dyn Operator,
        unknowns: &Unknowns,
        materials: &'a [PointMaterial],
        settings: NewtonSettings,
        linear: Box<dyn LinearSolver + 'a>,
        rounding: Rounding,
        external: ExternalForces,
        control: Option<ForceControl>,
    ) -> Self {
        let nodes = unknowns.equation.len();
        let unknown: Vec<_> = unknowns.equation.iter().map(|e| e.map(|e| e != NONE)).collect();
        Self {
            operator,
            materials,
            settings,
            effort: Effort::default(),
            relative: 0.0,
            scales: Scales::default(),
            reached: Scales::default(),
            beside: Scales::default(),
            rounding,
            external,
            control,
            residual: Residual::new(nodes),
            linear,
            free: unknown.clone(),
            linearised: unknown.clone(),
            unknown,
            factor: Linearisation::Absent,
            coupling: Coupling::Full,
            step: vec![[0.0; 4]; nodes],
            trial: Fields::zero(nodes),
        }
    }

    /// Projects the initial guess `fields` onto the bounds of the unknowns, and evaluates the residual.
    pub(super) fn begin(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<Norms, StepFailure> {
        if let Some(bounds) = context.bounds {
            bounds.project(fields);
        }
        self.evaluate(fields, context)
    }

    /// Computes the residual, the energies and the norms of the residual at `fields`. Returns an error if a value is
    /// not finite.
    pub(crate) fn evaluate(
        &mut self,
        fields: &Fields,
        context: StepContext,
    ) -> Result<Norms, StepFailure> {
        let increment = Increment { materials: self.materials, fields, context };
        self.operator.residual(&increment, &mut self.residual)?;
        let Residual { elastic, fracture, viscous, .. } = self.residual;
        if !(elastic + fracture + viscous).is_finite() {
            return Err(StepFailure::NotFinite);
        }
        self.external.subtract(fields, &mut self.residual);
        if let Some(bounds) = context.bounds {
            self.free.copy_from_slice(&self.unknown);
            bounds.constrain(fields, &self.residual.nodal, &mut self.free);
        }
        let [per_mm, constant] = self.external.rounding();
        let rounding = &Rounding {
            force_per_mm: self.rounding.force_per_mm.hypot(per_mm),
            force: constant,
            ..self.rounding
        };
        let operator = self.operator;
        let halo = &operator.part().halo;
        let mut norms =
            Norms::at(&self.residual, fields, &self.unknown, &self.free, rounding, halo);
        if let Some(control) = &mut self.control {
            let [missing, target] = control.evaluate(&self.external, fields, &self.residual, halo);
            norms.add_force(missing, target);
        }
        if !norms.is_finite() {
            return Err(StepFailure::NotFinite);
        }
        self.reached = norms.scales();
        let norms = norms.beside(&self.scales, self.settings.tolerance);
        self.beside = norms.scales();
        self.relative = norms.largest();
        Ok(norms)
    }

    /// Returns the reference value of residual forces at the fields evaluated last, N.
    pub(super) fn scale_of_forces(&self) -> f64 {
        self.beside.force.max(f64::MIN_POSITIVE)
    }

    /// Accepts the fields evaluated last as an equilibrium. Returns the largest reference values of all equilibria so
    /// far.
    pub(crate) fn keep_scales(&mut self) -> Scales {
        let Scales { force, damage } = self.reached;
        self.scales =
            Scales { force: self.scales.force.max(force), damage: self.scales.damage.max(damage) };
        self.scales
    }

    /// Solves for one field or for both by Newton's method, to the relative residual `tolerance`.
    ///
    /// `norms` are the norms at `fields`, from [`begin`](Self::begin) or from the previous call. Returns the norms at
    /// the solution.
    pub(super) fn iterate(
        &mut self,
        field: Equations,
        fields: &mut Fields,
        context: StepContext,
        mut norms: Norms,
        tolerance: f64,
    ) -> Result<Norms, StepFailure> {
        let coupling = if field == Equations::Both { Coupling::Full } else { Coupling::Separate };
        if coupling != self.coupling {
            self.factor = Linearisation::Absent;
            self.coupling = coupling;
        }
        let (mut spent, mut changes) = (0, 0);
        while spent < self.settings.iterations && changes < MOST_CHANGES {
            if norms.converged(field, tolerance) {
                return Ok(norms);
            }
            // the active set shrinks by only one layer of nodes per iteration, therefore an iteration that changes the
            // active set is progress even if the residual does not decrease
            let changed = self.operator.part().ranks().any(self.linearised != self.free);
            if changed {
                changes += 1
            } else {
                spent += 1
            }
            if self.factor == Linearisation::Absent || changed {
                self.factorise(fields, context)?;
            }
            self.effort.iterations += 1;
            self.solve_linear(field)?;
            norms = match self.line_search(field, fields, context, &norms) {
                Ok((next, ratio)) => {
                    self.factor =
                        if ratio <= KEEP { Linearisation::Kept } else { Linearisation::Absent };
                    next
                }
                Err(Stalled) if self.factor == Linearisation::Fresh => {
                    self.factor = Linearisation::Kept;
                    let close = norms.converged(field, self.settings.tolerance);
                    if close {
                        return self.evaluate(fields, context);
                    }
                    let (iterations, residual) = (spent + changes, norms.largest());
                    return Err(StepFailure::Stalled { iterations, residual });
                }
                Err(Stalled) => {
                    // the step with the factor of an earlier iterate did not reduce the residual: retry with a factor
                    // of this iterate
                    self.factor = Linearisation::Absent;
                    self.evaluate(fields, context)?
                }
            };
        }
        if norms.converged(field, tolerance) {
            Ok(norms)
        } else {
            let (iterations, residual) = (spent + changes, norms.largest());
            Err(StepFailure::TooManyIterations { iterations, residual })
        }
    }

    fn factorise(&mut self, fields: &Fields, context: StepContext) -> Result<(), StepFailure> {
        let contact = self.external.tangent(fields);
        let pairs = self.external.pair_tangent(fields);
        let context = StepContext { contact: &contact, pairs: &pairs, ..context };
        let increment = Increment { materials: self.materials, fields, context };
        self.linear.linearise(&increment, self.coupling, &self.free)?;
        self.linearised.copy_from_slice(&self.free);
        if let Some(control) = &mut self.control {
            control.linearise(&self.external, fields);
        }
        self.factor = Linearisation::Fresh;
        Ok(())
    }

    /// Solves for both fields together.
    pub(crate) fn solve_both(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        let norms = self.begin(fields, context)?;
        self.iterate(Equations::Both, fields, context, norms, self.settings.tolerance).map(drop)
    }

    /// Assembles and stores the fully coupled tangent at `fields`, which must be the fields of the last evaluation.
    /// Counts as an iteration.
    pub(super) fn linearise_both(
        &mut self,
        fields: &Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        self.coupling = Coupling::Full;
        self.effort.iterations += 1;
        self.factorise(fields, context)
    }

    /// Computes and stores the tangent for the following iterations at `fields`, which must be the fields of the last
    /// evaluation.
    pub(super) fn linearise_as(
        &mut self,
        coupling: Coupling,
        fields: &Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        self.coupling = coupling;
        self.factorise(fields, context)?;
        self.factor = Linearisation::Kept;
        Ok(())
    }

    /// Solves a linear system with the current tangent, to the given relative residual.
    pub(super) fn solve_nodal(
        &mut self,
        right: &[Nodal],
        tolerance: f64,
    ) -> Result<Vec<Nodal>, StepFailure> {
        let mut x = vec![[0.0; 4]; right.len()];
        let solved = self.linear.solve(right, &mut x, tolerance);
        let effort = match solved {
            Ok(effort) | Err(Singular(effort)) => effort,
        };
        self.effort.linear += effort.iterations;
        self.effort.factorisations += effort.renewals;
        if let Some(iterations) = self.linear.gave_way_after() {
            self.effort.slow_solution = iterations.max(1);
        }
        match solved {
            Ok(_) => Ok(x),
            Err(_) => Err(StepFailure::Singular),
        }
    }

    /// Computes the Newton step of the fields selected by `field`.
    fn solve_linear(&mut self, field: Equations) -> Result<(), StepFailure> {
        let select = |mut right: Vec<Nodal>| {
            for value in right.iter_mut().filter(|_| field != Equations::Both) {
                for k in 0..4 {
                    value[k] = if field.holds(k) { value[k] } else { 0.0 };
                }
            }
            right
        };
        let right = select(self.residual.nodal.clone());
        self.step = self.solve_nodal(&right, self.settings.linear_tolerance)?;
        let Some(mut control) = self.control.take() else { return Ok(()) };
        control.step_mm = 0.0;
        let completed = match field {
            // the damage changes at constant displacement
            Equations::Damage => Ok(()),
            _ if !control.is_active() => Ok(()),
            _ => self.complete_step(&mut control, select),
        };
        self.control = Some(control);
        completed
    }

    /// Takes the step x ← x − α d along the Newton step d, with the first α of 1, ½, ¼ … that reduces the scaled
    /// residual. Returns the new norms, and the new residual divided by the old residual.
    fn line_search(
        &mut self,
        field: Equations,
        fields: &mut Fields,
        context: StepContext,
        norms: &Norms,
    ) -> Result<(Norms, f64), Stalled> {
        let before = norms.merit(field, norms);
        let tries = if self.factor == Linearisation::Fresh { BACKTRACKS } else { 1 };
        let mut fraction = 1.0;
        for _ in 0..tries {
            let mut trial = std::mem::take(&mut self.trial);
            self.move_by(field, fields, fraction, &mut trial);
            if let Some(bounds) = context.bounds {
                bounds.project(&mut trial);
            }
            let reached = self.evaluate(&trial, context);
            self.trial = trial;
            if let Ok(next) = reached {
                let ratio = next.merit(field, norms) / before;
                if ratio <= 1.0 - 1e-4 * fraction || next.converged(field, self.settings.tolerance)
                {
                    std::mem::swap(fields, &mut self.trial);
                    return Ok((next, ratio));
                }
            }
            fraction *= 0.5;
        }
        Err(Stalled)
    }

    fn move_by(&self, field: Equations, from: &Fields, fraction: f64, to: &mut Fields) {
        to.copy_from(from);
        let Self { unknown, step, .. } = self;
        let moves = unknown.par_iter().with_min_len(CHUNK).zip(step);
        let values = to.displacement.par_iter_mut().zip(&mut to.damage);
        values.zip(moves).for_each(|((u, phi), (unknown, step))| {
            for k in 0..4 {
                if unknown[k] && field.holds(k) {
                    let value = if k < 3 { &mut u[k] } else { &mut *phi };
                    *value -= fraction * step[k];
                }
            }
        });
        if let Some(control) = self.control.as_ref().filter(|control| control.step_mm != 0.0) {
            to.platen_mm -= fraction * control.step_mm;
            for (u, motion) in to.displacement.iter_mut().zip(control.motion()) {
                for k in (0..3).filter(|&k| motion[k] != 0.0) {
                    u[k] = motion[k] * to.platen_mm;
                }
            }
        }
    }
}
