//! Writer of MSH 4.1 ASCII files that Gmsh can open.

use std::collections::BTreeMap;
use std::fmt::Write as _;
use std::path::Path;

use super::names::GmshNames;
use super::{data, grains, second_order};
use crate::error::MeshError;
use crate::mesh::TetMesh;
use crate::mesh::topology::edge_index;
use crate::mesh::vector::Point;

/// Number of the physical group of the first surface. The physical groups of regions are numbered from 1.
const FIRST_SURFACE: i32 = 11;

/// Writes a mesh as MSH 4.1 ASCII and returns the numbers of its physical groups.
///
/// Each region becomes one physical group of volumes; these groups are numbered 1, 2, … in the order of the regions.
/// Each surface becomes one surface entity and one physical group, numbered from 11: bottom, top, side, then the other
/// surfaces by name. Groups have names, and entities have bounding boxes. Each grain g (0 for the matrix) in region r
/// of R regions becomes one volume entity with the elementary tag g R + r, from which [`read`](super::read) computes
/// the grain numbers. The elements of each volume entity are one block, numbered in the order of the tetrahedra of the
/// mesh. A mesh with curved edges is written with second-order elements. Mixtures are written as element data of all
/// elements; the data of triangles are zero. Reading the file returns an identical mesh, to the last bit.
///
/// # Errors
/// [`MeshError`] if the mesh is not valid ([`TetMesh::validate`]) or the file cannot be written.
///
/// # Example
/// ```
/// use fem_mesh::{CylinderLattice, gmsh};
///
/// let mesh = CylinderLattice { radius_mm: 2.5, height_mm: 4.4, spacing_mm: 1.5 }.build()?;
/// let path = std::env::temp_dir().join("fem-doc-write.msh");
/// let names = gmsh::write(&path, &mesh)?;
/// assert_eq!(gmsh::read(&path, &names)?, mesh);
/// # std::fs::remove_file(path)?;
/// # Ok::<(), Box<dyn std::error::Error>>(())
/// ```
pub fn write(path: impl AsRef<Path>, mesh: &TetMesh) -> Result<GmshNames, MeshError> {
    mesh.validate()?;
    let path = path.as_ref();
    let surfaces = ordered_surfaces(mesh);
    let tags = grains::tags(mesh).map_err(|tet| MeshError::File {
        path: path.into(),
        place: format!("tetrahedron {tet}"),
        message: "its grain number is too large for the format; number the grains from 1".into(),
    })?;
    let text = text(mesh, &tags, &surfaces).expect("writing to a string cannot fail");
    std::fs::write(path, text).map_err(|error| MeshError::io("write", path, error))?;
    let numbered = |first: i32, names: Vec<&str>| {
        (first..).zip(names).map(|(k, name)| (name.into(), k.into())).collect()
    };
    Ok(GmshNames {
        regions: numbered(1, mesh.regions.iter().map(String::as_str).collect()),
        surfaces: numbered(FIRST_SURFACE, surfaces.iter().map(|&(name, _)| name).collect()),
    })
}

fn ordered_surfaces(mesh: &TetMesh) -> Vec<(&str, &[[u32; 3]])> {
    let rank = |name: &str| ["bottom", "top", "side"].iter().position(|&n| n == name).unwrap_or(3);
    let mut surfaces: Vec<_> =
        mesh.surfaces.iter().map(|(name, faces)| (name.as_str(), faces.as_slice())).collect();
    // the sort is stable, so that all other surfaces stay sorted by name
    surfaces.sort_by_key(|&(name, _)| rank(name));
    surfaces
}

fn text(
    mesh: &TetMesh,
    tags: &[i32],
    surfaces: &[(&str, &[[u32; 3]])],
) -> Result<String, std::fmt::Error> {
    let mut out = String::from("$MeshFormat\n4.1 0 8\n$EndMeshFormat\n");
    let faces = surfaces.len();

    writeln!(out, "$PhysicalNames\n{}", mesh.regions.len() + faces)?;
    for (number, (name, _)) in (FIRST_SURFACE..).zip(surfaces) {
        writeln!(out, "2 {number} \"{name}\"")?;
    }
    for (number, name) in (1..).zip(&mesh.regions) {
        writeln!(out, "3 {number} \"{name}\"")?;
    }
    out.push_str("$EndPhysicalNames\n");

    // bounding box and region of each volume entity, by elementary tag
    let mut volumes: BTreeMap<i32, (BoundingBox, u16)> = BTreeMap::new();
    for ((tet, &tag), &region) in mesh.tets.iter().zip(tags).zip(&mesh.region_of) {
        let (bounds, _) = volumes.entry(tag).or_insert((EMPTY_BOX, region));
        extend(bounds, mesh, tet);
    }
    writeln!(out, "$Entities\n0 0 {faces} {}", volumes.len())?;
    for (number, (_, triangles)) in (FIRST_SURFACE..).zip(surfaces) {
        let mut bounds = EMPTY_BOX;
        extend(&mut bounds, mesh, triangles.as_flattened());
        entity(&mut out, number, bounds, number)?;
    }
    for (&tag, &(bounds, region)) in &volumes {
        entity(&mut out, tag, bounds, i32::from(region) + 1)?;
    }
    out.push_str("$EndEntities\n");

    // write all nodes as one block, because Gmsh does not require that a node lies on the entity of its block
    let curved = !mesh.edge_points.is_empty();
    let edges = if curved { mesh.all_edges() } else { Vec::new() };
    let corners = mesh.nodes.len();
    let (nodes, first) = (corners + edges.len(), volumes.keys().next().copied().unwrap_or(1));
    writeln!(out, "$Nodes\n1 {nodes} 1 {nodes}\n3 {first} 0 {nodes}")?;
    for tag in 1..=nodes {
        writeln!(out, "{tag}")?;
    }
    for [x, y, z] in mesh.nodes.iter().chain(edges.iter().map(|(_, point)| point)) {
        writeln!(out, "{x:?} {y:?} {z:?}")?;
    }
    out.push_str("$EndNodes\n");

    let triangles = surfaces.iter().map(|(_, faces)| faces.len()).sum::<usize>();
    let elements = triangles + mesh.tets.len();
    writeln!(out, "$Elements\n{} {elements} 1 {elements}", volumes.len() + faces)?;
    // writes one element: its tag, its corners, and the mid-edge nodes if the element is of second order
    let element = |out: &mut String, tag: usize, nodes: &[u32], sides: &[[usize; 2]]| {
        write!(out, "{tag}")?;
        nodes.iter().try_for_each(|node| write!(out, " {}", node + 1))?;
        if curved {
            for ends in sides.iter().map(|side| side.map(|end| nodes[end])) {
                write!(out, " {}", corners + edge_index(&edges, ends) + 1)?;
            }
        }
        out.push('\n');
        std::fmt::Result::Ok(())
    };
    let [triangle, tetrahedron] = if curved { [9, 11] } else { [2, 4] };
    let mut tag = 0;
    for (number, (_, triangles)) in (FIRST_SURFACE..).zip(surfaces) {
        writeln!(out, "2 {number} {triangle} {}", triangles.len())?;
        for nodes in *triangles {
            tag += 1;
            element(&mut out, tag, nodes, &second_order::EDGES[..3])?;
        }
    }
    // write one block per volume entity; element numbers follow the order of the tetrahedra of the mesh
    let mut by_volume: Vec<usize> = (0..mesh.tets.len()).collect();
    by_volume.sort_by_key(|&tet| tags[tet]);
    for block in by_volume.chunk_by(|&a, &b| tags[a] == tags[b]) {
        writeln!(out, "3 {} {tetrahedron} {}", tags[block[0]], block.len())?;
        for &tet in block {
            element(&mut out, triangles + tet + 1, &mesh.tets[tet], &second_order::EDGES)?;
        }
    }
    out.push_str("$EndElements\n");
    data::write(&mut out, mesh, triangles, &by_volume)?;
    Ok(out)
}

/// Minimum and maximum coordinates (mm).
type BoundingBox = [Point; 2];

const EMPTY_BOX: BoundingBox = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];

fn entity(out: &mut String, tag: i32, bounds: BoundingBox, group: i32) -> std::fmt::Result {
    let [[a, b, c], [d, e, f]] = bounds;
    writeln!(out, "{tag} {a:?} {b:?} {c:?} {d:?} {e:?} {f:?} 1 {group} 0")
}

fn extend(bounds: &mut BoundingBox, mesh: &TetMesh, nodes: &[u32]) {
    for &node in nodes {
        let point = mesh.nodes[node as usize];
        for k in 0..3 {
            bounds[0][k] = bounds[0][k].min(point[k]);
            bounds[1][k] = bounds[1][k].max(point[k]);
        }
    }
}
