//! A column with a weak layer, which snaps back when the layer breaks.

use fem::{
    ArcLength, CompressionTest, CrackDensity, Fracture, Irreversibility, Material, Order,
    PhaseField, Problem, Schedule, TetMesh,
};

use super::{prism, test};

/// Mesh of a column with a cross-section of 1 mm × 1 mm, and one cell between successive `levels` (mm).
pub(crate) fn layers(levels: &[f64]) -> TetMesh {
    let mut mesh = prism(1, false);
    mesh.nodes.clear();
    mesh.tets.clear();
    for &z in levels {
        mesh.nodes.extend([[0.0, 0.0, z], [1.0, 0.0, z], [0.0, 1.0, z], [1.0, 1.0, z]]);
    }
    let cells = levels.len() as u32 - 1;
    for layer in 0..cells {
        let corner = |c: u32| 4 * layer + c;
        for [a, b] in [[1, 3], [3, 2], [2, 6], [6, 4], [4, 5], [5, 1]] {
            mesh.tets.push([corner(0), corner(a), corner(b), corner(7)]);
        }
    }
    mesh.region_of = vec![0; mesh.tets.len()];
    let top = 4 * cells;
    mesh.surfaces.insert("bottom".into(), vec![[0, 3, 1], [0, 2, 3]]);
    mesh.surfaces.insert("top".into(), vec![[top, top + 1, top + 3], [top, top + 3, top + 2]]);
    mesh
}

/// Mesh of a column: a weak layer of height 0.5 mm, below an elastic layer of height 10 mm.
pub(crate) fn column() -> TetMesh {
    let mut mesh = layers(&[0.0, 0.5, 5.0, 10.5]);
    mesh.region_of.iter_mut().skip(6).for_each(|region| *region = 1);
    mesh.regions = vec!["weak".into(), "elastic".into()];
    mesh
}

/// Compression test of the column by arc-length steps, until the force is a twentieth of its maximum.
pub(crate) fn snap_back(model: CrackDensity) -> Problem {
    let elastic = Material::hencky(100.0, 0.0);
    let weak = elastic.clone().with_fracture(Fracture::new(0.1));
    let field =
        PhaseField { model, irreversibility: Irreversibility::ActiveSet, ..PhaseField::new(1.0) };
    let steps = ArcLength { step: 0.02, release_n_mm: 1e-3 };
    let schedule = Schedule::new(1.0, steps).stop_below_peak(0.95);
    let loading = CompressionTest::new(1.0, schedule);
    test(column(), Order::Linear, vec![weak, elastic], Some(field), loading, 1e-10)
}
