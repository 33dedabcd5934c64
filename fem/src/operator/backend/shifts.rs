//! Derivatives of the residual with respect to parameters, for several elements per SIMD register.

use faer::traits::pulp::{Simd, WithSimd};

use super::gather::{Buffers, Gather, check, store_rows};
use super::lanes::{Rows, dispatch};
use super::regions::Regions;
use crate::material::{Homogenisation, Inverted, Lanes, POINTS, PointMaterial, SimdF64};
use crate::operator::layout::LANES;
use crate::operator::rates::{AT_ONCE, Moved, Rates};
use crate::operator::residual::Shift;

/// A parameter, with the materials below and above its value.
struct Sides<'a> {
    below: Regions,
    above: Regions,
    /// Whether stress or driving energy differ between `below` and `above`.
    responds: bool,
    shift: &'a Shift<'a>,
}

/// At most [`AT_ONCE`] parameters, whose rates are computed together.
pub(super) struct Shifts<'a, const N: usize> {
    gather: &'a Gather<'a, N>,
    shifts: Vec<Sides<'a>>,
}

impl<'a, const N: usize> Shifts<'a, N> {
    pub(super) fn new(
        gather: &'a Gather<'a, N>,
        rule: Homogenisation,
        duration: f64,
        shifts: &'a [Shift<'a>],
    ) -> Self {
        let sides = |shift: &'a Shift<'a>| {
            let [below, above] =
                [shift.below, shift.above].map(|side| Regions::new(side, rule, duration, 0.0));
            let same = shift.below.iter().zip(shift.above).all(|(a, b)| respond_alike(a, b));
            Sides { below, above, responds: !same, shift }
        };
        Self { gather, shifts: shifts.iter().map(sides).collect() }
    }

    /// The rates of `out.len()` elements, beginning with element `first`.
    pub(super) fn rates(&self, first: usize, out: &mut [Rates<f64, N>]) -> Result<(), Inverted> {
        dispatch(OfElements { shifts: self, first, out })
    }
}

/// Whether two materials are certain to have the same stress and driving energy. False for two user laws.
fn respond_alike(a: &PointMaterial, b: &PointMaterial) -> bool {
    let degradation =
        |m: &PointMaterial| m.damage.as_ref().map(|d| (d.degradation.clone(), d.residual));
    let moduli = |m: &PointMaterial| [m.moduli.bulk, m.moduli.shear];
    a.law() == b.law() && moduli(a) == moduli(b) && degradation(a) == degradation(b)
}

struct OfElements<'a, 'b, const N: usize> {
    shifts: &'a Shifts<'a, N>,
    first: usize,
    out: &'b mut [Rates<f64, N>],
}

impl<const N: usize> WithSimd for OfElements<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { shifts: Shifts { gather, shifts }, mut first, out } = self;
        let space = gather.space;
        let zero = SimdF64::<S>::splat(simd, 0.0);
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        for out in out.chunks_mut(SimdF64::<S>::COUNT) {
            let tets = gather.rows(first, out.len());
            let elements = gather.elements(simd, tets, &mut buffers);
            let none = Moved {
                below: elements.constants,
                above: elements.constants,
                per_unit: zero,
                responds: false,
                before: [zero; N],
            };
            let mut moved = [none; AT_ONCE];
            for (moved, sides) in moved.iter_mut().zip(shifts) {
                let Sides { below, above, responds, shift } = sides;
                moved.below = below.of(simd, space, &tets).0;
                moved.above = above.of(simd, space, &tets).0;
                moved.per_unit = SimdF64::splat(simd, 1.0 / shift.width);
                moved.responds = *responds;
                for a in 0..N {
                    let mut column = [0.0; POINTS];
                    for lane in 0..SimdF64::<S>::COUNT {
                        column[lane] = shift.before[space.tets[tets[lane]][a] as usize][3];
                    }
                    moved.before[a] = SimdF64::load(simd, &column);
                }
            }
            let mut rates = [[[zero; 4]; N]; AT_ONCE];
            check(elements.rates(&moved[..shifts.len()], &mut rates))?;
            let mut rows = Rows([[0.0; 4]; LANES]);
            for m in 0..shifts.len() {
                for a in 0..N {
                    store_rows(simd, &rates[m][a], &mut rows);
                    for (out, row) in out.iter_mut().zip(&rows.0) {
                        out[m][a] = *row;
                    }
                }
            }
            first += out.len();
        }
        Ok(())
    }
}
