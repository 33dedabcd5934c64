//! Assembled tangent: 4 × 4 blocks of node pairs, and the positions of the element blocks.

use std::sync::Arc;

use rayon::prelude::*;

use super::graph::Graph;
use super::increment::PairBlock;
use super::layout::LANES;

/// 4 × 4 block of nodes a and b: rows u_x, u_y, u_z, φ of a, columns u_x, u_y, u_z, φ of b.
pub(super) type Block = [[f64; 4]; 4];

/// Sparsity pattern of the tangent of a mesh, with the position of every element block.
#[derive(Clone, Debug)]
pub struct Pattern {
    pub graph: Graph,
    /// Positions of the N × N blocks of each element in the tangent, element after element, row by row.
    positions: Vec<u32>,
}

impl Pattern {
    /// Finds the pattern of a mesh. An element couples all its nodes.
    pub fn new<const N: usize>(tets: &[[u32; N]], nodes: usize) -> Self {
        let graph = Graph::new(tets, nodes);
        let positions = tets
            .iter()
            .flat_map(|tet| {
                let graph = &graph;
                tet.iter().flat_map(move |&a| {
                    tet.iter().map(move |&b| graph.position(a as usize, b) as u32)
                })
            })
            .collect();
        Self { graph, positions }
    }
}

/// Assembled tangent, with one block row per node. Both triangles are stored.
///
/// Prescribed values have rows and columns too; a solver excludes these rows and columns by a mask.
#[derive(Clone, Debug)]
pub struct Tangent {
    pub pattern: Arc<Pattern>,
    /// Blocks of the node pairs, in the order of `pattern.graph.near`.
    pub blocks: Vec<Block>,
    /// Whether block (b, a) is the transpose of block (a, b) for all node pairs. False with friction, and with laws
    /// whose equilibrium does not make an energy stationary.
    pub symmetric: bool,
}

impl Tangent {
    /// Creates a zero tangent.
    pub fn new(pattern: Arc<Pattern>) -> Self {
        let blocks = vec![[[0.0; 4]; 4]; pattern.graph.near.len()];
        Self { pattern, blocks, symmetric: true }
    }

    pub fn clear(&mut self) {
        self.blocks.fill([[0.0; 4]; 4]);
        self.symmetric = true;
    }

    /// Adds the matrices of consecutive elements. If `unsymmetric` is false, only the blocks (a, b ≤ a) of an element
    /// are read.
    ///
    /// Each thread owns a range of the blocks of the tangent and adds in the order of the elements, so that
    /// the sums do not depend on the number of threads.
    pub fn add_elements<const N: usize>(
        &mut self,
        first: usize,
        elements: &[[[Block; N]; N]],
        unsymmetric: bool,
    ) {
        self.symmetric &= !unsymmetric;
        let positions = &self.pattern.positions[first * N * N..(first + elements.len()) * N * N];
        if elements.len() <= LANES {
            return add_in_range(&mut self.blocks, 0, positions, elements, unsymmetric);
        }
        let low = positions.iter().copied().min().unwrap_or(0) as usize;
        let high = positions.iter().copied().max().map_or(0, |p| p as usize + 1);
        let range = (high - low).div_ceil(rayon::current_num_threads()).max(1);
        self.blocks[low..high].par_chunks_mut(range).enumerate().for_each(|(part, blocks)| {
            add_in_range(blocks, low + part * range, positions, elements, unsymmetric);
        });
    }

    /// Adds a block to the displacement part of the diagonal block of a node.
    pub fn add_node(&mut self, node: u32, block: &[[f64; 3]; 3]) {
        let position = self.pattern.graph.position(node as usize, node);
        self.symmetric &= (0..3).all(|i| (0..i).all(|j| block[i][j] == block[j][i]));
        for i in 0..3 {
            for j in 0..3 {
                self.blocks[position][i][j] += block[i][j];
            }
        }
    }

    /// Adds a block to the displacement part of the block of two nodes of a common element. The tangent then counts as
    /// unsymmetric.
    pub fn add_pair(&mut self, (row, column, block): &PairBlock) {
        let position = self.pattern.graph.position(*row as usize, *column);
        self.symmetric = false;
        for i in 0..3 {
            for j in 0..3 {
                self.blocks[position][i][j] += block[i][j];
            }
        }
    }

    /// Computes y = A x for nodal values u_x, u_y, u_z, φ.
    pub fn multiply(&self, x: &[[f64; 4]], y: &mut [[f64; 4]]) {
        const ROWS: usize = 1024;
        let graph = &self.pattern.graph;
        y.par_chunks_mut(ROWS).enumerate().for_each(|(chunk, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let row = chunk * ROWS + i;
                let range = graph.start[row] as usize..graph.start[row + 1] as usize;
                let mut sum = [0.0; 4];
                for (block, &column) in self.blocks[range].iter().zip(graph.neighbours(row)) {
                    let x = &x[column as usize];
                    for i in 0..4 {
                        let row = &block[i];
                        sum[i] += row[0] * x[0] + row[1] * x[1] + row[2] * x[2] + row[3] * x[3];
                    }
                }
                *y = sum;
            }
        });
    }

    /// Returns the diagonal, four values per node.
    pub fn diagonal(&self) -> Vec<[f64; 4]> {
        let graph = &self.pattern.graph;
        (0..graph.nodes())
            .map(|node| {
                let block = &self.blocks[graph.position(node, node as u32)];
                std::array::from_fn(|k| block[k][k])
            })
            .collect()
    }
}

/// Adds the element blocks whose position is in the range of `blocks`; the first entry of `blocks` has the position
/// `from`.
fn add_in_range<const N: usize>(
    blocks: &mut [Block],
    from: usize,
    positions: &[u32],
    elements: &[[[Block; N]; N]],
    unsymmetric: bool,
) {
    for (element, positions) in elements.iter().zip(positions.chunks_exact(N * N)) {
        for a in 0..N {
            for b in 0..=a {
                let block = &element[a][b];
                let index = |position: u32| (position as usize).wrapping_sub(from);
                if let Some(to) = blocks.get_mut(index(positions[a * N + b])) {
                    add(to, block);
                }
                if a == b {
                    continue;
                }
                if let Some(to) = blocks.get_mut(index(positions[b * N + a])) {
                    if unsymmetric {
                        add(to, &element[b][a]);
                        continue;
                    }
                    for i in 0..4 {
                        for j in 0..4 {
                            to[i][j] += block[j][i];
                        }
                    }
                }
            }
        }
    }
}

fn add(to: &mut Block, block: &Block) {
    for i in 0..4 {
        for j in 0..4 {
            to[i][j] += block[i][j];
        }
    }
}
