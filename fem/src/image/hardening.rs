//! Beam hardening: the brightness of one material as a function of the distance from the axis.
//!
//! An X-ray beam loses its soft part on its way, so the inside of a cylinder looks less dense than its
//! rim ("cupping"). Matrix and grains are dimmed by nearly the same factor, 1 + a s + b s² with
//! s = (r/R)², which is fitted to the mean grey values of both classes in rings.

use rayon::prelude::*;

use super::cylinder::Fit;
use super::grey::sum;
use super::threshold::{BINS, WIDTH, class_means, middle, otsu};

/// Rings of equal area.
const RINGS: usize = 32;
/// Rounds of classification and fit.
const ROUNDS: usize = 8;
/// Rings with fewer voxels of a class do not count for it.
const LEAST: f64 = 100.0;

/// The factor by which grey values above air are raised at a distance from the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Cupping {
    air: f64,
    /// 1, a, b, scaled so that the mean over the section is 1.
    profile: [f64; 3],
}

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
        let rings = ring_histograms(values, shape, set, cylinder, void);
        let mut cupping = Cupping { air, profile: [1.0, 0.0, 0.0] };
        for _ in 0..ROUNDS {
            let Some(next) = cupping.improved(&rings) else { break };
            let change =
                cupping.profile.iter().zip(next.profile).map(|(a, b)| (a - b).abs()).sum::<f64>();
            cupping = next;
            if change < 1e-5 {
                break;
            }
        }
        cupping
    }

    /// One round: classes by the corrected histogram, then the profile from their means in the rings.
    fn improved(&self, rings: &[Vec<u64>]) -> Option<Cupping> {
        let place = |ring: usize| (ring as f64 + 0.5) / RINGS as f64;
        let mut corrected = vec![0; BINS];
        for (ring, counts) in rings.iter().enumerate() {
            let factor = self.at(place(ring));
            for (bin, &count) in counts.iter().enumerate() {
                let value = self.air + (middle(bin) - self.air) / factor;
                corrected[(value.max(0.0) as usize / WIDTH).min(BINS - 1)] += count;
            }
        }
        let split = otsu(&corrected, 2)?;
        let means = class_means(&corrected, &split);
        let threshold = middle(split[0]) - WIDTH as f64 / 2.0;

        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        for (ring, counts) in rings.iter().enumerate() {
            let s = place(ring);
            let limit = self.air + (threshold - self.air) * self.at(s);
            let row = nalgebra::Vector3::new(1.0, s, s * s);
            for class in 0..2 {
                let (mut count, mut moment) = (0.0, 0.0);
                for (bin, &c) in counts.iter().enumerate() {
                    if usize::from(middle(bin) >= limit) == class {
                        count += c as f64;
                        moment += c as f64 * (middle(bin) - self.air);
                    }
                }
                if count >= LEAST {
                    let ratio = moment / count / (means[class] - self.air);
                    normal += row * row.transpose() * count;
                    right += row * (ratio * count);
                }
            }
        }
        let u = normal.cholesky()?.solve(&right);
        // over the section s is distributed evenly
        let mean = u[0] + u[1] / 2.0 + u[2] / 3.0;
        let next = Cupping { air: self.air, profile: [u[0] / mean, u[1] / mean, u[2] / mean] };
        let sound = (0..=RINGS).all(|n| next.at(n as f64 / RINGS as f64) > 0.2);
        sound.then_some(next)
    }

    /// Takes the profile out of grey values; beyond the wall it goes on as at the wall.
    pub(crate) fn correct(&self, values: &mut [u16], shape: [usize; 3], cylinder: &Fit) {
        let [nx, ny, _] = shape;
        let factors: Vec<f64> = (0..nx * ny)
            .map(|n| 1.0 / self.at(relative(cylinder, n % nx, n / nx).min(1.0)))
            .collect();
        values.par_chunks_mut(nx * ny).for_each(|slice| {
            for (value, factor) in slice.iter_mut().zip(&factors) {
                let corrected = self.air + (f64::from(*value) - self.air) * factor;
                *value = corrected.round().clamp(0.0, 65535.0) as u16;
            }
        });
    }
}

/// (r/R)² of a column of voxels.
fn relative(cylinder: &Fit, x: usize, y: usize) -> f64 {
    cylinder.squared_radius(x, y) / (cylinder.radius * cylinder.radius)
}

fn ring_histograms(
    values: &[u16],
    [nx, ny, _]: [usize; 3],
    set: &[u8],
    cylinder: &Fit,
    void: f64,
) -> Vec<Vec<u64>> {
    let ring_of: Vec<usize> = (0..nx * ny)
        .map(|n| relative(cylinder, n % nx, n / nx))
        .map(|s| ((s * RINGS as f64) as usize).min(RINGS - 1))
        .collect();
    let counts = values
        .par_chunks(nx * ny)
        .zip(set.par_chunks(nx * ny))
        .fold(
            || vec![0; RINGS * BINS],
            |mut counts, (values, set)| {
                for ((&value, &inside), &ring) in values.iter().zip(set).zip(&ring_of) {
                    let counted = inside != 0 && f64::from(value) >= void;
                    counts[ring * BINS + value as usize / WIDTH] += u64::from(counted);
                }
                counts
            },
        )
        .reduce(|| vec![0; RINGS * BINS], sum);
    counts.chunks_exact(BINS).map(<[u64]>::to_vec).collect()
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
        let cylinder = Fit {
            centre: [32.0, 32.0],
            radius: 30.0,
            bottom: 0.0,
            top: 24.0,
            lean: [0.0; 2],
            scatter: 0.0,
        };
        let set = cylinder.inside(shape, 2.0);
        let truth = |s: f64| 0.88 + 0.2 * s + 0.05 * s * s;
        let mut values = Vec::new();
        let mut clean = Vec::new();
        for n in 0..set.len() {
            let (x, y, z) = (n % 64, n / 64 % 64, n / 4096);
            // grains are more frequent outside, which must not be taken for cupping
            let s = relative(&cylinder, x, y);
            let grain = (x / 6 + y / 6 + z / 6) % 5 < if s > 0.5 { 3 } else { 1 };
            let material = if grain { 35_000.0 } else { 20_000.0 };
            let noise = rng.random_range(-1500.0..1500.0);
            values.push((9000.0 + material * truth(s.min(1.0)) + noise) as u16);
            clean.push(9000.0 + material);
        }
        let found = Cupping::fit(&values, shape, &set, &cylinder, 9000.0, 15_000.0);
        assert!((found.rim_over_centre() - truth(1.0) / truth(0.0)).abs() < 0.01, "{found:?}");
        found.correct(&mut values, shape, &cylinder);
        let ratio = |n: usize| (f64::from(values[n]) - 9000.0) / (clean[n] - 9000.0);
        let inside: Vec<usize> = (0..set.len()).filter(|&n| set[n] == 1).collect();
        for part in [0.0..0.2, 0.4..0.6, 0.7..0.9] {
            let ring = inside
                .iter()
                .copied()
                .filter(|&n| part.contains(&relative(&cylinder, n % 64, n / 64 % 64)));
            let ratios: Vec<f64> = ring.map(ratio).collect();
            let mean = ratios.iter().sum::<f64>() / ratios.len() as f64;
            assert!((mean - 0.9967).abs() < 0.005, "{part:?}: {mean}");
        }
    }
}
