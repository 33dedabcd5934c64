//! Arithmetic on several elements at once, with the widest instructions that the processor has.

use std::marker::PhantomData;

use faer::traits::pulp::{self, Simd, WithSimd};

use crate::operator::layout::LANES;

/// One number of as many elements as 32 bytes hold, the register of AVX2; wider ones gain nothing
/// where memory is the limit. It is so aligned that it does not cross a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Pack<T, const W: usize>([T; W]);

impl<T, const W: usize> AsRef<[T]> for Pack<T, W> {
    #[inline(always)]
    fn as_ref(&self) -> &[T] {
        &self.0
    }
}

impl<T, const W: usize> AsMut<[T]> for Pack<T, W> {
    #[inline(always)]
    fn as_mut(&mut self) -> &mut [T] {
        &mut self.0
    }
}

/// Four numbers of each element of a batch, element by element.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Rows<T>(pub(crate) [[T; 4]; LANES]);

/// The precision of stored numbers; `V` is a register of them.
pub(crate) trait Real: Copy + Default + Send + Sync + std::fmt::Debug + 'static {
    type Pack: Copy + Send + Sync + std::fmt::Debug + AsRef<[Self]> + AsMut<[Self]> + 'static;
    type V<S: Simd>: Copy;

    /// Numbers in a pack.
    const WIDTH: usize;
    const ZERO: Self::Pack;

    fn of(x: f64) -> Self;
    fn wide(self) -> f64;

    /// Numbers in a register, which divide a pack.
    fn lanes<S: Simd>() -> usize;
    fn splat<S: Simd>(simd: S, x: Self) -> Self::V<S>;
    fn load<S: Simd>(simd: S, pack: &Self::Pack, register: usize) -> Self::V<S>;
    fn store<S: Simd>(simd: S, pack: &mut Self::Pack, register: usize, x: Self::V<S>);
    fn add<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    fn sub<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    fn mul<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>) -> Self::V<S>;
    /// a b + c.
    fn mul_add<S: Simd>(simd: S, a: Self::V<S>, b: Self::V<S>, c: Self::V<S>) -> Self::V<S>;
    /// The four columns of as many rows as a register has lanes, in an order of the lanes that
    /// [`Real::rows`] undoes and [`places`] tells.
    fn columns<S: Simd>(simd: S, rows: &Rows<Self>, register: usize) -> [Self::V<S>; 4];
    /// Writes four columns as rows again.
    fn rows<S: Simd>(simd: S, columns: [Self::V<S>; 4], rows: &mut Rows<Self>, register: usize);
}

/// Runs work with AVX2 where the processor has it.
pub(crate) fn dispatch<W: WithSimd>(work: W) -> W::Output {
    #[cfg(target_arch = "x86_64")]
    return match pulp::x86::V3::try_new() {
        Some(simd) => Simd::vectorize(simd, work),
        None => pulp::Scalar::new().vectorize(work),
    };
    #[cfg(not(target_arch = "x86_64"))]
    pulp::Arch::new().dispatch(work)
}

/// Asks for the cache line of a value that may lie behind the end of `data`.
#[inline(always)]
pub(crate) fn prefetch<T>(data: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(sse) = pulp::core_arch::x86::Sse::try_new() {
        use std::arch::x86_64::_MM_HINT_T0;
        sse._mm_prefetch::<_MM_HINT_T0>(data.as_ptr().wrapping_add(index).cast());
    }
}

/// The place of each element of a batch in its packs, as [`Real::columns`] puts it.
pub(crate) fn places<T: Real>() -> [usize; LANES] {
    struct Places<T>(PhantomData<T>);
    impl<T: Real> WithSimd for Places<T> {
        type Output = [usize; LANES];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [usize; LANES] {
            let mut rows = Rows([[T::default(); 4]; LANES]);
            for row in 0..LANES {
                rows.0[row][0] = T::of(row as f64);
            }
            let mut places = [0; LANES];
            for register in 0..LANES / T::lanes::<S>() {
                let mut pack = T::ZERO;
                let [first, ..] = T::columns(simd, &rows, register);
                T::store(simd, &mut pack, 0, first);
                for lane in 0..T::lanes::<S>() {
                    places[pack.as_ref()[lane].wide() as usize] = register * T::lanes::<S>() + lane;
                }
            }
            places
        }
    }
    dispatch(Places(PhantomData::<T>))
}

macro_rules! real {
    ($t:ty, $width:literal, $v:ident, $lanes:ident, $splat:ident, $add:ident, $sub:ident,
     $mul:ident, $fma:ident, $load:ident, $store:ident, $apart:ident, $together:ident) => {
        impl Real for $t {
            type Pack = Pack<$t, $width>;
            type V<S: Simd> = S::$v;

            const WIDTH: usize = $width;
            const ZERO: Self::Pack = Pack([0.0; $width]);

            #[inline(always)]
            fn of(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn wide(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn lanes<S: Simd>() -> usize {
                S::$lanes
            }

            #[inline(always)]
            fn splat<S: Simd>(simd: S, x: Self) -> Self::V<S> {
                simd.$splat(x)
            }

            // numbers of registers are powers of two: the masks spare checks of bounds

            #[inline(always)]
            fn load<S: Simd>(_: S, pack: &Self::Pack, register: usize) -> Self::V<S> {
                let (registers, _) = S::$load(&pack.0);
                registers[register & (registers.len() - 1)]
            }

            #[inline(always)]
            fn store<S: Simd>(_: S, pack: &mut Self::Pack, register: usize, x: Self::V<S>) {
                let (registers, _) = S::$store(&mut pack.0);
                registers[register & (registers.len() - 1)] = x;
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

            #[inline(always)]
            fn columns<S: Simd>(simd: S, rows: &Rows<Self>, register: usize) -> [Self::V<S>; 4] {
                let (registers, _) = S::$load(rows.0.as_flattened());
                let mut columns = [simd.$splat(0.0); 4];
                for c in 0..4 {
                    columns[c] = registers[(4 * register + c) & (registers.len() - 1)];
                }
                simd.$apart(columns)
            }

            #[inline(always)]
            fn rows<S: Simd>(
                simd: S,
                columns: [Self::V<S>; 4],
                rows: &mut Rows<Self>,
                register: usize,
            ) {
                let columns = simd.$together(columns);
                let (registers, _) = S::$store(rows.0.as_flattened_mut());
                for c in 0..4 {
                    registers[(4 * register + c) & (registers.len() - 1)] = columns[c];
                }
            }
        }
    };
}

real!(
    f64,
    4,
    f64s,
    F64_LANES,
    splat_f64s,
    add_f64s,
    sub_f64s,
    mul_f64s,
    mul_add_f64s,
    as_simd_f64s,
    as_mut_simd_f64s,
    deinterleave_shfl_f64s,
    interleave_shfl_f64s
);

real!(
    f32,
    8,
    f32s,
    F32_LANES,
    splat_f32s,
    add_f32s,
    sub_f32s,
    mul_f32s,
    mul_add_f32s,
    as_simd_f32s,
    as_mut_simd_f32s,
    deinterleave_shfl_f32s,
    interleave_shfl_f32s
);
