//! Preservation of grain volumes by offsets of the grain surfaces.

use rayon::prelude::*;

use super::relocate::Relocation;
use crate::mesh::vector::{Point, add, cross, norm, scale, sub};

/// Largest offset of a grain surface, relative to the spacing.
const LARGEST: f64 = 0.3;
/// Lower and upper bound for the derivative of a grain's volume with respect to the offset of its surface, relative to
/// the area of the surface.
const SLOPES: [f64; 2] = [0.3, 1.3];
/// Quadrature weights on a triangle, exact for cubic polynomials: for each corner, for each edge midpoint, and for the
/// centre.
const CORNER: f64 = 0.05;
const MIDDLE: f64 = 2.0 / 15.0;
const CENTRE: f64 = 0.45;

impl Relocation<'_> {
    /// Updates the offset of each grain by a secant step towards its exact volume; `volumes` are the current volumes
    /// of the grains' tetrahedra (mm³).
    pub(super) fn correct(&mut self, volumes: &[f64]) {
        let areas = self.areas();
        let largest = LARGEST * self.how.spacing_mm;
        for (k, &volume) in volumes.iter().enumerate() {
            if volume == 0.0 || areas[k] == 0.0 {
                continue;
            }
            let offset = self.offsets[k];
            let slope = match self.earlier[k] {
                Some((old_offset, old_volume)) if (offset - old_offset).abs() > 1e-6 * largest => {
                    let secant = (volume - old_volume) / (offset - old_offset);
                    secant.clamp(SLOPES[0] * areas[k], SLOPES[1] * areas[k])
                }
                _ => areas[k],
            };
            self.earlier[k] = Some((offset, volume));
            let missing = self.how.field.volume_mm3(k as u32 + 1) - volume;
            self.offsets[k] = (offset + missing / slope).clamp(-largest, largest);
        }
    }

    /// Returns the area of each grain's interface (mm²).
    fn areas(&self) -> Vec<f64> {
        let mut areas = vec![0.0; self.offsets.len()];
        for &(triangle, labels) in &self.interface.triangles {
            let [a, b, c] = triangle.map(|node| self.nodes[node as usize]);
            let area = 0.5 * norm(cross(sub(b, a), sub(c, a)));
            for label in labels.into_iter().filter(|&label| label > 0) {
                areas[label as usize - 1] += area;
            }
        }
        areas
    }

    /// Returns the root mean square distance of the interface from the exact interface (mm), weighted by area. The
    /// distance is evaluated at the corners, edge midpoints and centres of the interface triangles.
    pub(super) fn interface_error(&self, edge_points: &[([u32; 2], Point)]) -> f64 {
        let squares_and_area = |&(triangle, labels): &([u32; 3], [u32; 2])| {
            let p = triangle.map(|node| self.nodes[node as usize]);
            let m: [Point; 3] = std::array::from_fn(|k| {
                let (a, b) = (triangle[k], triangle[(k + 1) % 3]);
                match edge_points.binary_search_by_key(&[a.min(b), a.max(b)], |&(edge, _)| edge) {
                    Ok(index) => edge_points[index].1,
                    Err(_) => scale(add(p[k], p[(k + 1) % 3]), 0.5),
                }
            });
            let [corners, middles] = [p, m].map(|points| points.into_iter().fold([0.0; 3], add));
            let centre = scale(sub(scale(middles, 4.0), corners), 1.0 / 9.0);
            let square = |point: Point| self.true_distance(labels, point).powi(2);
            let mean = CORNER * p.map(square).iter().sum::<f64>()
                + MIDDLE * m.map(square).iter().sum::<f64>()
                + CENTRE * square(centre);
            let area = 0.5 * norm(cross(sub(p[1], p[0]), sub(p[2], p[0])));
            (area * mean, area)
        };
        let all: Vec<(f64, f64)> =
            self.interface.triangles.par_iter().map(squares_and_area).collect();
        let (squares, area) = all.into_iter().fold((0.0, 0.0), |(s, a), (t, b)| (s + t, a + b));
        if area > 0.0 { (squares / area).sqrt() } else { 0.0 }
    }

    /// Returns the signed distance of a point from the exact interface between two labels (the smaller label first).
    fn true_distance(&self, [a, b]: [u32; 2], point: [f64; 3]) -> f64 {
        let field = self.how.field;
        match a {
            0 => field.distance(b, point),
            _ => 0.5 * (field.distance(a, point) - field.distance(b, point)),
        }
    }
}
