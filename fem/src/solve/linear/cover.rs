//! The least vertex cover of a bipartite graph.

const FREE: u32 = u32::MAX;

/// Left and right vertices that touch every edge, as few as possible.
///
/// `edges[l]` are the right neighbours of left vertex l. By König's theorem a maximum matching
/// yields them: (L ∖ Z) ∪ (R ∩ Z), with Z what alternating paths reach from the unmatched left.
pub(super) fn vertex_cover(edges: &[Vec<u32>], right: usize) -> (Vec<usize>, Vec<usize>) {
    let mut of_left = vec![FREE; edges.len()];
    let mut of_right = vec![FREE; right];
    for (l, near) in edges.iter().enumerate() {
        if let Some(&r) = near.iter().find(|&&r| of_right[r as usize] == FREE) {
            of_left[l] = r;
            of_right[r as usize] = l as u32;
        }
    }
    let mut seen = vec![FREE; right];
    for l in 0..edges.len() {
        if of_left[l] == FREE {
            augment(l as u32, edges, &mut of_left, &mut of_right, &mut seen);
        }
    }
    let mut reached = vec![false; edges.len()];
    let mut covered = vec![false; right];
    let mut stack: Vec<usize> = (0..edges.len()).filter(|&l| of_left[l] == FREE).collect();
    stack.iter().for_each(|&l| reached[l] = true);
    while let Some(l) = stack.pop() {
        for &r in &edges[l] {
            if !covered[r as usize] {
                covered[r as usize] = true;
                let next = of_right[r as usize] as usize;
                if !reached[next] {
                    reached[next] = true;
                    stack.push(next);
                }
            }
        }
    }
    (
        (0..edges.len()).filter(|&l| !reached[l]).collect(),
        (0..right).filter(|&r| covered[r]).collect(),
    )
}

/// Looks for an alternating path from the unmatched `root` to an unmatched right vertex, and flips
/// it. `seen[r]` is the root whose search came through r, so that it needs no clearing.
fn augment(
    root: u32,
    edges: &[Vec<u32>],
    of_left: &mut [u32],
    of_right: &mut [u32],
    seen: &mut [u32],
) {
    // (left vertex, the next of its edges to try)
    let mut path: Vec<(u32, usize)> = vec![(root, 0)];
    while let Some(&mut (l, ref mut next)) = path.last_mut() {
        let Some(&r) = edges[l as usize].get(*next) else {
            path.pop();
            continue;
        };
        *next += 1;
        if seen[r as usize] == root {
            continue;
        }
        seen[r as usize] = root;
        if of_right[r as usize] == FREE {
            for &(l, tried) in &path {
                let r = edges[l as usize][tried - 1];
                of_left[l as usize] = r;
                of_right[r as usize] = l;
            }
            return;
        }
        path.push((of_right[r as usize], 0));
    }
}

#[cfg(test)]
mod tests {
    use rand::{Rng, SeedableRng};
    use rand_xoshiro::Xoshiro256PlusPlus;

    use super::*;

    #[test]
    fn covers_are_complete_and_as_small_as_trying_all_finds() {
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
}
