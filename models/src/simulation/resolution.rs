//! Check that a mesh resolves the width of a crack.

use std::collections::BTreeMap;

use fem::{CrackDensity, TetMesh};

use super::setup::Setup;
use crate::case::MaterialCase;

/// Returns a note for a simulation on a mesh whose node distance is larger than the crack width ℓ₀; `None` if the node
/// distance is smaller, or if no material can break.
///
/// With the node distance h, the effective toughness is Gc (1 + h/(2 ℓ₀)) for AT2 and Gc (1 + 3h/(8 ℓ₀)) for AT1.
///
/// # Reference
/// Bourdin, Francfort & Marigo, The variational approach to fracture, J. Elasticity 91 (2008), section
/// 8.1.1: Gc (1 + h/(4 c l₀)) with c = 1/2 and 2/3.
pub(crate) fn resolution_note(setup: &Setup<'_>, mesh: &TetMesh) -> Option<String> {
    note_at_edge(setup, mesh, mesh.mean_edge())
}

/// Returns the note of [`resolution_note`] for a mesh with the regions of `mesh` and another mean length of its edges, mm.
pub(crate) fn note_at_edge(setup: &Setup<'_>, mesh: &TetMesh, mean_edge_mm: f64) -> Option<String> {
    let field = setup.phase_field.filter(|_| can_break(setup.material, mesh))?;
    let (order, width) = (f64::from(u8::from(setup.order)), field.length_mm);
    let apart = mean_edge_mm / order;
    let part = match field.model {
        CrackDensity::At2 => 1.0 / 2.0,
        CrackDensity::At1 => 3.0 / 8.0,
    };
    (apart > width).then(|| {
        format!(
            "nodes are {apart:.3} mm apart, cracks {width} mm wide: where a crack forms, the mesh makes \
             the effective toughness {:.1} times as large, Gc (1 + {part} h/l0); take a finer mesh, or \
             compare two",
            1.0 + part * apart / width
        )
    })
}

/// Whether a region of the mesh has a toughness, so that it can break.
pub(crate) fn can_break(materials: &BTreeMap<String, MaterialCase>, mesh: &TetMesh) -> bool {
    let toughness = |region: &String| materials.get(region)?.toughness_n_per_mm;
    mesh.regions.iter().any(|region| toughness(region).is_some())
}
