//! The values of several elements, a lane for each, and what follows from them at a point.

use faer::traits::pulp::Simd;

use super::Batched;
use crate::material::{
    CrackDensity, Inverted, Many, POINTS, PrincipalMany, REGISTERS, ResponseMany,
};
use crate::operator::element::MOST_POINTS;
use crate::operator::lanes::{Real, Rows};

/// The values of as many elements as there are lanes.
pub(super) struct Elements<'a, S: Simd, const N: usize> {
    pub(super) simd: S,
    pub(super) batched: &'a Batched<'a, N>,
    /// The element of each lane.
    pub(super) tets: [usize; POINTS],
    pub(super) displacement: [[Many<S>; 3]; N],
    pub(super) damage: [Many<S>; N],
    pub(super) before: [Many<S>; N],
    pub(super) volume: Many<S>,
    pub(super) moduli: [Many<S>; 2],
    /// 1 − η.
    pub(super) soft: Many<S>,
    pub(super) local: Many<S>,
    pub(super) gradient: Many<S>,
    pub(super) viscous: Many<S>,
}

/// Shape gradients and state at an elastic point of each element.
pub(super) struct At<S: Simd, const N: usize> {
    /// Volume that the point stands for.
    pub(super) weight: Many<S>,
    pub(super) shape: [[Many<S>; 3]; N],
    pub(super) principal: PrincipalMany<S>,
    pub(super) response: ResponseMany<S>,
}

impl<'a, S: Simd, const N: usize> Elements<'a, S, N> {
    #[inline(always)]
    pub(super) fn gather(simd: S, batched: &'a Batched<'a, N>, tets: [usize; POINTS]) -> Self {
        let zero = Many::splat(simd, 0.0);
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
    pub(super) fn constant(&self, x: f64) -> Many<S> {
        Many::splat(self.simd, x)
    }

    /// Elastic point q, with damage `phi` at the damage points.
    #[inline(always)]
    pub(super) fn at(&self, q: usize, phi: &[Many<S>; MOST_POINTS]) -> Result<At<S, N>, Inverted> {
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
        let principal = PrincipalMany::new(&h)?;
        let g = self.stiffness_at(q, phi);
        let response = self.batched.form.respond(self.moduli, g, &principal);
        let weight = self.volume * self.constant(space.rule.points[q].weight);
        Ok(At { weight, shape, principal, response })
    }

    #[inline(always)]
    pub(super) fn interpolate(&self, field: &[Many<S>; N], shape: &[f64; N]) -> Many<S> {
        let mut sum = self.constant(0.0);
        for a in 0..N {
            sum = field[a].mul_add(self.constant(shape[a]), sum);
        }
        sum
    }

    /// φ at the damage points.
    #[inline(always)]
    pub(super) fn damage_at_points(&self) -> [Many<S>; MOST_POINTS] {
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
    pub(super) fn softening(&self, phi: Many<S>) -> Many<S> {
        self.soft * (phi + phi - self.constant(2.0))
    }

    /// Adds to the damage points what drives damage at elastic point q: ψ⁺, or the largest value
    /// that it has had.
    #[inline(always)]
    pub(super) fn add_driving(&self, q: usize, at: &At<S, N>, to: &mut [Many<S>; MOST_POINTS]) {
        let history = self.batched.increment.span.history;
        let rule = &self.batched.space.rule;
        let mut energy = at.response.driving;
        if !history.is_empty() {
            let points = rule.points.len();
            let mut so_far = [0.0; POINTS];
            for lane in 0..Many::<S>::COUNT {
                so_far[lane] = history[self.tets[lane] * points + q];
            }
            energy = energy.max(Many::load(self.simd, &so_far));
        }
        let energy = at.weight * energy;
        for (to, &c) in to.iter_mut().zip(&rule.mixing[q]) {
            *to = energy.mul_add(self.constant(c), *to);
        }
    }

    /// g″ Σ w ψ⁺ + w (Gc/(c₀ ℓ₀) α″ + ξ/Δt) at a damage point.
    #[inline(always)]
    pub(super) fn local_tangent(&self, weight: f64, phi: Many<S>, driving: Many<S>) -> Many<S> {
        let [.., curvature] = self.density(phi);
        let stiffness = self.local.mul_add(curvature, self.viscous);
        let weight = self.volume * self.constant(weight);
        (self.soft + self.soft).mul_add(driving, weight * stiffness)
    }

    /// α, α′ and α″.
    #[inline(always)]
    pub(super) fn density(&self, phi: Many<S>) -> [Many<S>; 3] {
        match self.batched.density {
            CrackDensity::At2 => [phi * phi, phi + phi, self.constant(2.0)],
            CrackDensity::At1 => [phi, self.constant(1.0), self.constant(0.0)],
        }
    }
}

/// Writes four numbers of each element as rows, in the order of the elements.
#[inline(always)]
pub(super) fn store_rows<S: Simd>(simd: S, columns: &[Many<S>; 4], rows: &mut Rows<f64>) {
    for r in 0..REGISTERS {
        let mut registers = [columns[0].registers[r]; 4];
        for c in 1..4 {
            registers[c] = columns[c].registers[r];
        }
        f64::rows(simd, registers, rows, r);
    }
}
