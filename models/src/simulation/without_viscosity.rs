//! Warning about compression with damage without viscosity, which may not pass its peak.

use fem::{Order, Split};

use crate::case::{Case, Property};

/// Residual stiffness with which the default cylinder has passed its peak.
const MEASURED: f64 = 0.01;

/// Returns a warning if runs of the case may not pass their peak, because the damage of a region has no viscosity. `None` if
/// the combination of split, order of the elements and residual stiffness is known to pass the peak, and for loads other than
/// the platens, with which no combination has been measured.
///
/// The combinations are listed in `docs/how-to/without-viscosity.md`; `fem/benches/rate_independent.rs` measures them.
pub(crate) fn without_viscosity(case: &Case) -> Option<String> {
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
    let residual_stiffness = material.residual_stiffness;
    let is_quadratic = case.specimen.order == Order::Quadratic;
    let reason = match field.split {
        Split::Spectral => {
            "with split = \"spectral\" the force of a compression test does not fall, because closed cracks keep the \
             compressive stiffness. A small viscosity does not change this: write split = \"none\" under [phase_field]"
                .to_owned()
        }
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
        "Runs may not pass their peak: the damage of {region} has no viscosity (material.{} = 0), and {reason}{small}. See \
         docs/how-to/without-viscosity.md.",
        key(region)
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::CaseFile;

    /// Returns the warning for the default case without viscosity and without priors, after a change.
    fn warning(change: impl Fn(&mut Case)) -> Option<String> {
        let mut case = CaseFile::default_case().case;
        case.prior = None;
        case.material.get_mut("matrix").unwrap().viscosity_mpa_s = 0.0;
        change(&mut case);
        without_viscosity(&case)
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
