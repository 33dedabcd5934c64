//! What the equations need of a number.
//!
//! The point kernel and the element kernel are written over this trait. Single numbers and the dual
//! numbers of [`num_dual`] have it, and [`SimdF64`](super::simd::SimdF64), a number of each of
//! several elements. The kernels do not branch on values: they compare and select, so that every
//! lane does the same, and so that a scalar may write its operations down instead of doing them.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use num_dual::DualNum;

/// A number, or one of each of several points, of which sums and products are taken: all that the
/// product with a tangent needs.
pub trait Number:
    Copy + Add<Output = Self> + Sub<Output = Self> + Mul<Output = Self> + Neg<Output = Self> + AddAssign
{
    /// The same number at all points.
    fn constant(self, x: f64) -> Self;

    /// self · b + c.
    fn mul_add(self, b: Self, c: Self) -> Self;
}

/// A round of a loop: whether it was the end, and what the state is after another round.
pub type Round<T> = fn(&mut [T]) -> <T as Scalar>::Mask;

/// A number that the equations at a point can be written in.
pub trait Scalar: Number + Div<Output = Self> {
    /// Where a comparison holds.
    type Mask: Copy;

    /// Whether it writes operations down instead of doing them.
    const RECORDS: bool = false;

    /// Writes down a loop of at most so many rounds over `state`, which ends where what `round` returns holds
    /// before it changes the state; for numbers that record.
    fn record_loop(_name: &'static str, _most: usize, _state: &mut [Self], _round: Round<Self>) {}

    fn sqrt(self) -> Self;

    fn abs(self) -> Self;

    fn max(self, other: Self) -> Self;

    fn min(self, other: Self) -> Self;

    /// ln(1 + self), to the last digits also near zero.
    fn ln_1p(self) -> Self;

    /// e^self − 1, to the last digits also near zero.
    fn exp_m1(self) -> Self;

    fn less_than(self, other: Self) -> Self::Mask;

    fn equals(self, other: Self) -> Self::Mask;

    /// `yes` where the comparison holds, `no` elsewhere.
    fn select(mask: Self::Mask, yes: Self, no: Self) -> Self;

    /// Whether an iteration may stop where this holds at all points; never for numbers with
    /// derivatives, which settle after the values.
    fn settled(mask: Self::Mask) -> bool;

    /// Σ c_k self^k.
    #[inline(always)]
    fn polynomial(self, coefficients: &[f64]) -> Self {
        let mut sum = self.constant(0.0);
        for &c in coefficients.iter().rev() {
            sum = sum.mul_add(self, self.constant(c));
        }
        sum
    }

    /// artanh(self)/self for |self| < 0.18; one for zero.
    #[inline(always)]
    fn artanh_ratio(self) -> Self {
        (self * self).polynomial(&ARTANH)
    }
}

/// Numbers that stand side by side, one of each of [`COUNT`](Self::COUNT) elements.
pub trait Lanes: Scalar {
    /// What it takes to make one.
    type Token: Copy;

    /// How many there are.
    const COUNT: usize;

    fn token(self) -> Self::Token;

    fn load(token: Self::Token, values: &[f64; POINTS]) -> Self;

    fn store(self, values: &mut [f64; POINTS]);
}

/// The most numbers that stand side by side.
pub const POINTS: usize = 8;

/// artanh(z)/z in powers of z²: what is left out is below 2⁻⁵³ for |z| < 0.18.
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

    fn ln_1p(self) -> Self {
        DualNum::ln_1p(&self)
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
