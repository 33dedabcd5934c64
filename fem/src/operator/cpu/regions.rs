//! Material constants of the elements, gathered into SIMD lanes.

use crate::element::Space;
use crate::material::{
    Degradation, DegradationLaw, DrivingHistory, Homogenisation, LaneLaw, Lanes, MOST_GRAIN,
    MixedPhases, POINTS, PointMaterial, RegionLaw,
};
use crate::operator::kernel::Constants;

/// Material constants of all regions in an increment.
pub(crate) struct Regions {
    /// Distinct laws of the regions.
    laws: Vec<RegionLaw>,
    /// Distinct degradation functions of the regions.
    degradations: Vec<DegradationLaw>,
    /// Whether the largest driving energy so far drives damage.
    history: bool,
    /// Number of state values per elastic point.
    state_len: usize,
    /// Homogenisation rule of mixtures.
    homogenisation: Homogenisation,
    /// Constants by region.
    constants: Vec<[f64; CONSTANTS]>,
}

/// Returns the number of state values per elastic point: the largest number of state values of any region's law, plus
/// one if the largest driving energy so far drives damage.
pub fn state_len(materials: &[PointMaterial]) -> usize {
    let law = materials.iter().map(|m| m.law().state_len()).max().unwrap_or(0);
    law + usize::from(keeps_history(materials))
}

/// Returns whether the largest driving energy so far drives damage.
fn keeps_history(materials: &[PointMaterial]) -> bool {
    materials.iter().any(|m| m.damage.as_ref().is_some_and(|damage| damage.history))
}

/// Law of the elements in SIMD lanes.
pub type ElementLaw<'a, T> = DrivingHistory<LaneLaw<'a, T>>;

/// Number of constants of a region: K, μ, 1 − η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀, ξ/Δt, and the indices of law and degradation
/// function.
pub(crate) const CONSTANTS: usize = 8;

/// Constants of one element: constants of its region, then fraction, bulk and shear modulus of the grain.
pub(crate) type Row = [f64; CONSTANTS + 3];

/// Returns the index of a value in a list of distinct values. A value that is not in the list is appended.
fn index_in<T: PartialEq>(list: &mut Vec<T>, value: T) -> f64 {
    let position = list.iter().position(|other| *other == value);
    position.unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    }) as f64
}

impl Regions {
    pub(crate) fn new(
        materials: &[PointMaterial],
        homogenisation: Homogenisation,
        duration: f64,
        damping: f64,
    ) -> Self {
        let (mut laws, mut degradations) = (Vec::new(), Vec::new());
        let mut constants = vec![[0.0; CONSTANTS]; materials.len()];
        for (m, row) in materials.iter().zip(&mut constants) {
            row[..2].copy_from_slice(&[m.moduli.bulk, m.moduli.shear]);
            if let Some(d) = &m.damage {
                row[2..6].copy_from_slice(&[
                    1.0 - d.residual,
                    d.local,
                    d.gradient,
                    d.viscosity / duration + damping,
                ]);
                row[6] = index_in(&mut laws, m.law());
                row[7] = index_in(&mut degradations, d.degradation.clone());
            }
        }
        // a region without damage uses the law of a damaged region if both laws differ only in the split, which has
        // no effect without damage; fewer laws are then evaluated
        for (m, row) in materials.iter().zip(&mut constants) {
            if m.damage.is_none() {
                let new_law = m.law();
                let same = |law: &&RegionLaw| {
                    law.form == new_law.form && law.inelastic == new_law.inelastic
                };
                let law = laws.iter().find(same).cloned().unwrap_or(new_law);
                row[6] = index_in(&mut laws, law);
            }
        }
        if degradations.is_empty() {
            degradations.push(DegradationLaw::default());
        }
        let (history, state_len) = (keeps_history(materials), state_len(materials));
        Self { laws, degradations, history, state_len, homogenisation, constants }
    }

    /// Returns the distinct laws and degradation functions of the regions.
    pub(crate) fn laws(&self) -> (&[RegionLaw], &[DegradationLaw]) {
        (&self.laws, &self.degradations)
    }

    /// Returns the number of state values per elastic point.
    pub(crate) fn state_len(&self) -> usize {
        self.state_len
    }

    /// Returns whether the largest driving energy so far drives damage.
    pub(crate) fn keeps_history(&self) -> bool {
        self.history
    }

    /// Returns the constants of an element: constants of its region, then fraction, bulk and shear modulus of the
    /// grain. In a mixture, the element's region is the matrix, and the region `second` is the grain. The constants
    /// of damage are then reduced by the grain fraction. `band` is the material of an interface band and the share of
    /// the element in the band; the toughness is the mean of region and band.
    pub(crate) fn row(
        &self,
        region: usize,
        second: usize,
        fraction: f64,
        (band, share): (usize, f64),
    ) -> Row {
        let mut row = [0.0; CONSTANTS + 3];
        row[..CONSTANTS].copy_from_slice(&self.constants[region]);
        if share > 0.0 {
            for k in 3..5 {
                row[k] += share * (self.constants[band][k] - row[k]);
            }
        }
        // an element without grain stores the moduli of its own region as moduli of the grain
        let mut grain = region;
        if fraction > 0.0 {
            if fraction > MOST_GRAIN {
                row[2..6].fill(0.0);
            }
            row[3..6].iter_mut().for_each(|constant| *constant *= 1.0 - fraction);
            row[CONSTANTS] = fraction;
            grain = second;
        }
        row[CONSTANTS + 1..].copy_from_slice(&self.constants[grain][..2]);
        row
    }

    /// Gathers the constants of the elements `tets`, one element per SIMD lane. Also returns whether any of the
    /// elements is a mixture.
    #[inline(always)]
    pub(crate) fn constants<T: Lanes, const N: usize>(
        &self,
        token: T::Token,
        space: &Space<N>,
        tets: &[usize; POINTS],
    ) -> (Constants<'_, T, ElementLaw<'_, T>>, bool) {
        let mut columns = [[0.0; POINTS]; CONSTANTS + 3];
        let mut mixed = false;
        for lane in 0..T::COUNT {
            let region = usize::from(space.region[tets[lane]]);
            let fraction = space.fraction(tets[lane]);
            mixed |= fraction > 0.0;
            let second = space.second_region(tets[lane]);
            let row = self.row(region, second, fraction, space.band(tets[lane]));
            for k in 0..CONSTANTS + 3 {
                columns[k][lane] = row[k];
            }
        }
        let mut constants = [T::load(token, &columns[0]); CONSTANTS + 3];
        for k in 1..CONSTANTS + 3 {
            constants[k] = T::load(token, &columns[k]);
        }
        let [bulk, shear, soft, local, gradient, viscous, law, degradation, fraction, grain @ ..] =
            constants;
        let mut phases = None;
        if mixed {
            phases = Some(MixedPhases {
                homogenisation: self.homogenisation,
                matrix: [bulk, shear],
                grain,
                fraction,
            });
        }
        let law = LaneLaw::new(&self.laws, law, [bulk, shear], phases);
        let law = DrivingHistory { law, active: self.history };
        let degradation = Degradation { soft, laws: &self.degradations, law: degradation };
        (Constants { law, degradation, local, gradient, viscous }, mixed)
    }
}
