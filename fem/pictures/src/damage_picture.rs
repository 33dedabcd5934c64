//! Picture of damage in a specimen that is cut along its axis.

use std::collections::HashMap;

use crate::camera::{Camera, cross, dot, light, sub};
use crate::canvas::Canvas;
use crate::raster::{Raster, lit};

/// Longer side of the drawing in pixels. The final picture has half this size: each of its pixels is the mean of four
/// drawn pixels.
const SIDE: f64 = 1100.0;
/// Margin around the undeformed specimen, as a fraction of its size, so that a bulging specimen fits into the picture.
const PAD: f64 = 0.06;
/// Colours of damage from 0 to 1, evenly spaced.
const RAMP: [[u8; 3]; 5] =
    [[236, 232, 222], [246, 200, 96], [226, 112, 58], [160, 30, 52], [52, 12, 40]];
/// Colours of damage from 0 to 1, evenly spaced, in the syntax of style sheets.
pub const LEGEND: [&str; 5] =
    ["rgb(236,232,222)", "rgb(246,200,96)", "rgb(226,112,58)", "rgb(160,30,52)", "rgb(52,12,40)"];
const GRAIN: [f64; 3] = [140.0, 148.0, 160.0];

/// Mesh of linear tetrahedra with displacement and damage.
#[derive(Clone, Copy, Debug)]
pub struct DamagedBody<'a> {
    /// Positions of the nodes before loading, mm.
    pub nodes: &'a [[f64; 3]],
    /// Corners of the tetrahedra.
    pub tets: &'a [[u32; 4]],
    /// Volume fraction of grain in each tetrahedron, from 0 to 1.
    pub grain: &'a [f64],
    /// Displacement of each node, mm.
    pub displacement: &'a [[f64; 3]],
    /// Damage of each node, from 0 to 1.
    pub damage: &'a [f64],
}

/// Draws the half of the body behind a vertical plane through its axis; the viewer looks at the section.
///
/// The displacements are not magnified. All states of a body have the same scale.
pub fn damage_picture(body: &DamagedBody<'_>) -> Raster {
    let camera = Camera::new();
    let plane = Plane::through_axis(body.nodes, camera.ahead());
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &node in body.nodes.iter().filter(|node| plane.ahead(**node) <= 0.0) {
        let [x, y, _] = camera.project(node);
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    }
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let (pad, scale) = (PAD * size, SIDE / ((1.0 + 2.0 * PAD) * size));
    let side = |k: usize| ((high[k] - low[k] + 2.0 * pad) * scale).ceil().max(2.0) as usize;
    let mut canvas = Canvas::new(side(0), side(1));
    let to_pixels = |p: [f64; 3]| {
        let [x, y, depth] = camera.project(p);
        [(x - low[0] + pad) * scale, (y - low[1] + pad) * scale, depth * scale]
    };
    for (face, tet) in body.surface() {
        let corners = face.map(|n| Corner::at_node(body, &plane, n as usize));
        let corner_positions = corners.map(|c| c.position);
        let Some(brightness) = brightness(&camera, corner_positions, body.centre(tet)) else {
            continue;
        };
        canvas.fill(corners.map(|c| to_pixels(c.position)), |weights, _| {
            let mix =
                |value: fn(&Corner) -> f64| (0..3).map(|k| weights[k] * value(&corners[k])).sum();
            let (ahead, damage): (f64, f64) = (mix(|c| c.ahead), mix(|c| c.damage));
            (ahead <= 0.0).then(|| lit(colour(damage, body.grain[tet]), brightness))
        });
    }
    let brightness = light(camera.ahead());
    for (triangle, tet) in body.section(&plane) {
        canvas.fill(triangle.map(|c| to_pixels(c.position)), |weights, _| {
            let damage = (0..3).map(|k| weights[k] * triangle[k].damage).sum();
            Some(lit(colour(damage, body.grain[tet]), brightness))
        });
    }
    canvas.picture()
}

/// A vertical plane.
struct Plane {
    centre: [f64; 3],
    normal: [f64; 3],
}

impl Plane {
    /// Creates the vertical plane with this normal through the centre of the bounding box of the nodes.
    fn through_axis(nodes: &[[f64; 3]], normal: [f64; 3]) -> Self {
        let middle = |k: usize| {
            let low = nodes.iter().map(|x| x[k]).fold(f64::INFINITY, f64::min);
            let high = nodes.iter().map(|x| x[k]).fold(f64::NEG_INFINITY, f64::max);
            0.5 * (low + high)
        };
        Self { centre: [middle(0), middle(1), 0.0], normal }
    }

    /// Signed distance of a point from the plane, positive towards the viewer.
    fn ahead(&self, point: [f64; 3]) -> f64 {
        dot(sub(point, self.centre), self.normal)
    }
}

/// A corner of a triangle that is drawn: a triangle on the surface or on the section of the body.
#[derive(Clone, Copy)]
struct Corner {
    /// Displaced position, mm.
    position: [f64; 3],
    /// Signed distance from the plane before loading, mm; positive towards the viewer.
    ahead: f64,
    damage: f64,
}

impl Corner {
    fn at_node(body: &DamagedBody<'_>, plane: &Plane, node: usize) -> Self {
        let (x, u) = (body.nodes[node], body.displacement[node]);
        let position = [0, 1, 2].map(|k| x[k] + u[k]);
        Self { position, ahead: plane.ahead(x), damage: body.damage[node] }
    }

    /// Returns the intersection of the plane with the edge from this corner to another corner.
    fn on_plane(&self, other: &Corner) -> Self {
        let t = self.ahead / (self.ahead - other.ahead);
        let mix = |a: f64, b: f64| a + t * (b - a);
        Self {
            position: [0, 1, 2].map(|k| mix(self.position[k], other.position[k])),
            ahead: 0.0,
            damage: mix(self.damage, other.damage),
        }
    }
}

impl DamagedBody<'_> {
    /// Faces that belong to only one tetrahedron, each with the index of the tetrahedron. The faces are sorted, so that
    /// their order does not depend on the hash map.
    fn surface(&self) -> Vec<([u32; 3], usize)> {
        let mut faces: HashMap<[u32; 3], ([u32; 3], usize)> = HashMap::new();
        for (tet, &[a, b, c, d]) in self.tets.iter().enumerate() {
            for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
                let mut key = face;
                key.sort_unstable();
                if faces.remove(&key).is_none() {
                    faces.insert(key, (face, tet));
                }
            }
        }
        let mut faces: Vec<_> = faces.into_values().collect();
        faces.sort_unstable_by_key(|&(face, tet)| (tet, face));
        faces
    }

    /// Returns triangles that fill the section of the body by the plane, each with the index of its tetrahedron.
    fn section(&self, plane: &Plane) -> Vec<([Corner; 3], usize)> {
        let mut triangles = Vec::new();
        for (tet, nodes) in self.tets.iter().enumerate() {
            let corners = nodes.map(|n| Corner::at_node(self, plane, n as usize));
            let (before, behind): (Vec<&Corner>, Vec<&Corner>) =
                corners.iter().partition(|c| c.ahead > 0.0);
            let meet = |i: usize, j: usize| before[i].on_plane(behind[j]);
            match (before.len(), behind.len()) {
                (1, 3) => triangles.push(([meet(0, 0), meet(0, 1), meet(0, 2)], tet)),
                (3, 1) => triangles.push(([meet(0, 0), meet(1, 0), meet(2, 0)], tet)),
                (2, 2) => {
                    let around = [meet(0, 0), meet(0, 1), meet(1, 1), meet(1, 0)];
                    triangles.push(([around[0], around[1], around[2]], tet));
                    triangles.push(([around[0], around[2], around[3]], tet));
                }
                _ => {}
            }
        }
        triangles
    }

    fn centre(&self, tet: usize) -> [f64; 3] {
        let corner =
            |n: u32, k: usize| (self.nodes[n as usize][k] + self.displacement[n as usize][k]) / 4.0;
        [0, 1, 2].map(|k| self.tets[tet].iter().map(|&n| corner(n, k)).sum())
    }
}

/// Brightness of a face; `None` if the face is turned away from the viewer. The outward normal points away from
/// `centre`, the centroid of the tetrahedron.
fn brightness(camera: &Camera, [p, q, r]: [[f64; 3]; 3], centre: [f64; 3]) -> Option<f64> {
    let normal = cross(sub(q, p), sub(r, p));
    let length = dot(normal, normal).sqrt();
    let outward = dot(normal, sub(p, centre)).signum() / length;
    let normal = normal.map(|n| n * outward);
    (dot(normal, camera.towards) > 0.0).then(|| light(normal))
}

/// Returns the colour for a damage from 0 to 1 and a grain fraction from 0 to 1. Undamaged grains are grey; damage
/// changes the colour of a grain to the colour of the damaged matrix.
fn colour(damage: f64, grain: f64) -> [f64; 3] {
    let damage = damage.clamp(0.0, 1.0);
    let position = damage * (RAMP.len() - 1) as f64;
    let below = (position as usize).min(RAMP.len() - 2);
    let (a, b, t) = (RAMP[below], RAMP[below + 1], position - below as f64);
    let whole = grain * (1.0 - damage);
    [0, 1, 2].map(|k| {
        let matrix = f64::from(a[k]) + t * (f64::from(b[k]) - f64::from(a[k]));
        matrix + whole * (GRAIN[k] - matrix)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn mesh() -> fem_mesh::TetMesh {
        fem_mesh::CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 0.8 }
            .build()
            .unwrap()
    }

    #[test]
    fn the_section_of_a_cylinder_has_its_area_at_any_position() {
        for shift in [0.0, 7.0] {
            let mut mesh = mesh();
            mesh.nodes.iter_mut().for_each(|x| x[0] += shift);
            let n = mesh.nodes.len();
            let body = DamagedBody {
                nodes: &mesh.nodes,
                tets: &mesh.tets,
                grain: &vec![0.0; mesh.tets.len()],
                displacement: &vec![[0.0, 0.0, 1.0]; n],
                damage: &vec![0.0; n],
            };
            let plane = Plane::through_axis(body.nodes, Camera::new().ahead());
            let area: f64 = body
                .section(&plane)
                .iter()
                .map(|([a, b, c], _)| {
                    let normal = cross(sub(b.position, a.position), sub(c.position, a.position));
                    0.5 * dot(normal, normal).sqrt()
                })
                .sum();
            // the wall of the mesh is a polygon, so that the area is slightly less than 2 R H
            assert!((0.97 * 22.0..22.0 + 1e-9).contains(&area), "{area}");
        }
    }

    #[test]
    fn damaged_matrix_is_dark_and_grains_are_grey() {
        let mesh = mesh();
        let n = mesh.nodes.len();
        // the body is fully damaged above mid-height
        let damage: Vec<f64> = mesh.nodes.iter().map(|x| f64::from(u8::from(x[2] > 2.2))).collect();
        let body = DamagedBody {
            nodes: &mesh.nodes,
            tets: &mesh.tets,
            grain: &vec![0.0; mesh.tets.len()],
            displacement: &vec![[0.0; 3]; n],
            damage: &damage,
        };
        let picture = damage_picture(&body);
        let (column, rows) = (picture.width() / 2, picture.height());
        let brightness = |row: usize| picture.at(column, row).map(u32::from).iter().sum::<u32>();
        assert!(brightness(rows / 3) < brightness(rows * 3 / 4), "dark above, pale below");
        let grains = DamagedBody { grain: &vec![1.0; mesh.tets.len()], ..body };
        let seen = damage_picture(&grains).at(column, rows * 3 / 4);
        assert_eq!(seen, lit(GRAIN, light(Camera::new().ahead())));
        assert_eq!(picture, damage_picture(&body), "the same every time");
    }

    #[test]
    fn the_legend_has_the_colours_of_the_picture() {
        for (i, (text, [r, g, b])) in LEGEND.iter().zip(RAMP).enumerate() {
            assert_eq!(*text, format!("rgb({r},{g},{b})"));
            assert_eq!(colour(i as f64 / 4.0, 0.0), [r, g, b].map(f64::from));
        }
        assert_eq!(colour(0.0, 1.0), GRAIN);
        assert_eq!(colour(7.0, 1.0), colour(1.0, 0.0), "a broken grain is damaged as matrix is");
    }
}
