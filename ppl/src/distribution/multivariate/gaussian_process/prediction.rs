//! A Gaussian process at new inputs.

use rand::Rng;
use rand_distr::StandardNormal;

use super::covariance::Covariance;
use super::kernel::{Kernel, Point};
use super::process::{GaussianProcess, Mean, fits, require_mean};
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::Distribution;
use crate::distribution::vector::Vector;
use crate::scalar::Scalar;

/// The values of a Gaussian process at new inputs, given those at its own, without noise; made
/// by [`GaussianProcess::predict`].
///
/// Normal, with mean m* + K*ᵀ K⁻¹ (y − m) and covariance K** − K*ᵀ K⁻¹ K*. The mean function at
/// the new inputs is that of the process where it is one number; a vector is given by
/// [`mean`](Self::mean).
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// let kernel = SquaredExponential(1.0, 0.5);
/// let process = GaussianProcess::new(&[0.0, 1.0], kernel).noise(0.1);
/// let new = process.predict([0.8, -0.3], &[0.0, 0.5, 40.0]);
/// let (mean, sd) = new.moments::<f64>();
/// assert!((mean[0] - 0.8).abs() < 0.05 && sd[0] < 0.1); // where data are
/// assert!(mean[2].abs() < 1e-12 && (sd[2] - 1.0).abs() < 1e-9); // far from them
/// ```
///
/// # References
/// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, (2.23)–(2.24).
#[derive(Clone, Copy, Debug)]
pub struct Prediction<'a, P, K, M, S, Y, N> {
    pub(super) process: GaussianProcess<'a, P, K, M, S>,
    pub(super) y: Y,
    pub(super) inputs: &'a [P],
    pub(super) mean: N,
}

impl<'a, P: Point, K, M, S> GaussianProcess<'a, P, K, M, S> {
    /// The process, without its noise, at other inputs, given its values `y`.
    pub fn predict<Y>(self, y: Y, inputs: &'a [P]) -> Prediction<'a, P, K, M, S, Y, M>
    where
        M: Clone,
    {
        let mean = self.mean.clone();
        Prediction { process: self, y, inputs, mean }
    }
}

impl<'a, P: Point, K, M, S, Y, N> Prediction<'a, P, K, M, S, Y, N> {
    /// With this mean function at the new inputs: a number, or a vector with one for each.
    pub fn mean<O>(self, mean: O) -> Prediction<'a, P, K, M, S, Y, O> {
        let Self { process, y, inputs, .. } = self;
        Prediction { process, y, inputs, mean }
    }

    /// Means and standard deviations at the new inputs.
    pub fn moments<R>(&self) -> (Vec<f64>, Vec<f64>)
    where
        R: Scalar,
        K: Kernel<R>,
        M: Mean<R>,
        S: Datum<R>,
        Y: Vector<R>,
        N: Mean<R>,
    {
        let new = self.inputs.len();
        let spread = |row: &[f64]| row.iter().map(|l| l * l).sum::<f64>().sqrt();
        self.conditional(|mean, a, rows| {
            let sd = rows.iter().map(|row| a * spread(row)).collect();
            (mean, sd)
        })
        .unwrap_or_else(|| (vec![f64::NAN; new], vec![f64::NAN; new]))
    }

    fn joint<R: Scalar>(&self) -> Covariance<'_, P, K, R>
    where
        S: Datum<R>,
    {
        Covariance { inputs: [self.process.inputs, self.inputs], ..self.process.covariance() }
    }

    /// Mean, amplitude a, and the rows of the factor of the conditional covariance over a²: the
    /// last block of the joint factor.
    fn conditional<R, T>(&self, then: impl FnOnce(Vec<f64>, f64, &[&[f64]]) -> T) -> Option<T>
    where
        R: Scalar,
        K: Kernel<R>,
        M: Mean<R>,
        S: Datum<R>,
        Y: Vector<R>,
        N: Mean<R>,
    {
        let (n, new) = (self.process.inputs.len(), self.inputs.len());
        if self.y.size() != n || !fits(&self.process.mean, n) || !fits(&self.mean, new) {
            return None;
        }
        let root = self.joint::<R>().root(&[], false)?;
        let a = self.process.kernel.amplitude().value();
        let deviation = |i| (self.y.at(i).value() - self.process.mean.at(i).value()) / a;
        let z = root.solve((0..n).map(deviation));
        let rows: Vec<&[f64]> = (n..n + new).map(|i| root.row(i)).collect();
        let explained = |row: &[f64]| row.iter().zip(&z).map(|(l, z)| l * z).sum::<f64>();
        let mean = rows.iter().enumerate();
        let mean = mean.map(|(i, row)| self.mean.at(i).value() + a * explained(row)).collect();
        let rows: Vec<&[f64]> = rows.into_iter().map(|row| &row[n..]).collect();
        Some(then(mean, a, &rows))
    }
}

impl<P, K, M, S, Y, N> Family for Prediction<'_, P, K, M, S, Y, N>
where
    P: Point + Clone,
    K: Clone,
    M: Clone,
    S: Clone,
    Y: Clone,
    N: Clone,
{
}

impl<R, P, K, M, S, Y, N> Distribution<R> for Prediction<'_, P, K, M, S, Y, N>
where
    R: Scalar,
    P: Point + Clone,
    K: Kernel<R>,
    M: Mean<R>,
    S: Datum<R> + Clone,
    Y: Vector<R> + Clone,
    N: Mean<R>,
{
    type Value = Vec<R>;

    /// The joint density of old and new values over that of the old ones.
    fn ln_density(&self, x: &Vec<R>) -> R {
        let n = self.process.inputs.len();
        let sizes = x.len() == self.inputs.len() && self.y.size() == n;
        if !sizes || !fits(&self.process.mean, n) || !fits(&self.mean, x.len()) {
            return R::from(f64::NEG_INFINITY);
        }
        let old = |i: usize| self.y.at(i);
        let old_mean = |i: usize| self.process.mean.at(i);
        let joint = self.joint().ln_density(
            |i| if i < n { old(i) } else { x[i - n] },
            |i| if i < n { old_mean(i) } else { self.mean.at(i - n) },
        );
        joint - self.process.covariance().ln_density(old, old_mean)
    }

    fn validate(&self) -> Result<(), DomainError> {
        Distribution::<R>::validate(&self.process)?;
        let n = self.process.inputs.len();
        let requirement = format_args!("that of the inputs, {n}");
        let size = self.y.size();
        DomainError::require(size == n, "predict", "number of values", requirement, size as f64)?;
        require_mean(&self.mean, self.inputs.len())
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        let new = self.inputs.len();
        let z: Vec<f64> = (0..new).map(|_| rng.sample(StandardNormal)).collect();
        let inner = |row: &[f64]| row.iter().zip(&z).map(|(l, z)| l * z).sum::<f64>();
        self.conditional(|mean, a, rows| {
            mean.iter().zip(rows).map(|(m, row)| R::from(m + a * inner(row))).collect()
        })
        .unwrap_or_else(|| vec![R::from(f64::NAN); new])
    }
}
