//! Position and size of a cylindrical specimen in its image.

use crate::Volume;

/// A cylinder, in mm from the corner of the image: an upright cylinder, rotated about the middle of its axis until the
/// axis has the slopes of `lean`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Coordinates x and y of the middle of the axis (mm).
    pub centre_mm: [f64; 2],
    /// Radius (mm).
    pub radius_mm: f64,
    /// Coordinate z of the lower end before the rotation (mm).
    pub bottom_mm: f64,
    /// Coordinate z of the upper end before the rotation (mm).
    pub top_mm: f64,
    /// Slopes dx/dz and dy/dz of the axis; `[0.0; 2]` for an upright cylinder.
    pub lean: [f64; 2],
}

impl Cylinder {
    /// Returns the height along the axis (mm).
    pub fn height_mm(&self) -> f64 {
        self.top_mm - self.bottom_mm
    }

    /// Returns the volume (mm³).
    pub fn volume_mm3(&self) -> f64 {
        std::f64::consts::PI * self.radius_mm.powi(2) * self.height_mm()
    }

    /// Returns the largest upright cylinder inside a volume.
    pub(crate) fn within<T>(volume: &Volume<T>) -> Cylinder {
        let [x, y, z] = volume.size_mm();
        let centre_mm = [x / 2.0, y / 2.0];
        let radius_mm = x.min(y) / 2.0;
        Cylinder { centre_mm, radius_mm, bottom_mm: 0.0, top_mm: z, lean: [0.0; 2] }
    }

    /// Converts a point of the image (mm from the corner of the image) to the coordinates of the specimen (mm): the
    /// lower end is at z = 0, and the axis is z.
    pub fn to_specimen(&self, point: [f64; 3]) -> [f64; 3] {
        let [x, y] = [0, 1].map(|k| point[k] - self.centre_mm[k]);
        if self.lean == [0.0; 2] {
            return [x, y, point[2] - self.bottom_mm];
        }
        let off = [x, y, point[2] - self.middle_mm()];
        let along = |axis: [f64; 3]| (0..3).map(|k| axis[k] * off[k]).sum::<f64>();
        let [x, y, z] = self.axes().map(along);
        [x, y, z + 0.5 * self.height_mm()]
    }

    /// Converts a point of the specimen (mm) to coordinates of the image (mm), the inverse of
    /// [`to_specimen`](Self::to_specimen).
    pub fn to_image(&self, point: [f64; 3]) -> [f64; 3] {
        let [cx, cy] = self.centre_mm;
        let [x, y, z] = point;
        if self.lean == [0.0; 2] {
            return [x + cx, y + cy, z + self.bottom_mm];
        }
        let from_middle = [x, y, z - 0.5 * self.height_mm()];
        let axes = self.axes();
        let middle = [cx, cy, self.middle_mm()];
        std::array::from_fn(|k| {
            middle[k] + (0..3).map(|n| axes[n][k] * from_middle[n]).sum::<f64>()
        })
    }

    /// Returns the z coordinate of the middle of the axis (mm).
    fn middle_mm(&self) -> f64 {
        0.5 * (self.bottom_mm + self.top_mm)
    }

    /// Returns the axes of the specimen in the coordinates of the image: x, y and z after the smallest rotation that
    /// turns z onto the axis of the cylinder.
    fn axes(&self) -> [[f64; 3]; 3] {
        let [p, q] = self.lean;
        let z = (1.0 + p * p + q * q).sqrt().recip();
        let [x, y] = [p * z, q * z];
        let part = 1.0 / (1.0 + z);
        [
            [1.0 - x * x * part, -x * y * part, -x],
            [-x * y * part, 1.0 - y * y * part, -y],
            [x, y, z],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn to_image_and_to_specimen_are_inverse() {
        let upright = Cylinder {
            centre_mm: [3.0, 2.0],
            radius_mm: 1.0,
            bottom_mm: 0.5,
            top_mm: 4.5,
            lean: [0.0; 2],
        };
        for lean in [[0.0, 0.0], [0.1, -0.05], [0.3, 0.4]] {
            let cylinder = Cylinder { lean, ..upright };
            let near = |a: [f64; 3], b: [f64; 3]| {
                assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-13), "{a:?}, not {b:?}");
            };
            for point in [[0.0, 0.0, 0.0], [0.7, -0.2, 1.1], [-1.0, 0.4, 4.0]] {
                near(cylinder.to_specimen(cylinder.to_image(point)), point);
            }
            // the rotation changes neither the middle of the axis nor lengths; after the rotation, the axis has the
            // slopes `lean`
            near(cylinder.to_image([0.0, 0.0, 2.0]), [3.0, 2.0, 2.5]);
            let [bottom, top] = [0.0, 4.0].map(|z| cylinder.to_image([0.0, 0.0, z]));
            let way = [0, 1, 2].map(|k| top[k] - bottom[k]);
            near(way, [lean[0] * way[2], lean[1] * way[2], way[2]]);
            let across = cylinder.to_image([1.0, 0.0, 2.0]);
            let square: f64 = (0..3).map(|k| (across[k] - [3.0, 2.0, 2.5][k]).powi(2)).sum();
            let dot: f64 = (0..3).map(|k| (across[k] - [3.0, 2.0, 2.5][k]) * way[k]).sum();
            assert!((square - 1.0).abs() < 1e-13 && dot.abs() < 1e-13, "{square} {dot}");
        }
    }
}
