//! Shape functions: values at the nodes, and gradients compared with finite differences.

use super::*;

fn check<const N: usize, T: Tetrahedron<N>>() {
    let l = [0.17, 0.23, 0.41, 0.19];
    let step = 1e-6;
    let slopes = T::slopes(l);
    for k in 0..4 {
        let (mut forward, mut backward) = (l, l);
        forward[k] += step;
        backward[k] -= step;
        let (forward, backward) = (T::values(forward), T::values(backward));
        for a in 0..N {
            let difference = (forward[a] - backward[a]) / (2.0 * step);
            assert!((difference - slopes[a][k]).abs() < 1e-9, "node {a}, λ{k}");
        }
    }
    assert!((T::values(l).iter().sum::<f64>() - 1.0).abs() < 1e-15);
    for b in 0..N {
        let mut node = [0.0; 4];
        match b.checked_sub(4) {
            None => node[b] = 1.0,
            Some(edge) => T::EDGES[edge].iter().for_each(|&v| node[v] = 0.5),
        }
        for (a, value) in T::values(node).into_iter().enumerate() {
            assert_eq!(value, f64::from(a == b), "shape {a} at node {b}");
        }
    }
}

#[test]
fn shape_functions_are_nodal_and_their_gradients_are_derivatives() {
    check::<4, Linear>();
    check::<10, Quadratic>();
}
