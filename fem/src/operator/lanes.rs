//! Arithmetic on the lanes of a batch with the widest instructions that the processor has.

use faer::traits::pulp::Simd;

/// Elements that are worked on at once.
pub(crate) const LANES: usize = 8;

/// One number of each element of a batch.
pub(crate) type Lane<T> = [T; LANES];

/// The precision of stored numbers; `V` is a register of them.
pub(crate) trait Real: Copy + Default + Send + Sync + std::fmt::Debug + 'static {
    type V<S: Simd>: Copy;

    fn of(x: f64) -> Self;
    fn wide(self) -> f64;

    /// Registers that hold a batch.
    fn registers<S: Simd>() -> usize;
    fn splat<S: Simd>(simd: S, x: Self) -> Self::V<S>;
    fn load<S: Simd>(simd: S, lane: &Lane<Self>, register: usize) -> Self::V<S>;
    fn store<S: Simd>(simd: S, lane: &mut Lane<Self>, register: usize, x: Self::V<S>);
    fn add<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    fn sub<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    fn mul<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    /// a b + c.
    fn mul_add<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>, c: Self::V<S>) -> Self::V<S>;
}

macro_rules! real {
    ($t:ty, $v:ident, $lanes:ident, $splat:ident, $add:ident, $sub:ident, $mul:ident, $fma:ident,
     $load:ident, $store:ident, $partial:ident, $partial_store:ident) => {
        impl Real for $t {
            type V<S: Simd> = S::$v;

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn registers<S: Simd>() -> usize {
                // a register wider than a batch does not occur: AVX-512 has 8 doubles, and 16
                // singles are loaded as half a register
                LANES.div_ceil(S::$lanes)
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, x: Self) -> Self::V<S> {
                simd.$splat(x)
            }

            #[inline(always)]
            fn load<S: Simd>(simd: S, lane: &Lane<Self>, register: usize) -> Self::V<S> {
                // the number of registers is a power of two: the mask spares a check of bounds
                let (full, rest) = S::$load(lane);
                if full.is_empty() {
                    simd.$partial(rest)
                } else {
                    full[register & (full.len() - 1)]
                }
            }

            #[inline(always)]
            fn store<S: Simd>(simd: S, lane: &mut Lane<Self>, register: usize, x: Self::V<S>) {
                let (full, rest) = S::$store(lane);
                if full.is_empty() {
                    simd.$partial_store(rest, x)
                } else {
                    full[register & (full.len() - 1)] = x
                }
            }

            #[inline(always)]
            fn add<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S> {
                simd.$add(a, b)
            }

            #[inline(always)]
            fn sub<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S> {
                simd.$sub(a, b)
            }

            #[inline(always)]
            fn mul<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S> {
                simd.$mul(a, b)
            }

            #[inline(always)]
            fn mul_add<S: Simd>(
                simd: S,
                a: Self::V<S>,
                b: Self::V<S>,
                c: Self::V<S>,
            ) -> Self::V<S> {
                simd.$fma(a, b, c)
            }
        }
    };
}

real!(
    f64,
    f64s,
    F64_LANES,
    splat_f64s,
    add_f64s,
    sub_f64s,
    mul_f64s,
    mul_add_f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    partial_load_f64s,
    partial_store_f64s
);

real!(
    f32,
    f32s,
    F32_LANES,
    splat_f32s,
    add_f32s,
    sub_f32s,
    mul_f32s,
    mul_add_f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    partial_load_f32s,
    partial_store_f32s
);
