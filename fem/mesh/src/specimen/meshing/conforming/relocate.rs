//! Movement of nodes: interface nodes move onto the zero set of the signed distances, and surrounding nodes move
//! towards the mean of their neighbours.

use nalgebra::{Matrix3, Vector3};
use rayon::prelude::*;

use super::Conforming;
use super::guard::{cosine, worst_cosine};
use super::interface::{Held, Interface};
use crate::mesh::TetMesh;
use crate::mesh::vector::{Point, add, dot, norm, scale, sub};
use crate::specimen::meshing::adjacency::Adjacency;

/// Step of an interface node along the interface, relative to the distance of the node from the mean of its neighbours.
const SLIDE: f64 = 0.4;
/// Tikhonov damping of the normal equations for the step of a node. With damping, nearly parallel gradients count as
/// one direction.
const DAMPING: f64 = 0.02;
/// Largest length of a step of a node, relative to the spacing.
const FARTHEST: f64 = 0.35;
/// Step of the finite differences that give the gradients of signed distances, relative to the spacing.
const STEP: f64 = 0.02;
/// Smallest dihedral angle that the movement of a node that is not on an interface may cause (degrees).
const FREE_DEG: f64 = 32.0;
/// Minimum number of nodes per parallel task.
const GRAIN: usize = 64;

/// State of the movement of the nodes: the mesh, and the offsets of the grain surfaces.
pub(super) struct Relocation<'a> {
    pub(super) how: &'a Conforming<'a>,
    pub(super) mesh: &'a TetMesh,
    pub(super) around: &'a Adjacency<'a>,
    pub(super) interface: &'a Interface,
    pub(super) nodes: Vec<Point>,
    /// Offset of each grain's surface (mm). The interface of grain k in the mesh consists of points whose signed
    /// distance to the grain is `offsets[k - 1]`.
    pub(super) offsets: Vec<f64>,
    /// Offset (mm) and volume (mm³) of each grain before the previous correction.
    pub(super) earlier: Vec<Option<(f64, f64)>>,
}

impl<'a> Relocation<'a> {
    pub(super) fn new(
        how: &'a Conforming<'a>,
        mesh: &'a TetMesh,
        around: &'a Adjacency<'a>,
        interface: &'a Interface,
    ) -> Self {
        let grains = how.field.grains();
        let nodes = mesh.nodes.clone();
        let (offsets, earlier) = (vec![0.0; grains], vec![None; grains]);
        Relocation { how, mesh, around, interface, nodes, offsets, earlier }
    }

    /// Moves every movable node once. No dihedral angle falls below the angle with the cosine `limit`; an angle that is
    /// already smaller does not decrease.
    pub(super) fn sweep(&mut self, limit: f64) {
        let free = cosine(FREE_DEG);
        self.move_all(|this, node| match this.interface.ring[node as usize] {
            0 => this.towards_interface(node, limit),
            _ => this.towards_mean(node, free),
        });
    }

    /// Moves the nodes group by group, and in parallel within a group: nodes of one group share no tetrahedron.
    pub(super) fn move_all(&mut self, to: impl Fn(&Self, u32) -> Option<Point> + Sync) {
        for group in &self.interface.groups {
            let moved: Vec<Option<Point>> =
                group.par_iter().with_min_len(GRAIN).map(|&node| to(self, node)).collect();
            for (&node, moved) in group.iter().zip(moved) {
                if let Some(point) = moved {
                    self.nodes[node as usize] = point;
                }
            }
        }
    }

    /// Returns the largest [`worst_cosine`] of the tetrahedra around a node that is moved to `at`; stops as soon as the
    /// value exceeds `limit`.
    pub(super) fn worst_around(&self, node: u32, at: Point, limit: f64) -> f64 {
        let mut worst = -1.0_f64;
        for &tet in self.around.tets_of(node as usize) {
            let corners = self.mesh.tets[tet as usize]
                .map(|corner| if corner == node { at } else { self.nodes[corner as usize] });
            worst = worst.max(worst_cosine(corners));
            if worst > limit {
                return worst;
            }
        }
        worst
    }

    /// Returns the new position of an interface node, or `None` if the node does not move.
    fn towards_interface(&self, node: u32, limit: f64) -> Option<Point> {
        let here = self.nodes[node as usize];
        let held = self.interface.held[node as usize];
        let pull = Pull::new(self, self.interface.labels.of(node as usize), held, here);
        let to_surface = pull.to_surface(FARTHEST * self.how.spacing_mm);
        let neighbours = self.interface.neighbours.of(node as usize);
        let along = match neighbours.is_empty() {
            true => [0.0; 3],
            false => {
                let positions = neighbours.iter().map(|&other| self.nodes[other as usize]);
                let mean = scale(positions.fold([0.0; 3], add), 1.0 / neighbours.len() as f64);
                scale(pull.along(sub(mean, here)), SLIDE)
            }
        };
        let both = add(to_surface, along);
        if norm(both) < 1e-4 * self.how.spacing_mm {
            return None;
        }
        let steps = [
            (both, 1.0),
            (to_surface, 1.0),
            (both, 0.5),
            (to_surface, 0.5),
            (to_surface, 0.25),
            (along, 0.5),
            (to_surface, 0.1),
        ];
        self.first_within(node, limit, &steps)
    }

    /// Returns the position of the node after the first acceptable step. `steps` contains pairs of a step and the
    /// factor by which the step is multiplied. A step is acceptable if no [`worst_cosine`] around the node exceeds
    /// `limit` afterwards. If no step is acceptable and a cosine exceeds `limit` before the step, a step that does not
    /// increase the largest cosine is also acceptable.
    fn first_within(&self, node: u32, limit: f64, steps: &[(Point, f64)]) -> Option<Point> {
        let here = self.nodes[node as usize];
        let held = self.interface.held[node as usize];
        let first = |limit: f64| {
            steps.iter().find_map(|&(step, part)| {
                let there = self.hold(held, here, add(here, scale(step, part)));
                (self.worst_around(node, there, limit) <= limit).then_some(there)
            })
        };
        first(limit).or_else(|| {
            let worst = self.worst_around(node, here, f64::INFINITY);
            if worst > limit { first(worst) } else { None }
        })
    }

    /// Returns the new position of a node that is not on an interface. The new position is closer to the mean of the
    /// neighbours; `None` if the node does not move.
    fn towards_mean(&self, node: u32, good: f64) -> Option<Point> {
        let here = self.nodes[node as usize];
        let held = self.interface.held[node as usize];
        let (mut sum, mut count) = ([0.0; 3], 0.0);
        for &tet in self.around.tets_of(node as usize) {
            for &other in self.mesh.tets[tet as usize].iter().filter(|&&other| other != node) {
                sum = add(sum, self.nodes[other as usize]);
                count += 1.0;
            }
        }
        let step = on_tangent(held, here, sub(scale(sum, 1.0 / count), here));
        if norm(step) < 1e-3 * self.how.spacing_mm {
            return None;
        }
        self.first_within(node, good, &[(step, 1.0), (step, 0.5), (step, 0.2)])
    }

    /// Projects a point onto the wall or the end plane on which the node must stay.
    pub(super) fn hold(&self, held: Held, from: Point, point: Point) -> Point {
        let [mut x, mut y, mut z] = point;
        if held.wall {
            let stretch = self.how.wall.radius_at(x, y) / x.hypot(y);
            (x, y) = (x * stretch, y * stretch);
        }
        if held.corner {
            (x, y) = (from[0], from[1]);
        }
        if held.end {
            z = from[2];
        }
        [x, y, z]
    }

    /// Returns the residuals of a point (mm): its distances from the surfaces on which the labels meet. The result is
    /// empty if there are no labels.
    pub(super) fn residuals(&self, labels: &[u32], held: Held, point: Point) -> Vec<f64> {
        Pull::new(self, labels, held, point).residuals
    }
}

/// Projects a step onto the directions that the constraints of a node allow.
pub(super) fn on_tangent(held: Held, at: Point, mut step: Point) -> Point {
    if held.wall {
        let radial = scale([at[0], at[1], 0.0], 1.0 / at[0].hypot(at[1]));
        step = sub(step, scale(radial, dot(step, radial)));
    }
    if held.corner {
        (step[0], step[1]) = (0.0, 0.0);
    }
    if held.end {
        step[2] = 0.0;
    }
    step
}

/// Linearised conditions for the movement of a point to the surface on which its labels meet: residuals (distances) and
/// their gradients.
///
/// At an interface between matrix and grains, the residuals are the distances to the grains. At an interface between
/// grains without matrix, the residuals are the deviations of the distances to the grains from the mean of these
/// distances.
pub(super) struct Pull {
    residuals: Vec<f64>,
    gradients: Vec<Point>,
    inverse: Matrix3<f64>,
}

impl Pull {
    pub(super) fn new(from: &Relocation, labels: &[u32], held: Held, at: Point) -> Pull {
        let field = from.how.field;
        let step = STEP * from.how.spacing_mm.max(10.0 * field.resolution_mm());
        let grains = labels.iter().filter(|&&label| label > 0);
        let (mut residuals, mut gradients): (Vec<f64>, Vec<Point>) = grains
            .map(|&grain| {
                let (distance, gradient) = field.distance_and_gradient(grain, at, step);
                (distance - from.offsets[grain as usize - 1], gradient)
            })
            .unzip();
        if labels.first().is_some_and(|&label| label > 0) {
            let count = residuals.len() as f64;
            let mean = residuals.iter().sum::<f64>() / count;
            let slope = scale(gradients.iter().copied().fold([0.0; 3], add), 1.0 / count);
            residuals.iter_mut().for_each(|residual| *residual -= mean);
            gradients.iter_mut().for_each(|gradient| *gradient = sub(*gradient, slope));
        }
        for gradient in &mut gradients {
            *gradient = on_tangent(held, at, *gradient);
        }
        let mut normal = Matrix3::identity() * DAMPING;
        for &gradient in &gradients {
            let gradient = Vector3::from(gradient);
            normal += gradient * gradient.transpose();
        }
        let inverse = normal.try_inverse().unwrap_or_else(Matrix3::zeros);
        Pull { residuals, gradients, inverse }
    }

    /// Sets target values of the distances, by subtracting the target values from the residuals. Afterwards,
    /// [`Self::to_surface`] returns a step to a point with these distances.
    pub(super) fn towards(&mut self, values: &[f64]) {
        self.residuals.iter_mut().zip(values).for_each(|(residual, value)| *residual -= value);
    }

    /// Returns the shortest step to the point where the linearised residuals vanish, limited to the length `most`.
    pub(super) fn to_surface(&self, most: f64) -> Point {
        let mut rhs = Vector3::zeros();
        for (&residual, &gradient) in self.residuals.iter().zip(&self.gradients) {
            rhs -= Vector3::from(gradient) * residual;
        }
        let step: Point = (self.inverse * rhs).into();
        let length = norm(step);
        if length > most { scale(step, most / length) } else { step }
    }

    /// Returns the component of a step that does not change the residuals.
    pub(super) fn along(&self, step: Point) -> Point {
        (self.inverse * Vector3::from(step) * DAMPING).into()
    }
}
