//! Posterior of the coefficients of an expansion, which describes the estimation error of the expansion given the
//! runs.
//!
//! The regression model Y = Ψ C + E has N runs, P terms and M outputs; Ψ contains the values of the basis polynomials
//! at the runs, C the coefficients. The errors E are independent between runs, with one covariance Σ (outputs ×
//! outputs). With the noninformative prior p(C, Σ) ∝ |Σ|^(−(M+1)/2) the posterior has a closed form (Box & Tiao,
//! *Bayesian Inference in Statistical Analysis*, 1973, section 8.4): Σ is inverse Wishart with ν = N − P degrees of
//! freedom and scale RᵀR, where R are the residuals, and C given Σ is normal about the least squares estimate with
//! covariance (ΨᵀΨ)⁻¹ ⊗ Σ.
//!
//! This posterior is preferred to a bootstrap of the runs for four reasons. The posterior is exact if each run is on
//! a different random specimen. The posterior needs no further fit. The posterior is valid even if there are hardly
//! more runs than terms; a bootstrap is then too narrow, because residuals are smaller than errors by the factor √(1
//! − h). The posterior reduces the error at a point to one number, the leverage h.
//!
//! Two kinds of fit violate the assumptions. For both kinds, Σ is replaced by an estimate that is not too small:
//! - Fits with derivatives: the errors within a run are correlated. Σ is scaled to the jackknife covariance,
//!   which leaves out whole runs.
//! - Fits with sparse terms: terms that were chosen by the data explain some of the noise. Σ is the
//!   covariance of the cross-validation residuals.

use ppl::{DomainError, DynDifferentiable};
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::dataset::check_count;
use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::legendre::{basis_row, basis_slopes};
use crate::scale::Axis;

/// Posterior of the coefficients of an expansion.
///
/// As a function in a `ppl` model, the posterior maps the inputs to one output, the [leverage](Self::leverage).
///
/// ```
/// use surrogate::{Dataset, DesignMethod, DynPce, FitOptions, Input, rand};
/// use rand::{Rng, SeedableRng, rngs::StdRng};
/// let mut rng = StdRng::seed_from_u64(1);
/// let inputs = vec![Input::new("a", 0.0, 1.0)?];
/// let mut runs = Dataset::new(inputs.clone(), vec!["f".into()], "a line with noise")?;
/// for x in DesignMethod::Sobol.sample(&inputs, 32, 1)? {
///     runs.push(&x, &[3.0 + x[0] + 0.1 * (rng.random::<f64>() - 0.5)])?;
/// }
/// let fit = DynPce::fit(&runs, &FitOptions::default())?;
/// let posterior = &fit.coefficients;
/// // the standard error of the line at 0.2, and a line that is drawn from the posterior
/// let sd = posterior.error(&[0.2], &fit.pce.value(&[0.2])?)?[0][0].sqrt();
/// let drawn = posterior.draw(&mut rng)?;
/// assert!(sd < 0.02 && (drawn.value(&[0.2])?[0] - 3.2).abs() < 0.05);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored")]
pub struct CoefficientPosterior {
    estimate: DynPce,
    /// Factor F with F Fᵀ = (ΨᵀΨ)⁻¹, one row per term, in the order of the terms of `estimate`. Ψ contains the values
    /// of the basis polynomials at the runs.
    factor: Vec<Vec<f64>>,
    /// Covariance s² (outputs × outputs) of the error of a single run, on the linear or logarithmic scales of the
    /// outputs.
    scatter: Vec<Vec<f64>>,
    /// Degrees of freedom ν of the estimated covariance s² of the error of a single run.
    freedom: f64,
}

/// Deserialized fields of a [`CoefficientPosterior`], before their sizes are checked.
#[derive(Deserialize)]
struct Stored {
    estimate: DynPce,
    factor: Vec<Vec<f64>>,
    scatter: Vec<Vec<f64>>,
    freedom: f64,
}

impl TryFrom<Stored> for CoefficientPosterior {
    type Error = SurrogateError;

    fn try_from(stored: Stored) -> Result<Self, SurrogateError> {
        let Stored { estimate, factor, scatter, freedom } = stored;
        let (terms, outputs) = (estimate.terms().len(), estimate.outputs().len());
        check_count("rows of the factor", terms, factor.len())?;
        check_count("rows of the scatter", outputs, scatter.len())?;
        let width = factor[0].len();
        factor.iter().try_for_each(|row| check_count("columns of the factor", width, row.len()))?;
        for row in &scatter {
            check_count("columns of the scatter", outputs, row.len())?;
        }
        Ok(Self { estimate, factor, scatter, freedom })
    }
}

impl CoefficientPosterior {
    /// Builds the posterior from the estimate and the rows of the factor F, given as (term, row) in any
    /// order.
    pub(crate) fn new(
        estimate: &DynPce,
        rows: impl IntoIterator<Item = (Vec<u8>, Vec<f64>)>,
        scatter: Vec<Vec<f64>>,
        freedom: f64,
    ) -> Result<Self, SurrogateError> {
        let mut rows: Vec<(Vec<u8>, Vec<f64>)> = rows.into_iter().collect();
        let terms = estimate.terms();
        let position = |index: &Vec<u8>| terms.iter().position(|(term, _)| term == index);
        rows.sort_by_cached_key(|(index, _)| position(index));
        let factor = rows.into_iter().map(|(_, row)| row).collect();
        Stored { estimate: estimate.clone(), factor, scatter, freedom }.try_into()
    }

    /// Returns the expansion with the coefficients of the least squares estimate.
    pub fn estimate(&self) -> &DynPce {
        &self.estimate
    }

    /// Degrees of freedom ν of the estimated covariance s² of the error of a single run. Without derivatives, ν is the
    /// number of runs minus the number of terms.
    pub fn freedom(&self) -> f64 {
        self.freedom
    }

    /// Returns the leverage h(x) = ψ(x)ᵀ(ΨᵀΨ)⁻¹ψ(x), which is the ratio of the variance of the fit at `x` to the
    /// variance of the error of a single run. ψ(x) contains the values of the basis polynomials at `x`.
    ///
    /// # Errors
    /// If `x` lies outside the box by more than the tolerance, contains NaN, or has the wrong length.
    pub fn leverage(&self, x: &[f64]) -> Result<f64, SurrogateError> {
        self.estimate.position(x)?;
        Ok(self.leverage_at_unit(&self.unit(x)))
    }

    /// Returns the covariance s² h(x) of the fit at `x` (outputs × outputs, in the outputs' units): the covariance s²
    /// of the error of a single run times the leverage h(x). `at` are the values of the outputs at `x`.
    ///
    /// If each run has a separate specimen, this covariance is the error of the mean response over specimens. This
    /// covariance does not include the lack of fit of the polynomial to the response of a single specimen.
    /// [`FitReport::lack_of_fit`] includes the lack of fit and the scatter between specimens.
    ///
    /// # Errors
    /// The errors of [`Self::leverage`], and an error if `at` does not have one value per output.
    ///
    /// [`FitReport::lack_of_fit`]: crate::FitReport::lack_of_fit
    pub fn error(&self, x: &[f64], at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let leverage = self.leverage(x)?;
        let scatter = self.scatter(at)?;
        let row = |row: Vec<f64>| row.into_iter().map(|c| c * leverage).collect();
        Ok(scatter.into_iter().map(row).collect())
    }

    /// Covariance s² of the error of a single run (outputs × outputs, in the outputs' units): [`Self::error`] divided
    /// by the leverage. The output values `at` are needed to convert from a logarithmic scale.
    ///
    /// # Errors
    /// If `at` does not have one value per output.
    pub fn scatter(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let scales = self.estimate.output_scales();
        check_count("output values", scales.len(), at.len())?;
        let slopes: Vec<f64> = scales.iter().zip(at).map(|(scale, &y)| scale.slope_at(y)).collect();
        let row =
            |(row, a): (&Vec<f64>, &f64)| row.iter().zip(&slopes).map(|(c, b)| a * b * c).collect();
        Ok(self.scatter.iter().zip(&slopes).map(row).collect())
    }

    /// Covariance s² tr (ΨᵀΨ)⁻¹ of the fit averaged over the box (outputs × outputs, in the outputs' units). s² is the
    /// covariance of the error of a single run, and Ψ contains the values of the basis polynomials at the runs. The
    /// average is over inputs that are uniform on their scales. The output values `at` are needed to convert from a
    /// logarithmic scale.
    ///
    /// # Errors
    /// If `at` does not have one value per output.
    pub fn mean_error(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let mean: f64 = self.factor.iter().flatten().map(|f| f * f).sum();
        let row = |row: Vec<f64>| row.into_iter().map(|c| c * mean).collect();
        Ok(self.scatter(at)?.into_iter().map(row).collect())
    }

    /// Multiplies the covariance s² of the error of a single run by a factor, to account for the uncertainty of s²
    /// itself.
    pub fn widened(mut self, factor: f64) -> Self {
        self.scatter.iter_mut().flatten().for_each(|entry| *entry *= factor);
        self
    }

    /// Factor F with F Fᵀ = (ΨᵀΨ)⁻¹, one row per term. Ψ contains the values of the basis polynomials at the runs.
    pub(crate) fn factor(&self) -> &[Vec<f64>] {
        &self.factor
    }

    /// Draws an expansion from the posterior: all coefficients of all outputs jointly.
    ///
    /// # Errors
    /// If there are fewer degrees of freedom than outputs, so that no covariance of the outputs can be drawn.
    pub fn draw<R: Rng>(&self, rng: &mut R) -> Result<DynPce, SurrogateError> {
        let (m, columns) = (self.scatter.len(), self.factor[0].len());
        let spread = self.spread(rng)?;
        let deviations: Vec<Vec<f64>> = (0..columns)
            .map(|_| {
                let z: Vec<f64> = (0..m).map(|_| rng.sample(StandardNormal)).collect();
                spread.iter().map(|row| dot(row, &z)).collect()
            })
            .collect();
        let terms = self.estimate.terms().iter().zip(&self.factor).map(|((index, c), row)| {
            let moved = (0..m).map(|m| {
                c[m] + row
                    .iter()
                    .zip(&deviations)
                    .map(|(f, deviation)| f * deviation[m])
                    .sum::<f64>()
            });
            (index.clone(), moved.collect())
        });
        let estimate = &self.estimate;
        DynPce::from_terms(estimate.inputs().to_vec(), estimate.outputs().to_vec(), terms)?
            .with_scales(&estimate.input_scales(), estimate.output_scales())?
            .with_tolerance(estimate.tolerance())
    }

    /// Draws the covariance Σ of the error of a run, and returns its factor L₀ A⁻ᵀ by rows. Here L₀L₀ᵀ = ν s² with the
    /// estimate s² of Σ and its degrees of freedom ν, and A is the triangular Bartlett factor of a standard Wishart
    /// matrix.
    fn spread<R: Rng>(&self, rng: &mut R) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let m = self.scatter.len();
        let mut bartlett = vec![vec![0.0; m]; m];
        for (i, row) in bartlett.iter_mut().enumerate() {
            for entry in &mut row[..i] {
                *entry = rng.sample(StandardNormal);
            }
            let square = ChiSquared::new(self.freedom - i as f64).map_err(|_| {
                let what = "or more degrees of freedom of the residuals";
                SurrogateError::Count { what, expected: m, found: self.freedom.max(0.0) as usize }
            })?;
            row[i] = square.sample(rng).sqrt();
        }
        let lower = semidefinite_factor(&self.scatter);
        // each row x of L₀ A⁻ᵀ solves A xᵀ = lᵀ, where l is the same row of L₀
        let root = self.freedom.sqrt();
        let solve = |l: &Vec<f64>| {
            let mut x: Vec<f64> = Vec::with_capacity(m);
            for (i, row) in bartlett.iter().enumerate() {
                x.push((root * l[i] - dot(&row[..i], &x)) / row[i]);
            }
            x
        };
        Ok(lower.iter().map(solve).collect())
    }

    /// Returns the covariance s² (outputs × outputs) of the error of a single run, on the linear or logarithmic scales
    /// of the outputs.
    pub(crate) fn scatter_on_scales(&self) -> &[Vec<f64>] {
        &self.scatter
    }

    pub(crate) fn leverage_at_unit(&self, t: &[f64]) -> f64 {
        let psi = basis_row(self.indices(), t);
        self.projected(&psi).iter().map(|w| w * w).sum()
    }

    /// Returns the vector Fᵀ ψ(x), whose squared norm is the leverage at `x`. F is [`Self::factor`], and ψ(x) is
    /// [`Self::basis`].
    ///
    /// # Errors
    /// The errors of [`Self::leverage`].
    pub(crate) fn projection(&self, x: &[f64]) -> Result<Vec<f64>, SurrogateError> {
        self.estimate.position(x)?;
        Ok(self.projected(&basis_row(self.indices(), &self.unit(x))))
    }

    fn projected(&self, psi: &[f64]) -> Vec<f64> {
        let mut sum = vec![0.0; self.factor[0].len()];
        for (row, psi) in self.factor.iter().zip(psi) {
            sum.iter_mut().zip(row).for_each(|(sum, f)| *sum += f * psi);
        }
        sum
    }

    /// Returns the values of the basis polynomials at `x`, one value per term.
    pub(crate) fn basis(&self, x: &[f64]) -> Vec<f64> {
        basis_row(self.indices(), &self.unit(x))
    }

    fn unit(&self, x: &[f64]) -> Vec<f64> {
        self.estimate.axes().iter().zip(x).map(|(axis, &x)| axis.to_unit(x)).collect()
    }

    fn indices(&self) -> impl Iterator<Item = &Vec<u8>> + Clone {
        self.estimate.terms().iter().map(|(index, _)| index)
    }
}

impl DynDifferentiable for CoefficientPosterior {
    fn outputs(&self) -> usize {
        1
    }

    fn value_and_jacobian(&self, x: &[f64]) -> Result<(Vec<f64>, Vec<Vec<f64>>), DomainError> {
        self.estimate.position(x)?;
        let t = self.unit(x);
        let projected = self.projected(&basis_row(self.indices(), &t));
        // derivative of the leverage h = |Fᵀψ|² with the basis values ψ and the factor F: ∂h = 2 (F Fᵀψ)ᵀ ∂ψ
        let weights: Vec<f64> = self.factor.iter().map(|row| dot(row, &projected)).collect();
        let slope = |((row, axis), &x): ((&Vec<f64>, &Axis), &f64)| {
            2.0 * dot(row, &weights) * axis.slope_at(x)
        };
        let slopes = basis_slopes(self.indices(), &t);
        let jacobian = slopes.iter().zip(self.estimate.axes()).zip(x).map(slope).collect();
        Ok((vec![dot(&projected, &projected)], vec![jacobian]))
    }

    fn value(&self, x: &[f64]) -> Result<Vec<f64>, DomainError> {
        Ok(vec![self.leverage(x)?])
    }
}

pub(crate) fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Lower triangular factor L of a positive semidefinite matrix `a` = L Lᵀ. A pivot that is zero to working
/// precision gives a column of zeros: an output that the polynomial fits exactly has no scatter.
fn semidefinite_factor(a: &[Vec<f64>]) -> Vec<Vec<f64>> {
    let m = a.len();
    let mut l = vec![vec![0.0; m]; m];
    for j in 0..m {
        let rest = a[j][j] - dot(&l[j], &l[j]);
        if rest <= f64::EPSILON * a[j][j] {
            continue;
        }
        l[j][j] = rest.sqrt();
        for i in j + 1..m {
            l[i][j] = (a[i][j] - dot(&l[i], &l[j])) / l[j][j];
        }
    }
    l
}
