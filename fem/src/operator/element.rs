//! The equations of an element: residual and linearisation. They are generic over the number type: single
//! numbers, SIMD lanes of several elements, and dual numbers.
//!
//! Both work in the element's barycentric coordinates. With U_k = ∂u/∂λ_k − ∂u/∂λ₀ (k = 1 … 3) the
//! displacement gradient is H = Σ_k U_k ⊗ ∇λ_k for linear and quadratic elements. A force conjugate to U_k is
//! distributed to node a with the weight ∂U_k/∂u_a. In a curved element ∇λ_k varies between the points. A
//! region without damage has η = 1 and zero toughness. In a mixture only the matrix is damaged, so that the
//! energy is not linear in g.
//!
//! A new term of the energy must be added to `residual` and `linearise` here and to `rates.rs`. If it adds
//! point data of an elastic point, it must also be added to `point_data.rs`.

use super::point_data::{self, PointData};
use crate::element::{Geometry, Rule};
use crate::material::{
    CrackDensity, Degradation, PointLaw, PointTangent, Principal, Response, Scalar, dot, packed,
};

/// Largest number of elastic points or of damage points of any rule.
pub const MOST_POINTS: usize = 14;

/// The state of an element, or of one element per SIMD lane.
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
    /// Whether the elements of all lanes are straight and none is a mixture.
    pub plain: bool,
    /// Largest previous ψ⁺ by elastic point. `None` if damage is driven by the current ψ⁺.
    pub history: Option<&'a [T; MOST_POINTS]>,
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

/// Contributions of an element to residual and energies.
#[derive(Clone, Copy, Debug)]
pub struct ElementResidual<T, const N: usize> {
    /// R_u (N) and R_φ (N mm) of the element's nodes.
    pub nodal: [[T; 4]; N],
    /// The part ∫ g′ ψ⁺ N_a dV of R_φ.
    pub drive: [T; N],
    /// Elastic and crack energy, and viscous dissipation, N mm.
    pub energies: [T; 3],
    /// 1, or 0 if the element is inverted.
    pub sound: T,
}

/// Strains and stresses at an elastic point.
pub(super) struct At<T> {
    /// Volume of the point.
    pub(super) weight: T,
    pub(super) principal: Principal<T>,
    pub(super) response: Response<T>,
}

impl<T: Scalar, L: PointLaw<T>, const N: usize> ElementState<'_, T, L, N> {
    #[inline(always)]
    pub(super) fn constant(&self, x: f64) -> T {
        self.constants.local.constant(x)
    }

    /// Geometry factors at elastic point q.
    #[inline(always)]
    pub(super) fn geometry(&self, q: usize) -> &Geometry<T> {
        &self.geometry[if self.geometry.len() == 1 { 0 } else { q }]
    }

    /// Volume of elastic point q.
    #[inline(always)]
    pub(super) fn weight(&self, q: usize) -> T {
        self.geometry(q).volume * self.constant(self.rule.points[q].weight)
    }

    /// Volume of damage point p: the sum of the volumes of the elastic points, weighted by the mixing matrix.
    #[inline(always)]
    pub(super) fn damage_weight(&self, p: usize) -> T {
        if self.geometry.len() == 1 {
            return self.geometry[0].volume * self.constant(self.rule.damage[p].weight);
        }
        let mut sum = self.constant(0.0);
        for q in 0..self.rule.points.len() {
            sum = self.constant(self.rule.mixing[q][p]).mul_add(self.weight(q), sum);
        }
        sum
    }

    /// ∂U_k/∂u_a at elastic point q, by node a.
    #[inline(always)]
    fn slopes(&self, q: usize) -> &[[f64; 3]; N] {
        self.rule.points[q].slopes.first_chunk().expect("a slope of each node")
    }

    #[inline(always)]
    pub(super) fn shape(&self, p: usize) -> &[f64; N] {
        self.rule.damage[p].shape.first_chunk().expect("a value of each node")
    }

    /// Strains and stresses at elastic point q, for the values `phi` of φ at the damage points.
    #[inline(always)]
    pub(super) fn at<const TANGENT: bool>(&self, q: usize, phi: &[T; MOST_POINTS]) -> At<T> {
        let principal = self.principal(q);
        let Constants { law, degradation, .. } = &self.constants;
        let g = self.stiffness_at(q, phi, degradation);
        // no law depends on the duration or has a state yet
        let response = law.respond::<TANGENT>(&principal, g, self.constant(0.0), &[], &mut []);
        At { weight: self.weight(q), principal, response }
    }

    /// Principal strains at elastic point q.
    #[inline(always)]
    pub(super) fn principal(&self, q: usize) -> Principal<T> {
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
        Principal::new(&h)
    }

    /// ∂u/∂λ_k − ∂u/∂λ₀ at elastic point q, for k = 1 … 3.
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

    /// Distributes forces that are conjugate to the differences ∂u/∂λ_k − ∂u/∂λ₀ to the nodes.
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

    /// φ at the damage points.
    #[inline(always)]
    pub(super) fn damage_at_points(&self) -> [T; MOST_POINTS] {
        let mut phi = [self.constant(0.0); MOST_POINTS];
        for p in 0..self.rule.damage.len() {
            phi[p] = self.interpolate(&self.damage, self.shape(p));
        }
        phi
    }

    /// g_q = Σ_p C_qp g(φ_p); 1 if the element cannot be damaged.
    #[inline(always)]
    pub(super) fn stiffness_at(
        &self,
        q: usize,
        phi: &[T; MOST_POINTS],
        degradation: &Degradation<T>,
    ) -> T {
        let row = &self.rule.mixing[q];
        if row.is_empty() {
            return self.constant(1.0);
        }
        let mut sum = self.constant(0.0);
        for (&c, &phi) in row.iter().zip(phi) {
            sum = self.constant(c).mul_add(degradation.value(phi), sum);
        }
        sum
    }

    /// Driving energy of damage at elastic point q: ψ⁺, or the largest ψ⁺ so far.
    #[inline(always)]
    fn driving(&self, q: usize, at: &At<T>) -> T {
        match self.history {
            Some(so_far) => at.response.driving.max(so_far[q]),
            None => at.response.driving,
        }
    }

    /// Derivative of the driving energy at elastic point q with respect to g.
    #[inline(always)]
    fn softening(&self, q: usize, at: &At<T>) -> T {
        let Some(so_far) = self.history else { return at.response.softening };
        let held = at.response.driving.less_than(so_far[q]);
        T::select(held, self.constant(0.0), at.response.softening)
    }

    /// Distributes the driving energy of elastic point q to the damage points.
    #[inline(always)]
    fn add_driving(&self, q: usize, at: &At<T>, to: &mut [T; MOST_POINTS]) {
        let energy = at.weight * self.driving(q, at);
        for (to, &c) in to.iter_mut().zip(&self.rule.mixing[q]) {
            *to = energy.mul_add(self.constant(c), *to);
        }
    }

    /// Writes the driving energy of each elastic point. Returns 1, or 0 if the element is inverted.
    #[inline(always)]
    pub fn driving_energies(&self, out: &mut [T; MOST_POINTS]) -> T {
        let phi = self.damage_at_points();
        let mut sound = self.constant(1.0);
        for q in 0..self.rule.points.len() {
            let at = self.at::<false>(q, &phi);
            sound = sound.min(at.principal.sound);
            out[q] = self.driving(q, &at);
        }
        sound
    }

    /// Residuals R_u and R_φ of the element's nodes, and energies.
    #[inline(always)]
    pub fn residual(&self) -> ElementResidual<T, N> {
        let zero = self.constant(0.0);
        let (mut nodal, mut drive) = ([[zero; 4]; N], [zero; N]);
        let [mut elastic, mut fracture, mut viscous] = [zero; 3];
        let mut sound = self.constant(1.0);
        let phi = self.damage_at_points();
        let mut driving = [zero; MOST_POINTS];
        let mut damage = [[zero]; N];
        for a in 0..N {
            damage[a] = [self.damage[a]];
        }
        for q in 0..self.rule.points.len() {
            let at = self.at::<false>(q, &phi);
            let barycentric = &self.geometry(q).barycentric;
            sound = sound.min(at.principal.sound);
            elastic = at.weight.mul_add(at.response.energy, elastic);
            let piola = at.principal.piola(&at.response.stress, at.weight);
            let mut flux = [[zero; 4]; 3];
            for k in 0..3 {
                for i in 0..3 {
                    flux[k][i] = dot(&piola[i], &barycentric[k]);
                }
            }
            let damaged = !self.rule.damage.is_empty();
            if damaged {
                self.add_driving(q, &at, &mut driving);
                let mut gradient = [zero; 3];
                let change = self.differences(q, &damage);
                for k in 0..3 {
                    for x in 0..3 {
                        gradient[x] = change[k][0].mul_add(barycentric[k][x], gradient[x]);
                    }
                }
                let stiffness = at.weight * self.constants.gradient;
                fracture = stiffness.mul_add(dot(&gradient, &gradient), fracture);
                for k in 0..3 {
                    flux[k][3] = (stiffness + stiffness) * dot(&gradient, &barycentric[k]);
                }
            }
            self.add_flux(q, &flux, if damaged { 4 } else { 3 }, &mut nodal);
        }
        for p in 0..self.rule.damage.len() {
            let shape = self.shape(p);
            let weight = self.damage_weight(p);
            let [alpha, slope, _] = self.density.local(phi[p]);
            let growth = phi[p] - self.interpolate(&self.before, shape);
            let rate = self.constants.viscous * growth;
            fracture = (weight * self.constants.local).mul_add(alpha, fracture);
            viscous = (weight * rate).mul_add(growth, viscous);
            let force = self.constants.degradation.slope(phi[p]) * driving[p];
            let local = weight.mul_add(self.constants.local.mul_add(slope, rate), force);
            for a in 0..N {
                if shape[a] != 0.0 {
                    let shape = self.constant(shape[a]);
                    nodal[a][3] = shape.mul_add(local, nodal[a][3]);
                    drive[a] = shape.mul_add(force, drive[a]);
                }
            }
        }
        ElementResidual { nodal, drive, energies: [elastic, fracture, viscous], sound }
    }

    /// Writes the point data of the element's tangent in the order of [`PointData`]. `coupled` keeps the
    /// coupling terms between u and φ. With `AXES` the principal axes are appended, and the quaternions are
    /// not written. Returns 1, or 0 if the element is inverted.
    #[inline(always)]
    pub fn linearise<const AXES: bool>(&self, coupled: bool, out: &mut [T]) -> T {
        let zero = self.constant(0.0);
        let data = PointData::of(self.rule, self.plain);
        let phi = self.damage_at_points();
        let mut sound = self.constant(1.0);
        let mut driving = [zero; MOST_POINTS];
        for q in 0..self.rule.points.len() {
            let at = self.at::<true>(q, &phi);
            let barycentric = &self.geometry(q).barycentric;
            sound = sound.min(at.principal.sound);
            let tangent = PointTangent::new(&at.principal, &at.response, at.weight);
            let mut push = [[zero; 3]; 3];
            for k in 0..3 {
                for i in 0..3 {
                    push[k][i] = dot(&at.principal.push[i], &barycentric[k]);
                }
            }
            if AXES {
                data.write_axes(q, &tangent.axes, out);
            }
            let point = &mut out[data.point(q)..];
            point_data::write_point::<T, AXES>(&tangent, &push, point);
            if self.rule.damage.is_empty() {
                continue;
            }
            self.add_driving(q, &at, &mut driving);
            for i in 0..3 {
                let source = if coupled { at.weight * at.response.stress_plus[i] } else { zero };
                point[point_data::SOURCE + i] = source;
            }
            if !self.plain {
                point[point_data::SOFTENING] = at.weight * self.softening(q, &at);
            }
            // a straight element stores the gradient term once, other elements store it per point
            if !self.plain || q == 0 {
                let volume = if self.plain { self.geometry[0].volume } else { at.weight };
                let stiffness = volume * (self.constants.gradient + self.constants.gradient);
                for k in 0..3 {
                    for l in 0..=k {
                        let product = dot(&barycentric[k], &barycentric[l]);
                        out[data.gradient(q) + packed(k, l)] = stiffness * product;
                    }
                }
            }
        }
        for p in 0..self.rule.damage.len() {
            out[p] = self.constants.degradation.slope(phi[p]);
            // g″ Σ w ψ⁺ + w (Gc/(c₀ ℓ₀) α″ + ξ/Δt); `data.local` is the same entry for all points if they are
            // alike
            let [.., curvature] = self.density.local(phi[p]);
            let stiffness = self.constants.local.mul_add(curvature, self.constants.viscous);
            let weight = self.damage_weight(p);
            let curvature = self.constants.degradation.curvature(phi[p]);
            let local = curvature.mul_add(driving[p], weight * stiffness);
            out[data.local(p)] = local;
        }
        sound
    }
}
