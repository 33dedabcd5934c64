//! The graph of a mesh: pairs of nodes that share an element.

/// For each node the nodes of its elements, including itself, in increasing order (CSR format).
#[derive(Clone, Debug)]
pub struct Graph {
    pub start: Vec<u32>,
    pub near: Vec<u32>,
}

impl Graph {
    pub fn new<const N: usize>(tets: &[[u32; N]], nodes: usize) -> Self {
        let (first, of_node) = tets_of_nodes(tets, nodes);
        let mut start = Vec::with_capacity(nodes + 1);
        start.push(0);
        let mut near = Vec::new();
        let mut row: Vec<u32> = Vec::new();
        for node in 0..nodes {
            row.clear();
            for &tet in &of_node[first[node] as usize..first[node + 1] as usize] {
                row.extend(tets[tet as usize]);
            }
            row.sort_unstable();
            row.dedup();
            near.extend(&row);
            start.push(near.len() as u32);
        }
        Self { start, near }
    }

    pub fn nodes(&self) -> usize {
        self.start.len() - 1
    }

    pub fn of(&self, node: usize) -> &[u32] {
        &self.near[self.start[node] as usize..self.start[node + 1] as usize]
    }

    /// Position of the pair (node, other) in `near`.
    pub fn place(&self, node: usize, other: u32) -> usize {
        self.start[node] as usize + self.of(node).partition_point(|&m| m < other)
    }
}

/// The elements of each node in CSR format: (offsets by node, elements).
fn tets_of_nodes<const N: usize>(tets: &[[u32; N]], nodes: usize) -> (Vec<u32>, Vec<u32>) {
    let mut start = vec![0u32; nodes + 1];
    for &node in tets.iter().flatten() {
        start[node as usize + 1] += 1;
    }
    for node in 0..nodes {
        start[node + 1] += start[node];
    }
    let mut next = start.clone();
    let mut of_node = vec![0u32; N * tets.len()];
    for (tet, corners) in tets.iter().enumerate() {
        for &node in corners {
            of_node[next[node as usize] as usize] = tet as u32;
            next[node as usize] += 1;
        }
    }
    (start, of_node)
}
