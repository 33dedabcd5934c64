//! Gaussian processes observed with noise.

use std::fmt::Debug;

use rand::Rng;
use rand_distr::StandardNormal;

use super::correlations::{Correlations, InCovariance, square_distance};
use super::covariance::{Covariance, CovarianceParameters};
use super::matrix::Upper;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::glm::Design;
use crate::distribution::multivariate::{DynCholeskyFactor, MvNormalCholesky};
use crate::distribution::traits::{Distribution, Unknown};
use crate::distribution::vector::Sequence;
use crate::number::partials::Each;
use crate::number::scalar::Scalar;
use crate::quantity::datum::{Datum, Recordable};
use crate::special::HALF_LN_2PI;
use crate::term::accumulator::Accumulator;
use crate::term::parameter::Parameter;

/// Values of a Gaussian process at n points, observed with independent noise: `GaussianProcess(points, mean,
/// covariance, noise)`.
///
/// y ~ N(m, C), Cᵢⱼ = k(xᵢ, xⱼ) + s² δᵢⱼ,
///
/// with the points xᵢ (`&[f64]`, `&[[f64; D]]` or `&[Vec<f64>]`), the means mᵢ (an array, a slice or a `Vec` of numbers
/// or unknowns), a [`Covariance`] k such as [`SquaredExponential`](super::SquaredExponential), and the standard
/// deviation s > 0 of the noise. The points must be data.
///
/// The distribution is one operation with exact partial derivatives. A density costs n³/3 multiplications, a gradient
/// n³ multiplications and memory for n² numbers. If the process itself is an unknown, use a small noise, about 1e-5 of
/// the amplitude, which keeps C positive definite. If C is not positive definite, the density is NaN.
///
/// [`predict`](Self::predict) returns the distribution of further observations.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// A line plus a smooth discrepancy, observed with noise.
///     fn discrepancy(x: &[f64], y: &[f64], further: &[f64]) {
///         let slope ~ Normal(0.0, 2.0);
///         let amplitude ~ HalfNormal(1.0);
///         let length ~ LogNormal(0.0, 0.5);
///         let sd ~ HalfNormal(0.3);
///         let mean: Vec<Real> = x.iter().map(|x| slope * x).collect();
///         let process = GaussianProcess(x, &mean, SquaredExponential(amplitude, length), sd);
///         y ~ process;
///         let beyond: Vec<Real> = further.iter().map(|x| slope * x).collect();
///         #[predict] let next ~ process.predict(y, further, &beyond)?;
///     }
/// }
/// let model = discrepancy(&[0.0, 0.4, 1.0], &[0.1, 0.6, 0.9], &[1.2, 1.4]);
/// ppl::check::gradient(&model, 1);
/// ```
///
/// # References
/// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, eqs. 2.30 and 5.9; Kennedy & O'Hagan (2001),
/// *Bayesian Calibration of Computer Models*, doi:10.1111/1467-9868.00294.
#[derive(Clone, Copy, Debug)]
pub struct GaussianProcess<X, M, K, S>(pub X, pub M, pub K, pub S);

impl<X: Clone, M: Clone, K: Clone, S: Clone> Family for GaussianProcess<X, M, K, S> {}

const NAME: &str = "GaussianProcess";

impl<X: Design, M: Sequence<Item: Parameter>, K: Covariance, S: Parameter>
    GaussianProcess<X, M, K, S>
{
    /// Returns the distribution of further noisy observations at other points, given the observations `y`. `mean`
    /// contains the means at the other points. The distribution has no derivatives: use it for predictions.
    ///
    /// # Errors
    /// [`DomainError`] if a parameter is invalid, if lengths differ, or if a covariance matrix is not positive
    /// definite.
    ///
    /// # Example
    /// ```
    /// use ppl::prelude::*;
    ///
    /// let process = GaussianProcess(&[0.0], &[0.0], Matern32(1.0, 2.0), 1e-6);
    /// // the process passes through the observation, and far away it has its mean and its amplitude
    /// let near = process.predict(&[0.7], &[1e-9], &[0.0])?;
    /// assert!((near.0[0] - 0.7).abs() < 1e-6 && near.1.get(0, 0) < 1e-5);
    /// let far = process.predict(&[0.7], &[100.0], &[0.2])?;
    /// assert!((far.0[0] - 0.2).abs() < 1e-6 && (far.1.get(0, 0) - 1.0).abs() < 1e-6);
    /// # Ok::<(), ppl::DomainError>(())
    /// ```
    pub fn predict<P: Design>(
        &self,
        y: &[impl Parameter],
        points: P,
        mean: &[impl Parameter],
    ) -> Result<MvNormalCholesky<Vec<f64>, DynCholeskyFactor<f64>>, DomainError> {
        let Self(observed, means, covariance, noise) = self;
        self.validate_covariance()?;
        let lengths = [
            ("length of y", y.len(), "number of points", observed.size()),
            ("length of the mean", means.items().len(), "number of points", observed.size()),
            ("length of the other mean", mean.len(), "number of other points", points.size()),
        ];
        for (name, length, other, size) in lengths {
            let requirement = format_args!("equal to the {other}, {size}");
            DomainError::require(length == size, NAME, name, requirement, length as f64)?;
        }
        let columns = (observed.size() > 0).then(|| observed.row(0).len());
        for i in 0..points.size() {
            let (row, name) = (points.row(i), format_args!("number of columns of other point {i}"));
            let expected = columns.unwrap_or(row.len());
            let requirement = format_args!("equal to the number of columns of point 0, {expected}");
            let holds = expected == row.len();
            DomainError::require(holds, NAME, name, requirement, row.len() as f64)?;
        }
        let (Some(weights), Some(factor)) = (self.weights(), self.factor()) else {
            return Err(DomainError::new(format!(
                "{NAME}: the covariance matrix of the observations is not positive definite; use a larger noise"
            )));
        };
        let scale = covariance.amplitude().powi(2);
        let between = |a: &[f64], b: &[f64]| {
            scale * covariance.correlation(square_distance(a, b, &weights)).0
        };
        let mut residual: Vec<f64> =
            y.iter().zip(means.items()).map(|(y, mean)| y.number() - mean.number()).collect();
        factor.solve_transposed(&mut residual);
        // columns of U⁻ᵀ K, where K has the covariances between the observations and the other points
        let columns: Vec<Vec<f64>> = (0..points.size())
            .map(|i| {
                let mut column: Vec<f64> =
                    (0..observed.size()).map(|j| between(observed.row(j), points.row(i))).collect();
                factor.solve_transposed(&mut column);
                column
            })
            .collect();
        let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(a, b)| a * b).sum() };
        let centre =
            mean.iter().zip(&columns).map(|(m, column)| m.number() + dot(column, &residual));
        let entry = |i: usize, j: usize| {
            let nugget = if i == j { noise.number().powi(2) } else { 0.0 };
            between(points.row(i), points.row(j)) - dot(&columns[i], &columns[j]) + nugget
        };
        let matrix: Vec<Vec<f64>> =
            (0..points.size()).map(|i| (0..=i).map(|j| entry(i, j)).collect()).collect();
        Ok(MvNormalCholesky(centre.collect(), DynCholeskyFactor::of_covariance(&matrix)?))
    }
}

impl<X: Design, M, K: Covariance, S: Parameter> GaussianProcess<X, M, K, S> {
    /// Returns the weights 1/ℓ² of squared distances; `None` if a parameter of the covariance or the
    /// noise is not positive and finite.
    fn weights(&self) -> Option<Vec<f64>> {
        let lengths = self.2.lengths();
        let mut all = lengths.iter().copied().chain([self.2.amplitude(), self.3.number()]);
        let holds = all.all(|x| x > 0.0 && x.is_finite());
        holds.then(|| lengths.iter().map(|length| (length * length).recip()).collect())
    }

    /// Returns the factor of the covariance matrix of the observations; `None` if the matrix is not
    /// positive definite.
    fn factor(&self) -> Option<Upper> {
        let correlations = Correlations::new(self.0, &self.2, &self.weights()?);
        correlations.factor(self.2.amplitude(), self.3.number())
    }

    /// Checks points, covariance and noise.
    fn validate_covariance(&self) -> Result<(), DomainError> {
        let Self(points, _, covariance, noise) = self;
        let columns = if points.size() == 0 { 0 } else { points.row(0).len() };
        for i in 0..points.size() {
            let row = points.row(i);
            let name = format_args!("number of columns of point {i}");
            let requirement = format_args!("equal to the number of columns of point 0, {columns}");
            DomainError::require(row.len() == columns, NAME, name, requirement, row.len() as f64)?;
            for (d, x) in row.iter().enumerate() {
                DomainError::require_finite(NAME, format_args!("point {i}, column {d}"), *x)?;
            }
        }
        DomainError::require_positive(NAME, "amplitude", covariance.amplitude())?;
        let lengths = covariance.lengths();
        for (d, length) in lengths.iter().enumerate() {
            DomainError::require_positive(NAME, format_args!("length {d}"), *length)?;
        }
        let holds = lengths.len() == 1 || points.size() == 0 || lengths.len() == columns;
        let requirement = format_args!("1 or equal to the number of columns, {columns}");
        let count = lengths.len() as f64;
        DomainError::require(holds, NAME, "number of lengths", requirement, count)?;
        DomainError::require_positive(NAME, "noise", noise.number())
    }
}

impl<R, X, M, K, S> Distribution<R> for GaussianProcess<X, M, K, S>
where
    R: Scalar,
    X: Design,
    M: Sequence<Item: Datum<R>>,
    K: CovarianceParameters<R>,
    S: Parameter + Datum<R>,
{
    type Value = Vec<R>;

    fn add_terms(&self, x: &Vec<R>, terms: &mut impl Accumulator<R>) {
        let Self(points, mean, covariance, noise) = self;
        let size = points.size();
        if x.len() != size || mean.items().len() != size {
            return terms.add_number(R::from(f64::NEG_INFINITY));
        }
        let Some(weights) = self.weights() else {
            return terms.add_number(R::from(f64::NAN));
        };
        let (amplitude, sd) = (covariance.amplitude(), noise.number());
        let correlations = Correlations::new(*points, covariance, &weights);
        let Some(factor) = correlations.factor(amplitude, sd) else {
            return terms.add_number(R::from(f64::NAN));
        };
        let means: Vec<R> = mean.items().iter().map(Datum::lift).collect();
        let mut z: Vec<f64> = x.iter().zip(&means).map(|(x, m)| x.value() - m.value()).collect();
        factor.solve_transposed(&mut z);
        let square: f64 = z.iter().map(|z| z * z).sum();
        let constant = -HALF_LN_2PI * size as f64;
        let value = constant - 0.5 * square - factor.half_ln_determinant();
        if !R::DIFFERENTIABLE {
            return terms.add_number(R::from(value));
        }
        // α = C⁻¹ (x − m)
        factor.solve(&mut z);
        let mut hyperparameters = covariance.parameters();
        hyperparameters.push(noise.lift());
        let is_constant = hyperparameters.iter().all(|hyperparameter| hyperparameter.is_constant());
        let slopes = match is_constant {
            true => vec![0.0; hyperparameters.len()],
            false => {
                let in_covariance = InCovariance::new(&factor, &z);
                in_covariance.slopes(*points, &correlations, amplitude, sd, &weights)
            }
        };
        let of_values = x.iter().zip(&z).map(|(x, a)| (*x, -a));
        let of_means = means.iter().zip(&z).map(|(m, a)| (*m, *a));
        terms.add(
            value,
            Each(of_values.chain(of_means).chain(hyperparameters.into_iter().zip(slopes))),
        );
    }

    fn validate(&self) -> Result<(), DomainError> {
        self.validate_covariance()?;
        let (means, size) = (self.1.items(), self.0.size());
        let requirement = format_args!("equal to the number of points, {size}");
        let count = means.len() as f64;
        DomainError::require(means.len() == size, NAME, "length of the mean", requirement, count)?;
        for (i, mean) in means.iter().enumerate() {
            let mean: R = mean.lift();
            DomainError::require_finite(NAME, format_args!("mean[{i}]"), mean.value())?;
        }
        Ok(())
    }

    fn fits(&self, x: &Vec<R>) -> Result<(), DomainError> {
        let size = self.0.size();
        let requirement = format_args!("equal to the number of points, {size}");
        DomainError::require(x.len() == size, NAME, "length of x", requirement, x.len() as f64)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        let z: Vec<f64> = (0..self.0.size()).map(|_| rng.sample(StandardNormal)).collect();
        let deviations = match self.factor() {
            Some(factor) => factor.transposed_times(&z),
            None => vec![f64::NAN; z.len()],
        };
        let means = (0..z.len()).map(|i| self.1.at::<R>(i).value());
        means.zip(deviations).map(|(mean, deviation)| R::from(mean + deviation)).collect()
    }
}

impl<R, X, M, K, S> Unknown<R> for GaussianProcess<X, M, K, S>
where
    R: Scalar,
    X: Design,
    M: Sequence<Item: Datum<R>>,
    K: CovarianceParameters<R>,
    S: Parameter + Datum<R>,
{
    fn dim(&self) -> usize {
        self.0.size()
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Vec<R> {
        let x: Vec<R> = (0..self.0.size()).map(|_| next()).collect();
        self.add_terms(&x, terms);
        x
    }

    fn unconstrain(&self, x: &Vec<R>, out: &mut Vec<f64>) {
        x.flatten(out);
    }
}
