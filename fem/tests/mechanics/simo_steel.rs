//! The steel of Simo's benchmarks of plasticity at finite strain, for Cook's membrane and the necking of a bar.

use fem::{Hardening, HardeningPoint, Material, Plasticity};

pub(super) const YOUNG_MPA: f64 = 206_900.0;
pub(super) const POISSON: f64 = 0.29;

/// Steel with the yield stress 715 − 265 e^(−16.93 α) + 129.24 α MPa (Simo & Armero, Int. J. Numer. Meth. Engng 33 (1992)
/// 1413), as a table. Between the points of the table, the yield stress is at most 0.4 MPa too small.
pub(super) fn simo_steel() -> Material {
    const INTERVALS: u32 = 20;
    let exponential =
        (0..INTERVALS).map(|k| -2.0 / 16.93 * (-f64::from(k) / f64::from(INTERVALS)).ln_1p());
    let points = exponential.chain([0.7, 5.0]).map(|plastic_strain| HardeningPoint {
        plastic_strain,
        hardening_mpa: 265.0 * -(-16.93 * plastic_strain).exp_m1() + 129.24 * plastic_strain,
    });
    plastic(YOUNG_MPA, POISSON, 450.0, points.collect())
}

/// Steel with tabulated hardening.
pub(super) fn plastic(
    young_mpa: f64,
    poisson: f64,
    yield_mpa: f64,
    points: Vec<HardeningPoint>,
) -> Material {
    let hardening = Hardening::Table(points);
    let law = Plasticity { hardening, ..Plasticity::new(yield_mpa) };
    Material::hencky(young_mpa, poisson).with_plasticity(law)
}
