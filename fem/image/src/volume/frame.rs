//! The frame of an image that holds no data: what reconstruction leaves outside its circle.

use rayon::prelude::*;

use crate::Volume;

/// The circle touches the nearest sides of the image within this share of its radius.
const TOUCHES: f64 = 0.9;

/// An image whose corners all have one exact value outside a circle about the middle of its slices: with the grey value of
/// what is just inside the circle there. Nothing if the image is none.
///
/// Grey values of air scatter; an exact value that fills the corners of all slices and is hardly met within the circle was
/// written by the reconstruction.
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
    let is_within = |n: usize| off(n) < TOUCHES * half;
    let (mut within, mut hit, mut beyond) = (0_u64, 0_u64, 0_u64);
    let mut around = Vec::new();
    for slice in image.values.chunks_exact(nx * ny) {
        for (n, &grey) in slice.iter().enumerate() {
            let is_value = grey == value;
            if is_within(n) {
                within += 1;
                hit += u64::from(is_value);
                if !is_value && off(n) > (TOUCHES - 0.05) * half {
                    around.push(grey);
                }
            } else {
                beyond += u64::from(is_value);
            }
        }
    }
    if hit * 100 > within || beyond * 20 < within || around.is_empty() {
        return None;
    }
    // air is the darker half of what is just inside
    around.sort_unstable_by(f32::total_cmp);
    let air = around[around.len() / 4];
    let fill = |&grey: &f32| if grey == value { air } else { grey };
    Some(image.with(image.values.par_iter().map(fill).collect()))
}
