//! State of an element, and strains and stresses at its points.

use crate::element::{Geometry, Rule};
use crate::material::{AtPoint, CrackDensity, Degradation, PointLaw, Principal, Response, Scalar};

/// Largest number of elastic points or of damage points of any quadrature rule.
pub const MOST_POINTS: usize = 14;

/// State of an element, or of one element per SIMD lane.
#[derive(Clone, Copy, Debug)]
pub struct ElementState<'a, T, L, const N: usize> {
    pub rule: &'a Rule,
    pub constants: Constants<'a, T, L>,
    pub density: CrackDensity,
    /// Nodal displacement u, mm.
    pub displacement: [[T; 3]; N],
    /// Nodal damage φ.
    pub damage: [T; N],
    /// Nodal damage φ at the start of the increment.
    pub before: [T; N],
    /// Geometry factors by elastic point; a straight element has a single entry.
    pub geometry: &'a [Geometry<T>],
    /// Whether the elements of all SIMD lanes are straight, none is a mixture, and no law adds
    /// viscoelastic or plastic terms to the tangent.
    pub plain: bool,
    /// State of the law at the start of the increment, by elastic point.
    pub state: &'a [T],
    /// Duration of the increment, s.
    pub duration: T,
}

/// Material constants of an element.
#[derive(Clone, Copy, Debug)]
pub struct Constants<'a, T, L> {
    pub law: L,
    pub degradation: Degradation<'a, T>,
    /// Coefficient of the local crack density: Gc/(c₀ ℓ₀), MPa.
    pub local: T,
    /// Coefficient of the gradient of the crack density: Gc ℓ₀/c₀, N.
    pub gradient: T,
    /// Coefficient of the viscous term: ξ/Δt, MPa.
    pub viscous: T,
}

/// Deformation and response at an elastic point.
#[derive(Clone, Copy, Debug)]
pub(crate) struct PointState<T> {
    /// Volume that the point represents in integrals, mm³.
    pub weight: T,
    pub principal: Principal<T>,
    pub response: Response<T>,
}

impl<T: Scalar, L: PointLaw<T>, const N: usize> ElementState<'_, T, L, N> {
    #[inline(always)]
    pub(super) fn constant(&self, x: f64) -> T {
        self.constants.local.constant(x)
    }

    /// Returns the geometry factors at elastic point q.
    #[inline(always)]
    pub(super) fn geometry(&self, q: usize) -> &Geometry<T> {
        &self.geometry[if self.geometry.len() == 1 { 0 } else { q }]
    }

    /// Returns the volume that elastic point q represents in integrals, mm³.
    #[inline(always)]
    pub(super) fn weight(&self, q: usize) -> T {
        self.geometry(q).volume * self.constant(self.rule.elastic_points[q].weight)
    }

    /// Returns the volume that damage point p represents in integrals, mm³: the sum of the volumes of the elastic
    /// points, weighted by the coefficients C_qp.
    #[inline(always)]
    pub(super) fn damage_weight(&self, p: usize) -> T {
        if self.geometry.len() == 1 {
            return self.geometry[0].volume * self.constant(self.rule.damage[p].weight);
        }
        let mut sum = self.constant(0.0);
        for q in 0..self.rule.elastic_points.len() {
            sum = self.constant(self.rule.mixing[q][p]).mul_add(self.weight(q), sum);
        }
        sum
    }

    /// Returns ∂U_k/∂u_a at elastic point q; row a, column k.
    #[inline(always)]
    pub(super) fn slopes(&self, q: usize) -> &[[f64; 3]; N] {
        self.rule.elastic_points[q].slopes.first_chunk().expect("a slope of each node")
    }

    #[inline(always)]
    pub(super) fn shape(&self, p: usize) -> &[f64; N] {
        self.rule.damage[p].shape.first_chunk().expect("a value of each node")
    }

    /// Computes strains and stresses at elastic point q, for g and its derivatives at the damage points. Writes the state
    /// of the point at the end of the increment to the beginning of `state`.
    #[inline(always)]
    pub(super) fn at<const TANGENT: bool>(
        &self,
        q: usize,
        degradation: &[[T; 3]; MOST_POINTS],
        state: &mut [T],
    ) -> PointState<T> {
        let h = self.displacement_gradient(q);
        let law = &self.constants.law;
        let g = self.degradation_at(q, degradation);
        let len = law.state_len();
        let (old, new) = (&self.state[q * len..][..len], &mut state[..len]);
        let at = AtPoint::<_, _, TANGENT> { law, h: &h, g, dt: self.duration, old, new };
        let (principal, response) = g.vectorize(at);
        PointState { weight: self.weight(q), principal, response }
    }

    /// Returns the displacement gradient H = ∂u/∂X at elastic point q.
    #[inline(always)]
    pub(super) fn displacement_gradient(&self, q: usize) -> [[T; 3]; 3] {
        let du = self.differences(q, &self.displacement);
        let barycentric = &self.geometry(q).barycentric;
        let mut h = [[self.constant(0.0); 3]; 3];
        for k in 0..3 {
            for i in 0..3 {
                for j in 0..3 {
                    h[i][j] = du[k][i].mul_add(barycentric[k][j], h[i][j]);
                }
            }
        }
        h
    }

    /// Returns the differences U_k = ∂u/∂λ_k − ∂u/∂λ₀ at elastic point q, for k = 1 … 3.
    #[inline(always)]
    pub(super) fn differences<const C: usize>(&self, q: usize, u: &[[T; C]; N]) -> [[T; C]; 3] {
        let slopes = self.slopes(q);
        let mut du = [[self.constant(0.0); C]; 3];
        for k in 0..3 {
            for c in 0..C {
                if N == 4 {
                    du[k][c] = u[k + 1][c] - u[0][c];
                    continue;
                }
                for a in 0..N {
                    du[k][c] = u[a][c].mul_add(self.constant(slopes[a][k]), du[k][c]);
                }
            }
        }
        du
    }

    /// Distributes the forces `flux` to the nodes; `flux[k]` is conjugate to the difference U_k = ∂u/∂λ_k − ∂u/∂λ₀ of
    /// the nodal values.
    #[inline(always)]
    pub(super) fn add_flux(
        &self,
        q: usize,
        flux: &[[T; 4]; 3],
        fields: usize,
        nodal: &mut [[T; 4]; N],
    ) {
        let slopes = self.slopes(q);
        for c in 0..fields {
            for k in 0..3 {
                if N == 4 {
                    nodal[k + 1][c] += flux[k][c];
                    nodal[0][c] = nodal[0][c] - flux[k][c];
                    continue;
                }
                for a in 0..N {
                    let slope = self.constant(slopes[a][k]);
                    nodal[a][c] = slope.mul_add(flux[k][c], nodal[a][c]);
                }
            }
        }
    }

    #[inline(always)]
    pub(super) fn interpolate(&self, field: &[T; N], shape: &[f64; N]) -> T {
        let mut sum = self.constant(0.0);
        for a in 0..N {
            sum = field[a].mul_add(self.constant(shape[a]), sum);
        }
        sum
    }

    /// Returns φ at the damage points.
    #[inline(always)]
    pub(super) fn damage_at_points(&self) -> [T; MOST_POINTS] {
        let mut phi = [self.constant(0.0); MOST_POINTS];
        for p in 0..self.rule.damage.len() {
            phi[p] = self.interpolate(&self.damage, self.shape(p));
        }
        phi
    }

    /// Returns g, g′ and g″ at the damage points, for the values `phi` of φ.
    #[inline(always)]
    pub(super) fn degradation_at_points(&self, phi: &[T; MOST_POINTS]) -> [[T; 3]; MOST_POINTS] {
        let mut degradation = [[self.constant(0.0); 3]; MOST_POINTS];
        for p in 0..self.rule.damage.len() {
            degradation[p] = self.constants.degradation.derivatives(phi[p]);
        }
        degradation
    }

    /// Returns the degradation g_q = Σ_p C_qp g(φ_p) of elastic point q; 1 if no region can be damaged.
    #[inline(always)]
    pub(super) fn degradation_at(&self, q: usize, degradation: &[[T; 3]; MOST_POINTS]) -> T {
        let row = &self.rule.mixing[q];
        if row.is_empty() {
            return self.constant(1.0);
        }
        let mut sum = self.constant(0.0);
        for (&c, &[value, ..]) in row.iter().zip(degradation) {
            sum = self.constant(c).mul_add(value, sum);
        }
        sum
    }

    /// Distributes the driving energy of elastic point q to the damage points.
    #[inline(always)]
    pub(super) fn add_driving(&self, q: usize, at: &PointState<T>, to: &mut [T; MOST_POINTS]) {
        let energy = at.weight * at.response.driving;
        for (to, &c) in to.iter_mut().zip(&self.rule.mixing[q]) {
            *to = energy.mul_add(self.constant(c), *to);
        }
    }

    /// Writes the state of the laws at the end of the increment, by elastic point. Returns 1, or 0 if the element is
    /// inverted.
    #[inline(always)]
    pub fn update(&self, state: &mut [T]) -> T {
        let degradation = self.degradation_at_points(&self.damage_at_points());
        let mut sound = self.constant(1.0);
        let len = self.constants.law.state_len();
        for q in 0..self.rule.elastic_points.len() {
            let at = self.at::<false>(q, &degradation, &mut state[q * len..][..len]);
            sound = sound.min(at.principal.sound);
        }
        sound
    }
}
