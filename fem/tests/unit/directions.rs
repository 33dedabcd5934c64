//! Least residuals in a space of directions, against the conditions that define them.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// More than a task's, and no multiple of a part.
const NODES: usize = CHUNK + 37;

fn random(rng: &mut Xoshiro256PlusPlus) -> Vec<Nodal> {
    (0..NODES).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect()
}

/// Neighbouring values coupled, not symmetric.
fn multiply(x: &[Nodal]) -> Vec<Nodal> {
    let x = x.as_flattened();
    let at = |i: usize| x.get(i).copied().unwrap_or(0.0);
    let y: Vec<f64> =
        (0..x.len()).map(|i| 3.0 * x[i] - at(i.wrapping_sub(1)) - 0.5 * at(i + 1)).collect();
    y.as_chunks().0.to_vec()
}

fn add(to: &[Nodal], a: f64, x: &[Nodal]) -> Vec<Nodal> {
    to.iter().zip(x).map(|(t, x)| std::array::from_fn(|k| t[k] + a * x[k])).collect()
}

/// The weight, which does not see every fifth node; directions, two of which lie in others; and
/// right-hand sides.
fn problem() -> (Vec<Nodal>, Vec<Vec<Nodal>>, Vec<Vec<Nodal>>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let weight = |n: usize| if n.is_multiple_of(5) { [0.0; 4] } else { [0.5, 1.0, 2.0, 1e3] };
    let mut of: Vec<Vec<Nodal>> = (0..7).map(|_| random(&mut rng)).collect();
    of.push(add(&add(&of[1], -3.0, &of[4]), 1e-4, &random(&mut rng)));
    of.push(add(&of[2], 1e-9, &random(&mut rng)));
    of.push(add(&of[0], 2.0, &of[7]));
    let rights = (0..3).map(|_| random(&mut rng)).collect();
    ((0..NODES).map(weight).collect(), of, rights)
}

fn solve() -> (Directions, Vec<System>) {
    let (weight, of, rights) = problem();
    let mut directions = Directions::new(weight);
    let start = random(&mut Xoshiro256PlusPlus::seed_from_u64(6));
    let mut systems: Vec<System> = rights
        .iter()
        .map(|right| {
            let residual = add(right, -1.0, &multiply(&start));
            directions.system(start.clone(), residual, 1e-3)
        })
        .collect();
    let (first, later) = of.split_at(4);
    for block in [first, later] {
        let known = directions.count();
        directions.add(block.to_vec(), block.iter().map(|v| multiply(v)).collect());
        directions.reduce(known, &mut systems);
    }
    systems.iter_mut().for_each(|system| directions.form(system));
    (directions, systems)
}

#[test]
fn residuals_are_least_and_belong_to_the_solutions() {
    let (weight, of, rights) = problem();
    let (directions, systems) = solve();
    assert_eq!(directions.count(), of.len() - 2);
    for (system, right) in systems.iter().zip(&rights) {
        let exact = add(right, -1.0, &multiply(&system.x));
        let size = directions.norm(&exact);
        for (a, b) in exact.as_flattened().iter().zip(system.residual.as_flattened()) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert!(size > 0.0);
        for product in of.iter().map(|v| multiply(v)) {
            let along = weighted_dot(&weight, &product, &exact) / directions.norm(&product);
            assert!(along.abs() < 1e-10 * size, "{along:e} of {size:e}");
        }
    }
}

#[test]
fn a_right_hand_side_in_the_space_is_solved() {
    let (weight, of, _) = problem();
    let mut directions = Directions::new(weight);
    let exact = add(&of[0], -0.3, &of[5]);
    let mut systems = vec![directions.system(vec![[0.0; 4]; NODES], multiply(&exact), 1e-12)];
    directions.add(of.clone(), of.iter().map(|v| multiply(v)).collect());
    assert!(!directions.solved(&systems[0]));
    directions.reduce(0, &mut systems);
    assert!(directions.solved(&systems[0]));
    directions.form(&mut systems[0]);
    for (a, b) in systems[0].x.as_flattened().iter().zip(exact.as_flattened()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// Residuals a + b, a − b and 2 a of two that are orthogonal, in the weight of their norm.
#[test]
fn principal_parts_span_what_is_left_from_the_largest_on() {
    let (weight, of, _) = problem();
    let directions = Directions::new(weight.clone());
    let (a, mut b) = (of[0].clone(), of[1].clone());
    let along = weighted_dot(&weight, &a, &b) / weighted_dot(&weight, &a, &a);
    b = add(&b, -along, &a);
    let scale = 1e-3 * directions.norm(&a) / directions.norm(&b);
    b = add(&[[0.0; 4]; NODES], scale, &b);
    let none = vec![[0.0; 4]; NODES];
    let of = [add(&a, 1.0, &b), add(&a, -1.0, &b), add(&a, 1.0, &a)];
    let system = |right: &Vec<Nodal>| directions.system(none.clone(), right.clone(), 1e-5);
    let mut systems: Vec<System> = of.iter().map(system).collect();
    systems.push(directions.system(none.clone(), none.clone(), 1e-5));
    // each counts 10⁵ of its own size
    let (largest, parts) = directions.principal(&systems, 1e-4);
    assert!((largest / (1e5 * f64::sqrt(3.0)) - 1.0).abs() < 1e-5, "{largest:e}");
    assert_eq!(parts.len(), 2);
    let size = |x: &[Nodal]| directions.norm(x);
    let cosine = |x: &[Nodal], y: &[Nodal]| weighted_dot(&weight, x, y) / (size(x) * size(y));
    assert!((size(&parts[0]) / largest - 1.0).abs() < 1e-9);
    assert!((cosine(&parts[0], &a).abs() - 1.0).abs() < 1e-6);
    assert!((cosine(&parts[1], &b).abs() - 1.0).abs() < 1e-6);
    let expected = 1e5 * 1e-3 * f64::sqrt(2.0);
    assert!((size(&parts[1]) / expected - 1.0).abs() < 1e-5, "{:e}", size(&parts[1]));
    assert_eq!(directions.principal(&systems, 0.1).1.len(), 1);
    assert_eq!(directions.principal(&systems[3..], 0.1), (0.0, Vec::new()));
    systems[0].residual[3][1] = f64::NAN;
    assert!(directions.principal(&systems, 0.1).1.is_empty());
}

#[test]
fn growth_is_that_over_the_solution_of_the_stiffest() {
    // stiffnesses 4 and 1e-12 of the first field, 25 of the last; the others are not solved for
    let mut weight = vec![[0.25, 0.0, 0.0, 0.04]; NODES];
    weight[7][0] = 1e12;
    let directions = Directions::new(weight);
    let right = vec![[4.0, 5.0, 6.0, 50.0]; NODES];
    let mut system = directions.system(vec![[1.0, 0.0, 0.0, 2.0]; NODES], right, 1e-3);
    assert!((directions.growth(&system) - 1.0).abs() < 1e-12);
    system.x[7][0] = 4e12;
    let expected = 2.0 * 4e12 / (104.0 * NODES as f64).sqrt();
    assert!((directions.growth(&system) / expected - 1.0).abs() < 1e-9);
}

#[test]
fn threads_do_not_change_a_bit() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| solve().1.into_iter().map(|s| [s.x, s.residual]).collect::<Vec<_>>())
    };
    assert_eq!(with(1), with(3));
}
