//! How many simulations a case takes, and an estimate of their processor time before any of them is made.

use fem::Order;

use crate::case::{Case, SpecimenGeometry};

/// One simulation of the example `resolution` (docs/convergence.md): tetrahedra of the lattice, load steps and
/// processor seconds, with quadratic elements and with linear ones.
const QUADRATIC: Measured = Measured { tets: 3022.0, seconds: 5.4 };
const LINEAR: Measured = Measured { tets: 3022.0, seconds: 0.4 };
const STEPS: f64 = 44.0;
/// Seconds grow with this power of the number of tetrahedra: 5.4, 20 and 83 s for 3 022, 8 294 and 24 180.
const POWER: f64 = 1.3;

/// Processor seconds of a run before its first load step, for packing, mesh and set-up: the ensemble of the example
/// for own data.
const PREPARATION: f64 = 0.3;

struct Measured {
    tets: f64,
    seconds: f64,
}

/// A number of simulations on one mesh.
struct Runs {
    count: usize,
    what: String,
    spacing_mm: f64,
    order: Order,
    steps: Option<u32>,
}

/// Lines on the expected cost of a calibration: nothing without a prior; without times where the number of
/// tetrahedra is not known before the image is segmented.
pub(super) fn expected_cost(case: &Case, geometry: &SpecimenGeometry) -> Option<Vec<String>> {
    case.prior.as_ref()?;
    let volume_mm3 = match geometry {
        SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } => {
            Some(std::f64::consts::PI * radius_mm.powi(2) * height_mm)
        }
        SpecimenGeometry::Image { radius_mm: Some(r), height_mm: Some(h), .. } => {
            Some(std::f64::consts::PI * r.powi(2) * h)
        }
        SpecimenGeometry::Image { .. } | SpecimenGeometry::Mesh { .. } => None,
    };
    let mut lines = Vec::new();
    let (mut all, mut seconds) = (0, Some(0.0));
    for runs in plan(case) {
        all += runs.count;
        let tets = volume_mm3.map(|volume| 12.0 * volume / runs.spacing_mm.powi(3));
        let tets = tets.filter(|tets| tets.is_finite());
        let of_runs = tets.map(|tets| runs.count as f64 * (runs.seconds(tets) + PREPARATION));
        seconds = seconds.zip(of_runs).map(|(sum, own)| sum + own);
        let mesh = match tets {
            Some(tets) => {
                format!(", each on about {tets:.0} tetrahedra of order {}", u8::from(runs.order))
            }
            None => String::new(),
        };
        lines.push(format!("{} {}{mesh}", runs.count, runs.what));
    }
    lines.push(match seconds {
        Some(seconds) => format!(
            "{all} simulations, about {} of one processor; estimated from 5.4 s for 44 steps on 3022 quadratic \
             tetrahedra, growing as tetrahedra^{POWER}, and {PREPARATION} s a run for packing and mesh: another material or machine may differ by a factor of 3",
            duration(seconds)
        ),
        None => format!(
            "{all} simulations; their time is known after the first (breccia simulate), since the number of \
             tetrahedra is not in the case"
        ),
    });
    Some(lines)
}

impl Runs {
    fn seconds(&self, tets: f64) -> f64 {
        let Measured { tets: measured, seconds } = match self.order {
            Order::Linear => LINEAR,
            Order::Quadratic => QUADRATIC,
        };
        let steps = self.steps.map_or(STEPS, f64::from);
        seconds * (tets / measured).powf(POWER) * steps / STEPS
    }
}

fn plan(case: &Case) -> Vec<Runs> {
    let own = case.specimen.spacing_mm.unwrap_or(f64::NAN);
    let on_specimen = |count: usize, what: &str| Runs {
        count,
        what: what.to_owned(),
        spacing_mm: own,
        order: case.specimen.order,
        steps: case.test.steps,
    };
    let mut plan = Vec::new();
    let specimens = case.experiments.as_ref().and_then(|e| e.virtual_specimens.as_ref());
    if let Some(specimens) = specimens {
        let spacing_mm = specimens.spacing_mm.unwrap_or(own);
        plan.push(Runs {
            spacing_mm,
            ..on_specimen(specimens.specimens, "simulations of virtual specimens")
        });
    }
    let extended: usize = case.extend.iter().map(|extension| extension.runs).sum();
    let mut count = case.design.runs + extended;
    let mut what = "runs of the design".to_owned();
    for level in &case.fidelity.levels {
        plan.push(Runs {
            count,
            what,
            spacing_mm: level.spacing_mm,
            order: level.order.unwrap_or(case.specimen.order),
            steps: level.steps.or(case.test.steps),
        });
        count = level.repeats;
        what = "of them repeated on the next mesh".to_owned();
    }
    plan.push(on_specimen(count, &what));
    if let Some(sequential) = &case.sequential {
        let first = case.fidelity.levels.first();
        let mut runs = on_specimen(sequential.most, "runs at most where the posterior lives");
        if let Some(level) = first {
            runs.spacing_mm = level.spacing_mm;
            runs.order = level.order.unwrap_or(runs.order);
        }
        plan.push(runs);
    }
    plan.push(on_specimen(2 + case.confirm.draws, "to confirm the posterior"));
    if let Some(spacing_mm) = case.confirm.second_spacing_mm {
        plan.push(Runs { spacing_mm, ..on_specimen(1, "on a second mesh") });
    }
    let tests = case.further_tests.candidate.iter().filter(|test| test.is_another_test());
    for test in tests {
        let mut runs = on_specimen(test.runs, &format!("of the further test {:?}", test.name));
        if let Some(level) = case.fidelity.levels.first() {
            runs.spacing_mm = level.spacing_mm;
            runs.order = level.order.unwrap_or(runs.order);
        }
        plan.push(runs);
    }
    plan
}

fn duration(seconds: f64) -> String {
    match seconds {
        s if s < 90.0 => format!("{s:.0} s"),
        s if s < 5400.0 => format!("{:.0} min", s / 60.0),
        s => format!("{:.1} h", s / 3600.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::case::CaseFile;

    /// The rows of docs/convergence.md: 5.4, 20 and 83 s for 0.7, 0.5 and 0.35 mm.
    #[test]
    fn times_of_the_measured_meshes_are_reproduced() {
        let volume = std::f64::consts::PI * 2.5 * 2.5 * 4.4;
        for (spacing_mm, order, seconds) in [
            (0.7, Order::Quadratic, 5.4),
            (0.5, Order::Quadratic, 20.0),
            (0.35, Order::Quadratic, 83.0),
            (0.7, Order::Linear, 0.4),
        ] {
            let runs = Runs { count: 1, what: String::new(), spacing_mm, order, steps: Some(44) };
            let estimated = runs.seconds(12.0 * volume / f64::powi(spacing_mm, 3));
            assert!((estimated / seconds - 1.0).abs() < 0.05, "{spacing_mm}: {estimated}");
        }
    }

    #[test]
    fn the_simulations_of_the_default_case_are_counted() {
        let file = CaseFile::default_case();
        let lines = expected_cost(&file.case, &file.geometry().unwrap()).unwrap();
        let counts: Vec<usize> = plan(&file.case).iter().map(|runs| runs.count).collect();
        assert_eq!(counts[..2], [8, 100]);
        let total: usize = counts.iter().sum();
        assert!(lines.last().unwrap().starts_with(&format!("{total} simulations")), "{lines:?}");
    }
}
