//! The frame without data that a reconstruction writes outside its circular field of view.

use rayon::prelude::*;

use crate::Volume;

/// Share of the radius of the field of view (a circle that touches the nearest sides of the image) within which the
/// value of the frame must be rare.
const INNER_RADIUS: f64 = 0.9;
/// Width (voxels) of the ring inside the edge of the field of view whose grey values determine the grey value of air.
const AIR: usize = 2;

/// Replaces the frame of an image by the grey value of air; returns `None` if the image has no frame. An image has a
/// frame if all corners of its slices have exactly the same value, and this value is rare inside the circle and
/// frequent outside the circle.
///
/// Grey values of air vary from voxel to voxel. An exact value that fills the corners of all slices and hardly occurs
/// within the circle was therefore written by the reconstruction.
pub(crate) fn filled_frame(image: &Volume<f32>) -> Option<Volume<f32>> {
    let [nx, ny, nz] = image.shape;
    let value = image.values[0];
    let corners = (0..nz).flat_map(|z| {
        [[0, 0], [nx - 1, 0], [0, ny - 1], [nx - 1, ny - 1]].map(|[x, y]| x + nx * (y + ny * z))
    });
    if corners.into_iter().any(|at| image.values[at] != value) {
        return None;
    }
    let half = 0.5 * nx.min(ny) as f64;
    let off = |n: usize| {
        let [x, y] = [(n % nx) as f64 + 0.5, (n / nx) as f64 + 0.5];
        (x - 0.5 * nx as f64).hypot(y - 0.5 * ny as f64)
    };
    // for each distance from the middle (rounded down to whole voxels): the number of voxels, and the number of voxels
    // with the exact value of the corners
    let mut rings = vec![[0_u64; 2]; half as usize + 1];
    let mut beyond = 0_u64;
    for slice in image.values.chunks_exact(nx * ny) {
        for (n, &grey) in slice.iter().enumerate() {
            let is_value = u64::from(grey == value);
            match rings.get_mut(off(n) as usize) {
                Some([voxels, exact]) => {
                    *voxels += 1;
                    *exact += is_value;
                }
                None => beyond += is_value,
            }
        }
    }
    let (inner, outer) = rings.split_at((INNER_RADIUS * half) as usize);
    let sum = |rings: &[[u64; 2]], k: usize| rings.iter().map(|ring| ring[k]).sum::<u64>();
    let (within, hit) = (sum(inner, 0), sum(inner, 1));
    beyond += sum(outer, 1);
    if hit * 100 > within || beyond * 20 < within {
        return None;
    }
    // look for air in the outermost voxels inside the circle, which contain air except where the specimen reaches them
    let edge = rings.iter().rposition(|[voxels, exact]| 2 * exact < *voxels)?;
    let is_at_edge = |n: usize| (edge.saturating_sub(AIR)..=edge).contains(&(off(n) as usize));
    let slices = image.values.chunks_exact(nx * ny);
    let in_slice = |slice: &[f32]| -> Vec<f32> {
        let inside = slice.iter().enumerate().filter(|(n, grey)| is_at_edge(*n) && **grey != value);
        inside.map(|(_, &grey)| grey).collect()
    };
    let mut around: Vec<f32> = slices.flat_map(in_slice).collect();
    if around.is_empty() {
        return None;
    }
    // assume that the darker half of these voxels is air: the median of the darker half is the first quartile of all
    // values
    around.sort_unstable_by(f32::total_cmp);
    let air = around[around.len() / 4];
    let fill = |&grey: &f32| if grey == value { air } else { grey };
    Some(image.with(image.values.par_iter().map(fill).collect()))
}
