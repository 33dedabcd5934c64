//! Return mapping of plasticity in logarithmic strains, at one point or one point per SIMD lane.
//!
//! The trial strains ε_i are the elastic principal strains if the increment had no plastic flow. Let j be √J₂ of the
//! trial stress and p the mean trial stress. With the multiplier Δγ and the constants η, η̄ and ξ of
//! `YieldCriterion::cone`, plastic flow reduces j by μ Δγ and p by K η̄ Δγ, and increases the equivalent plastic strain
//! α by x = ξ Δγ. The yield condition is then an equation for x: t − k x = σ_y(α + x) with t = (j + η p)/ξ and k = (μ +
//! K η η̄)/ξ². If μ Δγ exceeds j, the stress returns to the apex of the cone, where √J₂ is zero: the equation is then
//! solved with t = η p/ξ and k = K η η̄/ξ². J2 is the cone η = η̄ = 0, ξ = 1/√3.
//!
//! References: Simo, Comput. Methods Appl. Mech. Engrg. 99 (1992) 61, doi:10.1016/0045-7825(92)90123-2; de Souza
//! Neto, Perić & Owen, Computational Methods for Plasticity (2008), chapters 7, 8 and 14.

use super::hardening::PlasticRate;
use super::plasticity::Plasticity;
use crate::material::number::{Computation, Scalar};
use crate::material::phase_field::DamageEnergies;
use crate::material::principal::Principal;
use crate::material::response::{Response, packed};

/// Number of state values: C_p⁻¹ − I (6 values, packed), α, plastic work in MPa.
pub(super) const STATE: usize = 8;
const ALPHA: usize = 6;
const WORK: usize = 7;

/// Plastic material at one point, with the moduli of the undamaged material.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct PlasticPoint<'a, T> {
    pub law: &'a Plasticity,
    pub bulk: T,
    pub shear: T,
    /// 1 if damage degrades the volumetric energy, else 0.
    pub volume_share: T,
    pub energies: &'a DamageEnergies,
    /// Degradation.
    pub g: T,
    /// Duration of the increment, s.
    pub dt: T,
}

/// Equation t − k x = d σ_y(α + x) for the increase x of α; damage multiplies the yield stress σ_y by d.
#[derive(Clone, Copy)]
struct FlowEquation<'a, T> {
    law: &'a Plasticity,
    dt: T,
    degradation: T,
    t: T,
    k: T,
    alpha: T,
}

/// Yield stress at α + x. This computation is a separate function, so that it is compiled once for
/// each number type.
struct YieldStress<'a, T> {
    equation: FlowEquation<'a, T>,
    x: T,
    /// 1 if the rate is above the reference rate, else 0.
    fast: T,
}

impl<T: Scalar> Computation for YieldStress<'_, T> {
    /// Yield stress, its derivative with respect to x, and the factor r of the strain rate.
    type Output = [T; 3];

    #[inline(always)]
    fn run(self) -> [T; 3] {
        let Self { equation: FlowEquation { law, dt, alpha, .. }, x, fast } = self;
        let [hardening, slope] = law.hardening.at(alpha + x);
        let mut factor = x.constant(1.0);
        let mut factor_slope = x.constant(0.0);
        if let Some(PlasticRate::JohnsonCook { c, reference_per_s }) = law.rate {
            let least = dt * reference_per_s;
            factor = (x.max(least) / least).ln() * fast * c + 1.0;
            factor_slope = fast * c / x.max(least);
        }
        let initial = law.yield_mpa;
        [factor * initial + hardening, factor_slope * initial + slope, factor]
    }
}

impl<T: Scalar> FlowEquation<'_, T> {
    #[inline(always)]
    fn yield_stress(self, x: T, fast: T) -> [T; 3] {
        x.vectorize(YieldStress { equation: self, x, fast })
    }
}

impl<T: Scalar> Computation for FlowEquation<'_, T> {
    type Output = Flow<T>;

    /// Solves the equation for x ≥ 0 by Newton's method in an interval that contains the solution. A step that leaves
    /// the interval is replaced by a bisection.
    #[inline(always)]
    fn run(self) -> Flow<T> {
        let Self { law, dt, degradation, t, k, .. } = self;
        let [zero, one] = [0.0, 1.0].map(|x| t.constant(x));
        let mut fast = zero;
        let mut low = zero;
        if let Some(PlasticRate::JohnsonCook { reference_per_s, .. }) = law.rate {
            // the yield stress has a kink at the reference rate
            let kink = dt * reference_per_s;
            let [stress, ..] = self.yield_stress(kink, one);
            let above = zero.less_than(t - k * kink - degradation * stress);
            fast = T::select(above, one, zero);
            low = T::select(above, kink, zero);
        }
        let mut x = low;
        let mut high = (t / k).max(low);
        let tolerance = t.abs() * 1e-14;
        let rounds = if T::RECORDS { 14 } else { 60 };
        for _ in 0..rounds {
            let [stress, slope, _] = self.yield_stress(x, fast);
            let residual = t - k * x - degradation * stress;
            let next = x + residual / (k + degradation * slope);
            let positive = zero.less_than(residual);
            low = T::select(positive, x, low);
            high = T::select(positive, high, x);
            let below = T::select(next.less_than(high), one, zero);
            let inside = T::select(low.less_than(next), below, zero);
            let middle = (low + high) * 0.5;
            let solved = residual.abs().less_than(tolerance);
            let bracketed = T::select(zero.less_than(inside), next, middle);
            x = T::select(solved, x, bracketed);
            if T::settled(solved) {
                break;
            }
        }
        // one more step after convergence: if T is a dual number, this step gives x its derivatives
        let [stress, slope, factor] = self.yield_stress(x, fast);
        x += (t - k * x - degradation * stress) / (k + degradation * slope);
        let flows = zero.less_than(t - degradation * self.yield_stress(zero, zero)[0]);
        let x = T::select(flows, x, zero);
        Flow { x, slope, stress, factor: T::select(flows, factor, one) }
    }
}

/// Solution of the [`FlowEquation`].
#[derive(Clone, Copy)]
struct Flow<T> {
    /// Increase x of α.
    x: T,
    /// Derivative of the yield stress with respect to x, MPa.
    slope: T,
    /// Yield stress σ_y, MPa.
    stress: T,
    /// Factor r of the rate.
    factor: T,
}

/// Response of a point in an increment. This computation is a separate function, so that it is compiled once for
/// each number type.
struct Increment<'a, T> {
    point: PlasticPoint<'a, T>,
    trial: &'a Principal<T>,
    old: &'a [T],
    new: &'a mut [T],
}

impl<T: Scalar> Computation for Increment<'_, T> {
    type Output = Response<T>;

    #[inline(always)]
    fn run(self) -> Response<T> {
        self.point.increment(self.trial, self.old, self.new)
    }
}

impl<T: Scalar> PlasticPoint<'_, T> {
    /// Returns the factor d by which damage multiplies the yield stress, and the derivative of d with respect to g.
    #[inline(always)]
    fn yield_degradation(&self) -> [T; 2] {
        let [zero, one] = [0.0, 1.0].map(|x| self.g.constant(x));
        if self.energies.degrade.plastic { [self.g, one] } else { [one, zero] }
    }

    /// Returns the [`FlowEquation`] with the given t, k and α.
    #[inline(always)]
    fn equation(&self, t: T, k: T, alpha: T) -> FlowEquation<'_, T> {
        let [degradation, _] = self.yield_degradation();
        FlowEquation { law: self.law, dt: self.dt, degradation, t, k, alpha }
    }

    /// Returns the response, and writes the state at the end of the increment.
    #[inline(always)]
    pub(in crate::material) fn respond(
        self,
        trial: &Principal<T>,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        self.g.vectorize(Increment { point: self, trial, old, new })
    }

    #[inline(always)]
    fn increment(&self, trial: &Principal<T>, old: &[T], new: &mut [T]) -> Response<T> {
        let [zero, one] = [0.0, 1.0].map(|x| self.g.constant(x));
        let Self { g, volume_share, .. } = *self;
        let [eta, eta_bar, xi] = self.law.criterion.cone();
        let theta = trial.strains.trace();
        let mut e = trial.strains.log;
        for i in 0..3 {
            e[i] = e[i] - theta / 3.0;
        }
        let norm = (e[0] * e[0] + e[1] * e[1] + e[2] * e[2]).sqrt();
        let inverse = one / norm.max(one.constant(1e-150));
        let axis = [e[0] * inverse, e[1] * inverse, e[2] * inverse];
        let shear = g * self.shear;
        let bulk = volume_share.mul_add(g * self.bulk - self.bulk, self.bulk);
        // `intact_j` is the trial value without damage; `shear`, `bulk`, `j` and `p` include the degradation
        let (root, alpha) = (2f64.sqrt(), old[ALPHA]);
        let intact_j = self.shear * norm * root;
        let (j, p) = (g * intact_j, bulk * theta);
        let k = (bulk * (eta * eta_bar) + shear) / (xi * xi);
        let smooth = k.vectorize(self.equation((p * eta + j) / xi, k, alpha));
        let mut gamma = smooth.x / xi;
        // 1 if the stress returns to the apex: `x` is then the increase of α, and the whole deviatoric strain becomes
        // plastic
        let mut apex = zero;
        let mut flow = smooth;
        let mut volume_flow = gamma * eta_bar;
        if eta_bar > 0.0 {
            let behind = (j - shear * gamma).less_than(zero);
            apex = T::select(behind, one, zero);
            if !T::settled(apex.equals(zero)) {
                let factor = eta * eta_bar / (xi * xi);
                let tip = k.vectorize(self.equation(p * (eta / xi), bulk * factor, alpha));
                volume_flow = T::select(behind, tip.x * (eta_bar / xi), volume_flow);
                gamma = T::select(behind, zero, gamma);
                flow.x = T::select(behind, tip.x, flow.x);
                flow.slope = T::select(behind, tip.slope, flow.slope);
                flow.stress = T::select(behind, tip.stress, flow.stress);
                flow.factor = T::select(behind, tip.factor, flow.factor);
            }
        }
        let on_cone = one - apex;
        let flows = T::select(zero.less_than(flow.x), one, zero);
        let left_j = on_cone * (intact_j - self.shear * gamma);
        let left_theta = theta - volume_flow;
        let [degradation, degradation_slope] = self.yield_degradation();
        let hardening = degradation * flow.slope;
        // derivative of Δγ with respect to g; at the apex, derivative of the volumetric plastic
        // strain
        let bulk_slope = volume_share * self.bulk;
        // lower bound of a denominator that is zero without stiffness and hardening
        let least = one.constant(1e-150);
        let cone_stiffness = shear + bulk * (eta * eta_bar) + hardening * (xi * xi);
        let cone_stiffness = cone_stiffness.max(least);
        let push = left_j + bulk_slope * left_theta * eta - degradation_slope * flow.stress * xi;
        let gamma_slope = flows * on_cone * push / cone_stiffness;
        let mut volume_slope = gamma_slope * eta_bar;
        // derivative of α with respect to the volumetric strain, for a stress that returns to the
        // apex
        let mut apex_slope = zero;
        let mut apex_bulk = zero;
        if eta_bar > 0.0 {
            let stiffness = (bulk * (eta / xi) + hardening * (xi / eta_bar)).max(least);
            let push = bulk_slope * left_theta * (eta / xi) - degradation_slope * flow.stress;
            volume_slope += flows * apex * push / stiffness;
            apex_bulk = bulk - bulk * bulk * (eta / xi) / stiffness;
            apex_slope = bulk * (eta / eta_bar) / stiffness;
        }
        let j_slope = left_j - shear * gamma_slope;
        let p_slope = bulk_slope * left_theta - bulk * volume_slope;
        let (left, pressure) = (g * left_j, bulk * left_theta);
        let elastic = left_j * left_j / (self.shear * 2.0);
        let volumetric = left_theta * left_theta * 0.5;
        let work = self.law.hardening.work(alpha + flow.x) - self.law.hardening.work(alpha)
            + flow.factor * flow.x * self.law.yield_mpa;
        let mut out = Response::zero(g);
        out.energy = g * elastic + bulk * volumetric;
        out.dissipation = degradation * work;
        out.driving = elastic + bulk_slope * volumetric;
        out.driving_slope = -(left_j * gamma_slope + bulk_slope * left_theta * volume_slope);
        new[ALPHA] = alpha + flow.x;
        new[WORK] = old[WORK] + work;
        // factor by which plastic flow multiplies the trial deviator
        let beta = on_cone * (one - shear * gamma / j.max(one.constant(1e-150)));
        let beta = T::select(zero.less_than(flow.x), beta, one);
        let compliance = flows * on_cone / cone_stiffness;
        let spin = shear * (one - beta) * 2.0;
        let normal_term = on_cone * (spin - shear * shear * compliance * 2.0);
        let cross = shear * bulk * compliance * root;
        let cone_bulk = bulk - bulk * bulk * compliance * (eta * eta_bar);
        let whole_bulk = T::select(zero.less_than(apex * flows), apex_bulk, cone_bulk);
        for i in 0..3 {
            out.stress[i] = left * axis[i] * root + pressure;
            out.stress_plus[i] = j_slope * axis[i] * root + p_slope;
            out.shear[i] = shear * beta * trial.strains.coth[i];
            out.skew[i] = cross * axis[i] * (-0.5 * (eta - eta_bar));
            for k in 0..=i {
                let diagonal = if i == k { 2.0 } else { 0.0 } - 2.0 / 3.0;
                let both = cross * (axis[i] + axis[k]) * (-0.5 * (eta + eta_bar));
                out.normal[packed(i, k)] =
                    shear * beta * diagonal + normal_term * axis[i] * axis[k] + both + whole_bulk;
            }
        }
        out.driving_stress = out.stress_plus;
        let DamageEnergies { drive, degrade, plastic_threshold_mpa } = *self.energies;
        let above = (new[WORK] - plastic_threshold_mpa).max(zero);
        let weight = match (drive.plastic, degrade.plastic) {
            (true, true) | (false, false) => zero,
            (true, false) => T::select(zero.less_than(above), one, zero),
            (false, true) => -one,
        };
        // ∂τ/∂g contains the derivative of the plastic work if damage degrades the plastic work
        for i in 0..3 {
            let on_cone = (shear * axis[i] * root + bulk * eta) * compliance;
            let work_slope = flow.stress * (on_cone * xi + apex * flows * apex_slope);
            out.driving_stress[i] += weight * work_slope;
        }
        if drive.plastic {
            out.driving += above;
        }
        self.update_plastic_strain(trial, axis, e, gamma, volume_flow, apex, old, new);
        out
    }

    /// Writes C_p⁻¹ − I at the end of the increment: Σ_i e^(2ε_i) (e^(−2Δ_i) − 1) p_i ⊗ p_i is added, with the
    /// increments Δ_i of plastic strain and p_i = F⁻¹ n_i.
    #[expect(
        clippy::too_many_arguments,
        reason = "values of one point, which only this call passes"
    )]
    #[inline(always)]
    fn update_plastic_strain(
        &self,
        trial: &Principal<T>,
        axis: [T; 3],
        e: [T; 3],
        gamma: T,
        volume_flow: T,
        apex: T,
        old: &[T],
        new: &mut [T],
    ) {
        new[..6].copy_from_slice(&old[..6]);
        for i in 0..3 {
            let on_cone = gamma * axis[i] * (0.5 * 2f64.sqrt());
            let flow = on_cone + apex * e[i] + volume_flow / 3.0;
            let change = (flow * -2.0).exp_m1() * (trial.strains.excess[i] + 1.0);
            let p = &trial.push[i];
            for a in 0..3 {
                for b in 0..=a {
                    let entry = packed(a, b);
                    new[entry] = (change * p[a]).mul_add(p[b], new[entry]);
                }
            }
        }
    }
}
