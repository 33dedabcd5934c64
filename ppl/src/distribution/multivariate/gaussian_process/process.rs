//! The values of a Gaussian process at given inputs.

use rand::Rng;
use rand_distr::StandardNormal;

use super::covariance::Covariance;
use super::kernel::{Kernel, Point};
use crate::accumulator::Accumulator;
use crate::datum::Datum;
use crate::density::DomainError;
use crate::distribution::family::Family;
use crate::distribution::traits::{Distribution, Unknown};
use crate::scalar::Scalar;
use crate::special::HALF_LN_2PI;

/// The mean of a Gaussian process: one number for all inputs, or one for each.
pub trait Mean<R>: Clone {
    /// How many inputs it is for; `None` for any.
    fn size(&self) -> Option<usize>;

    /// At input `i`.
    fn at(&self, i: usize) -> R;
}

impl<R, M: Scalar + Datum<R>> Mean<R> for M {
    fn size(&self) -> Option<usize> {
        None
    }

    fn at(&self, _: usize) -> R {
        self.lift()
    }
}

macro_rules! impl_vector_mean {
    ($([$($generics:tt)*] $Vector:ty;)*) => {$(
        impl<R, T: Datum<R> + Clone, $($generics)*> Mean<R> for $Vector {
            fn size(&self) -> Option<usize> {
                Some(self.len())
            }

            fn at(&self, i: usize) -> R {
                self[i].lift()
            }
        }
    )*};
}
impl_vector_mean! {
    [] Vec<T>;
    [] &Vec<T>;
    [] &[T];
    [const N: usize] [T; N];
    [const N: usize] &[T; N];
}

/// The values of a Gaussian process at given inputs: normal, with covariance
/// k(xᵢ, xⱼ) + σ² δᵢⱼ.
///
/// - Observed, `y ~ GaussianProcess::new(x, kernel).noise(sd)`: the marginal likelihood, with
///   everything that the process does not explain as noise. [`mean`](Self::mean) is what it
///   deviates from: the prediction of a model whose discrepancy the process describes.
/// - Unknown, `let f ~ GaussianProcess::new(x, kernel)`: one value an input, to be used in any
///   likelihood. The coordinates are non-centred: f = mean + L z with z standard normal and
///   L Lᵀ the covariance matrix.
/// - Elsewhere: [`predict`](Self::predict).
///
/// Inputs are data, numbers or arrays of coordinates. Amplitude, length scales, noise and mean
/// may be unknown; an evaluation is one Cholesky factorisation and one fused operation (unknown:
/// one for each value), exact in all derivatives. 10⁻¹⁰ of the variance of the process is added on the
/// diagonal. A covariance matrix that is not positive definite in spite of it makes NaN, which
/// rejects the point.
///
/// # Example
/// ```
/// use ppl::prelude::*;
///
/// ppl::model! {
///     /// A smooth function seen with noise, and where it is between the data.
///     fn smooth(x: &[f64], y: &[f64], between: &[f64]) {
///         let amplitude ~ HalfNormal(1.0);
///         let length ~ LogNormal(0.0, 0.5);
///         let sd ~ HalfNormal(0.2);
///         let process = GaussianProcess::new(x, Matern52(amplitude, length)).noise(sd);
///         y ~ process;
///         #[predict] let f ~ process.predict(y, between);
///     }
/// }
/// let model = smooth(&[0.0, 1.0, 2.0], &[0.1, 0.9, 0.2], &[0.5, 1.5]);
/// assert_eq!(model.layout()?.dim, 3);
///
/// ppl::model! {
///     /// Counts around an unknown log rate.
///     fn counts(x: &[f64], k: &[u64]) {
///         let amplitude ~ HalfNormal(2.0);
///         let length ~ Gamma(25.0, 4.0);
///         let f ~ GaussianProcess::new(x, SquaredExponential(amplitude, length));
///         for (f, k) in f.iter().zip(k) {
///             k ~ Poisson(f.exp());
///         }
///     }
/// }
/// assert_eq!(counts(&[0.0, 1.0, 2.0], &[3, 1, 4]).layout()?.dim, 5);
/// # Ok::<(), ppl::ModelError>(())
/// ```
///
/// # References
/// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, (2.30) and (5.9);
/// Kennedy & O'Hagan (2001), *Bayesian Calibration of Computer Models*,
/// doi:10.1111/1467-9868.00294.
#[derive(Clone, Copy, Debug)]
pub struct GaussianProcess<'a, P, K, M = f64, S = f64> {
    pub(super) inputs: &'a [P],
    pub(super) kernel: K,
    pub(super) mean: M,
    pub(super) noise: S,
}

impl<'a, P: Point, K> GaussianProcess<'a, P, K> {
    /// With mean 0 and no noise.
    pub fn new(inputs: &'a [P], kernel: K) -> Self {
        Self { inputs, kernel, mean: 0.0, noise: 0.0 }
    }
}

impl<'a, P: Point, K, M, S> GaussianProcess<'a, P, K, M, S> {
    /// With another mean: a number, or a vector with one for each input.
    pub fn mean<N>(self, mean: N) -> GaussianProcess<'a, P, K, N, S> {
        let Self { inputs, kernel, noise, .. } = self;
        GaussianProcess { inputs, kernel, mean, noise }
    }

    /// With independent normal noise of this standard deviation on every value.
    pub fn noise<N>(self, sd: N) -> GaussianProcess<'a, P, K, M, N> {
        let Self { inputs, kernel, mean, .. } = self;
        GaussianProcess { inputs, kernel, mean, noise: sd }
    }

    pub(super) fn covariance<R: Scalar>(&self) -> Covariance<'_, P, K, R>
    where
        S: Datum<R>,
    {
        let noisy = self.inputs.len();
        Covariance {
            inputs: [self.inputs, &[]],
            kernel: &self.kernel,
            noise: self.noise.lift(),
            noisy,
        }
    }
}

/// Demands a mean for every input.
pub(super) fn require_mean<R: Scalar>(
    mean: &impl Mean<R>,
    inputs: usize,
) -> Result<(), DomainError> {
    const NAME: &str = "GaussianProcess";
    let size = mean.size().unwrap_or(inputs);
    let requirement = format_args!("that of the inputs, {inputs}");
    DomainError::require(size == inputs, NAME, "length of the mean", requirement, size as f64)?;
    (0..inputs).try_for_each(|i| {
        DomainError::require_finite(NAME, format_args!("mean[{i}]"), mean.at(i).value())
    })
}

/// Whether `mean` can be asked for `inputs` values.
pub(super) fn fits<R>(mean: &impl Mean<R>, inputs: usize) -> bool {
    mean.size().is_none_or(|size| size == inputs)
}

impl<P: Point + Clone, K: Clone, M: Clone, S: Clone> Family for GaussianProcess<'_, P, K, M, S> {}

impl<R, P, K, M, S> Distribution<R> for GaussianProcess<'_, P, K, M, S>
where
    R: Scalar,
    P: Point + Clone,
    K: Kernel<R>,
    M: Mean<R>,
    S: Datum<R> + Clone,
{
    type Value = Vec<R>;

    fn ln_density(&self, x: &Vec<R>) -> R {
        if x.len() != self.inputs.len() || !fits(&self.mean, x.len()) {
            return R::from(f64::NEG_INFINITY);
        }
        self.covariance().ln_density(|i| x[i], |i| self.mean.at(i))
    }

    fn validate(&self) -> Result<(), DomainError> {
        let coordinates = self.inputs.first().map_or(1, |point| point.coordinates().len());
        self.kernel.validate(coordinates)?;
        require_mean(&self.mean, self.inputs.len())?;
        let sd = self.noise.lift().value();
        let holds = sd >= 0.0 && sd.is_finite();
        DomainError::require(holds, "GaussianProcess", "noise", "nonnegative and finite", sd)
    }

    fn draw<G: Rng + ?Sized>(&self, rng: &mut G) -> Vec<R> {
        let n = self.inputs.len();
        let z: Vec<f64> = (0..n).map(|_| rng.sample(StandardNormal)).collect();
        let Some(root) = self.covariance::<R>().root(&[], false) else {
            return vec![R::from(f64::NAN); n];
        };
        let a = self.kernel.amplitude().value();
        (0..n).map(|i| R::from(self.mean.at(i).value() + a * root.times(i, &z))).collect()
    }
}

impl<R, P, K, M, S> Unknown<R> for GaussianProcess<'_, P, K, M, S>
where
    R: Scalar,
    P: Point + Clone,
    K: Kernel<R>,
    M: Mean<R>,
    S: Datum<R> + Clone,
{
    fn dim(&self) -> usize {
        self.inputs.len()
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        jacobian: bool,
        terms: &mut impl Accumulator<R>,
    ) -> Vec<R> {
        let n = self.inputs.len();
        let coordinates: Vec<R> = (0..n).map(|_| next()).collect();
        let z: Vec<f64> = coordinates.iter().map(|z| z.value()).collect();
        let (amplitude, noise): (R, R) = (self.kernel.amplitude(), self.noise.lift());
        let (a, sd) = (amplitude.value(), noise.value());
        let lengths = (0..self.kernel.lengths()).map(|k| (k, self.kernel.length(k)));
        let varying: Vec<(usize, R)> = lengths.filter(|(_, l)| !l.is_constant()).collect();
        let along: Vec<usize> = varying.iter().map(|&(k, _)| k).collect();
        let in_noise = sd != 0.0 && !(amplitude.is_constant() && noise.is_constant());
        let root =
            if fits(&self.mean, n) { self.covariance::<R>().root(&along, in_noise) } else { None };
        let Some(root) = root else {
            terms.add_number(R::from(f64::NAN));
            return vec![R::from(f64::NAN); n];
        };
        // what a derivative along q = (σ/a)² is along a and σ
        let (q_in_a, q_in_sd) = (-2.0 * sd * sd / a.powi(3), 2.0 * sd / (a * a));
        let scales = |own: f64, along_q: f64| {
            [(amplitude, own + along_q * q_in_a), (noise, along_q * q_in_sd)]
        };
        let value = |i: usize| {
            let unit = root.times(i, &z);
            let mean = self.mean.at(i);
            let along_q = if in_noise { a * root.moved(along.len(), i, &z) } else { 0.0 };
            let in_z = coordinates.iter().zip(root.row(i)).map(|(&z, l)| (z, a * l));
            let in_lengths =
                varying.iter().enumerate().map(|(d, &(_, l))| (l, a * root.moved(d, i, &z)));
            let others = scales(unit, along_q).into_iter().chain([(mean, 1.0)]);
            R::fuse_iter(mean.value() + a * unit, in_z.chain(in_lengths).chain(others))
        };
        let values: Vec<R> = (0..n).map(value).collect();

        let square: f64 = z.iter().map(|z| z * z).sum();
        let over_z = -0.5 * square - n as f64 * HALF_LN_2PI;
        let in_z = coordinates.iter().zip(&z).map(|(&c, z)| (c, -z));
        if jacobian {
            terms.add_number(R::fuse_iter(over_z, in_z));
            return values;
        }
        let volume = n as f64 * a.ln() + root.ln_determinant();
        let along_q = if in_noise { -root.ln_determinant_moved(along.len()) } else { 0.0 };
        let in_lengths =
            varying.iter().enumerate().map(|(d, &(_, l))| (l, -root.ln_determinant_moved(d)));
        let in_scales = scales(-(n as f64) / a, along_q);
        terms.add_number(R::fuse_iter(over_z - volume, in_z.chain(in_lengths).chain(in_scales)));
        values
    }

    fn unconstrain(&self, x: &Vec<R>, out: &mut Vec<f64>) {
        let a = self.kernel.amplitude().value();
        match self.covariance::<R>().root(&[], false) {
            Some(root) => {
                let deviation = |(i, x): (usize, &R)| (x.value() - self.mean.at(i).value()) / a;
                out.extend(root.solve(x.iter().enumerate().map(deviation)));
            }
            None => out.extend(x.iter().map(|_| f64::NAN)),
        }
    }
}
