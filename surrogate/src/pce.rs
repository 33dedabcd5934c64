//! The expansion with sizes known at compile time.

use std::borrow::Borrow;
use std::ops::Deref;

use crate::dataset::{Input, check_count};
use crate::dyn_pce::{BoxPosition, DynPce};
use crate::error::SurrogateError;
use crate::kernel::PceKernel;
use crate::scale::{Axis, Scale};

/// A polynomial chaos expansion of `M` outputs in `D` inputs on a box: a [`DynPce`] with evaluation that does
/// not allocate.
///
/// The type dereferences to [`DynPce`]. The methods of `Pce` itself have arrays as arguments and results.
///
/// ```
/// use surrogate::{Input, Pce};
/// // f = 2 + √3 t with t = (x − 5)/5
/// let x = Input::new("x", 0.0, 10.0)?;
/// let pce = Pce::from_terms([x], ["f".into()], [([0], [2.0]), ([1], [1.0])])?;
/// let (value, jacobian) = pce.value_and_jacobian(&[7.5])?;
/// assert!((value[0] - (2.0 + 3f64.sqrt() / 2.0)).abs() < 1e-12);
/// assert!((jacobian[0][0] - 3f64.sqrt() / 5.0).abs() < 1e-12);
/// assert_eq!(pce.mean(), [2.0]);
/// assert!(pce.value(&[11.0]).is_err());
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug)]
pub struct Pce<const D: usize, const M: usize> {
    expansion: DynPce,
    /// Bounds of the box if all scales are linear; otherwise NaN, so that no point is inside. A point inside
    /// `plain_box` therefore needs no check of the scales.
    plain_box: [[f64; 2]; D],
    /// Derivative dt/dx of the coordinate t ∈ [−1, 1] of each input x. With divisions instead of these factors,
    /// evaluation would be 10 % slower.
    slopes: [f64; D],
    kernel: PceKernel<D, M>,
    axes: [Axis; D],
    output_scales: [Scale; M],
}

impl<const D: usize, const M: usize> Deref for Pce<D, M> {
    type Target = DynPce;

    fn deref(&self) -> &DynPce {
        &self.expansion
    }
}

impl<const D: usize, const M: usize> Borrow<DynPce> for Pce<D, M> {
    fn borrow(&self) -> &DynPce {
        &self.expansion
    }
}

impl<const D: usize, const M: usize> From<Pce<D, M>> for DynPce {
    fn from(pce: Pce<D, M>) -> DynPce {
        pce.expansion
    }
}

impl<const D: usize, const M: usize> TryFrom<DynPce> for Pce<D, M> {
    type Error = SurrogateError;

    /// Converts the expansion and arranges its terms for fast evaluation.
    ///
    /// # Errors
    /// If the expansion does not have `D` inputs and `M` outputs.
    fn try_from(expansion: DynPce) -> Result<Self, SurrogateError> {
        const { assert!(D > 0 && M > 0, "an expansion needs an input and an output") };
        check_count("inputs", D, expansion.inputs().len())?;
        check_count("outputs", M, expansion.outputs().len())?;
        let terms = expansion
            .terms()
            .iter()
            .map(|(index, c)| (std::array::from_fn(|d| index[d]), std::array::from_fn(|m| c[m])));
        let kernel = PceKernel::new(terms);
        let input = |d: usize| &expansion.inputs()[d];
        let linear = expansion.is_linear();
        let plain_box = std::array::from_fn(|d| {
            if linear { [input(d).lower, input(d).upper] } else { [f64::NAN; 2] }
        });
        let slopes = std::array::from_fn(|d| 2.0 / (input(d).upper - input(d).lower));
        let axes = std::array::from_fn(|d| expansion.axes()[d]);
        let output_scales = std::array::from_fn(|m| expansion.output_scales()[m]);
        Ok(Self { expansion, plain_box, slopes, kernel, axes, output_scales })
    }
}

impl<const D: usize, const M: usize> Pce<D, M> {
    /// Builds an expansion from its terms, in any order; see [`DynPce::from_terms`].
    ///
    /// # Errors
    /// The errors of [`DynPce::from_terms`].
    pub fn from_terms(
        inputs: [Input; D],
        outputs: [String; M],
        terms: impl IntoIterator<Item = ([u8; D], [f64; M])>,
    ) -> Result<Self, SurrogateError> {
        let terms = terms.into_iter().map(|(index, c)| (index.to_vec(), c.to_vec()));
        DynPce::from_terms(inputs.into(), outputs.into(), terms)?.try_into()
    }

    /// Sets the tolerance outside the box; see [`DynPce::with_tolerance`].
    ///
    /// # Errors
    /// The errors of [`DynPce::with_tolerance`].
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self, SurrogateError> {
        self.expansion = self.expansion.with_tolerance(tolerance)?;
        Ok(self)
    }

    /// Returns the expansion with the same coefficients and new scales; see [`DynPce::with_scales`].
    ///
    /// # Errors
    /// The errors of [`DynPce::with_scales`].
    pub fn with_scales(
        self,
        inputs: [Scale; D],
        outputs: [Scale; M],
    ) -> Result<Self, SurrogateError> {
        self.expansion.with_scales(&inputs, &outputs)?.try_into()
    }

    /// Position of `x` relative to the box: inside, or outside within the tolerance.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, or contains NaN.
    #[inline]
    pub fn position(&self, x: &[f64; D]) -> Result<BoxPosition, SurrogateError> {
        if self.is_plain(x) { Ok(BoxPosition::Inside) } else { self.expansion.position(x) }
    }

    /// Returns the outputs at `x`; `x` is in the inputs' units.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, or contains NaN.
    #[inline]
    pub fn value(&self, x: &[f64; D]) -> Result<[f64; M], SurrogateError> {
        if !self.is_plain(x) {
            return self.general_value(x);
        }
        Ok(self.kernel.value(&self.to_unit(x)))
    }

    /// Returns the outputs at `x` and their derivatives: `jacobian[m][d]` = ∂f_m/∂x_d in units of output m
    /// per unit of input d.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, or contains NaN.
    #[inline]
    pub fn value_and_jacobian(
        &self,
        x: &[f64; D],
    ) -> Result<([f64; M], [[f64; D]; M]), SurrogateError> {
        if !self.is_plain(x) {
            return self.general_value_and_jacobian(x);
        }
        let (value, mut jacobian) = self.kernel.value_and_jacobian(&self.to_unit(x));
        for row in &mut jacobian {
            for d in 0..D {
                row[d] *= self.slopes[d];
            }
        }
        Ok((value, jacobian))
    }

    /// Whether all scales are linear and `x` lies inside the box, which is the most frequent case.
    #[inline]
    fn is_plain(&self, x: &[f64; D]) -> bool {
        self.plain_box.iter().zip(x).all(|([lower, upper], x)| lower <= x && x <= upper)
    }

    #[cold]
    #[inline(never)]
    fn general_value(&self, x: &[f64; D]) -> Result<[f64; M], SurrogateError> {
        self.position(x)?;
        let mut value = self.kernel.value(&std::array::from_fn(|d| self.axes[d].to_unit(x[d])));
        for m in 0..M {
            value[m] = self.output_scales[m].value_and_slope(value[m]).0;
        }
        Ok(value)
    }

    #[cold]
    #[inline(never)]
    fn general_value_and_jacobian(
        &self,
        x: &[f64; D],
    ) -> Result<([f64; M], [[f64; D]; M]), SurrogateError> {
        self.position(x)?;
        let t = std::array::from_fn(|d| self.axes[d].to_unit(x[d]));
        let slopes: [f64; D] = std::array::from_fn(|d| self.axes[d].slope_at(x[d]));
        let (mut value, mut jacobian) = self.kernel.value_and_jacobian(&t);
        for m in 0..M {
            let (y, slope) = self.output_scales[m].value_and_slope(value[m]);
            value[m] = y;
            for d in 0..D {
                jacobian[m][d] *= slope * slopes[d];
            }
        }
        Ok((value, jacobian))
    }

    #[inline]
    fn to_unit(&self, x: &[f64; D]) -> [f64; D] {
        std::array::from_fn(|d| {
            let [lower, upper] = self.plain_box[d];
            0.5 * self.slopes[d] * ((x[d] - lower) - (upper - x[d]))
        })
    }
}
