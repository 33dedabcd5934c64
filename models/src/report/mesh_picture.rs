//! A cut-away picture of a labelled mesh, as SVG.

use std::collections::HashMap;
use std::fmt::Write;

use fem::TetMesh;

/// Where the viewer stands: azimuth and elevation in degrees.
const VIEW: (f64, f64) = (-52.0, 24.0);
/// Matrix whose centre lies in this sector about the axis is taken away, in degrees of azimuth.
const CUT: (f64, f64) = (-100.0, -4.0);

/// The mesh with a sector of the matrix cut out, so that the grains show: faces of the remaining
/// tets that are seen, far ones first.
pub fn mesh_picture(mesh: &TetMesh) -> String {
    let kept = (0..mesh.tets.len()).filter(|&t| grain(mesh, t) != 0 || !is_cut(centroid(mesh, t)));
    let mut faces: HashMap<[u32; 3], ([u32; 3], usize)> = HashMap::new();
    for t in kept {
        let [a, b, c, d] = mesh.tets[t];
        for face in [[a, c, b], [a, b, d], [b, c, d], [a, d, c]] {
            let mut key = face;
            key.sort_unstable();
            // a face that two kept tets share is inside
            if faces.remove(&key).is_none() {
                faces.insert(key, (face, t));
            }
        }
    }
    let camera = Camera::new();
    let mut seen: Vec<(f64, String)> =
        faces.into_values().filter_map(|(face, tet)| triangle(mesh, &camera, face, tet)).collect();
    // ties broken by the text, so that the picture does not depend on the hash map's order
    seen.sort_by(|a, b| a.0.total_cmp(&b.0).then_with(|| a.1.cmp(&b.1)));
    frame(mesh, &camera, &seen)
}

struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    towards: [f64; 3],
}

impl Camera {
    fn new() -> Self {
        let (azimuth, elevation) = (VIEW.0.to_radians(), VIEW.1.to_radians());
        let towards =
            [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        let right = [-azimuth.sin(), azimuth.cos(), 0.0];
        Self { right, up: cross(towards, right), towards }
    }

    fn project(&self, p: [f64; 3]) -> (f64, f64) {
        (dot(p, self.right), -dot(p, self.up))
    }
}

fn triangle(mesh: &TetMesh, camera: &Camera, face: [u32; 3], tet: usize) -> Option<(f64, String)> {
    let corners = face.map(|n| mesh.nodes[n as usize]);
    let [p, q, r] = corners;
    let normal = cross(sub(q, p), sub(r, p));
    let length = dot(normal, normal).sqrt();
    // the winding of a tet's faces is not relied upon: outward is away from its centre
    let middle = [0, 1, 2].map(|k| (p[k] + q[k] + r[k]) / 3.0);
    let outward = dot(normal, sub(middle, centroid(mesh, tet))).signum();
    let facing = outward * dot(normal, camera.towards) / length;
    if facing <= 0.0 {
        return None;
    }
    let light = outward * dot(normal, [0.25, -0.6, 0.76]) / length;
    let shade = 0.62 + 0.38 * light.max(0.0);
    let [red, green, blue] = base_colour(mesh, tet).map(|c| (c * shade) as u8);
    let mut path = String::new();
    for (i, corner) in corners.iter().enumerate() {
        let (x, y) = camera.project(*corner);
        let _ = write!(path, "{}{x:.3} {y:.3}", if i == 0 { "M" } else { "L" });
    }
    let colour = format!("#{red:02x}{green:02x}{blue:02x}");
    let svg = format!(r##"<path d="{path}Z" fill="{colour}" stroke="#00000030"/>"##);
    Some((dot(middle, camera.towards), svg))
}

/// The matrix is pale; every grain has a colour of its own.
fn base_colour(mesh: &TetMesh, tet: usize) -> [f64; 3] {
    const GRAINS: [[f64; 3]; 6] = [
        [230.0, 159.0, 60.0],
        [86.0, 160.0, 211.0],
        [90.0, 170.0, 120.0],
        [204.0, 121.0, 167.0],
        [214.0, 110.0, 80.0],
        [140.0, 130.0, 200.0],
    ];
    match grain(mesh, tet) {
        0 => [226.0, 222.0, 214.0],
        g => GRAINS[g as usize % GRAINS.len()],
    }
}

/// 0 in the matrix; without grain numbers the region stands for the grain.
fn grain(mesh: &TetMesh, tet: usize) -> u32 {
    mesh.grain_of.as_ref().map_or(u32::from(mesh.region_of[tet]), |g| g[tet])
}

fn frame(mesh: &TetMesh, camera: &Camera, seen: &[(f64, String)]) -> String {
    let (mut low, mut high) = ([f64::INFINITY; 2], [f64::NEG_INFINITY; 2]);
    for &node in &mesh.nodes {
        let (x, y) = camera.project(node);
        low = [low[0].min(x), low[1].min(y)];
        high = [high[0].max(x), high[1].max(y)];
    }
    let size = (high[0] - low[0]).max(high[1] - low[1]);
    let pad = 0.03 * size;
    let view = format!(
        "{:.3} {:.3} {:.3} {:.3}",
        low[0] - pad,
        low[1] - pad,
        high[0] - low[0] + 2.0 * pad,
        high[1] - low[1] + 2.0 * pad
    );
    let paths: String = seen.iter().map(|(_, svg)| svg.as_str()).collect();
    format!(
        r#"<svg xmlns="http://www.w3.org/2000/svg" viewBox="{view}" width="420" role="img" aria-label="mesh with a sector cut away"><g stroke-width="{:.4}" stroke-linejoin="round">{paths}</g></svg>"#,
        0.0016 * size
    )
}

fn is_cut(p: [f64; 3]) -> bool {
    let angle = p[1].atan2(p[0]).to_degrees();
    (CUT.0..CUT.1).contains(&angle)
}

fn centroid(mesh: &TetMesh, tet: usize) -> [f64; 3] {
    let corners = mesh.tets[tet].map(|n| mesh.nodes[n as usize]);
    [0, 1, 2].map(|k| corners.iter().map(|p| p[k]).sum::<f64>() / 4.0)
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
