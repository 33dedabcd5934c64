//! Checks of the corners of the box of all priors. The check of a single bound uses the values of the case for the other
//! parameters, so that it accepts bounds which contradict each other.

use fem::FemError;

use super::super::{CaseFile, MaterialCase, Parameter, SimulationParts};
use super::interface::check_interface;
use super::material::check_in_fem;
use crate::error::InputError;

/// Largest number of parameters of a region whose corners are all checked: 256 corners. Of more parameters, the corners of
/// each pair are checked.
const MOST: usize = 8;

/// Parameter with the bounds of its prior.
type Bounded<'a> = (&'a Parameter, [f64; 2]);

/// Constants that are impossible together.
struct Impossible {
    /// Name of the constant that is out of its range, if the error names one.
    field: Option<&'static str>,
    problem: String,
}

/// Refuses priors with a corner in which the constants of a region are impossible: a dilatancy angle above the friction
/// angle, a tensile strength above the compressive strength, and so on.
///
/// # Errors
/// The first such corner, with the parameters that cause it.
pub(super) fn check_corners(file: &CaseFile) -> Result<(), InputError> {
    let case = &file.case;
    let Some(prior) = case.whole_prior().filter(|_| case.is_built_in()) else { return Ok(()) };
    let bounded: Vec<Bounded<'_>> =
        prior.iter().map(|(parameter, prior)| (parameter, prior.range())).collect();
    let unchanged = case.simulation_parts();
    for region in case.material.keys() {
        // the check of the material reports constants that are impossible without the priors
        if impossible(file, region, &unchanged).is_some() {
            continue;
        }
        check_fractions(file, region, &bounded)?;
        // parameters without a region may change every region
        let is_of_region = |(parameter, _): &&Bounded<'_>| {
            parameter.region().is_none_or(|of| of == region) && !is_of_series(parameter)
        };
        let group: Vec<Bounded<'_>> = bounded.iter().filter(is_of_region).copied().collect();
        for members in groups(&group) {
            check_group(file, region, &members)?;
        }
    }
    Ok(())
}

/// Whether the parameter is a constant of a Prony series. Fractions are coupled by their sum alone, and times by nothing.
fn is_of_series(parameter: &Parameter) -> bool {
    let path = parameter.path();
    path.contains(".viscoelastic.") && (path.ends_with(".fraction") || path.ends_with(".time_s"))
}

/// Returns the group, or all its pairs if it is large.
fn groups<'a>(group: &[Bounded<'a>]) -> Vec<Vec<Bounded<'a>>> {
    if group.len() <= MOST {
        return vec![group.to_vec()];
    }
    let mut pairs = Vec::new();
    for (i, first) in group.iter().enumerate() {
        pairs.extend(group[i + 1..].iter().map(|second| vec![*first, *second]));
    }
    pairs
}

/// Checks all corners of the box of these parameters.
fn check_group(file: &CaseFile, region: &str, group: &[Bounded<'_>]) -> Result<(), InputError> {
    // the check of the bounds has checked a single parameter
    if group.len() < 2 {
        return Ok(());
    }
    for corner in 0..1_usize << group.len() {
        let values = group.iter().enumerate();
        let mut members: Vec<(&Parameter, f64)> =
            values.map(|(i, (parameter, bounds))| (*parameter, bounds[corner >> i & 1])).collect();
        let Some(mut found) = impossible_at(file, region, &members) else { continue };
        // omit parameters without which the other parameters remain impossible
        let mut i = 0;
        while i < members.len() {
            let omitted = members.remove(i);
            match impossible_at(file, region, &members) {
                Some(still) => found = still,
                None => {
                    members.insert(i, omitted);
                    i += 1;
                }
            }
        }
        let Impossible { field, problem } = found;
        let is_named = |path: &str| field.is_some_and(|field| path.ends_with(&format!(".{field}")));
        let named = members.iter().find(|(parameter, _)| is_named(&parameter.path()));
        let Some((parameter, _)) = named.or(members.first()) else { continue };
        let bounds = group.iter().find(|(other, _)| other == parameter).map(|(_, bounds)| bounds);
        let value = bounds.map(|bounds| format!("{bounds:?}")).unwrap_or_default();
        let at: Vec<String> =
            members.iter().map(|(parameter, value)| format!("{parameter} = {value}")).collect();
        let problem =
            format!("is not possible in a corner of the priors, {}: {problem}", at.join(", "));
        let help = "Narrow the ranges, so that every combination of their bounds is possible.";
        return Err(file.error(&format!("prior.{parameter}"), value, problem, help));
    }
    Ok(())
}

/// Returns why the region is impossible with these values; `None` if it is possible.
fn impossible_at(
    file: &CaseFile,
    region: &str,
    values: &[(&Parameter, f64)],
) -> Option<Impossible> {
    let mut parts = file.case.simulation_parts();
    for (parameter, value) in values {
        // the check of the bounds reports a parameter that cannot be set
        let _ = parameter.set(&mut parts, *value);
    }
    impossible(file, region, &parts)
}

/// Returns why a region of the case is impossible with these constants; `None` if it is possible.
fn impossible(file: &CaseFile, region: &str, parts: &SimulationParts) -> Option<Impossible> {
    let material = parts.material.get(region)?;
    let checked = material
        .in_fem()
        .and_then(|material| material.validate(region, parts.phase_field.as_ref()));
    if let Some(error) = checked.err().or_else(|| shift_error(material, parts)) {
        return Some(match error {
            FemError::OutOfRange { field, requirement, .. } => {
                Impossible { field: Some(field), problem: format!("{field} must be {requirement}") }
            }
            other => Impossible { field: None, problem: other.to_string() },
        });
    }
    parts.interface.iter().find_map(|(name, interface)| {
        let wrong = check_interface(&file.case, name, interface).err()?;
        Some(Impossible { field: None, problem: format!("{} {}", wrong.key, wrong.problem) })
    })
}

/// Returns the error of the time shift of a material, which depends on the temperature of the test.
pub(super) fn shift_error(material: &MaterialCase, parts: &SimulationParts) -> Option<FemError> {
    let shift = material.viscoelastic.as_ref()?.shift?;
    shift.validate("test", parts.test.temperature_celsius?).err()
}

/// Refuses priors of the fractions of a Prony series if the sum of all upper bounds is 1 or more: no long-term modulus
/// would remain.
fn check_fractions(
    file: &CaseFile,
    region: &str,
    bounded: &[Bounded<'_>],
) -> Result<(), InputError> {
    let mut parts = file.case.simulation_parts();
    for (parameter, [_, upper]) in bounded {
        let is_fraction = is_of_series(parameter) && parameter.path().ends_with(".fraction");
        if is_fraction && parameter.region() == Some(region) {
            // the check of the bounds reports a parameter that cannot be set
            let _ = parameter.set(&mut parts, *upper);
        }
    }
    let Some(material) = parts.material.get(region) else { return Ok(()) };
    let error = check_in_fem(file, region, material);
    if let Err(FemError::OutOfRange { field: "fraction", value, .. }) = error {
        let key = format!("prior.{region}.viscoelastic");
        let problem =
            "is the sum of the upper bounds of all fractions: no long-term modulus remains";
        let help = "Lower the upper bounds of the fractions, so that their sum stays below 1.";
        return Err(file.error(&key, value.to_string(), problem, help));
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    /// The mistakes of a case with these constants of the matrix and these priors.
    fn mistakes(constants: &str, priors: &str) -> Vec<String> {
        let text = format!(
            "[specimen]\nradius_mm = 2.5\nheight_mm = 4.4\nspacing_mm = 1.4\n\
             [material.matrix]\nyoung_mpa = 275.0\npoisson = 0.25\n{constants}\n\
             [test]\ndisplacement_mm = 0.2\ntemperature_celsius = 20.0\n[prior]\n{priors}\n\
             [experiments]\ntable = \"specimens.csv\"\n"
        );
        let mistakes = CaseFile::parse_all(&text, Path::new("case.toml")).1;
        mistakes.iter().map(ToString::to_string).collect()
    }

    const CONE: &str = "plastic.yield_mpa = 5.0\n\
                        plastic.criterion = { drucker-prager = { friction_deg = 30.0, dilatancy_deg = 10.0 } }";
    const ANGLES: &str = "matrix.plastic.criterion.drucker-prager";

    /// Each bound is possible with the values of the case, but a friction angle of 12° not with a dilatancy angle of 20°.
    #[test]
    fn an_impossible_corner_of_two_angles_is_refused() {
        let priors = |dilatancy: &str| {
            format!(
                "{ANGLES}.friction_deg = [12.0, 40.0]\n{ANGLES}.dilatancy_deg = {dilatancy}\n\
                 matrix.young_mpa = [200.0, 300.0]\nmatrix.plastic.yield_mpa = [4.0, 6.0]"
            )
        };
        let found = mistakes(CONE, &priors("[10.0, 20.0]"));
        assert_eq!(found.len(), 1, "{found:?}");
        for part in [
            format!("prior.{ANGLES}.dilatancy_deg = [10.0, 20.0]: is not possible in a corner"),
            format!(
                "priors, {ANGLES}.dilatancy_deg = 20, {ANGLES}.friction_deg = 12: dilatancy_deg"
            ),
            "must be at most friction_deg".to_owned(),
        ] {
            assert!(found[0].contains(&part), "{part:?} is not in {}", found[0]);
        }
        assert!(!found[0].contains("matrix.young_mpa ="), "{}", found[0]);
        assert_eq!(mistakes(CONE, &priors("[10.0, 12.0]")), [""; 0]);
    }

    /// The shift of Williams, Landel and Ferry exists above the reference temperature minus C₂.
    #[test]
    fn an_impossible_corner_of_the_shift_is_refused() {
        let shift = "viscoelastic.shear = [{ fraction = 0.3, time_s = 0.1 }]\n\
                     viscoelastic.shift = { wlf = { c1 = 17.4, c2_kelvin = 50.0, reference_celsius = 50.0 } }";
        let path = "matrix.viscoelastic.shift.wlf";
        let priors = |least: f64| {
            format!(
                "{path}.c2_kelvin = [{least:?}, 60.0]\n{path}.reference_celsius = [40.0, 65.0]\n\
                 matrix.viscoelastic.shear.0.fraction = [0.1, 0.5]"
            )
        };
        let found = mistakes(shift, &priors(40.0));
        assert_eq!(found.len(), 1, "{found:?}");
        for part in ["corner of the priors", "c2_kelvin = 40", "reference_celsius = 65"] {
            assert!(found[0].contains(part), "{part:?} is not in {}", found[0]);
        }
        assert_eq!(mistakes(shift, &priors(55.0)), [""; 0]);
    }

    #[test]
    fn the_sum_of_the_upper_bounds_of_fractions_is_limited() {
        let series = "viscoelastic.shear = [{ fraction = 0.3, time_s = 0.1 }, { fraction = 0.2, time_s = 1.0 }]";
        let path = "matrix.viscoelastic.shear";
        let priors = |most: f64| {
            format!("{path}.0.fraction = [0.1, 0.6]\n{path}.1.fraction = [0.1, {most}]")
        };
        let found = mistakes(series, &priors(0.5));
        assert!(found.len() == 1 && found[0].contains("sum of the upper bounds"), "{found:?}");
        assert_eq!(mistakes(series, &priors(0.3)), [""; 0]);
    }

    /// Of many parameters, the corners of each pair are checked.
    #[test]
    fn an_impossible_pair_of_many_parameters_is_refused() {
        let constants = format!(
            "{CONE}\nplastic.hardening = {{ swift = {{ factor_mpa = 4.0, offset = 0.1, exponent = 0.5 }} }}\n\
             plastic.rate = {{ johnson-cook = {{ c = 0.04, reference_per_s = 1e-5 }} }}"
        );
        let priors = format!(
            "matrix.young_mpa = [200.0, 300.0]\nmatrix.poisson = [0.2, 0.3]\nmatrix.plastic.yield_mpa = [4.0, 6.0]\n\
             matrix.plastic.hardening.swift.factor_mpa = [3.0, 5.0]\n\
             matrix.plastic.hardening.swift.offset = [0.1, 0.2]\n\
             matrix.plastic.hardening.swift.exponent = [0.4, 0.6]\n\
             matrix.plastic.rate.johnson-cook.c = [0.01, 0.05]\n\
             {ANGLES}.friction_deg = [12.0, 40.0]\n{ANGLES}.dilatancy_deg = [10.0, 20.0]"
        );
        let found = mistakes(&constants, &priors);
        assert!(found.len() == 1 && found[0].contains("friction_deg = 12"), "{found:?}");
    }
}
