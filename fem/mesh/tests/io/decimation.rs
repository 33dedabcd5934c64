//! Decimation of surfaces: number of triangles, topology, volume, and no flipped triangle.

use std::f64::consts::PI;

use fem_mesh::{CylinderLattice, Surface, decimated, stl};

use super::surfaces::sphere;

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|k| a[k] - b[k])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|k| a[k] * b[k]).sum()
}

fn normal(surface: &Surface, triangle: [u32; 3]) -> ([f64; 3], [f64; 3]) {
    let [a, b, c] = triangle.map(|corner| surface.points[corner as usize]);
    let (u, v) = (sub(b, a), sub(c, a));
    let normal = [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
    (normal, std::array::from_fn(|k| (a[k] + b[k] + c[k]) / 3.0))
}

/// Asserts that a surface is closed, connected and without a handle.
fn assert_is_ball(surface: &Surface) {
    assert_eq!(surface.open_edges(), 0);
    assert_eq!(surface.parts().len(), 1);
    let edges = 3 * surface.triangles.len() / 2;
    assert_eq!(surface.points.len() + surface.triangles.len(), edges + 2, "Euler");
}

/// Decimation of a ball of 8192 triangles: the distance of the points from the sphere increases in inverse proportion
/// to the number of triangles.
#[test]
fn a_ball_stays_a_ball() {
    let (centre, radius) = ([3.2, -0.4, 7.1], 1.3);
    let fine = Surface::new(&sphere(centre, radius, 5));
    for (factor, tolerance) in [(4.0, 0.003), (20.0, 0.015), (100.0, 0.08), (1000.0, 0.3)] {
        let coarse = decimated(&fine, factor);
        let target = ((8192.0 / factor) as usize).max(20);
        assert!(
            coarse.triangles.len().abs_diff(target) <= 1,
            "{factor}: {}",
            coarse.triangles.len()
        );
        assert_is_ball(&coarse);
        assert!((coarse.volume() / fine.volume() - 1.0).abs() < 1e-9);
        assert!((coarse.volume() / (4.0 / 3.0 * PI * radius.powi(3)) - 1.0).abs() < 0.002);
        let moved = sub(coarse.centroid(), centre);
        assert!(dot(moved, moved).sqrt() < tolerance * radius, "{factor}: {moved:?}");
        for &triangle in &coarse.triangles {
            let (normal, middle) = normal(&coarse, triangle);
            let out = sub(middle, centre);
            let cosine = dot(normal, out) / (dot(normal, normal) * dot(out, out)).sqrt();
            assert!(cosine > 0.7, "{factor}: the normal of a triangle is rotated, cosine {cosine}");
        }
        let farthest = coarse.points.iter().map(|&p| {
            let out = sub(p, centre);
            (dot(out, out).sqrt() / radius - 1.0).abs()
        });
        let farthest = farthest.fold(0.0, f64::max);
        assert!(
            farthest < tolerance,
            "{factor}: relative distance of a point from the sphere: {farthest}"
        );
        assert_eq!(coarse, decimated(&fine, factor), "a second call gives a different surface");
    }
    for factor in [f64::NAN, 0.0, -3.0, 1.0] {
        assert_eq!(decimated(&fine, factor), fine);
    }
}

/// Collapses in flat regions and along straight edges have no error, so a box keeps its corners.
#[test]
fn a_box_keeps_its_edges() {
    let n = 12;
    let mut triangles = Vec::new();
    for axis in 0..3 {
        for side in [0, n] {
            for i in 0..n {
                for j in 0..n {
                    let at = |i: usize, j: usize| {
                        let mut p = [0.0; 3];
                        p[axis] = side as f64;
                        p[(axis + 1) % 3] = i as f64;
                        p[(axis + 2) % 3] = j as f64;
                        p
                    };
                    let quad = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    let [a, b, c, d] =
                        if side == 0 { [quad[0], quad[3], quad[2], quad[1]] } else { quad };
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
            }
        }
    }
    let fine = Surface::new(&triangles);
    assert_eq!((fine.open_edges(), fine.volume().round() as usize), (0, n * n * n));
    let coarse = decimated(&fine, 40.0);
    assert_is_ball(&coarse);
    assert!(coarse.triangles.len() <= fine.triangles.len() / 40 + 1, "{}", coarse.triangles.len());
    for corner in 0..8 {
        let corner = [0, 1, 2].map(|k| if corner >> k & 1 == 1 { n as f64 } else { 0.0 });
        let nearest = coarse.points.iter().map(|&p| dot(sub(p, corner), sub(p, corner)).sqrt());
        let nearest = nearest.fold(f64::INFINITY, f64::min);
        assert!(nearest < 0.02 * n as f64, "{corner:?}: {nearest}");
    }
}

/// A torus keeps its hole, two balls that share a point keep this point, and a surface with an open edge keeps the
/// edge.
#[test]
fn decimation_preserves_the_topology() {
    let (n, m) = (48, 24);
    let at = |i: usize, j: usize| {
        let (u, v) = (i % n, j % m);
        let (u, v) = (2.0 * PI * u as f64 / n as f64, 2.0 * PI * v as f64 / m as f64);
        let r = 2.0 + 0.7 * v.cos();
        [r * u.cos(), r * u.sin(), 0.7 * v.sin()]
    };
    let quads = (0..n).flat_map(|i| (0..m).map(move |j| (i, j)));
    let ring: Vec<_> = quads
        .flat_map(|(i, j)| {
            let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
            [[a, b, c], [a, c, d]]
        })
        .collect();
    let fine = Surface::new(&ring);
    let coarse = decimated(&fine, 8.0);
    assert_eq!(coarse.open_edges(), 0);
    let edges = 3 * coarse.triangles.len() / 2;
    assert_eq!(
        coarse.points.len() + coarse.triangles.len(),
        edges,
        "Euler characteristic of a torus"
    );
    assert!(coarse.triangles.len() < fine.triangles.len() / 7);

    let pair: Vec<_> =
        [-1.0, 1.0].into_iter().flat_map(|x| sphere([x, 0.0, 0.0], 1.0, 4)).collect();
    let fine = Surface::new(&pair);
    assert_eq!(fine.parts().len(), 1, "the two balls do not share a point");
    let coarse = decimated(&fine, 10.0);
    assert_eq!(coarse.open_edges(), 0);
    assert!(coarse.triangles.len() < fine.triangles.len() / 9);
    let shared = coarse.points.iter().filter(|p| dot(**p, **p) < 1e-6).count();
    assert_eq!((coarse.parts().len(), shared), (1, 1));

    let open = Surface::new(&sphere([0.0; 3], 1.0, 4)[64..]);
    assert!(open.open_edges() > 0);
    assert!(decimated(&open, 4.0).open_edges() > 0);
}

/// A cylinder from the lattice mesher, which has two kinds of triangles.
#[test]
fn a_cylinder_keeps_its_size() {
    let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.2 }.build().unwrap();
    let fine = Surface::new(&stl::specimen(&mesh));
    let coarse = decimated(&fine, 20.0);
    assert_is_ball(&coarse);
    for (axis, low, high) in [(0, -2.5, 2.5), (1, -2.5, 2.5), (2, 0.0, 4.4)] {
        let found = coarse.points.iter().map(|p| p[axis]);
        assert!((found.clone().fold(f64::INFINITY, f64::min) - low).abs() < 0.05);
        assert!((found.fold(f64::NEG_INFINITY, f64::max) - high).abs() < 0.05);
    }
}
