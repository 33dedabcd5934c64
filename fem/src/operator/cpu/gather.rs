//! Transfer of element values into SIMD lanes, and of results from lanes to elements.

use faer::traits::pulp::Simd;

use super::lanes::{Rows, Stored, lane_of_row};
use super::regions::{ElementLaw, Regions};
use crate::element::{Geometry, Space};
use crate::material::{CrackDensity, Homogenisation, Inverted, Lanes, POINTS, REGISTERS, SimdF64};
use crate::operator::increment::Increment;
use crate::operator::kernel::ElementState;
use crate::operator::layout::LANES;

/// Data of an increment from which the state of elements is gathered.
pub struct Gather<'a, const N: usize> {
    space: &'a Space<N>,
    increment: &'a Increment<'a>,
    density: CrackDensity,
    regions: Regions,
    /// Lane of each row of a batch.
    pub lane_of_row: [usize; LANES],
}

/// Storage for the values that an [`ElementState`] borrows.
pub struct Buffers<T> {
    /// Geometry of the elements if all elements are straight. It is the same at all elastic points.
    straight: [Geometry<T>; 1],
    /// Geometry of the elements at each elastic point, if at least one element is curved.
    curved: Vec<Geometry<T>>,
    /// State of the law at each elastic point at the start of the increment.
    state: Vec<T>,
}

impl<T: Lanes> Buffers<T> {
    #[inline(always)]
    pub fn new(token: T::Token) -> Self {
        let zero = T::load(token, &[0.0; POINTS]);
        let straight = [Geometry { barycentric: [[zero; 3]; 3], volume: zero }];
        Self { straight, curved: Vec::new(), state: Vec::new() }
    }
}

impl<'a, const N: usize> Gather<'a, N> {
    pub fn new(
        space: &'a Space<N>,
        homogenisation: Homogenisation,
        increment: &'a Increment<'a>,
    ) -> Self {
        let Increment { materials, context, .. } = increment;
        // all regions with damage have the same crack density
        let damage = materials.iter().find_map(|m| m.damage.as_ref());
        Self {
            space,
            increment,
            density: damage.map_or(CrackDensity::At2, |d| d.density),
            regions: Regions::new(materials, homogenisation, context.duration, context.damping),
            lane_of_row: lane_of_row::<f64>(),
        }
    }

    /// Gathers the state of the elements `tets`, one element per SIMD lane.
    #[inline(always)]
    pub fn elements<'b, T: Lanes>(
        &'b self,
        token: T::Token,
        tets: [usize; POINTS],
        buffers: &'b mut Buffers<T>,
    ) -> ElementState<'b, T, ElementLaw<'b, T>, N>
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
        let (constants, mixed) = self.regions.constants(token, space, &tets);
        let mut curved = false;
        for lane in 0..T::COUNT {
            curved |= space.is_curved(tets[lane]);
        }
        self.fill_geometry(token, tets, curved, buffers);
        self.fill_state(token, tets, &mut buffers.state);
        ElementState {
            rule: &space.rule,
            constants,
            density: self.density,
            displacement,
            damage,
            before,
            geometry: if curved { &buffers.curved[..] } else { &buffers.straight[..] },
            plain: !curved && !mixed && !space.rule.extra.stored,
            state: &buffers.state,
            duration: zero.constant(context.duration),
        }
    }

    #[inline(always)]
    fn fill_geometry<T: Lanes>(
        &self,
        token: T::Token,
        tets: [usize; POINTS],
        curved: bool,
        buffers: &mut Buffers<T>,
    ) {
        if curved {
            let geometry_count = self.space.rule.elastic_points.len();
            buffers.curved.resize(geometry_count, buffers.straight[0]);
            for q in 0..geometry_count {
                buffers.curved[q] = self.geometry(token, tets, q);
            }
        } else {
            buffers.straight[0] = self.geometry(token, tets, 0);
        }
    }

    /// Loads the state at the start of the increment; zero if the increment has no state.
    #[inline(always)]
    fn fill_state<T: Lanes>(&self, token: T::Token, tets: [usize; POINTS], state: &mut Vec<T>) {
        let width = self.element_state_len();
        if width == 0 {
            return;
        }
        state.resize(width, T::load(token, &[0.0; POINTS]));
        let values = self.increment.context.state;
        for k in 0..width {
            let mut column = [0.0; POINTS];
            if !values.is_empty() {
                for lane in 0..T::COUNT {
                    column[lane] = values[tets[lane] * width + k];
                }
            }
            state[k] = T::load(token, &column);
        }
    }

    /// Returns the number of state values per element.
    pub fn element_state_len(&self) -> usize {
        self.regions.state_len() * self.space.rule.elastic_points.len()
    }

    /// Gathers the geometry of the elements `tets` at elastic point q.
    #[inline(always)]
    fn geometry<T: Lanes>(&self, token: T::Token, tets: [usize; POINTS], q: usize) -> Geometry<T> {
        let mut columns = [[0.0; POINTS]; 10];
        for lane in 0..T::COUNT {
            let geometries = self.space.geometry(tets[lane]);
            let Geometry { barycentric, volume } =
                &geometries[if geometries.len() == 1 { 0 } else { q }];
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
pub(crate) fn check<T: Lanes>(sound: T) -> Result<(), Inverted> {
    let mut lanes = [1.0; POINTS];
    sound.store(&mut lanes);
    if lanes == [1.0; POINTS] { Ok(()) } else { Err(Inverted) }
}

/// Converts four columns to rows. A column has one value of each element; a row has the four values
/// of one element. The rows are in the order of the elements.
#[inline(always)]
pub(crate) fn store_rows<S: Simd>(simd: S, columns: &[SimdF64<S>; 4], rows: &mut Rows<f64>) {
    for r in 0..REGISTERS {
        let mut registers = [SimdF64::<S, 1>::splat(simd, 0.0); 4];
        for c in 0..4 {
            registers[c].registers[0] = columns[c].registers[r];
        }
        f64::rows(simd, &registers, rows, r);
    }
}
