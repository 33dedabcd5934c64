//! Mesh levels of an ensemble, from the cheapest mesh to the mesh of the case.

use fem::{Meshing, PhaseField, TetMesh, gmsh};

use super::images;
use super::mesh::mesh_with;
use crate::case::LevelCase;
use crate::pipeline::inputs::Inputs;
use crate::results_folder::error::WorkflowError;
use crate::simulation::setup::Setup;

/// Mesh and load steps of a set of runs.
pub(crate) struct Level<'a> {
    /// Text that identifies the runs: a list of everything on which the runs depend. Its hash is the name of the
    /// folder of the runs.
    pub(crate) manifest: String,
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
    /// Returns the levels of a case. `meshes` is the number of mesh files from the stage `mesh` that the runs use.
    /// Without `[fidelity]`, the only level is the mesh of the case.
    ///
    /// Call this after reading prior, design and packings, and before reading anything else: all inputs that have been
    /// read so far become part of the identity of the runs on all levels. Adding a level does not change the identity
    /// of the runs of other levels.
    ///
    /// # Errors
    /// Fails if a mesh file is missing.
    pub(crate) fn all(inputs: &'a Inputs<'_>, meshes: usize) -> Result<Vec<Self>, WorkflowError> {
        // runs on more accurate levels only correct the values, so that derivatives are needed on the first level only
        let derivatives = inputs.design().derivatives;
        let setup = inputs.setup();
        for image in (images::FIRST..).take(meshes) {
            inputs.file(&images::mesh_file(image, "msh"))?;
        }
        let manifest = inputs.manifest();
        let levels = &inputs.fidelity().levels;
        let cheaper = levels.iter().enumerate().map(|(index, case)| Level {
            manifest: format!("{manifest}{}", described(case)),
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
            manifest: manifest.clone(),
            label: if levels.is_empty() { "runs" } else { "runs on the finest mesh" }.to_owned(),
            repeats: 0,
            setup: setup_of_own,
            case: None,
            is_made_anew: false,
        };
        Ok(cheaper.chain([finest]).collect())
    }

    /// Returns this level with another phase field and without derivatives. The changed manifest stores its runs in
    /// another folder.
    pub(crate) fn with_phase_field<'b>(&self, field: &'b PhaseField) -> Level<'b>
    where
        'a: 'b,
    {
        Level {
            manifest: format!("{}phase_field = {field:?}\n", self.manifest),
            label: "run with the other quadrature".to_owned(),
            repeats: 0,
            setup: Setup { phase_field: Some(field), derivatives: false, ..self.setup },
            case: self.case,
            is_made_anew: self.is_made_anew,
        }
    }

    /// Returns this level with `addition` appended to its manifest, for other runs, which `label` describes. The changed
    /// manifest stores these runs in another folder.
    pub(crate) fn named(&self, addition: &str, label: &str) -> Level<'a> {
        let manifest = format!("{}{addition}", self.manifest);
        Level {
            manifest,
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

/// Line of the manifest with the settings of a level that affect its runs.
fn described(case: &LevelCase) -> String {
    let LevelCase { spacing_mm, order, grain_mode, homogenisation, steps, repeats: _ } = case;
    format!(
        "level = {spacing_mm} mm, {order:?}, {grain_mode:?}, {homogenisation:?}, {steps:?} steps\n"
    )
}
