//! What the runs leave open of an expansion: the posterior of its coefficients.
//!
//! Least squares with errors of one covariance Σ from run to run and a prior that says nothing,
//! p(C, Σ) ∝ |Σ|^(−(M+1)/2), has a posterior in closed form (Box & Tiao, *Bayesian Inference in Statistical
//! Analysis*, 1973, section 8.4): Σ is inverse Wishart with ν = N − P degrees of freedom and scale RᵀR, and
//! C given Σ is normal about its estimate with covariance (ΨᵀΨ)⁻¹ ⊗ Σ. It is preferred to a bootstrap of
//! runs because it is exact where each run has a packing of its own, needs no further fit, does not fail
//! where runs are hardly more than terms, and gives the error at a place as one number: the leverage.
//! A bootstrap narrows there, since residuals are smaller than errors by √(1 − h).
//!
//! Two fits are no such regression, and their Σ is taken so that the errors are not too small. Where
//! derivatives were fitted too, errors of a run hang together: Σ is scaled to what leaving out runs
//! changes. Terms that were chosen by the data explain some of the noise: Σ is that of cross-validation.

use ppl::{DomainError, DynDifferentiable};
use rand::Rng;
use rand_distr::{ChiSquared, Distribution, StandardNormal};
use serde::{Deserialize, Serialize};

use crate::dataset::check_count;
use crate::dyn_pce::DynPce;
use crate::error::SurrogateError;
use crate::legendre::{basis_row, basis_slopes};
use crate::scale::Axis;

/// The posterior of an expansion's coefficients.
///
/// In a model it is a function of the inputs with one output, the [leverage](Self::leverage).
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
/// let open = &fit.coefficients;
/// // the standard error of the line at 0.2, and another line that the runs allow
/// let sd = open.error(&[0.2], &fit.pce.value(&[0.2])?)?[0][0].sqrt();
/// let other = open.draw(&mut rng)?;
/// assert!(sd < 0.02 && (other.value(&[0.2])?[0] - 3.2).abs() < 0.05);
/// # Ok::<(), surrogate::SurrogateError>(())
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "Stored")]
pub struct CoefficientPosterior {
    estimate: DynPce,
    /// Of each term of the estimate, in their order, its row of a factor F with F Fᵀ = (ΨᵀΨ)⁻¹.
    factor: Vec<Vec<f64>>,
    /// s² of the runs (outputs × outputs) on the outputs' scales.
    scatter: Vec<Vec<f64>>,
    /// ν
    freedom: f64,
}

/// The same as it is read, unchecked.
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
    /// From the estimate and, by its terms in any order, the rows of the factor.
    pub(crate) fn new(
        estimate: &DynPce,
        rows: impl IntoIterator<Item = (Vec<u8>, Vec<f64>)>,
        scatter: Vec<Vec<f64>>,
        freedom: f64,
    ) -> Result<Self, SurrogateError> {
        let mut rows: Vec<(Vec<u8>, Vec<f64>)> = rows.into_iter().collect();
        let terms = estimate.terms();
        let place = |index: &Vec<u8>| terms.iter().position(|(own, _)| own == index);
        rows.sort_by_cached_key(|(index, _)| place(index));
        let factor = rows.into_iter().map(|(_, row)| row).collect();
        Stored { estimate: estimate.clone(), factor, scatter, freedom }.try_into()
    }

    /// The expansion that was fitted.
    pub fn estimate(&self) -> &DynPce {
        &self.estimate
    }

    /// ν: runs less terms, or what takes their place where derivatives were fitted too.
    pub fn freedom(&self) -> f64 {
        self.freedom
    }

    /// The leverage h(x) = ψ(x)ᵀ(ΨᵀΨ)⁻¹ψ(x): the variance of the fit at `x` per variance of a run's error.
    ///
    /// # Errors
    /// A point outside the box by more than the tolerance, NaN, or one of another length.
    pub fn leverage(&self, x: &[f64]) -> Result<f64, SurrogateError> {
        self.estimate.position(x)?;
        Ok(self.leverage_at_unit(&self.unit(x)))
    }

    /// The covariance (outputs × outputs, in their units) of what the runs leave open at `x`, where the
    /// outputs are `at`: s² h(x).
    ///
    /// It is the error of the mean response of specimens that differ from run to run. What a polynomial
    /// misses of a single specimen's response comes beside it; [`FitReport::lack_of_fit`] has both.
    ///
    /// # Errors
    /// As [`Self::leverage`]; another number of values than of outputs.
    ///
    /// [`FitReport::lack_of_fit`]: crate::FitReport::lack_of_fit
    pub fn error(&self, x: &[f64], at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let leverage = self.leverage(x)?;
        let scatter = self.scatter(at)?;
        let row = |row: Vec<f64>| row.into_iter().map(|c| c * leverage).collect();
        Ok(scatter.into_iter().map(row).collect())
    }

    /// s² (outputs × outputs, in their units), where the outputs are `at`: [`Self::error`] per leverage.
    ///
    /// # Errors
    /// Another number of values than of outputs.
    pub fn scatter(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let scales = self.estimate.output_scales();
        check_count("output values", scales.len(), at.len())?;
        let slopes: Vec<f64> = scales.iter().zip(at).map(|(scale, &y)| scale.slope_at(y)).collect();
        let row =
            |(row, a): (&Vec<f64>, &f64)| row.iter().zip(&slopes).map(|(c, b)| a * b * c).collect();
        Ok(self.scatter.iter().zip(&slopes).map(row).collect())
    }

    /// The covariance (outputs × outputs, in their units) of what the runs leave open, averaged over the box,
    /// where the outputs are `at`: s² tr (ΨᵀΨ)⁻¹, inputs uniform on their scales.
    ///
    /// # Errors
    /// Another number of values than of outputs.
    pub fn mean_error(&self, at: &[f64]) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let mean: f64 = self.factor.iter().flatten().map(|f| f * f).sum();
        let row = |row: Vec<f64>| row.into_iter().map(|c| c * mean).collect();
        Ok(self.scatter(at)?.into_iter().map(row).collect())
    }

    /// The same with s² times a factor: for an s² that is poorly known itself.
    pub fn widened(mut self, factor: f64) -> Self {
        self.scatter.iter_mut().flatten().for_each(|entry| *entry *= factor);
        self
    }

    /// F, a row for each term.
    pub(crate) fn factor(&self) -> &[Vec<f64>] {
        &self.factor
    }

    /// An expansion that the runs allow: all coefficients of all outputs drawn together.
    ///
    /// # Errors
    /// Fewer degrees of freedom than outputs, which say nothing of their covariance.
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

    /// A factor of a draw of Σ, by rows: L₀ A⁻ᵀ with L₀L₀ᵀ = ν s² and Bartlett's triangle A of a standard
    /// Wishart matrix.
    fn spread<R: Rng>(&self, rng: &mut R) -> Result<Vec<Vec<f64>>, SurrogateError> {
        let m = self.scatter.len();
        let mut bartlett = vec![vec![0.0; m]; m];
        for (i, row) in bartlett.iter_mut().enumerate() {
            for entry in &mut row[..i] {
                *entry = rng.sample(StandardNormal);
            }
            let square = ChiSquared::new(self.freedom - i as f64).map_err(|_| {
                let what = "degrees of freedom beyond the terms, at least";
                SurrogateError::Count { what, expected: m, found: self.freedom.max(0.0) as usize }
            })?;
            row[i] = square.sample(rng).sqrt();
        }
        let lower = semidefinite_factor(&self.scatter);
        // each row x of L₀ A⁻ᵀ solves A xᵀ = l
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

    /// s² on the outputs' scales.
    pub(crate) fn own_scatter(&self) -> &[Vec<f64>] {
        &self.scatter
    }

    pub(crate) fn leverage_at_unit(&self, t: &[f64]) -> f64 {
        let psi = basis_row(self.indices(), t);
        self.projected(&psi).iter().map(|w| w * w).sum()
    }

    /// Fᵀ ψ at a point.
    ///
    /// # Errors
    /// As [`Self::leverage`].
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

    /// The basis at a point.
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
        // ∂h = 2 (F Fᵀψ)ᵀ ∂ψ
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

/// L with L Lᵀ = a symmetric matrix, with columns of zeros where that has no rank: outputs that
/// polynomials follow exactly have no scatter.
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
