//! Single-edge notched plate in tension or in shear, until it is broken.
//!
//! ```text
//! cargo bench -p fem --bench notched_plate -- [tension|shear] [SIZE_MM] [STATE]
//! ```
//!
//! `SIZE_MM` is the size of the elements around the crack (default 0.0075). `STATE` is a checkpoint file from which an
//! interrupted run resumes. The program prints the curve as CSV, then the peak. The documentation of the equations
//! (`fem::equations`) contains tables of the results. Most of the run time is spent in the increments in which the crack
//! grows unstably; these increments need hundreds of alternations.
//!
//! ```text
//!    tension              shear
//!    ↑ ↑ ↑ ↑ ↑            → → → → →
//!  ┌───────────┐        ┌───────────┐
//!  │           │        │           │   1 mm square, plane strain
//!  ├─────······│        ├─────.     │   open slit to the middle
//!  │           │        │      `.   │
//!  └───────────┘        └────────`──┘
//! ```

#[path = "../tests/support/notched_plate.rs"]
mod notched;

use std::ops::ControlFlow;

use fem::{Checkpoint, CurvePoint, Fields, Observer};
use notched::{Mode, NotchedPlate, kilonewton};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut arguments = std::env::args().skip(1).filter(|a| a != "--bench");
    let shear = arguments.next().is_some_and(|mode| mode == "shear");
    let size_mm: f64 = arguments.next().map_or(Ok(0.0075), |a| a.parse())?;
    let plate = if shear {
        NotchedPlate {
            mode: Mode::Shear,
            hybrid: false,
            size_mm,
            steps: vec![(0.008, 8), (0.02, 60)],
        }
    } else {
        NotchedPlate {
            mode: Mode::Tension,
            hybrid: true,
            size_mm,
            steps: vec![(0.005, 10), (0.0066, 80)],
        }
    };
    println!("{} tetrahedra", plate.mesh().tets.len());
    println!("displacement_mm,force_kN,fracture_N_mm,phi_max,newton");
    let mut print = Print { plate: &plate, peak: [0.0; 2] };
    let problem = plate.problem(1e-4);
    match arguments.next() {
        Some(path) => {
            problem.run_resumable(&Checkpoint { path: path.into(), every: 1 }, &mut print)?
        }
        None => problem.run(&mut print),
    };
    let [force, displacement] = print.peak;
    println!("peak {force:.5} kN at {displacement:.5} mm");
    Ok(())
}

/// Observer that prints the curve and records the peak.
struct Print<'a> {
    plate: &'a NotchedPlate,
    /// Force (kN) and displacement (mm) at the peak so far.
    peak: [f64; 2],
}

impl Observer for Print<'_> {
    fn step(&mut self, point: &CurvePoint, _: &Fields) -> ControlFlow<()> {
        let force = kilonewton(point, self.plate);
        if force > self.peak[0] {
            self.peak = [force, point.displacement_mm];
        }
        println!(
            "{:.5},{force:.5},{:.4e},{:.3},{}",
            point.displacement_mm,
            point.fracture_n_mm / self.plate.size_mm,
            point.phi_max,
            point.newton
        );
        ControlFlow::Continue(())
    }

    fn resumed(&mut self, curve: &[CurvePoint]) {
        for point in curve {
            let _ = self.step(point, &Fields::default());
        }
    }
}
