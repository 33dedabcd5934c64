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

#[test]
fn the_neck_of_simos_bar_agrees_with_an_independent_program() {
    let bar = |order, spacing_mm| {
        let pull = Pull {
            material: simo_steel(),
            thinner: 0.99,
            clamped: false,
            travel_mm: 7.0,
            steps: 100,
            order,
            spacing_mm,
        };
        pull.readings()
    };
    for (order, spacing_mm) in [
        (Order::Quadratic, 3.0),
        (Order::Quadratic, 2.0),
        (Order::Quadratic, 1.5),
        (Order::Linear, 1.5),
    ] {
        let readings = bar(order, spacing_mm);
        for half_mm in [1.4, 2.8, 3.5, 4.2, 4.9, 5.6, 6.3, 7.0] {
            println!("{:?}", at(&readings, half_mm));
        }
    }
}

#[test]
fn the_force_of_a_clamped_bar_agrees_with_finite_volumes() {
    let points = [
        (0.0, 451.0),
        (0.006, 476.0),
        (0.019, 525.0),
        (0.038, 583.0),
        (0.066, 642.0),
        (0.147, 710.0),
        (0.5, 777.0),
        (1.0, 831.0),
    ];
    let points = points.map(|(plastic_strain, yield_mpa)| HardeningPoint {
        plastic_strain,
        hardening_mpa: yield_mpa - 451.0,
    });
    let pull = Pull {
        material: plastic(200_000.0, 0.3, 451.0, points.to_vec()),
        thinner: 1.0,
        clamped: true,
        travel_mm: 7.0,
        steps: 140,
        order: Order::Quadratic,
        spacing_mm: 2.0,
    };
    let readings = pull.readings();
    for half_mm in [1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0] {
        println!("{:?}", at(&readings, half_mm));
    }
}
