//! Number types for the equations.
//!
//! The equations of points and elements are generic over the trait [`Scalar`]. This trait is implemented for
//! floating-point numbers and the dual numbers of [`num_dual`], for [`SimdF64`](super::SimdF64), which contains one
//! number for each of several elements, for [`Term`](super::Term), which records operations for a device, and for
//! [`Jet`](super::Jet), which contains derivatives. The equations do not branch on values. They compare and select
//! instead, so that all lanes execute the same operations, and so that a number type can record operations instead of
//! executing them.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use num_dual::DualNum;

/// Number, or one number for each of several points, that supports sums and products.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + AddAssign
{
    /// Returns a number with the value `x` at all points.
    fn constant(self, x: f64) -> Self;

    /// Returns self · b + c.
    fn mul_add(self, b: Self, c: Self) -> Self;
}

/// Function of one round of a recorded loop. It updates the state, and returns whether the state had converged before
/// the update.
pub type Round<T> = fn(&mut [T]) -> <T as Scalar>::Mask;

/// Computation that a number type compiles with its own processor instructions.
#[doc(hidden)]
pub trait Computation {
    type Output;

    fn run(self) -> Self::Output;
}

/// Runs a computation as a separate function, so that the code of the computation is not repeated
/// in each caller.
#[inline(never)]
fn run_apart<W: Computation>(work: W) -> W::Output {
    work.run()
}

/// Number type of laws, splits and degradation functions.
///
/// The solver evaluates a law with single numbers, with one number for each of several points (SIMD lanes), with
/// numbers that have derivatives, and with terms that are recorded as source code for a device. A law is therefore
/// written for any `T: Scalar`: constants are `f64` (`x * 2.0`, `x + 1.0`), and a decision that depends on a value
/// is made by [`less_than`](Self::less_than) and [`select`](Self::select) instead of `if`.
///
/// Functions that are generic over `T` need the attribute `#[inline(always)]`: the compiler then uses the vector
/// instructions of their caller. Without the attribute, the results are the same, but the function is several times
/// slower.
///
/// # Example
/// ```
/// use fem::Scalar;
///
/// /// ⟨x⟩₊², zero for negative x.
/// #[inline(always)]
/// fn positive_square<T: Scalar>(x: T) -> T {
///     let positive = x.max(x.constant(0.0));
///     positive * positive
/// }
/// assert_eq!(positive_square(-1.0) + positive_square(3.0), 9.0);
/// ```
pub trait Scalar:
    Number
    + Div<Output = Self>
    + Add<f64, Output = Self>
    + Sub<f64, Output = Self>
    + Mul<f64, Output = Self>
    + Div<f64, Output = Self>
    + 'static
{
    /// Result of a comparison, per point.
    type Mask: Copy;

    /// Whether the type records operations instead of executing them.
    #[doc(hidden)]
    const RECORDS: bool = false;

    /// Records a loop of at most `_most` rounds over `_state`. The loop ends when `_round` returns that the state
    /// before the round had converged. For recording types only.
    #[doc(hidden)]
    fn record_loop(_name: &'static str, _most: usize, _state: &mut [Self], _round: Round<Self>) {}

    /// Runs a computation that is compiled with the instructions of this type.
    #[doc(hidden)]
    #[inline(always)]
    fn vectorize<W: Computation>(self, work: W) -> W::Output {
        run_apart(work)
    }

    /// Returns the square root.
    fn sqrt(self) -> Self;

    /// Returns the absolute value.
    fn abs(self) -> Self;

    /// Returns the larger of two numbers.
    fn max(self, other: Self) -> Self;

    /// Returns the smaller of two numbers.
    fn min(self, other: Self) -> Self;

    /// Returns the natural logarithm.
    fn ln(self) -> Self;

    /// Returns ln(1 + self), accurate near zero.
    fn ln_1p(self) -> Self;

    /// Returns e^self.
    fn exp(self) -> Self;

    /// Returns e^self − 1, accurate near zero.
    fn exp_m1(self) -> Self;

    /// Returns self^exponent for a positive number.
    #[inline(always)]
    fn powf(self, exponent: f64) -> Self {
        (self.ln() * exponent).exp()
    }

    /// Returns the mask of the points where this number is less than `other`.
    fn less_than(self, other: Self) -> Self::Mask;

    /// Returns the mask of the points where the numbers are equal.
    fn equals(self, other: Self) -> Self::Mask;

    /// Returns `yes` at the points where the mask is true, `no` at the other points.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Returns whether the mask is certainly true at all points, so that an iteration can stop or a branch can be
    /// skipped. Always false for numbers with derivatives, whose derivatives converge later than their values, and
    /// for recorded terms.
    #[doc(hidden)]
    fn settled(mask: Self::Mask) -> bool;

    /// Returns the polynomial Σ c_k self^k, with the coefficient c_k at index k.
    #[inline(always)]
    fn polynomial(self, coefficients: &[f64]) -> Self {
        let mut sum = self.constant(0.0);
        for &c in coefficients.iter().rev() {
            sum = sum.mul_add(self, self.constant(c));
        }
        sum
    }

    /// Returns artanh(self)/self for |self| < 0.18; 1 for zero.
    #[doc(hidden)]
    #[inline(always)]
    fn artanh_ratio(self) -> Self {
        (self * self).polynomial(&ARTANH)
    }
}

/// SIMD number: one value for each of [`COUNT`](Self::COUNT) elements.
pub trait Lanes: Scalar {
    /// Data needed to create a value, such as the SIMD instruction set.
    type Token: Copy;

    /// Number of lanes.
    const COUNT: usize;

    /// Returns the token from which this value was created. Further values can be created from it.
    fn token(self) -> Self::Token;

    /// Loads the first [`COUNT`](Self::COUNT) values into the lanes.
    fn load(token: Self::Token, values: &[f64; POINTS]) -> Self;

    /// Stores the lanes in the first [`COUNT`](Self::COUNT) entries of `values`.
    fn store(self, values: &mut [f64; POINTS]);
}

/// Largest number of lanes of a SIMD number.
pub const POINTS: usize = 8;

/// Coefficients of artanh(z)/z in powers of z². The truncation error is below 2⁻⁵³ for |z| < 0.18.
const ARTANH: [f64; 11] = [
    1.0,
    1.0 / 3.0,
    1.0 / 5.0,
    1.0 / 7.0,
    1.0 / 9.0,
    1.0 / 11.0,
    1.0 / 13.0,
    1.0 / 15.0,
    1.0 / 17.0,
    1.0 / 19.0,
    1.0 / 21.0,
];

/// Returns the scalar product a · b.
#[inline(always)]
pub fn dot<T: Number>(a: &[T; 3], b: &[T; 3]) -> T {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

impl<T: DualNum<f64> + Copy> Number for T {
    fn constant(self, x: f64) -> Self {
        T::from(x)
    }

    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
}

impl<T: DualNum<f64> + Copy> Scalar for T {
    type Mask = bool;

    fn sqrt(self) -> Self {
        DualNum::sqrt(&self)
    }

    fn abs(self) -> Self {
        if self.re() < 0.0 { -self } else { self }
    }

    fn max(self, other: Self) -> Self {
        if self.re() > other.re() { self } else { other }
    }

    fn min(self, other: Self) -> Self {
        if self.re() < other.re() { self } else { other }
    }

    fn ln(self) -> Self {
        DualNum::ln(&self)
    }

    fn ln_1p(self) -> Self {
        DualNum::ln_1p(&self)
    }

    fn exp(self) -> Self {
        DualNum::exp(&self)
    }

    fn exp_m1(self) -> Self {
        DualNum::exp_m1(&self)
    }

    fn less_than(self, other: Self) -> bool {
        self.re() < other.re()
    }

    fn equals(self, other: Self) -> bool {
        self.re() == other.re()
    }

    fn select(mask: bool, yes: Self, no: Self) -> Self {
        if mask { yes } else { no }
    }

    fn settled(mask: bool) -> bool {
        mask && T::NDERIV == 0
    }
}

impl Lanes for f64 {
    type Token = ();

    const COUNT: usize = 1;

    fn token(self) {}

    fn load((): (), values: &[f64; POINTS]) -> Self {
        values[0]
    }

    fn store(self, values: &mut [f64; POINTS]) {
        values[0] = self;
    }
}
