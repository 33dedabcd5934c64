//! Conditions on the nodes of a finite-element space: constrained degrees of freedom, loads and contact.

use std::collections::BTreeMap;
use std::sync::Arc;

use nalgebra::Vector3;

use super::conditions::{Axis, Conditions, Driven, Prescribed, PressureOn, Probe, Travel};
use super::constraint::{ConstrainedDof, Constraints, Value};
use super::contact::Contact;
use super::function::Function;
use super::gauge::gauge_of;
use super::loads::{self, Loads, Traction};
use super::node_set::triangles;
use super::pressure::{Follower, Pressure};
use super::reaction::{self, Claims, Support};
use super::rigid::RigidMotions;
use crate::element::Domain;
use crate::error::{FemError, Unsupported};
use crate::fields::Fields;
use crate::parallel::Part;
use fem_mesh::TetMesh;

/// Boundary conditions and loads on a finite-element space, or on this rank's part of the space.
#[derive(Debug)]
pub(crate) struct Boundary {
    pub(super) constrained: Vec<ConstrainedDof>,
    /// Nodes of every surface whose reaction is recorded.
    pub(crate) surfaces: BTreeMap<String, Vec<u32>>,
    /// Prescribed displacement components of each surface, each with the share of the nodal force that belongs to the
    /// surface.
    pub(super) supports: BTreeMap<String, Vec<Support>>,
    tractions: Vec<Traction>,
    pressures: Vec<Pressure>,
    body_force: Option<Function<[f64; 3]>>,
    damage_source: Option<Function<f64>>,
    /// For each region, whether its material can be damaged.
    damaged: Vec<bool>,
    pub(crate) contacts: Vec<Contact>,
    pub(super) probe: Option<Probe>,
    /// Nodes of the extensometer and their weights; empty without an extensometer.
    pub(super) gauge: Vec<(u32, f64)>,
    /// Direction of the platen whose load program prescribes a force.
    pub(super) driven: Option<[f64; 3]>,
    first_guess: Option<Function<[f64; 3]>>,
    pub(super) part: Arc<Part>,
}

impl Boundary {
    /// Finds the nodes and areas of all conditions, and checks that the conditions are consistent and prevent all rigid
    /// motions.
    ///
    /// `damaged` states for each region whether damage is possible. At a node that surfaces share, the prescribed
    /// values of these surfaces must be equal. The values are compared at half of `duration_s` and at its end.
    pub(crate) fn new(
        domain: &dyn Domain,
        mesh: &TetMesh,
        conditions: &Conditions,
        damaged: Vec<bool>,
        duration_s: f64,
    ) -> Result<Self, FemError> {
        let triangles = |name: &str, role| triangles(mesh, name, role);
        let nodes_of = |name: &str, role| conditions.nodes_of(name, role, mesh, domain);
        let mut surfaces = BTreeMap::new();
        let (mut constraints, mut claims) =
            (Constraints::new(domain.nodes(), duration_s), Claims::default());
        for Prescribed { surface: name, axes, displacement } in &conditions.prescribed {
            let nodes = nodes_of(name, "displacement is prescribed")?;
            let value = displacement.clone().map_or(Value::Zero, Value::Displacement);
            for &axis in axes {
                constraints.add(name, &nodes, axis as usize, value.clone())?;
                claims.add(name, &nodes, axis as usize);
            }
            surfaces.insert(name.clone(), nodes);
        }
        for name in &conditions.symmetric {
            let on = triangles(name, "symmetry is prescribed")?;
            let nodes = domain.nodes_on(on);
            let axis = normal_axis(mesh, name, on)? as usize;
            constraints.add(name, &nodes, axis, Value::Zero)?;
            claims.add(name, &nodes, axis);
            surfaces.insert(name.clone(), nodes);
        }
        for (name, function) in &conditions.damage {
            let nodes = nodes_of(name, "damage is prescribed")?;
            constraints.add(name, &nodes, 3, Value::Damage(function.clone()))?;
        }
        if let Some(Driven { surface: name, direction, by_contact: false }) = &conditions.driven {
            let nodes = nodes_of(name, "a platen acts")?;
            for axis in (0..3).filter(|&axis| direction[axis] != 0.0) {
                constraints.add(name, &nodes, axis, Value::Driven(direction[axis]))?;
                claims.add(name, &nodes, axis);
            }
            surfaces.insert(name.clone(), nodes);
        }
        let (mut contacts, mut gauge) = (Vec::new(), Vec::new());
        for (name, platen) in &conditions.platens {
            platen.validate(name)?;
            let on = triangles(name, "a platen acts")?;
            let driven = conditions.driven.as_ref().filter(|d| d.by_contact && d.surface == *name);
            let direction = driven.map(|driven| driven.direction);
            contacts.push(Contact::new(name, platen.clone(), direction, domain, on)?);
            surfaces.insert(name.clone(), domain.nodes_on(on));
        }
        if let Some(probe) = &conditions.probe {
            let nodes = nodes_of(&probe.surface, "the curve is measured")?;
            surfaces.insert(probe.surface.clone(), nodes);
            let length = Vector3::from(probe.direction).norm();
            if !(length > 0.0 && length.is_finite()) {
                let entity = format!("surface '{}'", probe.surface);
                let requirement =
                    "positive and finite: the measured direction is a vector such as [0, 0, 1]";
                return Err(FemError::parameter(
                    &entity,
                    "length of the direction",
                    length,
                    requirement,
                ));
            }
            if let Travel::Gauge(gauge_points) = probe.travel {
                gauge = gauge_of(domain, gauge_points)?;
            }
        }
        let mut tractions = Vec::new();
        for (name, stress) in &conditions.tractions {
            let on = triangles(name, "a traction acts")?;
            let (surface, stress) = (name.clone(), stress.clone());
            tractions.push(Traction { surface, triangles: on.to_vec(), stress });
            surfaces.insert(name.clone(), domain.nodes_on(on));
        }
        let mut pressures = Vec::new();
        for PressureOn { surface: name, pressure, follows } in &conditions.pressures {
            let on = triangles(name, "a pressure acts")?;
            let (surface, pressure) = (name.clone(), pressure.clone());
            pressures.push(Pressure {
                surface,
                triangles: on.to_vec(),
                pressure,
                follows: *follows,
            });
            surfaces.insert(name.clone(), domain.nodes_on(on));
        }
        let mut constrained = constraints.into_dofs();
        let supports =
            supports(domain.nodes(), &constrained, &contacts, conditions.remove_rigid_motions)?;
        for (node, component) in supports {
            constrained.push(ConstrainedDof { node, component, value: Value::Zero });
        }
        Ok(Self {
            constrained,
            surfaces,
            supports: claims.into_supports(domain, mesh),
            tractions,
            pressures,
            body_force: conditions.body_force.clone(),
            damage_source: conditions.damage_source.clone(),
            damaged,
            contacts,
            probe: conditions.probe.clone().map(|probe| Probe {
                direction: Vector3::from(probe.direction).normalize().into(),
                ..probe
            }),
            gauge,
            driven: conditions.driven.as_ref().map(|driven| driven.direction),
            first_guess: conditions.first_guess.clone(),
            part: Arc::default(),
        })
    }

    /// Returns the conditions on this rank's part of the space. Constrained values and contact include all nodes of the
    /// part. Surfaces include only the nodes that the rank owns, and tractions include only the faces of the rank.
    /// `domain` is the whole space, and `rank_of_tet` the rank of each of its elements.
    pub(crate) fn of_part(self, part: Arc<Part>, domain: &dyn Domain, rank_of_tet: &[u32]) -> Self {
        let tractions = self.tractions.into_iter();
        let tractions = tractions.map(|traction| {
            let triangles = loads::of_part(&traction.triangles, domain, rank_of_tet, &part);
            Traction { triangles, ..traction }
        });
        let tractions = tractions.collect();
        let pressures = self.pressures.into_iter();
        let pressures = pressures.map(|pressure| {
            let triangles = loads::of_part(&pressure.triangles, domain, rank_of_tet, &part);
            Pressure { triangles, ..pressure }
        });
        let pressures = pressures.collect();
        let local = part.local();
        let constrained = self.constrained.into_iter();
        let constrained =
            constrained.filter_map(|dof| Some(ConstrainedDof { node: local(dof.node)?, ..dof }));
        let owned = |nodes: Vec<u32>| -> Vec<u32> {
            nodes.into_iter().filter_map(&local).filter(|&n| part.halo.owns(n)).collect()
        };
        let supports = self.supports.into_iter();
        let gauge = self.gauge.iter().filter_map(|&(n, weight)| Some((local(n)?, weight)));
        Self {
            supports: supports.map(|(name, all)| (name, reaction::of_part(all, &part))).collect(),
            constrained: constrained.collect(),
            surfaces: self.surfaces.into_iter().map(|(name, nodes)| (name, owned(nodes))).collect(),
            tractions,
            pressures,
            contacts: self.contacts.iter().map(|contact| contact.of_part(&part)).collect(),
            gauge: gauge.filter(|&(n, _)| part.halo.owns(n)).collect(),
            part,
            ..self
        }
    }

    /// Returns the part of the mesh on this rank.
    pub(crate) fn part(&self) -> &Arc<Part> {
        &self.part
    }

    /// Returns the constrained degrees of freedom as (node, component); component 3 is the damage.
    pub(crate) fn constrained(&self) -> impl Iterator<Item = (u32, usize)> + '_ {
        self.constrained.iter().map(|dof| (dof.node, dof.component))
    }

    /// Writes the prescribed values at a time, and at the displacement of the platen in the fields, into the fields.
    pub(crate) fn impose(&self, nodes: &[[f64; 3]], time_s: f64, fields: &mut Fields) {
        for dof in &self.constrained {
            let node = dof.node as usize;
            let value = dof.at(nodes[node], time_s, fields.platen_mm);
            match dof.component {
                3 => fields.damage[node] = value,
                k => fields.displacement[node][k] = value,
            }
        }
    }

    /// Sets the displacements to the initial guess of the first increment, if the conditions contain a guess.
    pub(crate) fn start(&self, nodes: &[[f64; 3]], time_s: f64, fields: &mut Fields) {
        if let Some(guess) = &self.first_guess {
            for (u, &x) in fields.displacement.iter_mut().zip(nodes) {
                *u = guess.at(x, time_s);
            }
        }
    }

    /// Returns the loads at a time; `None` if there are no loads.
    pub(crate) fn loads(&self, domain: &dyn Domain, time_s: f64) -> Option<Loads> {
        let mut dead = self.pressures.iter().filter(|pressure| !pressure.follows).peekable();
        let is_loaded = self.body_force.is_some() || self.damage_source.is_some();
        if self.tractions.is_empty() && dead.peek().is_none() && !is_loaded {
            return None;
        }
        let mut nodal = vec![[0.0; 4]; domain.nodes().len()];
        let mut tractions = BTreeMap::new();
        for traction in &self.tractions {
            let sum: &mut [f64; 3] = tractions.entry(traction.surface.clone()).or_default();
            let resultant = traction.add(domain, time_s, &mut nodal);
            (0..3).for_each(|k| sum[k] += resultant[k]);
        }
        for pressure in dead {
            let sum: &mut [f64; 3] = tractions.entry(pressure.surface.clone()).or_default();
            let resultant = pressure.add_dead(domain, time_s, &mut nodal);
            (0..3).for_each(|k| sum[k] += resultant[k]);
        }
        if let Some(f) = &self.body_force {
            let density = |x| {
                let [a, b, c] = f.at(x, time_s);
                [a, b, c, 0.0]
            };
            domain.volume_load(&|_| true, &density, &mut nodal);
        }
        if let Some(f) = &self.damage_source {
            let acts = |region: usize| self.damaged[region];
            domain.volume_load(&acts, &|x| [0.0, 0.0, 0.0, f.at(x, time_s)], &mut nodal);
        }
        self.part.halo.complete(&mut nodal);
        Some(Loads { nodal, tractions })
    }

    /// Returns the follower pressures at a time.
    pub(super) fn followers(&self, domain: &dyn Domain, time_s: f64) -> Vec<Follower> {
        let followers = self.pressures.iter().filter(|pressure| pressure.follows);
        followers.map(|pressure| pressure.follower(domain, time_s)).collect()
    }

    /// Returns the force from prescribed values on each surface, N: the sum over the nodes of this rank, zero for a
    /// surface without prescribed values.
    pub(crate) fn support_forces(&self, residual: &[[f64; 4]]) -> BTreeMap<String, [f64; 3]> {
        let force = |name: &String| {
            self.supports.get(name).map_or([0.0; 3], |list| reaction::sum(list, residual))
        };
        self.surfaces.keys().map(|name| (name.clone(), force(name))).collect()
    }

    /// Returns the nodes with prescribed damage.
    pub(crate) fn damaged_nodes(&self) -> impl Iterator<Item = u32> {
        self.constrained.iter().filter(|dof| dof.component == 3).map(|dof| dof.node)
    }

    /// Returns three maxima over the prescribed displacement components of all ranks, mm: |`guess` − `after`|,
    /// |`before` − `after`| and |`after`|.
    pub(crate) fn jump(&self, guess: &Fields, before: &Fields, after: &Fields) -> [f64; 3] {
        let mut sizes = [0.0f64; 3];
        for dof in self.constrained.iter().filter(|dof| dof.component < 3) {
            let (node, k) = (dof.node as usize, dof.component);
            let [guess, before, after] = [guess, before, after].map(|f| f.displacement[node][k]);
            let distances = [guess - after, before - after, after];
            (0..3).for_each(|k| sizes[k] = sizes[k].max(distances[k].abs()));
        }
        self.part.ranks().max(&mut sizes);
        sizes
    }
}

/// Returns the axis that is normal to a plane surface, or an error if the surface is not normal to an axis.
fn normal_axis(mesh: &TetMesh, name: &str, triangles: &[[u32; 3]]) -> Result<Axis, FemError> {
    let normal = |triangle: &[u32; 3]| {
        let p = triangle.map(|n| Vector3::from(mesh.nodes[n as usize]));
        (p[1] - p[0]).cross(&(p[2] - p[0])).normalize()
    };
    Axis::ALL
        .into_iter()
        .find(|&axis| triangles.iter().all(|t| normal(t)[axis as usize].abs() > 1.0 - 1e-8))
        .ok_or_else(|| FemError::unsupported(format!("surface '{name}'"), Unsupported::NotAPlane))
}

/// If `remove` is true, returns constraints (node, component) that prevent the free rigid motions. Otherwise returns an
/// error if a rigid motion is free.
fn supports(
    nodes: &[[f64; 3]],
    constrained: &[ConstrainedDof],
    contacts: &[Contact],
    remove: bool,
) -> Result<Vec<(u32, usize)>, FemError> {
    let mut motions = RigidMotions::new(nodes);
    for dof in constrained.iter().filter(|dof| dof.component < 3) {
        let unit = std::array::from_fn(|k| f64::from(k == dof.component));
        motions.add_support(nodes[dof.node as usize], unit);
    }
    for contact in contacts {
        contact.directions(&mut |x, direction| motions.add_support(x, direction));
    }
    if motions.count() == 0 {
        return Ok(Vec::new());
    }
    if remove {
        return Ok(motions.supports(nodes));
    }
    let reason = Unsupported::FreeMotions { motion: motions.describe(), count: motions.count() };
    Err(FemError::unsupported("boundary conditions", reason))
}
