//! The polynomial chaos expansion with sizes known at run time: terms, check of the box, evaluation.

use crate::dataset::{Input, check_count, check_distinct, check_name};
use crate::error::SurrogateError;
use crate::legendre::{MAX_ORDER, legendre, norm};
use crate::multi_index::graded;
use crate::scale::{Axis, Scale};

/// A polynomial chaos expansion of `m` outputs in `d` inputs on a box.
///
/// f(x) = Σ_a c_a Π_i ψ_(a_i)(t_i), where t ∈ [−1, 1]^d is the affine image of the box and ψ_k = √(2k+1) P_k
/// are Legendre polynomials, orthonormal for the uniform distribution. Inputs and outputs have the units of
/// the dataset to which the expansion was fitted.
///
/// **Scales** ([`DynPce::with_scales`]): if an input x is on a logarithmic [`Scale`], its coordinate t is the affine
/// image of ln x. If an output f is on a logarithmic scale, the sum is ln f. In either case, the argument of an
/// evaluation is x, and the result is f and its derivatives with respect to x.
///
/// **Outside the box** (see [`BoxPosition`]): if a point is outside the box by at most a tolerance (by
/// default 1 % of the input's width on its scale), an evaluation extrapolates the polynomial with its exact
/// gradient, and [`DynPce::position`] returns [`BoxPosition::Near`]. If a point is farther outside, every
/// evaluation returns an error.
///
/// Degrees are at most [`MAX_ORDER`]. If `d` and `m` are known at compile time, [`Pce`](crate::Pce) is the
/// same expansion, evaluated several times faster and without allocation:
///
/// ```
/// use surrogate::{DynPce, Input, Pce};
/// // f = 2 + √3 t with t = (x − 5)/5
/// let x = Input::new("x", 0.0, 10.0)?;
/// let terms = [(vec![0], vec![2.0]), (vec![1], vec![1.0])];
/// let pce = DynPce::from_terms(vec![x], vec!["f".into()], terms)?;
/// let (value, jacobian) = pce.value_and_jacobian(&[7.5])?;
/// assert!((value[0] - (2.0 + 3f64.sqrt() / 2.0)).abs() < 1e-12);
/// assert!((jacobian[0][0] - 3f64.sqrt() / 5.0).abs() < 1e-12);
/// let fast: Pce<1, 1> = pce.try_into()?;
/// assert!((fast.value(&[7.5])?[0] - value[0]).abs() < 1e-12);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
///
/// Reference: Xiu & Karniadakis, SIAM J. Sci. Comput. 24 (2002) 619, doi:10.1137/S1064827501387826.
#[derive(Clone, Debug, PartialEq)]
pub struct DynPce {
    inputs: Vec<Input>,
    axes: Vec<Axis>,
    outputs: Vec<String>,
    output_scales: Vec<Scale>,
    /// Multi-indices and coefficients, in graded order of the multi-indices.
    terms: Vec<(Vec<u8>, Vec<f64>)>,
    tolerance: f64,
    /// The highest degree of any input in any term.
    degree: usize,
}

/// Position of a point relative to the training box.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BoxPosition {
    /// Inside the box or on its boundary.
    Inside,
    /// Outside the box, within the tolerance: the value is an extrapolation.
    Near,
}

impl DynPce {
    /// Builds an expansion from its terms, in any order. A term is a multi-index and the orthonormal
    /// coefficients of all outputs.
    ///
    /// A coefficient of plain Legendre polynomials P_n must be divided by Π √(2 a_i + 1) to become an
    /// orthonormal coefficient.
    ///
    /// # Errors
    /// If there is no input, no output or no term; if bounds or names are invalid; if a multi-index is repeated, has
    /// the wrong length or has a degree above [`MAX_ORDER`]; a coefficient is not finite, or a term does not have one
    /// coefficient per output.
    pub fn from_terms(
        inputs: Vec<Input>,
        outputs: Vec<String>,
        terms: impl IntoIterator<Item = (Vec<u8>, Vec<f64>)>,
    ) -> Result<Self, SurrogateError> {
        for (what, count) in [("or more inputs", inputs.len()), ("or more outputs", outputs.len())]
        {
            if count == 0 {
                return Err(SurrogateError::Count { what, expected: 1, found: count });
            }
        }
        for input in &inputs {
            input.check()?;
        }
        for output in &outputs {
            check_name(output)?;
        }
        check_distinct(inputs.iter().map(|i| &i.name).chain(&outputs))?;
        let mut terms: Vec<(Vec<u8>, Vec<f64>)> = terms.into_iter().collect();
        terms.sort_by(|(a, _), (b, _)| graded(a).cmp(&graded(b)));
        let wrong = |index: &[u8], problem: &str| {
            Err(SurrogateError::Term { index: index.to_vec(), problem: problem.to_owned() })
        };
        if terms.is_empty() {
            return wrong(&[], "the expansion has no term; give at least the constant term");
        }
        for (i, (index, c)) in terms.iter().enumerate() {
            check_count("degrees in a term", inputs.len(), index.len())?;
            check_count("coefficients in a term", outputs.len(), c.len())?;
            if i > 0 && terms[i - 1].0 == *index {
                return wrong(index, "the term occurs twice; remove one of them");
            }
            if index.iter().any(|&a| usize::from(a) > MAX_ORDER) {
                return wrong(index, &format!("the degree exceeds {MAX_ORDER}; remove the term"));
            }
            if c.iter().any(|c| !c.is_finite()) {
                return wrong(index, "a coefficient is not finite; correct it");
            }
        }
        let degree = terms.iter().flat_map(|(index, _)| index).copied().max().unwrap_or(0).into();
        let axes = inputs.iter().map(|i| Axis::new(i, Scale::Linear)).collect::<Result<_, _>>()?;
        let output_scales = vec![Scale::Linear; outputs.len()];
        Ok(Self { inputs, axes, outputs, output_scales, terms, tolerance: 0.01, degree })
    }

    /// Returns the expansion with the same coefficients and new scales, one scale per input and one per output.
    ///
    /// # Errors
    /// If the number of scales is wrong, or an input on a logarithmic scale has a lower bound that is not
    /// above 0.
    ///
    /// ```
    /// use surrogate::{DynPce, Input, Scale};
    /// // ln y = 2 + ½ ln x on [1, 100], where ln x = ln 10 (1 + t)
    /// let x = Input::new("x", 1.0, 100.0)?;
    /// let half = 0.5 * 10f64.ln();
    /// let terms = [(vec![0], vec![2.0 + half]), (vec![1], vec![half / 3f64.sqrt()])];
    /// let pce = DynPce::from_terms(vec![x], vec!["y".into()], terms)?
    ///     .with_scales(&[Scale::Log], &[Scale::Log])?;
    /// let (value, jacobian) = pce.value_and_jacobian(&[25.0])?;
    /// assert!((value[0] - 5.0 * 2f64.exp()).abs() < 1e-12);
    /// assert!((jacobian[0][0] - value[0] / 50.0).abs() < 1e-12);
    /// # Ok::<(), surrogate::SurrogateError>(())
    /// ```
    pub fn with_scales(
        mut self,
        inputs: &[Scale],
        outputs: &[Scale],
    ) -> Result<Self, SurrogateError> {
        self.axes = axes(&self.inputs, inputs)?;
        check_count("scales of outputs", self.outputs.len(), outputs.len())?;
        self.output_scales = outputs.to_vec();
        Ok(self)
    }

    /// Sets the tolerance: the distance outside the box at which evaluation is still allowed, as a fraction
    /// of each input's width on its scale.
    ///
    /// # Errors
    /// If the tolerance is negative or not finite.
    pub fn with_tolerance(mut self, tolerance: f64) -> Result<Self, SurrogateError> {
        if !(tolerance >= 0.0 && tolerance.is_finite()) {
            return Err(SurrogateError::Option {
                option: "tolerance",
                value: tolerance.to_string(),
                allowed: "a fraction of the width, 0 or more".to_owned(),
            });
        }
        self.tolerance = tolerance;
        Ok(self)
    }

    /// Multiplies each output by a factor, for example to change the unit of the output. `factors` has one factor per
    /// output.
    ///
    /// # Errors
    /// If the number of factors is wrong, a scaled coefficient is not finite, or the factor of an output on a
    /// logarithmic scale is not above 0.
    pub fn scale_outputs(mut self, factors: &[f64]) -> Result<Self, SurrogateError> {
        check_count("factors", self.outputs.len(), factors.len())?;
        let constant = vec![0; self.inputs.len()];
        // the logarithm of the factor of a logarithmic output is added to the constant term, which is the first
        // term if present
        if self.output_scales.contains(&Scale::Log) && self.terms[0].0 != constant {
            self.terms.insert(0, (constant, vec![0.0; self.outputs.len()]));
        }
        for (m, (scale, &factor)) in self.output_scales.iter().zip(factors).enumerate() {
            match scale {
                Scale::Linear => self.terms.iter_mut().for_each(|(_, c)| c[m] *= factor),
                Scale::Log if factor > 0.0 => self.terms[0].1[m] += factor.ln(),
                Scale::Log => {
                    return Err(SurrogateError::Option {
                        option: "factor of a logarithmic output",
                        value: factor.to_string(),
                        allowed: "above 0".to_owned(),
                    });
                }
            }
        }
        let (inputs, outputs, tolerance) =
            (self.input_scales(), self.output_scales, self.tolerance);
        Self::from_terms(self.inputs, self.outputs, self.terms)?
            .with_scales(&inputs, &outputs)?
            .with_tolerance(tolerance)
    }

    /// Returns the inputs. Their bounds define the training box.
    pub fn inputs(&self) -> &[Input] {
        &self.inputs
    }

    /// The names of the outputs.
    pub fn outputs(&self) -> &[String] {
        &self.outputs
    }

    /// The scale of each input.
    pub fn input_scales(&self) -> Vec<Scale> {
        self.axes.iter().map(|axis| axis.scale).collect()
    }

    /// The scale of each output.
    pub fn output_scales(&self) -> &[Scale] {
        &self.output_scales
    }

    /// Whether all inputs and outputs are on linear scales.
    pub fn is_linear(&self) -> bool {
        self.axes
            .iter()
            .map(|axis| axis.scale)
            .chain(self.output_scales.iter().copied())
            .all(|scale| scale == Scale::Linear)
    }

    /// Returns the intervals of the inputs on their linear or logarithmic scales.
    pub(crate) fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// Multi-indices with the orthonormal coefficients of all outputs, in graded order.
    pub fn terms(&self) -> &[(Vec<u8>, Vec<f64>)] {
        &self.terms
    }

    /// The tolerance outside the box, as a fraction of each input's width on its scale.
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// Position of `x` relative to the box: inside, or outside within the tolerance.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, contains NaN, or has the wrong length.
    pub fn position(&self, x: &[f64]) -> Result<BoxPosition, SurrogateError> {
        check_count("input values", self.inputs.len(), x.len())?;
        if self.inputs.iter().zip(x).all(|(input, &x)| input.contains(x)) {
            return Ok(BoxPosition::Inside);
        }
        for ((input, axis), &value) in self.inputs.iter().zip(&self.axes).zip(x) {
            // `contains` is tested first: because of the rounding of logarithms, `is_near` can be false at a bound
            if !(input.contains(value) || axis.is_near(value, self.tolerance)) {
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

    /// Returns the outputs at `x`; `x` is in the inputs' units.
    ///
    /// # Errors
    /// The errors of [`Self::position`].
    pub fn value(&self, x: &[f64]) -> Result<Vec<f64>, SurrogateError> {
        self.position(x)?;
        let basis = self.basis(x);
        let mut value = vec![0.0; self.outputs.len()];
        for (index, c) in &self.terms {
            let weight: f64 =
                index.iter().zip(&basis).map(|(&a, psi)| psi[usize::from(a)][0]).product();
            value.iter_mut().zip(c).for_each(|(value, c)| *value += c * weight);
        }
        for (value, scale) in value.iter_mut().zip(&self.output_scales) {
            *value = scale.value_and_slope(*value).0;
        }
        Ok(value)
    }

    /// Returns the outputs at `x` and their derivatives: `jacobian[m][i]` = ∂f_m/∂x_i in units of output m
    /// per unit of input i.
    ///
    /// # Errors
    /// The errors of [`Self::position`].
    pub fn value_and_jacobian(
        &self,
        x: &[f64],
    ) -> Result<(Vec<f64>, Vec<Vec<f64>>), SurrogateError> {
        self.position(x)?;
        let basis = self.basis(x);
        let (d, m) = (self.inputs.len(), self.outputs.len());
        let (mut value, mut jacobian) = (vec![0.0; m], vec![vec![0.0; d]; m]);
        let mut slopes = vec![0.0; d];
        for (index, c) in &self.terms {
            let mut weight = 1.0;
            slopes.fill(1.0);
            for (i, (&a, psi)) in index.iter().zip(&basis).enumerate() {
                let [p, dp] = psi[usize::from(a)];
                weight *= p;
                slopes.iter_mut().enumerate().for_each(|(e, s)| *s *= if e == i { dp } else { p });
            }
            for ((value, row), c) in value.iter_mut().zip(&mut jacobian).zip(c) {
                *value += c * weight;
                row.iter_mut().zip(&slopes).for_each(|(entry, slope)| *entry += c * slope);
            }
        }
        for ((value, row), scale) in value.iter_mut().zip(&mut jacobian).zip(&self.output_scales) {
            let (y, slope) = scale.value_and_slope(*value);
            *value = y;
            row.iter_mut().for_each(|entry| *entry *= slope);
        }
        Ok((value, jacobian))
    }

    /// Returns ψ_k(t_i) and dψ_k/dx_i for each input i and each degree k up to the highest degree in the expansion. ψ_k
    /// is the orthonormal Legendre polynomial of degree k, and t_i is the coordinate of the input x_i on [−1, 1].
    fn basis(&self, x: &[f64]) -> Vec<Vec<[f64; 2]>> {
        let polynomials = |(axis, &x): (&Axis, &f64)| {
            let slope = axis.slope_at(x);
            let p = legendre::<{ MAX_ORDER + 1 }>(axis.to_unit(x));
            (0..=self.degree).map(|k| [norm(k) * p[k][0], norm(k) * p[k][1] * slope]).collect()
        };
        self.axes.iter().zip(x).map(polynomials).collect()
    }
}

/// The intervals of the inputs on their scales.
///
/// # Errors
/// If the number of scales is wrong, or the lower bound of an input on a logarithmic scale is not above 0.
pub(crate) fn axes(inputs: &[Input], scales: &[Scale]) -> Result<Vec<Axis>, SurrogateError> {
    check_count("scales of inputs", inputs.len(), scales.len())?;
    inputs.iter().zip(scales).map(|(input, &scale)| Axis::new(input, scale)).collect()
}
