//! Partition of a mesh, and communication between the ranks.

use std::collections::BTreeSet;

use super::{Part, RankLost, Ranks, bisect, guarded};
use crate::element::{DamageRule, Quadratic, Space};
use fem_mesh::CylinderLattice;

fn cylinder(spacing_mm: f64) -> (Space<10>, usize) {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm }.build().unwrap();
    (Space::new::<Quadratic>(&mesh, DamageRule::Absent), mesh.nodes.len())
}

fn parts_of(space: &Space<10>, parts: usize) -> Vec<u32> {
    let centre = |tet: &[u32; 10]| {
        [0, 1, 2].map(|k| tet[..4].iter().map(|&n| space.nodes[n as usize][k]).sum::<f64>() / 4.0)
    };
    bisect(&space.tets.iter().map(centre).collect::<Vec<_>>(), parts)
}

/// Calls `work` on every rank, each on a thread, and returns the results.
fn on_ranks<T: Send>(count: usize, work: impl Fn(Ranks) -> T + Sync) -> Vec<T> {
    std::thread::scope(|scope| {
        let threads: Vec<_> =
            Ranks::threads(count).into_iter().map(|ranks| scope.spawn(|| work(ranks))).collect();
        threads.into_iter().map(|thread| thread.join().unwrap()).collect()
    })
}

#[test]
fn parts_have_equal_sizes_and_few_ghosts() {
    let (space, vertices) = cylinder(0.35);
    for count in [2, 8] {
        let rank_of_tet = parts_of(&space, count);
        let sizes: Vec<usize> = (0..count as u32)
            .map(|part| rank_of_tet.iter().filter(|&&p| p == part).count())
            .collect();
        let (least, most) = (sizes.iter().min().unwrap(), sizes.iter().max().unwrap());
        assert!(most - least <= 1, "{sizes:?}");
        let nodes = [space.nodes.len(), vertices];
        let parts =
            on_ranks(count, |ranks| Part::new(&ranks, &rank_of_tet, |tet| &space.tets[tet], nodes));
        let owned: usize = parts.iter().map(|part| part.halo.own_of(&part.nodes).count()).sum();
        let local: usize = parts.iter().map(|part| part.nodes.len()).sum();
        assert_eq!(owned, space.nodes.len(), "each node belongs to one part");
        let ghosts = (local - owned) as f64 / owned as f64;
        // expected for cuts through a cylinder with seven cells per radius
        let most_ghosts = if count == 2 { 0.06 } else { 0.17 };
        println!("{count} parts: {owned} nodes, {:.2} % ghosts", 100.0 * ghosts);
        assert!(ghosts < most_ghosts, "{count} parts: {ghosts}");
    }
}

#[test]
fn points_with_equal_coordinates_are_distributed_too() {
    let part_of = bisect(&[[1.0, 2.0, 3.0]; 11], 4);
    let sizes: Vec<usize> =
        (0..4).map(|part| part_of.iter().filter(|&&p| p == part).count()).collect();
    assert_eq!((sizes.iter().min(), sizes.iter().max()), (Some(&2), Some(&3)));
    assert_eq!(bisect(&[], 3), Vec::<u32>::new());
}

/// Nodal sums over elements are complete on every rank that has the node, and ghosts get the values of their owners.
#[test]
fn sums_over_elements_and_nodes_do_not_depend_on_the_parts() {
    let (space, vertices) = cylinder(0.8);
    let nodes = space.nodes.len();
    // values are whole numbers, so that sums in any order are exact
    let of_tet = |tet: usize, a: usize| ((7 * tet + 3 * a) % 101) as f64;
    let mut whole = vec![0.0; nodes];
    for (tet, list) in space.tets.iter().enumerate() {
        (0..10).for_each(|a| whole[list[a] as usize] += of_tet(tet, a));
    }
    for count in 1..=5 {
        let rank_of_tet = parts_of(&space, count);
        let results = on_ranks(count, |ranks| {
            let part = Part::new(&ranks, &rank_of_tet, |tet| &space.tets[tet], [nodes, vertices]);
            if count == 1 {
                return whole.clone();
            }
            let local = space.part(&part);
            let mut values = vec![[0.0]; part.nodes.len()];
            for (&tet, list) in part.tets.iter().zip(&local.tets) {
                (0..10).for_each(|a| values[list[a] as usize][0] += of_tet(tet as usize, a));
            }
            part.halo.complete(&mut values);
            for (value, &node) in values.iter().zip(&part.nodes) {
                assert_eq!(value[0], whole[node as usize], "node {node}");
            }
            // the vertices come first, and `forward` does not change complete values
            let vertex = |&n: &u32| (n as usize) < vertices;
            assert!(part.nodes.iter().map(vertex).is_sorted_by(|a, b| a >= b));
            let before = values.clone();
            part.halo.forward(&mut values);
            assert_eq!(values, before);
            let mut sum = [part.halo.own_of(&values).map(|v| v[0]).sum()];
            ranks.sum(&mut sum);
            assert_eq!(sum[0], whole.iter().sum::<f64>());
            let picked = part.pick_tets(&space.region, 1);
            assert_eq!(part.gather_tets(&picked), space.region);
            part.gather_nodes(&values).into_iter().flatten().collect()
        });
        assert!(results.iter().all(|result| *result == whole), "{count} ranks");
    }
}

#[test]
fn decisions_and_texts_combine_all_ranks() {
    let results = on_ranks(3, |ranks| {
        let rank = ranks.rank();
        let mut largest = [rank as f64, -(rank as f64)];
        ranks.max(&mut largest);
        assert_eq!(largest, [2.0, 0.0]);
        assert!(ranks.any(rank == 1) && !ranks.any(false));
        assert_eq!(ranks.gather(&vec![rank as u32; rank]), [vec![], vec![1], vec![2, 2]]);
        assert_eq!(ranks.first_text(None).unwrap(), None);
        ranks.first_text((rank == 2).then_some("no file")).unwrap()
    });
    assert_eq!(results, vec![Some((2, "no file".to_owned())); 3]);
    assert_eq!(on_ranks(1, |ranks| ranks.size()), [1]);
}

#[test]
fn every_local_node_has_one_owner_among_the_ranks_that_have_it() {
    let (space, vertices) = cylinder(1.0);
    let rank_of_tet = parts_of(&space, 6);
    let nodes = [space.nodes.len(), vertices];
    let parts = on_ranks(6, |ranks| Part::new(&ranks, &rank_of_tet, |tet| &space.tets[tet], nodes));
    for (rank, part) in parts.iter().enumerate() {
        for neighbour in part.halo.neighbours() {
            let other = &parts[neighbour.rank];
            let back = other.halo.neighbours().iter().find(|n| n.rank == rank).unwrap();
            let in_mesh = |part: &Part, local_nodes: &[u32]| -> Vec<u32> {
                local_nodes.iter().map(|&p| part.nodes[p as usize]).collect()
            };
            assert_eq!(in_mesh(part, &neighbour.lent), in_mesh(other, &back.ghosts));
        }
        let ghosts = part.halo.neighbours().iter().flat_map(|n| n.ghosts.iter().copied());
        let ghosts: BTreeSet<u32> = ghosts.collect();
        let owned = (0..part.nodes.len() as u32).filter(|&n| part.halo.owns(n));
        assert_eq!(owned.count() + ghosts.len(), part.nodes.len());
    }
}

#[test]
fn a_rank_that_waits_for_an_ended_rank_gets_an_error() {
    let errors = on_ranks(3, |ranks| match ranks.rank() {
        1 => None,
        _ => Some(ranks.first_text(Some("here"))),
    });
    // rank 1 ends without sending a message
    assert_eq!(errors, [Some(Err(RankLost(1))), None, Some(Err(RankLost(1)))]);
    let guarded = on_ranks(2, |ranks| match ranks.rank() {
        1 => Ok(0.0),
        _ => guarded(|| {
            let mut sum = [1.0];
            ranks.sum(&mut sum);
            sum[0]
        }),
    });
    assert_eq!(guarded, [Err(RankLost(1)), Ok(0.0)]);
}
