//! Meshes of virtual specimens: a packing for each specimen, or a mesh file that all specimens share.

use std::path::Path;

use fem::{Meshing, Packing, TetMesh, gmsh};

use super::build::packed_mesh;
use crate::case::SpecimenGeometry;
use crate::experiments::mesh_scale::MeshSize;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;

/// Bodies of the virtual specimens of a case.
pub(crate) enum VirtualBodies<'a> {
    /// Cylinders. Each specimen has its own packing.
    Packings {
        /// Radius and height, mm.
        size_mm: [f64; 2],
        grains: Option<&'a Packing>,
        meshing: &'a Meshing,
    },
    /// The mesh of the case. All specimens have one microstructure, and scatter by their parameters only.
    Shared(Box<TetMesh>),
}

impl<'a> VirtualBodies<'a> {
    /// The bodies of a case.
    ///
    /// # Errors
    /// If the specimen is neither a cylinder nor a mesh file, or if the mesh cannot be read.
    pub(crate) fn of(
        inputs: &Inputs<'_>,
        geometry: &'a SpecimenGeometry,
    ) -> Result<Self, WorkflowError> {
        match geometry {
            SpecimenGeometry::Cylinder { radius_mm, height_mm, grains, meshing, .. } => {
                let size_mm = [*radius_mm, *height_mm];
                Ok(Self::Packings { size_mm, grains: grains.as_ref(), meshing })
            }
            SpecimenGeometry::Mesh { .. } | SpecimenGeometry::Block { .. } => {
                let mesh = gmsh::read(inputs.file("mesh.msh")?, &gmsh::GmshNames::default())?;
                Ok(Self::Shared(Box::new(mesh)))
            }
            _ => {
                let message = "virtual specimens need a cylinder, in which each specimen has its own packing, a block, \
                               or a mesh file";
                Err(WorkflowError::Unusable(message.to_owned()))
            }
        }
    }

    /// The packing of the case, whose grains the specimens do not share; `None` without grains or with a mesh file.
    pub(crate) fn grains(&self) -> Option<&'a Packing> {
        match self {
            Self::Packings { grains, .. } => *grains,
            Self::Shared(_) => None,
        }
    }

    /// Element size of the case in mm; `None` for a mesh file.
    pub(crate) fn spacing_mm(&self) -> Option<f64> {
        match self {
            Self::Packings { meshing, .. } => Some(meshing.spacing_mm),
            Self::Shared(_) => None,
        }
    }

    /// Radius and height in mm.
    pub(crate) fn size_mm(&self) -> [f64; 2] {
        match self {
            Self::Packings { size_mm, .. } => *size_mm,
            Self::Shared(mesh) => {
                let size = MeshSize::of(mesh);
                [size.radius_mm, size.height_mm]
            }
        }
    }

    /// Returns the mesh of a specimen. `seed` is the seed of its packing, by default the seed of the case; `spacing_mm`
    /// is the element size, by default the element size of the case. Both arguments have no effect for a mesh file.
    pub(crate) fn mesh(
        &self,
        case: &Path,
        seed: Option<u64>,
        spacing_mm: Option<f64>,
    ) -> Result<TetMesh, WorkflowError> {
        match self {
            Self::Packings { size_mm, grains, meshing } => {
                let grains = grains.map(|g| Packing { seed: seed.unwrap_or(g.seed), ..g.clone() });
                let spacing_mm = spacing_mm.unwrap_or(meshing.spacing_mm);
                let meshing = Meshing { spacing_mm, ..**meshing };
                // virtual specimens are meshed from the exact grains, not from a scan
                Ok(packed_mesh(case, *size_mm, grains.as_ref(), &meshing)?.mesh)
            }
            Self::Shared(mesh) => Ok(TetMesh::clone(mesh)),
        }
    }
}
