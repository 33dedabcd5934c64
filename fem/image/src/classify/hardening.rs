//! Beam hardening: the brightness of one material as a function of the distance from the axis.
//!
//! An X-ray beam loses its soft part on its way, so the inside of a cylinder looks less dense than its
//! rim ("cupping"). Matrix and grains are dimmed by nearly the same factor, 1 + a s + b s² with
//! s = (r/R)², which is fitted to the mean grey values of both classes in rings.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::locate::fit::Fit;
use crate::volume::filter::erode;
use crate::volume::threshold::{WIDTH, histogram, otsu};

/// Rings of equal area.
const RINGS: usize = 32;
/// Rounds of classification and fit.
const ROUNDS: usize = 3;
/// Steps in which profile and brightness of the classes are fitted in turn.
const STEPS: usize = 20;
/// Rings with fewer voxels of a class do not count for it.
const LEAST: u64 = 50;

/// The factor by which grey values above air are raised at a distance from the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cupping {
    air: f64,
    /// 1, a, b, scaled so that the mean over the section is 1.
    profile: [f64; 3],
}

/// Number and sum of the grey values of a class in each ring.
type Rings = Vec<(u64, u64)>;

impl Cupping {
    fn at(&self, s: f64) -> f64 {
        self.profile[0] + s * (self.profile[1] + s * self.profile[2])
    }

    /// Brightness at the wall over that at the axis.
    pub(crate) fn rim_over_centre(&self) -> f64 {
        self.at(1.0) / self.at(0.0)
    }

    /// Fits the profile to the voxels of a set within a cylinder; `air` is the grey value of nothing
    /// and `void` the least one that is not air.
    pub(crate) fn fit(
        values: &[u16],
        shape: [usize; 3],
        set: &[u8],
        cylinder: &Fit,
        air: f64,
        void: f64,
    ) -> Cupping {
        let mut cupping = Cupping { air, profile: [1.0, 0.0, 0.0] };
        let solid: Vec<u8> = values
            .par_iter()
            .zip(set)
            .map(|(&value, &inside)| u8::from(f64::from(value) >= void) & inside)
            .collect();
        let Some(split) = otsu(&histogram(values, &solid), 2) else { return cupping };
        let mut level = (split[0] * WIDTH) as f64;
        for _ in 0..ROUNDS {
            let classes = cupping.classes(values, shape, &solid, cylinder, level);
            let Some((next, means)) = cupping.improved(&classes) else { break };
            cupping = next;
            if means.iter().all(|mean| mean.is_finite()) {
                level = air + (means[0] + means[1]) / 2.0;
            }
        }
        cupping
    }

    /// Matrix and grain in the rings, away from interfaces, where voxels hold both.
    fn classes(
        &self,
        values: &[u16],
        shape: [usize; 3],
        solid: &[u8],
        cylinder: &Fit,
        level: f64,
    ) -> [Rings; 2] {
        let area = shape[0] * shape[1];
        let columns = Columns::new(cylinder, shape);
        [false, true].map(|grain| {
            let mut class = vec![0; values.len()];
            let slices = class.par_chunks_mut(area).zip(values.par_chunks(area));
            slices.zip(solid.par_chunks(area)).enumerate().for_each(
                |(z, ((class, values), solid))| {
                    let s = columns.at(z);
                    for n in 0..area {
                        let limit = self.air + (level - self.air) * self.at(s[n].min(1.0));
                        class[n] = u8::from((f64::from(values[n]) >= limit) == grain) & solid[n];
                    }
                },
            );
            let core = erode(shape, &erode(shape, &class));
            let add = |mut sums: Rings, (z, (values, core)): (usize, (&[u16], &[u8]))| {
                let s = columns.at(z);
                for n in (0..area).filter(|&n| core[n] != 0) {
                    let sum = &mut sums[((s[n] * RINGS as f64) as usize).min(RINGS - 1)];
                    *sum = (sum.0 + 1, sum.1 + u64::from(values[n]));
                }
                sums
            };
            let none = || vec![(0, 0); RINGS];
            let both = values.par_chunks(area).zip(core.par_chunks(area)).enumerate();
            both.fold(none, add)
                .reduce(none, |a, b| a.iter().zip(b).map(|(a, b)| (a.0 + b.0, a.1 + b.1)).collect())
        })
    }

    /// The profile that fits the means in the rings best, and the brightness of the classes above air
    /// (not a number for a class that is nowhere away from interfaces).
    fn improved(&self, classes: &[Rings; 2]) -> Option<(Cupping, [f64; 2])> {
        let points = |class: usize| {
            classes[class].iter().enumerate().filter(|(_, ring)| ring.0 >= LEAST).map(
                |(number, &(count, sum))| {
                    let s = (number as f64 + 0.5) / RINGS as f64;
                    (s, count as f64, sum as f64 / count as f64 - self.air)
                },
            )
        };
        let mut this = *self;
        let mut means = [f64::NAN; 2];
        for _ in 0..STEPS {
            let mut normal = nalgebra::Matrix3::zeros();
            let mut right = nalgebra::Vector3::zeros();
            for class in 0..2 {
                let (mut moment, mut weight) = (0.0, 0.0);
                for (s, count, mean) in points(class) {
                    moment += count * mean * this.at(s);
                    weight += count * this.at(s).powi(2);
                }
                means[class] = moment / weight;
                for (s, count, mean) in points(class) {
                    let row = nalgebra::Vector3::new(1.0, s, s * s);
                    normal += row * row.transpose() * count;
                    right += row * (count * mean / means[class]);
                }
            }
            let u = normal.cholesky()?.solve(&right);
            // over the section s is distributed evenly
            let mean = u[0] + u[1] / 2.0 + u[2] / 3.0;
            this.profile = [u[0] / mean, u[1] / mean, u[2] / mean];
        }
        let sound = (0..=RINGS).all(|n| this.at(n as f64 / RINGS as f64) > 0.2);
        sound.then_some((this, means))
    }

    /// Takes the profile out of grey values; beyond the wall it goes on as at the wall.
    pub(crate) fn correct(&self, values: &mut [u16], shape: [usize; 3], cylinder: &Fit) {
        let columns = Columns::new(cylinder, shape);
        values.par_chunks_mut(shape[0] * shape[1]).enumerate().for_each(|(z, slice)| {
            for (value, s) in slice.iter_mut().zip(columns.at(z).iter()) {
                let factor = 1.0 / self.at(s.min(1.0));
                let corrected = self.air + (f64::from(*value) - self.air) * factor;
                *value = corrected.round().clamp(0.0, 65535.0) as u16;
            }
        });
    }
}

/// (r/R)² of voxels, slice by slice: all slices of an upright cylinder are alike.
struct Columns<'a> {
    cylinder: &'a Fit,
    section: [usize; 2],
    upright: Option<Vec<f64>>,
}

impl<'a> Columns<'a> {
    fn new(cylinder: &'a Fit, [nx, ny, _]: [usize; 3]) -> Self {
        let section = [nx, ny];
        let is_upright = cylinder.lean == [0.0; 2];
        let upright = is_upright.then(|| cylinder.relative_squares(section, 0));
        Columns { cylinder, section, upright }
    }

    fn at(&self, z: usize) -> Cow<'_, [f64]> {
        match &self.upright {
            Some(all) => Cow::Borrowed(all),
            None => Cow::Owned(self.cylinder.relative_squares(self.section, z)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    #[test]
    fn a_known_profile_is_found_and_taken_out() {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(7);
        let shape = [64, 64, 24];
        for lean in [[0.0, 0.0], [0.15, -0.1]] {
            let cylinder = Fit {
                centre: [32.0, 32.0],
                radius: 30.0,
                bottom: 0.0,
                top: 24.0,
                lean,
                wander: 0.0,
                scatter: 0.0,
            };
            a_profile_is_taken_out_of(&cylinder, shape, &mut rng);
        }
    }

    fn a_profile_is_taken_out_of(cylinder: &Fit, shape: [usize; 3], rng: &mut impl Rng) {
        let set = cylinder.inside(shape, 2.0);
        let relative = |x, y, z| cylinder.place([x, y, z])[0] / cylinder.radius.powi(2);
        let truth = |s: f64| 0.88 + 0.2 * s + 0.05 * s * s;
        let mut values = Vec::new();
        let mut clean = Vec::new();
        for n in 0..set.len() {
            let (x, y, z) = (n % 64, n / 64 % 64, n / 4096);
            // grains are more frequent outside, which must not be taken for cupping
            let s = relative(x, y, z);
            let grain = (x / 9 + y / 9 + z / 12) % 5 < if s > 0.5 { 3 } else { 1 };
            let material = if grain { 35_000.0 } else { 20_000.0 };
            let noise = rng.random_range(-800.0..800.0);
            values.push((9000.0 + material * truth(s.min(1.0)) + noise) as u16);
            clean.push(9000.0 + material);
        }
        let found = Cupping::fit(&values, shape, &set, cylinder, 9000.0, 15_000.0);
        assert!((found.rim_over_centre() - truth(1.0) / truth(0.0)).abs() < 0.01, "{found:?}");
        found.correct(&mut values, shape, cylinder);
        let ratio = |n: usize| (f64::from(values[n]) - 9000.0) / (clean[n] - 9000.0);
        let inside: Vec<usize> = (0..set.len()).filter(|&n| set[n] == 1).collect();
        for part in [0.0..0.2, 0.4..0.6, 0.7..0.9] {
            let ring = inside
                .iter()
                .copied()
                .filter(|&n| part.contains(&relative(n % 64, n / 64 % 64, n / 4096)));
            let ratios: Vec<f64> = ring.map(ratio).collect();
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            assert!((mean - 0.9967).abs() < 0.005, "{part:?}: {mean}");
        }
    }
}
