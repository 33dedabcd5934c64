//! Material constants of the elements, gathered into SIMD lanes.

use crate::element::Space;
use crate::material::{
    Degradation, Degraded, DrivingHistory, Formula, Homogenisation, LaneLaw, Lanes, MOST_GRAIN,
    MixedPhases, POINTS, PointMaterial,
};
use crate::operator::kernel::Constants;

/// The materials of all regions in an increment.
pub(crate) struct Regions<'a> {
    materials: &'a [PointMaterial],
    degraded: Degraded,
    /// Whether the largest driving energy so far drives damage.
    history: bool,
    /// Number of state values per point.
    state_len: usize,
    /// The formula of the elastic law, if all regions have the same one.
    formula: Option<Formula>,
    rule: Homogenisation,
    /// Constants by region: K, μ, 1 − η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀ and ξ/Δt.
    constants: Vec<[f64; CONSTANTS]>,
}

/// Number of state values per elastic point: the largest number of the laws of all regions, and one if the largest
/// driving energy so far drives damage.
pub fn state_len(materials: &[PointMaterial]) -> usize {
    let law = materials.iter().map(PointMaterial::state_len).max().unwrap_or(0);
    law + usize::from(keeps_history(materials))
}

fn keeps_history(materials: &[PointMaterial]) -> bool {
    materials.iter().any(|m| m.damage.is_some_and(|damage| damage.history))
}

/// The law of elements in lanes.
pub type RegionLaw<'a, T> = DrivingHistory<LaneLaw<'a, T>>;

/// Number of constants of a region.
pub(crate) const CONSTANTS: usize = 6;

/// Constants of one element: constants of its region, then fraction, bulk and shear modulus of the grain.
pub(crate) type Row = [f64; CONSTANTS + 3];

impl<'a> Regions<'a> {
    pub(crate) fn new(
        materials: &'a [PointMaterial],
        rule: Homogenisation,
        duration: f64,
        damping: f64,
    ) -> Self {
        // all regions have the same damage model, so the first one is used
        let damage = materials.iter().find_map(|m| m.damage.as_ref());
        let constants = materials.iter().map(|m| {
            let [soft, local, gradient, viscous] = match &m.damage {
                Some(d) => {
                    [1.0 - d.residual, d.local, d.gradient, d.viscosity / duration + damping]
                }
                None => [0.0; 4],
            };
            [m.moduli.bulk, m.moduli.shear, soft, local, gradient, viscous]
        });
        let first = materials.first().and_then(PointMaterial::formula);
        Self {
            materials,
            degraded: damage.map_or(Degraded::ALL, |d| d.degraded),
            history: keeps_history(materials),
            state_len: state_len(materials),
            formula: first.filter(|_| materials.iter().all(|m| m.formula() == first)),
            rule,
            constants: constants.collect(),
        }
    }

    /// The formula that all regions share, if there is one, and the part of the energy that damage degrades.
    pub(crate) fn law(&self) -> (Option<Formula>, Degraded) {
        (self.formula, self.degraded)
    }

    /// Number of state values per elastic point.
    pub(crate) fn state_len(&self) -> usize {
        self.state_len
    }

    /// Whether the largest driving energy so far drives damage.
    pub(crate) fn keeps_history(&self) -> bool {
        self.history
    }

    /// The constants of an element: K, μ, 1 − η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀ and ξ/Δt, then fraction, K and μ of the
    /// grain. For a mixture the first six are those of the matrix; the constants of damage are reduced by the
    /// grain fraction. The grain is the phase of the region `second`.
    pub(crate) fn row(&self, region: usize, second: usize, fraction: f64) -> Row {
        let mut row = [0.0; CONSTANTS + 3];
        row[..CONSTANTS].copy_from_slice(&self.constants[region]);
        // a pure element stores its own moduli as the grain's
        let mut grain = region;
        if fraction > 0.0 {
            if fraction > MOST_GRAIN {
                row[2..CONSTANTS].fill(0.0);
            }
            row[3..CONSTANTS].iter_mut().for_each(|constant| *constant *= 1.0 - fraction);
            row[CONSTANTS] = fraction;
            grain = second;
        }
        row[CONSTANTS + 1..].copy_from_slice(&self.constants[grain][..2]);
        row
    }

    /// The constants of the elements in all lanes, and whether any element is a mixture.
    #[inline(always)]
    pub(crate) fn constants<T: Lanes, const N: usize>(
        &self,
        token: T::Token,
        space: &Space<N>,
        tets: &[usize; POINTS],
    ) -> (Constants<T, RegionLaw<'_, T>>, bool) {
        let mut columns = [[0.0; POINTS]; CONSTANTS + 3];
        let mut materials = [&self.materials[0]; POINTS];
        let mut mixed = false;
        for lane in 0..T::COUNT {
            let region = usize::from(space.region[tets[lane]]);
            materials[lane] = &self.materials[region];
            let fraction = space.fraction(tets[lane]);
            mixed |= fraction > 0.0;
            let row = self.row(region, space.second_region(tets[lane]), fraction);
            for k in 0..CONSTANTS + 3 {
                columns[k][lane] = row[k];
            }
        }
        let mut numbers = [T::load(token, &columns[0]); CONSTANTS + 3];
        for k in 1..CONSTANTS + 3 {
            numbers[k] = T::load(token, &columns[k]);
        }
        let [bulk, shear, soft, local, gradient, viscous, fraction, grain_bulk, grain_shear] =
            numbers;
        let mut phases = None;
        if mixed {
            let (matrix, grain) = ([bulk, shear], [grain_bulk, grain_shear]);
            phases = Some(MixedPhases { rule: self.rule, matrix, grain, fraction });
        }
        let law = LaneLaw::new(self.formula, self.degraded, [bulk, shear], phases, materials);
        let law = DrivingHistory { law, active: self.history };
        let degradation = Degradation { soft };
        (Constants { law, degradation, local, gradient, viscous }, mixed)
    }
}
