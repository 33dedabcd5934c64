//! A cylinder meshed with an O-grid of hexahedra, each split into tetrahedra.

use std::f64::consts::PI;

use serde::{Deserialize, Serialize};

use super::hexahedra;
use crate::mesh::TetMesh;
use crate::mesh::topology::{key, middle};
use crate::mesh::vector::Point;

/// Number of cells across the central block (`BLOCK`) and number of rings around the block (`RINGS`), as multiples of
/// radius / spacing. With these factors, the cells of the block and of the rings have about the same size. The number
/// of cells then equals the area of the disc divided by `spacing²`, because `1.2² + 4 · 1.2 · 0.354 ≈ π`.
const BLOCK: f64 = 1.2;
const RINGS: f64 = 0.354;
/// Width of the central block of the cross-section, relative to the width at which the cells of the block are as wide
/// as the rings around the block.
const WIDTH: f64 = 0.95;
/// Bulge of the sides of the central block: 0 for a square, 1 for a circle. With this value and [`WIDTH`], the smallest
/// dihedral angle is above 30°, or above 29° at the coarsest spacings (with cubes, the angle would be 45°).
const BULGE: f64 = 0.6;
/// Largest allowed ratio of spacing to radius. Above this ratio, even the smallest central block (3 × 3 cells) has
/// cells that are smaller than the spacing.
const COARSEST: f64 = 0.6;
/// Largest number of hexahedra of a lattice; a larger number is reported as a likely error in the units.
const MAX_CELLS: f64 = 2.0e6;

/// Position of the nodes on the wall (the curved side surface) of a [`CylinderLattice`].
///
/// A wall of straight edges between nodes on a circle encloses less than the cylinder. At a spacing of 0.6 mm and a
/// radius of 2.5 mm the end faces of [`Wall::Inscribed`] and [`Wall::Round`] are 1.6 % too small, and forces, stiffness
/// and energies are too small by the same factor. The smallest scaled Jacobian of this lattice is 0.324, or 0.322 with
/// [`Wall::EqualArea`].
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Wall {
    /// The body is a prism; the corners of its cross-section lie on the circle.
    #[default]
    Inscribed,
    /// The prism of [`Wall::Inscribed`], enlarged so that the area of its cross-section is πR²: the volume and the
    /// areas of the ends are exact. The second moments of area are too large by the fraction 0.089 (π / corners)⁴, and
    /// wall nodes lie outside the circle by up to R (π / corners)² / 3. This wall is recommended for linear elements.
    EqualArea,
    /// All nodes of the wall lie on the circle, including the centres of the faces. The body is not a prism.
    Round,
    /// The nodes are the nodes of [`Wall::Round`]. In addition, the edges on the wall are curved, and their mid-edge
    /// points lie on the circle. This wall is recommended for quadratic elements; linear elements ignore the curvature.
    Curved,
}

/// Cross-section of a wall: a circle, or a regular polygon about the axis.
#[derive(Clone, Copy, Debug)]
pub(crate) struct WallSection {
    /// Radius of the circle, or of the circle through the corners (mm).
    radius_mm: f64,
    /// Angle between two neighbouring corners of the polygon, seen from the axis; `None` for a circle.
    sector: Option<f64>,
}

/// Angle (about the axis, from x) of the first corner of the cross-section.
const FIRST_CORNER: f64 = -0.75 * PI;
/// A node within this distance of a corner counts as lying at the corner; the unit is the angle between two corners.
const AT_CORNER: f64 = 1e-6;

impl WallSection {
    /// Returns the distance of the wall from the axis in the direction of a point (mm).
    pub(crate) fn radius_at(&self, x: f64, y: f64) -> f64 {
        let Some(sector) = self.sector else { return self.radius_mm };
        let from_middle = (y.atan2(x) - FIRST_CORNER).rem_euclid(sector) - 0.5 * sector;
        self.radius_mm * (0.5 * sector).cos() / from_middle.cos()
    }

    /// Returns whether a point lies in the same direction from the axis as a corner of the cross-section.
    pub(crate) fn is_corner(&self, x: f64, y: f64) -> bool {
        self.sector.is_some_and(|sector| {
            let sectors = (y.atan2(x) - FIRST_CORNER) / sector;
            (sectors - sectors.round()).abs() < AT_CORNER
        })
    }
}

/// A right circular cylinder with its bottom at z = 0 and its axis on z, meshed with a single parameter, the spacing.
///
/// The cross-section is an O-grid: a central block of n × n cells with bulging sides, surrounded by rings of 4 n cells.
/// The edges between the cells of a ring lie on straight radial lines that end at nodes exactly on the circle. The
/// cross-section is extruded in layers of hexahedra. Each inner face and the centres of its two hexahedra form four
/// tetrahedra (twelve per hexahedron). At the boundary, where there is no second hexahedron, the centre of the face
/// replaces its centre. The mesh is therefore conforming for any shape of the hexahedra.
///
/// The body is a prism: every height has the same regular polygon of 4 n corners, so the area is
/// `2 n R² sin(π / (2 n))` (below πR² by 2.6 % for n = 4 and by 0.4 % for n = 10). [`CylinderLattice::build_with`]
/// builds a mesh with the exact area or a round wall.
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

/// Error of a cylinder or a round bar that cannot be meshed.
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
    /// A length outside its range.
    #[error("{field} = {value} mm is outside 0 … {most} mm")]
    OutOfRange {
        /// Name of the field.
        field: &'static str,
        /// Value of the field (mm).
        value: f64,
        /// Largest value allowed (mm).
        most: f64,
    },
    /// A spacing that is too coarse to resolve the circle.
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
    #[error("spacing_mm = {spacing_mm} would create {cells:.1e} hexahedra; use a larger spacing")]
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
        // with the tolerance of 1e-9, rounding errors do not add a layer: 4.4 / 1.1 gives four layers
        let layers = (height_mm / spacing_mm - 1e-9).ceil() as usize;
        Ok(extruded(&section, height_mm, layers))
    }

    /// Builds the mesh with all nodes of the wall on the circle: [`CylinderLattice::build_with`] for [`Wall::Round`].
    ///
    /// # Errors
    /// The errors of [`CylinderLattice::build`].
    pub fn build_round(&self) -> Result<TetMesh, LatticeError> {
        self.build_with(Wall::Round)
    }

    /// Builds the mesh with a given type of wall.
    ///
    /// # Errors
    /// The errors of [`CylinderLattice::build`].
    ///
    /// # Example
    /// ```
    /// use fem_mesh::{CylinderLattice, Quality, Wall};
    ///
    /// let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.6 };
    /// let exact = std::f64::consts::PI * 2.5 * 2.5 * 4.4;
    /// let error = |wall| Ok::<f64, fem_mesh::LatticeError>(lattice.build_with(wall)?.volume() / exact - 1.0);
    /// assert!(error(Wall::Inscribed)? < -0.016);
    /// assert!(error(Wall::EqualArea)?.abs() < 1e-12);
    /// assert!(error(Wall::Curved)?.abs() < 1e-4);
    /// # Ok::<(), fem_mesh::LatticeError>(())
    /// ```
    pub fn build_with(&self, wall: Wall) -> Result<TetMesh, LatticeError> {
        let mut mesh = self.build()?;
        match wall {
            Wall::Inscribed => {}
            Wall::EqualArea => {
                let stretch = self.section(wall).radius_mm / self.radius_mm;
                for [x, y, _] in &mut mesh.nodes {
                    (*x, *y) = (*x * stretch, *y * stretch);
                }
            }
            Wall::Round => self.round(&mut mesh),
            Wall::Curved => {
                self.round(&mut mesh);
                self.curve(&mut mesh);
            }
        }
        Ok(mesh)
    }

    /// Returns the cross-section of a wall.
    pub(crate) fn section(&self, wall: Wall) -> WallSection {
        let corners = 4 * cells(self.radius_mm, self.spacing_mm);
        let sector = 2.0 * PI / corners as f64;
        let radius_mm = match wall {
            Wall::EqualArea => self.radius_mm * (sector / sector.sin()).sqrt(),
            Wall::Inscribed | Wall::Round | Wall::Curved => self.radius_mm,
        };
        let is_prism = matches!(wall, Wall::Inscribed | Wall::EqualArea);
        WallSection { radius_mm, sector: is_prism.then_some(sector) }
    }

    /// Moves the nodes of the wall radially onto the circle.
    fn round(&self, mesh: &mut TetMesh) {
        for &node in mesh.surfaces["side"].as_flattened() {
            self.project(&mut mesh.nodes[node as usize]);
        }
    }

    /// Adds a point on the circle to each edge of the wall that is not parallel to the axis.
    fn curve(&self, mesh: &mut TetMesh) {
        let sides = |&[a, b, c]: &[u32; 3]| [key([a, b]), key([b, c]), key([c, a])];
        let mut edges: Vec<[u32; 2]> = mesh.surfaces["side"].iter().flat_map(sides).collect();
        edges.sort_unstable();
        edges.dedup();
        for edge in edges {
            let straight = middle(&mesh.nodes, edge);
            if straight[0].hypot(straight[1]) < (1.0 - 1e-9) * self.radius_mm {
                let mut point = straight;
                self.project(&mut point);
                mesh.edge_points.push((edge, point));
            }
        }
    }

    /// Moves a point radially onto the circle of the wall.
    fn project(&self, [x, y, _]: &mut Point) {
        let stretch = self.radius_mm / x.hypot(*y);
        (*x, *y) = (*x * stretch, *y * stretch);
    }
}

/// Returns the number n of cells along a side of the central block of the cross-section.
fn cells(radius: f64, spacing: f64) -> usize {
    ((BLOCK * radius / spacing).round() as usize).max(3)
}

/// Nodes (mm) and cells of the cross-section.
struct Section {
    positions: Vec<[f64; 2]>,
    /// Corners of each cell, counter-clockwise seen from above.
    quads: Vec<[u32; 4]>,
}

impl Section {
    fn new(radius: f64, spacing: f64) -> Section {
        let n = cells(radius, spacing);
        let rings = ((RINGS * radius / spacing).round() as usize).max(1);
        let half_width = radius * WIDTH / (1.0 + 2.0 * rings as f64 / n as f64);

        let mut positions = Vec::new();
        let mut quads = Vec::new();
        let block = |i: usize, j: usize| (i + (n + 1) * j) as u32;
        for j in 0..=n {
            for i in 0..=n {
                // this formula makes mirrored points symmetric to the last bit
                let u = (2.0 * i as f64 - n as f64) / n as f64;
                let v = (2.0 * j as f64 - n as f64) / n as f64;
                positions.push([
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

        // nodes on the boundary of the central block, counter-clockwise from the corner at −135°
        let around: Vec<u32> = (0..n)
            .map(|k| block(k, 0))
            .chain((0..n).map(|k| block(n, k)))
            .chain((0..n).map(|k| block(n - k, n)))
            .chain((0..n).map(|k| block(0, n - k)))
            .collect();
        let mut inner = around.clone();
        for ring in 1..=rings {
            let t = ring as f64 / rings as f64;
            let outer: Vec<u32> = (0..4 * n).map(|k| (positions.len() + k) as u32).collect();
            for (k, &foot) in around.iter().enumerate() {
                let angle = PI * (-0.75 + k as f64 / (2 * n) as f64);
                let [x, y] = positions[foot as usize];
                positions.push([
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
        Section { positions, quads }
    }
}

/// Extrudes the cross-section into layers of hexahedra and divides the hexahedra into tetrahedra.
fn extruded(section: &Section, height: f64, layers: usize) -> TetMesh {
    let level = section.positions.len() as u32;
    let mut nodes: Vec<Point> = Vec::new();
    for k in 0..=layers {
        let z = height * k as f64 / layers as f64;
        nodes.extend(section.positions.iter().map(|&[x, y]| [x, y, z]));
    }
    let hexahedron = move |quad: &[u32; 4], k: u32| -> [u32; 8] {
        std::array::from_fn(|corner| quad[corner % 4] + (k + corner as u32 / 4) * level)
    };
    let hexahedra: Vec<[u32; 8]> = (0..layers as u32)
        .flat_map(|k| section.quads.iter().map(move |quad| hexahedron(quad, k)))
        .collect();
    hexahedra::twelve(nodes, &hexahedra, ["bottom", "top", "side", "side", "side", "side"])
}
