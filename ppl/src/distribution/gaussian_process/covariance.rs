//! Covariance functions of Gaussian processes.

use std::fmt::Debug;

use crate::distribution::Sequence;
use crate::number::scalar::Scalar;
use crate::quantity::datum::Datum;
use crate::term::parameter::Parameter;

/// Covariance function of a [`GaussianProcess`](super::GaussianProcess):
///
/// k(x, x′) = a² ρ(u), u² = Σ_d (x_d − x′_d)²/ℓ_d²,
///
/// with amplitude a > 0, lengths ℓ_d > 0, and a correlation ρ with ρ(0) = 1 that gives positive definite matrices.
///
/// A user-defined covariance function implements this trait and [`CovarianceParameters`].
///
/// # Example
/// ```
/// use ppl::Covariance;
///
/// let covariance = ppl::Matern32(2.0, 0.5);
/// assert_eq!((covariance.amplitude(), covariance.lengths()), (2.0, vec![0.5]));
/// let (correlation, slope) = covariance.correlation(1.0);
/// let root: f64 = 3f64.sqrt();
/// assert!((correlation - (1.0 + root) * (-root).exp()).abs() < 1e-15);
/// assert!((slope - 3.0 * (-root).exp()).abs() < 1e-15);
/// ```
pub trait Covariance: Clone + Debug {
    /// Amplitude a.
    fn amplitude(&self) -> f64;

    /// Returns a single length that applies to all columns of the points, or one length per column.
    fn lengths(&self) -> Vec<f64>;

    /// Returns the correlation ρ(u) and −ρ′(u)/u at u² = `square`. At u = 0, −ρ′(u)/u must be
    /// finite.
    fn correlation(&self, square: f64) -> (f64, f64);
}

/// Parameters of a [`Covariance`] in a model: each parameter is a plain number or an unknown.
pub trait CovarianceParameters<R: Scalar>: Covariance {
    /// Returns the amplitude, followed by the lengths.
    fn parameters(&self) -> Vec<R>;
}

/// Lengths of a covariance function: a number or an unknown for all columns of the points, or [`PerColumn`].
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a length of a covariance function",
    label = "expected a number, an unknown, or `PerColumn(lengths)`"
)]
pub trait Lengths: Clone + Debug {
    /// Values of the lengths.
    fn values(&self) -> Vec<f64>;
}

/// Lengths in a model: each length is a plain number or an unknown.
pub trait LengthNumbers<R>: Lengths {
    /// Appends the lengths.
    fn append(&self, out: &mut Vec<R>);
}

impl<P: Parameter + Debug> Lengths for P {
    fn values(&self) -> Vec<f64> {
        vec![self.number()]
    }
}

impl<R, P: Parameter + Datum<R> + Debug> LengthNumbers<R> for P {
    fn append(&self, out: &mut Vec<R>) {
        out.push(self.lift());
    }
}

/// One length per column of the points: an array, a slice or a `Vec`.
#[derive(Clone, Copy, Debug)]
pub struct PerColumn<L>(pub L);

impl<L: Sequence<Item: Parameter> + Debug> Lengths for PerColumn<L> {
    fn values(&self) -> Vec<f64> {
        self.0.items().iter().map(|length| length.number()).collect()
    }
}

impl<R, L: Sequence<Item: Parameter + Datum<R>> + Debug> LengthNumbers<R> for PerColumn<L> {
    fn append(&self, out: &mut Vec<R>) {
        out.extend(self.0.items().iter().map(Datum::lift));
    }
}

/// Declares a covariance function with an amplitude and lengths. The expressions give ρ(u) and −ρ′(u)/u.
macro_rules! covariance {
    ($(#[$doc:meta])* $Name:ident($square:ident) => $correlation:expr) => {
        $(#[$doc])*
        #[derive(Clone, Copy, Debug)]
        pub struct $Name<A, L>(pub A, pub L);

        impl<A: Parameter + Debug, L: Lengths> Covariance for $Name<A, L> {
            fn amplitude(&self) -> f64 {
                self.0.number()
            }

            fn lengths(&self) -> Vec<f64> {
                self.1.values()
            }

            #[inline]
            fn correlation(&self, $square: f64) -> (f64, f64) {
                $correlation
            }
        }

        impl<R, A, L> CovarianceParameters<R> for $Name<A, L>
        where
            R: Scalar,
            A: Parameter + Datum<R> + Debug,
            L: LengthNumbers<R>,
        {
            fn parameters(&self) -> Vec<R> {
                let mut parameters = vec![self.0.lift()];
                self.1.append(&mut parameters);
                parameters
            }
        }
    };
}

covariance! {
    /// Squared exponential covariance a² exp(−u²/2), of processes that can be differentiated any number of times. The
    /// fields are the amplitude a and the lengths.
    SquaredExponential(square) => {
        let correlation = (-0.5 * square).exp();
        (correlation, correlation)
    }
}

covariance! {
    /// Matérn covariance a² (1 + √3 u) exp(−√3 u), of processes that can be differentiated once. The fields are the
    /// amplitude a and the lengths.
    Matern32(square) => {
        let distance = (3.0 * square).sqrt();
        let decay = (-distance).exp();
        ((1.0 + distance) * decay, 3.0 * decay)
    }
}

covariance! {
    /// Matérn covariance a² (1 + √5 u + 5u²/3) exp(−√5 u), of processes that can be differentiated twice. The fields
    /// are the amplitude a and the lengths.
    Matern52(square) => {
        let distance = (5.0 * square).sqrt();
        let decay = (-distance).exp();
        ((1.0 + distance + 5.0 / 3.0 * square) * decay, 5.0 / 3.0 * (1.0 + distance) * decay)
    }
}
