//! The specimens that the runs of an ensemble are made on, where there are several: a packing of its own for each run,
//! or fewer packings or images than runs, which share them.

use std::collections::btree_map::Entry;
use std::collections::{BTreeMap, BTreeSet};

use fem::{FemError, RunInput, TetMesh};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use rayon::prelude::*;

use super::WorkflowError;
use super::images;
use super::inputs::Inputs;
use super::levels::Level;
use super::made_on::{IMAGE, SEED};
use super::packings::Packings;
use super::simulator::Simulator;
use super::stiffness::stiffness_ratio;
use super::turns::in_turn;
use crate::case::Microstructure;

/// Specimens of runs.
pub(super) struct Microstructures {
    /// Of each run, by its place, which of them it is made on.
    of_run: Vec<usize>,
    source: Source,
}

enum Source {
    Packings(Packings),
    /// So many images, whose meshes lie in the folder of the results.
    Images(usize),
}

impl Microstructures {
    /// Those of so many runs, if the case wants more than one.
    ///
    /// # Errors
    /// A packing that does not fit in.
    pub(super) fn of(inputs: &Inputs<'_>, runs: usize) -> Result<Option<Self>, WorkflowError> {
        let design = inputs.design();
        if design.microstructure == Microstructure::One {
            return Ok(None);
        }
        let images = images::count(inputs)?;
        if images > images::OWN {
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
                // of few runs some packings are not asked for
                let asked: BTreeSet<usize> = of_run.iter().copied().collect();
                let place = |packing: &usize| asked.iter().position(|own| own == packing);
                let of_run = of_run.iter().filter_map(place).collect();
                Self::packed(inputs, asked.iter().map(|&packing| seeds[packing]).collect(), of_run)
            }
        }
    }

    /// A packing of its own for each run, of these seeds, if the case describes specimens by one.
    ///
    /// # Errors
    /// A packing that does not fit in.
    pub(super) fn with_seeds(
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

    /// How many meshes of the stage `mesh` the runs are made on, of which the first is that of the case's own image.
    pub(super) fn meshes(&self) -> usize {
        match self.source {
            Source::Packings(_) => 0,
            Source::Images(count) => count,
        }
    }

    /// The seed of the case's own packing, of packings.
    pub(super) fn own_seed(&self) -> Option<u64> {
        match &self.source {
            Source::Packings(packings) => Some(packings.own_seed()),
            Source::Images(_) => None,
        }
    }

    /// Which of them a run, counted from 1, is made on.
    pub(super) fn of_run(&self, run: usize) -> usize {
        self.of_run[run - 1]
    }

    /// The column of `runs.csv` that names them.
    pub(super) fn column(&self) -> &'static str {
        match self.source {
            Source::Packings(_) => SEED,
            Source::Images(_) => IMAGE,
        }
    }

    /// The name of the specimen of a run there.
    pub(super) fn name(&self, run: usize) -> String {
        let place = self.of_run(run);
        match &self.source {
            Source::Packings(packings) => packings.seeds[place].to_string(),
            Source::Images(_) => (images::OWN + place).to_string(),
        }
    }

    /// Checks materials and test of a level with these values of the parameters before any run begins, as far as no
    /// mesh of a specimen is needed.
    ///
    /// # Errors
    /// A case that makes no simulation.
    pub(super) fn check(
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

    /// The stiffness ratios of some of them, on the mesh of a level.
    ///
    /// # Errors
    /// A specimen that cannot be meshed, an elastic solve that fails.
    pub(super) fn stiffness_ratios(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        asked: &BTreeSet<usize>,
    ) -> Result<BTreeMap<usize, f64>, WorkflowError> {
        match &self.source {
            Source::Packings(packings) => {
                let ratio = |&place: &usize| -> Result<(usize, f64), FemError> {
                    Ok((place, stiffness_ratio(&level.setup, packings.mesh(place, level)?)?))
                };
                let asked: Vec<usize> = asked.iter().copied().collect();
                let found: Result<_, FemError> = asked.par_iter().map(ratio).collect();
                Ok(found?)
            }
            // one after the other: meshes of images are large
            Source::Images(_) => asked
                .iter()
                .map(|&place| {
                    let mesh = level.mesh(inputs, images::OWN + place)?;
                    Ok((place, stiffness_ratio(&level.setup, mesh)?))
                })
                .collect(),
        }
    }

    /// The specimen of a run on the mesh of a level.
    ///
    /// # Errors
    /// One that cannot be meshed.
    pub(super) fn mesh(
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
        place: usize,
    ) -> Result<TetMesh, WorkflowError> {
        match &self.source {
            Source::Packings(packings) => Ok(packings.mesh(place, level)?),
            Source::Images(_) => level.mesh(inputs, images::OWN + place),
        }
    }

    /// The packings, if each run has its own: those are meshed when their run begins.
    pub(super) fn packing_of_each(&self) -> Option<&Packings> {
        match &self.source {
            Source::Packings(packings) if packings.seeds.len() == self.of_run.len() => {
                Some(packings)
            }
            _ => None,
        }
    }

    /// The tests of a level on the specimens that these runs share, by [`Self::of_run`].
    ///
    /// # Errors
    /// One that cannot be meshed, a case that makes no simulation.
    pub(super) fn shared_simulators(
        &self,
        inputs: &Inputs<'_>,
        level: &Level<'_>,
        runs: &[RunInput],
    ) -> Result<BTreeMap<usize, Simulator>, WorkflowError> {
        let mut found = BTreeMap::new();
        for run in runs {
            let place = self.of_run(run.id);
            let Entry::Vacant(entry) = found.entry(place) else { continue };
            let mesh = self.mesh_of(inputs, level, place)?;
            let simulator = Simulator::new(&level.setup, mesh, inputs.parameters()?)?;
            simulator.check(&level.setup, &run.inputs)?;
            entry.insert(simulator);
        }
        Ok(found)
    }
}
