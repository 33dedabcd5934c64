//! Notes on an imported mesh file, for the author of the file.

use std::fmt;

use fem_image::listed;

use crate::mesh::TetMesh;
use crate::mesh::cavities::Cavity;

/// An imported mesh with notes.
#[derive(Clone, Debug, PartialEq)]
pub struct Imported {
    /// The mesh.
    pub mesh: TetMesh,
    /// Notes for the author of the mesh file.
    pub notes: Vec<ImportNote>,
}

/// A property of a mesh file that changes the results and that the author of the file may not expect.
#[derive(Clone, Debug, PartialEq)]
#[non_exhaustive]
pub enum ImportNote {
    /// Folded curved tetrahedra have been straightened.
    Straightened {
        /// Numbers of the straightened tetrahedra, from 0.
        tets: Vec<u32>,
        /// Total number of tetrahedra in the mesh.
        all: usize,
    },
    /// Volumes of the geometry are without elements, or the mesh encloses cavities.
    Missing {
        /// Elementary tags of the volumes of the geometry that have neither a physical group nor elements.
        volumes: Vec<i32>,
        /// Cavities inside the mesh.
        cavities: Vec<Cavity>,
    },
}

impl Imported {
    pub(super) fn new(mesh: TetMesh, straightened: Vec<u32>, volumes: Vec<i32>) -> Imported {
        let mut notes = Vec::new();
        if !straightened.is_empty() {
            notes.push(ImportNote::Straightened { tets: straightened, all: mesh.tets.len() });
        }
        let cavities = mesh.cavities();
        if !volumes.is_empty() || !cavities.is_empty() {
            notes.push(ImportNote::Missing { volumes, cavities });
        }
        Imported { mesh, notes }
    }
}

impl fmt::Display for ImportNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImportNote::Straightened { tets, all } => write!(
                f,
                "{} of {all} tetrahedra of the file are folded by their curved edges and were straightened: {}; use a finer \
                 mesh, or Mesh.HighOrderOptimize = 1 in Gmsh, to preserve the curved edges",
                tets.len(),
                listed(tets.iter().map(u32::to_string), ", "),
            ),
            ImportNote::Missing { volumes, cavities } => {
                let volume_and_centre = |cavity: &Cavity| {
                    let [x, y, z] = cavity.centre_mm;
                    format!("{:.3} mm³ at ({x:.3}, {y:.3}, {z:.3}) mm", cavity.volume_mm3)
                };
                let cavity_list = listed(cavities.iter().map(volume_and_centre), ", ");
                match cavities.len() {
                    0 => {}
                    1 => write!(f, "the mesh has a cavity inside: {cavity_list}; ")?,
                    count => write!(f, "the mesh has {count} cavities inside: {cavity_list}; ")?,
                }
                match volumes.len() {
                    0 => write!(
                        f,
                        "to fill a cavity, give its volume a physical group in Gmsh and list the group among the \
                         regions"
                    ),
                    count => write!(
                        f,
                        "{} of the geometry {} no physical group, so Gmsh saved no element of {}; give {} a \
                         physical group and list the group among the regions",
                        listed(volumes.iter().map(|volume| format!("volume {volume}")), ", "),
                        if count == 1 { "has" } else { "have" },
                        if count == 1 { "it" } else { "them" },
                        if count == 1 { "it" } else { "each" },
                    ),
                }
            }
        }
    }
}
