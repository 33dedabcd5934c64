//! The minimum vertex cover of a bipartite graph.

/// Placeholder for the partner of a vertex that is not matched, and for the root of a vertex that has not been visited.
const FREE: u32 = u32::MAX;

/// Returns a smallest set of vertices that contains an end of every edge: the left vertices of the set, and its right
/// vertices.
///
/// `edges[l]` contains the right neighbours of left vertex l. `right` is the number of right vertices. By König's
/// theorem, the cover follows from a maximum matching: (L ∖ Z) ∪ (R ∩ Z), where L and R are all left and right vertices,
/// and Z are the vertices that alternating paths reach from unmatched left vertices.
pub(super) fn vertex_cover(edges: &[Vec<u32>], right: usize) -> (Vec<usize>, Vec<usize>) {
    let mut partner_of_left = vec![FREE; edges.len()];
    let mut partner_of_right = vec![FREE; right];
    for (l, near) in edges.iter().enumerate() {
        if let Some(&r) = near.iter().find(|&&r| partner_of_right[r as usize] == FREE) {
            partner_of_left[l] = r;
            partner_of_right[r as usize] = l as u32;
        }
    }
    let mut seen = vec![FREE; right];
    for l in 0..edges.len() {
        if partner_of_left[l] == FREE {
            augment(l as u32, edges, &mut partner_of_left, &mut partner_of_right, &mut seen);
        }
    }
    let mut reached = vec![false; edges.len()];
    let mut covered = vec![false; right];
    let mut stack: Vec<usize> = (0..edges.len()).filter(|&l| partner_of_left[l] == FREE).collect();
    stack.iter().for_each(|&l| reached[l] = true);
    while let Some(l) = stack.pop() {
        for &r in &edges[l] {
            if !covered[r as usize] {
                covered[r as usize] = true;
                let next = partner_of_right[r as usize] as usize;
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

/// Searches for an alternating path from the unmatched left vertex `root` to an unmatched right vertex, and exchanges
/// matched and unmatched edges along the path.
///
/// `seen[r]` is the root of the last search that visited right vertex r, so that `seen` need not be cleared.
fn augment(
    root: u32,
    edges: &[Vec<u32>],
    partner_of_left: &mut [u32],
    partner_of_right: &mut [u32],
    seen: &mut [u32],
) {
    // one entry per left vertex of the path: the vertex, and the index of the next of its edges to try
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
        if partner_of_right[r as usize] == FREE {
            for &(l, tried) in &path {
                let r = edges[l as usize][tried - 1];
                partner_of_left[l as usize] = r;
                partner_of_right[r as usize] = l;
            }
            return;
        }
        path.push((partner_of_right[r as usize], 0));
    }
}

#[cfg(test)]
#[path = "../../../../tests/unit/vertex_cover.rs"]
mod tests;
