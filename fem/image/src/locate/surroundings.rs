//! Surroundings of a specimen in its image: air, or objects that must not count as part of the specimen. The image of a
//! block cut out of a specimen has no surroundings.

use crate::locate::fit::Fit;
use crate::{ImageError, Volume};

/// The corners of the image count as air if at least this share of their voxels is air, and as bright if at least this
/// share is bright.
const IN_CORNERS: f64 = 0.9;
/// The middle of the image counts as solid if at most this share of its voxels is air, and as dark if at most this
/// share is bright.
const IN_MIDDLE: f64 = 0.5;
/// An image shows a body in air if the share of solid voxels at the border is at most this multiple of the share of
/// solid voxels in the whole image. In an image of a block, both shares are similar.
const AT_BORDER: f64 = 0.1;
/// A slice shows a platen if its number of solid voxels exceeds this multiple of the median over the middle slices.
const WIDER: f64 = 1.15;
/// Allowed range of the area of the specimen's sections, divided by the area of the fitted circle.
const ROUND: [f64; 2] = [0.9, 1.1];

/// Surroundings of a specimen in its image.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Surroundings {
    /// Air.
    Air,
    /// No air: the image was cut out of a specimen.
    Block,
    /// The surroundings of the specimen are brighter than the specimen.
    Bright,
    /// Platens: ranges of slices, counted from 1, that are wider than the specimen or filled to their corners.
    Platens(Vec<[usize; 2]>),
}

impl Surroundings {
    /// Classifies the surroundings in an image. Grey values below `void` are air; values of at least `bright` form the
    /// brightest class.
    pub(crate) fn of(image: &Volume<u16>, void: f64, bright: f64) -> Self {
        let slices = counted(image, void, bright);
        let nz = slices.len();
        let central = &slices[nz / 4..nz - nz / 4];
        let (all, middle) = (Counts::sum(&slices), Counts::sum(central));
        let is_bright = |count: &Counts| count.corner_bright >= IN_CORNERS * count.corner;
        if is_bright(&all) && middle.middle_bright <= IN_MIDDLE * middle.middle {
            return Self::Bright;
        }
        let has_air = |count: &Counts| count.corner_air >= IN_CORNERS * count.corner;
        if !has_air(&middle) {
            return Self::Block;
        }
        let is_solid_inside = middle.middle_air <= IN_MIDDLE * middle.middle;
        // also detect air around a body that is not a cylinder, or not in the middle of the image
        let at_border = middle.border_solid / middle.border;
        let is_body = at_border < AT_BORDER * middle.solid / middle.all;
        if !(is_solid_inside || is_body) {
            return Self::Block;
        }
        let mut areas: Vec<f64> = central.iter().map(|slice| slice.solid).collect();
        areas.sort_unstable_by(f64::total_cmp);
        let area = areas[areas.len() / 2];
        let wide = runs(&slices, |slice| slice.solid > WIDER * area);
        match wide.is_empty() {
            true => Self::Air,
            false => Self::Platens(wide),
        }
    }

    /// Returns an error unless the image shows a specimen in air or a block.
    pub(crate) fn accepted(self) -> Result<Self, ImageError> {
        match self {
            Self::Air | Self::Block => Ok(self),
            Self::Bright => Err(ImageError::Scene {
                what: "the surroundings of the specimen are brighter than the specimen, as in an image with inverted grey values"
                    .to_owned(),
                help: "set contrast = \"dark\" in [specimen.image] if grains are the darkest material, otherwise invert the image; or set \
                       specimen = \"block\" if the image was cut out of a specimen",
            }),
            Self::Platens(runs) => {
                let runs: Vec<String> = runs
                    .iter()
                    .map(|[first, last]| match first == last {
                        true => first.to_string(),
                        false => format!("{first} to {last}"),
                    })
                    .collect();
                Err(ImageError::Scene {
                    what: format!(
                        "slices {} show an object wider than the specimen, such as a platen",
                        runs.join(" and ")
                    ),
                    help: "remove these slices from the stack; or set specimen = \"block\" in [specimen.image] if \
                           the image was cut out of a specimen",
                })
            }
        }
    }
}

/// Returns the ratio of the area of the specimen's horizontal sections to the area of the same sections of the fitted
/// cylinder (1 for a cylinder); voids count as filled. The sections of a tilted cylinder are ellipses.
pub(crate) fn filling(image: &Volume<u16>, fit: &Fit, void: f64) -> f64 {
    let [nx, ny, nz] = image.shape;
    let height = fit.top - fit.bottom;
    let first = (fit.bottom + 0.25 * height).max(0.0) as usize;
    let last = ((fit.top - 0.25 * height).max(0.0) as usize).clamp(first + 1, nz.max(first + 1));
    let slices = image.values.chunks_exact(nx * ny).skip(first).take(last - first);
    let (mut voxels, mut count) = (0_usize, 0_usize);
    for slice in slices {
        count += 1;
        for row in slice.chunks_exact(nx) {
            let is_solid = |&value: &u16| f64::from(value) >= void;
            // the wall starts at two adjacent solid voxels: a single solid voxel can be noise
            let wall = |pair: &[u16]| pair.iter().all(is_solid);
            let (from, to) = (row.windows(2).position(wall), row.windows(2).rposition(wall));
            voxels += from.zip(to).map_or(0, |(from, to)| to + 2 - from);
        }
    }
    let [p, q] = fit.lean;
    let section = std::f64::consts::PI * fit.radius * fit.radius * (1.0 + p * p + q * q).sqrt();
    voxels as f64 / count as f64 / section
}

/// Returns an error if the sections of a fitted cylinder do not fill the fitted circle.
pub(crate) fn checked_filling(filling: f64) -> Result<(), ImageError> {
    if (ROUND[0]..=ROUND[1]).contains(&filling) {
        return Ok(());
    }
    Err(ImageError::NoCylinder {
        message: format!(
            "the sections of the specimen fill {:.0} % of the fitted circle, as in a cut or broken cylinder",
            100.0 * filling
        ),
        help: "image a whole cylinder, or cut a block without air out of the image and set specimen = \"block\"",
    })
}

/// Numbers of voxels of one or several slices, for each region of the slice (corner, middle, border) and each class
/// (air, solid, bright).
#[derive(Clone, Copy, Debug, Default)]
struct Counts {
    all: f64,
    solid: f64,
    corner: f64,
    corner_air: f64,
    corner_bright: f64,
    middle: f64,
    middle_air: f64,
    middle_bright: f64,
    border: f64,
    border_solid: f64,
}

impl Counts {
    fn sum(slices: &[Self]) -> Self {
        slices.iter().fold(Self::default(), |sum, slice| Self {
            all: sum.all + slice.all,
            solid: sum.solid + slice.solid,
            corner: sum.corner + slice.corner,
            corner_air: sum.corner_air + slice.corner_air,
            corner_bright: sum.corner_bright + slice.corner_bright,
            middle: sum.middle + slice.middle,
            middle_air: sum.middle_air + slice.middle_air,
            middle_bright: sum.middle_bright + slice.middle_bright,
            border: sum.border + slice.border,
            border_solid: sum.border_solid + slice.border_solid,
        })
    }
}

/// Counts the voxels of each slice by region and class.
fn counted(image: &Volume<u16>, void: f64, bright: f64) -> Vec<Counts> {
    let [nx, ny, _] = image.shape;
    let from_axis = |at: usize, side: usize| ((2 * at + 1) as f64 - side as f64) / side as f64;
    let slice = |slice: &[u16]| {
        let mut counts = Counts::default();
        for (n, &value) in slice.iter().enumerate() {
            let (x, y) = (n % nx, n / nx);
            let (value, one) = (f64::from(value), |is: bool| f64::from(u8::from(is)));
            let (is_air, is_bright) = (value < void, value >= bright);
            counts.all += 1.0;
            counts.solid += one(!is_air);
            let off = from_axis(x, nx).powi(2) + from_axis(y, ny).powi(2);
            if off > 1.2 * 1.2 {
                counts.corner += 1.0;
                counts.corner_air += one(is_air);
                counts.corner_bright += one(is_bright);
            } else if off < 0.25 {
                counts.middle += 1.0;
                counts.middle_air += one(is_air);
                counts.middle_bright += one(is_bright);
            }
            if x == 0 || y == 0 || x + 1 == nx || y + 1 == ny {
                counts.border += 1.0;
                counts.border_solid += one(!is_air);
            }
        }
        counts
    };
    image.values.chunks_exact(nx * ny).map(slice).collect()
}

/// Returns the ranges (first and last, counted from 1) of consecutive slices for which `condition` holds.
fn runs(slices: &[Counts], condition: impl Fn(&Counts) -> bool) -> Vec<[usize; 2]> {
    let mut runs: Vec<[usize; 2]> = Vec::new();
    for (number, _) in (1..).zip(slices).filter(|(_, slice)| condition(slice)) {
        match runs.last_mut() {
            Some([_, last]) if *last + 1 == number => *last = number,
            _ => runs.push([number, number]),
        }
    }
    runs
}
