//! Comparison of the measured displacements at peak with the largest displacement that the simulations of a case reach.

use super::experiment_inputs;
use super::mesh_scale::{MeshScale, MeshSize};
use super::specimen_quantities::SpecimenNames;
use crate::case::TestCase;
use crate::error::InputError;
use crate::experiment::SpecimenTable;
use crate::pipeline::inputs::Inputs;
use crate::qoi::{DisplacementAtPeak, Qois, Quantity};

/// Share of the simulated displacement beyond which a measured peak is near the end of the simulations. The peaks of the
/// runs scatter over the prior box about the measured peak.
const NEAR_END: f64 = 0.9;

/// Finding about peaks near or beyond the end of the simulations.
pub(crate) enum EarlyEnd {
    /// All measured peaks are beyond the end: runs that resemble the specimens have no quantities.
    BeforeAllPeaks(InputError),
    /// Some measured peaks are near or beyond the end: runs will be missing.
    NearPeaks(String),
}

/// Compares the measured displacements at peak, at the size of the mesh, with the largest displacement of the simulations.
/// Returns `None` if the peaks are well before the end, or if the displacements cannot be compared because no quantity needs
/// a peak, the test has boundary conditions of its own or prescribes the force, or the compliance of the machine is
/// calibrated.
pub(crate) fn early_end(
    inputs: &Inputs<'_>,
    table: &SpecimenTable,
    mesh: MeshSize,
    names: &SpecimenNames<'_>,
) -> Option<EarlyEnd> {
    let qoi = inputs.qoi();
    let needs_peak = qoi.quantities.iter().any(|quantity| quantity.needs_peak());
    if !needs_peak
        || inputs.conditions().is_some()
        || experiment_inputs::calibrates_compliance(inputs)
    {
        return None;
    }
    let (key, reached_mm) = largest_displacement_mm(inputs.test())?;
    let peak = [Quantity::new(DisplacementAtPeak)];
    let peaks: Vec<(&str, f64)> = table
        .specimens
        .iter()
        .filter_map(|specimen| {
            let curve = MeshScale::of(specimen, Some(mesh)).apply(&specimen.curve);
            let fraction = specimen.slope_fraction.unwrap_or(qoi.slope_fraction);
            let peak_mm = Qois::values_of(&curve, fraction, &peak).ok()?[0];
            Some((specimen.id.as_str(), peak_mm))
        })
        .collect();
    judged(&peaks, key, reached_mm, names)
}

/// Largest prescribed displacement of a test in mm, with its key; `None` if the test prescribes a force.
fn largest_displacement_mm(test: &TestCase) -> Option<(&'static str, f64)> {
    match &test.program {
        Some(program) => {
            let points: Option<Vec<f64>> =
                program.iter().map(|point| point.displacement_mm).collect();
            Some(("test.program", points?.into_iter().fold(0.0, f64::max)))
        }
        None => Some(("test.displacement_mm", test.displacement_mm?)),
    }
}

fn judged(
    peaks: &[(&str, f64)],
    key: &str,
    reached_mm: f64,
    names: &SpecimenNames<'_>,
) -> Option<EarlyEnd> {
    let (first, _) = peaks.first()?;
    let largest = peaks.iter().map(|(_, peak_mm)| *peak_mm).fold(0.0, f64::max);
    let smallest = peaks.iter().map(|(_, peak_mm)| *peak_mm).fold(f64::INFINITY, f64::min);
    let advice = format!(
        "Write a larger displacement, {:.2} mm for example, in {key}",
        (2.0 * largest).max(reached_mm)
    );
    if smallest >= reached_mm {
        let problem = format!(
            "is beyond {reached_mm} mm, the end of the simulations ({key}): the measured peaks are at {smallest:.4} to {largest:.4} mm at \
             the size of the mesh, and simulations that resemble the specimens end before their peak"
        );
        let help = format!("{advice}, or check the unit of the displacements.");
        let (curve, value) = ((names.curve)(first), format!("{smallest:.4} mm"));
        let place = "smallest displacement at peak";
        return Some(EarlyEnd::BeforeAllPeaks(InputError::new(
            &curve, place, value, problem, help,
        )));
    }
    let near = peaks.iter().filter(|(_, peak_mm)| *peak_mm > NEAR_END * reached_mm).count();
    (near > 0).then(|| {
        EarlyEnd::NearPeaks(format!(
            "Runs near the measured values may have no peak and be omitted: {near} of {} specimens have their peak beyond {:.0} % \
             of the displacement that the simulations reach, {reached_mm} mm. {advice}.",
            peaks.len(),
            100.0 * NEAR_END
        ))
    })
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::case::CaseFile;

    fn finding(peaks: &[f64], reached_mm: f64) -> Option<EarlyEnd> {
        let peaks: Vec<(&str, f64)> = peaks.iter().map(|peak_mm| ("S-1", *peak_mm)).collect();
        let curve = |id: &str| format!("curves/{id}.csv").into();
        let names = SpecimenNames { table: Path::new("specimens.csv"), curve: &curve };
        judged(&peaks, "test.displacement_mm", reached_mm, &names)
    }

    /// Measured peaks at 0.096 mm against simulations to 0.05 mm: refused. The bounds are checked from both sides.
    #[test]
    fn simulations_that_end_before_the_measured_peaks_are_found() {
        let Some(EarlyEnd::BeforeAllPeaks(mistake)) = finding(&[0.096, 0.1], 0.05) else {
            panic!("not refused")
        };
        let text = mistake.to_string();
        for part in ["0.05 mm", "0.0960 to 0.1000 mm", "test.displacement_mm", "0.20 mm"] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(matches!(finding(&[0.096, 0.1], 0.0959), Some(EarlyEnd::BeforeAllPeaks(_))));
        let Some(EarlyEnd::NearPeaks(text)) = finding(&[0.096, 0.1], 0.0961) else {
            panic!("no warning")
        };
        assert!(text.contains("2 of 2 specimens"), "{text}");
        assert!(matches!(finding(&[0.096, 0.1], 0.111), Some(EarlyEnd::NearPeaks(_))));
        assert!(finding(&[0.096, 0.1], 0.112).is_none());
        assert!(finding(&[], 0.05).is_none());
    }

    #[test]
    fn the_displacement_of_a_program_is_its_largest_and_forces_have_none() {
        let test = |line: &str| largest_displacement_mm(&toml::from_str::<TestCase>(line).unwrap());
        let program = "program = [{ time_s = 1.0, displacement_mm = 0.3 }, { time_s = 2.0, displacement_mm = 0.1 }]";
        assert_eq!(test(program), Some(("test.program", 0.3)));
        let force =
            "program = [{ time_s = 1.0, displacement_mm = 0.3 }, { time_s = 2.0, force_n = 10.0 }]";
        assert_eq!(test(force), None);
        let case = CaseFile::default_case().case;
        assert_eq!(largest_displacement_mm(&case.test), Some(("test.displacement_mm", 0.22)));
    }
}
