//! Numbers with first and second derivatives.

use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::scalar::{Number, Scalar};

// loops instead of closures: the compiler does not inline SIMD instructions into closures

/// Value with `D` first derivatives, and `H` = D (D + 1)/2 second derivatives or no second derivatives (`H` = 0).
///
/// The second derivative with respect to variables i and j ≤ i has the index i (i + 1)/2 + j.
#[derive(Clone, Copy, Debug)]
pub struct Jet<T, const D: usize, const H: usize> {
    pub value: T,
    pub first: [T; D],
    pub second: [T; H],
}

impl<T: Scalar, const D: usize, const H: usize> Jet<T, D, H> {
    /// Creates a constant.
    #[inline(always)]
    pub fn fixed(value: T) -> Self {
        let zero = value.constant(0.0);
        Self { value, first: [zero; D], second: [zero; H] }
    }

    /// Creates a linear function of the variables with the given value and first derivatives.
    #[inline(always)]
    pub fn linear(value: T, first: [f64; D]) -> Self {
        let mut out = Self::fixed(value);
        for i in 0..D {
            out.first[i] = value.constant(first[i]);
        }
        out
    }

    /// Creates the independent variable with index `k` and the given value.
    #[inline(always)]
    pub fn variable(value: T, k: usize) -> Self {
        let mut first = [0.0; D];
        first[k] = 1.0;
        Self::linear(value, first)
    }

    /// Returns a function of this number by the chain rule, from the value, `slope` and `curvature` of the function.
    #[inline(always)]
    pub fn chain(self, value: T, slope: T, curvature: T) -> Self {
        let mut out = Self { value, ..self };
        for i in 0..D {
            out.first[i] = slope * self.first[i];
        }
        if H > 0 {
            for i in 0..D {
                let bend = curvature * self.first[i];
                for j in 0..=i {
                    let k = i * (i + 1) / 2 + j;
                    out.second[k] = bend.mul_add(self.first[j], slope * self.second[k]);
                }
            }
        }
        out
    }

    /// Multiplies value and derivatives by a factor that does not depend on the variables.
    #[inline(always)]
    fn scaled(mut self, factor: T) -> Self {
        self.value = self.value * factor;
        for i in 0..D {
            self.first[i] = self.first[i] * factor;
        }
        for k in 0..H {
            self.second[k] = self.second[k] * factor;
        }
        self
    }
}

impl<T: Scalar, const D: usize, const H: usize> Add for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn add(mut self, other: Self) -> Self {
        self.value += other.value;
        for i in 0..D {
            self.first[i] += other.first[i];
        }
        for k in 0..H {
            self.second[k] += other.second[k];
        }
        self
    }
}

impl<T: Scalar, const D: usize, const H: usize> Sub for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn sub(mut self, other: Self) -> Self {
        self.value = self.value - other.value;
        for i in 0..D {
            self.first[i] = self.first[i] - other.first[i];
        }
        for k in 0..H {
            self.second[k] = self.second[k] - other.second[k];
        }
        self
    }
}

impl<T: Scalar, const D: usize, const H: usize> Mul for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        let (a, b) = (self.value, other.value);
        let mut out = self;
        out.value = a * b;
        for i in 0..D {
            out.first[i] = a.mul_add(other.first[i], self.first[i] * b);
        }
        if H > 0 {
            for i in 0..D {
                for j in 0..=i {
                    let k = i * (i + 1) / 2 + j;
                    let ends = a.mul_add(other.second[k], self.second[k] * b);
                    let mixed = self.first[j].mul_add(other.first[i], ends);
                    out.second[k] = self.first[i].mul_add(other.first[j], mixed);
                }
            }
        }
        out
    }
}

impl<T: Scalar, const D: usize, const H: usize> Div for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn div(self, other: Self) -> Self {
        let one = other.value.constant(1.0);
        let inverse = one / other.value;
        let square = inverse * inverse;
        let mut out = self * other.chain(inverse, -square, (square + square) * inverse);
        out.value = self.value / other.value;
        out
    }
}

impl<T: Scalar, const D: usize, const H: usize> Neg for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn neg(mut self) -> Self {
        self.value = -self.value;
        for i in 0..D {
            self.first[i] = -self.first[i];
        }
        for k in 0..H {
            self.second[k] = -self.second[k];
        }
        self
    }
}

impl<T: Scalar, const D: usize, const H: usize> AddAssign for Jet<T, D, H> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<T: Scalar, const D: usize, const H: usize> Add<f64> for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn add(self, x: f64) -> Self {
        Self { value: self.value + x, ..self }
    }
}

impl<T: Scalar, const D: usize, const H: usize> Sub<f64> for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn sub(self, x: f64) -> Self {
        Self { value: self.value - x, ..self }
    }
}

impl<T: Scalar, const D: usize, const H: usize> Mul<f64> for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn mul(self, x: f64) -> Self {
        self.scaled(self.value.constant(x))
    }
}

impl<T: Scalar, const D: usize, const H: usize> Div<f64> for Jet<T, D, H> {
    type Output = Self;

    #[inline(always)]
    fn div(self, x: f64) -> Self {
        self.scaled(self.value.constant(1.0 / x))
    }
}

impl<T: Scalar, const D: usize, const H: usize> Number for Jet<T, D, H> {
    #[inline(always)]
    fn constant(self, x: f64) -> Self {
        Self::fixed(self.value.constant(x))
    }

    #[inline(always)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        self * b + c
    }
}

/// Comparisons compare the values. At a kink, the number has the derivatives of the selected side.
impl<T: Scalar, const D: usize, const H: usize> Scalar for Jet<T, D, H> {
    type Mask = T::Mask;

    #[inline(always)]
    fn sqrt(self) -> Self {
        let root = self.value.sqrt();
        let slope = self.value.constant(0.5) / root;
        self.chain(root, slope, slope * -0.5 / self.value)
    }

    #[inline(always)]
    fn abs(self) -> Self {
        let negative = self.value.less_than(self.value.constant(0.0));
        Self::select(negative, -self, self)
    }

    #[inline(always)]
    fn max(self, other: Self) -> Self {
        Self::select(self.less_than(other), other, self)
    }

    #[inline(always)]
    fn min(self, other: Self) -> Self {
        Self::select(other.less_than(self), other, self)
    }

    #[inline(always)]
    fn ln(self) -> Self {
        let slope = self.value.constant(1.0) / self.value;
        self.chain(self.value.ln(), slope, -(slope * slope))
    }

    #[inline(always)]
    fn ln_1p(self) -> Self {
        let slope = self.value.constant(1.0) / (self.value + 1.0);
        self.chain(self.value.ln_1p(), slope, -(slope * slope))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let value = self.value.exp();
        self.chain(value, value, value)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        let value = self.value.exp_m1();
        self.chain(value, value + 1.0, value + 1.0)
    }

    #[inline(always)]
    fn less_than(self, other: Self) -> T::Mask {
        self.value.less_than(other.value)
    }

    #[inline(always)]
    fn equals(self, other: Self) -> T::Mask {
        self.value.equals(other.value)
    }

    #[inline(always)]
    fn select(mask: T::Mask, yes: Self, mut no: Self) -> Self {
        no.value = T::select(mask, yes.value, no.value);
        for i in 0..D {
            no.first[i] = T::select(mask, yes.first[i], no.first[i]);
        }
        for k in 0..H {
            no.second[k] = T::select(mask, yes.second[k], no.second[k]);
        }
        no
    }

    #[inline(always)]
    fn settled(_: T::Mask) -> bool {
        false
    }
}
