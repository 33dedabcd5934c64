//! Scalar types with derivatives.

mod plain;

use std::f64::consts::{LN_2, LN_10, SQRT_2};
use std::fmt::Debug;
use std::iter::Sum;
use std::ops::{AddAssign, DivAssign, MulAssign, Neg, SubAssign};

pub use crate::number::arithmetic::Arithmetic;
pub(crate) use crate::number::arithmetic::impl_arithmetic;
use crate::number::partials::{Each, Partials, Zipped};
use crate::quantity::datum::{Datum, Recordable};
use crate::special;
use plain::{error_density, logit};
pub(crate) use special::{logistic, softplus};

/// Implements functions of a [`Scalar`] x, each given by its value v and its derivative with respect to x.
macro_rules! functions {
    ($($(#[$doc:meta])* $name:ident($x:ident): $v:ident = $value:expr => $slope:expr;)*) => {$(
        $(#[$doc])*
        #[inline]
        fn $name(self) -> Self {
            let $x = self.value();
            let $v = $value;
            self.unary($v, $slope)
        }
    )*};
}

/// Scalar type of the computations in a model: `f64` (values only), [`Var`](crate::number::tape::Var) (reverse mode) or
/// [`Dual`](crate::Dual) (forward mode).
///
/// All functions are based on [`fuse`](Scalar::fuse): a function with known value and partial derivatives is *one*
/// operation, regardless of its internal computations.
///
/// # Example
/// ```
/// use ppl::{Dual, Scalar};
///
/// fn rosenbrock<S: Scalar>(x: S, y: S) -> S {
///     (y - x * x).square() * 100.0 + (x - 1.0).square()
/// }
/// let [x, y] = Dual::variables([0.5, 2.0]);
/// assert_eq!(rosenbrock(0.5, 2.0), 306.5);
/// assert_eq!(rosenbrock(x, y).gradient(), [-351.0, 350.0]);
/// ```
#[diagnostic::on_unimplemented(
    message = "`{Self}` is not a number of a model",
    label = "expected an `f64` or an unknown",
    note = "write `1.0`, not `1`, and convert counts by `n as f64`"
)]
pub trait Scalar:
    Copy
    + Debug
    + From<f64>
    + Arithmetic
    + Arithmetic<f64>
    + for<'a> Arithmetic<&'a f64>
    + Neg<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + DivAssign
    + AddAssign<f64>
    + SubAssign<f64>
    + MulAssign<f64>
    + DivAssign<f64>
    + Sum
    + PartialEq
    + PartialOrd
    + PartialEq<f64>
    + PartialOrd<f64>
    + Datum<Self>
    + Recordable
{
    /// Whether scalars of this type have derivatives. If false, expensive partial derivatives are not computed.
    const DIFFERENTIABLE: bool;

    /// Value without derivatives.
    fn value(self) -> f64;

    /// Whether the scalar has no derivatives, as is true of data and literals.
    fn is_constant(self) -> bool;

    /// Creates the result of a function from its value and its partial derivatives with respect to its arguments.
    fn gather(value: f64, partials: impl Partials<Self>) -> Self;

    /// Whether all derivatives stored with the scalar are finite.
    #[doc(hidden)]
    #[inline(always)]
    fn has_finite_slopes(self) -> bool {
        true
    }

    /// Adds a separately summed adjoint to the adjoint of this scalar.
    #[doc(hidden)]
    #[inline(always)]
    fn deposit(self, adjoint: f64) {
        let _ = adjoint;
    }

    /// Version of [`unary`](Scalar::unary) for a scalar that the caller does not use afterwards. The result can reuse
    /// the node of the scalar on the tape.
    #[doc(hidden)]
    #[inline(always)]
    fn replaced(self, value: f64, derivative: f64) -> Self {
        self.unary(value, derivative)
    }

    /// Version of [`gather`](Scalar::gather) for any number of arguments.
    ///
    /// # Panics
    /// If the iterator itself performs operations on scalars of a tape: compute the arguments first.
    #[inline(always)]
    fn fuse_iter(value: f64, arguments: impl IntoIterator<Item = (Self, f64)>) -> Self {
        Self::gather(value, Each(arguments))
    }

    /// Version of [`gather`](Scalar::gather) for a fixed number of arguments.
    #[inline(always)]
    fn fuse<const K: usize>(value: f64, arguments: [Self; K], partials: [f64; K]) -> Self {
        Self::gather(value, Zipped(arguments, partials))
    }

    /// Version of [`fuse`](Scalar::fuse) for several functions of the same arguments.
    #[doc(hidden)]
    #[inline(always)]
    fn fuse_all<const D: usize, const M: usize>(
        values: [f64; M],
        arguments: [Self; D],
        jacobian: [[f64; D]; M],
    ) -> [Self; M] {
        each(values, arguments, jacobian)
    }

    /// Creates the result of a function whose only argument is this scalar, from its value and its derivative.
    #[inline(always)]
    fn unary(self, value: f64, derivative: f64) -> Self {
        Self::gather(value, ((self, derivative),))
    }

    functions! {
        /// eˣ.
        exp(x): v = x.exp() => v;
        /// eˣ − 1, accurate near 0.
        exp_m1(x): v = x.exp_m1() => v + 1.0;
        /// Natural logarithm.
        ln(x): v = x.ln() => x.recip();
        /// ln(1 + x), accurate near 0.
        ln_1p(x): v = x.ln_1p() => (1.0 + x).recip();
        /// Logarithm to base 10.
        log10(x): v = x.log10() => (x * LN_10).recip();
        /// Logarithm to base 2.
        log2(x): v = x.log2() => (x * LN_2).recip();
        /// Square root.
        sqrt(x): v = x.sqrt() => 0.5 / v;
        /// ∛x.
        cbrt(x): v = x.cbrt() => (3.0 * v * v).recip();
        /// x².
        square(x): v = x * x => 2.0 * x;
        /// 1/x.
        recip(x): v = x.recip() => -v * v;
        /// |x|, with derivative 0 at 0.
        abs(x): v = x.abs() => if x == 0.0 { 0.0 } else { x.signum() };
        /// sin x.
        sin(x): v = x.sin() => x.cos();
        /// cos x.
        cos(x): v = x.cos() => -x.sin();
        /// tan x.
        tan(x): v = x.tan() => 1.0 + v * v;
        /// arcsin x.
        asin(x): v = x.asin() => (1.0 - x * x).sqrt().recip();
        /// arccos x.
        acos(x): v = x.acos() => -(1.0 - x * x).sqrt().recip();
        /// arctan x.
        atan(x): v = x.atan() => (1.0 + x * x).recip();
        /// sinh x.
        sinh(x): v = x.sinh() => x.cosh();
        /// cosh x.
        cosh(x): v = x.cosh() => x.sinh();
        /// tanh x.
        tanh(x): v = x.tanh() => x.cosh().powi(-2);
        /// arsinh x.
        asinh(x): v = x.asinh() => x.hypot(1.0).recip();
        /// arcosh x.
        acosh(x): v = x.acosh() => ((x - 1.0) * (x + 1.0)).sqrt().recip();
        /// artanh x.
        atanh(x): v = x.atanh() => ((1.0 - x) * (1.0 + x)).recip();
    }

    functions! {
        /// ln(x/(1 − x)), the inverse of [`logistic`](Scalar::logistic), for 0 < x < 1.
        logit(x): v = logit(x) => (x * (1.0 - x)).recip();
        /// ln(1 + eˣ) without overflow or cancellation.
        softplus(x): v = softplus(x) => logistic(x).0;
        /// ln(1 − e⁻ˣ) for x > 0.
        ln_one_minus_exp(x): v = special::ln_one_minus_exp(x) => x.exp_m1().recip();
        /// The error function.
        erf(x): v = 2.0 * special::normal_from_zero(SQRT_2 * x) => error_density(x);
        /// 1 − erf x, accurate for large x.
        erfc(x): v = 2.0 * special::normal_cdf(-SQRT_2 * x) => -error_density(x);
        /// Φ(x), the standard normal distribution function.
        normal_cdf(x): v = special::normal_cdf(x) => (-0.5 * x * x - special::HALF_LN_2PI).exp();
        /// Φ⁻¹(p), the quantile of the standard normal distribution, for 0 < p < 1.
        normal_quantile(p): v = special::normal_quantile(p) =>
            (0.5 * v * v + special::HALF_LN_2PI).exp();
        /// ln Γ(x) for x > 0.
        ln_gamma(x): v = special::ln_gamma(x) => special::digamma(x);
    }

    /// Logistic function 1/(1 + e⁻ˣ).
    #[inline]
    fn logistic(self) -> Self {
        let (p, q) = logistic(self.value());
        self.unary(p, p * q)
    }

    /// ln Φ(x), accurate in both tails.
    #[inline]
    fn ln_normal_cdf(self) -> Self {
        let (value, derivative) = special::ln_normal_cdf(self.value());
        self.unary(value, derivative)
    }

    /// xⁿ for an integer n.
    #[inline]
    fn powi(self, n: i32) -> Self {
        let x = self.value();
        let derivative = if n == 0 { 0.0 } else { f64::from(n) * x.powi(n - 1) };
        self.unary(x.powi(n), derivative)
    }

    /// xᵖ for a constant p.
    #[inline]
    fn powf(self, p: f64) -> Self {
        let x = self.value();
        let derivative = if p == 0.0 { 0.0 } else { p * x.powf(p - 1.0) };
        self.unary(x.powf(p), derivative)
    }

    /// xᵖ with derivatives with respect to x and p, for x ≥ 0. At x = 0 and p > 0, p ≠ 1, the derivative with respect
    /// to x is set to 0 even if it is infinite, so that a growth curve can start at x = 0.
    #[inline]
    fn pow(self, p: Self) -> Self {
        let (x, e) = (self.value(), p.value());
        let v = x.powf(e);
        let slopes = match (x, e) {
            (0.0, 1.0) => (1.0, 0.0),
            (0.0, _) if e > 0.0 => (0.0, 0.0),
            _ => (e * x.powf(e - 1.0), v * x.ln()),
        };
        Self::gather(v, ((self, slopes.0), (p, slopes.1)))
    }

    /// Angle of the point (`x`, self), see `f64::atan2`.
    #[inline]
    fn atan2(self, x: impl Into<Self>) -> Self {
        let x = x.into();
        let (ordinate, abscissa) = (self.value(), x.value());
        let square = ordinate * ordinate + abscissa * abscissa;
        let partials = ((self, abscissa / square), (x, -ordinate / square));
        Self::gather(ordinate.atan2(abscissa), partials)
    }

    /// √(x² + y²); the derivatives at 0 are set to 0.
    #[inline]
    fn hypot(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        let (x, y) = (self.value(), other.value());
        let length = x.hypot(y);
        let per_length = if length == 0.0 { 0.0 } else { length.recip() };
        Self::gather(length, ((self, x * per_length), (other, y * per_length)))
    }

    /// Limits the scalar to the interval between `lower` and `upper`.
    #[inline]
    fn clamp(self, lower: impl Into<Self>, upper: impl Into<Self>) -> Self {
        Scalar::min(Scalar::max(self, lower), upper)
    }

    /// Larger of two scalars; `self` if they are equal, and NaN if one of them is NaN. For arguments of type `f64`,
    /// the inherent method `f64::max` has precedence, which ignores NaN.
    #[inline]
    fn max(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if self >= other || self.value().is_nan() { self } else { other }
    }

    /// Smaller of two scalars; `self` if they are equal, and NaN if one of them is NaN, see [`max`](Scalar::max).
    #[inline]
    fn min(self, other: impl Into<Self>) -> Self {
        let other = other.into();
        if self <= other || self.value().is_nan() { self } else { other }
    }
}

impl Scalar for f64 {
    const DIFFERENTIABLE: bool = false;

    #[inline]
    fn value(self) -> f64 {
        self
    }

    #[inline]
    fn is_constant(self) -> bool {
        true
    }

    #[inline]
    fn gather(value: f64, _: impl Partials<Self>) -> Self {
        value
    }
}

/// Creates scalars with the given values and partial derivatives, one by one.
#[inline(always)]
pub(crate) fn each<S: Scalar, const D: usize, const M: usize>(
    values: [f64; M],
    arguments: [S; D],
    jacobian: [[f64; D]; M],
) -> [S; M] {
    let mut results = [S::from(0.0); M];
    for m in 0..M {
        results[m] = S::fuse(values[m], arguments, jacobian[m]);
    }
    results
}

#[diagnostic::do_not_recommend]
impl<S: Scalar> Datum<S> for f64 {
    const CONSTANT: bool = true;
    const NUMBERS: usize = 0;

    #[inline(always)]
    fn spread(&self, _: f64, _: &mut impl FnMut(S, f64)) {}

    #[inline(always)]
    fn lift(&self) -> S {
        S::from(*self)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/scalar.rs"]
mod tests;
