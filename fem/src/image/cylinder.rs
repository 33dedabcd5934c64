//! Where a cylindrical specimen stands in its image.

use super::{ImageError, Volume};

/// An upright cylinder, in mm from the corner of the image.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cylinder {
    /// Where the axis stands, in x and y (mm).
    pub centre_mm: [f64; 2],
    /// Radius (mm).
    pub radius_mm: f64,
    /// Lower end, in z (mm).
    pub bottom_mm: f64,
    /// Upper end, in z (mm).
    pub top_mm: f64,
}

impl Cylinder {
    /// Height (mm).
    pub fn height_mm(&self) -> f64 {
        self.top_mm - self.bottom_mm
    }

    /// Volume (mm³).
    pub fn volume_mm3(&self) -> f64 {
        std::f64::consts::PI * self.radius_mm.powi(2) * self.height_mm()
    }

    /// The largest upright cylinder in a volume.
    pub(crate) fn within<T>(volume: &Volume<T>) -> Cylinder {
        let [x, y, z] = volume.size_mm();
        let centre_mm = [x / 2.0, y / 2.0];
        Cylinder { centre_mm, radius_mm: x.min(y) / 2.0, bottom_mm: 0.0, top_mm: z }
    }
}

/// A cylinder fitted to an image (in voxels), and how well it fits.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) centre: [f64; 2],
    pub(crate) radius: f64,
    pub(crate) bottom: f64,
    pub(crate) top: f64,
    /// How far the axis wanders between the ends, in x and y (voxels).
    pub(crate) lean: [f64; 2],
    /// Root mean square distance of the wall's points that were kept (voxels).
    pub(crate) scatter: f64,
}

/// Lengths are rounded to this share of a voxel, so that the order of sums does not show.
const GRID: f64 = 1024.0;
/// Directions in an eighth of a turn.
const EIGHTH: usize = 24;
/// Steps of the fit.
const STEPS: usize = 20;

impl Fit {
    pub(crate) fn in_mm(&self, voxel_mm: f64) -> Cylinder {
        Cylinder {
            centre_mm: self.centre.map(|c| c * voxel_mm),
            radius_mm: self.radius * voxel_mm,
            bottom_mm: self.bottom * voxel_mm,
            top_mm: self.top * voxel_mm,
        }
    }

    /// Squared distance of a column of voxels from the axis, in voxels; exact in floating point.
    pub(crate) fn squared_radius(&self, x: usize, y: usize) -> f64 {
        (x as f64 + 0.5 - self.centre[0]).powi(2) + (y as f64 + 0.5 - self.centre[1]).powi(2)
    }

    /// The voxels whose centres are inside by at least `margin` voxels: 1, the others 0.
    pub(crate) fn inside(&self, shape: [usize; 3], margin: f64) -> Vec<u8> {
        let [nx, ny, nz] = shape;
        let radius = (self.radius - margin).max(0.0);
        let mut set = vec![0; nx * ny * nz];
        for (z, slice) in set.chunks_exact_mut(nx * ny).enumerate() {
            let height = z as f64 + 0.5;
            if height < self.bottom + margin || height > self.top - margin {
                continue;
            }
            for (n, voxel) in slice.iter_mut().enumerate() {
                *voxel = u8::from(self.squared_radius(n % nx, n / nx) <= radius * radius);
            }
        }
        set
    }
}

/// Fits an upright cylinder to what is at least as bright as `edge`, the level half way between air and
/// matrix: the ends by the median over columns of where they are entered, axis and radius by least
/// squares over the outermost crossings of many rays, outliers left out. Axis, radius and ends are
/// found between voxels.
///
/// # Errors
/// [`ImageError::NoCylinder`].
pub(crate) fn fit(image: &Volume<u16>, edge: f64) -> Result<Fit, ImageError> {
    let [nx, ny, nz] = image.shape;
    let refuse = |message: String| ImageError::NoCylinder {
        message,
        help: "set specimen = \"block\" if the image was cut out of a specimen, or crop other objects away",
    };
    let Some((centre, radius)) = about(image, edge) else {
        return Err(refuse("nothing is brighter than air".into()));
    };
    let columns = ends(image, edge, centre, 0.8 * radius);
    let Some([bottom, top]) = columns else {
        return Err(refuse("no column crosses it".into()));
    };
    let points = wall(image, edge, centre, radius, [bottom, top]);
    let rays = 8 * EIGHTH * nz;
    let levels = (bottom.ceil() as usize..(top.floor() as usize).min(nz)).len();
    if points.len() < 8 * EIGHTH * levels / 4 || levels < 4 {
        return Err(refuse(format!("only {} of {rays} rays meet its wall", points.len())));
    }
    let middle = (bottom + top) / 2.0;
    let mut this = least_squares(&points, [centre[0], centre[1]], radius, middle);
    this.lean = this.lean.map(|lean| lean * (top - bottom));
    let round = |value: f64| (value * GRID).round() / GRID;
    this.centre = this.centre.map(round);
    this.radius = round(this.radius);
    (this.bottom, this.top) = (round(bottom), round(top));
    let largest = nx.max(ny) as f64;
    let sound =
        this.radius > 3.0 && this.radius < largest && this.scatter < 1.0 + 0.02 * this.radius;
    if !sound || !this.centre.iter().all(|c| c.is_finite()) {
        return Err(refuse(format!(
            "a radius of {:.1} voxels with a scatter of {:.1} was found",
            this.radius, this.scatter
        )));
    }
    Ok(this)
}

/// Centre of gravity of the columns of what is bright, and the radius of a disc of its section.
fn about(image: &Volume<u16>, edge: f64) -> Option<([f64; 2], f64)> {
    let [nx, ny, nz] = image.shape;
    let (mut count, mut sum_x, mut sum_y, mut slices) = (0_u64, 0_u64, 0_u64, 0_u64);
    for slice in image.values.chunks_exact(nx * ny).take(nz) {
        let before = count;
        for (y, row) in slice.chunks_exact(nx).enumerate() {
            for (x, _) in row.iter().enumerate().filter(|&(_, &value)| f64::from(value) >= edge) {
                count += 1;
                sum_x += x as u64;
                sum_y += y as u64;
            }
        }
        slices += u64::from(count - before > (nx * ny) as u64 / 50);
    }
    if count == 0 || slices == 0 {
        return None;
    }
    let mean = |sum: u64| sum as f64 / count as f64 + 0.5;
    let area = count as f64 / slices as f64;
    Some(([mean(sum_x), mean(sum_y)], (area / std::f64::consts::PI).sqrt()))
}

/// Where columns within a radius are entered from below and from above: the medians.
fn ends(image: &Volume<u16>, edge: f64, centre: [f64; 2], radius: f64) -> Option<[f64; 2]> {
    let [nx, ny, nz] = image.shape;
    let (mut low, mut high) = (Vec::new(), Vec::new());
    for y in 0..ny {
        for x in 0..nx {
            let out = (x as f64 + 0.5 - centre[0]).hypot(y as f64 + 0.5 - centre[1]) > radius;
            let value = |z: usize| f64::from(image.values[x + nx * (y + ny * z)]);
            let bright = |&z: &usize| value(z) >= edge;
            let (false, Some(first), Some(last)) =
                (out, (0..nz).find(bright), (0..nz).rev().find(bright))
            else {
                continue;
            };
            // between the centres of the last dark and the first bright voxel
            let part =
                |dark: usize, bright: usize| (edge - value(dark)) / (value(bright) - value(dark));
            low.push(if first == 0 { 0.0 } else { first as f64 - 0.5 + part(first - 1, first) });
            high.push(match last + 1 == nz {
                true => nz as f64,
                false => last as f64 + 1.5 - part(last + 1, last),
            });
        }
    }
    Some([median(&mut low)?, median(&mut high)?])
}

fn median(values: &mut [f64]) -> Option<f64> {
    if values.is_empty() {
        return None;
    }
    let (middle, odd) = (values.len() / 2, values.len() % 2 == 1);
    let (below, &mut upper, _) = values.select_nth_unstable_by(middle, f64::total_cmp);
    if odd {
        return Some(upper);
    }
    let lower = below.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    Some((lower + upper) / 2.0)
}

/// Points of the wall: rays come in from outside, in directions that are symmetric about the axes, and
/// stop where it is bright for a voxel.
fn wall(
    image: &Volume<u16>,
    edge: f64,
    centre: [f64; 2],
    radius: f64,
    [bottom, top]: [f64; 2],
) -> Vec<[f64; 3]> {
    let [nx, ny, nz] = image.shape;
    let mut points = Vec::new();
    let margin = 0.03 * (top - bottom) + 1.0;
    for z in 0..nz {
        let height = z as f64 + 0.5;
        if height < bottom + margin || height > top - margin {
            continue;
        }
        let slice = &image.values[nx * ny * z..][..nx * ny];
        for [cos, sin] in directions() {
            let at = |r: f64| sample(slice, [nx, ny], [centre[0] + r * cos, centre[1] + r * sin]);
            let (mut r, mut outer) = (1.5 * radius, None);
            while r > 0.3 * radius {
                let Some(value) = at(r) else {
                    r -= 0.5;
                    continue;
                };
                match outer {
                    // the wall is not within the image
                    None if value >= edge => break,
                    Some(dark) if value >= edge && at(r - 1.0).is_some_and(|v| v >= edge) => {
                        let r = r + 0.5 * (value - edge) / (value - dark);
                        points.push([centre[0] + r * cos, centre[1] + r * sin, height]);
                        break;
                    }
                    _ => outer = Some(value),
                }
                r -= 0.5;
            }
        }
    }
    points
}

fn directions() -> impl Iterator<Item = [f64; 2]> {
    (0..EIGHTH).flat_map(|n| {
        let angle = (n as f64 + 0.5) / EIGHTH as f64 * std::f64::consts::FRAC_PI_4;
        let (s, c) = angle.sin_cos();
        [[c, s], [s, c], [-s, c], [-c, s], [-c, -s], [-s, -c], [s, -c], [c, -s]]
    })
}

/// The grey value between voxels, bilinear; nothing outside the centres of the outermost.
fn sample(slice: &[u16], [nx, ny]: [usize; 2], [x, y]: [f64; 2]) -> Option<f64> {
    let (x, y) = (x - 0.5, y - 0.5);
    if !(x >= 0.0 && y >= 0.0 && x <= (nx - 1) as f64 && y <= (ny - 1) as f64) {
        return None;
    }
    let (i, j) = (x as usize, y as usize);
    let (p, q) = (x - i as f64, y - j as f64);
    let at = |i: usize, j: usize| f64::from(slice[i.min(nx - 1) + nx * j.min(ny - 1)]);
    let row = |j: usize| at(i, j) * (1.0 - p) + at(i + 1, j) * p;
    Some(row(j) * (1.0 - q) + row(j + 1) * q)
}

/// Axis (position at mid-height and slope) and radius by Gauss–Newton; points further off than three
/// times the median are left out.
fn least_squares(points: &[[f64; 3]], centre: [f64; 2], radius: f64, middle: f64) -> Fit {
    let mut u = nalgebra::SVector::<f64, 5>::from([centre[0], centre[1], 0.0, 0.0, radius]);
    let mut scatter = f64::NAN;
    for _ in 0..STEPS {
        let rows: Vec<_> = points
            .iter()
            .map(|&[x, y, z]| {
                let h = z - middle;
                let (dx, dy) = (x - u[0] - u[2] * h, y - u[1] - u[3] * h);
                let r = dx.hypot(dy).max(1e-9);
                let row = [-dx / r, -dy / r, -dx / r * h, -dy / r * h, -1.0];
                (r - u[4], nalgebra::SVector::<f64, 5>::from(row))
            })
            .collect();
        let mut off: Vec<f64> = rows.iter().map(|(residual, _)| residual.abs()).collect();
        let limit = 3.0 * median(&mut off).unwrap_or(0.0).max(0.02);
        let mut normal = nalgebra::SMatrix::<f64, 5, 5>::zeros();
        let mut right = nalgebra::SVector::<f64, 5>::zeros();
        let (mut squares, mut kept) = (0.0, 0.0);
        for (residual, row) in rows.iter().filter(|(residual, _)| residual.abs() <= limit) {
            normal += row * row.transpose();
            right -= row * *residual;
            squares += residual * residual;
            kept += 1.0;
        }
        scatter = f64::sqrt(squares / kept);
        let Some(factor) = normal.cholesky() else { break };
        let step = factor.solve(&right);
        u += step;
        if step.norm() < 1e-9 {
            break;
        }
    }
    Fit { centre: [u[0], u[1]], radius: u[4], bottom: 0.0, top: 0.0, lean: [u[2], u[3]], scatter }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    /// A cylinder with soft edges, noise, bright specks in the air and notches in the wall.
    fn image(truth: &Fit, shape: [usize; 3]) -> Volume<u16> {
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(6);
        let mut image = Volume::new(shape, 1.0, vec![0; shape.iter().product()]).unwrap();
        let middle = (truth.bottom + truth.top) / 2.0;
        for z in 0..shape[2] {
            for y in 0..shape[1] {
                for x in 0..shape[0] {
                    let h = (z as f64 + 0.5 - middle) / (truth.top - truth.bottom);
                    let at =
                        [x as f64 + 0.5 - h * truth.lean[0], y as f64 + 0.5 - h * truth.lean[1]];
                    let off = (at[0] - truth.centre[0]).hypot(at[1] - truth.centre[1]);
                    let outside = (off - truth.radius)
                        .max(truth.bottom - z as f64 - 0.5)
                        .max(z as f64 + 0.5 - truth.top);
                    let share = (0.5 - outside / 3.0).clamp(0.0, 1.0);
                    let notch = x < 30 && y.abs_diff(24) < 3 && z % 9 < 4;
                    let speck = (x, y) == (2, 40);
                    let share = if speck {
                        1.0
                    } else if notch {
                        0.0
                    } else {
                        share
                    };
                    let value = 10_000.0 + 20_000.0 * share + rng.random_range(-2000.0..2000.0);
                    let at = image.index([x, y, z]);
                    image.values[at] = value as u16;
                }
            }
        }
        image
    }

    #[test]
    fn a_cylinder_is_found_between_voxels() {
        let truth = Fit {
            centre: [31.3, 24.8],
            radius: 18.4,
            bottom: 6.3,
            top: 43.6,
            lean: [0.0, 0.0],
            scatter: 0.0,
        };
        for lean in [[0.0, 0.0], [1.5, -0.8]] {
            let truth = Fit { lean, ..truth };
            let found = fit(&image(&truth, [60, 50, 48]), 20_000.0).unwrap();
            for axis in 0..2 {
                assert!((found.centre[axis] - truth.centre[axis]).abs() < 0.05, "{found:?}");
                assert!((found.lean[axis] - truth.lean[axis]).abs() < 0.15, "{found:?}");
            }
            assert!((found.radius - truth.radius).abs() < 0.05, "{found:?}");
            assert!((found.bottom - truth.bottom).abs() < 0.05, "{found:?}");
            assert!((found.top - truth.top).abs() < 0.05, "{found:?}");
        }
    }

    #[test]
    fn an_image_without_a_cylinder_is_refused() {
        let block = Volume::new([20, 20, 20], 1.0, vec![30_000; 8000]).unwrap();
        assert!(matches!(fit(&block, 20_000.0), Err(ImageError::NoCylinder { .. })));
        assert!(matches!(fit(&block, 40_000.0), Err(ImageError::NoCylinder { .. })));
    }
}
