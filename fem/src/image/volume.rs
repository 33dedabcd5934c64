//! Voxels.

use super::ImageError;

/// The most voxels of a volume: they are numbered by 32 bits.
pub(crate) const MAX_VOXELS: u64 = u32::MAX as u64;

/// Values on a grid of cubic voxels, x fastest, then y, then z (the slices).
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
    /// A volume of these values.
    ///
    /// # Errors
    /// [`ImageError`] if there is not one value for each voxel, if there is none, or if `voxel_mm` is
    /// not above 0.
    ///
    /// # Example
    /// ```
    /// let volume = fem::Volume::new([2, 1, 1], 0.01, vec![3_u8, 4])?;
    /// assert_eq!(volume.at([1, 0, 0]), &4);
    /// # Ok::<(), fem::ImageError>(())
    /// ```
    pub fn new(shape: [usize; 3], voxel_mm: f64, values: Vec<T>) -> Result<Self, ImageError> {
        let volume = Volume { shape, voxel_mm, values };
        volume.check()?;
        Ok(volume)
    }

    /// Whether shape, values and size fit each other.
    pub(crate) fn check(&self) -> Result<(), ImageError> {
        let voxels = self.shape.iter().try_fold(1_u64, |n, &side| n.checked_mul(side as u64));
        if voxels != Some(self.values.len() as u64) || self.values.is_empty() {
            return Err(ImageError::Shape { shape: self.shape, values: self.values.len() });
        }
        if self.values.len() as u64 > MAX_VOXELS {
            let voxels = self.values.len() as u64;
            return Err(ImageError::TooManyVoxels { voxels, limit: MAX_VOXELS });
        }
        if !(self.voxel_mm.is_finite() && self.voxel_mm > 0.0) {
            return Err(ImageError::Parameter {
                field: "voxel_mm",
                value: self.voxel_mm,
                requirement: "a length above 0 (mm)",
            });
        }
        Ok(())
    }

    /// The value of voxel (i, j, k).
    ///
    /// # Panics
    /// If there is no such voxel.
    pub fn at(&self, voxel: [usize; 3]) -> &T {
        &self.values[self.index(voxel)]
    }

    /// The place of voxel (i, j, k) in `values`.
    pub fn index(&self, [i, j, k]: [usize; 3]) -> usize {
        let [nx, ny, nz] = self.shape;
        assert!(i < nx && j < ny && k < nz, "voxel {:?} of {:?}", [i, j, k], self.shape);
        i + nx * (j + ny * k)
    }

    /// Edges of the whole volume (mm).
    pub fn size_mm(&self) -> [f64; 3] {
        self.shape.map(|side| side as f64 * self.voxel_mm)
    }

    /// The same grid with other values.
    pub(crate) fn with<U>(&self, values: Vec<U>) -> Volume<U> {
        Volume { shape: self.shape, voxel_mm: self.voxel_mm, values }
    }
}

/// The voxel (i, j, k) at a place in the values.
pub(crate) fn voxel_at([nx, ny, _]: [usize; 3], index: usize) -> [usize; 3] {
    [index % nx, index / nx % ny, index / (nx * ny)]
}

/// The 26 neighbours of a voxel: their steps along x, y, z.
pub(crate) fn neighbour_steps() -> impl Iterator<Item = [isize; 3]> {
    let all = (0..27).map(|n| [n % 3 - 1, n / 3 % 3 - 1, n / 9 - 1]);
    all.filter(|step| *step != [0, 0, 0])
}
