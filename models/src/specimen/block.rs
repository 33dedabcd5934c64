//! Mesh of a block with a notch.

use fem::{Block, TetMesh};

use crate::case::NotchCase;

/// Distance below which two planes of the mesh are the same plane, relative to the size of the block.
const SAME: f64 = 1e-9;

/// Meshes a block of the size (length along x, width along y, depth along z, mm) with the notch. The block stands on z = 0,
/// in the middle of x and y. `planes_mm` are coordinates along x where nodes are needed; no cell is longer than `spacing_mm`.
///
/// The surfaces are `left`, `right` (x), `front`, `back` (y), `bottom`, `top` (z) and `notch`.
///
/// # Errors
/// The reason, if the block has too many cells.
pub(crate) fn block_mesh(
    size_mm: [f64; 3],
    notch: Option<NotchCase>,
    planes_mm: &[f64],
    spacing_mm: f64,
) -> Result<TetMesh, String> {
    let [length, width, depth] = size_mm;
    let slot = notch.map(|notch| [0.5 * notch.width_mm, notch.depth_mm]);
    let inner = slot.map_or_else(Vec::new, |[half, _]| vec![-half, half]);
    let x = [vec![-0.5 * length, 0.5 * length], inner, planes_mm.to_vec()].concat();
    let z = [vec![0.0, depth], slot.map_or_else(Vec::new, |[_, deep]| vec![deep])].concat();
    let fixed = [x, vec![-0.5 * width, 0.5 * width], z];
    let planes_mm = fixed.map(|fixed| divided(fixed, spacing_mm));
    let block = Block { planes_mm, split: Default::default() };
    let mesh = block.build().map_err(|error| error.to_string())?;
    let Some([half, deep]) = slot else { return Ok(mesh) };
    let is_cut = |[x, _, z]: [f64; 3]| x.abs() < half && z < deep;
    Ok(without(mesh, is_cut).with_surfaces(|centre, normal| {
        const NAMES: [[&str; 2]; 3] = [["left", "right"], ["front", "back"], ["bottom", "top"]];
        let axis = (0..3).max_by(|&a, &b| normal[a].abs().total_cmp(&normal[b].abs()))?;
        let on_slot = match axis {
            0 => centre[0].abs() < 0.5 * length * (1.0 - SAME),
            2 => normal[2] < 0.0 && centre[2] > SAME * depth,
            _ => false,
        };
        Some(if on_slot { "notch" } else { NAMES[axis][usize::from(normal[axis] > 0.0)] })
    }))
}

/// Divides the intervals between fixed coordinates into equal parts that are not longer than `spacing`.
fn divided(mut fixed: Vec<f64>, spacing: f64) -> Vec<f64> {
    fixed.sort_by(f64::total_cmp);
    let size = fixed[fixed.len() - 1] - fixed[0];
    fixed.dedup_by(|a, b| (*a - *b).abs() <= SAME * size);
    let mut planes = vec![fixed[0]];
    for pair in fixed.windows(2) {
        let parts = ((pair[1] - pair[0]) / spacing * (1.0 - SAME)).ceil().max(1.0);
        let inside = (1..parts as usize).map(|part| part as f64 / parts);
        planes.extend(inside.map(|part| pair[0] + part * (pair[1] - pair[0])));
        planes.push(pair[1]);
    }
    planes
}

/// Removes the tetrahedra whose centroids satisfy a condition, and the nodes that no other tetrahedron uses.
fn without(mesh: TetMesh, is_cut: impl Fn([f64; 3]) -> bool) -> TetMesh {
    let centroid = |tet: usize| {
        let corners = mesh.corners(tet);
        [0, 1, 2].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0)
    };
    let rest: Vec<usize> = (0..mesh.tets.len()).filter(|&tet| !is_cut(centroid(tet))).collect();
    let mut number = vec![None; mesh.nodes.len()];
    let mut nodes = Vec::new();
    let mut renumbered = |node: u32| {
        *number[node as usize].get_or_insert_with(|| {
            nodes.push(mesh.nodes[node as usize]);
            nodes.len() as u32 - 1
        })
    };
    let tets = rest.iter().map(|&tet| mesh.tets[tet].map(&mut renumbered)).collect();
    let region_of = rest.iter().map(|&tet| mesh.region_of[tet]).collect();
    TetMesh { nodes, tets, region_of, regions: mesh.regions, ..TetMesh::default() }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The notch removes its volume and adds its walls; all required planes have nodes.
    #[test]
    fn a_notch_is_cut_out_of_a_block() {
        let (size, notch) = ([24.0, 5.0, 6.0], NotchCase { depth_mm: 1.8, width_mm: 0.5 });
        let mesh = block_mesh(size, Some(notch), &[-10.0, 0.0, 10.0], 1.3).unwrap();
        mesh.validate().unwrap();
        assert!((mesh.volume() - (24.0 * 5.0 * 6.0 - 1.8 * 0.5 * 5.0)).abs() < 1e-9);
        let area = |name: &str| {
            let faces = mesh.surfaces[name].iter().map(|face| {
                let [a, b, c] = face.map(|node| nalgebra::Vector3::from(mesh.nodes[node as usize]));
                0.5 * (b - a).cross(&(c - a)).norm()
            });
            faces.sum::<f64>()
        };
        assert!((area("notch") - 5.0 * (2.0 * 1.8 + 0.5)).abs() < 1e-9);
        assert!((area("bottom") - 5.0 * 23.5).abs() < 1e-9);
        assert!((area("top") - 5.0 * 24.0).abs() < 1e-9 && (area("left") - 30.0).abs() < 1e-9);
        for x in [-12.0, -10.0, -0.25, 0.0, 0.25, 10.0] {
            assert!(mesh.nodes.iter().any(|node| (node[0] - x).abs() < 1e-12), "{x}");
        }
        let longest = mesh.edges().into_iter().map(|[a, b]| {
            let [a, b] = [a, b].map(|node| mesh.nodes[node as usize]);
            (0..3).map(|axis| (a[axis] - b[axis]).abs()).fold(0.0, f64::max)
        });
        assert!(longest.fold(0.0, f64::max) <= 1.3 + 1e-12);
        // without a notch the block has six surfaces
        let plain = block_mesh(size, None, &[], 3.0).unwrap();
        assert!(plain.surfaces.len() == 6 && (plain.volume() - 720.0).abs() < 1e-9);
    }
}
