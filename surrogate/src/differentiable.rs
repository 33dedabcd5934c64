//! Implements the traits of `ppl`, so that an expansion can be used in a probabilistic model.

use ppl::{Differentiable, DomainError, DynDifferentiable};

use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::pce::Pce;

impl From<SurrogateError> for DomainError {
    fn from(error: SurrogateError) -> Self {
        DomainError::new(error.to_string())
    }
}

/// Uses the expansion as a function in a `ppl` model. A point that is outside the training box by more than the
/// tolerance is rejected, with the message of [`SurrogateError::OutsideBox`].
///
/// ```
/// use ppl::Differentiable;
/// use surrogate::{Input, Pce};
/// let x = Input::new("x", 0.0, 10.0)?;
/// let pce = Pce::from_terms([x], ["f".into()], [([0], [2.0]), ([1], [1.0])])?;
/// assert_eq!(pce.at([7.5]), pce.value(&[7.5])?);
/// assert!(pce.at([70.0])[0].is_nan());
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
impl<const D: usize, const M: usize> Differentiable<D, M> for Pce<D, M> {
    #[inline]
    fn value_and_jacobian(&self, x: &[f64; D]) -> Result<([f64; M], [[f64; D]; M]), DomainError> {
        Ok(Pce::value_and_jacobian(self, x)?)
    }

    #[inline]
    fn value(&self, x: &[f64; D]) -> Result<[f64; M], DomainError> {
        Ok(Pce::value(self, x)?)
    }
}

/// Uses the expansion as a function in a `ppl` model; see the implementation for [`Pce`]. The numbers of inputs and
/// outputs are known at run time.
///
/// ```
/// use ppl::DynDifferentiable;
/// use surrogate::{DynPce, Input};
/// let x = Input::new("x", 0.0, 10.0)?;
/// let terms = [(vec![0], vec![2.0]), (vec![1], vec![1.0])];
/// let pce = DynPce::from_terms(vec![x], vec!["f".into()], terms)?;
/// assert_eq!(pce.at(&[7.5]), pce.value(&[7.5])?);
/// assert!(pce.at(&[70.0])[0].is_nan());
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
impl DynDifferentiable for DynPce {
    fn outputs(&self) -> usize {
        DynPce::outputs(self).len()
    }

    fn value_and_jacobian(&self, x: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), DomainError> {
        Ok(DynPce::value_and_jacobian(self, x)?)
    }

    fn value(&self, x: &[f64]) -> Result<Vec<f64>, DomainError> {
        Ok(DynPce::value(self, x)?)
    }
}
