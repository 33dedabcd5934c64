//! Effect of the quadrature of the damage terms on the results.

use std::collections::BTreeMap;

use fem::{CrackDensity, DamageQuadrature, Order, PhaseField, TetMesh};
use surrogate::Input;

use super::fidelity::spread;
use super::level_runs::{LevelRuns, Runner};
use crate::case::{Case, MaterialCase};
use crate::progress::say;
use crate::results_folder::error::WorkflowError;
use crate::simulation::resolution::can_break;
use crate::simulation::run_values::quantities;
use crate::specimen::levels::Level;

/// Smallest difference of a quantity that is reported, %.
const WORTH_TELLING: f64 = 1.0;

/// Returns the quadrature of the damage terms on a mesh, and an alternative. `None` if the crack width ℓ₀ is at least
/// two node distances: both quadratures then give nearly equal results. (Below two node distances, `auto` means
/// `vertex`.) Also `None` if no material can break, and for AT1 with quadratic elements, for which only one
/// quadrature is possible.
fn choice(
    field: &PhaseField,
    order: Order,
    materials: &BTreeMap<String, MaterialCase>,
    mesh: &TetMesh,
) -> Option<[DamageQuadrature; 2]> {
    use DamageQuadrature::{Auto, Consistent, Eleven, Vertex};
    let single = order == Order::Quadratic && field.model == CrackDensity::At1;
    if single || !can_break(materials, mesh) {
        return None;
    }
    let apart = mesh.mean_edge() / f64::from(u8::from(order));
    (field.length_mm < 2.0 * apart).then_some(match field.quadrature {
        Auto | Vertex => [Vertex, Consistent],
        selected @ (Consistent | Eleven) => [selected, Vertex],
    })
}

/// Name of the quadrature in a case file.
fn name(quadrature: DamageQuadrature) -> &'static str {
    match quadrature {
        DamageQuadrature::Auto => "auto",
        DamageQuadrature::Vertex => "vertex",
        DamageQuadrature::Consistent => "consistent",
        DamageQuadrature::Eleven => "eleven",
    }
}

/// Returns a note for a single simulation on a mesh for which two quadratures are possible.
pub(crate) fn quadrature_note(case: &Case, mesh: &TetMesh) -> Option<String> {
    let (field, order) = (case.phase_field.as_ref()?, case.specimen.order);
    let [selected, other] = choice(field, order, &case.material, mesh)?.map(name);
    let apart = mesh.mean_edge() / f64::from(u8::from(order));
    let overshoot = match selected {
        "vertex" => "",
        _ => ", and damage may exceed 1",
    };
    Some(format!(
        "nodes are {apart:.3} mm apart, more than half of the {} mm of a crack: the answer depends on where \
         damage is integrated (phase_field.quadrature = \"{selected}\"){overshoot}; compare with \"{other}\", which \
         on meshes of the default case moves the peak force by 4 %, or take a finer mesh",
        field.length_mm
    ))
}

/// Writes `quadrature.csv`, if two quadratures are possible. It lists the quantities of the run nearest to the centre
/// of the prior box, with the quadrature of the case and with the alternative. The alternative needs one additional
/// run, on the cheapest mesh.
///
/// # Errors
/// Fails if a mesh cannot be generated or a file cannot be written. An additional run without quantities is reported
/// and is not an error.
pub(crate) fn compare_quadratures(
    runner: &Runner<'_>,
    level: &Level<'_>,
    prior: &[Input],
    runs: &LevelRuns,
) -> Result<(), WorkflowError> {
    let usable: Vec<_> = runs.usable().collect();
    let parameter_points: Vec<&[f64]> =
        usable.iter().map(|(record, _)| &record.inputs[..]).collect();
    let (Some(field), Some(&middle)) = (
        level.setup.phase_field,
        spread(prior, &parameter_points, &vec![0; parameter_points.len()], 1).first(),
    ) else {
        return Ok(());
    };
    let (record, with_selected) = usable[middle];
    let (setup, mesh) = (&level.setup, runner.mesh(level, record.id)?);
    let Some(choice) = choice(field, setup.order, setup.material, &mesh) else { return Ok(()) };
    let other = PhaseField { quadrature: choice[1], ..*field };
    let run = fem::RunInput { id: record.id, inputs: record.inputs.clone() };
    let other_runs = runner.run(&level.with_phase_field(&other), &[run], true)?;
    let qoi = runner.task.inputs.qoi();
    let [own_name, other_name] = choice.map(name);
    let with_other = match quantities(&other_runs[0], qoi) {
        Ok(with_other) => with_other,
        Err(reason) => {
            say(
                "note",
                &format!(
                    "with quadrature = \"{other_name}\" the run in the middle of the box is {reason}"
                ),
            );
            return Ok(());
        }
    };
    let percent: Vec<f64> = with_selected
        .iter()
        .zip(&with_other)
        .map(|(with_selected, other)| 100.0 * (other / with_selected - 1.0))
        .collect();
    let columns = qoi.quantities.iter().map(|quantity| quantity.column());
    let rows = columns.zip(with_selected.iter().zip(&with_other)).zip(&percent);
    let rows = rows.map(|((column, (with_selected, other)), percent)| {
        [column.into_owned(), with_selected.to_string(), other.to_string(), percent.to_string()]
    });
    let header =
        ["qoi".to_owned(), own_name.to_owned(), other_name.to_owned(), "percent".to_owned()];
    runner.task.write_csv("quadrature.csv", header, rows)?;
    if percent.iter().any(|percent| percent.abs() > WORTH_TELLING) {
        let changes: Vec<String> = qoi
            .quantities
            .iter()
            .zip(&percent)
            .map(|(quantity, percent)| format!("{quantity} by {percent:+.1} %"))
            .collect();
        say(
            "note",
            &format!(
                "the intervals do not include the choice of phase_field.quadrature, which matters on the \
                 cheapest mesh: \"{other_name}\" in place of \"{own_name}\" changes {}; a finer mesh \
                 reduces the difference",
                changes.join(", ")
            ),
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use fem::CylinderLattice;

    use super::*;
    use crate::case::CaseFile;

    #[test]
    fn only_meshes_that_are_coarse_for_a_crack_leave_a_choice() {
        use DamageQuadrature::{Consistent, Vertex};
        let lattice = CylinderLattice { radius_mm: 2.5, height_mm: 4.0, spacing_mm: 1.0 };
        let mesh = lattice.build().unwrap();
        let wide = 2.0 * mesh.mean_edge();
        let mut case = CaseFile::default_case().case;
        let field = |length_mm| PhaseField::new(length_mm);
        let choices = |case: &Case, field, order| choice(&field, order, &case.material, &mesh);
        let both = Some([Vertex, Consistent]);
        assert_eq!(choices(&case, field(0.99 * wide), Order::Linear), both);
        assert_eq!(choices(&case, field(1.01 * wide), Order::Linear), None);
        assert_eq!(choices(&case, field(0.51 * wide), Order::Quadratic), None);
        assert_eq!(choices(&case, field(0.49 * wide), Order::Quadratic), both);
        let gauss = PhaseField { quadrature: Consistent, ..field(0.1) };
        assert_eq!(choices(&case, gauss, Order::Linear), Some([Consistent, Vertex]));
        let at1 = PhaseField { model: CrackDensity::At1, ..field(0.1) };
        assert_eq!(choices(&case, at1, Order::Quadratic), None);
        assert_eq!(choices(&case, at1, Order::Linear), both);

        case.phase_field = Some(gauss);
        let note = quadrature_note(&case, &mesh).unwrap();
        assert!(note.contains("exceed 1") && note.contains("\"vertex\""), "{note}");
        for material in case.material.values_mut() {
            material.toughness_n_per_mm = None;
        }
        assert_eq!(quadrature_note(&case, &mesh), None);
    }
}
