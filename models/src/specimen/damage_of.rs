//! Picture of the damage in a simulated body.

use fem::{Fields, Problem};

use super::mesh::grain_parts;
use crate::report::{DamagedBody, Raster, damage_picture};

/// Picture of the specimen, cut open, with the damage of `fields`.
pub(crate) fn damage_of(problem: &Problem, fields: &Fields) -> Raster {
    let tets = problem.linear_tets();
    // an element of higher order is drawn as several linear tetrahedra
    let grain_shares = grain_parts(problem.mesh());
    let each = tets.len() / grain_shares.len().max(1);
    let grain: Vec<f64> =
        grain_shares.into_iter().flat_map(|share| std::iter::repeat_n(share, each)).collect();
    damage_picture(&DamagedBody {
        nodes: problem.nodes(),
        tets: &tets,
        grain: &grain,
        displacement: &fields.displacement,
        damage: &fields.damage,
    })
}
