//! Blocks on a graded grid, with every face a named surface.
#![allow(dead_code)] // each user takes a part

use fem::TetMesh;

/// The block between the first and the last coordinates, six tetrahedra a cell. Its faces are `left`,
/// `right` (x), `front`, `back` (y), `bottom` and `top` (z).
pub(crate) fn block(grid: [&[f64]; 3]) -> TetMesh {
    let n = grid.map(<[f64]>::len);
    let at = |i: usize, j: usize, k: usize| (i + n[0] * (j + n[1] * k)) as u32;
    let mut mesh = TetMesh { regions: vec!["matrix".into()], ..TetMesh::default() };
    for k in 0..n[2] {
        for j in 0..n[1] {
            for i in 0..n[0] {
                mesh.nodes.push([grid[0][i], grid[1][j], grid[2][k]]);
            }
        }
    }
    for k in 0..n[2] - 1 {
        for j in 0..n[1] - 1 {
            for i in 0..n[0] - 1 {
                let corner = |c: usize| at(i + (c & 1), j + (c >> 1 & 1), k + (c >> 2));
                for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
                    mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
                    mesh.region_of.push(0);
                }
            }
        }
    }
    const NAMES: [[&str; 2]; 3] = [["left", "right"], ["front", "back"], ["bottom", "top"]];
    for face in mesh.boundary_faces() {
        let on =
            |axis: usize, value: f64| face.iter().all(|&v| mesh.nodes[v as usize][axis] == value);
        let name = (0..3).find_map(|axis| {
            let ends = [grid[axis][0], grid[axis][n[axis] - 1]];
            (0..2).find(|&end| on(axis, ends[end])).map(|end| NAMES[axis][end])
        });
        mesh.surfaces.entry(name.expect("a plane").into()).or_default().push(face);
    }
    mesh
}

/// n equal cells between two ends.
pub(crate) fn even(from: f64, to: f64, n: usize) -> Vec<f64> {
    (0..=n).map(|k| from + (to - from) * k as f64 / n as f64).collect()
}

/// `fine` cells of size `h` from zero, then cells that grow by `growth` until `to` is reached.
pub(crate) fn graded(h: f64, fine: usize, growth: f64, to: f64) -> Vec<f64> {
    let mut points: Vec<f64> = (0..=fine).map(|k| k as f64 * h).collect();
    let mut step = h;
    loop {
        step *= growth;
        let last = points[points.len() - 1];
        if last + 1.5 * step >= to {
            points.push(to);
            return points;
        }
        points.push(last + step);
    }
}
