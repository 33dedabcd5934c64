//! A packing of its own for each run of an ensemble.

use std::ops::Range;

use fem::{FemError, GrainList, Meshing, MeshingError, Packing, TetMesh};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;
use surrogate::Dataset;

use super::WorkflowError;
use super::inputs::Inputs;
use super::levels::Level;
use super::simulator::Simulator;
use super::specimen::packed_mesh;
use super::stiffness::stiffness_ratio;
use crate::case::{MaterialParameter, Microstructure, SpecimenGeometry};

/// The column of `runs.csv` with the seed of a packing of its own; empty without one.
pub(super) const SEED: &str = "packing_seed";

/// The packings of an ensemble, meshed when their run begins: a thousand meshes need not be kept.
pub(super) struct Packings {
    /// Seed of each run's packing.
    pub(super) seeds: Vec<u64>,
    grains: Vec<GrainList>,
    size_mm: [f64; 2],
    meshing: Meshing,
    own: Packing,
    parameters: Vec<MaterialParameter>,
}

impl Packings {
    /// Packings for so many runs, if the case wants one for each and describes specimens by a packing.
    ///
    /// # Errors
    /// A packing that does not fit in.
    pub(super) fn of(inputs: &Inputs<'_>, runs: usize) -> Result<Option<Self>, WorkflowError> {
        if inputs.design().microstructure == Microstructure::One {
            return Ok(None);
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(inputs.design().seed);
        Self::with_seeds(inputs, (0..runs).map(|_| u64::from(rng.random::<u32>())).collect())
    }

    /// Packings of these seeds, if the case describes specimens by one.
    ///
    /// # Errors
    /// A packing that does not fit in.
    pub(super) fn with_seeds(
        inputs: &Inputs<'_>,
        seeds: Vec<u64>,
    ) -> Result<Option<Self>, WorkflowError> {
        let (own, size_mm, meshing) = match inputs.geometry()? {
            SpecimenGeometry::Cylinder {
                radius_mm,
                height_mm,
                grains: Some(packing),
                meshing,
                ..
            } if packing.fraction > 0.0 => (packing, [radius_mm, height_mm], meshing),
            _ => return Ok(None),
        };
        let parameters = inputs.parameters()?;
        let fill = |&seed: &u64| {
            let [radius_mm, height_mm] = size_mm;
            let packing = Packing { seed, ..own.clone() };
            let grains = packing.fill(radius_mm, height_mm).map_err(|source| {
                let file = inputs.case_path().to_owned();
                WorkflowError::Packing { file, source }
            })?;
            Ok(GrainList::new(grains, radius_mm, height_mm))
        };
        let grains = seeds.iter().map(fill).collect::<Result<_, WorkflowError>>()?;
        Ok(Some(Self { seeds, grains, size_mm, meshing, own, parameters }))
    }

    /// The seed of the case's own packing.
    pub(super) fn own_seed(&self) -> u64 {
        self.own.seed
    }

    /// Checks materials and test of a level on the case's own packing with these values of the
    /// parameters, before any run begins.
    ///
    /// # Errors
    /// A case that makes no simulation.
    pub(super) fn check(&self, level: &Level<'_>, values: &[f64]) -> Result<(), WorkflowError> {
        let meshing = level.meshing(&self.meshing);
        let mesh = packed_mesh(level.setup.path, self.size_mm, Some(&self.own), &meshing)?.mesh;
        Simulator::new(&level.setup, mesh, self.parameters.clone())?.check(&level.setup, values)
    }

    /// The stiffness ratios of the packings of these runs, by their places, on the mesh of a level.
    ///
    /// # Errors
    /// A packing that cannot be meshed, an elastic solve that fails.
    pub(super) fn stiffness_ratios(
        &self,
        level: &Level<'_>,
        runs: Range<usize>,
    ) -> Result<Vec<f64>, FemError> {
        let ratio = |run| stiffness_ratio(&level.setup, self.mesh(run, level)?);
        runs.into_par_iter().map(ratio).collect()
    }

    /// The packing of a run on the mesh of a level.
    ///
    /// # Errors
    /// A packing that cannot be meshed.
    pub(super) fn mesh(&self, run: usize, level: &Level<'_>) -> Result<TetMesh, FemError> {
        let [radius_mm, height_mm] = self.size_mm;
        let built = level.meshing(&self.meshing).build(radius_mm, height_mm, &self.grains[run]);
        built.map(|meshed| meshed.mesh).map_err(|error| match error {
            MeshingError::Unsound(error) => FemError::Mesh(error),
            other => unsupported(&other.to_string()),
        })
    }

    /// The test of a level on the packing of a run, by its place.
    pub(super) fn simulator(&self, run: usize, level: &Level<'_>) -> Result<Simulator, FemError> {
        let mesh = self.mesh(run, level)?;
        Simulator::new(&level.setup, mesh, self.parameters.clone()).map_err(|error| match error {
            WorkflowError::Test { source, .. } => source,
            other => unsupported(&other.to_string()),
        })
    }
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
