//! Curves of tests that are loaded at constant displacement first, such as triaxial compression.

use super::InspectedCurve;
use crate::experiment::TestCurve;

/// Largest change of the displacement during the confinement, as a fraction of its range, for curves without times.
const RESTS: f64 = 0.005;
/// Fewest readings after the confinement that are checked.
const FEWEST: usize = 3;
/// Findings about the origin of force and displacement. They do not apply to a body that is loaded before the displacement
/// begins.
const OF_ORIGIN: [&str; 4] = ["preload", "force-zero", "late-load", "toe"];

/// Checks a curve whose displacement rests up to `confined_s` after its first reading, while other loads change the force.
/// The readings of the confinement are kept. Spikes, order, slope and peak are checked after the confinement, and the
/// origin of force and displacement is not checked. A curve without times rests as long as its displacement is constant.
pub fn inspect_confined(curve: &TestCurve, slope_fraction: f64, confined_s: f64) -> InspectedCurve {
    let mut check = InspectedCurve::unchecked(curve);
    let start = end_of_confinement(curve, confined_s);
    let loading: Vec<usize> = (start..curve.force_n.len()).collect();
    if loading.len() < FEWEST {
        return check;
    }
    let after = InspectedCurve::of(&curve.picked(&loading), slope_fraction);
    let kept: Vec<usize> = (0..start + after.prepared.force_n.len()).collect();
    check.prepared = check.prepared.picked(&kept);
    check.findings = after.findings;
    check.findings.retain(|finding| !OF_ORIGIN.contains(&finding.name));
    check
}

/// Returns the index of the last reading of the confinement.
fn end_of_confinement(curve: &TestCurve, confined_s: f64) -> usize {
    let (times, u) = (&curve.time_s, &curve.displacement_mm);
    let last = u.len().saturating_sub(1);
    if let Some(&start_s) = times.first() {
        let end_s = start_s + confined_s * (1.0 - 1e-9);
        return times.partition_point(|time_s| *time_s < end_s).min(last);
    }
    let Some(&start_mm) = u.first() else { return 0 };
    let [low, high] = u
        .iter()
        .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], &u| [low.min(u), high.max(u)]);
    let resting = u.iter().take_while(|&&u| (u - start_mm).abs() <= RESTS * (high - low)).count();
    resting.saturating_sub(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A confinement of 1 s, in which the force rises to 34 N and falls to 20 N, and a loading of 9 s with a peak at 0.1 mm.
    fn triaxial() -> TestCurve {
        let time_s: Vec<f64> = (0..=100).map(|i| 0.1 * f64::from(i)).collect();
        let displacement_mm = time_s.iter().map(|t| (0.03 * (t - 1.0)).max(0.0)).collect();
        let force = |&t: &f64| match t {
            t if t < 0.95 => 37.8 * t,
            t if t < 1.05 => 20.0,
            t => {
                let x = 0.3 * (t - 1.0);
                20.0 + 150.0 * x * ((1.0 - x.powi(3)) / 3.0).exp()
            }
        };
        let force_n = time_s.iter().map(force).collect();
        TestCurve { time_s, ..TestCurve::new(displacement_mm, force_n) }
    }

    fn names(check: &InspectedCurve) -> Vec<&'static str> {
        check.findings.iter().map(|finding| finding.name).collect()
    }

    #[test]
    fn a_confined_curve_is_checked_from_the_end_of_the_confinement() {
        let curve = triaxial();
        let unaware = names(&InspectedCurve::of(&curve, 0.3));
        assert!(unaware.contains(&"toe"), "{unaware:?}");
        let check = inspect_confined(&curve, 0.3, 1.0);
        assert_eq!(names(&check), [""; 0]);
        assert_eq!((&check.prepared, check.toe_mm), (&curve, 0.0));
        // without times, the confinement ends where the displacement begins
        let timeless = TestCurve { time_s: Vec::new(), ..curve.clone() };
        assert_eq!(names(&inspect_confined(&timeless, 0.3, 1.0)), [""; 0]);
    }

    #[test]
    fn defects_after_the_confinement_are_found() {
        let mut spiked = triaxial();
        spiked.force_n[30] += 80.0;
        assert!(names(&inspect_confined(&spiked, 0.3, 1.0)).contains(&"spike"));
        // unloading at the end is omitted, and the confinement is kept
        let mut unloaded = triaxial();
        for k in 1..=10 {
            let last = unloaded.displacement_mm[100];
            unloaded.displacement_mm.push(last - 0.01 * f64::from(k));
            unloaded.force_n.push(10.0);
            unloaded.time_s.push(10.0 + 0.1 * f64::from(k));
        }
        let check = inspect_confined(&unloaded, 0.3, 1.0);
        assert_eq!(names(&check), ["unloading"]);
        assert_eq!(check.prepared, triaxial());
    }

    #[test]
    fn a_curve_that_ends_in_the_confinement_has_no_findings() {
        let curve = triaxial().picked(&(0..8).collect::<Vec<_>>());
        let check = inspect_confined(&curve, 0.3, 1.0);
        assert_eq!((names(&check), &check.prepared), (Vec::new(), &curve));
    }
}
