//! Response of finite linear viscoelasticity at a point, or at one point per SIMD lane.
//!
//! With the elastic deviatoric stress in the material frame S̃ = J^(2/3) F⁻¹ (dev τ°) F⁻ᵀ, the stress of term i is
//! H_i = e^(−Δt/τ_i) H_i,n + γ_i f_i (S̃ − S̃_n), f_i = (1 − e^(−Δt/τ_i)) τ_i/Δt. In the spatial frame,
//! h_i = J^(−2/3) F H_i Fᵀ is the sum of a_i, which the state at the start of the increment determines, and of
//! γ_i f_i dev τ°. The stress is τ = (γ_∞ + Σ γ_i f_i) dev τ° + dev a + p with a = Σ a_i. The tensor a does not have the
//! principal axes of the strain.
//!
//! Reference: Simo, Comput. Methods Appl. Mech. Engrg. 60 (1987) 153, doi:10.1016/0045-7825(87)90107-1.

use super::prony::{PronyTerm, Viscoelasticity};
use crate::material::number::{Computation, Scalar, dot};
use crate::material::principal::Principal;
use crate::material::response::packed;

/// Viscoelastic law in one increment.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct ViscousPoint<'a, T> {
    pub law: &'a Viscoelasticity,
    /// Duration of the increment, s.
    pub dt: T,
}

/// e^(−x) and (1 − e^(−x))/x; a function of its own, so that it is compiled once for each number type.
struct Decay<T>(T);

impl<T: Scalar> Computation for Decay<T> {
    type Output = [T; 2];

    #[inline(always)]
    fn run(self) -> [T; 2] {
        let x = self.0;
        let lost = -(-x).exp_m1();
        let none = x.equals(x.constant(0.0));
        [-lost + 1.0, T::select(none, x.constant(1.0), lost / x)]
    }
}

/// Factors of a modulus in one increment, relative to the modulus of the elastic law.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Relaxation<T> {
    /// Instantaneous modulus.
    pub instantaneous: T,
    /// Modulus γ_∞ of the equilibrium spring.
    pub equilibrium: T,
    /// Part Σ γ_i f_i of the terms.
    pub viscous: T,
}

/// Stress of the terms at the end of the increment, as far as the state at the start determines it.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct Overstress<T> {
    /// Entries of dev a in the principal axes, MPa: (0,0), (1,1), (2,2), then (1,2), (2,0), (0,1).
    pub deviator: [T; 6],
    /// tr a, MPa.
    pub trace: T,
}

/// Energy of the Prony terms.
#[derive(Clone, Copy, Debug)]
pub(in crate::material) struct StoredEnergy<T> {
    /// Stored energy Σ |dev h_i|²/(4 μ γ_i), MPa. It is exact at small strain.
    pub energy: T,
    /// Energy Δt Σ |dev h_i|²/(2 μ γ_i τ_i) that the terms dissipate in the increment, MPa.
    pub dissipation: T,
    /// Derivative of `energy` with respect to the strain, in the order of [`Overstress::deviator`], MPa. It is exact at
    /// small strain.
    pub stress: [T; 6],
}

impl<T: Scalar> ViscousPoint<'_, T> {
    /// Returns e^(−Δt/τ) and (1 − e^(−Δt/τ)) τ/Δt of a term.
    #[inline(always)]
    fn decay(&self, term: &PronyTerm) -> [T; 2] {
        let x = self.dt / term.time_s;
        x.vectorize(Decay(x))
    }

    #[inline(always)]
    fn relaxation(&self, terms: &[PronyTerm], instantaneous: f64) -> Relaxation<T> {
        let mut viscous = self.dt.constant(0.0);
        let mut equilibrium = 1.0;
        for term in terms {
            viscous += self.decay(term)[1] * term.fraction;
            equilibrium -= term.fraction;
        }
        Relaxation {
            instantaneous: self.dt.constant(instantaneous),
            equilibrium: self.dt.constant(equilibrium * instantaneous),
            viscous: viscous * instantaneous,
        }
    }

    /// Returns the factors of the shear modulus.
    #[inline(always)]
    pub(in crate::material) fn shear(&self) -> Relaxation<T> {
        self.relaxation(&self.law.shear, self.law.instantaneous()[0])
    }

    /// Returns the factors of the bulk modulus.
    #[inline(always)]
    pub(in crate::material) fn bulk(&self) -> Relaxation<T> {
        self.relaxation(&self.law.bulk, self.law.instantaneous()[1])
    }

    /// Index of the first state value of the bulk terms.
    #[inline(always)]
    fn first_of_bulk(&self) -> usize {
        if self.law.shear.is_empty() { 0 } else { 6 * (1 + self.law.shear.len()) }
    }

    /// Returns the part of the pressure that the state at the start determines, MPa.
    #[inline(always)]
    pub(in crate::material) fn known_pressure(&self, old: &[T]) -> T {
        let mut sum = self.dt.constant(0.0);
        if self.law.bulk.is_empty() {
            return sum;
        }
        let at = &old[self.first_of_bulk()..];
        for (k, term) in self.law.bulk.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            sum += decay * at[1 + k] - mean * term.fraction * at[0];
        }
        sum
    }

    /// Writes the state of the bulk terms; `pressure` is the instantaneous elastic pressure at the end of the
    /// increment, MPa.
    #[inline(always)]
    pub(in crate::material) fn update_pressure(&self, pressure: T, old: &[T], new: &mut [T]) {
        if self.law.bulk.is_empty() {
            return;
        }
        let first = self.first_of_bulk();
        for (k, term) in self.law.bulk.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            let gain = mean * term.fraction * (pressure - old[first]);
            new[first + 1 + k] = decay * old[first + 1 + k] + gain;
        }
        new[first] = pressure;
    }

    /// Returns a = J^(−2/3) F A Fᵀ for the sum A of the known stresses of the terms, in the principal axes.
    #[inline(always)]
    pub(in crate::material) fn overstress(&self, trial: &Principal<T>, old: &[T]) -> Overstress<T> {
        let zero = self.dt.constant(0.0);
        let mut known = [zero; 6];
        for (k, term) in self.law.shear.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            let gain = mean * term.fraction;
            for entry in 0..6 {
                known[entry] += decay * old[6 * (1 + k) + entry] - gain * old[entry];
            }
        }
        let spatial = if self.law.shear.is_empty() { [zero; 6] } else { spatial(trial, &known) };
        let trace = spatial[0] + spatial[1] + spatial[2];
        let mut deviator = spatial;
        for i in 0..3 {
            deviator[i] = spatial[i] - trace / 3.0;
        }
        Overstress { deviator, trace }
    }

    /// Writes the state of the shear terms. `elastic` is the instantaneous elastic deviatoric stress of the matrix in
    /// the principal axes, in the order of [`Overstress::deviator`], MPa.
    #[inline(always)]
    pub(in crate::material) fn update_shear(
        &self,
        trial: &Principal<T>,
        elastic: &[T; 6],
        old: &[T],
        new: &mut [T],
    ) {
        if self.law.shear.is_empty() {
            return;
        }
        let material = material(trial, elastic);
        for (k, term) in self.law.shear.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            let gain = mean * term.fraction;
            for entry in 0..6 {
                let at = 6 * (1 + k) + entry;
                new[at] = decay * old[at] + gain * (material[entry] - old[entry]);
            }
        }
        new[..6].copy_from_slice(&material);
    }

    /// Returns the energy of the terms at the state `new`. `shear` and `bulk` are the instantaneous moduli, MPa.
    #[inline(always)]
    pub(in crate::material) fn stored(
        &self,
        trial: &Principal<T>,
        shear: T,
        bulk: T,
        new: &[T],
    ) -> StoredEnergy<T> {
        let zero = self.dt.constant(0.0);
        let [mut energy, mut dissipation, mut pressures] = [zero; 3];
        let mut stress = [zero; 6];
        for (k, term) in self.law.shear.iter().enumerate() {
            let mut known = [zero; 6];
            known.copy_from_slice(&new[6 * (1 + k)..][..6]);
            let h = spatial(trial, &known);
            let mean = (h[0] + h[1] + h[2]) / 3.0;
            let mut square = zero;
            let weight = self.decay(term)[1];
            for i in 0..3 {
                let (normal, oblique) = (h[i] - mean, h[3 + i]);
                square += normal * normal + oblique * oblique * 2.0;
                stress[i] += weight * normal;
                stress[3 + i] += weight * oblique;
            }
            let stored = square / (shear * (4.0 * term.fraction));
            energy += stored;
            dissipation += stored * self.dt * (2.0 / term.time_s);
        }
        let first = self.first_of_bulk();
        for (k, term) in self.law.bulk.iter().enumerate() {
            let pressure = new[first + 1 + k];
            let stored = pressure * pressure / (bulk * (2.0 * term.fraction));
            energy += stored;
            dissipation += stored * self.dt * (2.0 / term.time_s);
            pressures += self.decay(term)[1] * pressure;
        }
        for i in 0..3 {
            stress[i] += pressures;
        }
        StoredEnergy { energy, dissipation, stress }
    }
}

/// Row and column of the entries of [`Overstress::deviator`].
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];

/// Returns J^(−2/3) F A Fᵀ in the principal axes, for a packed tensor A in the material frame.
#[inline(always)]
fn spatial<T: Scalar>(trial: &Principal<T>, a: &[T; 6]) -> [T; 6] {
    a[0].vectorize(Spatial { trial, a })
}

struct Spatial<'a, T> {
    trial: &'a Principal<T>,
    a: &'a [T; 6],
}

impl<T: Scalar> Computation for Spatial<'_, T> {
    type Output = [T; 6];

    #[inline(always)]
    fn run(self) -> [T; 6] {
        pushed(self.trial, self.a)
    }
}

#[inline(always)]
fn pushed<T: Scalar>(trial: &Principal<T>, a: &[T; 6]) -> [T; 6] {
    let scale = (trial.strains.trace() * (-2.0 / 3.0)).exp();
    // rows of Qᵀ F: λ_i² times the rows of Qᵀ F⁻ᵀ
    let mut rows = trial.push;
    let mut images = trial.push;
    for i in 0..3 {
        let square = trial.strains.excess[i] + 1.0;
        for k in 0..3 {
            rows[i][k] = square * trial.push[i][k];
        }
        for k in 0..3 {
            let column = [a[packed(k, 0)], a[packed(k.max(1), k.min(1))], a[packed(2, k)]];
            images[i][k] = dot(&rows[i], &column);
        }
    }
    let mut out = [scale; 6];
    for (entry, (i, j)) in ENTRIES.into_iter().enumerate() {
        out[entry] = scale * dot(&images[i], &rows[j]);
    }
    out
}

/// Returns J^(2/3) F⁻¹ τ F⁻ᵀ, packed, for a tensor τ in the principal axes.
#[inline(always)]
fn material<T: Scalar>(trial: &Principal<T>, tau: &[T; 6]) -> [T; 6] {
    let scale = (trial.strains.trace() * (2.0 / 3.0)).exp();
    let push = &trial.push;
    let mut images = trial.push;
    for i in 0..3 {
        let (j, k) = ((i + 1) % 3, (i + 2) % 3);
        for a in 0..3 {
            images[i][a] = tau[i] * push[i][a] + tau[3 + k] * push[j][a] + tau[3 + j] * push[k][a];
        }
    }
    let mut out = [scale; 6];
    for a in 0..3 {
        for b in 0..=a {
            let [x, y] = [a, b];
            let mut sum = images[0][x] * push[0][y];
            sum = images[1][x].mul_add(push[1][y], sum);
            sum = images[2][x].mul_add(push[2][y], sum);
            out[packed(a, b)] = scale * sum;
        }
    }
    out
}
