//! Pictures of slices through an image, with the outlines of labels.

use crate::{Cylinder, ImageError, Volume};

/// A picture in RGB colours.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RgbSlice {
    /// Number of pixels in a row.
    pub width: usize,
    /// Number of rows; the first row is at the top.
    pub height: usize,
    /// Three bytes for each pixel, row after row.
    pub pixels: Vec<u8>,
}

/// Colours of outlines, which distinguish neighbouring labels on a grey image.
const COLOURS: [[u8; 3]; 8] = [
    [230, 85, 13],
    [49, 163, 84],
    [49, 130, 189],
    [227, 26, 140],
    [253, 191, 0],
    [0, 180, 190],
    [150, 90, 220],
    [170, 210, 40],
];

/// Colour of a cylinder's outline.
const CYLINDER: [u8; 3] = [255, 255, 0];

impl RgbSlice {
    /// Draws the outline of a cylinder into the picture of the slice `index` across an axis; the picture has the
    /// orientation of [`outlined_slice`].
    pub fn draw_cylinder(&mut self, cylinder: &Cylinder, voxel_mm: f64, axis: usize, index: usize) {
        let is_inside = |column: usize, row: usize| {
            let row = if axis == 2 { row } else { self.height - 1 - row };
            let voxel = match axis {
                0 => [index, column, row],
                1 => [column, index, row],
                _ => [column, row, index],
            };
            let [x, y, z] = cylinder.to_specimen(voxel.map(|c| (c as f64 + 0.5) * voxel_mm));
            x.hypot(y) <= cylinder.radius_mm && (0.0..=cylinder.height_mm()).contains(&z)
        };
        let mut edge = Vec::new();
        for row in 0..self.height {
            for column in (0..self.width).filter(|&column| is_inside(column, row)) {
                let is_edge = column == 0
                    || row == 0
                    || column + 1 == self.width
                    || row + 1 == self.height
                    || !is_inside(column - 1, row)
                    || !is_inside(column + 1, row)
                    || !is_inside(column, row - 1)
                    || !is_inside(column, row + 1);
                if is_edge {
                    edge.push(3 * (column + self.width * row));
                }
            }
        }
        for at in edge {
            self.pixels[at..at + 3].copy_from_slice(&CYLINDER);
        }
    }
}

/// Returns a grey picture of the slice `index` across an axis (0, 1, 2 for x, y, z), with a coloured outline of each
/// label.
///
/// Slices across z have x to the right and y downwards; slices across x or y have z upwards.
///
/// # Errors
/// [`ImageError`] if the shapes of the volumes differ or the slice does not exist.
pub fn outlined_slice(
    grey: &Volume<f32>,
    labels: &Volume<u32>,
    axis: usize,
    index: usize,
) -> Result<RgbSlice, ImageError> {
    grey.check()?;
    labels.check()?;
    if grey.shape != labels.shape {
        return Err(ImageError::Shape { shape: grey.shape, values: labels.values.len() });
    }
    if axis > 2 || index >= grey.shape[axis] {
        return Err(ImageError::Parameter {
            field: "slice",
            value: index as f64,
            requirement: "a slice of the volume, across axis 0, 1 or 2",
        });
    }
    let [right, down] = [[1, 2], [0, 2], [0, 1]][axis];
    let [width, height] = [grey.shape[right], grey.shape[down]];
    let voxel = |column: usize, row: usize| {
        let mut voxel = [index; 3];
        voxel[right] = column;
        voxel[down] = if axis == 2 { row } else { height - 1 - row };
        voxel
    };
    let (mut least, mut most) = (f32::INFINITY, f32::NEG_INFINITY);
    for row in 0..height {
        for column in 0..width {
            let value = *grey.at(voxel(column, row));
            (least, most) = (least.min(value), most.max(value));
        }
    }
    let mut pixels = Vec::with_capacity(3 * width * height);
    for row in 0..height {
        for column in 0..width {
            let label = *labels.at(voxel(column, row));
            let other = |column: usize, row: usize| *labels.at(voxel(column, row)) != label;
            let edge = label != 0
                && ((column > 0 && other(column - 1, row))
                    || (column + 1 < width && other(column + 1, row))
                    || (row > 0 && other(column, row - 1))
                    || (row + 1 < height && other(column, row + 1)));
            let value = *grey.at(voxel(column, row));
            let bright = (255.0 * (value - least) / (most - least).max(f32::MIN_POSITIVE)) as u8;
            pixels.extend(if edge { COLOURS[label as usize % COLOURS.len()] } else { [bright; 3] });
        }
    }
    Ok(RgbSlice { width, height, pixels })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_coloured_and_the_rest_is_grey() {
        let shape = [5, 4, 3];
        let grey = Volume::new(shape, 1.0, (0..60).map(|n| n as f32).collect()).unwrap();
        let mut labels = Volume::new(shape, 1.0, vec![0; 60]).unwrap();
        for (x, y) in [(1, 1), (2, 1), (3, 1), (1, 2), (2, 2), (3, 2), (1, 3), (2, 3), (3, 3)] {
            let at = labels.index([x, y, 1]);
            labels.values[at] = 3;
        }
        let slice = outlined_slice(&grey, &labels, 2, 1).unwrap();
        assert_eq!((slice.width, slice.height, slice.pixels.len()), (5, 4, 60));
        let pixel = |x: usize, y: usize| &slice.pixels[3 * (x + 5 * y)..][..3];
        assert_eq!(pixel(1, 1), COLOURS[3]);
        // the interior of the label and the corner of the image are not coloured
        assert!(pixel(2, 2).iter().all(|&c| c == pixel(2, 2)[0]));
        assert_eq!(pixel(0, 0), [0; 3]);
        let upright = outlined_slice(&grey, &labels, 1, 2).unwrap();
        assert_eq!((upright.width, upright.height), (5, 3));
        assert!(outlined_slice(&grey, &labels, 1, 4).is_err());
    }
}
