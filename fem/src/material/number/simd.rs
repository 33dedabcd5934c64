//! SIMD numbers: one value for each of several points.
//!
//! The compiler inlines SIMD instructions beyond the baseline of the processor only into functions that are
//! themselves inlined into the code that [`dispatch`] runs. All functions here are therefore `#[inline(always)]`, and
//! code that uses these numbers has loops instead of closures.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2, LOG2_E};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use faer::traits::pulp::{self, Simd, WithSimd};

use super::scalar::{Computation, Lanes, Number, POINTS, Scalar};

/// Number of registers per value when laws are evaluated. With two registers, the processor computes with one
/// register while the other register waits for a square root or a quotient.
pub const REGISTERS: usize = 2;

/// Runs `work` with AVX2 or Neon instructions if the processor supports them, else without vector instructions. The
/// SIMD types here must be the SIMD types of `OverScalars`.
pub fn dispatch<W: WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    return match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => pulp::Scalar::new().vectorize(work),
    };
    #[cfg(target_arch = "aarch64")]
    return match pulp::aarch64::Neon::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => pulp::Scalar::new().vectorize(work),
    };
    #[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
    pulp::Scalar::new().vectorize(work)
}

macro_rules! each_register {
    ($name:ident, $intrinsic:ident $(, $other:ident)*) => {
        #[inline(always)]
        fn $name(mut self $(, $other: Self)*) -> Self {
            for r in 0..self.registers.len() {
                self.registers[r] =
                    self.simd.$intrinsic(self.registers[r] $(, $other.registers[r])*);
            }
            self
        }
    };
}

macro_rules! operator {
    ($number:ident, $trait:ident, $name:ident, $intrinsic:ident $(, $other:ident)*) => {
        impl<S: Simd, const R: usize> $trait for $number<S, R> {
            type Output = Self;

            each_register!($name, $intrinsic $(, $other)*);
        }
    };
}

/// Defines a SIMD number type of the given precision, with sums and products.
macro_rules! simd_number {
    ($(#[$doc:meta])* $number:ident, $real:ty, $registers:ident, $splat:ident, $add:ident,
     $sub:ident, $mul:ident, $neg:ident, $mul_add:ident) => {
        $(#[$doc])*
        #[derive(Clone, Copy)]
        pub struct $number<S: Simd, const R: usize = REGISTERS> {
            pub simd: S,
            pub registers: [S::$registers; R],
        }

        impl<S: Simd, const R: usize> $number<S, R> {
            #[inline(always)]
            pub fn splat(simd: S, x: f64) -> Self {
                Self { simd, registers: [simd.$splat(x as $real); R] }
            }
        }

        operator!($number, Add, add, $add, other);
        operator!($number, Sub, sub, $sub, other);
        operator!($number, Mul, mul, $mul, other);
        operator!($number, Neg, neg, $neg);

        impl<S: Simd, const R: usize> AddAssign for $number<S, R> {
            #[inline(always)]
            fn add_assign(&mut self, other: Self) {
                *self = *self + other;
            }
        }

        impl<S: Simd, const R: usize> Number for $number<S, R> {
            each_register!(mul_add, $mul_add, b, c);

            #[inline(always)]
            fn constant(self, x: f64) -> Self {
                Self::splat(self.simd, x)
            }
        }
    };
}

simd_number!(
    /// One double-precision number per point, for as many points as the registers hold.
    SimdF64, f64, f64s, splat_f64s, add_f64s, sub_f64s, mul_f64s, neg_f64s, mul_add_e_f64s
);
simd_number!(
    /// One single-precision number per point, for as many points as the registers hold.
    SimdF32, f32, f32s, splat_f32s, add_f32s, sub_f32s, mul_f32s, neg_f32s, mul_add_e_f32s
);
operator!(SimdF64, Div, div, div_f64s, other);

macro_rules! with_constant {
    ($trait:ident, $name:ident) => {
        impl<S: Simd> $trait<f64> for SimdF64<S> {
            type Output = Self;

            #[inline(always)]
            fn $name(self, x: f64) -> Self {
                $trait::$name(self, Self::splat(self.simd, x))
            }
        }
    };
}

with_constant!(Add, add);
with_constant!(Sub, sub);
with_constant!(Mul, mul);
with_constant!(Div, div);

/// Computation that runs with the vector instructions of its caller.
struct Vectorized<W>(W);

impl<W: Computation> WithSimd for Vectorized<W> {
    type Output = W::Output;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> W::Output {
        self.0.run()
    }
}

/// Result of a comparison, per SIMD lane.
#[derive(Clone, Copy)]
pub struct Mask<S: Simd> {
    simd: S,
    registers: [S::m64s; REGISTERS],
}

impl<S: Simd> SimdF64<S> {
    /// Returns k and m with self = 2^k m and ½√2 ≤ m < √2, for a positive normal number.
    #[inline(always)]
    fn binary_parts(self) -> [Self; 2] {
        const MANTISSA: u32 = 52;
        const ONE: u64 = 1.0f64.to_bits();
        const SHIFT: u64 = ONE - FRAC_1_SQRT_2.to_bits();
        // an integer below 2⁵² in the mantissa bits of 2⁵² gives the number 2⁵² plus this integer
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

    /// Returns 2^k and e^r − 1 with self = k ln 2 + r and |r| ≤ ½ ln 2, for |self| < 709.
    #[inline(always)]
    fn exponential_parts(self) -> [Self; 2] {
        const MANTISSA: u32 = 52;
        // adding this number rounds to an integer, and stores the integer in the last bits of the sum
        const ROUND: f64 = 1.5 * (1u64 << MANTISSA) as f64;
        let shifted = self.mul_add(self.constant(LOG2_E), self.constant(ROUND));
        let k = shifted - self.constant(ROUND);
        let r = k.mul_add(self.constant(-LN_2_LOW), k.mul_add(self.constant(-LN_2_HIGH), self));
        let mut powers = [1.0; POINTS];
        shifted.store(&mut powers);
        for p in 0..Self::COUNT {
            let bits = powers[p].to_bits() << MANTISSA;
            powers[p] = f64::from_bits(bits.wrapping_add(1.0f64.to_bits()));
        }
        let rest = r.polynomial(&EXPONENTIAL);
        [Self::load(self.simd, &powers), (r * r).mul_add(rest, r)]
    }

    /// Returns `value` where [`limited_exponent`](Self::limited_exponent) did not change the number, else the limit of
    /// the exponential function: infinity, or `low`. NaN stays NaN.
    #[inline(always)]
    fn beyond_exponents(self, value: Self, low: f64) -> Self {
        let (low, infinity) = (self.constant(low), self.constant(f64::INFINITY));
        let value = Self::select(self.constant(708.0).less_than(self), infinity, value);
        let value = Self::select(self.less_than(self.constant(-708.0)), low, value);
        Self::select(self.equals(self), value, self)
    }

    /// Limits the number to the range in which e^self is a normal floating-point number.
    #[inline(always)]
    fn limited_exponent(self) -> Self {
        self.max(self.constant(-708.0)).min(self.constant(708.0))
    }
}

/// High part of ln 2 = `LN_2_HIGH` + `LN_2_LOW`. This part has 32 trailing zero bits, so that its multiples k
/// `LN_2_HIGH` are exact.
const LN_2_HIGH: f64 = 0.693_147_180_369_123_8;
/// Low part of ln 2.
const LN_2_LOW: f64 = 1.908_214_929_270_587_7e-10;

/// Coefficients of (e^r − 1 − r)/r² in powers of r. The truncation error is below 2⁻⁵⁵ for |r| ≤ ½ ln 2.
const EXPONENTIAL: [f64; 12] = [
    1.0 / 2.0,
    1.0 / 6.0,
    1.0 / 24.0,
    1.0 / 120.0,
    1.0 / 720.0,
    1.0 / 5_040.0,
    1.0 / 40_320.0,
    1.0 / 362_880.0,
    1.0 / 3_628_800.0,
    1.0 / 39_916_800.0,
    1.0 / 479_001_600.0,
    1.0 / 6_227_020_800.0,
];

impl<S: Simd> Lanes for SimdF64<S> {
    type Token = S;

    const COUNT: usize =
        if REGISTERS * S::F64_LANES < POINTS { REGISTERS * S::F64_LANES } else { POINTS };

    #[inline(always)]
    fn token(self) -> S {
        self.simd
    }

    #[inline(always)]
    fn load(simd: S, values: &[f64; POINTS]) -> Self {
        let (registers, _) = S::as_simd_f64s(values);
        Self { simd, registers: *registers.first_chunk().expect("no more lanes than points") }
    }

    #[inline(always)]
    fn store(self, values: &mut [f64; POINTS]) {
        let (registers, _) = S::as_mut_simd_f64s(values);
        *registers.first_chunk_mut().expect("no more lanes than points") = self.registers;
    }
}

macro_rules! comparison {
    ($name:ident, $intrinsic:ident) => {
        #[inline(always)]
        fn $name(self, other: Self) -> Mask<S> {
            let simd = self.simd;
            let first = simd.$intrinsic(self.registers[0], other.registers[0]);
            let mut registers = [first; REGISTERS];
            for r in 1..REGISTERS {
                registers[r] = simd.$intrinsic(self.registers[r], other.registers[r]);
            }
            Mask { simd, registers }
        }
    };
}

impl<S: Simd> Scalar for SimdF64<S> {
    type Mask = Mask<S>;

    #[inline(always)]
    fn vectorize<W: Computation>(self, work: W) -> W::Output {
        self.simd.vectorize(Vectorized(work))
    }

    each_register!(sqrt, sqrt_f64s);
    each_register!(abs, abs_f64s);
    each_register!(max, max_f64s, other);
    each_register!(min, min_f64s, other);
    comparison!(less_than, less_than_f64s);
    comparison!(equals, equal_f64s);

    /// Returns ln(1 + x); NaN for x ≤ −1. With 1 + x = 2^k (1 + f), the result is k ln 2 + 2 artanh(f / (2 + f)),
    /// where |f / (2 + f)| < 0.172.
    #[inline(always)]
    fn ln_1p(self) -> Self {
        let one = self.constant(1.0);
        let zero = self.constant(0.0);
        let argument = self + one;
        let [exponent, mantissa] = argument.binary_parts();
        let f = Self::select(exponent.equals(zero), self, mantissa - one);
        let z = f / (f + self.constant(2.0));
        let whole = exponent * self.constant(LN_2);
        let logarithm = (z + z).mul_add(z.artanh_ratio(), whole);
        Self::select(zero.less_than(argument), logarithm, self.constant(f64::NAN))
    }

    /// Returns ln x; NaN for x ≤ 0. With x = 2^k (1 + f), the result is k ln 2 + 2 artanh(f / (2 + f)).
    #[inline(always)]
    fn ln(self) -> Self {
        let [exponent, mantissa] = self.binary_parts();
        let f = mantissa - 1.0;
        let z = f / (f + 2.0);
        let logarithm = (z + z).mul_add(z.artanh_ratio(), exponent * LN_2);
        let is_positive = self.constant(0.0).less_than(self);
        Self::select(is_positive, logarithm, self.constant(f64::NAN))
    }

    #[inline(always)]
    fn exp(self) -> Self {
        let [power, rest] = self.limited_exponent().exponential_parts();
        self.beyond_exponents(power.mul_add(rest, power), 0.0)
    }

    #[inline(always)]
    fn exp_m1(self) -> Self {
        let [power, rest] = self.limited_exponent().exponential_parts();
        self.beyond_exponents(power.mul_add(rest, power - 1.0), -1.0)
    }

    #[inline(always)]
    fn select(mask: Mask<S>, yes: Self, no: Self) -> Self {
        let mut out = no;
        for r in 0..REGISTERS {
            out.registers[r] =
                mask.simd.select_f64s(mask.registers[r], yes.registers[r], no.registers[r]);
        }
        out
    }

    #[inline(always)]
    fn settled(mask: Mask<S>) -> bool {
        let zero = Self::splat(mask.simd, 0.0);
        let holds = Self::select(mask, zero.constant(1.0), zero);
        let mut least = holds.registers[0];
        for r in 1..REGISTERS {
            least = mask.simd.min_f64s(least, holds.registers[r]);
        }
        mask.simd.reduce_min_f64s(least) > 0.5
    }
}
