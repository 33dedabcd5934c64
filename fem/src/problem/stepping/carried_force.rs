//! Increments with a prescribed force of the platen.
//!
//! Newton's method solves for the fields and for the displacement of the platen. If the method fails, the platen is
//! moved in the same time by prescribed displacements that become larger and larger. If the force then reaches the
//! prescribed force, Newton's method starts again from this displacement. If the force falls instead, the specimen does
//! not carry the prescribed force.
//!
//! With a viscosity of the damage and a residual stiffness, a specimen has an equilibrium even where a specimen without
//! both would have no equilibrium. The specimen then fails by damage that grows in time, and its residual stiffness
//! stops the platen only after a large displacement. Therefore the work of each increment is compared with the work
//! that the residual stiffness alone stores.

use super::increment::Increments;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::material::PointMaterial;
use crate::operator::{Increment, Residual};

/// Largest number of displacements of the platen that are tried to reach a force.
const MOST_MOVES: usize = 24;
/// Factor by which the displacement of the platen grows from one try to the next.
const GROWTH: f64 = 1.5;
/// A force counts as falling if it is below the largest force of the increment by this fraction.
const FALLS: f64 = 1e-6;
/// Largest share of the work of an increment that may act on the residual stiffness of damaged material. Beyond one
/// half, the body moves mainly where only the numerical constant `residual_stiffness` carries the force.
const MOST_RESIDUAL_WORK: f64 = 0.5;
/// Smallest displacement of the platen in an increment, relative to its total displacement. The work of a smaller
/// displacement is only a rounding error.
const RESTS: f64 = 1e-6;

impl Increments<'_> {
    /// Solves an increment of `duration` s with the force `force_n` of the platen, from the guess in `fields`.
    ///
    /// # Errors
    /// [`StepFailure::LimitLoad`] if there is no equilibrium with the force, and [`StepFailure::ResidualStiffness`] if
    /// only the residual stiffness of damaged material carries the force.
    pub(super) fn carry(
        &mut self,
        fields: &mut Fields,
        force_n: f64,
        duration: f64,
    ) -> Result<(), StepFailure> {
        if let Err(failure) = self.solve_with_force(fields, force_n, duration, Fallbacks::Omitted) {
            self.solver.newton.effort.fallbacks += 1;
            self.push(fields, force_n, duration, failure)?;
            self.solve_with_force(fields, force_n, duration, Fallbacks::Tried)?;
        }
        let share = self.residual_work_share(fields, duration)?;
        match share > MOST_RESIDUAL_WORK {
            true => Err(StepFailure::ResidualStiffness { prescribed_n: force_n, share }),
            false => Ok(()),
        }
    }

    /// Returns the share of the work of the increment to the equilibrium `fields` that acts on the residual stiffness:
    /// 1 − Σ f⁰·Δu / Σ f·Δu, with the inner forces f of the body, the inner forces f⁰ of the same fields without residual
    /// stiffness, and the displacements Δu of the increment. Returns zero if the platen does not move into the body.
    ///
    /// The displacements of an increment at a constant force are concentrated where the body fails. Therefore the share is
    /// close to 1 for a body that creeps in a broken section, however thin the section is, and close to 0 for a closed
    /// crack whose split keeps its stiffness in compression.
    fn residual_work_share(&self, fields: &Fields, duration: f64) -> Result<f64, StepFailure> {
        let moved_mm = fields.platen_mm - self.state.fields.platen_mm;
        let has_residual =
            |point: &PointMaterial| point.damage.as_ref().is_some_and(|d| d.residual > 0.0);
        let materials = &self.setup.point_materials;
        if moved_mm <= RESTS * fields.platen_mm.abs() || !materials.iter().any(has_residual) {
            return Ok(0.0);
        }
        let domain = self.setup.discretisation.as_ref();
        let (newton, part) = (&self.solver.newton, domain.operator.part());
        let mut without: Vec<PointMaterial> = materials.to_vec();
        without.iter_mut().filter_map(|point| point.damage.as_mut()).for_each(|d| d.residual = 0.0);
        let context = self.state.memory.context(&self.state.fields.damage, duration);
        let increment = Increment { materials: &without, fields, context };
        let mut residual = Residual::new(fields.displacement.len());
        domain.operator.residual(&increment, &mut residual)?;
        let forces = newton.external.outer_forces(&domain.boundary, fields, &newton.residual);
        let before = part.halo.own_of(&self.state.fields.displacement);
        let displacements = part.halo.own_of(&fields.displacement).zip(before);
        let inner = part.halo.own_of(&forces).zip(part.halo.own_of(&residual.nodal));
        let mut work = [0.0; 2];
        for ((now, before), (force, without_residual)) in displacements.zip(inner) {
            for k in 0..3 {
                let moved = now[k] - before[k];
                work[0] += force[k] * moved;
                work[1] += without_residual[k] * moved;
            }
        }
        part.ranks().sum(&mut work);
        Ok(if work[0] > 0.0 { 1.0 - work[1] / work[0] } else { 0.0 })
    }

    /// Solves for the fields and for the displacement of the platen.
    fn solve_with_force(
        &mut self,
        fields: &mut Fields,
        force_n: f64,
        duration: f64,
        fallbacks: Fallbacks,
    ) -> Result<(), StepFailure> {
        self.solver.newton.prescribe_force(Some(force_n));
        let context = self.state.memory.context(&self.state.fields.damage, duration);
        let solved = match fallbacks {
            Fallbacks::Omitted => self.solver.equilibrium_at_once(fields, context),
            Fallbacks::Tried => self.solver.equilibrium(fields, context),
        };
        self.solver.newton.prescribe_force(None);
        solved.map(drop)
    }

    /// Moves the platen by prescribed displacements until its force is at least `force_n`, or at most `force_n` if the
    /// force decreases. On success, `fields` is the equilibrium at the last displacement.
    fn push(
        &mut self,
        fields: &mut Fields,
        force_n: f64,
        duration: f64,
        failure: StepFailure,
    ) -> Result<(), StepFailure> {
        let start = self.state.fields.without_state();
        fields.copy_from(&start);
        let mut reached_n = self.push_to(fields, start.platen_mm, duration).map_err(|_| failure)?;
        let increases = reached_n < force_n;
        let (mut largest_n, mut before_mm) = (reached_n, start.platen_mm);
        let scale_mm = self.usual_move_mm(force_n - reached_n);
        let mut move_mm = if increases { scale_mm } else { -scale_mm };
        if scale_mm == 0.0 {
            return Err(failure);
        }
        for _ in 0..MOST_MOVES {
            let platen_mm = before_mm + move_mm;
            reached_n = self.push_to(fields, platen_mm, duration).map_err(|_| failure)?;
            if (reached_n >= force_n) == increases {
                return Ok(());
            }
            if increases && reached_n < (1.0 - FALLS) * largest_n {
                return Err(StepFailure::LimitLoad { prescribed_n: force_n, largest_n });
            }
            largest_n = largest_n.max(reached_n);
            before_mm = platen_mm;
            move_mm *= GROWTH;
        }
        Err(failure)
    }

    /// Solves the increment with a prescribed displacement of the platen, from the guess in `fields`. Returns the force of
    /// the platen, N.
    fn push_to(
        &mut self,
        fields: &mut Fields,
        platen_mm: f64,
        duration: f64,
    ) -> Result<f64, StepFailure> {
        let setup = self.setup;
        let boundary = &setup.discretisation.boundary;
        let context = self.state.memory.context(&self.state.fields.damage, duration);
        let mut moved = fields.clone();
        moved.platen_mm = platen_mm;
        boundary.follow_platen(&mut moved);
        if platen_mm != fields.platen_mm
            && let Ok(predicted) = self.solver.predict(fields, &moved, context)
        {
            moved = predicted;
        }
        self.solver.equilibrium(&mut moved, context)?;
        *fields = moved;
        let newton = &self.solver.newton;
        let reactions = newton.external.reactions(boundary, fields, &newton.residual);
        Ok(boundary.measure(0.0, fields, &reactions)[1])
    }

    /// Returns the displacement by which the platen moves for a change of its force in an elastic specimen, mm. The
    /// stiffness is estimated from the last equilibrium; zero for an unloaded specimen.
    fn usual_move_mm(&self, change_n: f64) -> f64 {
        let point = &self.state.point;
        let stiffness = (point.force_n / point.displacement_mm).abs();
        let move_mm = (change_n / stiffness).abs();
        // a hundredth of the displacement so far bounds the move, so that a peak is not skipped
        let most_mm = 0.01 * point.displacement_mm.abs();
        if move_mm.is_finite() { move_mm.clamp(1e-3 * most_mm, most_mm) } else { most_mm }
    }
}

/// Whether slower schemes are tried after a failure of the selected scheme.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Fallbacks {
    Omitted,
    Tried,
}
