//! Solution of an increment by the selected scheme, and by fallback schemes if no equilibrium is found.

use super::external::External;
use super::newton::Solver;
use super::options::Scheme;
use crate::error::StepFailure;
use crate::fields::Fields;
use crate::operator::StepContext;

impl<E: External> Solver<'_, E> {
    /// Solves one increment from the guess in `fields`. Returns the number of iterations.
    ///
    /// After a failure `fields` is not in equilibrium.
    pub(crate) fn solve(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<u32, StepFailure> {
        let (start, guess) = (self.effort.iterations, fields.clone());
        if let Err(failure) = self.solve_at_once(fields, context) {
            self.fall_back(&guess, fields, context, failure)?;
        }
        Ok(self.effort.iterations - start)
    }

    /// Solves for both fields by the selected scheme, without fallback.
    pub(super) fn solve_at_once(
        &mut self,
        fields: &mut Fields,
        context: StepContext,
    ) -> Result<(), StepFailure> {
        match self.options.scheme {
            Scheme::Monolithic => self.solve_monolithic(fields, context),
            Scheme::Alternate => self.alternate(fields, context),
        }
    }

    /// Solves for both fields by slower, more robust schemes after the selected scheme has failed.
    fn fall_back(
        &mut self,
        guess: &Fields,
        fields: &mut Fields,
        context: StepContext,
        mut failure: StepFailure,
    ) -> Result<(), StepFailure> {
        if self.is_rate_independent() {
            self.effort.fallbacks += 1;
            fields.copy_from(guess);
            match self.flow(fields, context) {
                Ok(()) => return Ok(()),
                Err(reason) => failure = reason,
            }
        }
        if self.options.scheme == Scheme::Alternate {
            return Err(failure);
        }
        self.effort.fallbacks += 1;
        fields.copy_from(guess);
        self.alternate(fields, context)
    }
}
