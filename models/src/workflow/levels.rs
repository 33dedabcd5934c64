//! The meshes that the runs of an ensemble are made on, from the cheapest to the specimen's own.

use fem::{Meshing, PhaseField, TetMesh, gmsh};

use super::WorkflowError;
use super::images;
use super::inputs::Inputs;
use super::mesh::mesh_with;
use super::simulator::Setup;
use crate::case::LevelCase;

/// A mesh and the steps that runs are made with.
pub(super) struct Level<'a> {
    /// What its runs are named by.
    pub(super) manifest: String,
    /// How many of its runs are repeated on the next level.
    pub(super) repeats: usize,
    pub(super) setup: Setup<'a>,
    case: Option<&'a LevelCase>,
    /// Whether its mesh is made from the case and not the one that the stage `mesh` left.
    pub(super) is_made_anew: bool,
}

impl<'a> Level<'a> {
    /// The levels of a case whose runs are made on so many meshes of the stage `mesh`; without `[fidelity]` there is
    /// the specimen's own alone.
    ///
    /// To be called after prior, design and packings are read: what was read until now names the runs
    /// of all levels, and another level leaves those of the others as they are.
    ///
    /// # Errors
    /// No mesh where runs share it.
    pub(super) fn all(inputs: &'a Inputs<'_>, meshes: usize) -> Result<Vec<Self>, WorkflowError> {
        // quantities of better levels are only compared with those of the first
        let derivatives = inputs.design().derivatives;
        let setup = inputs.setup();
        for image in (images::OWN..).take(meshes) {
            inputs.file(&images::mesh_file(image, "msh"))?;
        }
        let manifest = inputs.manifest();
        let levels = &inputs.fidelity().levels;
        let cheaper = levels.iter().enumerate().map(|(place, case)| Level {
            manifest: format!("{manifest}{}", described(case)),
            repeats: case.repeats,
            setup: Setup {
                order: case.order.unwrap_or(setup.order),
                homogenisation: case.homogenisation.unwrap_or(setup.homogenisation),
                steps: case.steps,
                derivatives: derivatives && place == 0,
                ..setup
            },
            case: Some(case),
            is_made_anew: false,
        });
        let setup_of_own = Setup { derivatives: derivatives && levels.is_empty(), ..setup };
        let own = Level {
            manifest: manifest.clone(),
            repeats: 0,
            setup: setup_of_own,
            case: None,
            is_made_anew: false,
        };
        Ok(cheaper.chain([own]).collect())
    }

    /// The same with another phase field and without derivatives, its runs by names of their own.
    pub(super) fn with_phase_field<'b>(&self, field: &'b PhaseField) -> Level<'b>
    where
        'a: 'b,
    {
        Level {
            manifest: format!("{}phase_field = {field:?}\n", self.manifest),
            repeats: 0,
            setup: Setup { phase_field: Some(field), derivatives: false, ..self.setup },
            case: self.case,
            is_made_anew: self.is_made_anew,
        }
    }

    /// The same for runs with names of their own.
    pub(super) fn named(&self, addition: &str) -> Level<'a> {
        let manifest = format!("{}{addition}", self.manifest);
        Level {
            manifest,
            repeats: 0,
            setup: self.setup,
            case: self.case,
            is_made_anew: self.is_made_anew,
        }
    }

    /// The specimen's mesher as this level has it.
    pub(super) fn meshing(&self, specimen: &Meshing) -> Meshing {
        self.case.map_or(*specimen, |case| case.meshing(specimen))
    }

    /// The specimen's mesh on this level, by the number of its image.
    pub(super) fn mesh(&self, inputs: &Inputs<'_>, image: usize) -> Result<TetMesh, WorkflowError> {
        match self.case.is_some() || self.is_made_anew {
            true => Ok(mesh_with(inputs, image, &|specimen| self.meshing(specimen))?.0),
            false => {
                let file = inputs.file(&images::mesh_file(image, "msh"))?;
                Ok(gmsh::read(file, &gmsh::GmshNames::default())?)
            }
        }
    }
}

/// What the runs of a level depend on, one line.
fn described(case: &LevelCase) -> String {
    let LevelCase { spacing_mm, order, grain_mode, homogenisation, steps, repeats: _ } = case;
    format!(
        "level = {spacing_mm} mm, {order:?}, {grain_mode:?}, {homogenisation:?}, {steps:?} steps\n"
    )
}
