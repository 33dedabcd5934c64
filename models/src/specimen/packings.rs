//! Packings of grains for the runs of an ensemble.

use fem::{FemError, GrainList, Meshing, MeshingError, Packing, TetMesh, Unsupported};

use super::build::packed_mesh;
use super::levels::Level;
use crate::case::{Parameter, SpecimenGeometry};
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::simulation::simulator::Simulator;

/// Packings of the runs. A packing is meshed when its run starts, so that a thousand meshes need not be stored.
pub(crate) struct Packings {
    /// Seed of each packing.
    pub(crate) seeds: Vec<u64>,
    grains: Vec<GrainList>,
    size_mm: [f64; 2],
    meshing: Meshing,
    case_packing: Packing,
}

impl Packings {
    /// Generates packings with the given seeds; `None` if the specimen of the case is not a
    /// packing.
    ///
    /// # Errors
    /// Fails if the grains of a packing do not fit into the specimen.
    pub(crate) fn with_seeds(
        inputs: &Inputs<'_>,
        seeds: Vec<u64>,
    ) -> Result<Option<Self>, WorkflowError> {
        let (case_packing, size_mm, meshing) = match inputs.geometry()? {
            SpecimenGeometry::Cylinder {
                radius_mm,
                height_mm,
                grains: Some(packing),
                meshing,
                ..
            } if packing.fraction > 0.0 => (packing, [radius_mm, height_mm], meshing),
            _ => return Ok(None),
        };
        let fill = |&seed: &u64| {
            let [radius_mm, height_mm] = size_mm;
            let packing = Packing { seed, ..case_packing.clone() };
            let grains = packing.fill(radius_mm, height_mm).map_err(|source| {
                let file = inputs.case_path().to_owned();
                WorkflowError::Packing { file, source }
            })?;
            Ok(GrainList::new(grains, radius_mm, height_mm))
        };
        let grains = seeds.iter().map(fill).collect::<Result<_, WorkflowError>>()?;
        Ok(Some(Self { seeds, grains, size_mm, meshing, case_packing }))
    }

    /// Returns the seed of the packing of the case.
    pub(crate) fn case_seed(&self) -> u64 {
        self.case_packing.seed
    }

    /// Checks materials and test of a level on the packing of the case, for the parameter `values`, before the
    /// first run.
    ///
    /// # Errors
    /// Fails if the case cannot be simulated.
    pub(crate) fn check(
        &self,
        level: &Level<'_>,
        parameters: Vec<Parameter>,
        values: &[f64],
    ) -> Result<(), WorkflowError> {
        let meshing = level.meshing(&self.meshing);
        let mesh =
            packed_mesh(level.setup.path, self.size_mm, Some(&self.case_packing), &meshing)?.mesh;
        Simulator::new(&level.setup, mesh, parameters)?.check(&level.setup, values)
    }

    /// Mesh of the packing with index `packing` on a level.
    ///
    /// # Errors
    /// Fails if the packing cannot be meshed.
    pub(crate) fn mesh(&self, packing: usize, level: &Level<'_>) -> Result<TetMesh, FemError> {
        let [radius_mm, height_mm] = self.size_mm;
        let built = level.meshing(&self.meshing).build(radius_mm, height_mm, &self.grains[packing]);
        built.map(|meshed| meshed.mesh).map_err(|error| match error {
            MeshingError::Unsound(error) => FemError::Mesh(error),
            other => unsupported(&other.to_string()),
        })
    }

    /// Simulator of a level on the packing with index `packing`.
    ///
    /// # Errors
    /// The errors of [`Self::mesh`]. Also fails if the materials do not suit the mesh.
    pub(crate) fn simulator(
        &self,
        packing: usize,
        level: &Level<'_>,
        parameters: &[Parameter],
    ) -> Result<Simulator, FemError> {
        let mesh = self.mesh(packing, level)?;
        Simulator::new(&level.setup, mesh, parameters.to_vec()).map_err(|error| match error {
            WorkflowError::Test { source, .. } => source,
            other => unsupported(&other.to_string()),
        })
    }
}

fn unsupported(message: &str) -> FemError {
    let help = "take another seed of the design, or a finer spacing";
    let reason = Unsupported::ByCaller { message: message.to_owned(), help };
    FemError::Unsupported { entity: "a packing of the design".to_owned(), reason }
}
