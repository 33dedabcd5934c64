//! Mesh levels of an ensemble, from the cheapest mesh to the mesh of the case.

use fem::{Meshing, PhaseField, TetMesh, gmsh};

use super::images;
use super::mesh::mesh_with;
use crate::case::LevelCase;
use crate::pipeline::inputs::Inputs;
use crate::pipeline::run_key::RunKey;
use crate::results_folder::error::WorkflowError;
use crate::simulation::setup::Setup;

/// Mesh and load steps of a set of runs.
pub(crate) struct Level<'a> {
    /// Identity of the runs.
    pub(crate) key: RunKey,
    /// Description of the runs in the progress bar.
    pub(crate) label: String,
    /// Number of runs that are repeated on the next level.
    pub(crate) repeats: usize,
    pub(crate) setup: Setup<'a>,
    case: Option<&'a LevelCase>,
    /// Whether the mesh is generated from the case instead of read from the file of the stage `mesh`.
    pub(crate) is_made_anew: bool,
}

impl<'a> Level<'a> {
    /// Returns the levels of a case. `key` identifies the runs on the mesh of the case. Without `[fidelity]`, this mesh
    /// is the only level. Adding a level does not change the identity of the runs of other levels.
    pub(crate) fn all(inputs: &'a Inputs<'_>, key: &RunKey) -> Vec<Self> {
        // runs on more accurate levels only correct the values, so that derivatives are needed on the first level only
        let derivatives = inputs.design().derivatives;
        let setup = inputs.setup();
        let levels = &inputs.fidelity().levels;
        let cheaper = levels.iter().enumerate().map(|(index, case)| Level {
            key: key.with(&described(case)),
            label: format!("runs on {} mm", case.spacing_mm),
            repeats: case.repeats,
            setup: Setup {
                order: case.order.unwrap_or(setup.order),
                homogenisation: case.homogenisation.unwrap_or(setup.homogenisation),
                steps: case.steps,
                derivatives: derivatives && index == 0,
                ..setup
            },
            case: Some(case),
            is_made_anew: false,
        });
        let setup_of_own = Setup { derivatives: derivatives && levels.is_empty(), ..setup };
        let finest = Level {
            key: key.clone(),
            label: if levels.is_empty() { "runs" } else { "runs on the finest mesh" }.to_owned(),
            repeats: 0,
            setup: setup_of_own,
            case: None,
            is_made_anew: false,
        };
        cheaper.chain([finest]).collect()
    }

    /// Returns this level with another phase field and without derivatives. Its runs have another key.
    pub(crate) fn with_phase_field<'b>(&self, field: &'b PhaseField) -> Level<'b>
    where
        'a: 'b,
    {
        Level {
            key: self.key.with(&format!("phase_field = {field:?}\n")),
            label: "run with the other quadrature".to_owned(),
            repeats: 0,
            setup: Setup { phase_field: Some(field), derivatives: false, ..self.setup },
            case: self.case,
            is_made_anew: self.is_made_anew,
        }
    }

    /// Returns this level for other runs, which have the identity `key` and which `label` describes.
    pub(crate) fn named(&self, key: RunKey, label: &str) -> Level<'a> {
        Level {
            key,
            label: label.to_owned(),
            repeats: 0,
            setup: self.setup,
            case: self.case,
            is_made_anew: self.is_made_anew,
        }
    }

    /// Returns the mesher settings of this level; `specimen` are the mesher settings of the case.
    pub(crate) fn meshing(&self, specimen: &Meshing) -> Meshing {
        self.case.map_or(*specimen, |case| case.meshing(specimen))
    }

    /// Returns the specimen's mesh on this level; `image` is the number of the specimen's image.
    pub(crate) fn mesh(&self, inputs: &Inputs<'_>, image: usize) -> Result<TetMesh, WorkflowError> {
        match self.case.is_some() || self.is_made_anew {
            true => Ok(mesh_with(inputs, image, &|specimen| self.meshing(specimen))?.0),
            false => {
                let file = inputs.file(&images::mesh_file(image, "msh"))?;
                Ok(gmsh::read(file, &gmsh::GmshNames::default())?)
            }
        }
    }
}

/// Line of the key with the settings of a level that affect its runs.
fn described(case: &LevelCase) -> String {
    let LevelCase { spacing_mm, order, grain_mode, homogenisation, steps, repeats: _ } = case;
    format!(
        "level = {spacing_mm} mm, {order:?}, {grain_mode:?}, {homogenisation:?}, {steps:?} steps\n"
    )
}
