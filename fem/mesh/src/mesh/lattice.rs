//! A cylinder meshed with an O-grid of hexahedra, each split into tetrahedra.

use std::collections::BTreeMap;
use std::f64::consts::PI;

use rayon::prelude::*;

use super::TetMesh;
use super::vector::{Point, mean};

/// Number of cells across the central block and number of rings around it, each per radius over spacing. With these
/// factors the cells of block and rings have about the same size, and the number of cells equals the number of
/// squares of edge `spacing` with the area of the disc: `1.2² + 4 · 1.2 · 0.354 ≈ π`.
const BLOCK: f64 = 1.2;
const RINGS: f64 = 0.354;
/// Width of the central block, relative to the width for which its cells are as wide as the rings.
const WIDTH: f64 = 0.95;
/// Bulge of the block's sides: 0 for a square, 1 for a circle. Together with [`WIDTH`] it keeps the smallest dihedral
/// angle above 30°, or 29° at the coarsest spacings (cubes would have 45°).
const BULGE: f64 = 0.6;
/// Largest allowed ratio of spacing to radius; above it the minimum block of three cells is finer than the spacing.
const COARSEST: f64 = 0.6;
/// Limit of the number of cells; a larger number is reported as a likely error in the units.
const MAX_CELLS: f64 = 2.0e6;

/// The faces of a hexahedron, counter-clockwise seen from outside: bottom, top, four sides.
const HEX_FACES: [[usize; 4]; 6] =
    [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [1, 2, 6, 5], [2, 3, 7, 6], [3, 0, 4, 7]];

/// A right circular cylinder with its bottom at z = 0 and its axis on z, meshed with a single parameter, the spacing.
///
/// The cross-section is an O-grid: a central block of n × n cells with bulging sides, surrounded by rings of 4 n
/// cells with straight spokes that end at nodes exactly on the circle. The cross-section is extruded in layers of
/// hexahedra. Each inner face and the centres of its two hexahedra form four tetrahedra (twelve per hexahedron). At
/// the boundary the centre of the face replaces the centre of the missing neighbour. The mesh is therefore conforming
/// for any shape of the cells.
///
/// The body is a prism: every height has the same regular polygon of 4 n corners, so the area is
/// `2 n R² sin(π / (2 n))` (below πR² by 2.6 % for n = 4 and by 0.4 % for n = 10).
///
/// The surfaces are `bottom`, `top` and `side`; the only region is `matrix`.
///
/// # Example
/// ```
/// use fem_mesh::CylinderLattice;
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 }.build()?;
/// assert_eq!(mesh.tets.len(), 3040);
/// # Ok::<(), fem_mesh::LatticeError>(())
/// ```
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CylinderLattice {
    /// Radius R of the circle on which the wall nodes lie (mm).
    pub radius_mm: f64,
    /// Height (mm).
    pub height_mm: f64,
    /// Target edge length of the hexahedra (mm).
    pub spacing_mm: f64,
}

/// Error of a cylinder that cannot be meshed.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum LatticeError {
    /// A length that is not a positive finite number.
    #[error("{field} = {value} mm; give a positive length")]
    NotPositive {
        /// Name of the field.
        field: &'static str,
        /// Value of the field (mm).
        value: f64,
    },
    /// A spacing too coarse to resolve the circle.
    #[error(
        "spacing_mm = {spacing_mm} is too coarse for a radius of {radius_mm} mm and a height of \
         {height_mm} mm; use at most {most_mm:.4} mm"
    )]
    TooCoarse {
        /// The spacing (mm).
        spacing_mm: f64,
        /// The radius (mm).
        radius_mm: f64,
        /// The height (mm).
        height_mm: f64,
        /// The coarsest spacing allowed (mm).
        most_mm: f64,
    },
    /// A spacing that would create more cells than supported.
    #[error("spacing_mm = {spacing_mm} would make {cells:.1e} hexahedra; use a coarser one")]
    TooFine {
        /// The spacing (mm).
        spacing_mm: f64,
        /// Number of hexahedra for this spacing.
        cells: f64,
    },
}

impl CylinderLattice {
    /// Builds the mesh.
    ///
    /// # Errors
    /// [`LatticeError`] if a length is not positive or the spacing does not suit the cylinder.
    pub fn build(&self) -> Result<TetMesh, LatticeError> {
        let &CylinderLattice { radius_mm, height_mm, spacing_mm } = self;
        for (field, value) in
            [("radius_mm", radius_mm), ("height_mm", height_mm), ("spacing_mm", spacing_mm)]
        {
            if !(value.is_finite() && value > 0.0) {
                return Err(LatticeError::NotPositive { field, value });
            }
        }
        let most_mm = (COARSEST * radius_mm).min(height_mm);
        if spacing_mm > most_mm {
            return Err(LatticeError::TooCoarse { spacing_mm, radius_mm, height_mm, most_mm });
        }
        let cells = PI * radius_mm.powi(2) * height_mm / spacing_mm.powi(3);
        if cells > MAX_CELLS {
            return Err(LatticeError::TooFine { spacing_mm, cells });
        }
        let section = Section::new(radius_mm, spacing_mm);
        // the tolerance of 1e-9 makes 4.4 / 1.1 four layers in spite of rounding
        let layers = (height_mm / spacing_mm - 1e-9).ceil() as usize;
        Ok(split(&section, height_mm, layers))
    }

    /// Builds the mesh like [`CylinderLattice::build`], but moves all nodes of the wall onto the circle, including
    /// the centres of its faces. The mesh is closer to the cylinder, but it is not a prism.
    ///
    /// # Errors
    /// Same as [`CylinderLattice::build`].
    pub fn build_round(&self) -> Result<TetMesh, LatticeError> {
        let mut mesh = self.build()?;
        for &node in mesh.surfaces["side"].as_flattened() {
            let [x, y, _] = &mut mesh.nodes[node as usize];
            let stretch = self.radius_mm / x.hypot(*y);
            (*x, *y) = (*x * stretch, *y * stretch);
        }
        Ok(mesh)
    }
}

/// Nodes and cells of the cross-section.
struct Section {
    points: Vec<[f64; 2]>,
    /// Corners of each cell, counter-clockwise.
    quads: Vec<[u32; 4]>,
}

impl Section {
    fn new(radius: f64, spacing: f64) -> Section {
        let n = ((BLOCK * radius / spacing).round() as usize).max(3);
        let rings = ((RINGS * radius / spacing).round() as usize).max(1);
        let half_width = radius * WIDTH / (1.0 + 2.0 * rings as f64 / n as f64);

        let mut points = Vec::new();
        let mut quads = Vec::new();
        let block = |i: usize, j: usize| (i + (n + 1) * j) as u32;
        for j in 0..=n {
            for i in 0..=n {
                // this form makes mirrored points exactly symmetric
                let u = (2.0 * i as f64 - n as f64) / n as f64;
                let v = (2.0 * j as f64 - n as f64) / n as f64;
                points.push([
                    half_width * u * (1.0 - 0.5 * BULGE * v * v).sqrt(),
                    half_width * v * (1.0 - 0.5 * BULGE * u * u).sqrt(),
                ]);
            }
        }
        for j in 0..n {
            for i in 0..n {
                quads.push([block(i, j), block(i + 1, j), block(i + 1, j + 1), block(i, j + 1)]);
            }
        }

        // nodes around the block, starting at its corner at -135 degrees
        let around: Vec<u32> = (0..n)
            .map(|k| block(k, 0))
            .chain((0..n).map(|k| block(n, k)))
            .chain((0..n).map(|k| block(n - k, n)))
            .chain((0..n).map(|k| block(0, n - k)))
            .collect();
        let mut inner = around.clone();
        for ring in 1..=rings {
            let t = ring as f64 / rings as f64;
            let outer: Vec<u32> = (0..4 * n).map(|k| (points.len() + k) as u32).collect();
            for (k, &foot) in around.iter().enumerate() {
                let angle = PI * (-0.75 + k as f64 / (2 * n) as f64);
                let [x, y] = points[foot as usize];
                points.push([
                    (1.0 - t) * x + t * radius * angle.cos(),
                    (1.0 - t) * y + t * radius * angle.sin(),
                ]);
            }
            for k in 0..4 * n {
                let next = (k + 1) % (4 * n);
                quads.push([inner[k], outer[k], outer[next], inner[next]]);
            }
            inner = outer;
        }
        Section { points, quads }
    }
}

/// Extrudes the cross-section into layers of hexahedra and splits them into tetrahedra.
fn split(section: &Section, height: f64, layers: usize) -> TetMesh {
    let level = section.points.len() as u32;
    let mut nodes: Vec<Point> = Vec::new();
    for k in 0..=layers {
        let z = height * k as f64 / layers as f64;
        nodes.extend(section.points.iter().map(|&[x, y]| [x, y, z]));
    }

    let mut faces: Vec<HexFace> = Vec::with_capacity(6 * layers * section.quads.len());
    for k in 0..layers as u32 {
        for quad in &section.quads {
            let mut hex = [0; 8];
            for (corner, &node) in quad.iter().enumerate() {
                hex[corner] = node + k * level;
                hex[corner + 4] = node + (k + 1) * level;
            }
            let centre = nodes.len() as u32;
            nodes.push(mean(hex.iter().map(|&node| nodes[node as usize])));
            for (side, local) in HEX_FACES.iter().enumerate() {
                faces.push(HexFace::new(local.map(|l| hex[l]), centre, side));
            }
        }
    }
    faces.par_sort_unstable_by_key(|face| (face.key, face.centre));

    let mut tets = Vec::new();
    let mut surfaces: BTreeMap<String, Vec<[u32; 3]>> = BTreeMap::new();
    for shared in faces.chunk_by(|a, b| a.key == b.key) {
        let HexFace { outward, centre, side, .. } = shared[0];
        let apex = match shared.get(1) {
            Some(other) => other.centre,
            None => {
                nodes.push(mean(outward.iter().map(|&node| nodes[node as usize])));
                nodes.len() as u32 - 1
            }
        };
        for k in 0..4 {
            let edge = [outward[k], outward[(k + 1) % 4]];
            tets.push([centre, edge[0], edge[1], apex]);
            if shared.len() == 1 {
                let name = ["bottom", "top", "side"][side.min(2)];
                surfaces.entry(name.into()).or_default().push([edge[0], edge[1], apex]);
            }
        }
    }
    TetMesh {
        region_of: vec![0; tets.len()],
        regions: vec!["matrix".into()],
        nodes,
        tets,
        surfaces,
        ..TetMesh::default()
    }
}

/// A face of one hexahedron; `key` holds its sorted nodes, `side` its index in [`HEX_FACES`].
struct HexFace {
    key: [u32; 4],
    outward: [u32; 4],
    centre: u32,
    side: usize,
}

impl HexFace {
    fn new(outward: [u32; 4], centre: u32, side: usize) -> HexFace {
        let mut key = outward;
        key.sort_unstable();
        HexFace { key, outward, centre, side }
    }
}
