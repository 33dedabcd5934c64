//! Single-edge notched tension with elements of a quarter of the length scale.
//!
//! Run: `cargo run --release -p fem --example notched_plate [size_mm]`; it prints the curve as CSV
//! and, at the end, the peak beside the record (definitions 3.6, case 7: 0.71074 kN at 0.00556 mm).
//! The table is in the documentation of the equations. The increment in which the plate breaks takes
//! hundreds of alternations, most of the time.
//!
//! ```text
//!      ↑ ↑ ↑ ↑ u
//!    ┌─────────┐
//!    │         │  1 mm square, plane strain
//!    ├────     │  slit to the middle, open
//!    │         │
//!    └─────────┘
//! ```

#[path = "../tests/support/notched_plate.rs"]
mod notched;

use std::ops::ControlFlow;

use fem::{CurvePoint, Fields};
use notched::{NotchedPlate, kilonewton};

fn main() {
    let size_mm = std::env::args().nth(1).map_or(0.00375, |text| {
        text.parse().expect("the size of the elements around the crack in mm")
    });
    let plate = NotchedPlate { size_mm, steps: vec![(0.005, 10), (0.0066, 80)] };
    println!("{} tetrahedra", plate.mesh().tets.len());
    println!("displacement_mm,force_kN,fracture_N_mm,phi_max,newton");
    let mut peak = [0.0; 2];
    plate.problem(1e-4).run(&mut |point: &CurvePoint, _: &Fields| {
        let force = kilonewton(point, &plate);
        if force > peak[0] {
            peak = [force, point.displacement_mm];
        }
        println!(
            "{:.5},{force:.5},{:.4e},{:.3},{}",
            point.displacement_mm,
            point.fracture_n_mm / size_mm,
            point.phi_max,
            point.newton
        );
        ControlFlow::Continue(())
    });
    println!(
        "peak {:.5} kN at {:.5} mm; the record has 0.71074 kN at 0.00556 mm",
        peak[0], peak[1]
    );
}
