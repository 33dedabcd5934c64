//! SIMD numbers: one value for each of several points.
//!
//! Instructions beyond the baseline are inlined only into functions that are inlined too. All functions here are
//! therefore inlined, and code that uses these numbers has loops instead of closures.

use std::f64::consts::{FRAC_1_SQRT_2, LN_2};
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use faer::traits::pulp::{self, Simd, WithSimd};

use super::scalar::{Lanes, Number, POINTS, Scalar};

/// Number of registers per value when laws are evaluated: one register computes while the other waits for a square
/// root or a quotient.
pub const REGISTERS: usize = 2;

/// Runs `work` with AVX2 if the processor supports it.
pub fn dispatch<W: WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    return match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => pulp::Scalar::new().vectorize(work),
    };
    #[cfg(not(target_arch = "x86_64"))]
    pulp::Arch::new().dispatch(work)
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

/// Result of a comparison, per lane.
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
}

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

    each_register!(sqrt, sqrt_f64s);
    each_register!(abs, abs_f64s);
    each_register!(max, max_f64s, other);
    each_register!(min, min_f64s, other);
    comparison!(less_than, less_than_f64s);
    comparison!(equals, equal_f64s);

    /// With 1 + x = 2^k (1 + f), the result is k ln 2 + 2 artanh(f / (2 + f)), where |f / (2 + f)| < 0.172.
    #[inline(always)]
    fn ln_1p(self) -> Self {
        let one = self.constant(1.0);
        let [exponent, mantissa] = (self + one).binary_parts();
        let f = Self::select(exponent.equals(self.constant(0.0)), self, mantissa - one);
        let z = f / (f + self.constant(2.0));
        let whole = exponent * self.constant(LN_2);
        (z + z).mul_add(z.artanh_ratio(), whole)
    }

    /// Calls the scalar library function for each lane: no time-critical law uses `exp_m1`.
    #[inline(always)]
    fn exp_m1(self) -> Self {
        let mut values = [0.0; POINTS];
        self.store(&mut values);
        for p in 0..Self::COUNT {
            values[p] = values[p].exp_m1();
        }
        Self::load(self.simd, &values)
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
