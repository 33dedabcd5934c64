//! A number at several points at once, in the widest registers that the processor has.
//!
//! Instructions wider than the baseline are inlined only into functions that are inlined
//! themselves: all here are, and what computes with these numbers uses loops and no closures.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use faer::traits::pulp::Simd;

/// Registers of a number: one computes while the other waits for a root or a quotient.
pub(crate) const REGISTERS: usize = 2;
/// The most points of a number.
pub(crate) const POINTS: usize = 8;

/// One number of each point; points beyond those of the registers are left out.
#[derive(Clone, Copy)]
pub(crate) struct Many<S: Simd> {
    simd: S,
    pub(crate) registers: [S::f64s; REGISTERS],
}

/// Where a comparison holds.
#[derive(Clone, Copy)]
pub(crate) struct Mask<S: Simd> {
    simd: S,
    registers: [S::m64s; REGISTERS],
}

impl<S: Simd> Mask<S> {
    /// `yes` where it holds, `no` elsewhere.
    #[inline(always)]
    pub(crate) fn select(self, yes: Many<S>, no: Many<S>) -> Many<S> {
        let mut out = no;
        for r in 0..REGISTERS {
            out.registers[r] =
                self.simd.select_f64s(self.registers[r], yes.registers[r], no.registers[r]);
        }
        out
    }

    /// Whether it holds at all points.
    #[inline(always)]
    pub(crate) fn all(self) -> bool {
        let zero = Many::splat(self.simd, 0.0);
        let holds = self.select(Many::splat(self.simd, 1.0), zero);
        let mut least = holds.registers[0];
        for r in 1..REGISTERS {
            least = self.simd.min_f64s(least, holds.registers[r]);
        }
        self.simd.reduce_min_f64s(least) > 0.5
    }
}

impl<S: Simd> Many<S> {
    /// How many points there are.
    pub(crate) const COUNT: usize =
        if REGISTERS * S::F64_LANES < POINTS { REGISTERS * S::F64_LANES } else { POINTS };

    #[inline(always)]
    pub(crate) fn splat(simd: S, x: f64) -> Self {
        Self { simd, registers: [simd.splat_f64s(x); REGISTERS] }
    }

    #[inline(always)]
    pub(crate) fn load(simd: S, values: &[f64; POINTS]) -> Self {
        let (registers, _) = S::as_simd_f64s(values);
        Self { simd, registers: *registers.first_chunk().expect("no more lanes than points") }
    }

    #[inline(always)]
    pub(crate) fn store(self, values: &mut [f64; POINTS]) {
        let (registers, _) = S::as_mut_simd_f64s(values);
        *registers.first_chunk_mut().expect("no more lanes than points") = self.registers;
    }

    /// The same number at all points.
    #[inline(always)]
    pub(crate) fn constant(self, x: f64) -> Self {
        Self::splat(self.simd, x)
    }

    /// self · b + c.
    #[inline(always)]
    pub(crate) fn mul_add(mut self, b: Self, c: Self) -> Self {
        for r in 0..REGISTERS {
            self.registers[r] =
                self.simd.mul_add_e_f64s(self.registers[r], b.registers[r], c.registers[r]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn sqrt(mut self) -> Self {
        for r in 0..REGISTERS {
            self.registers[r] = self.simd.sqrt_f64s(self.registers[r]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn abs(mut self) -> Self {
        for r in 0..REGISTERS {
            self.registers[r] = self.simd.abs_f64s(self.registers[r]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn max(mut self, other: Self) -> Self {
        for r in 0..REGISTERS {
            self.registers[r] = self.simd.max_f64s(self.registers[r], other.registers[r]);
        }
        self
    }

    #[inline(always)]
    pub(crate) fn min(mut self, other: Self) -> Self {
        for r in 0..REGISTERS {
            self.registers[r] = self.simd.min_f64s(self.registers[r], other.registers[r]);
        }
        self
    }

    /// Σ c_k self^k.
    #[inline(always)]
    pub(crate) fn polynomial(self, coefficients: &[f64]) -> Self {
        let mut sum = self.constant(0.0);
        for &c in coefficients.iter().rev() {
            sum = sum.mul_add(self, self.constant(c));
        }
        sum
    }

    /// k and m of self = 2^k m with ½√2 ≤ m < √2, for a positive normal number.
    #[inline(always)]
    fn binary_parts(self) -> [Self; 2] {
        const MANTISSA: u32 = 52;
        const ONE: u64 = 1.0f64.to_bits();
        const SHIFT: u64 = ONE - FRAC_1_SQRT_2.to_bits();
        // an integer below 2⁵² in the mantissa of 2⁵² is that number behind the point
        const BIG: f64 = (1u64 << MANTISSA) as f64;
        const BIAS: f64 = (ONE >> MANTISSA) as f64;
        let (mut exponents, mut mantissas) = ([0.0; POINTS], [1.0; POINTS]);
        self.store(&mut mantissas);
        for p in 0..Self::COUNT {
            let bits = mantissas[p].to_bits();
            let exponent = bits.wrapping_add(SHIFT) >> MANTISSA;
            exponents[p] = f64::from_bits(exponent | BIG.to_bits()) - (BIG + BIAS);
            mantissas[p] =
                f64::from_bits(bits.wrapping_sub(exponent << MANTISSA).wrapping_add(ONE));
        }
        [Self::load(self.simd, &exponents), Self::load(self.simd, &mantissas)]
    }

    /// ln(1 + self), to the last digits also near zero.
    ///
    /// With 1 + x = 2^k (1 + f): k ln 2 + 2 artanh(f / (2 + f)), where |f / (2 + f)| < 0.172.
    #[inline(always)]
    pub(crate) fn ln_1p(self) -> Self {
        let one = self.constant(1.0);
        let [exponent, mantissa] = (self + one).binary_parts();
        let f = exponent.equals(self.constant(0.0)).select(self, mantissa - one);
        let z = f / (f + self.constant(2.0));
        let whole = exponent * self.constant(LN_2);
        (z + z).mul_add((z * z).polynomial(&ARTANH), whole)
    }

    /// x coth x of x = artanh(self), |self| < 0.18, which is 1 for zero.
    #[inline(always)]
    pub(crate) fn artanh_ratio(self) -> Self {
        (self * self).polynomial(&ARTANH)
    }
}

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

macro_rules! operation {
    ($trait:ident, $name:ident, $intrinsic:ident) => {
        impl<S: Simd> $trait for Many<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(mut self, other: Self) -> Self {
                for r in 0..REGISTERS {
                    self.registers[r] = self.simd.$intrinsic(self.registers[r], other.registers[r]);
                }
                self
            }
        }
    };
}

operation!(Add, add, add_f64s);
operation!(Sub, sub, sub_f64s);
operation!(Mul, mul, mul_f64s);
operation!(Div, div, div_f64s);

macro_rules! comparison {
    ($name:ident, $intrinsic:ident) => {
        impl<S: Simd> Many<S> {
            #[inline(always)]
            pub(crate) fn $name(self, other: Self) -> Mask<S> {
                let simd = self.simd;
                let first = simd.$intrinsic(self.registers[0], other.registers[0]);
                let mut registers = [first; REGISTERS];
                for r in 1..REGISTERS {
                    registers[r] = simd.$intrinsic(self.registers[r], other.registers[r]);
                }
                Mask { simd, registers }
            }
        }
    };
}

comparison!(less_than, less_than_f64s);
comparison!(at_most, less_than_or_equal_f64s);
comparison!(equals, equal_f64s);

impl<S: Simd> Neg for Many<S> {
    type Output = Self;

    #[inline(always)]
    fn neg(self) -> Self {
        self.constant(0.0) - self
    }
}

impl<S: Simd> AddAssign for Many<S> {
    #[inline(always)]
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}
