//! Writer of binary STL files of the surfaces of grains and specimens; reader of STL files of other programs.
//!
//! Surfaces consist of faces of tetrahedra, so the surfaces of a conforming mesh are closed. In a mesh with curved
//! edges each face is divided into four triangles.
//!
//! # Reference
//! M. Burns, "Automated Fabrication", Prentice Hall (1993), section 6.5.

use std::collections::BTreeMap;
use std::path::Path;

use crate::error::MeshError;
use crate::mesh::TetMesh;
use crate::mesh::topology::{EdgePoint, edge_index};
use crate::mesh::vector::{Point, cross, dot, norm, scale, sub};
use fem_file::write_atomically;

mod read;

pub use read::read;

/// Corners of a triangle (mm), counter-clockwise seen from outside the body.
pub type Triangle = [[f64; 3]; 3];

/// Returns the surface of the whole body, with normals pointing outwards.
pub fn specimen(mesh: &TetMesh) -> Vec<Triangle> {
    triangulated(mesh, mesh.boundary_faces())
}

/// Returns the surface of each grain by grain number, with normals pointing outwards: the faces between the grain and
/// the matrix, other grains, or the outside. The matrix (number 0) is omitted; the map is empty if the mesh has no
/// grain numbers.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, Packing, label, stl};
///
/// let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.7 };
/// let mut mesh = lattice.build()?;
/// label(&mut mesh, &Packing::new(0.2, 1).fill(lattice.radius_mm, lattice.height_mm)?);
/// let path = std::env::temp_dir().join("fem-doc-grain.stl");
/// for (number, surface) in stl::grains(&mesh) {
///     stl::write(&path, &format!("grain {number}"), &surface)?;
/// }
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn grains(mesh: &TetMesh) -> BTreeMap<u32, Vec<Triangle>> {
    let mut faces: BTreeMap<u32, Vec<[u32; 3]>> = BTreeMap::new();
    let Some(grain_of) = &mesh.grain_of else { return BTreeMap::new() };
    for shared in mesh.sorted_faces().chunk_by(|a, b| a.key == b.key) {
        let number = |k: usize| shared.get(k).map_or(0, |face| grain_of[face.tet as usize]);
        let grains = [number(0), number(1)];
        for (face, grain) in shared.iter().zip(grains) {
            if grains[0] != grains[1] && grain > 0 {
                faces.entry(grain).or_default().push(face.outward);
            }
        }
    }
    faces.into_iter().map(|(grain, faces)| (grain, triangulated(mesh, faces))).collect()
}

/// Returns the volume enclosed by a closed surface (mm³), positive if its normals point outwards.
pub fn enclosed_volume(surface: &[Triangle]) -> f64 {
    surface.iter().map(|&[a, b, c]| dot(a, cross(b, c)) / 6.0).sum()
}

/// Writes triangles as binary STL, in mm and single precision; the header contains `title` and is truncated to 80
/// bytes.
///
/// # Errors
/// [`MeshError::File`] for more than 2³² − 1 triangles, [`MeshError::Io`] if the file cannot be written.
pub fn write(path: impl AsRef<Path>, title: &str, surface: &[Triangle]) -> Result<(), MeshError> {
    let path = path.as_ref();
    let count = u32::try_from(surface.len()).map_err(|_| MeshError::File {
        path: path.into(),
        place: "header".into(),
        message: format!(
            "{} triangles exceed the limit of the format (2³² − 1); use a coarser mesh",
            surface.len()
        ),
    })?;
    let mut bytes = Vec::with_capacity(84 + 50 * surface.len());
    // readers treat a file that begins with `solid` as ASCII, so the header must begin with another word
    let title = format!("binary STL: {title}");
    bytes.extend(title.bytes().chain(std::iter::repeat(b' ')).take(80));
    bytes.extend(count.to_le_bytes());
    for triangle in surface {
        for point in std::iter::once(&normal(triangle)).chain(triangle) {
            point.iter().for_each(|&x| bytes.extend((x as f32).to_le_bytes()));
        }
        bytes.extend([0; 2]);
    }
    write_atomically(path, &bytes).map_err(|error| MeshError::io("write", path, error))
}

fn normal(&[a, b, c]: &Triangle) -> Point {
    let area = cross(sub(b, a), sub(c, a));
    let length = norm(area);
    if length > 0.0 { scale(area, 1.0 / length) } else { [0.0; 3] }
}

fn triangulated(mesh: &TetMesh, faces: Vec<[u32; 3]>) -> Vec<Triangle> {
    let at = |node: u32| mesh.nodes[node as usize];
    if mesh.edge_points.is_empty() {
        return faces.into_iter().map(|face| face.map(at)).collect();
    }
    let edges: Vec<EdgePoint> = mesh.all_edges();
    let on = |a, b| edges[edge_index(&edges, [a, b])].1;
    let four = |[a, b, c]: [u32; 3]| {
        let (ab, bc, ca) = (on(a, b), on(b, c), on(c, a));
        [[at(a), ab, ca], [ab, at(b), bc], [ca, bc, at(c)], [ab, bc, ca]]
    };
    faces.into_iter().flat_map(four).collect()
}
