//! Graph of a mesh: pairs of nodes that share an element.

use fem_mesh::Groups;

/// Neighbours of each node in CSR format. The neighbours of a node are the nodes of its elements, including the node
/// itself, in increasing order.
#[derive(Clone, Debug)]
pub struct Graph {
    /// Offsets of the nodes into `near`; length number of nodes + 1.
    pub start: Vec<u32>,
    /// Neighbours of all nodes, node after node.
    pub near: Vec<u32>,
}

impl Graph {
    /// Finds the neighbours of `nodes` nodes from the nodes of each element.
    pub fn new<const N: usize>(tets: &[[u32; N]], nodes: usize) -> Self {
        let pairs = (0..).zip(tets).flat_map(|(tet, nodes)| nodes.map(|node| (node, tet)));
        let tets_of_nodes = Groups::new(nodes, pairs);
        let mut start = Vec::with_capacity(nodes + 1);
        start.push(0);
        let mut near = Vec::new();
        let mut row: Vec<u32> = Vec::new();
        for node in 0..nodes {
            row.clear();
            for &tet in tets_of_nodes.of(node) {
                row.extend(tets[tet as usize]);
            }
            row.sort_unstable();
            row.dedup();
            near.extend(&row);
            start.push(near.len() as u32);
        }
        Self { start, near }
    }

    /// Returns the number of nodes.
    pub fn nodes(&self) -> usize {
        self.start.len() - 1
    }

    /// Returns the nodes that share an element with `node`, including `node` itself, in increasing order.
    pub fn neighbours(&self, node: usize) -> &[u32] {
        &self.near[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// Returns the position of the pair (`node`, `other`) in `near`.
    pub fn position(&self, node: usize, other: u32) -> usize {
        self.start[node] as usize + self.neighbours(node).partition_point(|&m| m < other)
    }
}
