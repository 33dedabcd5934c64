//! A law with a state that is independent of the principal axes.

use super::{grain, matrix};
use fem::{ConstitutiveLaw, ElasticResponse, Material, Principal, Response, Scalar};

/// Law with a one-term Maxwell body for the volume and an elastic shear part: p = K (t − f α) with t = tr ε and the
/// viscous dilatation α, where dα/dt = (t − α)/t₀. The energy of this law is not the potential of its stress.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Creeping {
    pub(crate) bulk_mpa: f64,
    pub(crate) fraction: f64,
    pub(crate) time_s: f64,
}

const SHEAR_MPA: f64 = 110.0;
pub(crate) const CREEPING: Creeping = Creeping { bulk_mpa: 180.0, fraction: 0.6, time_s: 0.2 };

impl ConstitutiveLaw for Creeping {
    fn young_and_poisson(&self) -> [f64; 2] {
        let (k, g) = (self.bulk_mpa, SHEAR_MPA);
        [9.0 * k * g / (3.0 * k + g), (3.0 * k - 2.0 * g) / (6.0 * k + 2.0 * g)]
    }

    fn state_len(&self) -> usize {
        1
    }

    #[inline(always)]
    fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let trace = trial.strains.trace();
        let remaining = (-dt / self.time_s).exp();
        let spring = (trace - old[0]) * remaining;
        new[0] = trace - spring;
        let (elastic, creeps) =
            (self.bulk_mpa * (1.0 - self.fraction), self.bulk_mpa * self.fraction);
        let energy = (trace * trace * elastic + spring * spring * creeps) * 0.5;
        let pressure = trace * elastic + spring * creeps;
        let mut out = ElasticResponse::volumetric([energy, pressure, remaining * creeps + elastic]);
        for i in 0..3 {
            let deviator = trial.strains.log[i] - trace / 3.0;
            out.energy += deviator * deviator * SHEAR_MPA;
            out.stress[i] += deviator * (2.0 * SHEAR_MPA);
            out.shear[i] += trial.strains.coth[i] * SHEAR_MPA;
        }
        for (entry, i, j) in [(0, 0, 0), (1, 1, 0), (2, 1, 1), (3, 2, 0), (4, 2, 1), (5, 2, 2)] {
            let share = if i == j { 4.0 / 3.0 } else { -2.0 / 3.0 };
            out.normal[entry] += g.constant(SHEAR_MPA * share);
        }
        out.degraded(g)
    }
}

/// A matrix that creeps and breaks, and the baseline grains.
pub(crate) fn creeping(law: Creeping) -> Vec<Material> {
    let fracture = matrix().fracture;
    vec![Material { fracture, ..Material::with_law(law).expect("a law") }, grain()]
}
