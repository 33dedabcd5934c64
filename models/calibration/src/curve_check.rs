//! What a look at a measured curve shows: order and sign, spikes, preload, toe, unloading, sampling.

use crate::experiment::TestCurve;
use crate::qoi::{Line, QoiError, Qois, Window, slope_line};

/// A force at the first reading of more than this fraction of the peak is a preload.
const PRELOAD: f64 = 0.02;
/// A toe of more than this fraction of the displacement at peak is worth a line on the screen.
const TOE: f64 = 0.02;
/// What displacement may go back before the peak, as a fraction of the way there.
const BACK: f64 = 0.05;
/// A reading that stands off both its neighbours by this fraction of the peak is a spike.
const SPIKE: f64 = 0.05;
/// Fewer readings before the peak than this are sparse.
const SPARSE: usize = 10;
/// A gap between readings before the peak is wide from this fraction of the displacement at peak on.
const GAP: f64 = 0.15;

/// How much a finding matters.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Weight {
    /// To be looked up.
    Note,
    /// To be told.
    Warning,
    /// Quantities of interest would be wrong.
    Error,
}

/// Something that was found on a curve.
#[derive(Clone, Debug, PartialEq)]
pub struct Finding {
    /// Its name in tables.
    pub name: &'static str,
    /// The number behind it; its unit is in the words.
    pub value: f64,
    /// What was found, a clause.
    pub problem: String,
    /// What to do, whole sentences.
    pub help: &'static str,
    pub weight: Weight,
}

/// A curve that was looked at.
#[derive(Clone, Debug, PartialEq)]
pub struct InspectedCurve {
    /// What was found, in the order in which it was looked for.
    pub findings: Vec<Finding>,
    /// Displacement (mm) at which loading begins: see [`toe_mm`].
    pub toe_mm: f64,
    /// The curve up to its largest displacement.
    pub loading: TestCurve,
}

impl InspectedCurve {
    /// Looks at a curve whose slope is taken around `slope_fraction` of the displacement at peak.
    pub fn of(curve: &TestCurve, slope_fraction: f64) -> Self {
        let mut found = Self { findings: Vec::new(), toe_mm: 0.0, loading: curve.clone() };
        if let Some(finding) = order(curve) {
            found.findings.push(finding);
            return found;
        }
        found.cut_unloading();
        found.findings.extend(spikes(&found.loading));
        match Qois::of(&found.loading, slope_fraction) {
            Err(reason) => found.findings.push(without_quantities(&reason)),
            Ok(qois) if qois.slope_n_per_mm <= 0.0 => found.findings.push(Finding {
                name: "slope",
                value: qois.slope_n_per_mm,
                problem: format!("has an initial slope of {:.4} N/mm", qois.slope_n_per_mm),
                help: "Force must rise with displacement where the slope is taken: check the curve, \
                       or slope_fraction.",
                weight: Weight::Error,
            }),
            Ok(qois) => {
                found.toe_mm = toe_mm(&found.loading, &qois, slope_fraction);
                found.findings.extend(preload(&found.loading, &qois));
                found.findings.push(toe(found.toe_mm, &qois));
                found.findings.extend(sampling(&found.loading, &qois, slope_fraction));
            }
        }
        found
    }

    /// The loading with displacements counted from the toe, and what they were moved by in mm.
    pub fn without_toe(&self, slope_fraction: f64) -> (TestCurve, f64) {
        let (mut curve, mut moved) = (self.loading.clone(), 0.0);
        // where the slope is taken moves with the origin: a few turns settle both
        for _ in 0..4 {
            let Ok(qois) = Qois::of(&curve, slope_fraction) else { break };
            let toe = toe_mm(&curve, &qois, slope_fraction);
            curve = curve.shift_displacement(-toe);
            moved += toe;
        }
        (curve, moved)
    }

    /// What lies beyond the largest displacement is no loading.
    fn cut_unloading(&mut self) {
        let u = &self.loading.displacement_mm;
        let (farthest, last) = (largest(u), u.len() - 1);
        let back = u[farthest] - u[last];
        if back <= 0.02 * (u[farthest] - u[0]) {
            return;
        }
        let value = u[farthest];
        self.findings.push(Finding {
            name: "unloading",
            value,
            problem: format!("comes back from {value:.4} mm by {back:.4} mm at its end"),
            help: "The way back is left out.",
            weight: Weight::Warning,
        });
        self.loading.displacement_mm.truncate(farthest + 1);
        self.loading.force_n.truncate(farthest + 1);
    }
}

/// Index of the largest value.
fn largest(values: &[f64]) -> usize {
    (0..values.len()).max_by(|&a, &b| values[a].total_cmp(&values[b])).unwrap_or(0)
}

/// What is wrong with the order of the readings or their sign.
fn order(curve: &TestCurve) -> Option<Finding> {
    let (u, force) = (&curve.displacement_mm, &curve.force_n);
    let error = |name, value, problem: String, help| {
        Some(Finding { name, value, problem, help, weight: Weight::Error })
    };
    let (last, top, farthest) = (u.len().checked_sub(1)?, largest(force), largest(u));
    let lowest = force.iter().copied().fold(f64::INFINITY, f64::min);
    let least = u.iter().copied().fold(f64::INFINITY, f64::min);
    let span = u[farthest] - least;
    if span <= 0.0 {
        return error(
            "displacement",
            u[0],
            format!("stays at a displacement of {} mm", u[0]),
            "Check the column displacement_mm.",
        );
    }
    if -lowest > 3.0 * force[top] {
        return error(
            "sign-of-force",
            lowest,
            format!("has forces down to {lowest} N and up to {} N only", force[top]),
            "Compression is positive: change the sign of force_N, and of displacement_mm if that \
             falls.",
        );
    }
    // what rises to the very end, while the other one has a peak, is a displacement
    let comes_back = u[farthest] - u[last] > 0.05 * span && farthest > 0;
    let rises = force[last] - force[farthest] > 0.05 * (force[top] - lowest);
    if comes_back && rises && top + 1 + force.len() / 20 > last {
        return error(
            "columns-swapped",
            u[farthest],
            format!("has its largest displacement_mm, {}, before its largest force_N", u[farthest]),
            "Are the two columns swapped? Force has a peak, displacement rises to the end.",
        );
    }
    if u[0] - u[last] > 0.5 * span {
        // a test begins without force, and where displacement is counted from
        let loaded = [force[0], force[last]].map(|f| f > 0.1 * force[top]);
        let is_reversed = match loaded {
            [true, false] => true,
            [false, true] => false,
            _ => u[last].abs() < u[0].abs(),
        };
        return if is_reversed {
            error(
                "order",
                u[0] - u[last],
                format!("begins at {} mm and ends at {} mm, without force", u[0], u[last]),
                "Its rows stand in reverse order: write the first reading first.",
            )
        } else {
            error(
                "sign-of-displacement",
                u[last],
                format!("has displacements that fall, from {} to {} mm", u[0], u[last]),
                "Compression is positive: change the sign of displacement_mm.",
            )
        };
    }
    let mut so_far = f64::NEG_INFINITY;
    let back = u[..=top].iter().map(|&x| {
        so_far = so_far.max(x);
        so_far - x
    });
    let back = back.fold(0.0, f64::max);
    if back > BACK * (u[top] - u[0]).max(BACK * span) {
        return error(
            "order",
            back,
            format!("goes back by {back:.4} mm before its peak"),
            "Sort its rows, or keep the monotonic test only: slope and peak are those of one way.",
        );
    }
    None
}

/// Single readings that stand off both their neighbours.
fn spikes(curve: &TestCurve) -> Vec<Finding> {
    let (u, force) = (&curve.displacement_mm, &curve.force_n);
    let top = largest(force);
    let mut steps: Vec<f64> = force.windows(2).map(|pair| (pair[1] - pair[0]).abs()).collect();
    steps.sort_unstable_by(f64::total_cmp);
    let usual = steps.get(steps.len() / 2).copied().unwrap_or(0.0);
    let height = (1..force.len().saturating_sub(1)).map(|i| {
        let [before, after] = [force[i] - force[i - 1], force[i] - force[i + 1]];
        let same_side = before * after > 0.0;
        (i, if same_side { before.signum() * before.abs().min(after.abs()) } else { 0.0 })
    });
    let height: Vec<(usize, f64)> = height.collect();
    // a spike at the top must not be the measure of itself
    let mut forces = force.clone();
    forces.sort_unstable_by(f64::total_cmp);
    let scale = forces[forces.len().saturating_sub(2)];
    let limit = (SPIKE * scale).max(3.0 * usual);
    let off = height.into_iter().filter(|(_, height)| height.abs() > limit);
    off.map(|(i, height)| Finding {
        name: "spike",
        value: force[i],
        problem: format!(
            "has a single reading of {} N at {} mm, {height:+.4} N off its neighbours",
            force[i], u[i]
        ),
        help: "Remove the reading.",
        weight: if i == top { Weight::Error } else { Weight::Warning },
    })
    .collect()
}

fn without_quantities(reason: &QoiError) -> Finding {
    Finding {
        name: "no-quantities",
        value: f64::NAN,
        problem: reason.to_string(),
        help: "Correct the curve or leave the specimen out of the table.",
        weight: Weight::Error,
    }
}

fn preload(curve: &TestCurve, qois: &Qois) -> Option<Finding> {
    let value = curve.force_n[0];
    (value > PRELOAD * qois.peak_force_n).then(|| Finding {
        name: "preload",
        value,
        problem: format!("begins at {value:.4} N"),
        help: "Displacement must be counted from the unloaded specimen: toe = \"correct\" under \
               [experiments] extrapolates to it.",
        weight: Weight::Warning,
    })
}

fn toe(toe_mm: f64, qois: &Qois) -> Finding {
    let large = toe_mm.abs() > TOE * qois.displacement_at_peak_mm;
    Finding {
        name: "toe",
        value: toe_mm,
        problem: format!("begins to carry load at {toe_mm:.4} mm"),
        help: "The displacement at peak includes it; toe = \"correct\" under [experiments] counts \
               displacement from there.",
        weight: if large { Weight::Warning } else { Weight::Note },
    }
}

/// Displacement (mm) at which the curve without its soft start would leave zero force.
///
/// It is where the slope's line meets zero force, less what the curve's own bend moves that: a test
/// F ∝ v exp(−x³/3), x = v/v_peak (viscous damage), has at v a tangent that meets zero force at
/// −v x³/(1 − x³).
fn toe_mm(curve: &TestCurve, qois: &Qois, slope_fraction: f64) -> f64 {
    let peak = qois.displacement_at_peak_mm;
    let window = Window::around(slope_fraction, peak);
    let Ok(Line { middle_mm: middle, mean: force, .. }) = slope_line(curve, window) else {
        return 0.0;
    };
    let line = middle - force / qois.slope_n_per_mm;
    let mut toe = line;
    for _ in 0..50 {
        let x = ((middle - toe) / (peak - toe)).clamp(0.0, 0.9);
        let bend = x.powi(3) / (1.0 - x.powi(3));
        toe = line + (middle - toe) * bend;
    }
    toe
}

fn sampling(curve: &TestCurve, qois: &Qois, slope_fraction: f64) -> Option<Finding> {
    let peak = qois.displacement_at_peak_mm;
    let before: Vec<f64> = curve.displacement_mm.iter().copied().filter(|u| *u < peak).collect();
    let gap = before.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let in_window = Window::around(slope_fraction, peak).readings(&curve.displacement_mm);
    (before.len() < SPARSE || in_window < 3 || gap > GAP * peak).then(|| Finding {
        name: "sampling",
        value: before.len() as f64,
        problem: format!(
            "has {} readings before its peak, up to {gap:.4} mm apart, {in_window} of them where \
             the slope is taken",
            before.len()
        ),
        help: "Slope and peak are uncertain: record more often.",
        weight: Weight::Warning,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The viscous closed form, 44 steps to 0.22 mm, peak 147 N at 0.12 mm.
    fn viscous() -> TestCurve {
        let displacement_mm: Vec<f64> = (0..=44).map(|i| 0.005 * f64::from(i)).collect();
        let force = |u: f64| {
            147.0 * (1.0_f64 / 3.0).exp() * (u / 0.12) * (-(u / 0.12_f64).powi(3) / 3.0).exp()
        };
        let force_n = displacement_mm.iter().map(|&u| force(u)).collect();
        TestCurve { displacement_mm, force_n }
    }

    fn changed(change: impl Fn(&mut Vec<f64>, &mut Vec<f64>)) -> TestCurve {
        let mut curve = viscous();
        change(&mut curve.displacement_mm, &mut curve.force_n);
        curve
    }

    /// Names and weights of what is not a mere note.
    fn found(curve: &TestCurve) -> Vec<(&'static str, Weight)> {
        let findings = InspectedCurve::of(curve, 0.3).findings;
        findings.iter().filter(|f| f.weight != Weight::Note).map(|f| (f.name, f.weight)).collect()
    }

    #[test]
    fn a_sound_curve_has_a_toe_of_nothing_and_no_other_finding() {
        for fraction in [0.3, 0.55] {
            let seen = InspectedCurve::of(&viscous(), fraction);
            assert_eq!(seen.findings.iter().map(|f| f.name).collect::<Vec<_>>(), ["toe"]);
            assert!(seen.toe_mm.abs() < 0.004 * 0.12, "{}", seen.toe_mm);
        }
    }

    #[test]
    fn what_makes_quantities_wrong_is_an_error_of_its_own_name() {
        use Weight::Error;
        let minus = |x: &mut Vec<f64>| x.iter_mut().for_each(|x| *x = -*x);
        let cases: [(TestCurve, &str); 9] = [
            (changed(|u, _| minus(u)), "sign-of-displacement"),
            (changed(|_, f| minus(f)), "sign-of-force"),
            (changed(|u, f| (u.reverse(), f.reverse()).0), "order"),
            (changed(std::mem::swap), "columns-swapped"),
            (changed(|u, f| (u.swap(6, 15), f.swap(6, 15)).0), "order"),
            (changed(|_, f| f[24] = 190.0), "spike"),
            (changed(|u, _| u.fill(0.1)), "displacement"),
            (changed(|u, f| (u.truncate(20), f.truncate(20)).0), "no-quantities"),
            (changed(|_, f| f[5..10].reverse()), "slope"),
        ];
        for (curve, name) in cases {
            let found = found(&curve);
            assert!(found.contains(&(name, Error)), "{name}: {found:?}");
        }
    }

    #[test]
    fn preload_spikes_unloading_and_sparse_readings_are_told() {
        use Weight::Warning;
        let loaded = changed(|u, f| {
            u.drain(..4);
            f.drain(..4);
            let first = u[0];
            u.iter_mut().for_each(|u| *u -= first);
        });
        assert_eq!(found(&loaded), [("preload", Warning), ("toe", Warning)]);
        assert_eq!(found(&changed(|_, f| f[12] -= 30.0)), [("spike", Warning)]);
        let unloaded = changed(|u, f| {
            u.extend([0.2, 0.15, 0.1, 0.036]);
            f.extend([50.0, 20.0, 1.0, 0.0]);
        });
        assert_eq!(found(&unloaded), [("unloading", Warning)]);
        assert_eq!(InspectedCurve::of(&unloaded, 0.3).loading, viscous());
        let sparse = changed(|u, f| {
            let mut kept = 0..;
            u.retain(|_| kept.next().is_some_and(|i| i % 3 == 0));
            let mut kept = 0..;
            f.retain(|_| kept.next().is_some_and(|i| i % 3 == 0));
        });
        assert_eq!(found(&sparse), [("sampling", Warning)]);
    }

    /// A soft start of a = 0.02 mm: force follows the closed form in v with v + a (1 − e^(−v/a)) = u.
    #[test]
    fn a_soft_start_is_measured_and_taken_away() {
        let a = 0.02;
        let soft = changed(|u, _| {
            u.iter_mut().for_each(|u| *u += a * (1.0 - (-*u / (0.2 * a)).exp()));
        });
        assert_eq!(found(&soft), [("toe", Weight::Warning)]);
        let (corrected, moved) = InspectedCurve::of(&soft, 0.3).without_toe(0.3);
        assert!((moved / a - 1.0).abs() < 0.05, "{moved} mm");
        let [exact, with, without] =
            [&viscous(), &soft, &corrected].map(|curve| Qois::of(curve, 0.3).unwrap());
        let error = |q: &Qois| q.displacement_at_peak_mm / exact.displacement_at_peak_mm - 1.0;
        assert!(error(&with) > 0.15 && error(&without).abs() < 0.01, "{with:?} {without:?}");
        assert!((without.slope_n_per_mm / exact.slope_n_per_mm - 1.0).abs() < 0.01);
    }
}
