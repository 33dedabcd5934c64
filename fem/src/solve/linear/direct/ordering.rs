//! Fill-reducing order of the nodes: geometric nested dissection.
//!
//! A plane divides the nodes into two parts. The separator is the smallest set of nodes whose removal cuts every edge
//! across the plane; the separator is eliminated last. Both parts are divided recursively. Parts that are too small to
//! be divided are ordered by minimum degree. The unknowns of a node are numbered consecutively.
//!
//! References: George, SIAM J. Numer. Anal. 10 (1973) 345, doi:10.1137/0710032; the smallest separator of a cut is a
//! vertex cover of a bipartite graph, found by a matching (Pothen & Fan, ACM Trans. Math. Softw. 16 (1990) 303,
//! doi:10.1145/98267.98287).

use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::amd;

use super::cover::vertex_cover;
use crate::error::FemError;
use crate::operator::Graph;

/// Largest number of nodes of a part that is not divided further.
const LEAF: usize = 100;
/// Positions of the planes that are compared as cuts through a part. A position is the fraction of the part's nodes on
/// the lower side of the plane.
const CUTS: [f64; 5] = [0.42, 0.46, 0.5, 0.54, 0.58];

/// Returns the nodes in the order of elimination.
pub(crate) fn nested_dissection(
    graph: &Graph,
    positions: &[[f64; 3]],
) -> Result<Vec<u32>, FemError> {
    let nodes = graph.nodes();
    let mut dissection = Dissection {
        graph,
        positions,
        side: vec![OUT; nodes],
        local: vec![0; nodes],
        order: vec![],
    };
    dissection.cut((0..nodes as u32).collect())?;
    Ok(dissection.order)
}

const OUT: u8 = 0;
const LEFT: u8 = 1;
const RIGHT: u8 = 2;
const SEPARATOR: u8 = 3;

struct Dissection<'a> {
    graph: &'a Graph,
    positions: &'a [[f64; 3]],
    /// Side of the current cutting plane on which each node lies: `OUT` (not in this part), `LEFT`, `RIGHT` or
    /// `SEPARATOR`.
    side: Vec<u8>,
    /// Index of each node among the nodes of its side.
    local: Vec<u32>,
    order: Vec<u32>,
}

impl Dissection<'_> {
    fn cut(&mut self, part: Vec<u32>) -> Result<(), FemError> {
        if part.len() <= LEAF {
            return self.minimum_degree(&part);
        }
        let mut best: Option<(f64, [Vec<u32>; 3])> = None;
        for axis in 0..3 {
            let mut sorted = part.clone();
            // order nodes with equal coordinates along the axis by their other coordinates, so that a cut between such
            // nodes is plane, too
            let key = |n: u32| [0, 1, 2].map(|k| self.positions[n as usize][(axis + k) % 3]);
            sorted.sort_unstable_by(|&a, &b| {
                let (p, q) = (key(a), key(b));
                let ties = p[1].total_cmp(&q[1]).then(p[2].total_cmp(&q[2])).then(a.cmp(&b));
                p[0].total_cmp(&q[0]).then(ties)
            });
            for share in CUTS {
                let at = (share * part.len() as f64) as usize;
                let separator = self.separator(&sorted, at);
                let size = separator.len() as f64;
                let score = size * (1.0 + (share - 0.5).abs());
                if best.as_ref().is_none_or(|b| score < b.0) {
                    separator.iter().for_each(|&n| self.side[n as usize] = SEPARATOR);
                    let keep = |half: &[u32]| -> Vec<u32> {
                        let stays = |n: &u32| self.side[*n as usize] != SEPARATOR;
                        half.iter().copied().filter(stays).collect()
                    };
                    best = Some((score, [keep(&sorted[..at]), keep(&sorted[at..]), separator]));
                }
            }
        }
        part.iter().for_each(|&n| self.side[n as usize] = OUT);
        let Some((_, [left, right, separator])) = best else { return Ok(()) };
        if left.is_empty() && right.is_empty() {
            self.order.extend(separator);
            return Ok(());
        }
        self.cut(left)?;
        self.cut(right)?;
        self.order.extend(separator);
        Ok(())
    }

    /// Returns the smallest set of nodes that separates `sorted[..at]` from `sorted[at..]`.
    fn separator(&mut self, sorted: &[u32], at: usize) -> Vec<u32> {
        sorted[..at].iter().for_each(|&n| self.side[n as usize] = LEFT);
        sorted[at..].iter().for_each(|&n| self.side[n as usize] = RIGHT);
        let (mut left, mut right, mut edges) = (Vec::new(), Vec::new(), Vec::new());
        for &n in &sorted[at..] {
            if self.graph.neighbours(n as usize).iter().any(|&m| self.side[m as usize] == LEFT) {
                self.local[n as usize] = right.len() as u32;
                right.push(n);
            }
        }
        for &n in &sorted[..at] {
            let across = self.graph.neighbours(n as usize).iter();
            let across: Vec<u32> = across
                .filter(|&&m| self.side[m as usize] == RIGHT)
                .map(|&m| self.local[m as usize])
                .collect();
            if !across.is_empty() {
                left.push(n);
                edges.push(across);
            }
        }
        let (from_left, from_right) = vertex_cover(&edges, right.len());
        let chosen = from_left.into_iter().map(|i| left[i]);
        chosen.chain(from_right.into_iter().map(|i| right[i])).collect()
    }

    /// Orders a part by approximate minimum degree (Amestoy, Davis & Duff, SIAM J. Matrix Anal. Appl. 17 (1996) 886,
    /// doi:10.1137/S0895479894278952).
    fn minimum_degree(&mut self, part: &[u32]) -> Result<(), FemError> {
        for (i, &n) in part.iter().enumerate() {
            self.side[n as usize] = LEFT;
            self.local[n as usize] = i as u32;
        }
        let mut start = vec![0u32];
        let mut row = Vec::new();
        for &n in part {
            let begin = row.len();
            let inside = self
                .graph
                .neighbours(n as usize)
                .iter()
                .filter(|&&m| self.side[m as usize] == LEFT);
            row.extend(inside.map(|&m| self.local[m as usize]));
            row[begin..].sort_unstable();
            start.push(row.len() as u32);
        }
        part.iter().for_each(|&n| self.side[n as usize] = OUT);
        let order = amd_order(part.len(), &start, &row)?;
        self.order.extend(order.into_iter().map(|i| part[i as usize]));
        Ok(())
    }
}

/// Returns the approximate minimum degree order of a graph in compressed sparse row format.
fn amd_order(nodes: usize, start: &[u32], row: &[u32]) -> Result<Vec<u32>, FemError> {
    let failed = |reason: String| FemError::factorisation(4 * nodes, reason);
    let graph = SymbolicSparseColMatRef::new_checked(nodes, nodes, start, None, row);
    let (mut order, mut position) = (vec![0u32; nodes], vec![0u32; nodes]);
    let scratch = amd::order_scratch::<u32>(nodes, row.len());
    let mut memory = MemBuffer::try_new(scratch).map_err(|_| failed("out of memory".into()))?;
    let stack = MemStack::new(&mut memory);
    amd::order(&mut order, &mut position, graph, amd::Control::default(), stack)
        .map_err(|e| failed(e.to_string()))?;
    Ok(order)
}

#[cfg(test)]
#[path = "../../../../tests/unit/nested_dissection.rs"]
mod tests;
