//! Number of simulations of a case, and an estimate of their processor time before the first simulation.

use fem::Order;

use crate::case::{Case, SpecimenGeometry, ValidationCase};

/// Measured cost of one simulation in the example `resolution` (docs/explanation/convergence.md) with [`STEPS`] load
/// steps: number of tetrahedra of the lattice and processor seconds, for quadratic and for linear elements.
const QUADRATIC: Measured = Measured { tets: 3022.0, seconds: 5.4 };
const LINEAR: Measured = Measured { tets: 3022.0, seconds: 0.4 };
const STEPS: f64 = 44.0;
/// Processor time is proportional to this power of the number of tetrahedra; measured: 5.4, 20 and 83 s for 3 022, 8
/// 294 and 24 180 tetrahedra.
const POWER: f64 = 1.3;

/// Processor seconds per run for packing, mesh and set-up, before the first load step. Measured in the ensemble of the
/// example that `breccia init --own-data` writes.
const PREPARATION: f64 = 0.3;

struct Measured {
    tets: f64,
    seconds: f64,
}

/// A group of simulations that use the same mesh.
struct Runs {
    count: usize,
    what: String,
    spacing_mm: f64,
    order: Order,
    steps: Option<u32>,
}

/// Number and cost of the simulations of a case.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ExpectedCost {
    /// Number of simulations.
    pub simulations: usize,
    /// Processor seconds; `None` if the number of tetrahedra is unknown before the image is segmented.
    pub seconds: Option<f64>,
    /// Description of each group of simulations, one line each.
    pub(crate) lines: Vec<String>,
}

impl ExpectedCost {
    /// Estimates the cost of a calibration, including the tests of virtual specimens; `None` for a case without a
    /// prior.
    pub(crate) fn of_calibration(case: &Case, geometry: &SpecimenGeometry) -> Option<Self> {
        case.prior.as_ref()?;
        if case.design.import.is_some() {
            return None;
        }
        Some(Self::of_runs(virtual_tests(case).chain(calibration(case)), geometry))
    }

    /// Estimates the cost of the tests of virtual specimens.
    pub(crate) fn of_laboratory(case: &Case, geometry: &SpecimenGeometry) -> Self {
        Self::of_runs(virtual_tests(case), geometry)
    }

    /// Estimates the cost of a validation with the case `case`: `draws` simulations, and the tests of virtual specimens.
    pub(crate) fn of_validation(
        case: &Case,
        entry: &ValidationCase,
        draws: usize,
        geometry: &SpecimenGeometry,
    ) -> Self {
        let what = format!("at posterior draws, for the validation {:?}", entry.name);
        let simulated = (draws > 0).then(|| on_specimen(case, draws, &what));
        Self::of_runs(virtual_tests(case).chain(simulated), geometry)
    }

    /// Adds the cost of further groups of simulations.
    pub(crate) fn with(mut self, others: Vec<Self>) -> Self {
        for other in others {
            self.simulations += other.simulations;
            self.seconds = self.seconds.zip(other.seconds).map(|(a, b)| a + b);
            self.lines.extend(other.lines);
        }
        self
    }

    fn of_runs(runs: impl Iterator<Item = Runs>, geometry: &SpecimenGeometry) -> Self {
        let volume_mm3 = volume_mm3(geometry);
        let mut cost = Self { seconds: Some(0.0), ..Self::default() };
        for runs in runs {
            cost.simulations += runs.count;
            let tets = volume_mm3.map(|volume| 12.0 * volume / runs.spacing_mm.powi(3));
            let tets = tets.filter(|tets| tets.is_finite());
            let of_runs = tets.map(|tets| runs.count as f64 * (runs.seconds(tets) + PREPARATION));
            cost.seconds = cost.seconds.zip(of_runs).map(|(sum, of_these)| sum + of_these);
            let mesh = match tets {
                Some(tets) => {
                    let order = u8::from(runs.order);
                    format!(", each on about {tets:.0} tetrahedra of order {order}")
                }
                None => String::new(),
            };
            cost.lines.push(format!("{} {}{mesh}", runs.count, runs.what));
        }
        cost
    }

    /// Total cost of several cases.
    pub(crate) fn sum(costs: &[&Self]) -> Self {
        let seconds = costs.iter().map(|cost| cost.seconds).sum();
        let simulations = costs.iter().map(|cost| cost.simulations).sum();
        Self { simulations, seconds, lines: Vec::new() }
    }

    /// Describes the number of simulations and their time on one line.
    pub fn total(&self) -> String {
        let all = self.simulations;
        match self.seconds {
            Some(seconds) => format!(
                "{all} simulations, about {} of one processor; estimated from 5.4 s for 44 steps on 3022 quadratic \
                 tetrahedra, growing as tetrahedra^{POWER}, and {PREPARATION} s a run for packing and mesh: another \
                 material or machine may differ by a factor of 3",
                duration(seconds)
            ),
            None => format!(
                "{all} simulations; their cost is not known yet, because the case does not state the size of the mesh"
            ),
        }
    }
}

/// Volume of the specimen, mm³; `None` if the case does not specify its size.
fn volume_mm3(geometry: &SpecimenGeometry) -> Option<f64> {
    match geometry {
        SpecimenGeometry::Cylinder { radius_mm, height_mm, .. } => {
            Some(std::f64::consts::PI * radius_mm.powi(2) * height_mm)
        }
        // a block has six tetrahedra per cell, a lattice twelve
        SpecimenGeometry::Block { size_mm, .. } => Some(0.5 * size_mm.iter().product::<f64>()),
        SpecimenGeometry::Image { radius_mm: Some(r), height_mm: Some(h), .. }
        | SpecimenGeometry::Surfaces { radius_mm: Some(r), height_mm: Some(h), .. } => {
            Some(std::f64::consts::PI * r.powi(2) * h)
        }
        SpecimenGeometry::Image { .. }
        | SpecimenGeometry::Surfaces { .. }
        | SpecimenGeometry::Mesh { .. }
        | SpecimenGeometry::Absent => None,
    }
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

/// The tests of virtual specimens.
fn virtual_tests(case: &Case) -> impl Iterator<Item = Runs> {
    let specimens = case.experiments.as_ref().and_then(|e| e.virtual_specimens.as_ref());
    specimens.into_iter().map(|specimens| {
        let default = on_specimen(case, specimens.specimens, "simulations of virtual specimens");
        Runs { spacing_mm: specimens.spacing_mm.unwrap_or(default.spacing_mm), ..default }
    })
}

/// Returns `count` simulations on the mesh of the case's specimen, described by `what`.
fn on_specimen(case: &Case, count: usize, what: &str) -> Runs {
    Runs {
        count,
        what: what.to_owned(),
        spacing_mm: case.specimen.spacing_mm.unwrap_or(f64::NAN),
        order: case.specimen.order,
        steps: case.test.load_steps(None),
    }
}

/// The simulations of a calibration, except the tests of virtual specimens.
fn calibration(case: &Case) -> Vec<Runs> {
    let on_specimen = |count: usize, what: &str| on_specimen(case, count, what);
    let mut plan = Vec::new();
    let extended: usize = case.extend.iter().map(|extension| extension.runs).sum();
    let mut count = case.design.runs + extended;
    let mut what = "runs of the design".to_owned();
    for level in &case.fidelity.levels {
        plan.push(Runs {
            count,
            what,
            spacing_mm: level.spacing_mm,
            order: level.order.unwrap_or(case.specimen.order),
            steps: case.test.load_steps(level.steps),
        });
        count = level.repeats;
        what = "of them repeated on the next mesh".to_owned();
    }
    plan.push(on_specimen(count, &what));
    if let Some(sequential) = &case.sequential {
        let first = case.fidelity.levels.first();
        let mut runs = on_specimen(sequential.most, "runs at most in the posterior");
        if let Some(level) = first {
            runs.spacing_mm = level.spacing_mm;
            runs.order = level.order.unwrap_or(runs.order);
        }
        plan.push(runs);
    }
    // the built-in simulation also simulates the materials before the calibration
    let confirming = if case.is_built_in() { 2 } else { 1 };
    plan.push(on_specimen(confirming + case.confirm.draws, "to confirm the posterior"));
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

    /// Reproduces the rows of docs/explanation/convergence.md: 5.4, 20 and 83 s for spacings of 0.7, 0.5 and 0.35 mm.
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
        let geometry = file.geometry().unwrap();
        let cost = ExpectedCost::of_calibration(&file.case, &geometry).unwrap();
        let runs: Vec<Runs> = virtual_tests(&file.case).chain(calibration(&file.case)).collect();
        let counts: Vec<usize> = runs.iter().map(|runs| runs.count).collect();
        assert_eq!(counts[..2], [8, 100]);
        assert_eq!(cost.simulations, counts.iter().sum::<usize>());
        assert_eq!(cost.lines.len(), counts.len());
        assert_eq!(ExpectedCost::of_laboratory(&file.case, &geometry).simulations, 8);
    }
}
