//! Picture of a labelled mesh with a sector of the matrix removed.

use std::collections::HashMap;

use fem_mesh::TetMesh;

use crate::camera::{Camera, cross, dot, light, sub};
use crate::canvas::Canvas;
use crate::raster::{Raster, grain_colour, lit};

/// Sector about the axis, in degrees of azimuth. Matrix tetrahedra whose centroid is in the sector are not drawn.
const CUT: (f64, f64) = (-100.0, -4.0);
/// Longer side of the drawing in pixels. The final picture has half this size: each of its pixels is the mean of four
/// drawn pixels.
const SIDE: f64 = 1500.0;
const MATRIX: [f64; 3] = [226.0, 222.0, 214.0];

/// Draws the mesh without a sector of the matrix, so that the grains are visible. The colour of a mixed tetrahedron
/// depends on its grain fraction.
pub fn mesh_picture(mesh: &TetMesh) -> Raster {
    let camera = Camera::new();
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &node in &mesh.nodes {
        let [x, y, _] = camera.project(node);
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    }
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let (pad, scale) = (0.02 * size, SIDE / (1.04 * size));
    let side = |k: usize| ((high[k] - low[k] + 2.0 * pad) * scale).ceil().max(2.0) as usize;
    let mut canvas = Canvas::new(side(0), side(1));
    for (face, tet) in visible_faces(mesh) {
        let corners = face.map(|n| mesh.nodes[n as usize]);
        let Some(brightness) = brightness(mesh, &camera, corners, tet) else { continue };
        let placed = corners.map(|p| {
            let [x, y, depth] = camera.project(p);
            [(x - low[0] + pad) * scale, (y - low[1] + pad) * scale, depth * scale]
        });
        let colour = colour(mesh, tet);
        canvas.fill(placed, |_, on_edge| {
            Some(lit(colour, brightness * if on_edge { 0.72 } else { 1.0 }))
        });
    }
    canvas.picture()
}

/// Faces that belong to only one drawn tetrahedron, each with the index of the tetrahedron. The faces are sorted, so
/// that their order does not depend on the hash map.
fn visible_faces(mesh: &TetMesh) -> Vec<([u32; 3], usize)> {
    let drawn = (0..mesh.tets.len()).filter(|&t| grain(mesh, t) != 0 || !is_cut(centroid(mesh, t)));
    let mut faces: HashMap<[u32; 3], ([u32; 3], usize)> = HashMap::new();
    for t in drawn {
        let [a, b, c, d] = mesh.tets[t];
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            // a face that two drawn tetrahedra share is not visible
            if faces.remove(&key).is_none() {
                faces.insert(key, (face, t));
            }
        }
    }
    let mut faces: Vec<_> = faces.into_values().collect();
    faces.sort_unstable_by_key(|&(face, tet)| (tet, face));
    faces
}

/// Brightness of a face; `None` if the face is turned away from the viewer.
fn brightness(
    mesh: &TetMesh,
    camera: &Camera,
    [p, q, r]: [[f64; 3]; 3],
    tet: usize,
) -> Option<f64> {
    let normal = cross(sub(q, p), sub(r, p));
    let length = dot(normal, normal).sqrt();
    // the orientation of the faces may be wrong: use the direction away from the centroid of the tetrahedron as outward
    let middle = [0, 1, 2].map(|k| (p[k] + q[k] + r[k]) / 3.0);
    let outward = dot(normal, sub(middle, centroid(mesh, tet))).signum() / length;
    let normal = normal.map(|n| n * outward);
    (dot(normal, camera.towards) > 0.0).then(|| light(normal))
}

/// Returns the colour of a tetrahedron: a pale colour for the matrix, a colour per grain, and a blend of both for a
/// tetrahedron that contains matrix and grain.
fn colour(mesh: &TetMesh, tet: usize) -> [f64; 3] {
    let between = |f: f64| {
        let grains = grain_colour(0);
        [0, 1, 2].map(|k| MATRIX[k] + f * (grains[k] - MATRIX[k]))
    };
    match (grain(mesh, tet), &mesh.mixture) {
        (0, Some(mixture)) => between(f64::from(mixture[tet].fraction)),
        (0, None) => MATRIX,
        (g, _) => grain_colour(g),
    }
}

/// Returns the number of the grain that contains a tetrahedron, and 0 for the matrix. In a mesh without grain numbers,
/// returns the number of the tetrahedron's region.
fn grain(mesh: &TetMesh, tet: usize) -> u32 {
    mesh.grain_of.as_ref().map_or(u32::from(mesh.region_of[tet]), |g| g[tet])
}

fn is_cut(p: [f64; 3]) -> bool {
    let angle = p[1].atan2(p[0]).to_degrees();
    (CUT.0..CUT.1).contains(&angle)
}

fn centroid(mesh: &TetMesh, tet: usize) -> [f64; 3] {
    let corners = mesh.tets[tet].map(|n| mesh.nodes[n as usize]);
    [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_sector_of_the_matrix_is_removed_and_grains_remain() {
        let mut mesh =
            fem_mesh::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.0 }
                .build()
                .unwrap();
        let whole = mesh.boundary_faces().len();
        let opened = visible_faces(&mesh);
        assert!(opened.iter().all(|&(_, tet)| !is_cut(centroid(&mesh, tet))));
        mesh.grain_of = Some(vec![1; mesh.tets.len()]);
        assert_eq!(visible_faces(&mesh).len(), whole);
        let picture = mesh_picture(&mesh);
        assert!(picture.width() > 300 && picture.height() > 300);
        assert_eq!(picture, mesh_picture(&mesh), "the same every time");
    }
}
