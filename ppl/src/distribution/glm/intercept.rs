//! Intercepts of regressions: one for all data, or one per group.

use crate::density::DomainError;
use crate::distribution::Sequence;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::parameter::Parameter;

/// Intercept of a linear predictor: a number, an unknown, or [`ByGroup`].
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not an intercept",
    label = "expected a number, an unknown, or `ByGroup(&levels, &group)`"
)]
pub trait Intercept<R>: Clone {
    /// Number of different intercepts.
    fn groups(&self) -> usize;

    /// Index of the group of datum `i`.
    fn group(&self, i: usize) -> usize;

    /// Intercept of a group.
    fn of_group(&self, group: usize) -> impl Parameter + Datum<R>;

    /// Checks that each of the `n` data has an intercept and that all intercepts are finite.
    ///
    /// # Errors
    /// [`DomainError`] with the invalid datum or intercept.
    fn validate(&self, family: &'static str, n: usize) -> Result<(), DomainError>;
}

impl<R: Scalar, P: Parameter + Datum<R>> Intercept<R> for P {
    #[inline(always)]
    fn groups(&self) -> usize {
        1
    }

    #[inline(always)]
    fn group(&self, _: usize) -> usize {
        0
    }

    #[inline(always)]
    fn of_group(&self, _: usize) -> impl Parameter + Datum<R> {
        *self
    }

    fn validate(&self, family: &'static str, _: usize) -> Result<(), DomainError> {
        DomainError::require_finite(family, "intercept", self.number())
    }
}

/// One intercept per group: the intercepts (an array, a slice or a `Vec`), and the group index of every datum; see
/// [`NormalGlm`](crate::NormalGlm).
#[derive(Clone, Copy, Debug)]
pub struct ByGroup<'g, L>(pub L, pub &'g [usize]);

impl<R: Scalar, L: Sequence<Item: Datum<R>>> Intercept<R> for ByGroup<'_, L> {
    #[inline(always)]
    fn groups(&self) -> usize {
        self.0.items().len()
    }

    #[inline(always)]
    fn group(&self, i: usize) -> usize {
        self.1[i]
    }

    #[inline(always)]
    fn of_group(&self, group: usize) -> impl Parameter + Datum<R> {
        self.0.at::<R>(group)
    }

    fn validate(&self, family: &'static str, n: usize) -> Result<(), DomainError> {
        let (levels, groups) = (self.0.items().len(), self.1.len());
        if groups != n {
            let message = format!(
                "{family}: {groups} data have a group but x has {n} rows; give one group per row"
            );
            return Err(DomainError::new(message));
        }
        if let Some(i) = self.1.iter().position(|&group| group >= levels) {
            let message = format!(
                "{family}: datum {i} belongs to group {}, but there are {levels} intercepts; groups are \
                 counted from 0",
                self.1[i]
            );
            return Err(DomainError::new(message));
        }
        for group in 0..levels {
            let name = format_args!("intercept[{group}]");
            DomainError::require_finite(family, name, self.0.at::<R>(group).value())?;
        }
        Ok(())
    }
}
