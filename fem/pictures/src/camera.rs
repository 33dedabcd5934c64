//! Camera of the pictures: an infinitely distant viewer, so that all rays are parallel.

/// Azimuth and elevation of the viewer in degrees.
const VIEW: (f64, f64) = (-52.0, 24.0);
/// Direction from the specimen to the light source (unit vector, rounded).
const LIGHT: [f64; 3] = [0.25, -0.6, 0.76];

/// Orthographic view of a specimen whose axis is z.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Camera {
    right: [f64; 3],
    up: [f64; 3],
    /// Unit vector from the specimen to the viewer.
    pub towards: [f64; 3],
}

impl Camera {
    pub(crate) fn new() -> Self {
        let (azimuth, elevation) = (VIEW.0.to_radians(), VIEW.1.to_radians());
        let towards =
            [elevation.cos() * azimuth.cos(), elevation.cos() * azimuth.sin(), elevation.sin()];
        let right = [-azimuth.sin(), azimuth.cos(), 0.0];
        Self { right, up: cross(towards, right), towards }
    }

    /// Horizontal unit vector towards the viewer (normal to the axis of the specimen).
    pub(crate) fn ahead(&self) -> [f64; 3] {
        let azimuth = VIEW.0.to_radians();
        [azimuth.cos(), azimuth.sin(), 0.0]
    }

    /// Projects a point to view coordinates: the distances to the right, downwards and towards the viewer.
    pub(crate) fn project(&self, p: [f64; 3]) -> [f64; 3] {
        [dot(p, self.right), -dot(p, self.up), dot(p, self.towards)]
    }

    /// Returns the point in space with the given view coordinates (to the right, downwards, towards the viewer).
    pub(crate) fn unproject(&self, [x, y, depth]: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|k| x * self.right[k] - y * self.up[k] + depth * self.towards[k])
    }
}

/// Returns the brightness of a surface with the outward unit normal `normal`, from 0.5 (unlit) to 1.
pub(crate) fn light(normal: [f64; 3]) -> f64 {
    0.5 + 0.5 * dot(normal, LIGHT).max(0.0)
}

pub(crate) fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

pub(crate) fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub(crate) fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unproject_is_the_inverse_of_project() {
        let camera = Camera::new();
        let p = [0.3, -1.2, 2.5];
        let back = camera.unproject(camera.project(p));
        assert!(sub(p, back).iter().all(|d| d.abs() < 1e-14), "{back:?}");
        // a point with larger z must be higher in the picture, and a nearer point must have a larger depth
        assert!(camera.project([0.0, 0.0, 1.0])[1] < 0.0);
        assert!(camera.project(camera.towards)[2] > 0.0);
    }
}
