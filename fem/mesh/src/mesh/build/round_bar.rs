//! An eighth of the gauge section of a round tension bar.

use std::f64::consts::FRAC_PI_2;

use super::cylinder::LatticeError;
use super::hexahedra;
use crate::mesh::TetMesh;
use crate::mesh::topology::{key, middle};

/// Number of cells along a side of the quarter of the central block, divided by radius / spacing.
const BLOCK: f64 = 0.6;
/// Number of rings around the block, divided by radius / spacing. With [`BLOCK`], the number of cells is about the
/// area of the quarter disc divided by `spacing²`: `0.6² + 2 · 0.6 · 0.354 ≈ π / 4`.
const RINGS: f64 = 0.354;
/// Width of the central block, relative to the width at which the cells of the block are as wide as the rings.
const WIDTH: f64 = 0.95;
/// Bulge of the sides of the central block: 0 for a square, 1 for a circle.
const BULGE: f64 = 0.6;
/// Largest allowed ratio of spacing to radius.
const COARSEST: f64 = 0.6;
/// Growth of the cells from layer to layer outside the necking region.
const GROWTH: f64 = 1.3;
/// Largest height of a cell outside the necking region, in spacings.
const TALLEST: f64 = 3.0;
/// Limit of the number of hexahedra; a larger number is reported as a likely error in the units.
const MAX_CELLS: f64 = 2.0e6;
/// Tolerance of a number of cells, so that rounding adds no cell.
const ROUNDING: f64 = 1e-9;

/// An eighth of the gauge section of a round tension bar: x ≥ 0, y ≥ 0, z ≥ 0, with the middle of the bar at z = 0 and
/// its axis on z.
///
/// The radius grows linearly from the middle to the end of the gauge section. This taper makes the bar neck in the
/// middle: after the largest load, the thinnest cross-section elongates, and all other cross-sections unload.
///
/// The cross-section is a quarter of an O-grid: n × n cells inside, rings of 2 n cells outside. Each hexahedron is divided
/// into six tetrahedra. Edges on the wall are curved, for quadratic elements. Cells are as high as they are wide within
/// the necking region, and grow to three times this height outside.
///
/// The surfaces are `bottom` (z = 0), `left` (x = 0) and `front` (y = 0), which are planes of symmetry, `top` (the end of
/// the gauge section) and `side` (the wall); the only region is `matrix`.
///
/// # Example
/// A bar of ASTM E8 with a gauge radius of 3.175 mm:
/// ```
/// use fem_mesh::RoundBar;
///
/// let bar = RoundBar {
///     radius_mm: 3.175,
///     taper_mm: 0.019,
///     length_mm: 31.75,
///     necking_mm: 7.14,
///     spacing_mm: 0.762,
/// };
/// let mesh = bar.eighth()?;
/// mesh.validate()?;
/// let (middle, end) = (bar.radius_mm, bar.radius_mm + bar.taper_mm);
/// let exact = std::f64::consts::PI / 8.0 * 31.75 * (middle * middle + middle * end + end * end) / 3.0;
/// assert!((mesh.volume() / exact - 1.0).abs() < 1e-3);
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoundBar {
    /// Radius in the middle of the bar (mm).
    pub radius_mm: f64,
    /// Difference of the radii at the end and in the middle of the gauge section (mm); 0 for a cylinder.
    pub taper_mm: f64,
    /// Length of the whole gauge section (mm).
    pub length_mm: f64,
    /// Length of the region around the middle with the smallest elements (mm).
    pub necking_mm: f64,
    /// Target edge length of the hexahedra (mm).
    pub spacing_mm: f64,
}

impl RoundBar {
    /// Returns the radius of the bar at a distance from the middle (mm).
    pub fn radius_at(&self, z_mm: f64) -> f64 {
        self.radius_mm + self.taper_mm * z_mm / (0.5 * self.length_mm)
    }

    /// Builds the mesh of an eighth of the bar.
    ///
    /// # Errors
    /// [`LatticeError`] if a length is not positive, the necking region is longer than the bar, or the spacing does not
    /// suit the bar.
    pub fn eighth(&self) -> Result<TetMesh, LatticeError> {
        self.check()?;
        let section = QuarterSection::new(self.radius_mm, self.spacing_mm);
        let heights = self.heights();
        let layers = heights.len() - 1;
        let level = section.positions.len() as u32;
        let nodes =
            heights.iter().flat_map(|&z| section.positions.iter().map(move |&[x, y]| [x, y, z]));
        let hexahedra: Vec<[u32; 8]> = (0..layers as u32)
            .flat_map(|layer| {
                section.quads.iter().map(move |quad| {
                    std::array::from_fn(|k| quad[k % 4] + (layer + k as u32 / 4) * level)
                })
            })
            .collect();
        let near = 1e-6 * self.radius_mm;
        let mut mesh =
            hexahedra::six(nodes.collect(), &hexahedra).with_surfaces(|[x, y, _], normal| {
                Some(match normal {
                    [_, _, n] if n < -0.5 => "bottom",
                    [_, _, n] if n > 0.5 => "top",
                    _ if x < near => "left",
                    _ if y < near => "front",
                    _ => "side",
                })
            });
        self.curve(&mut mesh);
        let edge_points = mesh.edge_points.iter_mut().map(|(_, point)| point);
        for [x, y, z] in mesh.nodes.iter_mut().chain(edge_points) {
            let stretch = self.radius_at(*z) / self.radius_mm;
            (*x, *y) = (*x * stretch, *y * stretch);
        }
        Ok(mesh)
    }

    fn check(&self) -> Result<(), LatticeError> {
        let &RoundBar { radius_mm, taper_mm, length_mm, necking_mm, spacing_mm } = self;
        for (field, value) in [
            ("radius_mm", radius_mm),
            ("length_mm", length_mm),
            ("necking_mm", necking_mm),
            ("spacing_mm", spacing_mm),
        ] {
            if !(value.is_finite() && value > 0.0) {
                return Err(LatticeError::NotPositive { field, value });
            }
        }
        for (field, value, most) in
            [("taper_mm", taper_mm, radius_mm), ("necking_mm", necking_mm, length_mm)]
        {
            if !(0.0..=most).contains(&value) {
                return Err(LatticeError::OutOfRange { field, value, most });
            }
        }
        let height_mm = 0.5 * length_mm;
        let most_mm = (COARSEST * radius_mm).min(height_mm);
        if spacing_mm > most_mm {
            return Err(LatticeError::TooCoarse { spacing_mm, radius_mm, height_mm, most_mm });
        }
        let cells = 0.5 * FRAC_PI_2 * radius_mm.powi(2) * height_mm / spacing_mm.powi(3);
        if cells > MAX_CELLS {
            return Err(LatticeError::TooFine { spacing_mm, cells });
        }
        Ok(())
    }

    /// Returns the heights of the planes between the layers of hexahedra (mm), from 0 to half the length of the bar.
    fn heights(&self) -> Vec<f64> {
        let (necking, end) = (0.5 * self.necking_mm, 0.5 * self.length_mm);
        let layers = (necking / self.spacing_mm - ROUNDING).ceil().max(1.0);
        let mut heights: Vec<f64> =
            (0..=layers as usize).map(|k| necking * k as f64 / layers).collect();
        let rest = end - necking;
        if rest <= ROUNDING * end {
            return heights;
        }
        let (mut widths, mut sum) = (Vec::new(), 0.0);
        while sum < rest * (1.0 - ROUNDING) {
            let last = widths.last().copied().unwrap_or(necking / layers);
            let width = (GROWTH * last).min(TALLEST * self.spacing_mm);
            widths.push(width);
            sum += width;
        }
        // shrink all cells of the outer region equally, so that they end at the end of the bar
        let mut height = necking;
        for width in &widths {
            height += width * rest / sum;
            heights.push(height);
        }
        if let Some(last) = heights.last_mut() {
            *last = end;
        }
        heights
    }

    /// Adds a point on the circle to each edge of the wall that is not parallel to the axis. The mesh is still a cylinder.
    fn curve(&self, mesh: &mut TetMesh) {
        let sides = |&[a, b, c]: &[u32; 3]| [key([a, b]), key([b, c]), key([c, a])];
        let mut edges: Vec<[u32; 2]> = mesh.surfaces["side"].iter().flat_map(sides).collect();
        edges.sort_unstable();
        edges.dedup();
        for edge in edges {
            let [x, y, z] = middle(&mesh.nodes, edge);
            let distance = x.hypot(y);
            if distance < (1.0 - ROUNDING) * self.radius_mm {
                let stretch = self.radius_mm / distance;
                mesh.edge_points.push((edge, [x * stretch, y * stretch, z]));
            }
        }
    }
}

/// Nodes (mm) and cells of a quarter of the cross-section.
struct QuarterSection {
    positions: Vec<[f64; 2]>,
    /// Corners of each cell, counter-clockwise. The first corner has the smallest grid coordinates, so that neighbours
    /// divide their common face by the same diagonal.
    quads: Vec<[u32; 4]>,
}

impl QuarterSection {
    fn new(radius: f64, spacing: f64) -> QuarterSection {
        let n = ((BLOCK * radius / spacing - ROUNDING).ceil() as usize).max(1);
        let rings = ((RINGS * radius / spacing).round() as usize).max(1);
        let half_width = radius * WIDTH / (1.0 + rings as f64 / n as f64);
        let mut positions = Vec::new();
        for j in 0..=n {
            for i in 0..=n {
                let [u, v] = [i, j].map(|k| k as f64 / n as f64);
                positions.push([
                    half_width * u * (1.0 - 0.5 * BULGE * v * v).sqrt(),
                    half_width * v * (1.0 - 0.5 * BULGE * u * u).sqrt(),
                ]);
            }
        }
        let block = |i: usize, j: usize| i + (n + 1) * j;
        // nodes around the block, from the x axis to the y axis
        let foot = |k: usize| if k <= n { block(n, k) } else { block(2 * n - k, n) };
        for ring in 1..=rings {
            let t = ring as f64 / rings as f64;
            for k in 0..=2 * n {
                let [x, y] = positions[foot(k)];
                let angle = FRAC_PI_2 * k as f64 / (2 * n) as f64;
                // the nodes on the axes lie exactly in the planes of symmetry
                let [cos, sin] = [if k == 2 * n { 0.0 } else { angle.cos() }, angle.sin()];
                positions
                    .push([(1.0 - t) * x + t * radius * cos, (1.0 - t) * y + t * radius * sin]);
            }
        }
        let around = |ring: usize, k: usize| match ring {
            0 => foot(k) as u32,
            _ => ((n + 1) * (n + 1) + (ring - 1) * (2 * n + 1) + k) as u32,
        };
        let mut quads = Vec::new();
        for j in 0..n {
            for i in 0..n {
                let corners = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                quads.push(corners.map(|(i, j)| block(i, j) as u32));
            }
        }
        for ring in 0..rings {
            for j in 0..n {
                let corners = [(ring, j), (ring + 1, j), (ring + 1, j + 1), (ring, j + 1)];
                quads.push(corners.map(|(ring, k)| around(ring, k)));
            }
            for i in 0..n {
                let corners = [(ring, i), (ring, i + 1), (ring + 1, i + 1), (ring + 1, i)];
                quads.push(corners.map(|(ring, i)| around(ring, 2 * n - i)));
            }
        }
        QuarterSection { positions, quads }
    }
}
