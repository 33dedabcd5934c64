//! Arithmetic on several elements at once, with SIMD instructions that are chosen at run time.

use std::marker::PhantomData;

use bytemuck::Pod;
use faer::traits::pulp::{self, Simd, WithSimd};

pub(crate) use crate::material::dispatch;
use crate::material::{Number, SimdF32, SimdF64, Term};
use crate::operator::layout::LANES;

/// Pack: one value of each of several elements, 32 bytes in total, the size of an AVX2 register. Wider registers are
/// not faster, because memory bandwidth is the limit. The alignment keeps a pack within one cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Pack<T, const W: usize>([T; W]);

impl<T: Copy, const W: usize> Pack<T, W> {
    /// Creates a pack with the same value for all elements.
    pub(crate) const fn splat(x: T) -> Self {
        Self([x; W])
    }
}

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

/// Four values of each element of a batch, one row per element.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(crate) struct Rows<T>(pub [[T; 4]; LANES]);

/// Number type of a product with the tangent.
pub(crate) trait Precision:
    Copy + Default + Send + Sync + std::fmt::Debug + 'static
{
    /// Pack: one value of each of several elements, consecutive in memory.
    type Pack: Copy + Send + Sync + std::fmt::Debug + AsRef<[Self]> + AsMut<[Self]> + 'static;
    /// SIMD register of numbers.
    type Register<S: Simd>: Number;

    /// Creates a register with the same value in all lanes.
    fn splat<S: Simd>(simd: S, x: f64) -> Self::Register<S>;
    /// Loads register number `register` of a pack.
    fn load<S: Simd>(simd: S, pack: &Self::Pack, register: usize) -> Self::Register<S>;
}

/// Floating-point type in which the data of the tangent are stored.
pub(crate) trait Stored: Precision + Pod {
    /// Number of elements in a pack.
    const WIDTH: usize;
    const ZERO: Self::Pack;

    /// Rounds a number to this type.
    fn narrow(x: f64) -> Self;
    /// Converts the number to double precision.
    fn widen(self) -> f64;

    /// Returns the number of lanes of a register, which divides the width of a pack.
    fn lanes<S: Simd>() -> usize;
    /// Stores register number `register` of a pack.
    fn store<S: Simd>(pack: &mut Self::Pack, register: usize, x: Self::Register<S>);
    /// Loads the rows of one register as four columns: column c has value c of each row, with one row per SIMD
    /// lane. [`lane_of_row`] returns the order of the rows in the lanes. [`Stored::rows`] is the inverse
    /// operation.
    fn columns<S: Simd>(simd: S, rows: &Rows<Self>, register: usize) -> [Self::Register<S>; 4];
    /// Stores four columns as the rows of one register, the inverse of [`Stored::columns`].
    fn rows<S: Simd>(
        simd: S,
        columns: &[Self::Register<S>; 4],
        rows: &mut Rows<Self>,
        register: usize,
    );
}

/// Prefetches the cache line of a value. The index may be beyond the end of `data`.
#[inline(always)]
pub(crate) fn prefetch<T>(data: &[T], index: usize) {
    #[cfg(target_arch = "x86_64")]
    if let Some(sse) = pulp::core_arch::x86::Sse::try_new() {
        use std::arch::x86_64::_MM_HINT_T0;
        sse._mm_prefetch::<_MM_HINT_T0>(data.as_ptr().wrapping_add(index).cast());
    }
}

/// Returns the lane of each row of a batch in its packs, in the order that [`Stored::columns`] produces.
pub(crate) fn lane_of_row<T: Stored>() -> [usize; LANES] {
    struct Lanes<T>(PhantomData<T>);
    impl<T: Stored> WithSimd for Lanes<T> {
        type Output = [usize; LANES];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [usize; LANES] {
            let mut rows = Rows([[T::default(); 4]; LANES]);
            for row in 0..LANES {
                rows.0[row][0] = T::narrow(row as f64);
            }
            let mut lanes = [0; LANES];
            for register in 0..LANES / T::lanes::<S>() {
                let mut pack = T::ZERO;
                let [first, ..] = T::columns(simd, &rows, register);
                T::store::<S>(&mut pack, 0, first);
                for lane in 0..T::lanes::<S>() {
                    let row = pack.as_ref()[lane].widen() as usize;
                    lanes[row] = register * T::lanes::<S>() + lane;
                }
            }
            lanes
        }
    }
    dispatch(Lanes(PhantomData::<T>))
}

/// When a kernel is recorded, a register and a pack contain the value of a single element.
impl Precision for Term {
    type Pack = Pack<Self, 1>;
    type Register<S: Simd> = Self;

    fn splat<S: Simd>(_: S, x: f64) -> Self {
        Term::default().constant(x)
    }

    fn load<S: Simd>(_: S, pack: &Self::Pack, _: usize) -> Self {
        pack.as_ref()[0]
    }
}

macro_rules! precision {
    ($t:ty, $number:ident, $width:literal, $lanes:ident, $load:ident, $store:ident, $apart:ident,
     $together:ident) => {
        impl Precision for $t {
            type Pack = Pack<$t, $width>;
            type Register<S: Simd> = $number<S, 1>;

            #[inline(always)]
            fn splat<S: Simd>(simd: S, x: f64) -> Self::Register<S> {
                $number::splat(simd, x)
            }

            // the number of registers is a power of two: masking the index removes the bounds check

            #[inline(always)]
            fn load<S: Simd>(simd: S, pack: &Self::Pack, register: usize) -> Self::Register<S> {
                let (registers, _) = S::$load(&pack.0);
                $number { simd, registers: [registers[register & (registers.len() - 1)]] }
            }
        }

        impl Stored for $t {
            const WIDTH: usize = $width;
            const ZERO: Self::Pack = Pack::splat(0.0);

            #[inline(always)]
            fn narrow(x: f64) -> Self {
                x as $t
            }

            #[inline(always)]
            fn widen(self) -> f64 {
                f64::from(self)
            }

            #[inline(always)]
            fn lanes<S: Simd>() -> usize {
                S::$lanes
            }

            #[inline(always)]
            fn store<S: Simd>(pack: &mut Self::Pack, register: usize, x: Self::Register<S>) {
                let (registers, _) = S::$store(&mut pack.0);
                registers[register & (registers.len() - 1)] = x.registers[0];
            }

            #[inline(always)]
            fn columns<S: Simd>(
                simd: S,
                rows: &Rows<Self>,
                register: usize,
            ) -> [Self::Register<S>; 4] {
                let (registers, _) = S::$load(rows.0.as_flattened());
                let mut columns = [$number::<S, 1>::splat(simd, 0.0).registers[0]; 4];
                for c in 0..4 {
                    columns[c] = registers[(4 * register + c) & (registers.len() - 1)];
                }
                let [x, y, z, w] = simd.$apart(columns);
                [
                    $number { simd, registers: [x] },
                    $number { simd, registers: [y] },
                    $number { simd, registers: [z] },
                    $number { simd, registers: [w] },
                ]
            }

            #[inline(always)]
            fn rows<S: Simd>(
                simd: S,
                [x, y, z, w]: &[Self::Register<S>; 4],
                rows: &mut Rows<Self>,
                register: usize,
            ) {
                let columns = [x.registers[0], y.registers[0], z.registers[0], w.registers[0]];
                let columns = simd.$together(columns);
                let (registers, _) = S::$store(rows.0.as_flattened_mut());
                for c in 0..4 {
                    registers[(4 * register + c) & (registers.len() - 1)] = columns[c];
                }
            }
        }
    };
}

precision!(
    f64,
    SimdF64,
    4,
    F64_LANES,
    as_simd_f64s,
    as_mut_simd_f64s,
    deinterleave_shfl_f64s,
    interleave_shfl_f64s
);

precision!(
    f32,
    SimdF32,
    8,
    F32_LANES,
    as_simd_f32s,
    as_mut_simd_f32s,
    deinterleave_shfl_f32s,
    interleave_shfl_f32s
);
