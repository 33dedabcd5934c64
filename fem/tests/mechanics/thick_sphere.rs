//! A thick sphere of elastic, perfectly plastic material under internal pressure.

use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_4, PI};

use fem::{Axis, Conditions, End, Material, Order, Plasticity, Problem, Schedule, TetMesh};

const INNER_MM: f64 = 1.0;
const OUTER_MM: f64 = 2.0;
const YOUNG_MPA: f64 = 200_000.0;
const POISSON: f64 = 0.3;
/// So small, relative to Young's modulus, that the problem is geometrically linear.
const YIELD_MPA: f64 = 0.2;

/// Mesh of an octant: three patches of n × n cells on the sphere, in n layers, with curved edges. Each patch is the
/// projection of a side of a cube.
fn octant(n: usize) -> TetMesh {
    let mut mesh = TetMesh { regions: vec!["shell".into()], ..TetMesh::default() };
    let mut node_ids = HashMap::new();
    for patch in 0..3 {
        for cell in 0..n * n * n {
            let (i, j, k) = (cell % n, cell / n % n, cell / n / n);
            let corners: Vec<u32> = (0..8)
                .map(|c| {
                    let mut on_cube = [n; 3];
                    on_cube[(patch + 1) % 3] = i + (c & 1);
                    on_cube[(patch + 2) % 3] = j + (c >> 1 & 1);
                    let layer = k + (c >> 2);
                    *node_ids.entry((on_cube, layer)).or_insert_with(|| {
                        let size = INNER_MM + (OUTER_MM - INNER_MM) * layer as f64 / n as f64;
                        mesh.nodes.push(on_cube.map(|x| size * x as f64 / n as f64));
                        mesh.nodes.len() as u32 - 1
                    })
                })
                .collect();
            for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                mesh.tets.push([corners[0], corners[a], corners[b], corners[7]]);
                mesh.region_of.push(0);
            }
        }
    }
    let middle = 0.5 * (INNER_MM + OUTER_MM);
    let cube = mesh.with_surfaces(|x, normal| {
        Some(match normal.map(|n| n < -0.5) {
            [true, ..] if x[0] < 1e-9 => "left",
            [_, true, _] if x[1] < 1e-9 => "front",
            [.., true] if x[2] < 1e-9 => "bottom",
            _ if x.into_iter().fold(0.0, f64::max) < middle => "inner",
            _ => "outer",
        })
    });
    // equal angles between the planes through the centre
    cube.mapped(|x| {
        let size = x.into_iter().fold(0.0, f64::max);
        let direction = x.map(|x| (FRAC_PI_4 * x / size).tan());
        direction.map(|d| size * d / norm(direction))
    })
}

fn norm(x: [f64; 3]) -> f64 {
    x.iter().map(|x| x * x).sum::<f64>().sqrt()
}

/// Hill's solution (The Mathematical Theory of Plasticity, 1950, chapter V) for the radius c of the plastic zone:
/// pressure (MPa), and displacements of the inner and the outer surface (mm).
fn hill(c: f64) -> [f64; 3] {
    let [a, b] = [INNER_MM, OUTER_MM];
    let cubes = (c / b).powi(3);
    let pressure = 2.0 * YIELD_MPA * ((c / a).ln() + (1.0 - cubes) / 3.0);
    let volume = 2.0 / 3.0 * (1.0 - 2.0 * POISSON) * (1.0 + 3.0 * (c / a).ln() - cubes);
    let inner = YIELD_MPA / YOUNG_MPA * a * ((1.0 - POISSON) * (c / a).powi(3) - volume);
    let outer = YIELD_MPA / YOUNG_MPA * b * (1.0 - POISSON) * cubes;
    [pressure, inner, outer]
}

const STEPS: usize = 10;

/// Relative errors of a sphere.
#[derive(Debug, Default)]
struct Errors {
    /// Largest errors of the pressure and of the outer displacement while the plastic zone grows.
    growing: [f64; 2],
    /// Error of the pressure at the collapse.
    collapse: f64,
    /// Increase of the pressure while the displacement grows by a fifth after the collapse.
    rise: f64,
}

/// Errors of a sphere whose inner surface has a prescribed displacement.
fn errors(n: usize, order: Order) -> Errors {
    let zone = |time_s: f64| INNER_MM + (OUTER_MM - INNER_MM) * time_s.min(1.0);
    let growth = move |time_s: f64| hill(zone(time_s))[1] * time_s.max(1.0);
    let conditions = Conditions::new()
        .symmetry("left")
        .symmetry("front")
        .symmetry("bottom")
        .prescribe("inner", Axis::ALL, move |x, time_s| {
            let scale = growth(time_s) / norm(x);
            x.map(|x| scale * x)
        });
    let plastic = Material::hencky(YOUNG_MPA, POISSON).with_plasticity(Plasticity::new(YIELD_MPA));
    let problem = Problem::builder(octant(n))
        .order(order)
        .materials([plastic])
        .conditions(conditions)
        // the last two steps are beyond the collapse
        .schedule(Schedule::fixed(1.2, STEPS as u32 + 2))
        .build()
        .expect("valid input");
    let outer: Vec<(usize, [f64; 3])> = problem
        .nodes()
        .iter()
        .copied()
        .enumerate()
        .filter(|(_, x)| norm(*x) > OUTER_MM - 1e-3)
        .collect();
    let mut displacements = Vec::new();
    let mut read = |_: &fem::CurvePoint, fields: &fem::Fields| {
        let radial = |&(node, x): &(usize, [f64; 3])| {
            let u: [f64; 3] = fields.displacement[node];
            u.iter().zip(x).map(|(u, x)| u * x).sum::<f64>() / norm(x)
        };
        displacements.push(outer.iter().map(radial).sum::<f64>() / outer.len() as f64);
        std::ops::ControlFlow::Continue(())
    };
    let outcome = problem.run(&mut read);
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    // the projection of the inner surface of the octant is a quarter of a disc
    let area = 0.25 * PI * INNER_MM * INNER_MM;
    let pressure =
        |step: usize| outcome.reactions["inner"][step].iter().sum::<f64>() / (3.0 * area);
    let mut errors = Errors::default();
    for step in 0..STEPS {
        let [exact, _, moves] = hill(zone(0.1 * (step + 1) as f64));
        errors.collapse = pressure(step) / exact - 1.0;
        let both = [errors.collapse, displacements[step] / moves - 1.0];
        for (largest, error) in errors.growing.iter_mut().zip(both) {
            *largest = largest.max(error.abs());
        }
    }
    errors.rise = pressure(STEPS + 1) / pressure(STEPS - 1) - 1.0;
    println!("{order:?}, {n} cells, {} unknowns: {errors:?}", problem.unknowns());
    errors
}

/// The collapse pressure is 2 Y ln(b/a). Quadratic elements do not lock: their pressure stays constant after the
/// collapse. With linear elements the pressure keeps rising.
#[test]
fn a_sphere_follows_hills_solution_to_its_collapse() {
    let [coarse, fine] = [2, 4].map(|n| errors(n, Order::Quadratic));
    assert!(fine.growing[0] < 0.02 && fine.growing[1] < 1e-3, "{fine:?}");
    assert!(fine.collapse > 0.0 && fine.collapse < 0.01, "{fine:?}");
    assert!(fine.collapse < 0.55 * coarse.collapse, "{coarse:?} {fine:?}");
    assert!(fine.rise.abs() < 2e-4 && coarse.rise.abs() < 1e-3, "{coarse:?} {fine:?}");
    let linear = errors(4, Order::Linear);
    assert!(linear.collapse > 0.1 && linear.rise > 0.015, "{linear:?}");
}
