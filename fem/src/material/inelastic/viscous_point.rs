//! Prony terms at a point, or at one point per SIMD lane.
//!
//! The elastic deviatoric stress s is S̃ = J^(2/3) F⁻¹ s F⁻ᵀ in the material frame. The normalised stress of term i
//! with the relaxation time τ_i is H_i = e^(−Δt/τ_i) H_i,n + f_i (S̃ − S̃_n) with f_i = (1 − e^(−Δt/τ_i)) τ_i/Δt; the
//! index n denotes the start of the increment of duration Δt. In the spatial frame, H_i is h_i = J^(−2/3) F H_i Fᵀ =
//! a_i + f_i s, where a_i depends only on F and on the state at the start of the increment. The term contributes m_i
//! dev h_i to the stress, with a factor m_i that depends on damage. The tensor a_i does not have the principal axes of
//! the strain.
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

/// Symmetric tensor in the principal axes of the strain: entries (0,0), (1,1), (2,2), then (1,2), (2,0), (0,1).
#[derive(Clone, Copy, Debug)]
pub(super) struct Spatial<T>(pub [T; 6]);

/// Computation of e^(−x) and (1 − e^(−x))/x. It is a separate function, so that it is compiled once
/// for each number type.
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

impl<T: Scalar> ViscousPoint<'_, T> {
    /// Returns e^(−Δt/τ) and f = (1 − e^(−Δt/τ)) τ/Δt of a term.
    #[inline(always)]
    pub(super) fn decay(&self, term: &PronyTerm) -> [T; 2] {
        let x = self.dt / term.time_s;
        x.vectorize(Decay(x))
    }

    /// Returns the index of the first state value of the bulk terms.
    #[inline(always)]
    pub(super) fn first_of_bulk(&self) -> usize {
        if self.law.shear.is_empty() { 0 } else { 6 * (1 + self.law.shear.len()) }
    }

    /// Writes the state values of the bulk terms at the end of the increment. `pressure` is the elastic
    /// pressure at the end of the increment, MPa.
    #[inline(always)]
    pub(super) fn update_pressure(&self, pressure: T, old: &[T], new: &mut [T]) {
        if self.law.bulk.is_empty() {
            return;
        }
        let first = self.first_of_bulk();
        for (k, term) in self.law.bulk.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            let gain = mean * (pressure - old[first]);
            new[first + 1 + k] = decay * old[first + 1 + k] + gain;
        }
        new[first] = pressure;
    }

    /// Writes the state values of the shear terms at the end of the increment. `stress` is the elastic
    /// deviatoric stress in the principal axes.
    #[inline(always)]
    pub(super) fn update_shear(
        &self,
        trial: &Principal<T>,
        stress: &[T; 3],
        old: &[T],
        new: &mut [T],
    ) {
        if self.law.shear.is_empty() {
            return;
        }
        let material = material(trial, stress);
        for (k, term) in self.law.shear.iter().enumerate() {
            let [decay, mean] = self.decay(term);
            for entry in 0..6 {
                let at = 6 * (1 + k) + entry;
                new[at] = decay * old[at] + mean * (material[entry] - old[entry]);
            }
        }
        new[..6].copy_from_slice(&material);
    }
}

impl<T: Scalar> Spatial<T> {
    /// Returns J^(−2/3) F A Fᵀ for a packed tensor A in the material frame.
    #[inline(always)]
    pub(super) fn new(trial: &Principal<T>, a: &[T; 6]) -> Self {
        a[0].vectorize(Moved { trial, a })
    }

    /// Returns the trace.
    #[inline(always)]
    pub(super) fn trace(&self) -> T {
        self.0[0] + self.0[1] + self.0[2]
    }

    /// Returns the deviator.
    #[inline(always)]
    pub(super) fn deviator(mut self) -> Self {
        let mean = self.trace() / 3.0;
        for i in 0..3 {
            self.0[i] = self.0[i] - mean;
        }
        self
    }
}

/// Map of a tensor from the material frame to the principal axes of the strain. This computation is a separate
/// function, so that it is compiled once for each number type.
struct Moved<'a, T> {
    trial: &'a Principal<T>,
    a: &'a [T; 6],
}

/// Row and column of the entries of [`Spatial`].
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1)];

impl<T: Scalar> Computation for Moved<'_, T> {
    type Output = Spatial<T>;

    #[inline(always)]
    fn run(self) -> Spatial<T> {
        let Self { trial, a } = self;
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
        Spatial(out)
    }
}

/// Returns J^(2/3) F⁻¹ τ F⁻ᵀ, packed, for a tensor τ that is diagonal in the principal axes.
#[inline(always)]
fn material<T: Scalar>(trial: &Principal<T>, tau: &[T; 3]) -> [T; 6] {
    let scale = (trial.strains.trace() * (2.0 / 3.0)).exp();
    let push = &trial.push;
    let mut out = [scale; 6];
    for a in 0..3 {
        for b in 0..=a {
            let mut sum = tau[0] * push[0][a] * push[0][b];
            for i in 1..3 {
                sum = (tau[i] * push[i][a]).mul_add(push[i][b], sum);
            }
            out[packed(a, b)] = scale * sum;
        }
    }
    out
}
