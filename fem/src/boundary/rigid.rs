//! Rigid motions that a set of supports leaves free.

use nalgebra::{Matrix6, Vector3, Vector6};

/// The six infinitesimal rigid motions about the centre of a body. Rotations are scaled by the size of the body.
pub(super) struct RigidMotions {
    centre: Vector3<f64>,
    size: f64,
    /// Projector onto the space of the free motions, in the basis of the six rigid motions.
    free: Matrix6<f64>,
}

/// A support is ignored if it constrains the free motions less strongly than this value, see
/// [`stopped`](RigidMotions::stopped).
const LEAST_STOPPED: f64 = 1e-6;

impl RigidMotions {
    pub(super) fn new(nodes: &[[f64; 3]]) -> Self {
        let count = nodes.len().max(1) as f64;
        let centre = nodes.iter().map(|&x| Vector3::from(x)).sum::<Vector3<f64>>() / count;
        let size = nodes.iter().map(|&x| (Vector3::from(x) - centre).norm()).fold(1e-300, f64::max);
        Self { centre, size, free: Matrix6::identity() }
    }

    /// Returns the displacement of the point `x` along `direction` for each of the six motions.
    fn row(&self, x: [f64; 3], direction: [f64; 3]) -> Vector6<f64> {
        let arm = (Vector3::from(x) - self.centre) / self.size;
        let d = Vector3::from(direction);
        // a rotation ω moves the point at r along d by (ω × r) · d = ω · (r × d)
        let turn = arm.cross(&d);
        Vector6::new(d[0], d[1], d[2], turn[0], turn[1], turn[2])
    }

    /// Returns how strongly a support at `x` along `direction` would constrain the free motions: the norm of the
    /// displacements at `x` along `direction` that the free motions cause.
    fn stopped(&self, x: [f64; 3], direction: [f64; 3]) -> f64 {
        (self.free * self.row(x, direction)).norm()
    }

    /// Adds a support at `x` along `direction`.
    pub(super) fn add_support(&mut self, x: [f64; 3], direction: [f64; 3]) {
        let along = self.free * self.row(x, direction);
        if along.norm() > LEAST_STOPPED {
            self.free -= along * along.transpose() / along.norm_squared();
        }
    }

    /// Returns the number of free motions.
    pub(super) fn count(&self) -> usize {
        self.free.trace().round() as usize
    }

    /// Describes one of the free motions, e.g. "along x".
    pub(super) fn describe(&self) -> &'static str {
        const WORDS: [&str; 6] = [
            "along x",
            "along y",
            "along z",
            "about the x axis",
            "about the y axis",
            "about the z axis",
        ];
        (0..6)
            .max_by(|&a, &b| self.free[(a, a)].total_cmp(&self.free[(b, b)]))
            .map_or("", |k| WORDS[k])
    }

    /// Returns constraints (node, axis) that prevent the free motions. Each constraint is placed at the node and axis
    /// where it constrains the free motions most.
    pub(super) fn supports(mut self, nodes: &[[f64; 3]]) -> Vec<(u32, usize)> {
        let unit = |axis: usize| std::array::from_fn(|k| f64::from(k == axis));
        let mut supports = Vec::new();
        while self.count() > 0 {
            let mut best = (0.0, 0, 0);
            for (node, &x) in nodes.iter().enumerate() {
                for axis in 0..3 {
                    let stopped = self.stopped(x, unit(axis));
                    // require a clear gain, so that rounding errors do not decide between equal candidates
                    if stopped > best.0 * (1.0 + 1e-9) + LEAST_STOPPED {
                        best = (stopped, node, axis);
                    }
                }
            }
            if best.0 == 0.0 {
                break;
            }
            self.add_support(nodes[best.1], unit(best.2));
            supports.push((best.1 as u32, best.2));
        }
        supports
    }
}
