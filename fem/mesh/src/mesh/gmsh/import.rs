//! Notes on an imported mesh file, for the author of the file.

use std::fmt;

use fem_image::listed;

use super::region_volume::{RegionVolume, region_volumes};
use super::straighten::Straightening;
use crate::error::MeshError;
use crate::mesh::TetMesh;
use crate::mesh::cavities::Cavity;

/// Relative change of the volume of a region above which a note on straight edges is added.
const NOTED_CHANGE: f64 = 0.005;

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
    /// Edges of folded curved tetrahedra have been made less curved.
    Straightened {
        /// Numbers of the tetrahedra that were folded, from 0.
        tets: Vec<u32>,
        /// Total number of tetrahedra in the mesh.
        all: usize,
        /// Volume of each region in the file and in the mesh.
        volumes: Vec<RegionVolume>,
    },
    /// All curved edges have been made straight, for linear elements.
    Linear {
        /// Volume of each region in the file and in the mesh.
        volumes: Vec<RegionVolume>,
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
    pub(super) fn new(mesh: TetMesh, repair: Straightening, volumes: Vec<i32>) -> Imported {
        let mut notes = Vec::new();
        if !repair.tets.is_empty() {
            let Straightening { tets, volumes } = repair;
            notes.push(ImportNote::Straightened { tets, all: mesh.tets.len(), volumes });
        }
        let cavities = mesh.cavities();
        if !volumes.is_empty() || !cavities.is_empty() {
            notes.push(ImportNote::Missing { volumes, cavities });
        }
        Imported { mesh, notes }
    }

    /// Makes all curved edges straight, as linear elements have them. A note replaces the note on folded elements if a
    /// region gains or loses more than half a percent of its volume.
    ///
    /// # Errors
    /// The errors of [`TetMesh::validate_straight`]: a curved tetrahedron may have corners whose straight volume is
    /// negative.
    pub fn with_straight_edges(mut self) -> Result<Imported, MeshError> {
        let mut in_file = region_volumes(&self.mesh);
        for note in &self.notes {
            if let ImportNote::Straightened { volumes, .. } = note {
                in_file = volumes.iter().map(|volume| volume.file_mm3).collect();
            }
        }
        self.notes.retain(|note| !matches!(note, ImportNote::Straightened { .. }));
        self.mesh.edge_points.clear();
        self.mesh.validate_straight()?;
        let mesh = &self.mesh;
        let volumes = RegionVolume::pairs(&mesh.regions, in_file, region_volumes(mesh));
        if volumes.iter().any(|volume| volume.change().abs() > NOTED_CHANGE) {
            self.notes.insert(0, ImportNote::Linear { volumes });
        }
        Ok(self)
    }
}

impl fmt::Display for ImportNote {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            ImportNote::Straightened { tets, all, volumes } => write!(
                f,
                "the volumes of the mesh differ from the file: {}; {} of {all} tetrahedra of the file are folded by their \
                 curved edges, and the mid-edge points of these edges were moved towards the midpoints until no \
                 tetrahedron was folded; a finer mesh, or Mesh.HighOrderOptimize = 1 in Gmsh, preserves the curved edges; \
                 folded tetrahedra: {}",
                in_words(volumes),
                tets.len(),
                listed(tets.iter().map(u32::to_string), ", "),
            ),
            ImportNote::Linear { volumes } => write!(
                f,
                "the volumes of the mesh differ from the file: {}; linear elements have straight edges; order = 2 \
                 preserves the curved edges of the file",
                in_words(volumes),
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

fn in_words(volumes: &[RegionVolume]) -> String {
    volumes.iter().map(RegionVolume::to_string).collect::<Vec<_>>().join(", ")
}
