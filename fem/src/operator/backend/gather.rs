//! Gathers the values of elements into SIMD lanes, and stores the results of the element kernel.

use faer::traits::pulp::{Simd, WithSimd};

use super::lanes::{Rows, Stored, dispatch, places};
use super::regions::Regions;
use crate::element::{Domain, Geometry, Space};
use crate::material::{
    CrackDensity, Homogenisation, Inverted, LaneLaw, Lanes, POINTS, REGISTERS, SimdF64,
};
use crate::operator::blocks::write_blocks;
use crate::operator::element::{ElementResidual, ElementState, MOST_POINTS};
use crate::operator::layout::{LANES, VACANT};
use crate::operator::pattern::Block;
use crate::operator::point_data::PointData;
use crate::operator::residual::Increment;

/// Length of a stack buffer that holds the point data of a linear element with its principal axes.
const FEW: usize = 51;

/// Data of an increment that all elements share.
pub struct Gather<'a, const N: usize> {
    pub(super) space: &'a Space<N>,
    increment: &'a Increment<'a>,
    density: CrackDensity,
    regions: Regions,
    /// Lane of each row of a batch.
    pub(super) places: [usize; LANES],
}

/// Storage for the values to which [`ElementState`] refers.
pub struct Buffers<T> {
    /// Geometry if all elements are straight.
    straight: [Geometry<T>; 1],
    /// Geometry by elastic point, if at least one element is curved.
    curved: Vec<Geometry<T>>,
    history: Option<[T; MOST_POINTS]>,
}

impl<T: Lanes> Buffers<T> {
    #[inline(always)]
    pub fn new(token: T::Token) -> Self {
        let zero = T::load(token, &[0.0; POINTS]);
        let straight = [Geometry { barycentric: [[zero; 3]; 3], volume: zero }];
        Self { straight, curved: Vec::new(), history: None }
    }
}

impl<'a, const N: usize> Gather<'a, N> {
    pub fn new(space: &'a Space<N>, rule: Homogenisation, increment: &'a Increment<'a>) -> Self {
        let Increment { materials, context, .. } = increment;
        // all regions have the same damage model, so the first one is used
        let damage = materials.iter().find_map(|m| m.damage.as_ref());
        Self {
            space,
            increment,
            density: damage.map_or(CrackDensity::At2, |d| d.density),
            regions: Regions::new(materials, rule, context.duration, context.damping),
            places: places::<f64>(),
        }
    }

    /// The residuals of `out.len()` elements, beginning with element `first`.
    pub(super) fn residuals(
        &self,
        first: usize,
        out: &mut [ElementResidual<f64, N>],
    ) -> Result<(), Inverted> {
        dispatch(Residuals { gather: self, first, out })
    }

    /// The tangents of `out.len()` elements, beginning with element `first`.
    pub(super) fn tangents(
        &self,
        first: usize,
        coupled: bool,
        out: &mut [[[Block; N]; N]],
    ) -> Result<(), Inverted> {
        dispatch(Tangents { gather: self, first, coupled, out })
    }

    /// The point data of the tangents of the elements `tets`, batch by batch.
    pub(super) fn point_data(
        &self,
        tets: &[u32],
        coupled: bool,
        write: &mut dyn FnMut(usize, &[[f64; LANES]]),
    ) -> Result<(), Inverted> {
        dispatch(Numbers { gather: self, tets, coupled, write })
    }

    /// The driving energies of consecutive elements, beginning with element `first`, point by point.
    pub(super) fn driving_energies(&self, first: usize, out: &mut [f64]) -> Result<(), Inverted> {
        dispatch(Driving { gather: self, first, out })
    }

    /// The element of each lane, chosen so that the rows are stored in the order of the elements. Lanes
    /// without an element repeat the last element.
    pub(super) fn rows(&self, first: usize, count: usize) -> [usize; LANES] {
        let mut tets = [first; LANES];
        for row in 0..LANES {
            tets[self.places[row]] = first + row.min(count - 1);
        }
        tets
    }

    /// The state of the elements in all lanes.
    #[inline(always)]
    pub fn elements<'b, T: Lanes>(
        &'b self,
        token: T::Token,
        tets: [usize; POINTS],
        buffers: &'b mut Buffers<T>,
    ) -> ElementState<'b, T, LaneLaw<'b, T>, N>
    where
        'a: 'b,
    {
        let Self { space, increment, .. } = self;
        let zero = T::load(token, &[0.0; POINTS]);
        let (fields, context) = (increment.fields, &increment.context);
        let (mut displacement, mut damage, mut before) = ([[zero; 3]; N], [zero; N], [zero; N]);
        for a in 0..N {
            let mut columns = [[0.0; POINTS]; 5];
            for lane in 0..T::COUNT {
                let node = space.tets[tets[lane]][a] as usize;
                let u = &fields.displacement[node];
                for k in 0..3 {
                    columns[k][lane] = u[k];
                }
                columns[3][lane] = fields.damage[node];
                columns[4][lane] = context.damage_before[node];
            }
            for k in 0..3 {
                displacement[a][k] = T::load(token, &columns[k]);
            }
            damage[a] = T::load(token, &columns[3]);
            before[a] = T::load(token, &columns[4]);
        }
        let (constants, mixed) = self.regions.of(token, space, &tets);
        let mut curved = false;
        for lane in 0..T::COUNT {
            curved |= space.is_curved(tets[lane]);
        }
        self.locate(token, tets, curved, buffers);
        ElementState {
            rule: &space.rule,
            constants,
            density: self.density,
            displacement,
            damage,
            before,
            geometry: if curved { &buffers.curved[..] } else { &buffers.straight[..] },
            plain: !curved && !mixed,
            history: buffers.history.as_ref(),
        }
    }

    /// Fills the buffers: the geometry, and the largest previous ψ⁺ at the elastic points if there is a
    /// history.
    #[inline(always)]
    fn locate<T: Lanes>(
        &self,
        token: T::Token,
        tets: [usize; POINTS],
        curved: bool,
        buffers: &mut Buffers<T>,
    ) {
        let (history, points) = (self.increment.context.history, self.space.rule.points.len());
        if curved {
            buffers.curved.resize(points, buffers.straight[0]);
            for q in 0..points {
                buffers.curved[q] = self.geometry(token, tets, q);
            }
        } else {
            buffers.straight[0] = self.geometry(token, tets, 0);
        }
        if history.is_empty() {
            return;
        }
        let mut so_far = [T::load(token, &[0.0; POINTS]); MOST_POINTS];
        for q in 0..points {
            let mut column = [0.0; POINTS];
            for lane in 0..T::COUNT {
                column[lane] = history[tets[lane] * points + q];
            }
            so_far[q] = T::load(token, &column);
        }
        buffers.history = Some(so_far);
    }

    /// The geometry of the elements in all lanes at elastic point q.
    #[inline(always)]
    fn geometry<T: Lanes>(&self, token: T::Token, tets: [usize; POINTS], q: usize) -> Geometry<T> {
        let mut columns = [[0.0; POINTS]; 10];
        for lane in 0..T::COUNT {
            let points = self.space.geometry(tets[lane]);
            let Geometry { barycentric, volume } = &points[if points.len() == 1 { 0 } else { q }];
            for k in 0..3 {
                for x in 0..3 {
                    columns[3 * k + x][lane] = barycentric[k][x];
                }
            }
            columns[9][lane] = *volume;
        }
        let zero = T::load(token, &[0.0; POINTS]);
        let mut barycentric = [[zero; 3]; 3];
        for k in 0..3 {
            for x in 0..3 {
                barycentric[k][x] = T::load(token, &columns[3 * k + x]);
            }
        }
        Geometry { barycentric, volume: T::load(token, &columns[9]) }
    }
}

/// Returns an error if the element of any lane is inverted.
#[inline(always)]
pub(super) fn check<T: Lanes>(sound: T) -> Result<(), Inverted> {
    let mut lanes = [1.0; POINTS];
    sound.store(&mut lanes);
    if lanes == [1.0; POINTS] { Ok(()) } else { Err(Inverted) }
}

/// Stores four values of each element as rows, in the order of the elements.
#[inline(always)]
pub(super) fn store_rows<S: Simd>(simd: S, columns: &[SimdF64<S>; 4], rows: &mut Rows<f64>) {
    for r in 0..REGISTERS {
        let mut parts = [SimdF64::<S, 1>::splat(simd, 0.0); 4];
        for c in 0..4 {
            parts[c].registers[0] = columns[c].registers[r];
        }
        f64::rows(simd, &parts, rows, r);
    }
}

struct Residuals<'a, 'b, const N: usize> {
    gather: &'a Gather<'a, N>,
    first: usize,
    out: &'b mut [ElementResidual<f64, N>],
}

impl<const N: usize> WithSimd for Residuals<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, mut first, out } = self;
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        for out in out.chunks_mut(SimdF64::<S>::COUNT) {
            let tets = gather.rows(first, out.len());
            let residual = gather.elements(simd, tets, &mut buffers).residual();
            check(residual.sound)?;
            let mut rows = Rows([[0.0; 4]; LANES]);
            for a in 0..N {
                store_rows(simd, &residual.nodal[a], &mut rows);
                for (out, row) in out.iter_mut().zip(&rows.0) {
                    out.nodal[a] = *row;
                }
            }
            let mut column = [0.0; POINTS];
            for a in 0..N {
                residual.drive[a].store(&mut column);
                for (out, &place) in out.iter_mut().zip(&gather.places) {
                    out.drive[a] = column[place];
                }
            }
            for k in 0..3 {
                residual.energies[k].store(&mut column);
                for (out, &place) in out.iter_mut().zip(&gather.places) {
                    out.energies[k] = column[place];
                }
            }
            first += out.len();
        }
        Ok(())
    }
}

struct Tangents<'a, 'b, const N: usize> {
    gather: &'a Gather<'a, N>,
    first: usize,
    coupled: bool,
    out: &'b mut [[[Block; N]; N]],
}

impl<const N: usize> WithSimd for Tangents<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, mut first, coupled, out } = self;
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        let rule = &gather.space.rule;
        // sized for elements that are not plain, which need the most
        let width = PointData::of(rule, false).width_with_axes();
        // the point data of a linear element fit on the stack
        let zero = SimdF64::<S>::splat(simd, 0.0);
        let (mut few, mut many) = ([zero; FEW], Vec::new());
        let numbers = if width <= FEW {
            &mut few[..width]
        } else {
            many.resize(width, zero);
            &mut many
        };
        for out in out.chunks_mut(SimdF64::<S>::COUNT) {
            let tets = gather.rows(first, out.len());
            let elements = gather.elements(simd, tets, &mut buffers);
            check(elements.linearise::<true>(coupled, numbers))?;
            let mut blocks = [[[[zero; 4]; 4]; N]; N];
            write_blocks::<SimdF64<S>, true, N>(rule, elements.plain, numbers, &mut blocks);
            let mut rows = Rows([[0.0; 4]; LANES]);
            for a in 0..N {
                for b in 0..=a {
                    for i in 0..4 {
                        store_rows(simd, &blocks[a][b][i], &mut rows);
                        for (out, row) in out.iter_mut().zip(&rows.0) {
                            out[a][b][i] = *row;
                        }
                    }
                }
            }
            first += out.len();
        }
        Ok(())
    }
}

struct Numbers<'a, 'b, const N: usize> {
    gather: &'a Gather<'a, N>,
    tets: &'b [u32],
    coupled: bool,
    write: &'b mut dyn FnMut(usize, &[[f64; LANES]]),
}

impl<const N: usize> WithSimd for Numbers<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, tets, coupled, write } = self;
        let count = SimdF64::<S>::COUNT;
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        let plain = tets.iter().all(|&tet| tet == VACANT || gather.space.is_plain(tet as usize));
        let width = PointData::of(&gather.space.rule, plain).width();
        let mut numbers = vec![SimdF64::<S>::splat(simd, 0.0); width];
        let mut columns = vec![[0.0; POINTS]; width];
        for (batch, tets) in tets.chunks(LANES).enumerate() {
            for first in (0..LANES).step_by(count) {
                let mut lanes = [0; LANES];
                for lane in 0..count {
                    // a vacant lane repeats the first element of the batch
                    let tet = tets.get(first + lane).copied().filter(|&tet| tet != VACANT);
                    lanes[lane] = tet.unwrap_or(tets[0]) as usize;
                }
                let mut elements = gather.elements(simd, lanes, &mut buffers);
                elements.plain = plain;
                check(elements.linearise::<false>(coupled, &mut numbers))?;
                for (out, number) in columns.iter_mut().zip(&numbers) {
                    let mut column = [0.0; POINTS];
                    number.store(&mut column);
                    out[first..first + count].copy_from_slice(&column[..count]);
                }
            }
            write(batch, &columns);
        }
        Ok(())
    }
}

struct Driving<'a, 'b, const N: usize> {
    gather: &'a Gather<'a, N>,
    first: usize,
    out: &'b mut [f64],
}

impl<const N: usize> WithSimd for Driving<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let Self { gather, mut first, out } = self;
        let points = gather.space.rule.points.len();
        let mut buffers = Buffers::<SimdF64<S>>::new(simd);
        for out in out.chunks_mut(SimdF64::<S>::COUNT * points) {
            let count = out.len() / points;
            let mut energies = [SimdF64::<S>::splat(simd, 0.0); MOST_POINTS];
            let tets = gather.rows(first, count);
            let elements = gather.elements(simd, tets, &mut buffers);
            check(elements.driving_energies(&mut energies))?;
            for q in 0..points {
                let mut column = [0.0; POINTS];
                energies[q].store(&mut column);
                for (out, &place) in out.chunks_exact_mut(points).zip(&gather.places) {
                    out[q] = column[place];
                }
            }
            first += count;
        }
        Ok(())
    }
}
