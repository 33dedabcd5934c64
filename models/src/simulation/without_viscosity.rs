//! Compression with damage without viscosity, which may not pass its peak: warning, and refusal of calibrations that need
//! a peak which no run has.

use fem::{Order, PhaseField, Split};

use crate::case::{Case, CaseFile, Property};
use crate::error::InputError;

/// Residual stiffness with which the default cylinder has passed its peak.
const MEASURED: f64 = 0.01;
/// What the measured runs with the spectral split have in common.
const NO_FALL: &str = "with split = \"spectral\" the force of a compression test does not fall, because closed cracks keep \
                       the compressive stiffness";

/// Region whose damage has no viscosity, and the settings on which the end of a run depends.
struct WithoutViscosity<'a> {
    field: &'a PhaseField,
    region: &'a str,
    /// Key of the viscosity.
    key: String,
    residual_stiffness: f64,
}

impl<'a> WithoutViscosity<'a> {
    /// Returns the first region of the case whose damage has no viscosity. `None` for loads other than the platens, with which
    /// no combination has been measured.
    fn of(case: &'a Case) -> Option<Self> {
        let field = case.phase_field.as_ref().filter(|_| case.is_built_in())?;
        if case.conditions.is_some() || field.hybrid {
            return None;
        }
        let prior = case.whole_prior();
        let is_calibrated =
            |key: &str| prior.iter().flat_map(|prior| prior.names()).any(|name| name == key);
        let key = |region: &str| format!("{region}.{}", Property::Viscosity.key());
        let (region, material) = case.material.iter().find(|(region, material)| {
            let breaks = material.toughness_n_per_mm.is_some();
            breaks && material.viscosity_mpa_s == 0.0 && !is_calibrated(&key(region))
        })?;
        let key = format!("material.{}", key(region));
        Some(Self { field, region, key, residual_stiffness: material.residual_stiffness })
    }
}

/// Refuses a calibration that compares a quantity of the peak if runs of the case are known not to have a peak.
///
/// # Errors
/// If the split is spectral and the damage of a region has no viscosity.
pub(crate) fn refuse_without_peak(file: &CaseFile) -> Result<(), InputError> {
    let case = &file.case;
    let is_calibration = case.prior.is_some() && case.experiments.is_some();
    let compared = if is_calibration { case.compared_quantities() } else { Vec::new() };
    let Some(quantity) = compared.iter().find(|quantity| quantity.needs_peak()) else {
        return Ok(());
    };
    let Some(WithoutViscosity { region, key, .. }) =
        WithoutViscosity::of(case).filter(|found| found.field.split == Split::Spectral)
    else {
        return Ok(());
    };
    let problem = format!(
        "{NO_FALL}, and {quantity} needs the peak: the damage of {region} has no viscosity ({key} = 0)"
    );
    let help = "A small viscosity does not change this: write split = \"none\", or compare quantities that need no peak \
                (qoi.quantities = [\"force-at-0.05-mm\"]). For a single simulation, remove [prior]. See \
                docs/how-to/without-viscosity.md.";
    Err(file.error("phase_field.split", "\"spectral\"", problem, help))
}

/// Returns a warning if runs of the case may not pass their peak, because the damage of a region has no viscosity. `None` if
/// the combination of split, order of the elements and residual stiffness is known to pass the peak, and if
/// [`refuse_without_peak`] refuses the case.
///
/// The combinations are listed in `docs/how-to/without-viscosity.md`; `fem/benches/rate_independent.rs` measures them.
pub(crate) fn without_viscosity(file: &CaseFile) -> Option<String> {
    let case = &file.case;
    let WithoutViscosity { field, region, key, residual_stiffness } = WithoutViscosity::of(case)?;
    if refuse_without_peak(file).is_err() {
        return None;
    }
    let is_quadratic = case.specimen.order == Order::Quadratic;
    let reason = match field.split {
        Split::Spectral => format!(
            "{NO_FALL}. A small viscosity does not change this: write split = \"none\" under [phase_field]"
        ),
        Split::VolumetricDeviatoric if is_quadratic => {
            "with split = \"volumetric-deviatoric\" and quadratic elements the step after the peak of the default cylinder \
             was not finished in 510 s. Write split = \"none\" with residual_stiffness = 0.01, linear elements \
             (specimen.order = 1), or a small viscosity"
                .to_owned()
        }
        Split::None if is_quadratic && residual_stiffness < MEASURED => format!(
            "with quadratic elements only residual_stiffness = 0.01 is known to pass the peak, and the region has \
             {residual_stiffness}. Write residual_stiffness = 0.01, or a small viscosity"
        ),
        _ => return None,
    };
    let small = match field.split {
        Split::Spectral => "",
        _ => {
            " (viscosity_mpa_s = 0.0001 per second of the test raises the peak force by 2 to 3 %, 0.001 by 20 to 25 %)"
        }
    };
    Some(format!(
        "Runs may not pass their peak: the damage of {region} has no viscosity ({key} = 0), and {reason}{small}. See \
         docs/how-to/without-viscosity.md."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::qoi::{ForceAt, Quantity};

    /// Returns the default case without viscosity and without priors, after a change.
    fn changed(change: impl Fn(&mut Case)) -> CaseFile {
        let mut file = CaseFile::default_case();
        file.case.prior = None;
        file.case.material.get_mut("matrix").unwrap().viscosity_mpa_s = 0.0;
        change(&mut file.case);
        file
    }

    fn warning(change: impl Fn(&mut Case)) -> Option<String> {
        without_viscosity(&changed(change))
    }

    /// Priors of the default case without the prior of the viscosity.
    fn calibrate(case: &mut Case) {
        let priors = CaseFile::default_case().case.prior.unwrap();
        let others =
            priors.iter().filter(|(parameter, _)| parameter.path() != "matrix.viscosity_mpa_s");
        case.prior = Some(others.map(|(parameter, prior)| (parameter.clone(), *prior)).collect());
    }

    fn set_split(case: &mut Case, split: Split) {
        case.phase_field.as_mut().unwrap().split = split;
    }

    fn set_residual_stiffness(case: &mut Case, value: f64) {
        case.material.get_mut("matrix").unwrap().residual_stiffness = value;
    }

    #[test]
    fn combinations_that_may_not_pass_the_peak_are_warned_of() {
        let spectral = warning(|case| set_split(case, Split::Spectral)).unwrap();
        for part in ["material.matrix.viscosity_mpa_s = 0", "does not fall", "split = \"none\""] {
            assert!(spectral.contains(part), "{part}: {spectral}");
        }
        let deviatoric = warning(|case| set_split(case, Split::VolumetricDeviatoric)).unwrap();
        for part in ["not finished in 510 s", "residual_stiffness = 0.01", "0.0001 per second"] {
            assert!(deviatoric.contains(part), "{part}: {deviatoric}");
        }
        let brittle = warning(|case| set_residual_stiffness(case, 1e-4)).unwrap();
        assert!(brittle.contains("the region has 0.0001"), "{brittle}");
    }

    #[test]
    fn a_calibration_that_needs_a_peak_which_no_run_has_is_refused() {
        let spectral = |case: &mut Case| {
            calibrate(case);
            set_split(case, Split::Spectral);
        };
        let file = changed(spectral);
        let message = refuse_without_peak(&file).unwrap_err().to_string();
        for part in [
            "phase_field.split = \"spectral\"",
            "slope needs the peak",
            "material.matrix.viscosity_mpa_s = 0",
            "write split = \"none\"",
        ] {
            assert!(message.contains(part), "{part:?} is not in {message}");
        }
        assert_eq!(without_viscosity(&file), None, "the refusal replaces the warning");
        // the peak is not needed
        let file = changed(|case| {
            spectral(case);
            case.qoi.quantities = vec![Quantity::new(ForceAt::micrometres(50).unwrap())];
        });
        assert_eq!(refuse_without_peak(&file), Ok(()));
        assert!(without_viscosity(&file).is_some());
        // a single simulation, combinations that may work, and a viscosity
        assert_eq!(refuse_without_peak(&changed(|case| set_split(case, Split::Spectral))), Ok(()));
        for split in [Split::None, Split::VolumetricDeviatoric] {
            let file = changed(|case| {
                calibrate(case);
                set_split(case, split);
            });
            assert_eq!(refuse_without_peak(&file), Ok(()), "{split:?}");
        }
        let file = changed(|case| {
            spectral(case);
            case.material.get_mut("matrix").unwrap().viscosity_mpa_s = 0.3;
        });
        assert_eq!(refuse_without_peak(&file), Ok(()));
    }

    #[test]
    fn combinations_that_pass_the_peak_are_not_warned_of() {
        assert_eq!(warning(|_| ()), None);
        for split in [Split::None, Split::VolumetricDeviatoric] {
            let linear = |case: &mut Case| {
                case.specimen.order = Order::Linear;
                set_split(case, split);
                set_residual_stiffness(case, 1e-4);
            };
            assert_eq!(warning(linear), None, "{split:?}");
        }
        let calibrated = |case: &mut Case| {
            set_split(case, Split::Spectral);
            case.prior = CaseFile::default_case().case.prior;
        };
        assert_eq!(warning(calibrated), None);
        let viscous = |case: &mut Case| {
            set_split(case, Split::Spectral);
            case.material.get_mut("matrix").unwrap().viscosity_mpa_s = 0.3;
        };
        assert_eq!(warning(viscous), None);
    }
}
