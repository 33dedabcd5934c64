//! A notched plate in tension: a crack runs from the notch to the opposite side.
//!
//! ```text
//!     ↑ ↑ ↑ ↑ ↑      upper side moves up
//!   ┌───────────┐
//!   │           │    1 mm square, one element thick, plane strain
//!   ├─────······│    notch to the middle, then the crack (dots)
//!   │           │
//!   └───────────┘    lower side is held
//! ```
//!
//! ```text
//! cargo run --release -p fem --example notched_plate [-- SIZE_MM]
//! ```
//!
//! `SIZE_MM` is the element size (default 0.025); the length of the phase field is twice the element size. The notch is
//! a gap between the lips: nodes on the notch are doubled. Benchmark values on finer meshes are in the documentation of
//! the equations (`fem::equations`).
//!
//! Expected output with the default size:
//! ```text
//! 9600 elements
//! displacement_mm,force_per_thickness_N_per_mm,largest_damage
//! 0.00025,36.0,0.001
//! 0.00050,71.9,0.002
//! …
//! 0.00575,608.4,0.430
//! 0.00600,610.9,0.510
//! 0.00625,11.3,0.986
//! peak 610.9 N/mm at 0.00600 mm
//! ```

use fem::{
    Axis, Conditions, Fracture, Irreversibility, Material, PhaseField, Problem, Schedule,
    SolverOptions, Split, TetMesh,
};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let size_mm: f64 = std::env::args().nth(1).map_or(Ok(0.025), |text| text.parse())?;
    let mesh = plate(size_mm);
    println!("{} elements", mesh.tets.len());
    // steel: λ = 121.15 GPa, μ = 80.77 GPa, Gc = 2.7 N/mm
    let steel = Material::hencky(210_000.0, 0.3)
        .with_fracture(Fracture { residual_stiffness: 1e-7, ..Fracture::new(2.7) });
    let field = PhaseField {
        split: Split::Spectral,
        hybrid: true,
        irreversibility: Irreversibility::History,
        ..PhaseField::new(2.0 * size_mm)
    };
    let conditions = Conditions::new()
        .fix("front", [Axis::Z])
        .fix("back", [Axis::Z])
        .fix("bottom", [Axis::X, Axis::Y])
        .fix("top", [Axis::X])
        .prescribe("top", [Axis::Y], |_, time_s| [0.0, 0.007 * time_s, 0.0])
        .measure("top", [0.0, 1.0, 0.0]);
    let options = SolverOptions { tolerance: 1e-4, alternations: 2000, ..Default::default() };
    let problem = Problem::builder(mesh)
        .materials([steel])
        .phase_field(field)
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 28).stop_below_peak(0.5))
        .options(options)
        .build()?;
    println!("displacement_mm,force_per_thickness_N_per_mm,largest_damage");
    let mut peak = [0.0; 2];
    let mut run = problem.start();
    while let Some(point) = run.step() {
        let force = point.force_n / size_mm;
        if force > peak[0] {
            peak = [force, point.displacement_mm];
        }
        println!("{:.5},{force:.1},{:.3}", point.displacement_mm, point.phi_max);
    }
    println!("peak {:.1} N/mm at {:.5} mm", peak[0], peak[1]);
    Ok(())
}

/// Returns the plate, of n × n × 1 cubes with six tetrahedra each. Surfaces: bottom, top, front and back.
fn plate(size_mm: f64) -> TetMesh {
    let half = (0.5 / size_mm).round() as usize;
    let n = 2 * half;
    let size = 1.0 / n as f64;
    let mut mesh = TetMesh { regions: vec!["plate".into()], ..TetMesh::default() };
    // number of nodes per layer: all nodes of the grid, then the nodes of the upper lip of the notch
    let layer = (n + 1) * (n + 1) + half;
    for z in [0.0, size_mm] {
        let grid = (0..(n + 1) * (n + 1)).map(|k| [k % (n + 1), k / (n + 1)]);
        let lip = (0..half).map(|i| [i, half]);
        mesh.nodes.extend(grid.chain(lip).map(|[i, j]| [i as f64 * size, j as f64 * size, z]));
    }
    let node = |i: usize, j: usize, k: usize, is_above: bool| {
        let is_on_lip = is_above && j == half && i < half;
        (k * layer + if is_on_lip { (n + 1) * (n + 1) + i } else { i + (n + 1) * j }) as u32
    };
    let mut surfaces: [Vec<[u32; 3]>; 4] = Default::default();
    for (i, j) in (0..n * n).map(|cell| (cell % n, cell / n)) {
        let corner = |c: usize| node(i + (c & 1), j + (c >> 1 & 1), c >> 2, j >= half);
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
            mesh.region_of.push(0);
        }
        let mut add = |surface: usize, [a, b, c, d]: [usize; 4]| {
            let [a, b, c, d] = [a, b, c, d].map(corner);
            surfaces[surface].extend([[a, b, d], [a, d, c]]);
        };
        if j == 0 {
            add(0, [0, 1, 4, 5]);
        }
        if j + 1 == n {
            add(1, [2, 6, 3, 7]);
        }
        add(2, [0, 2, 1, 3]);
        add(3, [4, 5, 6, 7]);
    }
    for (name, triangles) in ["bottom", "top", "front", "back"].into_iter().zip(surfaces) {
        mesh.surfaces.insert(name.into(), triangles);
    }
    mesh
}
