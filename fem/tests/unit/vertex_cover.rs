//! Vertex covers, compared with an exhaustive search.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

#[test]
fn covers_are_complete_and_minimal() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(4);
    for _ in 0..200 {
        let (left, right) = (6usize, 6usize);
        let edges: Vec<Vec<u32>> = (0..left)
            .map(|_| (0..right as u32).filter(|_| rng.random_bool(0.3)).collect())
            .collect();
        let (a, b) = vertex_cover(&edges, right);
        let covers = |a: &dyn Fn(usize) -> bool, b: &dyn Fn(usize) -> bool| {
            (0..left).all(|l| a(l) || edges[l].iter().all(|&r| b(r as usize)))
        };
        assert!(covers(&|l| a.contains(&l), &|r| b.contains(&r)));
        let least = (0u32..1 << (left + right))
            .filter(|set| covers(&|l| set >> l & 1 == 1, &|r| set >> (left + r) & 1 == 1))
            .map(u32::count_ones)
            .min();
        assert_eq!(Some((a.len() + b.len()) as u32), least);
    }
}
