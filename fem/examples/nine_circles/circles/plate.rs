//! Meshes of plates and tubes.

use std::collections::BTreeMap;

use fem::{Axis, Block, BlockError, Conditions, NodeSet, TetMesh};

/// Positions on a grid plane differ from it by less than this distance, mm.
pub(crate) const ROUNDING: f64 = 1e-7;

/// Coordinates from 0 to `to`: cells of size `h` up to `fine`, then cells that grow by a factor of 1.35 up to the size
/// `largest`.
pub(crate) fn graded(h: f64, fine: f64, to: f64, largest: f64) -> Vec<f64> {
    let mut coordinates = vec![0.0];
    let mut step = h;
    loop {
        let last = coordinates[coordinates.len() - 1];
        if last > fine - 0.5 * h {
            step = largest.min(1.35 * step);
        }
        if last + 1.4 * step >= to {
            coordinates.push(to);
            return coordinates;
        }
        coordinates.push(last + step);
    }
}

/// Coordinates from `from` to `to` with cells of size `h` between `centre − fine[0]` and `centre + fine[1]`, and larger cells
/// outside.
pub(crate) fn around(
    centre: f64,
    [from, to]: [f64; 2],
    h: f64,
    fine: [f64; 2],
    largest: f64,
) -> Vec<f64> {
    let below = graded(h, fine[0], centre - from, largest);
    let above = graded(h, fine[1], to - centre, largest);
    let mut coordinates: Vec<f64> = below.iter().skip(1).rev().map(|d| centre - d).collect();
    coordinates.extend(above.iter().map(|d| centre + d));
    coordinates
}

/// Upper half of a plate in the x–z plane with a crack on z = 0, up to x = `tip_mm`. The row of elements at the crack plane is
/// half as high as the others: together with its mirror image, it is one row.
#[derive(Clone, Copy, Debug)]
pub(crate) struct HalfPlate {
    pub(crate) width_mm: f64,
    /// Height of the half.
    pub(crate) height_mm: f64,
    pub(crate) tip_mm: f64,
    /// Size of the elements where the crack grows, and thickness of the plate.
    pub(crate) size_mm: f64,
    /// Lengths of the fine mesh behind and ahead of the tip, and above the crack plane, mm.
    pub(crate) fine_mm: [f64; 3],
    /// Size of the largest elements, mm.
    pub(crate) largest_mm: f64,
}

impl HalfPlate {
    pub(crate) fn mesh(&self) -> Result<TetMesh, BlockError> {
        let Self { width_mm, height_mm, tip_mm, size_mm: h, fine_mm, largest_mm } = *self;
        let [behind, ahead, above] = fine_mm;
        let along = around(tip_mm, [0.0, width_mm], h, [behind, ahead], largest_mm);
        let mut across = vec![0.0];
        across
            .extend(graded(h, above, height_mm - 0.5 * h, largest_mm).iter().map(|z| z + 0.5 * h));
        Block { planes_mm: [along, vec![0.0, h], across], ..Block::new([1.0; 3], [1; 3]) }.build()
    }

    /// Returns the nodes of the crack plane ahead of the tip.
    pub(crate) fn ligament(&self) -> NodeSet {
        let tip = self.tip_mm;
        NodeSet::matching(move |[x, _, z]| z < ROUNDING && x > tip - ROUNDING)
    }

    /// Returns the nodes of the row of elements at the crack: a crack that has grown leaves this row damaged.
    pub(crate) fn crack(&self) -> NodeSet {
        let (tip, row) = (self.tip_mm, 0.5 * self.size_mm);
        NodeSet::matching(move |[x, _, z]| z < row + ROUNDING && x < tip + ROUNDING)
    }

    /// Returns the conditions of a thin plate (plane stress) with free crack faces. With `is_damaged`, the crack faces are
    /// fully damaged.
    pub(crate) fn conditions(&self, is_damaged: bool) -> Conditions {
        let conditions = Conditions::new()
            .node_set("ligament", self.ligament())
            .node_set("crack", self.crack())
            .fix("ligament", [Axis::Z])
            .fix("front", [Axis::Y]);
        if is_damaged { conditions.prescribe_damage("crack", |_, _| 1.0) } else { conditions }
    }
}

/// Returns the mesh with one node in place of all nodes at the same position, and without named surfaces.
///
/// Tetrahedra with two nodes at the same position are dropped.
pub(crate) fn merged(mut mesh: TetMesh) -> TetMesh {
    let key = |x: &[f64; 3]| x.map(|c| (c / ROUNDING).round() as i64);
    let mut first = BTreeMap::new();
    let mut nodes = Vec::new();
    let mut number = Vec::new();
    for x in &mesh.nodes {
        let n = *first.entry(key(x)).or_insert_with(|| {
            nodes.push(*x);
            nodes.len() as u32 - 1
        });
        number.push(n);
    }
    let renumbered = mesh.tets.iter().map(|tet| tet.map(|n| number[n as usize]));
    let is_sound = |tet: &[u32; 4]| (0..4).all(|k| !tet[k + 1..].contains(&tet[k]));
    mesh.tets = renumbered.filter(is_sound).collect();
    mesh.region_of.truncate(mesh.tets.len());
    mesh.nodes = nodes;
    mesh.surfaces.clear();
    // elements are linear
    mesh.edge_points.clear();
    mesh
}

/// Tube with its axis along z, of `cells` elements around and along.
pub(crate) fn tube(
    radii_mm: [f64; 2],
    length_mm: f64,
    cells: [usize; 2],
) -> Result<TetMesh, BlockError> {
    let [inner, outer] = radii_mm;
    let block = Block::new([1.0, outer - inner, length_mm], [cells[0], 1, cells[1]]).build()?;
    let bent = block.mapped(|[x, y, z]| {
        let angle = std::f64::consts::TAU * x;
        let radius = outer - y;
        [radius * angle.cos(), radius * angle.sin(), z]
    });
    Ok(merged(bent).with_surfaces(|_, normal| {
        let up = normal[2];
        (up.abs() > 0.9).then_some(if up > 0.0 { "top" } else { "bottom" })
    }))
}
