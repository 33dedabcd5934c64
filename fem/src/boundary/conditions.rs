//! Boundary conditions and loads, with the names of the surfaces of the mesh.

use std::collections::BTreeMap;

use super::contact::Platen;
use super::function::Function;
use super::node_set::{NodeSet, triangles};
use crate::element::Domain;
use crate::error::{FemError, Unsupported};
use fem_mesh::TetMesh;

/// Axis of the global coordinate system.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Axis {
    /// Axis of the first coordinate.
    X,
    /// Axis of the second coordinate.
    Y,
    /// Axis of the third coordinate, which is the axis of a cylindrical specimen.
    Z,
}

impl Axis {
    /// All three axes.
    pub const ALL: [Axis; 3] = [Axis::X, Axis::Y, Axis::Z];
}

/// Source of the displacement values of a force–displacement curve.
#[derive(Clone, Debug)]
pub(crate) enum Travel {
    /// Mean displacement of the surface's nodes along the direction.
    Mean,
    /// Displacement of the second gauge point relative to the first gauge point, along the direction. The gauge points
    /// are reference positions, mm.
    Gauge([[f64; 3]; 2]),
    /// The displacement (mm) is a given function of time (s).
    Known(Function<f64>),
    /// Displacement of the platen whose load program prescribes a force.
    Platen,
}

/// Surface on which the force and the displacement of the curve are measured, with the direction of both.
#[derive(Clone, Debug)]
pub(crate) struct Probe {
    pub(crate) surface: String,
    pub(crate) direction: [f64; 3],
    pub(crate) travel: Travel,
}

/// Prescribed displacement components of a surface. If `displacement` is `None`, the prescribed displacement is zero.
#[derive(Clone, Debug)]
pub(super) struct Prescribed {
    pub(super) surface: String,
    pub(super) axes: Vec<Axis>,
    pub(super) displacement: Option<Function<[f64; 3]>>,
}

/// Pressure on a surface, MPa, on the reference surface or normal to the deformed surface.
#[derive(Clone, Debug)]
pub(super) struct PressureOn {
    pub(super) surface: String,
    pub(super) pressure: Function<f64>,
    pub(super) follows: bool,
}

/// Platen whose load program prescribes a force.
#[derive(Clone, Debug)]
pub(super) struct Driven {
    pub(super) surface: String,
    /// Displacement of the platen for a displacement of 1 mm along the load program.
    pub(super) direction: [f64; 3],
    /// Whether the surface touches the platen only by contact. Otherwise the surface is fixed to the platen along
    /// `direction`, which is then parallel to an axis.
    pub(super) by_contact: bool,
}

/// Boundary conditions and loads of a [`Problem`](crate::Problem).
///
/// Functions take the *reference* position in mm and the time in s. On a surface without a condition, the traction and
/// the flux of the damage are zero. A surface may have several conditions. At nodes that surfaces share, all conditions
/// must prescribe the same value.
///
/// # Example
/// A bar pulled at one end, with two planes of symmetry:
/// ```
/// use fem::{Axis, Conditions};
///
/// let conditions = Conditions::new()
///     .symmetry("left")
///     .symmetry("front")
///     .fix("bottom", [Axis::Z])
///     .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.1 * time_s])
///     .measure("top", [0.0, 0.0, 1.0]);
/// # let _ = conditions;
/// ```
#[derive(Clone, Debug, Default)]
pub struct Conditions {
    node_sets: BTreeMap<String, NodeSet>,
    pub(super) prescribed: Vec<Prescribed>,
    pub(super) damage: Vec<(String, Function<f64>)>,
    pub(super) symmetric: Vec<String>,
    pub(super) tractions: Vec<(String, Function<[f64; 3]>)>,
    pub(super) pressures: Vec<PressureOn>,
    pub(super) body_force: Option<Function<[f64; 3]>>,
    pub(super) damage_source: Option<Function<f64>>,
    pub(super) platens: Vec<(String, Platen)>,
    pub(super) remove_rigid_motions: bool,
    pub(super) probe: Option<Probe>,
    pub(super) driven: Option<Driven>,
    pub(super) first_guess: Option<Function<[f64; 3]>>,
    description: String,
}

impl Conditions {
    /// Creates an empty list of conditions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names a selection of nodes. Conditions accept this name like the name of a surface. Exceptions are tractions,
    /// pressures, platens and symmetry, which need an area. If several conditions prescribe the same component of a node and one
    /// of these conditions belongs to a node set, the force is divided equally among the conditions.
    ///
    /// # Example
    /// A plate on a line support and a pin:
    /// ```
    /// use fem::{Axis, Conditions, NodeSet};
    ///
    /// let conditions = Conditions::new()
    ///     .node_set("line", NodeSet::segment([0.0, 0.0, 0.0], [0.0, 5.0, 0.0]))
    ///     .node_set("pin", NodeSet::nearest([10.0, 2.5, 0.0]))
    ///     .fix("line", [Axis::Z])
    ///     .fix("pin", Axis::ALL);
    /// # let _ = conditions;
    /// ```
    pub fn node_set(mut self, name: &str, nodes: NodeSet) -> Self {
        self.node_sets.insert(name.into(), nodes);
        self
    }

    /// Prescribes components of the displacement of a surface, mm. Components that are not in `axes` stay free, and
    /// the function's values for these components are ignored.
    pub fn prescribe(
        mut self,
        surface: &str,
        axes: impl IntoIterator<Item = Axis>,
        displacement_mm: impl Fn([f64; 3], f64) -> [f64; 3] + Send + Sync + 'static,
    ) -> Self {
        self.prescribed.push(Prescribed {
            surface: surface.into(),
            axes: axes.into_iter().collect(),
            displacement: Some(Function::new(displacement_mm)),
        });
        self
    }

    /// Sets components of the displacement of a surface to zero.
    pub fn fix(mut self, surface: &str, axes: impl IntoIterator<Item = Axis>) -> Self {
        self.prescribed.push(Prescribed {
            surface: surface.into(),
            axes: axes.into_iter().collect(),
            displacement: None,
        });
        self
    }

    /// Prescribes the damage of a surface, in [0, 1].
    pub fn prescribe_damage(
        mut self,
        surface: &str,
        damage: impl Fn([f64; 3], f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.damage.push((surface.into(), Function::new(damage)));
        self
    }

    /// Makes a plane surface, normal to one of the axes, a plane of symmetry: its nodes stay in the plane.
    pub fn symmetry(mut self, surface: &str) -> Self {
        self.symmetric.push(surface.into());
        self
    }

    /// Adds a dead load on a surface: force per reference area, MPa.
    pub fn traction(
        mut self,
        surface: &str,
        traction_mpa: impl Fn([f64; 3], f64) -> [f64; 3] + Send + Sync + 'static,
    ) -> Self {
        self.tractions.push((surface.into(), Function::new(traction_mpa)));
        self
    }

    /// Adds a dead pressure on a surface, MPa: −p N per reference area, with the outward normal N of the reference surface.
    /// Direction and area do not change with the deformation.
    pub fn pressure(
        mut self,
        surface: &str,
        pressure_mpa: impl Fn([f64; 3], f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let (surface, pressure) = (surface.into(), Function::new(pressure_mpa));
        self.pressures.push(PressureOn { surface, pressure, follows: false });
        self
    }

    /// Adds a follower pressure on a surface, MPa: −p n per deformed area, with the outward normal n of the deformed
    /// surface, such as the pressure of a fluid.
    ///
    /// # Example
    /// A confining pressure of 5 MPa on the side of a cylinder, which acts from the start:
    /// ```
    /// use fem::{Axis, Conditions};
    ///
    /// let conditions = Conditions::new()
    ///     .fix("bottom", [Axis::Z])
    ///     .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, -0.1 * time_s])
    ///     .follower_pressure("side", |_, _| 5.0)
    ///     .remove_rigid_motions()
    ///     .measure("top", [0.0, 0.0, -1.0]);
    /// # let _ = conditions;
    /// ```
    pub fn follower_pressure(
        mut self,
        surface: &str,
        pressure_mpa: impl Fn([f64; 3], f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let (surface, pressure) = (surface.into(), Function::new(pressure_mpa));
        self.pressures.push(PressureOn { surface, pressure, follows: true });
        self
    }

    /// Returns whether a pressure is normal to the deformed surface.
    pub(crate) fn has_follower(&self) -> bool {
        self.pressures.iter().any(|pressure| pressure.follows)
    }

    /// Whether the measured displacement is prescribed by conditions or by a platen, so that it does not depend on the
    /// material.
    pub(crate) fn prescribes_measured_displacement(&self) -> bool {
        let Some(probe) = &self.probe else { return true };
        let is_fixed = |axis: Axis| {
            let has_axis = |p: &Prescribed| p.surface == probe.surface && p.axes.contains(&axis);
            probe.direction[axis as usize] == 0.0 || self.prescribed.iter().any(has_axis)
        };
        match probe.travel {
            Travel::Known(_) | Travel::Platen => true,
            Travel::Gauge(_) => false,
            Travel::Mean => {
                self.platens.iter().any(|(surface, _)| *surface == probe.surface)
                    || Axis::ALL.into_iter().all(is_fixed)
            }
        }
    }

    /// Sets a body force per reference volume, N/mm³.
    pub fn body_force(
        mut self,
        force_n_per_mm3: impl Fn([f64; 3], f64) -> [f64; 3] + Send + Sync + 'static,
    ) -> Self {
        self.body_force = Some(Function::new(force_n_per_mm3));
        self
    }

    /// Sets a source on the right-hand side of the damage equation, MPa, e.g. for a manufactured solution. The source
    /// acts in the regions that have a toughness.
    pub fn damage_source(
        mut self,
        source_mpa: impl Fn([f64; 3], f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        self.damage_source = Some(Function::new(source_mpa));
        self
    }

    /// Adds a rigid platen that a surface can touch and leave.
    pub fn platen(mut self, surface: &str, platen: Platen) -> Self {
        self.platens.push((surface.into(), platen));
        self
    }

    /// Constrains single nodes, so that the rigid motions that the other conditions allow are no longer possible.
    ///
    /// Loads must be in equilibrium along these motions; the reactions at these nodes then vanish.
    pub fn remove_rigid_motions(mut self) -> Self {
        self.remove_rigid_motions = true;
        self
    }

    /// Returns whether a platen has friction or drag.
    pub(crate) fn has_friction(&self) -> bool {
        self.platens.iter().any(|(_, platen)| platen.resists_sliding())
    }

    /// Returns whether the conditions consist of prescribed values only, without loads and platens.
    pub(crate) fn only_prescribe(&self) -> bool {
        let loaded = self.body_force.is_some() || self.damage_source.is_some();
        let loaded = loaded || !self.pressures.is_empty();
        self.tractions.is_empty() && self.platens.is_empty() && !loaded
    }

    /// Measures force and displacement of the curve on a surface, along `direction` (any length). The force is the
    /// force on the body from the prescribed values, the platen, the tractions and the pressures of this surface. The displacement
    /// is the mean over the nodes of the surface.
    pub fn measure(mut self, surface: &str, direction: [f64; 3]) -> Self {
        self.probe = Some(Probe { surface: surface.into(), direction, travel: Travel::Mean });
        self
    }

    /// Measures the force on a surface as [`measure`](Self::measure) does, with a given displacement (mm) as a
    /// function of time (s), such as the displacement of the platen.
    pub fn measure_travel(
        mut self,
        surface: &str,
        direction: [f64; 3],
        travel_mm: impl Fn(f64) -> f64 + Send + Sync + 'static,
    ) -> Self {
        let travel = Travel::Known(Function::new(move |_, time_s| travel_mm(time_s)));
        self.probe = Some(Probe { surface: surface.into(), direction, travel });
        self
    }

    /// Measures the force on a surface as [`measure`](Self::measure) does, and the displacement with an extensometer:
    /// the displacement of the point `gauge_mm[1]` relative to the point `gauge_mm[0]` along `direction`. Both gauge
    /// points are reference positions inside the body, mm, and need not be nodes.
    ///
    /// # Example
    /// ```
    /// use fem::{Axis, Conditions};
    ///
    /// let conditions = Conditions::new()
    ///     .fix("bottom", [Axis::Z])
    ///     .prescribe("top", [Axis::Z], |_, time_s| [0.0, 0.0, 0.1 * time_s])
    ///     .measure_between("top", [0.0, 0.0, 1.0], [[2.5, 0.0, 1.2], [2.5, 0.0, 3.2]]);
    /// # let _ = conditions;
    /// ```
    pub fn measure_between(
        mut self,
        surface: &str,
        direction: [f64; 3],
        gauge_mm: [[f64; 3]; 2],
    ) -> Self {
        let travel = Travel::Gauge(gauge_mm);
        self.probe = Some(Probe { surface: surface.into(), direction, travel });
        self
    }

    /// Moves a surface along `direction` (parallel to an axis, of length 1) with a platen whose load program prescribes a
    /// force, and measures force and displacement of this platen. Components that are zero in `direction` stay free.
    pub(crate) fn drive(mut self, surface: &str, direction: [f64; 3]) -> Self {
        self.driven = Some(Driven { surface: surface.into(), direction, by_contact: false });
        self.probe = Some(Probe { surface: surface.into(), direction, travel: Travel::Platen });
        self
    }

    /// Adds a rigid platen that moves along `direction` (of length 1), and whose load program prescribes a force. Force
    /// and displacement of this platen are measured.
    pub(crate) fn drive_platen(self, surface: &str, platen: Platen, direction: [f64; 3]) -> Self {
        let mut driven = self.platen(surface, platen).drive(surface, direction);
        driven.driven.iter_mut().for_each(|driven| driven.by_contact = true);
        driven
    }

    /// Returns whether a surface can touch and leave a platen.
    pub(crate) fn has_platens(&self) -> bool {
        !self.platens.is_empty()
    }

    /// Returns whether a platen follows a load program that prescribes a force.
    pub(crate) fn is_driven(&self) -> bool {
        self.driven.is_some()
    }

    /// Returns the nodes of a surface or a node set. `role` describes the use of the nodes in error messages.
    pub(crate) fn nodes_of(
        &self,
        name: &str,
        role: &'static str,
        mesh: &TetMesh,
        domain: &dyn Domain,
    ) -> Result<Vec<u32>, FemError> {
        let Some(set) = self.node_sets.get(name) else {
            return Ok(domain.nodes_on(triangles(mesh, name, role)?));
        };
        let refused = |reason| Err(FemError::unsupported(format!("node set '{name}'"), reason));
        if mesh.surfaces.contains_key(name) {
            return refused(Unsupported::NameOfSurface);
        }
        let nodes = set.nodes(name, mesh, domain)?;
        if nodes.is_empty() { refused(Unsupported::EmptyNodeSet) } else { Ok(nodes) }
    }

    /// Sets a text that describes the functions of the conditions. Functions cannot be compared. A run therefore
    /// resumes from a saved state only if this text equals the text in the saved state.
    pub fn described_as(mut self, words: impl Into<String>) -> Self {
        self.description = words.into();
        self
    }

    /// Sets the initial guess of the first increment, mm. Without a guess, the iteration starts from zero displacement,
    /// except for the prescribed values. The size of the elements at the surface then limits the first load step.
    pub fn first_guess(
        mut self,
        displacement_mm: impl Fn([f64; 3], f64) -> [f64; 3] + Send + Sync + 'static,
    ) -> Self {
        self.first_guess = Some(Function::new(displacement_mm));
        self
    }
}
