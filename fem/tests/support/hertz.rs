//! Contact of a rigid ball with an elastic block, compared with Hertz's theory. By symmetry, only a quarter of the
//! problem is computed.
#![allow(dead_code)] // each test or benchmark uses only some of the fields

use fem::{Axis, Conditions, Material, Order, Platen, Problem, Schedule, SolverOptions};

use super::block::{block, graded};

/// Results of a run, and the values of Hertz's theory.
#[derive(Debug)]
pub(crate) struct Hertz {
    pub(crate) tets: usize,
    /// Force on the whole ball, N.
    pub(crate) force_n: f64,
    /// Contact radius a of p² = p₀² (1 − r²/a²), fitted to the nodal pressures, mm.
    pub(crate) radius_mm: f64,
    /// Largest pressure p₀ of the fit that gives `radius_mm`, MPa.
    pub(crate) pressure_mpa: f64,
    /// Contact radius a = (3FR/(4E*))^(1/3), mm.
    pub(crate) exact_radius_mm: f64,
    /// Largest pressure p₀ = 3F/(2πa²), MPa.
    pub(crate) exact_pressure_mpa: f64,
}

const YOUNG: f64 = 1000.0;
const POISSON: f64 = 0.3;
/// Radius of the ball, mm.
const BALL: f64 = 20.0;
/// Edge length of the quarter block, mm.
const SIZE: f64 = 8.0;

/// Presses the ball into the block until the contact radius is about 0.6 mm, with `across` elements across the radius.
pub(crate) fn hertz(across: usize, order: Order) -> Hertz {
    let h = 0.6 / across as f64;
    let flat = graded(h, across + across / 3 + 1, 1.35, SIZE);
    let down: Vec<f64> = graded(h, across, 1.35, SIZE).iter().rev().map(|z| SIZE - z).collect();
    let mesh = block([&flat, &flat, &down]);
    let tets = mesh.tets.len();
    let depth = 0.6 * 0.6 / BALL;
    let ball = Platen::sphere([0.0, 0.0, SIZE + BALL], BALL)
        .moving(move |time_s| [0.0, 0.0, -depth * time_s]);
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .fix("bottom", [Axis::Z])
        .platen("top", ball)
        .measure("top", [0.0, 0.0, -1.0]);
    let schedule = Schedule::fixed(1.0, 3);
    let material = Material::hencky(YOUNG, POISSON);
    let options = SolverOptions::default();
    let problem = Problem::builder(mesh)
        .order(order)
        .materials([material])
        .conditions(conditions)
        .schedule(schedule)
        .options(options)
        .build()
        .expect("valid input");
    let outcome = problem.run(&mut ());
    let last = outcome.curve.last().unwrap_or_else(|| panic!("{:?}", outcome.end));
    let contact_points = &outcome.contact["top"];
    for point in contact_points {
        assert!(point.pressure_mpa >= 0.0 && point.gap_mm > -1e-8, "{point:?}");
        assert!(point.pressure_mpa * point.gap_mm.max(0.0) < 1e-6, "{point:?}");
    }
    // least-squares line through (r², p²) at the nodes with at least 30 % of the largest pressure
    let most = contact_points.iter().map(|p| p.pressure_mpa).fold(0.0, f64::max);
    let [mut n, mut sx, mut sy, mut sxx, mut sxy] = [0.0; 5];
    for point in contact_points.iter().filter(|p| p.pressure_mpa > 0.3 * most) {
        let at = problem.nodes()[point.node as usize];
        let (x, y) = (at[0].powi(2) + at[1].powi(2), point.pressure_mpa.powi(2));
        (n, sx, sy) = (n + 1.0, sx + x, sy + y);
        (sxx, sxy) = (sxx + x * x, sxy + x * y);
    }
    let slope = (n * sxy - sx * sy) / (n * sxx - sx * sx);
    let square = (sy - slope * sx) / n;
    let force_n = 4.0 * last.force_n;
    let contact_modulus = YOUNG / (1.0 - POISSON * POISSON);
    let exact_radius_mm = (0.75 * force_n * BALL / contact_modulus).cbrt();
    Hertz {
        tets,
        force_n,
        radius_mm: (-square / slope).sqrt(),
        pressure_mpa: square.sqrt(),
        exact_radius_mm,
        exact_pressure_mpa: 1.5 * force_n / (std::f64::consts::PI * exact_radius_mm.powi(2)),
    }
}
