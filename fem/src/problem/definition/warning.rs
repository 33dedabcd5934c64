//! Properties of a problem that do not stop a run but make its result inaccurate.

use super::definition::Definition;
use crate::element::Order;

/// Property of a problem that makes its result wrong without an error.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum ProblemWarning {
    /// Volumetric locking: linear elements cannot change their shape at constant volume.
    #[error(
        "forces may come out too large: linear tetrahedra lock where a material is nearly incompressible, and \
         region '{region}' has a Poisson's ratio of {poisson} (a block glued at its ends, six elements high, is too \
         stiff by 12 % at 0.45, 45 % at 0.49 and 240 % at 0.499); take quadratic elements"
    )]
    VolumetricLocking {
        /// Name of the region.
        region: String,
        /// Poisson's ratio of the region at small strain.
        poisson: f64,
    },
    /// Shear locking: linear elements are too stiff in bending.
    #[error(
        "bending may come out many times too stiff: linear tetrahedra lock in a slender body, and this one is \
         only {across:.1} edges of its mesh thick ({thickness_mm:.3} mm) at a size of {size_mm:.3} mm; take \
         quadratic elements, or edges of at most a quarter of that thickness"
    )]
    BendingLocking {
        /// Mean thickness of the body, mm.
        thickness_mm: f64,
        /// Largest extent of the body, mm.
        size_mm: f64,
        /// Thickness divided by the mean edge length of the elements.
        across: f64,
    },
    /// Some parts of the mesh have no common face.
    #[error(
        "the mesh falls into {parts} parts that are joined only by an edge or a node, as by a hinge (one of them \
         has tetrahedron {tet}): they turn freely about each other; make them share faces, or remove the small ones"
    )]
    Hinges {
        /// The number of parts.
        parts: usize,
        /// The first tetrahedron that is not in the part of tetrahedron 0.
        tet: usize,
    },
}

/// Smallest Poisson's ratio for which a warning about volumetric locking is given.
const INCOMPRESSIBLE: f64 = 0.45;
/// Smallest ratio of extent to mean thickness for which a body counts as slender.
const SLENDER: f64 = 15.0;
/// Number of edges across the thickness below which a slender body of linear elements is too stiff. A square bar with
/// ten cubes across has 3.8 edges and bends by 3 % too little; a bar with four cubes across has 1.5 and bends by 17 %
/// too little.
const ACROSS: f64 = 3.5;

/// Returns the properties that make the result of a problem wrong without an error.
pub(crate) fn warnings(parts: &Definition) -> Vec<ProblemWarning> {
    let mut warnings = Vec::new();
    if parts.order == Order::Linear {
        warnings.extend(volumetric_locking(parts));
        warnings.extend(bending_locking(parts));
    }
    warnings.extend(hinges(parts));
    warnings
}

/// Warns about the region with the largest Poisson's ratio, if it is nearly incompressible.
fn volumetric_locking(parts: &Definition) -> Option<ProblemWarning> {
    let poisson = |k: usize| parts.materials[k].elasticity.poisson();
    let region = (0..parts.materials.len()).max_by(|&a, &b| poisson(a).total_cmp(&poisson(b)))?;
    (poisson(region) >= INCOMPRESSIBLE).then(|| ProblemWarning::VolumetricLocking {
        region: parts.mesh.regions[region].clone(),
        poisson: poisson(region),
    })
}

/// Warns about a slender body. The thickness is twice the volume divided by the surface area: exact for a plate, half
/// the thickness of a square bar.
fn bending_locking(parts: &Definition) -> Option<ProblemWarning> {
    let mesh = &parts.mesh;
    let thickness_mm = 2.0 * mesh.volume() / mesh.boundary_area();
    let size_mm = mesh.largest_extent();
    let across = thickness_mm / mesh.mean_edge();
    (size_mm > SLENDER * thickness_mm && across < ACROSS)
        .then_some(ProblemWarning::BendingLocking { thickness_mm, size_mm, across })
}

fn hinges(parts: &Definition) -> Option<ProblemWarning> {
    let part_of = parts.mesh.parts_by_faces();
    let tet = part_of.iter().position(|&part| part != 0)?;
    let mut roots = part_of;
    roots.sort_unstable();
    roots.dedup();
    Some(ProblemWarning::Hinges { parts: roots.len(), tet })
}
