//! Contact at the nodes of a surface.
//!
//! Pressure, friction and drag are integrated at the nodes with the weights ∫ N_a dA: at the vertices of linear
//! triangles, and at the edge midpoints of quadratic triangles (whose vertices have zero weight, so that a uniform
//! pressure is in equilibrium at each node).
//!
//! The pressure is computed by an augmented Lagrangian method. For the stored pressure p, the gap g and the penalty γ,
//! the augmented pressure is p_γ = ⟨p + γ (−g)⟩₊, where ⟨x⟩₊ = max(x, 0). With p fixed, Newton's method finds the nodes
//! in contact (its active set are the nodes with p_γ > 0). Then p is set to p_γ, and both steps are repeated until p
//! and p_γ agree; the gap of every node in contact then vanishes for any γ. Friction uses the fixed p, so that the
//! tangent stays symmetric; at convergence the friction is exact as well.
//!
//! References: Alart & Curnier, Comput. Methods Appl. Mech. Engrg. 92 (1991) 353,
//! doi:10.1016/0045-7825(91)90022-X; Hintermüller, Ito & Kunisch, SIAM J. Optim. 13 (2003) 865,
//! doi:10.1137/S1052623401383558.

use nalgebra::{Matrix3, Vector3};

use super::platen::{Platen, Proximity};
use crate::element::Domain;
use crate::error::FemError;
use crate::fields::Fields;
use crate::operator::NodeBlock;
use crate::parallel::Part;

/// A node with a gap below this fraction of the face size counts as in contact, even if the contact pressure is zero.
const TOUCH: f64 = 1e-9;
/// Tangential stiffness, as a fraction of γ, of nodes in contact whose pressure p, and therefore friction, is still
/// zero. This stiffness makes the tangent regular and is not part of the residual.
const HOLD: f64 = 1e-6;
/// Penalty γ of the contact pressure, in units of the modulus λ + 2μ divided by the face size.
const PENALTY: f64 = 20.0;

/// State of one node of a contact surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactPoint {
    /// Node number.
    pub node: u32,
    /// Reference area of the surface that belongs to the node, mm².
    pub area_mm2: f64,
    /// Contact pressure per reference area, MPa.
    pub pressure_mpa: f64,
    /// Distance from the platen, mm; negative if the node penetrates the platen.
    pub gap_mm: f64,
    /// Force on the specimen from pressure, friction and drag, N.
    pub force_n: [f64; 3],
}

/// Platen with the nodes that it can touch.
#[derive(Clone, Debug)]
pub(crate) struct Contact {
    pub(crate) surface: String,
    platen: Platen,
    /// Direction of the platen if its load program prescribes a force.
    driven: Option<Vector3<f64>>,
    /// Nodes that the platen can touch: node number, area (mm²), reference position (mm).
    nodes: Vec<(u32, f64, Vector3<f64>)>,
    /// Face size: square root of the mean nodal area, mm.
    size: f64,
    /// Index of each node of this contact surface in the list of the contact nodes of all ranks.
    pub(crate) places: Vec<u32>,
    /// Number of contact nodes, summed over all ranks.
    pub(crate) all: usize,
    /// For each node, whether this rank owns the node.
    owned: Vec<bool>,
}

impl Contact {
    pub(crate) fn new(
        surface: &str,
        platen: Platen,
        driven: Option<[f64; 3]>,
        domain: &dyn Domain,
        triangles: &[[u32; 3]],
    ) -> Result<Self, FemError> {
        let at_rest = platen.travel(0.0).norm();
        if at_rest > 0.0 {
            return Err(FemError::parameter(
                &format!("platen on surface '{surface}'"),
                "travel_mm at time zero",
                at_rest,
                "zero: define the platen at its position at time zero",
            ));
        }
        let position = |node: u32| Vector3::from(domain.nodes()[node as usize]);
        let nodes: Vec<_> = domain
            .nodal_areas(triangles)
            .into_iter()
            .map(|(node, area)| (node, area, position(node)))
            .collect();
        let (all, total) = (nodes.len(), nodes.iter().map(|n| n.1).sum::<f64>());
        let size = (total / all.max(1) as f64).sqrt();
        let (places, owned) = ((0..all as u32).collect(), vec![true; all]);
        let driven = driven.map(Vector3::from);
        Ok(Self { surface: surface.into(), platen, driven, nodes, size, places, all, owned })
    }

    /// Returns the same contact, restricted to the nodes that a part of the mesh contains.
    pub(crate) fn of_part(&self, part: &Part) -> Self {
        let local = part.local();
        let (mut nodes, mut places, mut owned) = (Vec::new(), Vec::new(), Vec::new());
        for (index, &(node, area, position)) in self.nodes.iter().enumerate() {
            if let Some(node) = local(node) {
                nodes.push((node, area, position));
                places.push(index as u32);
                owned.push(part.halo.owns(node));
            }
        }
        let (surface, platen) = (self.surface.clone(), self.platen.clone());
        Self { surface, platen, nodes, places, owned, ..*self }
    }

    /// Iterates over the entries of `values` (one per node) at the nodes that belong to this rank.
    pub(crate) fn own_of<'a, T>(&self, values: &'a [T]) -> impl Iterator<Item = &'a T> {
        values.iter().zip(&self.owned).filter(|(_, owned)| **owned).map(|(value, _)| value)
    }

    /// Iterates over the indices of this rank's own nodes in the list of the contact nodes of all ranks.
    pub(crate) fn own_places(&self) -> impl Iterator<Item = u32> {
        self.own_of(&self.places).copied()
    }

    /// Whether the load program of the platen prescribes a force.
    pub(crate) fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// Returns the number of nodes that can touch the platen.
    pub(crate) fn count(&self) -> usize {
        self.nodes.len()
    }

    /// Calls `each` with the reference position of every node and every direction in which contact can support the
    /// node.
    pub(crate) fn directions(&self, each: &mut dyn FnMut([f64; 3], [f64; 3])) {
        for (_, _, x) in &self.nodes {
            if self.platen.resists_sliding() {
                (0..3).for_each(|k| each((*x).into(), std::array::from_fn(|i| f64::from(i == k))));
            } else {
                let normal = self.platen.proximity(*x, Vector3::zeros()).normal;
                each((*x).into(), normal.into());
            }
        }
    }
}

/// Contact of one surface with its platen in one increment.
#[derive(Clone, Debug)]
pub(crate) struct ContactStep {
    platen: Platen,
    pub(crate) surface: String,
    /// Displacement of the platen at the end of the increment, mm, without the displacement along `driven`.
    travel: Vector3<f64>,
    /// Direction of the platen if its load program prescribes a force, and its displacement along this direction at the
    /// start of the increment, mm.
    driven: Option<(Vector3<f64>, f64)>,
    /// Duration of the increment, s.
    duration: f64,
    /// Penalty γ, MPa/mm.
    penalty: f64,
    /// Gap below which a node counts as in contact, mm.
    touch: f64,
    nodes: Vec<Node>,
    /// Factor by which the slip velocity ε (below which friction decreases to zero) is multiplied. The factor is larger
    /// than 1 while the solver introduces friction gradually.
    pub(crate) bluntness: f64,
}

/// Node of a contact surface in one increment.
#[derive(Clone, Copy, Debug)]
struct Node {
    node: u32,
    area: f64,
    position: Vector3<f64>,
    /// Displacement that the node would have if it stuck to the platen during the increment: its displacement u_n at
    /// the start, plus the displacement of the platen in the increment (without the displacement along `driven`), mm.
    carried: Vector3<f64>,
    /// Contact pressure p, MPa.
    pressure: f64,
    /// Whether the node belongs to this rank.
    owned: bool,
}

impl ContactStep {
    /// Creates the contact at the end of an increment of `duration` s that started at the fields `before`. `pressures`
    /// are the pressures at the start of the increment, MPa; `None` stands for zero.
    pub(crate) fn new(
        contact: &Contact,
        time_s: f64,
        before: &Fields,
        duration: f64,
        pressures: Option<Vec<f64>>,
        modulus_mpa: f64,
    ) -> Self {
        let travel = contact.platen.travel(time_s);
        let since = travel - contact.platen.travel(time_s - duration);
        let pressures = pressures.unwrap_or_else(|| vec![0.0; contact.nodes.len()]);
        let size = contact.size;
        let nodes = contact
            .nodes
            .iter()
            .zip(pressures)
            .zip(&contact.owned)
            .map(|((&(node, area, position), pressure), &owned)| Node {
                node,
                area,
                position,
                carried: Vector3::from(before.displacement[node as usize]) + since,
                pressure,
                owned,
            })
            .collect();
        Self {
            platen: contact.platen.clone(),
            surface: contact.surface.clone(),
            travel,
            driven: contact.driven.map(|direction| (direction, before.platen_mm)),
            duration,
            penalty: PENALTY * modulus_mpa / size,
            touch: TOUCH * size,
            nodes,
            bluntness: 1.0,
        }
    }

    /// Returns whether the positions of the platen are finite.
    pub(crate) fn is_finite(&self) -> bool {
        self.travel.iter().all(|x| x.is_finite())
            && self.nodes.iter().all(|node| node.carried.iter().all(|x| x.is_finite()))
    }

    pub(crate) fn has_friction(&self) -> bool {
        self.platen.friction > 0.0
    }

    /// Returns gap, normal and curvature of the platen at a node.
    fn proximity(&self, node: &Node, fields: &Fields) -> Proximity {
        let u = Vector3::from(fields.displacement[node.node as usize]);
        let driven = self.driven.map_or(Vector3::zeros(), |(along, _)| along * fields.platen_mm);
        self.platen.proximity(node.position, u - self.travel - driven)
    }

    /// Returns the augmented pressure p_γ = ⟨p + γ (−g)⟩₊ for the pressure p, the penalty γ and the gap g, MPa.
    fn pressure(&self, node: &Node, proximity: &Proximity) -> f64 {
        (node.pressure - self.penalty * proximity.gap).max(0.0)
    }

    /// Returns whether the pressure p_γ depends on the gap. At the kink of ⟨·⟩₊ both one-sided derivatives are
    /// admissible; a node at the kink counts as in contact.
    fn touches(&self, node: &Node, proximity: &Proximity) -> bool {
        node.pressure - self.penalty * (proximity.gap - self.touch) > 0.0
    }

    /// Returns the velocity v_t at which the node slides on the platen, mm/s.
    fn slip(&self, node: &Node, proximity: &Proximity, fields: &Fields) -> Vector3<f64> {
        let u = Vector3::from(fields.displacement[node.node as usize]);
        let since = |(along, start_mm): (Vector3<f64>, f64)| along * (fields.platen_mm - start_mm);
        let carried = node.carried + self.driven.map_or(Vector3::zeros(), since);
        let v = (u - carried) / self.duration;
        v - proximity.normal * proximity.normal.dot(&v)
    }

    /// Returns the resistance to sliding μ p s_ε + F_v (MPa s/mm) with s_ε = 1/√(|v_t|² + ε²), and the term μ p s_ε³ of
    /// its derivative (MPa s³/mm³). Here μ is the coefficient of friction, F_v the drag, v_t the sliding velocity and ε
    /// the slip velocity. Both values are zero without pressure.
    fn resistance(&self, node: &Node, slip: &Vector3<f64>) -> (f64, f64) {
        if node.pressure == 0.0 {
            return (0.0, 0.0);
        }
        let s = 1.0 / slip.norm().hypot(self.bluntness * self.platen.slip_velocity);
        let coulomb = self.platen.friction * node.pressure;
        (coulomb * s + self.platen.drag, coulomb * s.powi(3))
    }

    /// Returns the traction on the specimen, MPa.
    fn traction(&self, node: &Node, fields: &Fields) -> Vector3<f64> {
        let proximity = self.proximity(node, fields);
        let mut traction = proximity.normal * self.pressure(node, &proximity);
        if self.platen.resists_sliding() {
            let slip = self.slip(node, &proximity, fields);
            traction -= slip * self.resistance(node, &slip).0;
        }
        traction
    }

    /// Iterates over the nodal forces, N.
    pub(crate) fn forces(&self, fields: &Fields) -> impl Iterator<Item = (u32, [f64; 3])> {
        self.nodes.iter().map(|n| (n.node, (self.traction(n, fields) * n.area).into()))
    }

    /// Returns the sum of the forces over the nodes that belong to this rank, N.
    pub(crate) fn force(&self, fields: &Fields) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (_, force) in
            self.forces(fields).zip(&self.nodes).filter(|(_, n)| n.owned).map(|(f, _)| f)
        {
            (0..3).for_each(|k| sum[k] += force[k]);
        }
        sum
    }

    /// Returns the contribution of contact to the tangent, −∂force/∂u at each node, N/mm.
    ///
    /// On a curved platen, the rotation of the tangent plane is neglected in the friction terms.
    pub(crate) fn blocks(&self, fields: &Fields) -> impl Iterator<Item = NodeBlock> {
        self.nodes.iter().map(|node| {
            let proximity = self.proximity(node, fields);
            let pressure = self.pressure(node, &proximity);
            let mut block = Matrix3::zeros();
            let touches = self.touches(node, &proximity);
            if touches {
                let n = proximity.normal;
                block += n * n.transpose() * self.penalty - proximity.curvature * pressure;
            }
            if self.platen.resists_sliding() {
                let slip = self.slip(node, &proximity, fields);
                let (secant, cubic) = self.resistance(node, &slip);
                let n = proximity.normal;
                let tangential = Matrix3::identity() - n * n.transpose();
                block += (tangential * secant - slip * slip.transpose() * cubic) / self.duration;
                if touches && node.pressure == 0.0 {
                    block += tangential * (HOLD * self.penalty);
                }
            }
            let block = block * node.area;
            (node.node, std::array::from_fn(|i| std::array::from_fn(|j| block[(i, j)])))
        })
    }

    /// Whether the load program of the platen prescribes a force.
    pub(crate) fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// Returns the derivatives of the contact forces with respect to a parameter θ that keep the gaps closed, N per
    /// unit of θ: −γ A (n·du/dθ) n with the nodal area A and the normal n for nodes in contact, zero for all other
    /// nodes.
    pub(crate) fn follow(
        &self,
        fields: &Fields,
        rates: &[[f64; 4]],
    ) -> impl Iterator<Item = (u32, [f64; 3])> {
        self.nodes.iter().map(|node| {
            let proximity = self.proximity(node, fields);
            let [x, y, z, _] = rates[node.node as usize];
            let mut force = Vector3::zeros();
            if self.touches(node, &proximity) {
                let closing = -proximity.normal.dot(&Vector3::new(x, y, z));
                force = proximity.normal * (self.penalty * node.area * closing);
            }
            (node.node, force.into())
        })
    }

    /// Returns the energy that friction and drag dissipate in the increment at the nodes that belong to this rank, N
    /// mm: ∫ (μ p s_ε + F_v) |v_t|² dA Δt, with the symbols of [`Platen`].
    pub(crate) fn dissipated(&self, fields: &Fields) -> f64 {
        let power = |node: &Node| {
            let slip = self.slip(node, &self.proximity(node, fields), fields);
            node.area * self.resistance(node, &slip).0 * slip.norm_squared()
        };
        if !self.platen.resists_sliding() {
            return 0.0;
        }
        self.duration * self.nodes.iter().filter(|n| n.owned).map(power).sum::<f64>()
    }

    /// Returns the pressures p by node, MPa.
    pub(crate) fn pressures(&self) -> Vec<f64> {
        self.nodes.iter().map(|n| n.pressure).collect()
    }

    /// Sets each pressure p to the augmented pressure p_γ. Returns the sum of the squared changes of nodal force over
    /// the nodes that belong to this rank, N².
    pub(crate) fn update(&mut self, fields: &Fields) -> f64 {
        let mut square = 0.0;
        for k in 0..self.nodes.len() {
            let node = self.nodes[k];
            let pressure = self.pressure(&node, &self.proximity(&node, fields));
            if node.owned {
                square += (node.area * (pressure - node.pressure)).powi(2);
            }
            self.nodes[k].pressure = pressure;
        }
        square
    }

    /// Returns two quantities from which the rounding error of the contact forces is estimated: the sum of the
    /// squared nodal penalties γ A over the nodes that belong to this rank, N²/mm², and the length (mm) to which
    /// the rounding errors of the gaps are proportional.
    pub(crate) fn stiffness(&self) -> (f64, f64) {
        let owned = self.nodes.iter().filter(|node| node.owned);
        let squares = owned.map(|node| (self.penalty * node.area).powi(2)).sum();
        (squares, self.platen.rounded_mm())
    }

    /// Returns whether no node is in contact with the platen.
    pub(crate) fn is_open(&self, fields: &Fields) -> bool {
        !self.nodes.iter().any(|node| self.touches(node, &self.proximity(node, fields)))
    }

    /// Returns the contact state of every node.
    pub(crate) fn contact_points(&self, fields: &Fields) -> Vec<ContactPoint> {
        let point = |node: &Node| ContactPoint {
            node: node.node,
            area_mm2: node.area,
            pressure_mpa: node.pressure,
            gap_mm: self.proximity(node, fields).gap,
            force_n: (self.traction(node, fields) * node.area).into(),
        };
        self.nodes.iter().map(point).collect()
    }
}
