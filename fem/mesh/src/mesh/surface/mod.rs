//! Closed triangle surfaces, for example of grains segmented by another program.
//!
//! # References
//! G. Taubin, "A signal processing approach to fair surface design", SIGGRAPH 95, 351–358,
//! doi:10.1145/218380.218473.

mod decimate;
mod isosurface;

use std::collections::{BTreeMap, HashMap};

use crate::mesh::vector::{Point, add, cross, dot, scale, sub};
use fem_image::DisjointSets;

pub use decimate::decimated;
pub(crate) use isosurface::isosurface;

/// Factors of the two steps of each pass of Taubin's smoothing filter: a shrinking step and an expanding step.
const SHRINK: f64 = 0.5;
const GROW: f64 = -0.53;

/// A triangle surface with shared corners.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Surface, stl};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 }.build()?;
/// let surface = Surface::new(&stl::specimen(&mesh));
/// assert_eq!(surface.open_edges(), 0);
/// assert!((surface.volume() / mesh.volume() - 1.0).abs() < 1e-12);
/// # Ok::<(), fem_mesh::LatticeError>(())
/// ```
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Surface {
    /// Coordinates of the points (mm).
    pub points: Vec<[f64; 3]>,
    /// Point indices of each triangle, counter-clockwise seen from outside.
    pub triangles: Vec<[u32; 3]>,
}

impl Surface {
    /// Creates a surface from triangles (mm): merges corners with identical coordinates and omits triangles with two
    /// equal corners.
    pub fn new(triangles: &[[[f64; 3]; 3]]) -> Surface {
        let mut number: HashMap<[u64; 3], u32> = HashMap::new();
        let mut surface = Surface::default();
        for triangle in triangles {
            let corners = triangle.map(|point| {
                // adding 0 turns −0 into 0, so that −0 and 0 have the same key
                let key = point.map(|x| (x + 0.0).to_bits());
                *number.entry(key).or_insert_with(|| {
                    surface.points.push(point);
                    surface.points.len() as u32 - 1
                })
            });
            let [a, b, c] = corners;
            if a != b && b != c && c != a {
                surface.triangles.push(corners);
            }
        }
        surface
    }

    /// Returns the corners of a triangle (mm).
    pub(crate) fn corners(&self, triangle: usize) -> [Point; 3] {
        self.triangles[triangle].map(|corner| self.points[corner as usize])
    }

    /// Returns the number of edges that the triangles do not traverse equally often in both directions. The number is 0
    /// for a closed surface.
    pub fn open_edges(&self) -> usize {
        let mut passes: BTreeMap<[u32; 2], i32> = BTreeMap::new();
        for &[a, b, c] in &self.triangles {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                *passes.entry([p.min(q), p.max(q)]).or_default() += if p < q { 1 } else { -1 };
            }
        }
        passes.values().filter(|&&count| count != 0).count()
    }

    /// Returns the enclosed volume (mm³), positive if the normals point outwards.
    pub fn volume(&self) -> f64 {
        let cone = |triangle: usize| {
            let [a, b, c] = self.corners(triangle);
            dot(a, cross(b, c)) / 6.0
        };
        (0..self.triangles.len()).map(cone).sum()
    }

    /// Splits the surface into its connected parts, ordered by their first triangles; different parts share no corner.
    /// In a file with several grains each part is a grain.
    pub fn parts(&self) -> Vec<Surface> {
        let mut connected = DisjointSets::new(self.points.len());
        for &[a, b, c] in &self.triangles {
            connected.join(a, b);
            connected.join(b, c);
        }
        let mut part_number: HashMap<u32, usize> = HashMap::new();
        let mut corners: Vec<Vec<[[f64; 3]; 3]>> = Vec::new();
        for (triangle, nodes) in self.triangles.iter().enumerate() {
            let part = *part_number.entry(connected.root(nodes[0])).or_insert_with(|| {
                corners.push(Vec::new());
                corners.len() - 1
            });
            corners[part].push(self.corners(triangle));
        }
        corners.iter().map(|corners| Surface::new(corners)).collect()
    }

    /// Returns the surface with normals pointing outwards: if the enclosed volume is negative, all triangles are
    /// reversed.
    pub fn outward(mut self) -> Surface {
        if self.volume() < 0.0 {
            self.triangles.iter_mut().for_each(|triangle| triangle.swap(1, 2));
        }
        self
    }

    /// Returns the centroid of the enclosed volume (mm).
    pub fn centroid(&self) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for triangle in 0..self.triangles.len() {
            let [a, b, c] = self.corners(triangle);
            sum = add(sum, scale(add(a, add(b, c)), dot(a, cross(b, c)) / 24.0));
        }
        scale(sum, 1.0 / self.volume())
    }

    /// Smooths the surface with `passes` passes of Taubin's filter, which nearly preserves the volume, and then scales
    /// the surface about its centroid to the original volume.
    pub fn smoothed(&self, passes: usize) -> Surface {
        let mut neighbours: Vec<Vec<u32>> = vec![Vec::new(); self.points.len()];
        for &[a, b, c] in &self.triangles {
            for [p, q] in [[a, b], [b, c], [c, a], [b, a], [c, b], [a, c]] {
                neighbours[p as usize].push(q);
            }
        }
        for near in &mut neighbours {
            near.sort_unstable();
            near.dedup();
        }
        let mut smooth = self.clone();
        for factor in [SHRINK, GROW].repeat(passes) {
            let old = smooth.points.clone();
            let moved = |(point, near): (&Point, &Vec<u32>)| {
                if near.is_empty() {
                    return *point;
                }
                let sum = near.iter().fold([0.0; 3], |sum, &n| add(sum, old[n as usize]));
                add(*point, scale(sub(scale(sum, 1.0 / near.len() as f64), *point), factor))
            };
            smooth.points = old.iter().zip(&neighbours).map(moved).collect();
        }
        let ratio = self.volume() / smooth.volume();
        if ratio.is_finite() && ratio > 0.0 { smooth.scaled(ratio.cbrt()) } else { self.clone() }
    }

    /// Returns the surface scaled about its centroid by a factor.
    pub fn scaled(&self, factor: f64) -> Surface {
        let centre = self.centroid();
        let points =
            self.points.iter().map(|&p| add(centre, scale(sub(p, centre), factor))).collect();
        Surface { points, triangles: self.triangles.clone() }
    }
}
