//! Covariance functions.

use crate::datum::Datum;
use crate::density::DomainError;
use crate::scalar::Scalar;

/// An input of a Gaussian process: a number, or an array of coordinates.
pub trait Point: Sync {
    /// Its coordinates.
    fn coordinates(&self) -> &[f64];
}

impl Point for f64 {
    fn coordinates(&self) -> &[f64] {
        std::slice::from_ref(self)
    }
}

impl<const D: usize> Point for [f64; D] {
    fn coordinates(&self) -> &[f64] {
        self
    }
}

/// Length scales of a kernel: one number for all coordinates, or an array with one for each.
pub trait Lengths<R>: Clone {
    /// 1, or the number of coordinates.
    fn size(&self) -> usize;

    /// Length scale `k`.
    fn at(&self, k: usize) -> R;
}

impl<R, L: Scalar + Datum<R>> Lengths<R> for L {
    fn size(&self) -> usize {
        1
    }

    fn at(&self, _: usize) -> R {
        self.lift()
    }
}

impl<R, L: Datum<R> + Clone, const D: usize> Lengths<R> for [L; D] {
    fn size(&self) -> usize {
        D
    }

    fn at(&self, k: usize) -> R {
        self[k].lift()
    }
}

/// A stationary covariance function k(x, x') = a² φ(s) with s = Σ ((x_d − x'_d)/ℓ_d)².
///
/// Own kernels implement it; φ(0) = 1, and φ must be positive definite.
pub trait Kernel<R: Scalar>: Clone {
    /// The standard deviation a of the process.
    fn amplitude(&self) -> R;

    /// Number of length scales: 1, shared by all coordinates, or one for each.
    fn lengths(&self) -> usize;

    /// Length scale `k`.
    fn length(&self, k: usize) -> R;

    /// φ(s) and dφ/ds.
    fn profile(&self, square: f64) -> (f64, f64);

    /// Whether amplitude and length scales are positive, and as many as `coordinates` need.
    ///
    /// # Errors
    /// [`DomainError`] naming parameter, requirement and value.
    fn validate(&self, coordinates: usize) -> Result<(), DomainError> {
        const NAME: &str = "GaussianProcess";
        DomainError::require_positive(NAME, "amplitude", self.amplitude().value())?;
        let n = self.lengths();
        let requirement = format_args!("1 or that of the coordinates, {coordinates}");
        let holds = n == 1 || n == coordinates;
        DomainError::require(holds, NAME, "number of length scales", requirement, n as f64)?;
        (0..n).try_for_each(|k| {
            DomainError::require_positive(NAME, "length scale", self.length(k).value())
        })
    }
}

macro_rules! kernel {
    ($(#[$doc:meta])* $Name:ident, |$s:ident| $profile:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $Name<A, L>(pub A, pub L);

        impl<R, A, L> Kernel<R> for $Name<A, L>
        where
            R: Scalar,
            A: Datum<R> + Clone,
            L: Lengths<R>,
        {
            fn amplitude(&self) -> R {
                self.0.lift()
            }

            fn lengths(&self) -> usize {
                self.1.size()
            }

            fn length(&self, k: usize) -> R {
                self.1.at(k)
            }

            #[inline]
            fn profile(&self, $s: f64) -> (f64, f64) {
                $profile
            }
        }
    };
}

kernel!(
    /// The squared exponential kernel a² exp(−s/2), of infinitely smooth functions:
    /// `SquaredExponential(amplitude, length)` or `(amplitude, [length, …])`.
    ///
    /// # References
    /// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, (4.9).
    SquaredExponential,
    |s| {
        let value = (-0.5 * s).exp();
        (value, -0.5 * value)
    }
);

kernel!(
    /// The Matérn kernel 3/2, a² (1 + √(3s)) exp(−√(3s)), of functions with one derivative:
    /// `Matern32(amplitude, length)` or `(amplitude, [length, …])`.
    ///
    /// # References
    /// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, (4.17).
    Matern32,
    |s| {
        let r = (3.0 * s).sqrt();
        let decay = (-r).exp();
        ((1.0 + r) * decay, -1.5 * decay)
    }
);

kernel!(
    /// The Matérn kernel 5/2, a² (1 + √(5s) + 5s/3) exp(−√(5s)), of functions with two
    /// derivatives: `Matern52(amplitude, length)` or `(amplitude, [length, …])`.
    ///
    /// # References
    /// Rasmussen & Williams (2006), *Gaussian Processes for Machine Learning*, (4.17).
    Matern52,
    |s| {
        let r = (5.0 * s).sqrt();
        let decay = (-r).exp();
        ((1.0 + r + 5.0 / 3.0 * s) * decay, -5.0 / 6.0 * (1.0 + r) * decay)
    }
);
