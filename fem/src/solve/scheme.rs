//! Solution of an increment by the selected scheme, and by slower schemes if the selected scheme fails.

use super::alternate::Alternation;
use super::arc_length::ArcLengthControl;
use super::contact_passes;
use super::flow;
use super::force_control::ForceControl;
use super::linear::LinearSolver;
use super::newton::{Newton, NewtonSettings};
use super::norms::Rounding;
use super::options::{Scheme, SolverOptions};
use super::predict::predict;
use crate::boundary::ExternalForces;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::material::PointMaterial;
use crate::operator::{Coupling, Operator, StepContext, Unknowns};

/// The solver of one run.
pub(crate) struct Solver<'a> {
    pub(crate) newton: Newton<'a>,
    schemes: Schemes,
}

/// The selected scheme, and the settings of alternate minimisation.
#[derive(Clone, Copy, Debug)]
struct Schemes {
    selected: Scheme,
    alternation: Alternation,
}

impl<'a> Solver<'a> {
    /// Creates a solver without tangents, factors and counters of earlier increments.
    #[allow(clippy::too_many_arguments)]
    pub(crate) fn new(
        operator: &'a dyn Operator,
        unknowns: &Unknowns,
        materials: &'a [PointMaterial],
        options: SolverOptions,
        linear: Box<dyn LinearSolver + 'a>,
        rounding: Rounding,
        external: ExternalForces,
        control: Option<ForceControl>,
    ) -> Self {
        let SolverOptions { scheme, tolerance, linear_tolerance, iterations, .. } = options;
        let settings = NewtonSettings { tolerance, linear_tolerance, iterations };
        let newton = Newton::new(
            operator, unknowns, materials, settings, linear, rounding, external, control,
        );
        let alternation = Alternation {
            limit: options.alternations,
            finishes_together: scheme == Scheme::Monolithic,
        };
        Self { newton, schemes: Schemes { selected: scheme, alternation } }
    }

    /// Returns the previous equilibrium `before` plus its linear response to the loads and the prescribed values of
    /// this increment, which `placed` contains.
    pub(crate) fn predict(
        &mut self,
        before: &Fields,
        placed: &Fields,
        context: StepContext,
    ) -> Result<Fields, StepFailure> {
        let coupling = match self.schemes.selected {
            Scheme::Monolithic => Coupling::Full,
            Scheme::Alternate => Coupling::Separate,
        };
        predict(&mut self.newton, coupling, before, placed, context)
    }

    /// Solves one increment from the guess in `fields`. Returns the number of iterations.
    ///
    /// After an error, `fields` is not in equilibrium.
    pub(crate) fn equilibrium(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<u32, StepFailure> {
        let schemes = self.schemes;
        contact_passes::equilibrium(
            &mut self.newton,
            fields,
            context,
            &mut |newton, fields, context| schemes.solve(newton, fields, context),
        )
    }

    /// Solves one increment from the guess in `fields` by the selected scheme, without fallback. Returns the number of
    /// iterations.
    ///
    /// After an error, `fields` is not in equilibrium.
    pub(crate) fn equilibrium_at_once(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<u32, StepFailure> {
        let schemes = self.schemes;
        contact_passes::equilibrium(
            &mut self.newton,
            fields,
            context,
            &mut |newton, fields, context| {
                let start = newton.effort.iterations;
                schemes.solve_at_once(newton, fields, context)?;
                Ok(newton.effort.iterations - start)
            },
        )
    }

    /// Solves for the fields and for the position of the loaded ends at a prescribed crack energy. Returns the position
    /// (fraction of the test's duration).
    pub(crate) fn release(
        &mut self,
        fields: &mut Fields,
        position: f64,
        control: &ArcLengthControl,
        context: StepContext,
    ) -> Result<f64, StepFailure> {
        control.solve(&mut self.newton, fields, position, context)
    }
}

impl Schemes {
    /// Solves for both fields from the guess in `fields`. Returns the number of iterations.
    fn solve(
        self,
        newton: &mut Newton,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<u32, StepFailure> {
        let (start, guess) = (newton.effort.iterations, fields.clone());
        if let Err(failure) = self.solve_at_once(newton, fields, context) {
            self.fall_back(newton, &guess, fields, context, failure)?;
        }
        Ok(newton.effort.iterations - start)
    }

    /// Solves for both fields by the selected scheme, without fallback.
    fn solve_at_once(
        self,
        newton: &mut Newton,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        match self.selected {
            Scheme::Monolithic => newton.solve_both(fields, context),
            Scheme::Alternate => self.alternation.solve(newton, fields, context),
        }
    }

    /// Solves for both fields by slower, more robust schemes after the selected scheme has failed.
    fn fall_back(
        self,
        newton: &mut Newton,
        guess: &Fields,
        fields: &mut Fields,
        context: StepContext,
        mut failure: StepFailure,
    ) -> Result<(), StepFailure> {
        if flow::is_rate_independent(newton) {
            newton.effort.fallbacks += 1;
            fields.copy_from(guess);
            let solve = |newton: &mut Newton, fields: &mut Fields, context: StepContext| {
                self.solve_at_once(newton, fields, context)
            };
            match flow::flow(newton, fields, context, &solve) {
                Ok(()) => return Ok(()),
                Err(reason) => failure = reason,
            }
        }
        if self.selected == Scheme::Alternate {
            return Err(failure);
        }
        newton.effort.fallbacks += 1;
        fields.copy_from(guess);
        self.alternation.solve(newton, fields, context)
    }
}
