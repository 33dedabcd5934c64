//! Material constants of the elements, gathered into SIMD lanes.

use crate::element::Space;
use crate::material::{
    Degradation, DegradationLaw, Degraded, Homogenisation, LaneLaw, Lanes, MOST_GRAIN, MixedPhases,
    POINTS, PointMaterial, RegionLaw,
};
use crate::operator::element::Constants;

/// The materials of all regions in an increment.
pub(super) struct Regions {
    /// The different laws and degradation functions of the regions.
    laws: Vec<RegionLaw>,
    degradations: Vec<DegradationLaw>,
    rule: Homogenisation,
    /// Constants by region.
    constants: Vec<[f64; CONSTANTS]>,
}

/// Number of constants of a region: K, μ, 1 − η, Gc/(c₀ ℓ₀), Gc ℓ₀/c₀, ξ/Δt, and the indices of law and degradation
/// function.
pub(super) const CONSTANTS: usize = 8;

/// Constants of one element: those of its region, then fraction, bulk and shear modulus of the grain.
pub(super) type Row = [f64; CONSTANTS + 3];

/// Returns the index of a value in a list of different values, to which it is added if it is new.
fn index_in<T: PartialEq>(list: &mut Vec<T>, value: T) -> f64 {
    let known = list.iter().position(|other| *other == value);
    known.unwrap_or_else(|| {
        list.push(value);
        list.len() - 1
    }) as f64
}

impl Regions {
    pub(super) fn new(
        materials: &[PointMaterial],
        rule: Homogenisation,
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
        // a region without damage shares the law of a region with damage that differs from it in the split only
        for (m, row) in materials.iter().zip(&mut constants) {
            if m.damage.is_none() {
                let form = m.form();
                let same = laws.iter().find(|law| law.form == form);
                let degraded = same.map_or(Degraded::ALL, |law| law.degraded.clone());
                row[6] = index_in(&mut laws, RegionLaw { form, degraded });
            }
        }
        if degradations.is_empty() {
            degradations.push(DegradationLaw::default());
        }
        Self { laws, degradations, rule, constants }
    }

    /// The different laws and degradation functions of the regions.
    pub(super) fn laws(&self) -> (&[RegionLaw], &[DegradationLaw]) {
        (&self.laws, &self.degradations)
    }

    /// The constants of an element: those of its region, then fraction, K and μ of the grain. For a mixture those of
    /// the region are those of the matrix; the constants of damage are reduced by the grain fraction. The grain is the
    /// phase of the region `second`.
    pub(super) fn row(&self, region: usize, second: usize, fraction: f64) -> Row {
        let mut row = [0.0; CONSTANTS + 3];
        row[..CONSTANTS].copy_from_slice(&self.constants[region]);
        // a pure element stores its own moduli as the grain's
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

    /// The constants of the elements in all lanes, and whether any element is a mixture.
    #[inline(always)]
    pub(super) fn of<T: Lanes, const N: usize>(
        &self,
        token: T::Token,
        space: &Space<N>,
        tets: &[usize; POINTS],
    ) -> (Constants<'_, T, LaneLaw<'_, T>>, bool) {
        let mut columns = [[0.0; POINTS]; CONSTANTS + 3];
        let mut mixed = false;
        for lane in 0..T::COUNT {
            let region = usize::from(space.region[tets[lane]]);
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
        let [bulk, shear, soft, local, gradient, viscous, law, degradation, fraction, grain @ ..] =
            numbers;
        let mut phases = None;
        if mixed {
            phases = Some(MixedPhases { rule: self.rule, matrix: [bulk, shear], grain, fraction });
        }
        let law = LaneLaw::new(&self.laws, law, [bulk, shear], phases);
        let degradation = Degradation { soft, laws: &self.degradations, law: degradation };
        (Constants { law, degradation, local, gradient, viscous }, mixed)
    }
}
