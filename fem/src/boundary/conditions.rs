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
    pub(super) body_force: Option<Function<[f64; 3]>>,
    pub(super) damage_source: Option<Function<f64>>,
    pub(super) platens: Vec<(String, Platen)>,
    pub(super) remove_rigid_motions: bool,
    pub(super) probe: Option<Probe>,
    pub(super) first_guess: Option<Function<[f64; 3]>>,
    description: String,
}

impl Conditions {
    /// Creates an empty list of conditions.
    pub fn new() -> Self {
        Self::default()
    }

    /// Names a selection of nodes. Conditions accept this name like the name of a surface. Exceptions are tractions,
    /// platens and symmetry, which need an area. If several conditions prescribe the same component of a node and one
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
        self.tractions.is_empty() && self.platens.is_empty() && !loaded
    }

    /// Measures force and displacement of the curve on a surface, along `direction` (any length). The force is the
    /// force on the body from the prescribed values, the platen and the tractions of this surface. The displacement
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
        let nodes = set.nodes(mesh, domain)?;
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
