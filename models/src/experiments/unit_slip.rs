//! Warning about measured slopes that a common slip of units explains: forces in pound-force or kilogram-force, stresses in
//! place of forces, strains in place of displacements. Slips by a factor of 1000 are errors: see
//! [`super::closed_form`].

use super::closed_form::ClosedForm;
use super::mesh_scale::MeshSize;
use super::specimen_quantities::compared;
use crate::case::MaterialCase;
use crate::case_inputs::CaseInputs;
use crate::experiment::{Specimen, SpecimenTable};
use crate::pipeline::inputs::Inputs;
use crate::qoi::{Quantity, Slope};

/// Largest ratio of the slope of a composite to the slope of its softest phase: 40 % of rigid grains, by the estimate of Mori
/// and Tanaka for spheres and ν = 0.25.
const COMPOSITE: f64 = 2.4;
/// Relative distance from the estimated range within which a slope counts as explained.
const NEAR: f64 = 1.2;
/// Distance from the estimated range, as a ratio, from which a slip of units that explains the slope is reported.
const EXPLAINED: f64 = 2.0;
/// Distance from the estimated range, as a ratio, from which any slope is reported.
const UNEXPLAINED: f64 = 3.0;

/// A slip of units.
struct Slip {
    /// Factor of the slope that the slip causes.
    factor: f64,
    /// The slip, with the key of `[experiments.read]` that states the unit.
    text: &'static str,
}

/// Slips of units for a specimen of this size.
fn slips(mesh: MeshSize) -> [Slip; 6] {
    let area_mm2 = std::f64::consts::PI * mesh.radius_mm.powi(2);
    let height_mm = mesh.height_mm;
    [
        Slip { factor: 1.0 / 4.448_222, text: "forces in lbf (force_unit = \"lbf\")" },
        Slip { factor: 1.0 / 9.806_65, text: "forces in kgf (force_unit = \"kgf\")" },
        Slip {
            factor: 1.0 / area_mm2,
            text: "stresses in MPa in place of forces (force_unit = \"MPa\")",
        },
        Slip {
            factor: height_mm,
            text: "strains in place of displacements (displacement_unit = \"1\")",
        },
        Slip {
            factor: 0.01 * height_mm,
            text: "strains in % in place of displacements (displacement_unit = \"%\")",
        },
        Slip { factor: 25.4, text: "displacements in inches (displacement_unit = \"in\")" },
    ]
}

/// Returns a warning if the mean measured slope is far from the slope of a cylinder of the materials of the case. `None` where
/// the slope has no closed form: other loads than the platens, bodies that are no cylinders, inelastic materials, and a
/// calibrated compliance of the machine.
pub(crate) fn unit_slip(
    inputs: &Inputs<'_>,
    table: &SpecimenTable,
    mesh: MeshSize,
) -> Option<String> {
    let setup = inputs.setup();
    let is_inelastic =
        |material: &MaterialCase| material.viscoelastic.is_some() || material.plastic.is_some();
    if !mesh.is_cylinder || setup.material.values().any(is_inelastic) {
        return None;
    }
    let prior = inputs.whole_prior();
    let is_machine = |name: String| name == "machine.compliance_mm_per_n";
    if prior.iter().flat_map(|prior| prior.names()).any(is_machine) {
        return None;
    }
    let bounds = prior.map(|prior| prior.bounds()).unwrap_or_default();
    let form = ClosedForm::of(&setup, &bounds)?;
    let [low, high] = form.range(&Slope, mesh.height_mm, mesh.radius_mm)?;
    let is_composite = setup.material.len() > 1;
    let range = [low, if is_composite { COMPOSITE * high } else { high }];

    let qoi = &inputs.qoi();
    let slope = [Quantity::new(Slope)];
    let of_specimen = |specimen: &Specimen| compared(specimen, Some(mesh), qoi, &slope).values[0];
    let slopes = table.specimens.iter().map(of_specimen).filter(|slope| slope.is_finite());
    let slopes: Vec<f64> = slopes.collect();
    let mean = slopes.iter().sum::<f64>() / slopes.len() as f64;
    warning(mean, range, mesh)
}

/// Ratio of a value to the nearer end of a range; 1 inside the range.
fn distance(value: f64, [low, high]: [f64; 2]) -> f64 {
    if value < low { value / low } else { (value / high).max(1.0) }
}

/// Returns a warning if a slope is far from its estimated range.
fn warning(slope: f64, range: [f64; 2], mesh: MeshSize) -> Option<String> {
    let distance_of = |value: f64| {
        let ratio = distance(value, range);
        ratio.max(1.0 / ratio)
    };
    // NaN: no specimen has a slope
    if slope.is_nan() || distance_of(slope) < EXPLAINED {
        return None;
    }
    let explains = |slip: &Slip| distance_of(slope / slip.factor) <= NEAR;
    let causes: Vec<&str> =
        slips(mesh).into_iter().filter(explains).map(|slip| slip.text).collect();
    if causes.is_empty() && distance_of(slope) < UNEXPLAINED {
        return None;
    }
    let cause = match causes.is_empty() {
        true => "Check the units of curve, sizes and [material], and the compliance of the machine ([machine])".to_owned(),
        false => format!("Possible causes, with the keys of [experiments.read]: {}", causes.join("; ")),
    };
    let [low, high] = range;
    Some(format!(
        "Every result may be wrong by a unit: the mean measured slope, {slope:.4} N/mm, is {:.3} times the nearest slope of \
         a cylinder of these materials, {low:.4} to {high:.4} N/mm. {cause}.",
        distance(slope, range)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The cylinder of the paper: radius 2.5 mm, height 4.4 mm. A composite with E = 400 MPa has the slope 1785 N/mm; the
    /// estimate extends from 250 MPa of the matrix to 2.4 · 300 MPa.
    const SLOPE: f64 = 1785.0;
    const RANGE: [f64; 2] = [1115.6, 3213.0];

    fn warned(slope: f64) -> Option<String> {
        warning(slope, RANGE, MeshSize::of_cylinder([4.4, 2.5]))
    }

    #[test]
    fn slips_of_units_are_named() {
        for (factor, part) in [
            (1.0 / 4.448, "forces in lbf"),
            (1.0 / 9.807, "forces in kgf"),
            (1.0 / 19.635, "stresses in MPa"),
            (4.4, "strains in place of displacements"),
            (0.044, "strains in %"),
            (25.4, "displacements in inches"),
        ] {
            let text = warned(SLOPE * factor).unwrap_or_else(|| panic!("{factor}"));
            assert!(text.contains(part), "{part:?} is not in {text:?}");
        }
    }

    #[test]
    fn plausible_slopes_are_not_warned_of() {
        for slope in [SLOPE, RANGE[0] / 1.9, RANGE[1] * 1.9, f64::NAN] {
            assert_eq!(warned(slope), None, "{slope}");
        }
        // a factor of 12, which no slip explains
        let text = warned(SLOPE * 12.0).unwrap();
        assert!(text.contains("[machine]"), "{text}");
    }
}
