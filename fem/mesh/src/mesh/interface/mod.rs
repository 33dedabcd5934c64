//! Surface between two regions of a mesh, and the band of elements around this surface.

mod level;
mod nearest;

use rayon::prelude::*;

use self::level::{fraction_below, level_of, section};
use self::nearest::{Grid, Piece};
use super::tet_mesh::{Mixture, TetMesh};
use super::topology::EDGES;
use super::vector::{Point, cross, dot, mean, norm, sub};

/// Surface between two regions of a mesh.
///
/// Between tetrahedra of one phase each, the surface consists of their common faces. In a mixture, the surface is the
/// plane with the normal of the mixture that divides the tetrahedron according to its fraction. In a mixture without
/// normal, the surface is a ball at the centroid.
///
/// # Example
/// ```
/// use fem_mesh::{Block, InterfaceSurface};
///
/// let mesh = Block::new([4.0, 1.0, 1.0], [8, 2, 2]).build()?;
/// let mesh = mesh.with_regions(&["matrix", "grain"], |[x, ..]| u16::from(x > 2.0));
/// let surface = InterfaceSurface::new(&mesh, [0, 1]);
/// assert!((surface.area_mm2() - 1.0).abs() < 1e-12);
/// assert!((surface.row_mm()[0] - 0.5).abs() < 1e-12);
/// // the band of 0.75 mm in the matrix, and no band in the grain
/// let band = surface.band(&mesh, [0.75, 0.0]);
/// let volume: f64 = band.iter().enumerate().map(|(tet, share)| share * mesh.tet_volume(tet)).sum();
/// assert!((volume - 0.75).abs() < 1e-12);
/// # Ok::<(), fem_mesh::BlockError>(())
/// ```
#[derive(Debug)]
pub struct InterfaceSurface {
    regions: [u16; 2],
    pieces: Vec<Piece>,
    area_mm2: f64,
    /// Volume (mm³) of the elements that touch the surface, on the side of each region.
    row_mm3: [f64; 2],
}

impl InterfaceSurface {
    /// Finds the surface between two regions, given as indices into `mesh.regions`.
    pub fn new(mesh: &TetMesh, regions: [u16; 2]) -> Self {
        let mut surface = Self { regions, pieces: Vec::new(), area_mm2: 0.0, row_mm3: [0.0; 2] };
        for &[first, second] in &mesh.neighbours() {
            let tets = [first as usize, second as usize];
            let sides = tets.map(|tet| surface.pure_side(mesh, tet));
            let ([Some(0), Some(1)] | [Some(1), Some(0)]) = sides else { continue };
            let of_first = mesh.tets[tets[0]];
            let common = of_first.into_iter().filter(|node| mesh.tets[tets[1]].contains(node));
            let mut corners = [[0.0; 3]; 3];
            corners.iter_mut().zip(common).for_each(|(x, node)| *x = mesh.nodes[node as usize]);
            surface.add(corners);
            for (tet, side) in tets.into_iter().zip(sides) {
                // a full row of elements has three times the volume of the elements that share a face with the surface;
                // the other elements of the row share an edge or a node
                surface.row_mm3[side.unwrap_or(0)] += 3.0 * mesh.tet_volume(tet);
            }
        }
        for tet in 0..mesh.tets.len() {
            let Some((side, mixture)) = surface.mixed_side(mesh, tet) else { continue };
            let (corners, volume) = (mesh.corners(tet), mesh.tet_volume(tet));
            let fraction = f64::from(mixture.fraction);
            surface.row_mm3[side] += (1.0 - fraction) * volume;
            match plane(&corners, &mixture) {
                Some((values, level)) => section(corners, values, level)
                    .into_iter()
                    .for_each(|triangle| surface.add(triangle)),
                None => {
                    let radius = ball_mm(fraction * volume);
                    surface.area_mm2 += 4.0 * std::f64::consts::PI * radius * radius;
                    surface.pieces.push(Piece::Ball(mean(corners.into_iter()), radius));
                }
            }
        }
        surface
    }

    fn add(&mut self, triangle: [Point; 3]) {
        let [a, b, c] = triangle;
        self.area_mm2 += 0.5 * norm(cross(sub(b, a), sub(c, a)));
        self.pieces.push(Piece::Triangle(triangle));
    }

    /// Returns the area of the surface (mm²); zero if the regions do not touch.
    pub fn area_mm2(&self) -> f64 {
        self.area_mm2
    }

    /// Returns the mean thickness (mm) of the row of elements at the surface, on the side of each region; zero if the
    /// region has no element at the surface. Only the matrix of a mixture is included.
    pub fn row_mm(&self) -> [f64; 2] {
        self.row_mm3.map(|volume| if volume > 0.0 { volume / self.area_mm2 } else { 0.0 })
    }

    /// Returns the share of each tetrahedron that is closer to the surface than `half_width_mm`, which has one width
    /// for each region. The share of a mixture is the share of its matrix.
    ///
    /// The distance from the surface is interpolated linearly between the vertices.
    pub fn band(&self, mesh: &TetMesh, half_width_mm: [f64; 2]) -> Vec<f64> {
        let widest = half_width_mm[0].max(half_width_mm[1]);
        if self.pieces.is_empty() || widest <= 0.0 {
            return vec![0.0; mesh.tets.len()];
        }
        let longest = |tet: usize| {
            let x = mesh.corners(tet);
            EDGES.iter().map(|&[a, b]| norm(sub(x[a], x[b]))).fold(0.0, f64::max)
        };
        let longest = (0..mesh.tets.len()).map(longest).fold(0.0, f64::max);
        // a larger distance is not needed: the band contains no part of an element with a vertex at that distance
        let grid = Grid::new(&self.pieces, widest + longest);
        let distances: Vec<f64> = mesh.nodes.par_iter().map(|&x| grid.distance(x)).collect();
        let share = |tet: usize| {
            if let Some((side, mixture)) = self.mixed_side(mesh, tet) {
                return share_of_mixture(mesh, tet, &mixture, half_width_mm[side]);
            }
            let Some(side) = self.pure_side(mesh, tet) else { return 0.0 };
            let at = mesh.tets[tet].map(|node| distances[node as usize]);
            let is_near = at.iter().any(|distance| *distance < half_width_mm[side]);
            if is_near { fraction_below(at, half_width_mm[side]) } else { 0.0 }
        };
        (0..mesh.tets.len()).into_par_iter().map(share).collect()
    }

    /// Returns the side (0 or 1) of a tetrahedron of one phase; `None` for a mixture or a tetrahedron of another region.
    fn pure_side(&self, mesh: &TetMesh, tet: usize) -> Option<usize> {
        let tet_region = mesh.region_of[tet];
        let mixture = mesh
            .mixture
            .as_ref()
            .map(|all| all[tet])
            .filter(|mixture| mixture.region != tet_region);
        let phase = match mixture {
            Some(Mixture { fraction, region, .. }) if fraction >= 1.0 => region,
            Some(mixture) if mixture.fraction > 0.0 => return None,
            _ => tet_region,
        };
        self.regions.iter().position(|&region| region == phase)
    }

    /// Returns the side (0 or 1) of the matrix of a tetrahedron, and its mixture; `None` unless the tetrahedron is a
    /// mixture of the two regions.
    fn mixed_side(&self, mesh: &TetMesh, tet: usize) -> Option<(usize, Mixture)> {
        let mixture = mesh.mixture.as_ref()?[tet];
        let [first, second] = self.regions;
        let pair = (mesh.region_of[tet], mixture.region);
        let side = [(first, second), (second, first)]
            .into_iter()
            .position(|side_pair| side_pair == pair)?;
        (mixture.fraction > 0.0 && mixture.fraction < 1.0).then_some((side, mixture))
    }
}

/// Returns the coordinates of the vertices along the normal of a mixture, and the coordinate of the plane that divides
/// the tetrahedron according to the fraction; `None` without normal.
fn plane(corners: &[Point; 4], mixture: &Mixture) -> Option<([f64; 4], f64)> {
    let normal = mixture.normal.map(f64::from);
    let length = norm(normal);
    if length == 0.0 {
        return None;
    }
    let values = corners.map(|x| dot(normal, x) / length);
    Some((values, level_of(values, f64::from(mixture.fraction))))
}

/// Returns the radius of a ball of this volume (mm).
fn ball_mm(volume_mm3: f64) -> f64 {
    (0.75 * volume_mm3 / std::f64::consts::PI).cbrt()
}

/// Returns the share of a mixture's matrix that is closer to the grain than `half_width_mm`.
fn share_of_mixture(mesh: &TetMesh, tet: usize, mixture: &Mixture, half_width_mm: f64) -> f64 {
    let (corners, fraction) = (mesh.corners(tet), f64::from(mixture.fraction));
    match plane(&corners, mixture) {
        Some((values, level)) => {
            let within = fraction_below(values, level + half_width_mm) - fraction;
            (within / (1.0 - fraction)).clamp(0.0, 1.0)
        }
        None => {
            let volume = mesh.tet_volume(tet);
            let radius = ball_mm(fraction * volume);
            let shell = 4.0 / 3.0
                * std::f64::consts::PI
                * ((radius + half_width_mm).powi(3) - radius.powi(3));
            (shell / ((1.0 - fraction) * volume)).clamp(0.0, 1.0)
        }
    }
}
