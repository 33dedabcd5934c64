//! A packing of its own for each run of an ensemble.

use fem::{FemError, GrainList, Meshing, MeshingError, Packing};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::Dataset;

use super::WorkflowError;
use super::inputs::Inputs;
use super::simulator::{Setup, Simulator};
use super::specimen::packed_mesh;
use crate::case::{MaterialParameter, Microstructure, SpecimenGeometry};

/// The column of `runs.csv` with the seed of a packing of its own; empty without one.
pub(super) const SEED: &str = "packing_seed";

/// The packings of an ensemble, meshed when their run begins: a thousand meshes need not be kept.
pub(super) struct Packings<'a> {
    /// Seed of each run's packing.
    pub(super) seeds: Vec<u64>,
    grains: Vec<GrainList>,
    size_mm: [f64; 2],
    meshing: Meshing,
    setup: Setup<'a>,
    parameters: Vec<MaterialParameter>,
}

impl<'a> Packings<'a> {
    /// Packings for so many runs, if the case wants one for each and describes specimens by a packing.
    ///
    /// # Errors
    /// A case that makes no simulation; a packing that does not fit in.
    pub(super) fn of(inputs: &'a Inputs<'_>, runs: usize) -> Result<Option<Self>, WorkflowError> {
        let Some((packing, size_mm, meshing)) = per_run(inputs)? else { return Ok(None) };
        let (setup, parameters) = (inputs.setup(), inputs.parameters()?);
        // materials and test are checked on the case's own packing before any run begins
        let mesh = packed_mesh(setup.path, size_mm, Some(&packing), &meshing)?.mesh;
        Simulator::new(&setup, mesh, parameters.clone())?;
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(inputs.design().seed);
        let seeds: Vec<u64> = (0..runs).map(|_| u64::from(rng.random::<u32>())).collect();
        let fill = |&seed: &u64| {
            let [radius_mm, height_mm] = size_mm;
            let packing = Packing { seed, ..packing.clone() };
            let grains = packing
                .fill(radius_mm, height_mm)
                .map_err(|source| WorkflowError::Packing { file: setup.path.to_owned(), source })?;
            Ok(GrainList::new(grains, radius_mm, height_mm))
        };
        let grains = seeds.iter().map(fill).collect::<Result<_, WorkflowError>>()?;
        Ok(Some(Self { seeds, grains, size_mm, meshing, setup, parameters }))
    }

    /// The test on the packing of a run, by its place.
    pub(super) fn simulator(&self, run: usize) -> Result<Simulator, FemError> {
        let [radius_mm, height_mm] = self.size_mm;
        let built = self.meshing.build(radius_mm, height_mm, &self.grains[run]);
        let mesh = built.map_err(|error| match error {
            MeshingError::Unsound(error) => FemError::Mesh(error),
            other => unsupported(&other.to_string()),
        })?;
        Simulator::new(&self.setup, mesh.mesh, self.parameters.clone()).map_err(|error| match error
        {
            WorkflowError::Test { source, .. } => source,
            other => unsupported(&other.to_string()),
        })
    }
}

/// Packing, size [radius, height] and mesher of an ensemble with a packing for each run.
fn per_run(inputs: &Inputs<'_>) -> Result<Option<(Packing, [f64; 2], Meshing)>, WorkflowError> {
    if inputs.design().microstructure == Microstructure::One {
        return Ok(None);
    }
    Ok(match inputs.geometry()? {
        SpecimenGeometry::Cylinder {
            radius_mm, height_mm, grains: Some(packing), meshing, ..
        } if packing.fraction > 0.0 => Some((packing, [radius_mm, height_mm], meshing)),
        _ => None,
    })
}

/// Whether each run of a dataset had a packing of its own.
pub(super) fn has_packing_per_run(runs: &Dataset) -> bool {
    !runs.is_empty() && (0..runs.len()).all(|i| runs.note(i, SEED).is_some_and(|s| !s.is_empty()))
}

fn unsupported(message: &str) -> FemError {
    FemError::Unsupported {
        entity: "a packing of the design".to_owned(),
        message: message.to_owned(),
        help: "take another seed of the design, or a finer spacing".to_owned(),
    }
}
