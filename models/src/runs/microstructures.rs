//! The specimens of the runs of an ensemble, if there are several. Either each run has a separate packing, or several
//! runs share a packing or an image.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use fem::{FemError, RunInput, TetMesh};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::made_on::{IMAGE, SEED};
use crate::case::Microstructure;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::results_folder::turns::in_turn;
use crate::simulation::simulator::Simulator;
use crate::simulation::stiffness::stiffness_ratio;
use crate::specimen::images;
use crate::specimen::levels::Level;
use crate::specimen::packings::Packings;

/// Several specimens and their assignment to runs.
pub(crate) struct Microstructures {
    /// Index of the specimen of each run.
    of_run: Vec<usize>,
    source: Source,
}

enum Source {
    Packings(Packings),
    /// Number of images; their meshes are in the results folder.
    Images(usize),
}

impl Microstructures {
    /// Returns the specimens for `runs` runs; `None` if all runs use the specimen of the case.
    ///
    /// # Errors
    /// Fails if the grains of a packing do not fit into the specimen.
    pub(crate) fn of(inputs: &Inputs<'_>, runs: usize) -> Result<Option<Self>, WorkflowError> {
        let design = inputs.design();
        if design.microstructure == Microstructure::One {
            return Ok(None);
        }
        let images = images::count(inputs)?;
        if images > images::FIRST {
            let of_run = in_turn(runs, images, design.seed);
            return Ok(Some(Self { of_run, source: Source::Images(images) }));
        }
        let mut rng = Xoshiro256PlusPlus::seed_from_u64(design.seed);
        let count = design.packings.unwrap_or(runs);
        let seeds: Vec<u64> = (0..count).map(|_| u64::from(rng.random::<u32>())).collect();
        match design.packings {
            None => Self::with_seeds(inputs, seeds),
            Some(packings) => {
                let of_run = in_turn(runs, packings, design.seed);
                // generate only the packings that are used: with few runs, some packings are unused
                let asked: BTreeSet<usize> = of_run.iter().copied().collect();
                let index_of = |packing: &usize| asked.iter().position(|other| other == packing);
                let of_run = of_run.iter().filter_map(index_of).collect();
                Self::packed(inputs, asked.iter().map(|&packing| seeds[packing]).collect(), of_run)
            }
        }
    }

    /// Generates a packing for each run with the given seeds; `None` if the specimen of the case is not a
    /// packing.
    ///
    /// # Errors
    /// Fails if the grains of a packing do not fit into the specimen.
    pub(crate) fn with_seeds(
        inputs: &Inputs<'_>,
        seeds: Vec<u64>,
    ) -> Result<Option<Self>, WorkflowError> {
        let of_run = (0..seeds.len()).collect();
        Self::packed(inputs, seeds, of_run)
    }

    fn packed(
        inputs: &Inputs<'_>,
        seeds: Vec<u64>,
        of_run: Vec<usize>,
    ) -> Result<Option<Self>, WorkflowError> {
        let packings = Packings::with_seeds(inputs, seeds)?;
        Ok(packings.map(|packings| Self { of_run, source: Source::Packings(packings) }))
    }

    /// Number of meshes from the stage `mesh` that the runs use; 0 for packings. The first mesh is the mesh of
    /// image 1, which the case names in `specimen.image`.
    pub(crate) fn meshes(&self) -> usize {
        match self.source {
            Source::Packings(_) => 0,
            Source::Images(count) => count,
        }
    }

    /// Seed of the packing of the case; `None` for images.
    pub(crate) fn case_seed(&self) -> Option<u64> {
        match &self.source {
            Source::Packings(packings) => Some(packings.case_seed()),
            Source::Images(_) => None,
        }
    }

    /// Index of the specimen of a run; runs are numbered from 1.
    pub(crate) fn of_run(&self, run: usize) -> usize {
        self.of_run[run - 1]
    }

    /// Column of `runs.csv` that identifies the specimen of a run.
    pub(crate) fn column(&self) -> &'static str {
        match self.source {
            Source::Packings(_) => SEED,
            Source::Images(_) => IMAGE,
        }
    }

    /// Identifier of the specimen of a run, i.e. the entry of the run in the column [`Self::column`].
    pub(crate) fn name(&self, run: usize) -> String {
        let specimen = self.of_run(run);
        match &self.source {
            Source::Packings(packings) => packings.seeds[specimen].to_string(),
            Source::Images(_) => (images::FIRST + specimen).to_string(),
        }
    }

    /// Checks materials and test of a level for the parameter `values` before the first run. Checks that need the mesh
    /// of a specimen are omitted for images.
    ///
    /// # Errors
    /// Fails if the case cannot be simulated.
    pub(crate) fn check(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        values: &[f64],
    ) -> Result<(), WorkflowError> {
        match &self.source {
            Source::Packings(packings) => packings.check(level, inputs.parameters()?, values),
            Source::Images(_) => Ok(()),
        }
    }

    /// Stiffness ratios of the specimens `asked`, by index, on the mesh of a level.
    ///
    /// # Errors
    /// Fails if a specimen cannot be meshed or an elastic solve fails.
    pub(crate) fn stiffness_ratios(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        asked: &BTreeSet<usize>,
    ) -> Result<BTreeMap<usize, f64>, WorkflowError> {
        match &self.source {
            Source::Packings(packings) => {
                let ratio = |&specimen: &usize| -> Result<(usize, f64), FemError> {
                    Ok((specimen, stiffness_ratio(&level.setup, packings.mesh(specimen, level)?)?))
                };
                let asked: Vec<usize> = asked.iter().copied().collect();
                let ratios: Result<_, FemError> = asked.par_iter().map(ratio).collect();
                Ok(ratios?)
            }
            // computed sequentially, because meshes of images are large
            Source::Images(_) => asked
                .iter()
                .map(|&specimen| {
                    let mesh = level.mesh(inputs, images::FIRST + specimen)?;
                    Ok((specimen, stiffness_ratio(&level.setup, mesh)?))
                })
                .collect(),
        }
    }

    /// Mesh of the specimen of a run on a level.
    ///
    /// # Errors
    /// Fails if the specimen cannot be meshed.
    pub(crate) fn mesh(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        run: usize,
    ) -> Result<TetMesh, WorkflowError> {
        self.mesh_of(inputs, level, self.of_run(run))
    }

    fn mesh_of(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        specimen: usize,
    ) -> Result<TetMesh, WorkflowError> {
        match &self.source {
            Source::Packings(packings) => Ok(packings.mesh(specimen, level)?),
            Source::Images(_) => level.mesh(inputs, images::FIRST + specimen),
        }
    }

    /// Returns the packings if each run has a separate packing. Such a packing is meshed when its run
    /// starts.
    pub(crate) fn packing_of_each(&self) -> Option<&Packings> {
        match &self.source {
            Source::Packings(packings) if packings.seeds.len() == self.of_run.len() => {
                Some(packings)
            }
            _ => None,
        }
    }

    /// Returns the simulators of a level for the specimens of `runs`, with the index from [`Self::of_run`] as key.
    ///
    /// # Errors
    /// Fails if a specimen cannot be meshed or if the case cannot be simulated.
    pub(crate) fn shared_simulators(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        runs: &[RunInput],
    ) -> Result<BTreeMap<usize, Simulator>, WorkflowError> {
        let mut simulators = BTreeMap::new();
        for run in runs {
            let specimen = self.of_run(run.id);
            let Entry::Vacant(entry) = simulators.entry(specimen) else { continue };
            let mesh = self.mesh_of(inputs, level, specimen)?;
            let simulator = Simulator::new(&level.setup, mesh, inputs.parameters()?)?;
            simulator.check(&level.setup, &run.inputs)?;
            entry.insert(simulator);
        }
        Ok(simulators)
    }
}
