//! Cavities: empty volumes that a mesh encloses.

use std::collections::HashMap;

use super::TetMesh;
use super::vector::{Point, add, cross, dot, mean, scale};
use fem_image::DisjointSets;

/// An empty volume enclosed by a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cavity {
    /// Volume of the cavity (mm³), computed with straight edges.
    pub volume_mm3: f64,
    /// Mean of the centres of the cavity's boundary faces (mm).
    pub centre_mm: [f64; 3],
}

impl TetMesh {
    /// Returns the cavities of a valid mesh, ordered by their first faces. A cavity is a set of boundary faces that are
    /// connected through edges and enclose a negative volume. The volume is negative because the normals of the faces
    /// point into the cavity.
    pub fn cavities(&self) -> Vec<Cavity> {
        let faces = self.boundary_faces();
        let mut connected = DisjointSets::new(faces.len());
        let mut first_face: HashMap<[u32; 2], u32> = HashMap::with_capacity(3 * faces.len() / 2);
        for (number, &[a, b, c]) in (0..).zip(&faces) {
            for [p, q] in [[a, b], [b, c], [c, a]] {
                let other = *first_face.entry([p.min(q), p.max(q)]).or_insert(number);
                connected.join(other, number);
            }
        }
        let mut shells: Vec<(f64, Point, usize)> = Vec::new();
        let mut shell_of_part: HashMap<u32, usize> = HashMap::new();
        for (number, face) in (0..).zip(&faces) {
            let corners = face.map(|node| self.nodes[node as usize]);
            let shell = *shell_of_part.entry(connected.root(number)).or_insert_with(|| {
                shells.push((0.0, [0.0; 3], 0));
                shells.len() - 1
            });
            let (volume, sum, count) = &mut shells[shell];
            *volume += dot(corners[0], cross(corners[1], corners[2])) / 6.0;
            *sum = add(*sum, mean(corners.into_iter()));
            *count += 1;
        }
        let cavity = |(volume, sum, count): (f64, Point, usize)| {
            let centre_mm = scale(sum, 1.0 / count as f64);
            (volume < 0.0).then_some(Cavity { volume_mm3: -volume, centre_mm })
        };
        shells.into_iter().filter_map(cavity).collect()
    }
}
