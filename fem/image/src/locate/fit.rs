//! Fit of a cylinder to an image.

use rayon::prelude::*;

use crate::{Cylinder, ImageError, Volume};

/// A cylinder fitted to an image (in voxels), and measures of the quality of the fit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Fit {
    /// Coordinates x and y of the middle of the cylinder's axis.
    pub(crate) centre: [f64; 2],
    pub(crate) radius: f64,
    /// Height z of the lower end. A tilted cylinder is described as an upright cylinder that is then rotated about the
    /// middle of its axis; `bottom` is the lower end before this rotation.
    pub(crate) bottom: f64,
    pub(crate) top: f64,
    /// Slopes dx/dz and dy/dz of the cylinder's axis; 0 for an upright cylinder.
    pub(crate) lean: [f64; 2],
    /// Horizontal displacement between the ends of the axis that was fitted with tilt (voxels). This value can exceed 0
    /// although the resulting cylinder is upright.
    pub(crate) wander: f64,
    /// Root mean square distance of the points found on the wall from the fitted cylinder (voxels), without outliers.
    pub(crate) scatter: f64,
}

/// Lengths are rounded to 1/`GRID` voxel, so that results do not depend on the order of summation.
const GRID: f64 = 1024.0;
/// Slopes are rounded to 1/`SLOPES`, so that results do not depend on the order of summation.
const SLOPES: f64 = 1048576.0;
/// If the axis is displaced by more than this distance between the ends (voxels), an upright cylinder does not describe
/// the specimen.
const OFF_AXIS: f64 = 2.0;
/// If the axis is displaced by at most this distance between the ends (voxels), the axis counts as upright.
const UPRIGHT: f64 = 1.0;
/// Number of iterations that refine a tilted axis; each iteration starts from the axis of the previous iteration.
const ROUNDS: usize = 3;
/// Slope of the axis above which the fit is rejected.
const STEEPEST: f64 = 0.5;
/// Number of directions of rays in an angle of 45°.
const EIGHTH: usize = 24;
/// Maximum number of Gauss–Newton steps of the fit.
const STEPS: usize = 20;

impl Fit {
    /// Returns whether the axis of the specimen is tilted although the fitted cylinder is upright.
    pub(crate) fn is_off_axis(&self) -> bool {
        self.lean == [0.0; 2] && self.wander > OFF_AXIS
    }

    /// Converts the cylinder from voxels to mm.
    pub(crate) fn in_mm(&self, voxel_mm: f64) -> Cylinder {
        Cylinder {
            centre_mm: self.centre.map(|c| c * voxel_mm),
            radius_mm: self.radius * voxel_mm,
            bottom_mm: self.bottom * voxel_mm,
            top_mm: self.top * voxel_mm,
            lean: self.lean,
        }
    }

    /// Returns the squared distance of a voxel from the axis (voxels²) and the height z of the voxel (voxels), both
    /// after the rotation that makes the cylinder upright. Both values are exact in floating point if the axis is
    /// upright.
    pub(crate) fn radius_squared_and_height(&self, [x, y, z]: [usize; 3]) -> [f64; 2] {
        let middle = (self.bottom + self.top) / 2.0;
        let [p, q] = self.lean;
        let h = z as f64 + 0.5 - middle;
        // components of the distance from the point of the axis in the same slice
        let (dx, dy) =
            (x as f64 + 0.5 - self.centre[0] - p * h, y as f64 + 0.5 - self.centre[1] - q * h);
        let (along, square) = (dx * p + dy * q, 1.0 + (p * p + q * q));
        let height = (along + h * square) / square.sqrt();
        [dx * dx + dy * dy - along * along / square, middle + height]
    }

    /// Returns the distances along x and y of a voxel's centre from the axis in the same slice (voxels).
    pub(crate) fn off_axis(&self, [x, y, z]: [usize; 3]) -> [f64; 2] {
        let above_middle = z as f64 + 0.5 - (self.bottom + self.top) / 2.0;
        [(x, 0), (y, 1)].map(|(c, k)| c as f64 + 0.5 - self.centre[k] - self.lean[k] * above_middle)
    }

    /// Returns the squared relative radii (r/R)² of the voxels of a slice.
    pub(crate) fn relative_squares(&self, [nx, ny]: [usize; 2], z: usize) -> Vec<f64> {
        let square = self.radius * self.radius;
        (0..nx * ny)
            .map(|n| self.radius_squared_and_height([n % nx, n / nx, z])[0] / square)
            .collect()
    }

    /// Returns the set of voxels (1 inside, 0 outside) whose centres are at least `margin` voxels inside the cylinder.
    pub(crate) fn inside(&self, shape: [usize; 3], margin: f64) -> Vec<u8> {
        let [nx, ny, nz] = shape;
        let radius = (self.radius - margin).max(0.0);
        let heights = self.bottom + margin..=self.top - margin;
        let mut set = vec![0; nx * ny * nz];
        if self.lean == [0.0; 2] {
            // compute one section, because all sections of an upright cylinder are equal
            let disc: Vec<u8> = (0..nx * ny)
                .map(|n| {
                    u8::from(
                        self.radius_squared_and_height([n % nx, n / nx, 0])[0] <= radius * radius,
                    )
                })
                .collect();
            let slices = set.par_chunks_exact_mut(nx * ny).enumerate();
            slices
                .filter(|(z, _)| heights.contains(&self.radius_squared_and_height([0, 0, *z])[1]))
                .for_each(|(_, slice)| slice.copy_from_slice(&disc));
            return set;
        }
        set.par_chunks_exact_mut(nx * ny).enumerate().for_each(|(z, slice)| {
            for (n, voxel) in slice.iter_mut().enumerate() {
                let [square, height] = self.radius_squared_and_height([n % nx, n / nx, z]);
                *voxel = u8::from(square <= radius * radius && heights.contains(&height));
            }
        });
        set
    }
}

/// A straight line, given by one of its points and its slopes dx/dz and dy/dz.
#[derive(Clone, Copy, Debug)]
struct Axis {
    at: [f64; 3],
    lean: [f64; 2],
}

impl Axis {
    /// Returns the position of the line in x and y at the height z.
    fn through(&self, z: f64) -> [f64; 2] {
        [0, 1].map(|k| self.at[k] + self.lean[k] * (z - self.at[2]))
    }

    /// Returns the tangent of the angle between the line and the vertical.
    fn slope(&self) -> f64 {
        self.lean[0].hypot(self.lean[1])
    }

    /// Returns the length along the line that corresponds to a height of one voxel.
    fn stretch(&self) -> f64 {
        (1.0 + (self.lean[0] * self.lean[0] + self.lean[1] * self.lean[1])).sqrt()
    }

    /// Returns the coordinate of a point along the line: the distance from the point `at` of the line to the foot of
    /// the perpendicular from the given point.
    fn along(&self, point: [f64; 3]) -> f64 {
        let [x, y, z] = [0, 1, 2].map(|k| point[k] - self.at[k]);
        (x * self.lean[0] + y * self.lean[1] + z) / self.stretch()
    }
}

/// Cylinder without ends, fitted to the points at which rays meet the wall: axis, radius, and root mean square distance
/// of the points.
struct Wall {
    axis: Axis,
    radius: f64,
    scatter: f64,
}

/// Fits a cylinder to the voxels that are at least as bright as `edge`, the grey level half way between air and matrix.
/// The ends are medians over columns of voxels: of the height at which the grey value first crosses `edge`, and of the
/// height at which it last crosses `edge`. Axis and radius follow from least squares over the outermost points at which
/// the grey value crosses `edge` along many rays, without outliers. Axis, radius and ends have sub-voxel accuracy.
///
/// Rays and ends are first computed with respect to an upright axis. If the fitted axis is tilted and `leans` is true,
/// rays and ends are computed again with respect to the fitted axis.
///
/// # Errors
/// [`ImageError::NoCylinder`].
pub(crate) fn fit(image: &Volume<u16>, edge: f64, leans: bool) -> Result<Fit, ImageError> {
    let [nx, ny, _] = image.shape;
    let Some((centre, radius)) = about(image, edge) else {
        return Err(refused("no voxel is brighter than air".into()));
    };
    let upright = Axis { at: [centre[0], centre[1], 0.0], lean: [0.0; 2] };
    let (mut wall, mut ends) = sides(image, edge, &upright, radius)?;
    let wander = |wall: &Wall, [bottom, top]: [f64; 2]| wall.axis.slope() * (top - bottom);
    let mut lean = [0.0; 2];
    if leans && wander(&wall, ends) > UPRIGHT {
        for _ in 0..ROUNDS {
            if !(wall.axis.slope() < STEEPEST && wall.radius > 3.0) {
                break;
            }
            (wall, ends) = sides(image, edge, &wall.axis, wall.radius)?;
        }
        lean = wall.axis.lean.map(|slope| (slope * SLOPES).round() / SLOPES);
    }
    let [x, y, _] = wall.axis.at;
    let this = Fit {
        centre: [x, y].map(rounded_length),
        radius: rounded_length(wall.radius),
        bottom: rounded_length(ends[0]),
        top: rounded_length(ends[1]),
        lean,
        wander: wander(&wall, ends),
        scatter: wall.scatter,
    };
    let largest = nx.max(ny) as f64;
    let sound =
        this.radius > 3.0 && this.radius < largest && this.scatter < 1.0 + 0.02 * this.radius;
    if !sound || !this.centre.iter().all(|c| c.is_finite()) {
        return Err(refused(format!(
            "the fit has a radius of {:.1} voxels, and the wall deviates from it by {:.1} voxels (root mean square)",
            this.radius, this.scatter
        )));
    }
    if wall.axis.slope() >= STEEPEST {
        let degrees = wall.axis.slope().atan().to_degrees();
        return Err(refused(format!("the axis of the fit is tilted by {degrees:.0}° against z")));
    }
    Ok(this)
}

/// Rounds a length (voxels) to 1/[`GRID`].
pub(crate) fn rounded_length(voxels: f64) -> f64 {
    (voxels * GRID).round() / GRID
}

fn refused(message: String) -> ImageError {
    ImageError::NoCylinder {
        message,
        help: "set specimen = \"block\" if the image was cut out of a specimen, or remove other objects from the image",
    }
}

/// Determines the wall and the ends of the cylinder, starting from an approximate axis and radius.
fn sides(
    image: &Volume<u16>,
    edge: f64,
    axis: &Axis,
    radius: f64,
) -> Result<(Wall, [f64; 2]), ImageError> {
    let nz = image.shape[2];
    let Some(ends @ [bottom, top]) = ends(image, edge, axis, 0.8 * radius) else {
        return Err(refused("no column of voxels crosses the specimen".into()));
    };
    let points = wall(image, edge, axis, radius, ends);
    let rays = 8 * EIGHTH * nz;
    let levels = (bottom.ceil().max(0.0) as usize..(top.floor() as usize).min(nz)).len();
    if points.len() < 8 * EIGHTH * levels / 4 || levels < 4 {
        return Err(refused(format!(
            "only {} of {rays} rays cross the wall of the specimen",
            points.len()
        )));
    }
    Ok((least_squares(&points, axis, radius, (bottom + top) / 2.0), ends))
}

/// Returns the centroid (x and y) of the bright voxels, and the radius of a disc whose area is the mean number of
/// bright voxels per slice.
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

/// Returns the heights of both ends: the medians of the heights at which columns within a radius enter and leave the
/// bright voxels. Heights are measured along the axis, as z of the cylinder before its rotation.
fn ends(image: &Volume<u16>, edge: f64, axis: &Axis, radius: f64) -> Option<[f64; 2]> {
    let [nx, ny, nz] = image.shape;
    let (mut low, mut high) = (Vec::new(), Vec::new());
    let off = |x: usize, y: usize, z: f64| {
        let [cx, cy] = axis.through(z);
        (x as f64 + 0.5 - cx).hypot(y as f64 + 0.5 - cy)
    };
    let reach = radius + axis.slope() * nz as f64;
    for y in 0..ny {
        for x in 0..nx {
            let value = |z: usize| f64::from(image.values[x + nx * (y + ny * z)]);
            let bright = |&z: &usize| value(z) >= edge;
            let (false, Some(first), Some(last)) = (
                off(x, y, nz as f64 / 2.0) > reach,
                (0..nz).find(bright),
                (0..nz).rev().find(bright),
            ) else {
                continue;
            };
            // linear interpolation between the centres of the outermost bright voxel and its dark neighbour
            let part =
                |dark: usize, bright: usize| (edge - value(dark)) / (value(bright) - value(dark));
            let entry = if first == 0 { 0.0 } else { first as f64 - 0.5 + part(first - 1, first) };
            let exit = match last + 1 == nz {
                true => nz as f64,
                false => last as f64 + 1.5 - part(last + 1, last),
            };
            for (z, heights) in [(entry, &mut low), (exit, &mut high)] {
                if off(x, y, z) <= radius {
                    heights.push(axis.along([x as f64 + 0.5, y as f64 + 0.5, z]));
                }
            }
        }
    }
    let (low, high) = (median(&mut low)?, median(&mut high)?);
    // heights are measured from the middle of the axis, which the rotation to an upright axis does not move
    let middle = (low + high) / 2.0;
    let shift = axis.at[2] + middle / axis.stretch() - middle;
    Some([low + shift, high + shift])
}

/// Returns the median of the values, or `None` without values.
pub(crate) fn median(values: &mut [f64]) -> Option<f64> {
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

/// Returns points of the wall, found along rays. The directions of the rays are symmetric about x and y. A ray starts
/// outside the specimen and ends where two samples one voxel apart are bright.
fn wall(
    image: &Volume<u16>,
    edge: f64,
    axis: &Axis,
    radius: f64,
    [bottom, top]: [f64; 2],
) -> Vec<[f64; 3]> {
    let [nx, ny, nz] = image.shape;
    let mut points = Vec::new();
    // exclude slices near the ends; a tilted end extends over several slices
    let margin = 0.03 * (top - bottom) + 1.0 + radius * axis.slope();
    for z in 0..nz {
        let height = z as f64 + 0.5;
        if height < bottom + margin || height > top - margin {
            continue;
        }
        let centre = axis.through(height);
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
                    // the first sample is already bright: on this ray, the wall is outside the image
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

/// Iterates over the directions (cosine, sine) of the rays.
fn directions() -> impl Iterator<Item = [f64; 2]> {
    (0..EIGHTH).flat_map(|n| {
        let angle = (n as f64 + 0.5) / EIGHTH as f64 * std::f64::consts::FRAC_PI_4;
        let (s, c) = angle.sin_cos();
        [[c, s], [s, c], [-s, c], [-c, s], [-c, -s], [-s, -c], [s, -c], [c, -s]]
    })
}

/// Returns the grey value at a point by bilinear interpolation, or `None` outside the centres of the outermost voxels.
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

/// Fits axis (position at mid-height and slopes) and radius by Gauss–Newton. Distances are measured perpendicular to
/// the approximate axis `about`; points with a residual above three times the median are omitted.
fn least_squares(points: &[[f64; 3]], about: &Axis, radius: f64, middle: f64) -> Wall {
    let ([x, y], [p, q]) = (about.through(middle), about.lean);
    let square = 1.0 + (p * p + q * q);
    let mut u = nalgebra::SVector::<f64, 5>::from([x, y, p, q, radius]);
    let mut scatter = f64::NAN;
    for _ in 0..STEPS {
        let rows: Vec<_> = points
            .iter()
            .map(|&[x, y, z]| {
                let h = z - middle;
                let (dx, dy) = (x - u[0] - u[2] * h, y - u[1] - u[3] * h);
                let along = (dx * p + dy * q) / square;
                // components of (dx, dy, 0) perpendicular to the axis; their norm is the distance from the axis
                let (cx, cy) = (dx - along * p, dy - along * q);
                let r = (dx * cx + dy * cy).max(1e-18).sqrt();
                let row = [-cx / r, -cy / r, -cx / r * h, -cy / r * h, -1.0];
                (r - u[4], nalgebra::SVector::<f64, 5>::from(row))
            })
            .collect();
        let mut off: Vec<f64> = rows.iter().map(|(residual, _)| residual.abs()).collect();
        let limit = 3.0 * median(&mut off).unwrap_or(0.0).max(0.02);
        let mut normal = nalgebra::SMatrix::<f64, 5, 5>::zeros();
        let mut right = nalgebra::SVector::<f64, 5>::zeros();
        let (mut squares, mut used) = (0.0, 0.0);
        for (residual, row) in rows.iter().filter(|(residual, _)| residual.abs() <= limit) {
            normal += row * row.transpose();
            right -= row * *residual;
            squares += residual * residual;
            used += 1.0;
        }
        scatter = f64::sqrt(squares / used);
        let Some(factor) = normal.cholesky() else { break };
        let step = factor.solve(&right);
        u += step;
        if step.norm() < 1e-9 {
            break;
        }
    }
    let axis = Axis { at: [u[0], u[1], middle], lean: [u[2], u[3]] };
    Wall { axis, radius: u[4], scatter }
}

#[cfg(test)]
mod tests;
