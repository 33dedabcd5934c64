//! Several elements at once: residual and tangent blocks of Hencky solids.
//!
//! The formulas are those of [`super::element`], with a lane for each element. A region without
//! damage is one whose damage neither softens nor costs anything: η = 1 and no toughness.

#[cfg(test)]
mod tests;

use faer::traits::pulp::{Simd, WithSimd};

use super::element::{Block, ElementResidual, MOST_POINTS};
use super::lanes::{LANES, Real, Rows, dispatch, places};
use super::residual::Increment;
use crate::element::Space;
use crate::material::{
    CrackDensity, HenckyForm, Inverted, Many, POINTS, PointMaterial, PrincipalMany, REGISTERS, dot,
};

/// What the elements of a mesh have in common in an increment.
pub(super) struct Batched<'a, const N: usize> {
    space: &'a Space<N>,
    increment: &'a Increment<'a>,
    form: HenckyForm,
    density: CrackDensity,
    /// By region.
    constants: Vec<Constants>,
    places: [usize; LANES],
}

/// κ, μ, η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀ and ξ/Δt of a region.
type Constants = [f64; 6];

impl<'a, const N: usize> Batched<'a, N> {
    /// `None`: these materials are for single points.
    pub(super) fn new(space: &'a Space<N>, increment: &'a Increment<'a>) -> Option<Self> {
        let form = HenckyForm::of(increment.materials)?;
        let damaged = || increment.materials.iter().filter_map(|m| m.damage.as_ref());
        let density = damaged().next().map_or(CrackDensity::At2, |d| d.density);
        if damaged().any(|d| d.density != density) {
            return None;
        }
        let constants = |material: &PointMaterial| {
            let [volumetric, shear] = form.moduli(material);
            let [residual, local, gradient, viscosity] = match &material.damage {
                Some(d) => [d.degradation.residual, d.local, d.gradient, d.viscosity],
                None => [1.0, 0.0, 0.0, 0.0],
            };
            [volumetric, shear, residual, local, gradient, viscosity / increment.span.duration]
        };
        let constants = increment.materials.iter().map(constants).collect();
        Some(Self { space, increment, form, density, constants, places: places::<f64>() })
    }

    /// The residuals of the elements from `first` on.
    pub(super) fn residuals(
        &self,
        first: usize,
        out: &mut [ElementResidual<N>],
    ) -> Result<(), Inverted> {
        dispatch(Residuals { batched: self, first, out })
    }

    /// The tangents of the elements from `first` on.
    pub(super) fn tangents(
        &self,
        first: usize,
        coupled: bool,
        out: &mut [[[Block; N]; N]],
    ) -> Result<(), Inverted> {
        dispatch(Tangents { batched: self, first, coupled, out })
    }
}

struct Residuals<'a, 'b, const N: usize> {
    batched: &'a Batched<'a, N>,
    first: usize,
    out: &'b mut [ElementResidual<N>],
}

impl<const N: usize> WithSimd for Residuals<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut first = self.first;
        for out in self.out.chunks_mut(Many::<S>::COUNT) {
            Elements::gather(simd, self.batched, first, out.len()).residual(out)?;
            first += out.len();
        }
        Ok(())
    }
}

struct Tangents<'a, 'b, const N: usize> {
    batched: &'a Batched<'a, N>,
    first: usize,
    coupled: bool,
    out: &'b mut [[[Block; N]; N]],
}

impl<const N: usize> WithSimd for Tangents<'_, '_, N> {
    type Output = Result<(), Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let mut first = self.first;
        for out in self.out.chunks_mut(Many::<S>::COUNT) {
            Elements::gather(simd, self.batched, first, out.len()).tangent(self.coupled, out)?;
            first += out.len();
        }
        Ok(())
    }
}

/// The values of as many elements as there are lanes.
struct Elements<'a, S: Simd, const N: usize> {
    simd: S,
    batched: &'a Batched<'a, N>,
    /// The element of each lane; lanes without one have the last one again.
    tets: [usize; POINTS],
    displacement: [[Many<S>; 3]; N],
    damage: [Many<S>; N],
    before: [Many<S>; N],
    volume: Many<S>,
    moduli: [Many<S>; 2],
    /// 1 − η.
    soft: Many<S>,
    local: Many<S>,
    gradient: Many<S>,
    viscous: Many<S>,
}

/// Shape gradients and state at an elastic point of each element.
struct At<S: Simd, const N: usize> {
    shape: [[Many<S>; 3]; N],
    principal: PrincipalMany<S>,
}

impl<'a, S: Simd, const N: usize> Elements<'a, S, N> {
    #[inline(always)]
    fn gather(simd: S, batched: &'a Batched<'a, N>, first: usize, count: usize) -> Self {
        let zero = Many::splat(simd, 0.0);
        let mut tets = [first; POINTS];
        for lane in 0..POINTS {
            tets[batched.places[lane]] = first + lane.min(count - 1);
        }
        let (fields, span) = (batched.increment.fields, &batched.increment.span);
        let (mut displacement, mut damage, mut before) = ([[zero; 3]; N], [zero; N], [zero; N]);
        for a in 0..N {
            let mut columns = [[0.0; POINTS]; 5];
            for lane in 0..Many::<S>::COUNT {
                let node = batched.space.tets[tets[lane]][a] as usize;
                let u = &fields.displacement[node];
                for k in 0..3 {
                    columns[k][lane] = u[k];
                }
                columns[3][lane] = fields.damage[node];
                columns[4][lane] = span.damage_before[node];
            }
            for k in 0..3 {
                displacement[a][k] = Many::load(simd, &columns[k]);
            }
            damage[a] = Many::load(simd, &columns[3]);
            before[a] = Many::load(simd, &columns[4]);
        }
        let mut columns = [[0.0; POINTS]; 7];
        for lane in 0..Many::<S>::COUNT {
            let region = usize::from(batched.space.region[tets[lane]]);
            columns[6][lane] = batched.space.volume[tets[lane]];
            for k in 0..6 {
                columns[k][lane] = batched.constants[region][k];
            }
        }
        Self {
            simd,
            batched,
            tets,
            displacement,
            damage,
            before,
            volume: Many::load(simd, &columns[6]),
            moduli: [Many::load(simd, &columns[0]), Many::load(simd, &columns[1])],
            soft: Many::splat(simd, 1.0) - Many::load(simd, &columns[2]),
            local: Many::load(simd, &columns[3]),
            gradient: Many::load(simd, &columns[4]),
            viscous: Many::load(simd, &columns[5]),
        }
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> Many<S> {
        Many::splat(self.simd, x)
    }

    #[inline(always)]
    fn at(&self, q: usize) -> Result<At<S, N>, Inverted> {
        let space = self.batched.space;
        let points = space.rule.points.len();
        let zero = self.constant(0.0);
        let mut columns = [[[0.0; POINTS]; 3]; N];
        for lane in 0..Many::<S>::COUNT {
            let gradients = &space.gradients[self.tets[lane] * points + q];
            for a in 0..N {
                for k in 0..3 {
                    columns[a][k][lane] = gradients[a][k];
                }
            }
        }
        let mut shape = [[zero; 3]; N];
        let mut h = [[zero; 3]; 3];
        for a in 0..N {
            for k in 0..3 {
                shape[a][k] = Many::load(self.simd, &columns[a][k]);
                for i in 0..3 {
                    h[i][k] = self.displacement[a][i].mul_add(shape[a][k], h[i][k]);
                }
            }
        }
        Ok(At { shape, principal: PrincipalMany::new(&h)? })
    }

    #[inline(always)]
    fn interpolate(&self, field: &[Many<S>; N], shape: &[f64; N]) -> Many<S> {
        let mut sum = self.constant(0.0);
        for a in 0..N {
            sum = field[a].mul_add(self.constant(shape[a]), sum);
        }
        sum
    }

    /// φ at the damage points.
    #[inline(always)]
    fn damage_at_points(&self) -> [Many<S>; MOST_POINTS] {
        let mut phi = [self.constant(0.0); MOST_POINTS];
        for (phi, point) in phi.iter_mut().zip(&self.batched.space.rule.damage) {
            *phi = self.interpolate(&self.damage, &point.shape);
        }
        phi
    }

    /// g_q = Σ_p C_qp g(φ_p), one where nothing can be damaged.
    #[inline(always)]
    fn stiffness_at(&self, q: usize, phi: &[Many<S>; MOST_POINTS]) -> Many<S> {
        let one = self.constant(1.0);
        let row = &self.batched.space.rule.mixing[q];
        if row.is_empty() {
            return one;
        }
        let mut sum = self.constant(0.0);
        for (&c, &phi) in row.iter().zip(phi) {
            // 1 − g = (1 − η)(1 − (1 − φ)²)
            let sound = one - phi;
            let g = self.soft.mul_add(sound * sound, one - self.soft);
            sum = self.constant(c).mul_add(g, sum);
        }
        sum
    }

    /// g′(φ).
    #[inline(always)]
    fn softening(&self, phi: Many<S>) -> Many<S> {
        self.soft * (phi + phi - self.constant(2.0))
    }

    /// What drives damage at elastic point q: ψ⁺, or the largest value that it has had.
    #[inline(always)]
    fn driving_energy(&self, q: usize, now: Many<S>) -> Many<S> {
        let history = self.batched.increment.span.history;
        if history.is_empty() {
            return now;
        }
        let points = self.batched.space.rule.points.len();
        let mut so_far = [0.0; POINTS];
        for lane in 0..Many::<S>::COUNT {
            so_far[lane] = history[self.tets[lane] * points + q];
        }
        now.max(Many::load(self.simd, &so_far))
    }

    #[inline(always)]
    fn residual(&self, out: &mut [ElementResidual<N>]) -> Result<(), Inverted> {
        let zero = self.constant(0.0);
        let rule = &self.batched.space.rule;
        let (mut nodal, mut drive) = ([[zero; 4]; N], [zero; N]);
        let [mut elastic, mut fracture, mut viscous] = [zero; 3];
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        for (q, point) in rule.points.iter().enumerate() {
            let At { shape, principal } = self.at(q)?;
            let weight = self.volume * self.constant(point.weight);
            let g = self.stiffness_at(q, &phi);
            let response = self.batched.form.respond(self.moduli, g, &principal);
            elastic = weight.mul_add(response.energy, elastic);
            let piola = principal.piola(&response.stress, weight);
            for a in 0..N {
                for i in 0..3 {
                    nodal[a][i] += dot(&piola[i], &shape[a]);
                }
            }
            if rule.damage.is_empty() {
                continue;
            }
            let seen = weight * self.driving_energy(q, response.driving);
            for (driving, &c) in driving.iter_mut().zip(&rule.mixing[q]) {
                *driving = seen.mul_add(self.constant(c), *driving);
            }
            let mut slope = [zero; 3];
            for a in 0..N {
                for k in 0..3 {
                    slope[k] = self.damage[a].mul_add(shape[a][k], slope[k]);
                }
            }
            let stiffness = weight * self.gradient;
            fracture = stiffness.mul_add(dot(&slope, &slope), fracture);
            for a in 0..N {
                nodal[a][3] = (stiffness + stiffness).mul_add(dot(&slope, &shape[a]), nodal[a][3]);
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let weight = self.volume * self.constant(point.weight);
            let [alpha, slope, _] = self.density(phi[p]);
            let growth = phi[p] - self.interpolate(&self.before, &point.shape);
            let rate = self.viscous * growth;
            fracture = (weight * self.local).mul_add(alpha, fracture);
            viscous = (weight * rate).mul_add(growth, viscous);
            let force = self.softening(phi[p]) * driving[p];
            let local = weight.mul_add(self.local.mul_add(slope, rate), force);
            for a in 0..N {
                if point.shape[a] != 0.0 {
                    let shape = self.constant(point.shape[a]);
                    nodal[a][3] = shape.mul_add(local, nodal[a][3]);
                    drive[a] = shape.mul_add(force, drive[a]);
                }
            }
        }
        let mut rows = Rows([[0.0; 4]; LANES]);
        for a in 0..N {
            store_rows(self.simd, &nodal[a], &mut rows);
            for (out, row) in out.iter_mut().zip(&rows.0) {
                out.nodal[a] = *row;
            }
        }
        let places = &self.batched.places;
        let mut column = [0.0; POINTS];
        let mut scalars = |x: Many<S>, write: &dyn Fn(&mut ElementResidual<N>, f64)| {
            x.store(&mut column);
            for (out, &place) in out.iter_mut().zip(places) {
                write(out, column[place]);
            }
        };
        for a in 0..N {
            scalars(drive[a], &|out, x| out.drive[a] = x);
        }
        scalars(elastic, &|out, x| out.elastic = x);
        scalars(fracture, &|out, x| out.fracture = x);
        scalars(viscous, &|out, x| out.viscous = x);
        Ok(())
    }

    /// α, α′ and α″.
    #[inline(always)]
    fn density(&self, phi: Many<S>) -> [Many<S>; 3] {
        match self.batched.density {
            CrackDensity::At2 => [phi * phi, phi + phi, self.constant(2.0)],
            CrackDensity::At1 => [phi, self.constant(1.0), self.constant(0.0)],
        }
    }

    #[inline(always)]
    fn tangent(&self, coupled: bool, out: &mut [[[Block; N]; N]]) -> Result<(), Inverted> {
        let zero = self.constant(0.0);
        let rule = &self.batched.space.rule;
        let mut blocks = [[[[zero; 4]; 4]; N]; N];
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        for (q, point) in rule.points.iter().enumerate() {
            let At { shape, principal } = self.at(q)?;
            let weight = self.volume * self.constant(point.weight);
            let g = self.stiffness_at(q, &phi);
            let response = self.batched.form.respond(self.moduli, g, &principal);
            let tangent = response.tangent(weight);
            let mut spatial = [[zero; 3]; N];
            for a in 0..N {
                for i in 0..3 {
                    spatial[a][i] = dot(&principal.push[i], &shape[a]);
                }
            }
            // the shape functions add up to one: node 0 follows from the others
            for a in 1..N {
                for b in 1..=a {
                    let block = tangent.block(&principal.basis, &spatial[a], &spatial[b]);
                    for i in 0..3 {
                        for j in 0..3 {
                            blocks[a][b][i][j] += block[i][j];
                        }
                    }
                }
            }
            if rule.damage.is_empty() {
                continue;
            }
            let row = &rule.mixing[q];
            let seen = weight * self.driving_energy(q, response.driving);
            for (driving, &c) in driving.iter_mut().zip(row) {
                *driving = seen.mul_add(self.constant(c), *driving);
            }
            let stiffness = weight * (self.gradient + self.gradient);
            for a in 0..N {
                for b in 0..=a {
                    let product = dot(&shape[a], &shape[b]);
                    blocks[a][b][3][3] = stiffness.mul_add(product, blocks[a][b][3][3]);
                }
            }
            if !coupled {
                continue;
            }
            let piola = principal.piola(&response.stress_plus, weight);
            let (mut forces, mut soft) = ([[zero; 3]; N], [zero; N]);
            for ((point, &c), &phi) in rule.damage.iter().zip(row).zip(&phi) {
                let slope = self.constant(c) * self.softening(phi);
                for a in 0..N {
                    soft[a] = slope.mul_add(self.constant(point.shape[a]), soft[a]);
                }
            }
            for a in 0..N {
                for i in 0..3 {
                    forces[a][i] = dot(&piola[i], &shape[a]);
                }
            }
            for a in 0..N {
                for b in 0..=a {
                    let block = &mut blocks[a][b];
                    for i in 0..3 {
                        block[i][3] = forces[a][i].mul_add(soft[b], block[i][3]);
                        block[3][i] = forces[b][i].mul_add(soft[a], block[3][i]);
                    }
                }
            }
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let [.., curvature] = self.density(phi[p]);
            let weight = self.volume * self.constant(point.weight);
            let stiffness = weight * self.local.mul_add(curvature, self.viscous);
            let local = (self.soft + self.soft).mul_add(driving[p], stiffness);
            for a in 0..N {
                for b in 0..=a {
                    let product = point.shape[a] * point.shape[b];
                    if product != 0.0 {
                        let block = &mut blocks[a][b][3][3];
                        *block = self.constant(product).mul_add(local, *block);
                    }
                }
            }
        }
        for a in 1..N {
            for b in 1..N {
                for i in 0..3 {
                    for j in 0..3 {
                        let block = if b <= a { blocks[a][b][i][j] } else { blocks[b][a][j][i] };
                        blocks[a][0][i][j] = blocks[a][0][i][j] - block;
                    }
                }
            }
        }
        for a in 1..N {
            for i in 0..3 {
                for j in 0..3 {
                    blocks[0][0][i][j] = blocks[0][0][i][j] - blocks[a][0][i][j];
                }
            }
        }
        let mut rows = Rows([[0.0; 4]; LANES]);
        for a in 0..N {
            for b in 0..=a {
                for i in 0..4 {
                    store_rows(self.simd, &blocks[a][b][i], &mut rows);
                    for (out, row) in out.iter_mut().zip(&rows.0) {
                        out[a][b][i] = *row;
                    }
                }
            }
        }
        Ok(())
    }
}

/// Writes four numbers of each element as rows, in the order of the elements.
#[inline(always)]
fn store_rows<S: Simd>(simd: S, columns: &[Many<S>; 4], rows: &mut Rows<f64>) {
    for r in 0..REGISTERS {
        let mut registers = [columns[0].registers[r]; 4];
        for c in 1..4 {
            registers[c] = columns[c].registers[r];
        }
        f64::rows(simd, registers, rows, r);
    }
}
