//! Brightness of one material as a function of the position: beam hardening and drift.
//!
//! An X-ray beam loses its low-energy part along its path. Therefore the inside of a cylinder looks less dense than its
//! rim ("cupping"). A source or detector whose brightness changes from slice to slice causes a drift along the axis.
//! Matrix and grains are dimmed by nearly the same factor, (1 + a s + b s²) (1 + c t + d t²) with s = (r/R)² (radial
//! position over radius) and the relative height t from 0 to 1. The factor is fitted to the mean grey values of both
//! classes in rings and layers. Each class has its own mean, so an uneven distribution of grains does not change the
//! factor.

use std::borrow::Cow;

use rayon::prelude::*;

use crate::locate::fit::Fit;
use crate::volume::filter::core;
use crate::volume::grey::rounded;
use crate::volume::threshold::{WIDTH, histogram, otsu};

/// Number of rings of equal area into which a section of the cylinder is divided.
const RINGS: usize = 32;
/// Number of layers of equal height into which the cylinder is divided.
const LAYERS: usize = 16;
/// Largest number of iterations; each iteration classifies the voxels and then fits the profiles of brightness.
const ROUNDS: usize = 3;
/// The iterations end if no profile of brightness changes by more than this value.
const STILL: f64 = 0.002;
/// Number of steps of a fit; each step fits first the brightness of the two classes (matrix, grain) and then the
/// profiles.
const STEPS: usize = 20;
/// Smallest number of voxels of a class (matrix or grain) in a ring of a layer. Means over fewer
/// voxels are not used.
const LEAST: u64 = 5;
/// Smallest range of s or t that the means must cover to fit a quadratic profile. A quadratic polynomial that is fitted
/// to a smaller range is wrong by tens of percent at the wall of a thin cylinder.
const COVERED: f64 = 0.6;

/// Factor by which the grey value minus the grey value of air is dimmed, as a function of the position.
/// [`correct`](Self::correct) divides by this factor.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Brightness {
    air: f64,
    radial: Profile,
    axial: Profile,
}

/// Coefficients of a quadratic polynomial in s or t (from 0 to 1); the value of the polynomial is a factor with mean 1.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Profile([f64; 3]);

/// Degree of a profile of brightness.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Degree {
    Constant,
    Linear,
    Quadratic,
}

/// Number of voxels and sum of grey values of one class (matrix or grain), for each ring of each layer.
type Parts = Vec<(u64, u64)>;

/// Factors of the voxels of a slice. The factor of a voxel is `axial` times the value of the voxel in `radial`.
struct Factors<'a> {
    radial: Cow<'a, [f64]>,
    axial: f64,
}

/// Mean brightness (grey value minus the grey value of air) of one class (matrix or grain) in a
/// ring of a layer.
struct Mean {
    s: f64,
    t: f64,
    count: f64,
    value: f64,
}

impl Profile {
    const EVEN: Self = Self([1.0, 0.0, 0.0]);

    fn at(&self, s: f64) -> f64 {
        self.0[0] + s * (self.0[1] + s * self.0[2])
    }

    /// Fits a profile of brightness to points `[position, weight, factor, value]`, so that value ≈ factor ·
    /// profile(position) by weighted least squares. Returns `None` if the equations are singular, or if the profile is
    /// not above 0.2 everywhere.
    fn fitted(points: impl Iterator<Item = [f64; 4]>, degree: Degree) -> Option<Self> {
        if degree == Degree::Constant {
            return Some(Self::EVEN);
        }
        let mut normal = nalgebra::Matrix3::zeros();
        let mut right = nalgebra::Vector3::zeros();
        let curved = f64::from(u8::from(degree == Degree::Quadratic));
        // a linear profile has no equation for its last coefficient, which this term sets to 0
        normal[(2, 2)] = 1.0 - curved;
        for [s, weight, factor, value] in points {
            let row = nalgebra::Vector3::new(1.0, s, curved * s * s) * factor;
            normal += row * row.transpose() * weight;
            right += row * (weight * value);
        }
        let u = normal.cholesky()?.solve(&right);
        // mean over s or t from 0 to 1: in a cylinder, s is uniformly distributed over the section, and t over the
        // height
        let mean = u[0] + u[1] / 2.0 + u[2] / 3.0;
        let profile = Self([u[0] / mean, u[1] / mean, u[2] / mean]);
        let is_sound = (0..=RINGS).all(|n| profile.at(n as f64 / RINGS as f64) > 0.2);
        is_sound.then_some(profile)
    }
}

impl Brightness {
    fn at(&self, s: f64, t: f64) -> f64 {
        self.radial.at(s.min(1.0)) * self.axial.at(t.clamp(0.0, 1.0))
    }

    /// Returns the factors of brightness of the voxels of a slice. If the radial factors are equal in all slices,
    /// `upright` contains them.
    fn factors<'a>(&self, places: &Places<'_>, upright: Option<&'a [f64]>) -> Factors<'a> {
        match (&places.heights, upright) {
            (Heights::Equal(t), Some(radial)) => {
                Factors { radial: Cow::Borrowed(radial), axial: self.axial.at(t.clamp(0.0, 1.0)) }
            }
            _ => {
                let all = (0..places.squares.len()).map(|n| {
                    let [s, t] = places.at(n);
                    self.at(s, t)
                });
                Factors { radial: Cow::Owned(all.collect()), axial: 1.0 }
            }
        }
    }

    /// Returns the radial factors of brightness, which are equal in all slices of an upright cylinder; `None` for a
    /// tilted cylinder.
    fn across(&self, columns: &Columns<'_>) -> Option<Vec<f64>> {
        let squares = columns.upright.as_ref()?;
        Some(squares.iter().map(|s| self.radial.at(s.min(1.0))).collect())
    }

    /// Returns whether two brightness functions differ by less than [`STILL`]; such a difference does not affect the
    /// classification.
    fn is_near(&self, other: &Self) -> bool {
        let mut places = (0..=RINGS).map(|n| n as f64 / RINGS as f64);
        let off = |s: f64| {
            let radial = self.radial.at(s) - other.radial.at(s);
            let axial = self.axial.at(s) - other.axial.at(s);
            radial.abs().max(axial.abs())
        };
        places.all(|s| off(s) < STILL)
    }

    /// Returns the ratio of a material's brightness at the wall to its brightness at the axis.
    pub(crate) fn rim_over_centre(&self) -> f64 {
        self.radial.at(1.0) / self.radial.at(0.0)
    }

    /// Returns the ratio of a material's brightness at the top to its brightness at the bottom.
    pub(crate) fn top_over_bottom(&self) -> f64 {
        self.axial.at(1.0) / self.axial.at(0.0)
    }

    /// Fits the profiles to the voxels of a set within a cylinder. `air` is the grey value of air and `void` the lowest
    /// grey value that is not air.
    pub(crate) fn fit(
        values: &[u16],
        shape: [usize; 3],
        set: &[u8],
        cylinder: &Fit,
        air: f64,
        void: f64,
    ) -> Brightness {
        let mut brightness = Brightness { air, radial: Profile::EVEN, axial: Profile::EVEN };
        let solid: Vec<u8> = values
            .par_iter()
            .zip(set)
            .map(|(&value, &inside)| u8::from(f64::from(value) >= void) & inside)
            .collect();
        let Some(split) = otsu(&histogram(values, &solid), 2) else { return brightness };
        let mut level = (split[0] * WIDTH) as f64;
        for _ in 0..ROUNDS {
            let classes = brightness.classes(values, shape, &solid, cylinder, level);
            // beyond the range of the voxels away from interfaces, a linear profile is not better than none
            let Some((next, means)) = brightness.improved(&classes, Degree::Constant) else {
                break;
            };
            let is_still = brightness.is_near(&next);
            brightness = next;
            if means.iter().all(|mean| mean.is_finite()) {
                level = air + (means[0] + means[1]) / 2.0;
            }
            if is_still {
                break;
            }
        }
        brightness
    }

    /// Fits the profiles to an image without grains. `set` are voxels of matrix whose grey values contain no air.
    pub(crate) fn of_matrix(
        values: &[u16],
        shape: [usize; 3],
        set: &[u8],
        cylinder: &Fit,
        air: f64,
    ) -> Brightness {
        let even = Brightness { air, radial: Profile::EVEN, axial: Profile::EVEN };
        let classes = [ring_sums(values, shape, set, cylinder), vec![(0, 0); RINGS * LAYERS]];
        even.improved(&classes, Degree::Linear).map_or(even, |(brightness, _)| brightness)
    }

    /// Sums the grey values of matrix and of grain in rings and layers. Voxels at interfaces are omitted, because they
    /// contain both materials.
    fn classes(
        &self,
        values: &[u16],
        shape: [usize; 3],
        solid: &[u8],
        cylinder: &Fit,
        level: f64,
    ) -> [Parts; 2] {
        let area = shape[0] * shape[1];
        let columns = Columns::new(cylinder, shape);
        let across = self.across(&columns);
        let mut grain = vec![0; values.len()];
        let slices = grain.par_chunks_mut(area).zip(values.par_chunks(area));
        slices.zip(solid.par_chunks(area)).enumerate().for_each(|(z, ((grain, values), solid))| {
            let factors = self.factors(&columns.at(z), across.as_deref());
            let above = (level - self.air) * factors.axial;
            let voxels = values.iter().zip(solid).zip(factors.radial.iter());
            for (grain, ((&value, solid), radial)) in grain.iter_mut().zip(voxels) {
                *grain = u8::from(f64::from(value) >= self.air + above * radial) & solid;
            }
        });
        let matrix: Vec<u8> =
            solid.par_iter().zip(&grain).map(|(solid, grain)| solid & (1 - grain)).collect();
        [matrix, grain].map(|class| ring_sums(values, shape, &core(shape, &class), cylinder))
    }

    /// Fits the profiles to the means in rings and layers. Returns the profiles, and the brightness above air of both
    /// classes (matrix, grain); the brightness is NaN for a class without voxels away from interfaces.
    ///
    /// The profiles are quadratic; if the means cover only a part of the cylinder, they have the degree `partial`.
    fn improved(&self, classes: &[Parts; 2], partial: Degree) -> Option<(Brightness, [f64; 2])> {
        let means_of = |parts: &Parts| -> Vec<Mean> {
            let parts = parts.iter().enumerate().filter(|(_, part)| part.0 >= LEAST);
            parts
                .map(|(number, &(count, sum))| Mean {
                    s: ((number % RINGS) as f64 + 0.5) / RINGS as f64,
                    t: ((number / RINGS) as f64 + 0.5) / LAYERS as f64,
                    count: count as f64,
                    value: sum as f64 / count as f64 - self.air,
                })
                .collect()
        };
        let classes = [means_of(&classes[0]), means_of(&classes[1])];
        let degree = |place: fn(&Mean) -> f64, from_zero: bool| {
            let places = || classes.iter().flatten().map(place);
            let first = if from_zero { 0.0 } else { places().fold(1.0, f64::min) };
            match places().fold(0.0, f64::max) - first {
                covered if covered < COVERED => partial,
                _ => Degree::Quadratic,
            }
        };
        // the radial profile of a cylinder is symmetric, so that only the largest radius matters
        let radial_degree = degree(|mean| mean.s, true);
        let axial_degree = degree(|mean| mean.t, false);
        let mut this = *self;
        let mut brightness = [f64::NAN; 2];
        for _ in 0..STEPS {
            for (brightness, class) in brightness.iter_mut().zip(&classes) {
                let (mut moment, mut weight) = (0.0, 0.0);
                for mean in class {
                    let factor = this.at(mean.s, mean.t);
                    moment += mean.count * mean.value * factor;
                    weight += mean.count * factor.powi(2);
                }
                *brightness = moment / weight;
            }
            let points = || {
                let both = classes.iter().zip(brightness);
                both.flat_map(|(class, level)| {
                    class.iter().map(move |mean| (mean, mean.value / level))
                })
            };
            let radial =
                |(mean, value): (&Mean, f64)| [mean.s, mean.count, this.axial.at(mean.t), value];
            let radial = Profile::fitted(points().map(radial), radial_degree)?;
            let axial =
                |(mean, value): (&Mean, f64)| [mean.t, mean.count, radial.at(mean.s), value];
            this.axial = Profile::fitted(points().map(axial), axial_degree)?;
            this.radial = radial;
        }
        Some((this, brightness))
    }

    /// Removes the profiles of brightness from grey values. Beyond the wall and the ends of the cylinder, the factors
    /// at the wall and at the ends are used.
    pub(crate) fn correct(&self, values: &mut [u16], shape: [usize; 3], cylinder: &Fit) {
        let columns = Columns::new(cylinder, shape);
        let across = self.across(&columns);
        values.par_chunks_mut(shape[0] * shape[1]).enumerate().for_each(|(z, slice)| {
            let factors = self.factors(&columns.at(z), across.as_deref());
            for (value, radial) in slice.iter_mut().zip(factors.radial.iter()) {
                let corrected =
                    self.air + (f64::from(*value) - self.air) / (radial * factors.axial);
                *value = rounded(corrected.clamp(0.0, 65535.0)) as u16;
            }
        });
    }
}

/// Sums the grey values of a set of voxels in rings and layers of a cylinder.
fn ring_sums(values: &[u16], shape: [usize; 3], set: &[u8], cylinder: &Fit) -> Parts {
    let area = shape[0] * shape[1];
    let columns = Columns::new(cylinder, shape);
    let bin = |share: f64, bins: usize| ((share * bins as f64) as usize).min(bins - 1);
    let add = |mut sums: Parts, (z, (values, set)): (usize, (&[u16], &[u8]))| {
        let places = columns.at(z);
        for n in (0..area).filter(|&n| set[n] != 0) {
            let [s, t] = places.at(n);
            let sum = &mut sums[bin(s, RINGS) + RINGS * bin(t, LAYERS)];
            *sum = (sum.0 + 1, sum.1 + u64::from(values[n]));
        }
        sums
    };
    let none = || vec![(0, 0); RINGS * LAYERS];
    let both = values.par_chunks(area).zip(set.par_chunks(area)).enumerate();
    both.fold(none, add)
        .reduce(none, |a, b| a.iter().zip(b).map(|(a, b)| (a.0 + b.0, a.1 + b.1)).collect())
}

/// Source of the values (r/R)² and of the relative heights of voxels, slice by slice.
struct Columns<'a> {
    cylinder: &'a Fit,
    section: [usize; 2],
    /// Values (r/R)² of the voxels of a slice, if the cylinder is upright. These values are then equal in all slices.
    upright: Option<Vec<f64>>,
}

/// Values (r/R)² of the voxels of a slice, and the voxels' relative heights from 0 to 1.
struct Places<'a> {
    squares: Cow<'a, [f64]>,
    heights: Heights,
}

/// Heights of the voxels of a slice.
enum Heights {
    Equal(f64),
    Each(Vec<f64>),
}

impl Places<'_> {
    /// Returns (r/R)² and the relative height of a voxel of the slice.
    fn at(&self, n: usize) -> [f64; 2] {
        let height = match &self.heights {
            Heights::Equal(height) => *height,
            Heights::Each(heights) => heights[n],
        };
        [self.squares[n], height]
    }
}

impl<'a> Columns<'a> {
    fn new(cylinder: &'a Fit, [nx, ny, _]: [usize; 3]) -> Self {
        let section = [nx, ny];
        let is_upright = cylinder.lean == [0.0; 2];
        let upright = is_upright.then(|| cylinder.relative_squares(section, 0));
        Columns { cylinder, section, upright }
    }

    fn at(&self, z: usize) -> Places<'_> {
        let Fit { bottom, top, .. } = self.cylinder;
        let height =
            |voxel| (self.cylinder.radius_squared_and_height(voxel)[1] - bottom) / (top - bottom);
        match &self.upright {
            Some(all) => {
                Places { squares: Cow::Borrowed(all), heights: Heights::Equal(height([0, 0, z])) }
            }
            None => {
                let [nx, ny] = self.section;
                let all = (0..nx * ny).map(|n| height([n % nx, n / nx, z])).collect();
                Places {
                    squares: Cow::Owned(self.cylinder.relative_squares(self.section, z)),
                    heights: Heights::Each(all),
                }
            }
        }
    }
}

#[cfg(test)]
mod tests;
