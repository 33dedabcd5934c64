//! Position of the specimen as given by the user.

use std::path::PathBuf;

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::locate::fit::Fit;
use crate::{ImageError, Volume};

/// Position of the specimen, in voxels of the segmented image (after the averaging of blocks by `bin`). Absent values
/// are determined from the image.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields, default)]
pub struct SpecimenRegion {
    /// Position of the axis of an upright cylinder along x and y, in voxels from the corner of the image.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = -1e6, max = 1e6)))]
    pub centre_px: Option<[f64; 2]>,
    /// Radius of the cylinder (voxels).
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 3, max = 1e6))]
    pub radius_px: Option<f64>,
    /// First and last slice of the specimen, counted from 1.
    #[serde(skip_serializing_if = "Option::is_none")]
    #[schemars(inner(range(min = 1)))]
    pub slices: Option<[usize; 2]>,
    /// Path of an image with the same number of voxels; voxels with at least half of the largest value belong to the
    /// specimen.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mask: Option<PathBuf>,
}

impl SpecimenRegion {
    /// Checks all values that can be checked without the image.
    ///
    /// # Errors
    /// [`ImageError::Parameter`].
    pub(crate) fn check(&self) -> Result<(), ImageError> {
        let refuse =
            |field, value, requirement| Err(ImageError::Parameter { field, value, requirement });
        if let Some(value) = self.radius_px.filter(|radius| !(3.0..=1e6).contains(radius)) {
            return refuse("region.radius_px", value, "from 3 to 1000000 voxels");
        }
        let centre = self.centre_px.into_iter().flatten();
        if let Some(value) = centre.into_iter().find(|c| !(-1e6..=1e6).contains(c)) {
            return refuse("region.centre_px", value, "two positions in the image (voxels)");
        }
        if let Some([first, last]) = self.slices
            && !(first >= 1 && first + 3 < last)
        {
            let value = first as f64;
            return refuse(
                "region.slices",
                value,
                "a first and a last slice, at least 4 apart, from 1",
            );
        }
        Ok(())
    }

    /// Checks that the slices and the centre are within an image, and that the radius is not larger than the image.
    ///
    /// # Errors
    /// [`ImageError::Parameter`].
    pub(crate) fn check_in<T>(&self, image: &Volume<T>) -> Result<(), ImageError> {
        let [nx, ny, nz] = image.shape;
        if let Some([_, last]) = self.slices.filter(|[_, last]| *last > nz) {
            return Err(ImageError::Parameter {
                field: "region.slices",
                value: last as f64,
                requirement: "within the slices of the image",
            });
        }
        let largest = nx.max(ny) as f64 / 2.0;
        if let Some(value) = self.radius_px.filter(|&radius| radius > largest + 0.5) {
            return Err(ImageError::Parameter {
                field: "region.radius_px",
                value,
                requirement: "at most half of the image's longer side (voxels)",
            });
        }
        if let Some([x, y]) = self.centre_px {
            let is_in = |c: f64, side: usize| (0.0..=side as f64).contains(&c);
            if !(is_in(x, nx) && is_in(y, ny)) {
                let value = if is_in(x, nx) { y } else { x };
                let requirement = "within the image (voxels)";
                return Err(ImageError::Parameter {
                    field: "region.centre_px",
                    value,
                    requirement,
                });
            }
        }
        Ok(())
    }

    /// Returns whether no value is given, not even a mask.
    pub(crate) fn is_unset(&self) -> bool {
        *self == Self::default()
    }

    /// Returns whether no value except the mask is given.
    pub(crate) fn is_empty(&self) -> bool {
        self.centre_px.is_none() && self.radius_px.is_none() && self.slices.is_none()
    }

    /// Returns the cylinder of the region, or `None` if centre, radius or slices are missing.
    pub(crate) fn fit(&self) -> Option<Fit> {
        let (centre, radius, [first, last]) = (self.centre_px?, self.radius_px?, self.slices?);
        let (bottom, top) = ((first - 1) as f64, last as f64);
        Some(Fit { centre, radius, bottom, top, lean: [0.0; 2], wander: 0.0, scatter: 0.0 })
    }

    /// Replaces the values of a fitted cylinder by the given values.
    pub(crate) fn overriding(&self, fit: Fit) -> Fit {
        if self.is_empty() {
            return fit;
        }
        let [bottom, top] = match self.slices {
            Some([first, last]) => [(first - 1) as f64, last as f64],
            None => [fit.bottom, fit.top],
        };
        let (centre, radius) =
            (self.centre_px.unwrap_or(fit.centre), self.radius_px.unwrap_or(fit.radius));
        let lean = if self.centre_px.is_some() { [0.0; 2] } else { fit.lean };
        Fit { centre, radius, bottom, top, lean, ..fit }
    }

    /// Returns a copy of the image with air outside the given region, or `None` if neither slices nor a disc are given.
    pub(crate) fn restricted(&self, image: &Volume<u16>, air: f64) -> Option<Volume<u16>> {
        self.with_outside(image, air.round() as u16)
    }

    /// Returns a copy of the image with the value `outside` outside the given slices and disc, or `None` if neither
    /// slices nor a disc are given.
    pub(crate) fn with_outside<T: Copy>(&self, image: &Volume<T>, outside: T) -> Option<Volume<T>> {
        let disc = self.centre_px.zip(self.radius_px);
        if disc.is_none() && self.slices.is_none() {
            return None;
        }
        let [nx, ny, _] = image.shape;
        let mut values = image.values.clone();
        for (z, slice) in values.chunks_exact_mut(nx * ny).enumerate() {
            let is_out = self.slices.is_some_and(|[first, last]| z + 1 < first || z >= last);
            for (n, value) in slice.iter_mut().enumerate() {
                let [x, y] = [n % nx, n / nx].map(|c| c as f64 + 0.5);
                let is_off = |([cx, cy], r): ([f64; 2], f64)| (x - cx).hypot(y - cy) > r;
                if is_out || disc.is_some_and(is_off) {
                    *value = outside;
                }
            }
        }
        Some(image.with(values))
    }
}

/// Returns the voxels of the specimen in a mask: the voxels with at least half of the mask's largest value.
///
/// # Errors
/// [`ImageError::Mask`] if the mask and the image differ in shape, [`ImageError::NoContrast`] for an empty mask.
pub(crate) fn masked<T>(mask: &Volume<f32>, image: &Volume<T>) -> Result<Vec<u8>, ImageError> {
    if mask.shape != image.shape {
        return Err(ImageError::Mask { mask: mask.shape, image: image.shape });
    }
    let most = mask.values.iter().copied().fold(0.0, f32::max);
    if most <= 0.0 {
        return Err(ImageError::NoContrast {
            what: "region.mask has no voxel above 0".to_owned(),
            help: "give the specimen's voxels a value above 0",
        });
    }
    Ok(mask.values.iter().map(|&value| u8::from(value >= 0.5 * most)).collect())
}
