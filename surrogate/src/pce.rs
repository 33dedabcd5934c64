//! The polynomial chaos expansion: terms, evaluation, guard.

use crate::dataset::{Input, check_distinct, check_name};
use crate::error::SurrogateError;
use crate::kernel::Kernel;
use crate::legendre::MAX_ORDER;
use crate::multi_index::graded;

/// A polynomial chaos expansion of `M` outputs in `D` inputs on a box.
///
/// f(x) = Σ_a c_a Π_d ψ_(a_d)(t_d) with t ∈ [−1, 1]^D the affine image of the box and
/// ψ_k = √(2k+1) P_k orthonormal Legendre polynomials for the uniform distribution. Inputs and
/// outputs have the units of the dataset it was fitted to.
///
/// **Outside the box** (see [`BoxPosition`]): silent inside; up to a tolerance outside, by
/// default 1 % of an input's width, the polynomial is continued as it is, smooth and with
/// its exact gradient, and [`Pce::position`] tells so; farther out every evaluation is an error.
///
/// Evaluation allocates nothing. Degrees go up to [`MAX_ORDER`].
///
/// ```
/// use surrogate::{Input, Pce};
/// // f = 2 + √3 t with t = (x − 5)/5
/// let x = Input::new("x", 0.0, 10.0)?;
/// let pce = Pce::from_terms([x], ["f".into()], [([0], [2.0]), ([1], [1.0])])?;
/// let (value, jacobian) = pce.value_and_jacobian(&[7.5])?;
/// assert!((value[0] - (2.0 + 3f64.sqrt() / 2.0)).abs() < 1e-12);
/// assert!((jacobian[0][0] - 3f64.sqrt() / 5.0).abs() < 1e-12);
/// assert!(pce.value(&[11.0]).is_err());
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
///
/// Reference: Xiu & Karniadakis, SIAM J. Sci. Comput. 24 (2002) 619, doi:10.1137/S1064827501387826.
#[derive(Clone, Debug)]
pub struct Pce<const D: usize, const M: usize> {
    inputs: [Input; D],
    outputs: [String; M],
    /// In the graded order of the multi-indices.
    terms: Vec<([u8; D], [f64; M])>,
    tolerance: f64,
    /// dt/dx, kept because divisions would be a tenth of an evaluation.
    slopes: [f64; D],
    kernel: Kernel<D, M>,
}

/// Where a point lies with respect to the training box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoxPosition {
    /// Inside or on the boundary.
    Inside,
    /// Outside, but by no more than the tolerance: the value is an extrapolation.
    Near,
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// Builds an expansion from its terms: multi-index and orthonormal coefficients of all outputs, in any order.
    ///
    /// Coefficients of plain Legendre polynomials P_n are divided by Π √(2 a_d + 1) first.
    ///
    /// # Errors
    /// Bad bounds or names; no terms, a repeated multi-index, a degree above [`MAX_ORDER`], a
    /// coefficient that is not finite.
    pub fn from_terms(
        inputs: [Input; D],
        outputs: [String; M],
        terms: impl IntoIterator<Item = ([u8; D], [f64; M])>,
    ) -> Result<Self, SurrogateError> {
        const { assert!(D > 0 && M > 0, "an expansion needs an input and an output") };
        for input in &inputs {
            input.check()?;
        }
        for output in &outputs {
            check_name(output)?;
        }
        check_distinct(inputs.iter().map(|i| &i.name).chain(&outputs))?;
        let mut terms: Vec<_> = terms.into_iter().collect();
        terms.sort_by_key(|(index, _)| graded(index));
        let wrong = |index: &[u8], problem: &str| {
            Err(SurrogateError::Term { index: index.to_vec(), problem: problem.to_owned() })
        };
        if terms.is_empty() {
            return wrong(&[], "there is none; give at least the constant one");
        }
        for (i, (index, c)) in terms.iter().enumerate() {
            if i > 0 && terms[i - 1].0 == *index {
                return wrong(index, "occurs twice; keep one");
            }
            if index.iter().any(|&a| usize::from(a) > MAX_ORDER) {
                return wrong(index, &format!("its degree exceeds {MAX_ORDER}; leave it out"));
            }
            if c.iter().any(|c| !c.is_finite()) {
                return wrong(index, "a coefficient is not finite; correct it");
            }
        }
        let kernel = Kernel::new(terms.iter().map(|(index, c)| (index, c)));
        let slopes = inputs.each_ref().map(Input::unit_slope);
        Ok(Self { inputs, outputs, terms, tolerance: 0.01, slopes, kernel })
    }

    /// Sets how far outside the box, as a share of each input's width, evaluation is still allowed.
    ///
    /// # Errors
    /// A tolerance that is negative or not finite.
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self, SurrogateError> {
        if !(tolerance >= 0.0 && tolerance.is_finite()) {
            return Err(SurrogateError::Option {
                option: "tolerance",
                value: tolerance.to_string(),
                allowed: "a share of the width, 0 or more".to_owned(),
            });
        }
        self.tolerance = tolerance;
        Ok(self)
    }

    /// The inputs with the box.
    pub fn inputs(&self) -> &[Input; D] {
        &self.inputs
    }

    /// The outputs' names.
    pub fn outputs(&self) -> &[String; M] {
        &self.outputs
    }

    /// Multi-indices with their orthonormal coefficients of all outputs, in graded order.
    pub fn terms(&self) -> &[([u8; D], [f64; M])] {
        &self.terms
    }

    /// The tolerance outside the box, as a share of each input's width.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Whether `x` lies inside the box or within the tolerance of it.
    ///
    /// # Errors
    /// A point farther outside, or NaN.
    #[inline]
    pub fn position(&self, x: &[f64; D]) -> Result<BoxPosition, SurrogateError> {
        if self.inputs.iter().zip(x).all(|(input, &x)| input.contains(x)) {
            Ok(BoxPosition::Inside)
        } else {
            self.near(x)
        }
    }

    /// Out of line, so that points inside the box pay only the comparisons.
    #[cold]
    fn near(&self, x: &[f64; D]) -> Result<BoxPosition, SurrogateError> {
        for (input, &value) in self.inputs.iter().zip(x) {
            let margin = self.tolerance * (input.upper - input.lower);
            // NaN fails the comparison too
            if !(input.lower - margin <= value && value <= input.upper + margin) {
                return Err(SurrogateError::OutsideBox {
                    input: input.name.clone(),
                    value,
                    lower: input.lower,
                    upper: input.upper,
                    tolerance: self.tolerance,
                });
            }
        }
        Ok(BoxPosition::Near)
    }

    /// The outputs at `x`, in the inputs' units.
    ///
    /// # Errors
    /// A point outside the box by more than the tolerance, or NaN.
    #[inline]
    pub fn value(&self, x: &[f64; D]) -> Result<[f64; M], SurrogateError> {
        self.position(x)?;
        Ok(self.kernel.value(&self.to_unit(x)))
    }

    /// The outputs at `x` and their derivatives, `jacobian[m][d]` = ∂f_m/∂x_d in the outputs' per the inputs' units.
    ///
    /// # Errors
    /// A point outside the box by more than the tolerance, or NaN.
    #[inline]
    pub fn value_and_jacobian(
        &self,
        x: &[f64; D],
    ) -> Result<([f64; M], [[f64; D]; M]), SurrogateError> {
        self.position(x)?;
        let (value, mut jacobian) = self.kernel.value_and_jacobian(&self.to_unit(x));
        for row in &mut jacobian {
            for d in 0..D {
                row[d] *= self.slopes[d];
            }
        }
        Ok((value, jacobian))
    }

    #[inline]
    fn to_unit(&self, x: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|d| {
            let Input { lower, upper, .. } = self.inputs[d];
            0.5 * self.slopes[d] * ((x[d] - lower) - (upper - x[d]))
        })
    }
}
