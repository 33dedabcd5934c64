//! Necking of a round bar: Simo's benchmark of plasticity at finite strain.

use std::ops::ControlFlow;

use super::simo_steel::{plastic, simo_steel};
use fem::{
    Axis, Conditions, CurvePoint, End, Fields, HardeningPoint, Material, Order, Problem, RoundBar,
    Schedule,
};

const RADIUS_MM: f64 = 6.413;
const LENGTH_MM: f64 = 53.334;

/// Height of the cells at the neck, relative to the mean height.
const LOWEST: f64 = 0.3;

/// Half of the elongation (mm), radius of the neck (mm), force (kN).
type Reading = [f64; 3];

/// A bar that is pulled until each end has moved by `travel_mm`.
struct Pull {
    material: Material,
    /// Radius in the middle divided by the radius at the end.
    thinner: f64,
    /// Whether the ends keep their radius.
    clamped: bool,
    travel_mm: f64,
    steps: u32,
    order: Order,
    spacing_mm: f64,
}

impl Pull {
    fn readings(&self) -> Vec<Reading> {
        let radius_mm = self.thinner * RADIUS_MM;
        let cylinder = RoundBar {
            radius_mm: RADIUS_MM,
            taper_mm: 0.0,
            length_mm: LENGTH_MM,
            necking_mm: LENGTH_MM,
            spacing_mm: self.spacing_mm,
        };
        // cells become lower towards the neck, where they elongate most, and the radius falls linearly to the neck
        let thinner = self.thinner;
        let mesh = cylinder.eighth().expect("a mesh").mapped(move |[x, y, z]| {
            let height = z / (0.5 * LENGTH_MM);
            let height = height * (LOWEST + (1.0 - LOWEST) * height);
            let stretch = thinner + (1.0 - thinner) * height;
            [stretch * x, stretch * y, 0.5 * LENGTH_MM * height]
        });
        let travel_mm = self.travel_mm;
        let axes: &[Axis] = if self.clamped { &Axis::ALL } else { &[Axis::Z] };
        let conditions = Conditions::new()
            .symmetry("bottom")
            .symmetry("left")
            .symmetry("front")
            .prescribe("top", axes.iter().copied(), move |_, t| [0.0, 0.0, travel_mm * t])
            .measure("top", [0.0, 0.0, 1.0]);
        let problem = Problem::builder(mesh)
            .order(self.order)
            .materials([self.material.clone()])
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, self.steps))
            .build()
            .expect("valid input");
        let is_neck =
            |x: &[f64; 3]| (x[0] - radius_mm).abs() + x[1].abs() + x[2].abs() < 1e-9 * RADIUS_MM;
        let neck = problem.nodes().iter().position(is_neck).expect("a node at the neck");
        let mut readings = Vec::new();
        let mut read = |point: &CurvePoint, fields: &Fields| {
            let radius = radius_mm + fields.displacement[neck][0];
            // a quarter of the section
            readings.push([point.displacement_mm, radius, 4e-3 * point.force_n]);
            ControlFlow::Continue(())
        };
        let outcome = problem.run(&mut read);
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        println!(
            "{:?}, spacing {} mm, {} unknowns, {} iterations",
            self.order,
            self.spacing_mm,
            problem.unknowns(),
            outcome.effort.iterations
        );
        readings
    }
}

/// Reading at the half elongation.
fn at(readings: &[Reading], half_mm: f64) -> Reading {
    let found = readings.iter().find(|reading| (reading[0] - half_mm).abs() < 1e-9);
    *found.unwrap_or_else(|| panic!("no step at {half_mm} mm"))
}

/// `reference/plasticity_2d.py bar 12`: an independent program with axial symmetry, 12 × 36 quadrilaterals of eight nodes
/// and 400 steps. With 6 × 18 quadrilaterals and 200 steps the radius at the end is 2.677 mm and the force 29.2 kN.
const REFERENCE: [Reading; 8] = [
    [1.4, 6.1824, 73.412],
    [2.8, 5.9944, 78.129],
    [3.5, 5.7583, 77.369],
    [4.2, 5.3574, 72.600],
    [4.9, 4.8478, 65.168],
    [5.6, 4.2402, 55.613],
    [6.3, 3.5232, 43.684],
    [7.0, 2.6779, 29.352],
];

/// The bar has free ends and a radius that is 1 % smaller in the middle. Errors are relative to the initial radius and
/// to the largest force.
#[test]
fn the_neck_of_simos_bar_agrees_with_an_independent_program() {
    let errors = [2.5, 1.5].map(|spacing_mm| {
        let pull = Pull {
            material: simo_steel(),
            thinner: 0.99,
            clamped: false,
            travel_mm: 7.0,
            steps: 140,
            order: Order::Quadratic,
            spacing_mm,
        };
        let readings = pull.readings();
        REFERENCE.map(|[half_mm, radius_mm, force_kn]| {
            let [_, radius, force] = at(&readings, half_mm);
            println!(
                "{half_mm} mm: radius {radius:.4} ({radius_mm}), force {force:.3} ({force_kn})"
            );
            [(radius - radius_mm).abs() / RADIUS_MM, (force - force_kn).abs() / 78.2]
        })
    });
    let [coarse, fine] = errors;
    for (k, [radius, force]) in fine.into_iter().enumerate() {
        let tolerance = if REFERENCE[k][0] < 5.0 { 0.003 } else { 0.03 };
        assert!(radius < tolerance && force < tolerance, "{:?}: {radius} {force}", REFERENCE[k]);
    }
    let last = REFERENCE.len() - 1;
    assert!((0..2).all(|k| fine[last][k] < 0.6 * coarse[last][k]), "{coarse:?} {fine:?}");
}

/// Forces read from a published figure, to 0.3 kN (solids4foam, tutorials/solids/elastoplasticity/neckingBar, after
/// Cardiff et al., Int. J. Numer. Meth. Engng 109 (2017) 1777): finite volumes, a cylinder whose ends keep their radius,
/// tabulated hardening.
#[test]
fn the_force_of_a_clamped_bar_agrees_with_finite_volumes() {
    let hardening = [
        (0.0, 451.0),
        (0.006, 476.0),
        (0.019, 525.0),
        (0.038, 583.0),
        (0.066, 642.0),
        (0.147, 710.0),
        (0.5, 777.0),
        (1.0, 831.0),
    ];
    let hardening = hardening.map(|(plastic_strain, yield_mpa)| HardeningPoint {
        plastic_strain,
        hardening_mpa: yield_mpa - 451.0,
    });
    let pull = Pull {
        material: plastic(200_000.0, 0.3, 451.0, hardening.to_vec()),
        thinner: 1.0,
        clamped: true,
        travel_mm: 7.0,
        steps: 140,
        order: Order::Quadratic,
        spacing_mm: 2.0,
    };
    let readings = pull.readings();
    for (half_mm, force_kn, tolerance) in [
        (1.0, 72.2, 0.01),
        (2.0, 77.9, 0.01),
        (3.0, 78.8, 0.01),
        (4.0, 76.0, 0.03),
        (5.0, 68.0, 0.03),
        (6.0, 54.7, 0.03),
    ] {
        let force = at(&readings, half_mm)[2];
        println!("{half_mm} mm: force {force:.2} ({force_kn}) kN");
        assert!((force / force_kn - 1.0).abs() < tolerance, "{force} and {force_kn} kN");
    }
}
