//! Minimal residuals in a space of search directions, compared with the conditions that define them.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// Number of nodes. It exceeds the number that one parallel task processes, and it is not a multiple of `PART`.
const NODES: usize = CHUNK + 37;

fn random(rng: &mut Xoshiro256PlusPlus) -> Vec<Nodal> {
    (0..NODES).map(|_| std::array::from_fn(|_| rng.random_range(-1.0..1.0))).collect()
}

/// Multiplies by a matrix that couples neighbouring values and is not symmetric.
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

/// Returns the weights (zero at every fifth node), ten directions (two of them depend linearly on the other eight
/// directions), and three right-hand sides.
fn problem() -> (Vec<Nodal>, Vec<Vec<Nodal>>, Vec<Vec<Nodal>>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let weight = |n: usize| if n.is_multiple_of(5) { [0.0; 4] } else { [0.5, 1.0, 2.0, 1e3] };
    let mut vectors: Vec<Vec<Nodal>> = (0..7).map(|_| random(&mut rng)).collect();
    vectors.push(add(&add(&vectors[1], -3.0, &vectors[4]), 1e-4, &random(&mut rng)));
    vectors.push(add(&vectors[2], 1e-9, &random(&mut rng)));
    vectors.push(add(&vectors[0], 2.0, &vectors[7]));
    let rights = (0..3).map(|_| random(&mut rng)).collect();
    ((0..NODES).map(weight).collect(), vectors, rights)
}

fn solve() -> (Directions, Vec<System>) {
    let (weight, vectors, rights) = problem();
    let mut directions = Directions::new(weight);
    let start = random(&mut Xoshiro256PlusPlus::seed_from_u64(6));
    let mut systems: Vec<System> = rights
        .iter()
        .map(|right| {
            let residual = add(right, -1.0, &multiply(&start));
            directions.system(start.clone(), residual, 1e-3)
        })
        .collect();
    let (first, later) = vectors.split_at(4);
    for block in [first, later] {
        let count_before = directions.count();
        directions.add(block.to_vec(), block.iter().map(|v| multiply(v)).collect());
        directions.reduce(count_before, &mut systems);
    }
    systems.iter_mut().for_each(|system| directions.form(system));
    (directions, systems)
}

#[test]
fn residuals_are_minimal_and_belong_to_the_solutions() {
    let (weight, vectors, rights) = problem();
    let (directions, systems) = solve();
    assert_eq!(directions.count(), vectors.len() - 2);
    for (system, right) in systems.iter().zip(&rights) {
        let exact = add(right, -1.0, &multiply(&system.x));
        let size = directions.norm(&exact);
        for (a, b) in exact.as_flattened().iter().zip(system.residual.as_flattened()) {
            assert!((a - b).abs() < 1e-9, "{a} {b}");
        }
        assert!(size > 0.0);
        for product in vectors.iter().map(|v| multiply(v)) {
            let along = weighted_dot(&weight, &product, &exact) / directions.norm(&product);
            assert!(along.abs() < 1e-10 * size, "{along:e} of {size:e}");
        }
    }
}

#[test]
fn a_right_hand_side_in_the_space_is_solved() {
    let (weight, vectors, _) = problem();
    let mut directions = Directions::new(weight);
    let exact = add(&vectors[0], -0.3, &vectors[5]);
    let mut systems = vec![directions.system(vec![[0.0; 4]; NODES], multiply(&exact), 1e-12)];
    directions.add(vectors.clone(), vectors.iter().map(|v| multiply(v)).collect());
    assert!(!directions.solved(&systems[0]));
    directions.reduce(0, &mut systems);
    assert!(directions.solved(&systems[0]));
    directions.form(&mut systems[0]);
    for (a, b) in systems[0].x.as_flattened().iter().zip(exact.as_flattened()) {
        assert!((a - b).abs() < 1e-9, "{a} {b}");
    }
}

/// Principal components of the residuals a + b, a − b and 2 a, where a and b are orthogonal in the weighted inner product.
#[test]
fn principal_components_are_orthogonal_and_sorted_by_size() {
    let (weight, vectors, _) = problem();
    let directions = Directions::new(weight.clone());
    let (a, mut b) = (vectors[0].clone(), vectors[1].clone());
    let along = weighted_dot(&weight, &a, &b) / weighted_dot(&weight, &a, &a);
    b = add(&b, -along, &a);
    let scale = 1e-3 * directions.norm(&a) / directions.norm(&b);
    b = add(&[[0.0; 4]; NODES], scale, &b);
    let none = vec![[0.0; 4]; NODES];
    let residuals = [add(&a, 1.0, &b), add(&a, -1.0, &b), add(&a, 1.0, &a)];
    let system = |right: &Vec<Nodal>| directions.system(none.clone(), right.clone(), 1e-5);
    let mut systems: Vec<System> = residuals.iter().map(system).collect();
    systems.push(directions.system(none.clone(), none.clone(), 1e-5));
    // each residual is 10⁵ times its allowed residual
    let (largest, components) = directions.principal(&systems, 1e-4);
    assert!((largest / (1e5 * f64::sqrt(3.0)) - 1.0).abs() < 1e-5, "{largest:e}");
    assert_eq!(components.len(), 2);
    let size = |x: &[Nodal]| directions.norm(x);
    let cosine = |x: &[Nodal], y: &[Nodal]| weighted_dot(&weight, x, y) / (size(x) * size(y));
    assert!((size(&components[0]) / largest - 1.0).abs() < 1e-9);
    assert!((cosine(&components[0], &a).abs() - 1.0).abs() < 1e-6);
    assert!((cosine(&components[1], &b).abs() - 1.0).abs() < 1e-6);
    let expected = 1e5 * 1e-3 * f64::sqrt(2.0);
    assert!((size(&components[1]) / expected - 1.0).abs() < 1e-5, "{:e}", size(&components[1]));
    assert_eq!(directions.principal(&systems, 0.1).1.len(), 1);
    assert_eq!(directions.principal(&systems[3..], 0.1), (0.0, Vec::new()));
    systems[0].residual[3][1] = f64::NAN;
    assert!(directions.principal(&systems, 0.1).1.is_empty());
}

#[test]
fn growth_is_relative_to_the_solution_with_the_largest_stiffness() {
    // the stiffness is 4 for the first component (1e-12 at one node) and 25 for the last component; the other
    // components are not unknowns
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
fn the_solution_does_not_depend_on_the_number_of_threads() {
    let with = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("threads");
        pool.install(|| solve().1.into_iter().map(|s| [s.x, s.residual]).collect::<Vec<_>>())
    };
    assert_eq!(with(1), with(3));
}
