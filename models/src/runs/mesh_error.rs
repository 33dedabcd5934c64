//! Error of the mesh at the posterior mode, estimated with a second mesh.

use std::borrow::Cow;

use fem::{Meshing, Order, RunInput, RunRecord, write_curve};

use super::ensemble_runs::{NamedRuns, run_named};
use crate::case::{Parameter, SpecimenGeometry};
use crate::pipeline::run_key::RunKey;
use crate::pipeline::task::Task;
use crate::results_folder::error::WorkflowError;
use crate::simulation::run_values::quantities;
use crate::simulation::simulator::Simulator;
use crate::specimen::images;
use crate::specimen::mesh::mesh_with;

/// Returns the error of each quantity due to the mesh, %: 100 (q_h/q − 1). q_h is the quantity of the simulation at
/// the posterior mode. q is extrapolated to zero spacing from this simulation and a second simulation on a mesh with
/// the spacing `confirm.second_spacing_mm`, by default half of the specimen's spacing.
///
/// Errors are assumed to be of first order in the spacing for linear elements, and of second order for quadratic
/// elements. Returns `None` for a mesh from a file, and if the second simulation has no quantities.
///
/// # Reference
/// Richardson's extrapolation; Roache (1994), *Perspective: a method for uniform reporting of grid
/// refinement studies*, doi:10.1115/1.2910291.
pub(crate) fn mesh_errors(
    task: &Task<'_>,
    names: &[String],
    parameters: Vec<Parameter>,
    mode: &RunRecord,
    at_spacing: &[f64],
) -> Result<Option<Vec<f64>>, WorkflowError> {
    let inputs = &task.inputs;
    let spacing_mm = match inputs.geometry()? {
        SpecimenGeometry::Mesh { .. } | SpecimenGeometry::Absent => return Ok(None),
        SpecimenGeometry::Cylinder { meshing, .. }
        | SpecimenGeometry::Block { meshing, .. }
        | SpecimenGeometry::Image { meshing, .. }
        | SpecimenGeometry::Surfaces { meshing, .. } => meshing.spacing_mm,
    };
    let second_mm = inputs.confirm().second_spacing_mm.unwrap_or(0.5 * spacing_mm);
    let second = |specimen: &Meshing| Meshing { spacing_mm: second_mm, ..*specimen };
    let mesh = mesh_with(inputs, images::FIRST, &second)?.0;
    let simulator = Simulator::new(&inputs.setup(), mesh, parameters)?;
    let run = RunInput { id: 1, inputs: mode.inputs.clone() };
    let further = ["confirm.second_spacing_mm"];
    let named = NamedRuns {
        folder: "confirm/second",
        label: "run on the second mesh",
        // the mesh of the case identifies the image from which the second mesh is made
        key: &RunKey::of_simulations(inputs, &further, &["mesh.msh", "map.csv"])
            .and_specimen(inputs)?,
        names,
        runs: &[run],
        wait: true,
    };
    let records = run_named(task, named, &|_| Ok(Cow::Borrowed(&simulator)))?;
    task.product("curves/second-mesh.csv", |path| write_curve(path, &records[0].curve))?;
    let other = match quantities(&records[0], inputs.qoi()) {
        Ok(other) => other,
        Err(reason) => {
            task.warn(&format!(
                "The error of the mesh is not known: the simulation at the MAP on a mesh of {second_mm} mm has no \
                 quantities of interest: {reason}."
            ));
            return Ok(None);
        }
    };
    let order = match inputs.order() {
        Order::Linear => 1.0,
        Order::Quadratic => 2.0,
    };
    let errors: Vec<f64> = at_spacing
        .iter()
        .zip(other)
        .map(|(&at_spacing, other)| {
            100.0
                * (at_spacing / extrapolated([spacing_mm, second_mm], [at_spacing, other], order)
                    - 1.0)
        })
        .collect();
    Ok(Some(errors))
}

/// Extrapolates a value to zero spacing from its values at the two spacings `h` and `other`. The error is assumed to be
/// proportional to spacing^`order`.
fn extrapolated([h, other]: [f64; 2], [at_h, at_other]: [f64; 2], order: f64) -> f64 {
    at_h + (at_h - at_other) / ((other / h).powf(order) - 1.0)
}

#[cfg(test)]
mod tests {
    use super::extrapolated;

    #[test]
    fn errors_of_the_supposed_order_are_taken_away_from_either_side() {
        for order in [1.0, 2.0] {
            let at = |h: f64| 7.0 + 0.3 * h.powf(order);
            for other in [0.25, 0.7] {
                let limit = extrapolated([0.5, other], [at(0.5), at(other)], order);
                assert!((limit - 7.0).abs() < 1e-12, "{limit}");
            }
        }
    }
}
