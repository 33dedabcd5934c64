//! Local search for better positions of the nodes of flat tetrahedra.

use super::interface::Held;
use super::relocate::{Pull, Relocation, on_tangent};
use crate::mesh::vector::{Point, add, scale};

/// Lengths of the steps that are tried for a node, relative to the spacing.
const STEPS: [f64; 4] = [0.16, 0.08, 0.04, 0.02];
/// An interface node may change its distance from the interface by at most this value, relative to the spacing. Larger
/// changes would alter the volumes of grains.
const MAX_CHANGE: f64 = 0.005;

impl Relocation<'_> {
    /// Moves the nodes of each flat tetrahedron so that the smallest dihedral angle around each of these nodes
    /// increases. A tetrahedron is flat if its smallest dihedral angle is below the angle with the cosine `wanted`.
    /// Interface nodes move along the interface.
    pub(super) fn improve(&mut self, wanted: f64) {
        self.move_all(|this, node| this.better_position(node, wanted));
    }

    /// Returns a better position of a node, or `None` if the dihedral angles around the node are large enough or cannot
    /// be improved.
    fn better_position(&self, node: u32, wanted: f64) -> Option<Point> {
        let from = self.nodes[node as usize];
        let mut worst = self.worst_around(node, from, f64::INFINITY);
        if worst <= wanted {
            return None;
        }
        let held = self.interface.held[node as usize];
        let labels = self.interface.labels.of(node as usize);
        let off = self.residuals(labels, held, from);
        let stays = |there: Point| {
            let now = self.residuals(labels, held, there);
            let moved = off.iter().zip(now).map(|(before, now)| (now - before).abs());
            moved.fold(0.0, f64::max) <= MAX_CHANGE * self.how.spacing_mm
        };
        let mut here = from;
        for step in STEPS {
            for direction in directions() {
                let step = scale(direction, step * self.how.spacing_mm);
                let there = self.step_along(labels, held, here, step);
                let worst_there = self.worst_around(node, there, worst);
                if worst_there < worst - 1e-3 && stays(there) {
                    (here, worst) = (there, worst_there);
                }
            }
        }
        (here != from).then_some(here)
    }

    /// Moves a node by a step; an interface node is then moved back to its original distance from the interface.
    fn step_along(&self, labels: &[u32], held: Held, here: Point, step: Point) -> Point {
        let step = on_tangent(held, here, step);
        if labels.is_empty() {
            return self.hold(held, here, add(here, step));
        }
        let along = Pull::new(self, labels, held, here).along(step);
        let there = self.hold(held, here, add(here, along));
        let mut back = Pull::new(self, labels, held, there);
        back.towards(&self.residuals(labels, held, here));
        self.hold(held, here, add(there, back.to_surface(0.1 * self.how.spacing_mm)))
    }
}

/// Iterates over unit vectors along the axes and the diagonals of a cube.
fn directions() -> impl Iterator<Item = Point> {
    let corner = 1.0 / 3.0_f64.sqrt();
    let along = (0..6).map(|k| {
        let mut axis = [0.0; 3];
        axis[k / 2] = if k % 2 == 0 { 1.0 } else { -1.0 };
        axis
    });
    along.chain((0..8).map(move |k| {
        std::array::from_fn(|axis| if k >> axis & 1 == 0 { corner } else { -corner })
    }))
}
