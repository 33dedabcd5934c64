//! Fill of the factor with the order of nested dissection.

use super::*;
use fem_mesh::CylinderLattice;

/// Returns the number of entries of the factor of a matrix with this graph, by symbolic elimination on the graph.
fn fill(graph: &Graph, order: &[u32]) -> usize {
    let mut position = vec![0; order.len()];
    order.iter().enumerate().for_each(|(i, &n)| position[n as usize] = i);
    let mut later: Vec<std::collections::BTreeSet<usize>> = order
        .iter()
        .enumerate()
        .map(|(i, &n)| {
            let near = graph.neighbours(n as usize).iter().map(|&m| position[m as usize]);
            near.filter(|&j| j > i).collect()
        })
        .collect();
    let mut entries = 0;
    for i in 0..later.len() {
        let row = std::mem::take(&mut later[i]);
        entries += row.len() + 1;
        if let Some(&parent) = row.first() {
            later[parent].extend(row.into_iter().skip(1));
        }
    }
    entries
}

#[test]
fn the_order_is_a_permutation_with_less_fill_than_minimum_degree() {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.5 }
        .build()
        .expect("a mesh");
    let graph = Graph::new(&mesh.tets, mesh.nodes.len());
    let order = nested_dissection(&graph, &mesh.nodes).expect("an order");
    let mut sorted = order.clone();
    sorted.sort_unstable();
    assert!(sorted.into_iter().eq(0..mesh.nodes.len() as u32));
    let minimum_degree = amd_order(mesh.nodes.len(), &graph.start, &graph.near).expect("an order");
    let (ours, theirs) = (fill(&graph, &order), fill(&graph, &minimum_degree));
    assert!(ours < theirs, "{ours} entries, minimum degree {theirs}");
}

#[test]
fn a_path_graph_is_divided_in_the_middle() {
    let nodes = 300u32;
    let edges: Vec<[u32; 2]> = (1..nodes).map(|i| [i - 1, i]).collect();
    let graph = Graph::new(&edges, nodes as usize);
    let positions: Vec<_> = (0..nodes).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let order = nested_dissection(&graph, &positions).expect("an order");
    let last = order[nodes as usize - 1];
    assert!((100..200).contains(&last), "{last}");
    assert!(fill(&graph, &order) < 3 * nodes as usize);
}
