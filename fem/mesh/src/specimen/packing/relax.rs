//! Relaxation of overlapping spheres inside a cylinder.

use std::collections::HashMap;

use crate::mesh::vector::{Point, add, norm, scale, sub};

/// An overlapping pair is moved apart to the required distance times (1 + `CUSHION`). Without this excess, the
/// relaxation would not end after finitely many sweeps.
const CUSHION: f64 = 1e-4;

/// Spheres in a cylinder (mm). The required gap between two spheres is `gap`, and half of it between a sphere and the
/// surface of the cylinder.
pub(super) struct Spheres {
    pub(super) centres: Vec<Point>,
    pub(super) radii: Vec<f64>,
    pub(super) gap: f64,
    pub(super) cylinder_radius: f64,
    pub(super) cylinder_height: f64,
}

impl Spheres {
    /// Moves overlapping pairs apart until no pair overlaps; returns whether `sweeps` sweeps were sufficient.
    pub(super) fn relax(&mut self, sweeps: usize) -> bool {
        for _ in 0..sweeps {
            let mut overlapping = false;
            for (i, j) in self.close_pairs() {
                overlapping |= self.move_apart(i, j);
            }
            for i in 0..self.centres.len() {
                self.hold_inside(i);
            }
            // moving spheres into the cylinder may have caused new overlaps, which the next sweep detects
            if !overlapping {
                return true;
            }
        }
        false
    }

    /// Returns the factor by which all radii must be multiplied so that no spheres overlap.
    pub(super) fn shrinkage(&self) -> f64 {
        self.close_pairs()
            .into_iter()
            .map(|(i, j)| {
                let distance = norm(sub(self.centres[j], self.centres[i]));
                (distance - self.gap).max(0.0) / (self.radii[i] + self.radii[j])
            })
            .fold(1.0, f64::min)
    }

    /// Moves two spheres apart if they are closer than the required gap; returns whether they were closer.
    fn move_apart(&mut self, i: usize, j: usize) -> bool {
        let apart = sub(self.centres[j], self.centres[i]);
        let distance = norm(apart);
        let needed = self.radii[i] + self.radii[j] + self.gap;
        if distance >= needed {
            return false;
        }
        let direction = match distance > 0.0 {
            true => scale(apart, 1.0 / distance),
            false => [0.0, 0.0, 1.0],
        };
        let push = needed * (1.0 + CUSHION) - distance;
        // move the smaller sphere farther than the larger sphere
        let fraction = self.radii[j] / (self.radii[i] + self.radii[j]);
        self.centres[i] = add(self.centres[i], scale(direction, -push * fraction));
        self.centres[j] = add(self.centres[j], scale(direction, push * (1.0 - fraction)));
        true
    }

    /// Moves a sphere into the cylinder.
    fn hold_inside(&mut self, i: usize) {
        let margin = self.radii[i] + 0.5 * self.gap;
        let [x, y, z] = &mut self.centres[i];
        *z = z.clamp(margin, self.cylinder_height - margin);
        let (out, most) = (x.hypot(*y), self.cylinder_radius - margin);
        if out > most {
            *x *= most / out;
            *y *= most / out;
        }
    }

    /// Returns the pairs that may overlap, in a deterministic order.
    fn close_pairs(&self) -> Vec<(usize, usize)> {
        let largest = self.radii.iter().copied().fold(0.0, f64::max);
        let width = 2.0 * largest + self.gap;
        let cell = |p: Point| p.map(|x| (x / width).floor() as i64);
        let mut grid: HashMap<[i64; 3], Vec<usize>> = HashMap::new();
        for (i, &centre) in self.centres.iter().enumerate() {
            grid.entry(cell(centre)).or_default().push(i);
        }
        let mut pairs = Vec::new();
        for (i, &centre) in self.centres.iter().enumerate() {
            let [a, b, c] = cell(centre);
            for offset in 0..27 {
                let key = [a + offset % 3 - 1, b + offset / 3 % 3 - 1, c + offset / 9 - 1];
                let others = grid.get(&key).into_iter().flatten();
                pairs.extend(others.filter(|&&j| j > i).map(|&j| (i, j)));
            }
        }
        pairs
    }
}
