//! Volumes of voxels, and operations on volumes that do not depend on specimens: filters, distances, connected
//! components, grey values.

pub(crate) mod components;
pub(crate) mod contrast;
pub(crate) mod cylinder;
pub(crate) mod disjoint_sets;
pub(crate) mod distance;
pub(crate) mod filter;
pub(crate) mod frame;
pub(crate) mod grey;
pub(crate) mod threshold;

use crate::ImageError;

/// Maximum number of voxels of a volume, including a rim of one voxel on each side: voxel numbers have 32 bits.
pub(crate) const MAX_VOXELS: u64 = u32::MAX as u64;

/// Checks that the number of voxels of a shape is not too large, after each block of `bin`³ voxels was averaged to one
/// voxel.
///
/// # Errors
/// [`ImageError::TooManyVoxels`], with the smallest sufficient `bin`.
pub(crate) fn check_count(shape: [usize; 3], bin: usize) -> Result<(), ImageError> {
    let rimmed = |bin: usize| {
        let along = shape.map(|side| (side / bin) as u64 + 2);
        along.into_iter().fold(1, u64::saturating_mul)
    };
    if rimmed(bin) <= MAX_VOXELS {
        return Ok(());
    }
    let least = (bin + 1..).find(|&bin| rimmed(bin) <= MAX_VOXELS).unwrap_or(usize::MAX);
    Err(ImageError::TooManyVoxels { shape, limit: MAX_VOXELS, bin: least })
}

/// Values on a grid of cubic voxels. In memory, x varies fastest, then y, then z (the number of the slice).
///
/// Voxel (i, j, k) has its centre at ((i + ½), (j + ½), (k + ½)) · `voxel_mm`. The axis of a specimen
/// is z.
#[derive(Clone, Debug, PartialEq)]
pub struct Volume<T> {
    /// Voxels along x, y and z.
    pub shape: [usize; 3],
    /// Edge of a voxel (mm).
    pub voxel_mm: f64,
    /// One value for each voxel.
    pub values: Vec<T>,
}

impl<T> Volume<T> {
    /// Creates a volume with given values.
    ///
    /// # Errors
    /// [`ImageError`] if the number of values is not the number of voxels, if there are no voxels, or if `voxel_mm` is
    /// not above 0.
    ///
    /// # Example
    /// ```
    /// let volume = fem_image::Volume::new([2, 1, 1], 0.01, vec![3_u8, 4])?;
    /// assert_eq!(volume.at([1, 0, 0]), &4);
    /// # Ok::<(), fem_image::ImageError>(())
    /// ```
    pub fn new(shape: [usize; 3], voxel_mm: f64, values: Vec<T>) -> Result<Self, ImageError> {
        let volume = Volume { shape, voxel_mm, values };
        volume.check()?;
        Ok(volume)
    }

    /// Checks that the shape fits the number of values, that the voxels can be numbered, and that `voxel_mm` is above
    /// 0.
    pub(crate) fn check(&self) -> Result<(), ImageError> {
        let voxels = self.shape.iter().try_fold(1_u64, |n, &side| n.checked_mul(side as u64));
        if voxels != Some(self.values.len() as u64) || self.values.is_empty() {
            return Err(ImageError::Shape { shape: self.shape, values: self.values.len() });
        }
        check_count(self.shape, 1)?;
        if !(self.voxel_mm.is_finite() && self.voxel_mm > 0.0) {
            return Err(ImageError::Parameter {
                field: "voxel_mm",
                value: self.voxel_mm,
                requirement: "a length above 0 (mm)",
            });
        }
        Ok(())
    }

    /// Returns the value of voxel (i, j, k).
    ///
    /// # Panics
    /// If there is no such voxel.
    pub fn at(&self, voxel: [usize; 3]) -> &T {
        &self.values[self.index(voxel)]
    }

    /// Returns the index of voxel (i, j, k) in `values`.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, nz] = self.shape;
        assert!(i < nx && j < ny && k < nz, "voxel {:?} of {:?}", [i, j, k], self.shape);
        i + nx * (j + ny * k)
    }

    /// Returns the edges of the whole volume (mm).
    pub fn size_mm(&self) -> [f64; 3] {
        self.shape.map(|side| side as f64 * self.voxel_mm)
    }

    /// Returns a volume with the same grid and other values.
    pub(crate) fn with<U>(&self, values: Vec<U>) -> Volume<U> {
        Volume { shape: self.shape, voxel_mm: self.voxel_mm, values }
    }
}

/// Returns the voxel (i, j, k) whose value has the given index.
pub(crate) fn voxel_at([nx, ny, _]: [usize; 3], index: usize) -> [usize; 3] {
    [index % nx, index / nx % ny, index / (nx * ny)]
}

/// Iterates over the steps along x, y, z to the 26 neighbours of a voxel.
pub(crate) fn neighbour_steps() -> impl Iterator<Item = [isize; 3]> {
    let all = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
    all.filter(|step| *step != [0, 0, 0])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_name_the_smallest_sufficient_bin() {
        for (shape, bin, least) in [
            ([1600, 1600, 1600], 1, None),
            // without the rim, the number of voxels (4.29e9) is below the limit; with the rim, it is above the limit
            ([1625, 1625, 1626], 1, Some(2)),
            ([4000, 4000, 5000], 1, Some(3)),
            ([4000, 4000, 5000], 2, Some(3)),
            ([4000, 4000, 5000], 3, None),
        ] {
            match (check_count(shape, bin), least) {
                (Ok(()), None) => {}
                (Err(error @ ImageError::TooManyVoxels { .. }), Some(least)) => {
                    assert_eq!(check_count(shape, least).map_err(|e| e.to_string()), Ok(()));
                    assert!(least == bin + 1 || check_count(shape, least - 1).is_err());
                    let remedy = format!("bin = {least} in [specimen.image]");
                    assert!(error.to_string().contains(&remedy), "{error}");
                }
                (other, _) => panic!("{shape:?}, {bin}: {other:?}"),
            }
        }
    }
}
