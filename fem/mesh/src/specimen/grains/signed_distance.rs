//! Smooth signed distances, computed from the solid fractions of voxels.
//!
//! The surface is the set where the solid fraction, smoothed over neighbouring voxels, equals one half. Distances of
//! voxels that are not adjacent to the surface are computed by fast sweeping. Smoothing and the blur of the image
//! shrink a ball of radius R by σ²/R, where σ is the standard deviation of the blur; therefore all distances of a grain
//! are finally shifted so that the region of negative distance has the grain's volume.
//!
//! # Reference
//! H. Zhao, "A fast sweeping method for eikonal equations", Math. Comp. 74 (2005) 603–627,
//! doi:10.1090/S0025-5718-04-01678-3.

/// Ratio of two slopes of the smoothed fraction at the surface: the central difference over two voxels, divided by the
/// exact slope. The ratio is 0.75 for surfaces normal to an axis and 0.9 for surfaces normal to a diagonal.
const SLOPE: f32 = 0.85;
/// Number of rounds of eight sweeps, in which the distances are computed. One round is enough for convex bodies.
const ROUNDS: usize = 2;
/// Number of Newton steps that shift the distances until the enclosed volume is correct.
const STEPS: usize = 6;
/// Largest distance (voxels) by which the surface is shifted to correct the enclosed volume.
const MAX_SHIFT: f32 = 1.0;

/// One value for each voxel in a box of voxels; x varies fastest.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    /// Index of the first voxel in the image.
    pub(super) low: [usize; 3],
    /// Number of voxels along each axis.
    pub(super) size: [usize; 3],
    pub(super) values: Vec<f32>,
}

impl Patch {
    pub(super) fn new(low: [usize; 3], size: [usize; 3]) -> Patch {
        Patch { low, size, values: vec![0.0; size.iter().product()] }
    }

    fn strides(&self) -> [usize; 3] {
        [1, self.size[0], self.size[0] * self.size[1]]
    }

    /// Iterates over the voxels (indices within the box) in the order of `values`.
    pub(super) fn voxels(&self) -> impl Iterator<Item = [usize; 3]> + use<> {
        let [nx, ny, nz] = self.size;
        (0..nx * ny * nz).map(move |c| [c % nx, c / nx % ny, c / nx / ny])
    }

    /// Converts solid fractions into signed distances in voxels, negative inside.
    pub(super) fn fractions_to_distances(&mut self) {
        for axis in 0..3 {
            self.smooth(axis);
        }
        let is_initial = self.crossings();
        self.sweep(&is_initial);
    }

    /// Smooths the values along an axis with the weights ¼, ½, ¼. Outside the box, the outermost value is repeated.
    fn smooth(&mut self, axis: usize) {
        let (stride, count) = (self.strides()[axis], self.size[axis]);
        if count < 2 {
            return;
        }
        for first in 0..self.values.len() {
            if first / stride % count != 0 {
                continue;
            }
            let mut before = self.values[first];
            for k in 0..count {
                let at = first + k * stride;
                let here = self.values[at];
                let after = if k + 1 < count { self.values[at + stride] } else { here };
                self.values[at] = 0.25 * (before + after) + 0.5 * here;
                before = here;
            }
        }
    }

    /// Initialises the distances. A voxel with a neighbour on the other side of the surface gets its distance to the
    /// surface; all other voxels get a large value with the correct sign. Returns, for each voxel, whether its distance
    /// was computed.
    fn crossings(&mut self) -> Vec<bool> {
        let far = self.size.iter().sum::<usize>() as f32;
        let strides = self.strides();
        let fraction = std::mem::take(&mut self.values);
        let mut is_initial = vec![false; fraction.len()];
        self.values = vec![far; fraction.len()];
        for (at, voxel) in self.voxels().enumerate() {
            let here = 0.5 - fraction[at];
            let mut slope = 0.0;
            for axis in 0..3 {
                let mut look = |inside: bool, other: usize| {
                    let other = if inside { other } else { at };
                    is_initial[at] |= (here < 0.0) != (fraction[other] > 0.5);
                    fraction[other]
                };
                let before = look(voxel[axis] > 0, at.wrapping_sub(strides[axis]));
                let after = look(voxel[axis] + 1 < self.size[axis], at + strides[axis]);
                slope += (0.5 * (after - before)).powi(2);
            }
            let distance = if is_initial[at] {
                (SLOPE * here.abs() / slope.sqrt().max(1e-6)).min(1.0)
            } else {
                far
            };
            self.values[at] = distance.copysign(here);
        }
        is_initial
    }

    /// Shifts all distances by one value of at most one voxel, so that the region of negative distance has a given
    /// volume (voxels).
    pub(super) fn enclose(&mut self, volume: f64) {
        // volume inside the surface if all distances are shifted; in each voxel, the surface is assumed to be flat
        let within = |shift: f32| -> f64 {
            let share = |&value: &f32| f64::from((0.5 + shift - value).clamp(0.0, 1.0));
            self.values.iter().map(share).sum()
        };
        let mut shift = 0.0_f32;
        for _ in 0..STEPS {
            let area = within(shift + 0.5) - within(shift - 0.5);
            if area < 1.0 {
                return;
            }
            let step = (volume - within(shift)) / area;
            shift = (shift + step as f32).clamp(-MAX_SHIFT, MAX_SHIFT);
        }
        self.values.iter_mut().for_each(|value| *value -= shift);
    }

    /// Computes the distances of all voxels that `crossings` has not computed, by fast sweeping.
    fn sweep(&mut self, is_initial: &[bool]) {
        let ([nx, ny, nz], strides) = (self.size, self.strides());
        let order = |count: usize, reverse: bool, k: usize| if reverse { count - 1 - k } else { k };
        for turn in 0..8 * ROUNDS {
            let reverse = [turn & 1 > 0, turn & 2 > 0, turn & 4 > 0];
            for c in 0..nz {
                let z = order(nz, reverse[2], c);
                for b in 0..ny {
                    let y = order(ny, reverse[1], b);
                    for a in 0..nx {
                        let x = order(nx, reverse[0], a);
                        let at = x + nx * (y + ny * z);
                        if !is_initial[at] {
                            self.update(at, [x, y, z], strides);
                        }
                    }
                }
            }
        }
    }

    /// Updates the distance d of a voxel by Godunov's upwind scheme for |∇d| = 1.
    fn update(&mut self, at: usize, voxel: [usize; 3], strides: [usize; 3]) {
        let mut smallest = [f32::INFINITY; 3];
        for axis in 0..3 {
            if voxel[axis] > 0 {
                smallest[axis] = self.values[at - strides[axis]].abs();
            }
            if voxel[axis] + 1 < self.size[axis] {
                smallest[axis] = smallest[axis].min(self.values[at + strides[axis]].abs());
            }
        }
        smallest.sort_unstable_by(f32::total_cmp);
        let [a, b, c] = smallest;
        let mut distance = a + 1.0;
        if distance > b {
            distance = 0.5 * (a + b + (2.0 - (a - b).powi(2)).sqrt());
            if distance > c {
                let (sum, squares) = (a + b + c, a * a + b * b + c * c);
                distance = (sum + (sum * sum - 3.0 * (squares - 1.0)).max(0.0).sqrt()) / 3.0;
            }
        }
        let here = self.values[at];
        if distance < here.abs() {
            self.values[at] = distance.copysign(here);
        }
    }

    /// Interpolates the value at `x` (in voxels from the centre of the first voxel), linearly along each axis. For a
    /// point outside the box, the first result is the value at the nearest point of the box. The second result is the
    /// distance from the box (voxels).
    pub(super) fn interpolate(&self, x: [f64; 3]) -> (f64, f64) {
        let strides = self.strides();
        let (mut first, mut step, mut t) = (0, [0; 3], [0.0; 3]);
        let mut outside = 0.0;
        for axis in 0..3 {
            let most = (self.size[axis] - 1) as f64;
            let inside = x[axis].clamp(0.0, most);
            outside += (x[axis] - inside).powi(2);
            let cell = (inside as usize).min(self.size[axis].saturating_sub(2));
            first += cell * strides[axis];
            step[axis] = if self.size[axis] > 1 { strides[axis] } else { 0 };
            t[axis] = inside - cell as f64;
        }
        let along = |at: usize| {
            let (low, high) = (self.values[at] as f64, self.values[at + step[0]] as f64);
            low + t[0] * (high - low)
        };
        let plane = |at: usize| {
            let (low, high) = (along(at), along(at + step[1]));
            low + t[1] * (high - low)
        };
        let (low, high) = (plane(first), plane(first + step[2]));
        (low + t[2] * (high - low), outside.sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the fraction of a voxel that lies inside a ball, estimated by 8³ samples.
    fn share(voxel: [usize; 3], centre: [f64; 3], radius: f64) -> f32 {
        let n = 8;
        let inside = (0..n * n * n).filter(|c| {
            let sample = [c % n, c / n % n, c / n / n];
            let squares = (0..3).map(|k| {
                let x = voxel[k] as f64 - 0.5 + (sample[k] as f64 + 0.5) / n as f64;
                (x - centre[k]).powi(2)
            });
            squares.sum::<f64>() < radius * radius
        });
        inside.count() as f32 / (n * n * n) as f32
    }

    #[test]
    fn the_surface_of_a_ball_is_located_to_a_fraction_of_a_voxel() {
        let (centre, radius) = ([11.3, 11.8, 12.1], 6.5);
        let mut patch = Patch::new([0; 3], [24; 3]);
        let voxels: Vec<[usize; 3]> = patch.voxels().collect();
        for (value, &voxel) in patch.values.iter_mut().zip(&voxels) {
            *value = share(voxel, centre, radius);
        }
        patch.fractions_to_distances();
        let (rms, near, far) = errors(&patch, centre, radius);
        // the smoothing, whose variance is σ² = ½ voxel², shrinks this ball by σ² / R = 0.08 voxels
        assert!(rms < 0.15 && near < 0.3, "{rms} {near}");
        assert!(far < 0.5, "{far}");
        // the correction of the volume removes this shift of the surface
        let volume = 4.0 / 3.0 * std::f64::consts::PI * radius.powi(3);
        patch.enclose(volume);
        let shifted = errors(&patch, centre, radius);
        assert!(shifted.0 < 0.6 * rms && shifted.0 < 0.06, "{rms} {shifted:?}");
        // the correction of the volume also removes any other constant shift of the distances
        patch.values.iter_mut().for_each(|value| *value += 0.4);
        patch.enclose(volume);
        assert!((errors(&patch, centre, radius).0 - shifted.0).abs() < 1e-3);
    }

    /// Returns the root mean square error of the distances at the surface of a ball, the largest error near the
    /// surface, and the largest error far from the surface (voxels).
    fn errors(patch: &Patch, centre: [f64; 3], radius: f64) -> (f64, f64, f64) {
        let (mut near, mut far, mut squares, mut count) = (0.0_f64, 0.0_f64, 0.0, 0.0);
        for a in 0..20 {
            for b in 0..20 {
                let (theta, z) = (a as f64 * 0.31, (b as f64 - 9.5) / 10.0);
                let along =
                    [(1.0 - z * z).sqrt() * theta.cos(), (1.0 - z * z).sqrt() * theta.sin(), z];
                for offset in [-3.0, -1.0, -0.3, 0.0, 0.4, 1.0, 3.0] {
                    let x = std::array::from_fn(|k| centre[k] + (radius + offset) * along[k]);
                    let (value, outside) = patch.interpolate(x);
                    assert_eq!(outside, 0.0);
                    let error = (value - offset).abs();
                    if offset == 0.0 {
                        squares += error * error;
                        count += 1.0;
                    }
                    if offset.abs() < 0.5 { near = near.max(error) } else { far = far.max(error) }
                }
            }
        }
        (f64::sqrt(squares / count), near, far)
    }
}
