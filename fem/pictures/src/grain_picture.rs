//! Picture of labelled grains with a transparent matrix.

use fem_image::Volume;
use rayon::prelude::*;

use crate::camera::{Camera, light};
use crate::raster::{Colour, Raster, grain_colour, lit};

/// Longer side of the drawing in pixels. The final picture has half this size: each of its pixels is the mean of four
/// drawn pixels.
const SIDE: f64 = 1200.0;
const BACKGROUND: Colour = [255; 3];
/// Half width in voxels of the neighbourhood from which the normal of a surface is computed.
const AROUND: i64 = 2;

/// Draws the grains as seen from the side and slightly above. Each pixel shows the first grain on its ray.
pub fn grain_picture(labels: &Volume<u32>) -> Raster {
    let camera = Camera::new();
    let size = labels.shape.map(|n| n as f64);
    let corners =
        (0..8).map(|c| camera.project([0, 1, 2].map(|k| size[k] * f64::from(c >> k & 1))));
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for corner in corners {
        for k in 0..3 {
            low[k] = low[k].min(corner[k]);
            high[k] = high[k].max(corner[k]);
        }
    }
    let pixel = (high[0] - low[0]).max(high[1] - low[1]) / SIDE;
    let [width, height] = [0, 1].map(|k| ((high[k] - low[k]) / pixel).ceil().max(2.0) as usize);
    let rows: Vec<Vec<Colour>> = (0..height)
        .into_par_iter()
        .map(|row| {
            let at = |column: usize| {
                let x = low[0] + (column as f64 + 0.5) * pixel;
                let y = low[1] + (row as f64 + 0.5) * pixel;
                let start = camera.unproject([x, y, high[2]]);
                first_grain(labels, start, camera.towards.map(|t| -t))
            };
            (0..width).map(|column| at(column).map_or(BACKGROUND, |v| shaded(labels, v))).collect()
        })
        .collect();
    Raster::from_rows(width, rows).halved()
}

/// Returns the first voxel of a grain on a ray; coordinates are in voxels. The ray is followed from face to face of the
/// voxel grid (Amanatides & Woo, Eurographics 1987).
fn first_grain(labels: &Volume<u32>, start: [f64; 3], way: [f64; 3]) -> Option<[usize; 3]> {
    let size = labels.shape.map(|n| n as f64);
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for k in 0..3 {
        let (a, b) = (-start[k] / way[k], (size[k] - start[k]) / way[k]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    if enter >= leave {
        return None;
    }
    let inside = |k: usize| (start[k] + enter * way[k]).floor().clamp(0.0, size[k] - 1.0) as i64;
    let mut voxel = [inside(0), inside(1), inside(2)];
    let step = way.map(|w| if w > 0.0 { 1 } else { -1 });
    // for each axis: distance along the ray to the next voxel face that is normal to the axis, and distance between two
    // such faces
    let mut next = [0, 1, 2].map(|k| {
        let face = voxel[k] + i64::from(step[k] > 0);
        (face as f64 - start[k]) / way[k]
    });
    let apart = way.map(|w| (1.0 / w).abs());
    loop {
        let index = voxel.map(|v| v as usize);
        if *labels.at(index) > 0 {
            return Some(index);
        }
        let k = match (next[0] <= next[1], next[0] <= next[2], next[1] <= next[2]) {
            (true, true, _) => 0,
            (_, _, true) => 1,
            _ => 2,
        };
        voxel[k] += step[k];
        if !(0..labels.shape[k] as i64).contains(&voxel[k]) {
            return None;
        }
        next[k] += apart[k];
    }
}

/// Returns the colour of a grain at a voxel of its surface, with shading. The surface normal is estimated: it points to
/// the side on which the grain has fewer voxels.
fn shaded(labels: &Volume<u32>, voxel: [usize; 3]) -> Colour {
    let grain = *labels.at(voxel);
    let mut normal = [0.0; 3];
    for dz in -AROUND..=AROUND {
        for dy in -AROUND..=AROUND {
            for dx in -AROUND..=AROUND {
                let offset = [dx, dy, dz];
                let index = [0, 1, 2].map(|k| voxel[k] as i64 + offset[k]);
                let inside = (0..3).all(|k| (0..labels.shape[k] as i64).contains(&index[k]));
                if inside && *labels.at(index.map(|p| p as usize)) == grain {
                    (0..3).for_each(|k| normal[k] -= offset[k] as f64);
                }
            }
        }
    }
    let length = normal.iter().map(|n| n * n).sum::<f64>().sqrt().max(1.0);
    lit(grain_colour(grain), light(normal.map(|n| n / length)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ball() -> Volume<u32> {
        let side = 40;
        let label = |n: usize| {
            let p = [n % side, n / side % side, n / (side * side)];
            let r2: f64 = p.iter().map(|&i| (i as f64 + 0.5 - 20.0).powi(2)).sum();
            u32::from(r2 < 15.0 * 15.0)
        };
        Volume { shape: [side; 3], voxel_mm: 0.1, values: (0..side.pow(3)).map(label).collect() }
    }

    #[test]
    fn a_ball_covers_its_disc_and_is_lit_from_above() {
        let labels = ball();
        let camera = Camera::new();
        let way = camera.towards.map(|t| -t);
        let [x, y, _] = camera.project([20.0; 3]);
        let hit = |r: f64, angle: f64| {
            let start = camera.unproject([x + r * angle.cos(), y + r * angle.sin(), 200.0]);
            first_grain(&labels, start, way)
        };
        for k in 0..24 {
            let angle = f64::from(k) * 0.26;
            assert!(hit(14.0, angle).is_some(), "inside the disc at {angle}");
            assert!(hit(16.0, angle).is_none(), "outside the disc at {angle}");
        }
        let brightness = |v: [usize; 3]| shaded(&labels, v).map(u32::from).iter().sum::<u32>();
        let (top, bottom) = (hit(14.0, -1.57).unwrap(), hit(14.0, 1.57).unwrap());
        assert!(brightness(top) > brightness(bottom));
    }

    #[test]
    fn a_picture_without_grains_is_empty() {
        let labels = Volume { shape: [3, 4, 5], voxel_mm: 1.0, values: vec![0; 60] };
        let picture = grain_picture(&labels);
        assert_eq!(picture, Raster::new(picture.width(), picture.height(), BACKGROUND));
    }
}
