//! Sets of nodes selected by their reference positions, and surfaces by name.

use nalgebra::Vector3;

use super::function::Function;
use crate::element::Domain;
use crate::error::FemError;
use fem_mesh::TetMesh;

/// A node counts as lying on a segment if its distance from the segment is at most this fraction of the segment's
/// length.
const ON_SEGMENT: f64 = 1e-6;

/// Selection of nodes, for supports of single nodes and edges. [`Conditions::node_set`](crate::Conditions::node_set)
/// names the selection. [`fix`](crate::Conditions::fix), [`prescribe`](crate::Conditions::prescribe),
/// [`prescribe_damage`](crate::Conditions::prescribe_damage) and [`measure`](crate::Conditions::measure) accept this
/// name like the name of a surface.
///
/// If a force acts on a single node or on an edge of a solid, the displacement there grows without limit as the mesh is
/// refined. Use such supports only where the force is zero or small, or where the local field does not matter.
#[derive(Clone, Debug)]
pub struct NodeSet(Selection);

/// Rule that selects nodes.
#[derive(Clone, Debug)]
enum Selection {
    Nearest([f64; 3]),
    Segment([[f64; 3]; 2]),
    Common([String; 2]),
    Matching(Function<bool>),
}

impl NodeSet {
    /// Selects the node that is nearest to a reference position, mm.
    pub fn nearest(position_mm: [f64; 3]) -> Self {
        Self(Selection::Nearest(position_mm))
    }

    /// Selects the nodes on the straight segment between two reference positions, mm.
    pub fn segment(from_mm: [f64; 3], to_mm: [f64; 3]) -> Self {
        Self(Selection::Segment([from_mm, to_mm]))
    }

    /// Selects the nodes that two surfaces have in common: an edge of the body.
    pub fn common(first_surface: &str, second_surface: &str) -> Self {
        Self(Selection::Common([first_surface.into(), second_surface.into()]))
    }

    /// Selects the nodes whose reference position (mm) satisfies a condition.
    pub fn matching(is_selected: impl Fn([f64; 3]) -> bool + Send + Sync + 'static) -> Self {
        Self(Selection::Matching(Function::new(move |x, _| is_selected(x))))
    }

    /// Returns the first coordinate of the selection that is not finite, and the name of the selection.
    fn infinite(&self) -> Option<(&'static str, f64)> {
        let (field, positions) = match &self.0 {
            Selection::Nearest(x) => ("nearest", std::slice::from_ref(x)),
            Selection::Segment(ends) => ("segment", &ends[..]),
            Selection::Common(_) | Selection::Matching(_) => return None,
        };
        let mut coordinates = positions.iter().flatten();
        coordinates.find(|x| !x.is_finite()).map(|&x| (field, x))
    }

    /// Returns the nodes of the set `set_name` in increasing order.
    ///
    /// # Errors
    /// [`FemError::OutOfRange`] if a coordinate is not finite; [`FemError::MissingSurface`].
    pub(super) fn nodes(
        &self,
        set_name: &str,
        mesh: &TetMesh,
        domain: &dyn Domain,
    ) -> Result<Vec<u32>, FemError> {
        if let Some((field, x)) = self.infinite() {
            let entity = format!("node set '{set_name}'");
            let requirement = "a position with finite coordinates, mm";
            return Err(FemError::parameter(&entity, field, x, requirement));
        }
        let positions = domain.nodes();
        let all = 0..positions.len() as u32;
        let at = |n: u32| Vector3::from(positions[n as usize]);
        Ok(match &self.0 {
            Selection::Nearest(x) => {
                let distance = |n: &u32| (at(*n) - Vector3::from(*x)).norm();
                all.min_by(|a, b| distance(a).total_cmp(&distance(b))).into_iter().collect()
            }
            Selection::Segment([from, to]) => {
                let (from, to) = (Vector3::from(*from), Vector3::from(*to));
                let along = to - from;
                let is_on = |n: &u32| {
                    let share = (at(*n) - from).dot(&along) / along.norm_squared();
                    let nearest = from + along * share.clamp(0.0, 1.0);
                    (at(*n) - nearest).norm() <= ON_SEGMENT * along.norm()
                };
                all.filter(is_on).collect()
            }
            Selection::Common(surfaces) => {
                let nodes = |name: &String| {
                    Ok::<_, FemError>(domain.nodes_on(triangles(
                        mesh,
                        name,
                        "an edge is selected",
                    )?))
                };
                let (mut first, second) = (nodes(&surfaces[0])?, nodes(&surfaces[1])?);
                first.retain(|n| second.binary_search(n).is_ok());
                first
            }
            Selection::Matching(f) => all.filter(|&n| f.at(positions[n as usize], 0.0)).collect(),
        })
    }
}

/// Returns the triangles of a surface, or an error if the surface is missing or empty.
pub(super) fn triangles<'a>(
    mesh: &'a TetMesh,
    name: &str,
    role: &'static str,
) -> Result<&'a [[u32; 3]], FemError> {
    match mesh.surfaces.get(name) {
        Some(triangles) if !triangles.is_empty() => Ok(triangles),
        _ => {
            let names: Vec<_> = mesh
                .surfaces
                .iter()
                .filter(|(_, t)| !t.is_empty())
                .map(|(n, _)| format!("'{n}'"))
                .collect();
            let present = if names.is_empty() { "none".into() } else { names.join(", ") };
            Err(FemError::MissingSurface { name: name.into(), role, present })
        }
    }
}
