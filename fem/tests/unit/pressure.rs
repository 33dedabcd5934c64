//! Load stiffness of a face, compared with differences of its forces.

use super::*;

fn moved(x: &[Vector3<f64>], node: usize, k: usize, by: f64) -> Vec<Vector3<f64>> {
    let mut x = x.to_vec();
    x[node][k] += by;
    x
}

#[test]
fn the_load_stiffness_is_the_derivative_of_the_forces() {
    let corners = [[0.0, 0.1, 0.2], [1.3, -0.1, 0.4], [0.3, 1.1, -0.2]].map(Vector3::from);
    let edges = [[0.7, 0.1, 0.35], [0.75, 0.55, 0.2], [0.1, 0.5, 0.1]].map(Vector3::from);
    for count in [3, 6] {
        let positions: Vec<_> = corners.into_iter().chain(edges).take(count).collect();
        let face = Face {
            nodes: (0..count as u32).collect(),
            positions: positions.clone(),
            pressure: [1.0, 1.5, 0.5, 2.0, -1.0, 0.3, 0.8],
        };
        let mut pairs = Vec::new();
        face.add_tangent(&positions, &mut pairs);
        assert_eq!(pairs.len(), count * count);
        let step = 1e-5;
        for (a, b, block) in pairs {
            for j in 0..3 {
                // the forces are quadratic in the positions: the central difference is exact
                let side = |by| face.forces(&moved(&positions, b as usize, j, by))[a as usize];
                let difference = (side(step) - side(-step)) / (2.0 * step);
                for i in 0..3 {
                    let error = (block[i][j] + difference[i]).abs();
                    assert!(error < 1e-9, "{count}: {a} {b} {i} {j}: {error}");
                }
            }
        }
        // a rigid translation does not change the forces
        let there: Vec<_> = positions.iter().map(|x| x + Vector3::new(1.0, 2.0, 3.0)).collect();
        for (a, b) in face.forces(&positions).iter().zip(face.forces(&there)) {
            assert!((a - b).norm() < 1e-12);
        }
    }
}

/// The resultant of a constant pressure is −p times the vector area, for straight faces of both orders.
#[test]
fn the_resultant_is_pressure_times_area() {
    let corners = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]].map(Vector3::from);
    let middle = |i: usize| 0.5 * (corners[i] + corners[(i + 1) % 3]);
    for count in [3, 6] {
        let positions: Vec<_> = corners.into_iter().chain((0..3).map(middle)).take(count).collect();
        let nodes = (0..count as u32).collect();
        let face = Face { nodes, positions, pressure: [3.0; 7] };
        let sum: Vector3<f64> = face.forces(&face.positions).iter().sum();
        assert!((sum - Vector3::new(0.0, 0.0, -3.0)).norm() < 1e-12, "{sum}");
    }
}
