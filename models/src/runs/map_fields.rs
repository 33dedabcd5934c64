//! Fields of the simulation at the posterior mode, at several stages of damage.

use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, Ordering};

use fem::{CurvePoint, Fields, Observer, vtu};

use crate::pipeline::task::Task;
use crate::progress::Bar;
use crate::results_folder::error::WorkflowError;
use crate::simulation::simulator::Simulator;
use crate::specimen::damage_of::damage_of;
use crate::specimen::segment::write_picture;

/// Displacement of the first stored state, as a fraction of the displacement at the highest force.
const EARLY: f64 = 0.5;

/// Repeats the run that gave `curve`, and writes its fields while the force rises, at the peak and at the end:
/// `fields/map-*.vtu` with their collection `fields/map.pvd` for ParaView, a picture of the damage in each state, and
/// `fields/map.csv`.
///
/// The run is repeated because the fields of runs are not stored: in large ensembles, they would need too much disk
/// space.
pub(crate) fn write_fields(
    task: &Task<'_>,
    simulator: &Simulator,
    values: &[f64],
    curve: &[CurvePoint],
) -> Result<(), WorkflowError> {
    let problem = simulator.at(values)?;
    let mut states = States::new(task.interrupt, moments(curve));
    problem.run(&mut states);
    task.check_interrupt()?;
    let States { stored, .. } = states;
    let (mut rows, mut steps) = (Vec::new(), Vec::new());
    for (name, point, fields) in &stored {
        let file = format!("map-{name}.vtu");
        task.product(&format!("fields/{file}"), |path| problem.write_vtu(path, fields))?;
        steps.push((point.time_s, file));
        let picture = format!("fields/map-{name}.png");
        write_picture(task, &picture, &damage_of(&problem, fields))?;
        let point_values =
            [point.time_s, point.displacement_mm, point.force_n].map(|x| x.to_string());
        rows.push(
            [name.to_string()].into_iter().chain(point_values).chain([picture]).collect::<Vec<_>>(),
        );
    }
    let steps: Vec<(f64, &str)> = steps.iter().map(|(time, file)| (*time, file.as_str())).collect();
    task.product("fields/map.pvd", |path| vtu::write_pvd(path, &steps))?;
    let header = ["state", "time_s", "displacement_mm", "force_N", "picture"];
    task.write_csv("fields/map.csv", header, rows)
}

/// Selects the steps whose fields are stored, each with a name: a step before the peak, the peak, and the last step. A
/// curve may lack some of these steps.
fn moments(curve: &[CurvePoint]) -> Vec<(usize, &'static str)> {
    let highest = |a: &usize, b: &usize| curve[*a].force_n.total_cmp(&curve[*b].force_n);
    let Some(peak) = (0..curve.len()).max_by(highest) else { return Vec::new() };
    let early =
        |i: &usize| curve[*i].displacement_mm.abs() >= EARLY * curve[peak].displacement_mm.abs();
    let first = (0..peak).find(early);
    let last = curve.len() - 1;
    let mut moments: Vec<(usize, &str)> = first.map(|i| (i, "rising")).into_iter().collect();
    moments.push((peak, "peak"));
    if last > peak {
        moments.push((last, "last"));
    }
    moments
}

/// Observer that stores the fields of the selected steps, and ends the run after the last selected step.
struct States<'a> {
    interrupt: &'a AtomicBool,
    wanted: Vec<(usize, &'static str)>,
    steps: usize,
    stored: Vec<(&'static str, CurvePoint, Fields)>,
    bar: Bar,
}

impl<'a> States<'a> {
    fn new(interrupt: &'a AtomicBool, wanted: Vec<(usize, &'static str)>) -> Self {
        Self {
            interrupt,
            wanted,
            steps: 0,
            stored: Vec::new(),
            bar: Bar::new("confirm", "fields at the mode"),
        }
    }
}

impl Observer for States<'_> {
    fn step(&mut self, point: &CurvePoint, fields: &Fields) -> ControlFlow<()> {
        if let Some((_, name)) = self.wanted.iter().find(|(step, _)| *step == self.steps) {
            self.stored.push((name, *point, fields.clone()));
        }
        self.steps += 1;
        let end = self.wanted.last().map_or(0, |(step, _)| step + 1);
        let done = self.steps as f64 / end.max(1) as f64;
        self.bar.set(done, &format!("step {} of {end}", self.steps));
        match self.steps >= end || self.interrupt.load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn curve(forces: &[f64]) -> Vec<CurvePoint> {
        let point = |(i, &force_n): (usize, &f64)| CurvePoint {
            displacement_mm: 0.01 * (i + 1) as f64,
            force_n,
            ..CurvePoint::default()
        };
        forces.iter().enumerate().map(point).collect()
    }

    #[test]
    fn rising_peak_and_last_as_far_as_a_curve_has_them() {
        let whole = curve(&[10.0, 20.0, 28.0, 33.0, 35.0, 34.0, 30.0]);
        assert_eq!(moments(&whole), [(2, "rising"), (4, "peak"), (6, "last")]);
        assert_eq!(moments(&whole[..5]), [(2, "rising"), (4, "peak")]);
        assert_eq!(moments(&whole[..1]), [(0, "peak")]);
        assert_eq!(moments(&[]), []);
    }
}
