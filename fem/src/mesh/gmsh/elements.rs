//! What both versions of the format come down to, and how a mesh is made of it.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::grains;
use super::names::{GmshNames, PhysicalGroup};
use super::source::{Fault, Source};
use crate::mesh::TetMesh;
use crate::mesh::tet_mesh::{is_even_turn, sorted};
use crate::mesh::vector::{Point, tet_volume};

/// Nodes and elements of a file, with their physical groups.
#[derive(Default)]
pub(super) struct Contents {
    /// Names of physical groups by (dimension, number).
    pub(super) names: BTreeMap<(i32, i32), String>,
    /// Physical groups of each entity by (dimension, entity), in version 4.
    pub(super) groups: HashMap<(i32, i32), Vec<i32>>,
    pub(super) points: Vec<Point>,
    /// Position in `points` of each node tag.
    pub(super) position: HashMap<u64, u32>,
    pub(super) triangles: Vec<Element<3>>,
    pub(super) tets: Vec<Element<4>>,
}

/// Corner nodes (positions) of an element, its elementary tag and its physical groups.
pub(super) struct Element<const N: usize> {
    nodes: [u32; N],
    entity: i32,
    groups: Vec<i32>,
}

/// Reads `$PhysicalNames`, text in both kinds of files.
pub(super) fn physical_names(source: &mut Source, contents: &mut Contents) -> Result<(), Fault> {
    let count: usize = source.text("the number of physical names")?;
    for _ in 0..count {
        let dimension = source.text("a dimension")?;
        let number = source.text("a physical group's number")?;
        let name = source.text_line()?.trim_matches('"').to_string();
        contents.names.insert((dimension, number), name);
    }
    Ok(())
}

/// Dimension and number of nodes of Gmsh's element types.
pub(super) fn shape(kind: i32) -> Option<(i32, usize)> {
    Some(match kind {
        15 => (0, 1),
        1 => (1, 2),
        8 => (1, 3),
        2 => (2, 3),
        9 => (2, 6),
        3 => (2, 4),
        16 => (2, 8),
        10 => (2, 9),
        4 => (3, 4),
        11 => (3, 10),
        5 => (3, 8),
        6 => (3, 6),
        7 => (3, 5),
        _ => return None,
    })
}

impl Contents {
    /// Adds a node.
    pub(super) fn node(&mut self, source: &Source, tag: u64, point: Point) -> Result<(), Fault> {
        let position = u32::try_from(self.points.len())
            .map_err(|_| source.fault("more than 2³² nodes".into()))?;
        if self.position.insert(tag, position).is_some() {
            return Err(source.fault(format!("node {tag} is defined twice; renumber the mesh")));
        }
        self.points.push(point);
        Ok(())
    }

    /// Reads the nodes of an element and keeps it if it is a triangle or a tetrahedron.
    pub(super) fn element(
        &mut self,
        source: &mut Source,
        kind: i32,
        entity: i32,
        groups: &[i32],
        mut tag: impl FnMut(&mut Source) -> Result<u64, Fault>,
    ) -> Result<(), Fault> {
        let Some((dimension, count)) = shape(kind) else {
            return Err(source.fault(format!(
                "element type {kind} is not read; mesh with tetrahedra of order 1 or 2"
            )));
        };
        let is_simplex = matches!(kind, 2 | 9 | 4 | 11);
        let mut corners = [0; 4];
        for k in 0..count {
            let tag = tag(source)?;
            if is_simplex && k <= dimension as usize {
                corners[k] = *self.position.get(&tag).ok_or_else(|| {
                    source.fault(format!("an element refers to node {tag}, which is not there"))
                })?;
            }
        }
        let groups = groups.to_vec();
        match (dimension, is_simplex) {
            (2, true) => {
                let nodes = [corners[0], corners[1], corners[2]];
                self.triangles.push(Element { nodes, entity, groups });
            }
            (3, true) => self.tets.push(Element { nodes: corners, entity, groups }),
            (3, false) => {
                return Err(source.fault(format!(
                    "element type {kind} is no tetrahedron; mesh with tetrahedra only"
                )));
            }
            _ => {}
        }
        Ok(())
    }

    /// The mesh of the named groups; the error is a message.
    pub(super) fn into_mesh(self, names: &GmshNames) -> Result<TetMesh, String> {
        let regions = self.resolve(3, "region", &names.regions, &self.tets)?;
        let surfaces = self.resolve(2, "surface", &names.surfaces, &self.triangles)?;

        let mut region_of = Vec::with_capacity(self.tets.len());
        let mut tets = Vec::with_capacity(self.tets.len());
        for (number, tet) in self.tets.iter().enumerate() {
            let [x, y, z] = self.points[tet.nodes[0] as usize];
            let mut found =
                (0..).zip(&regions).filter(|(_, (_, group))| tet.groups.contains(group));
            let Some((region, _)) = found.next() else {
                return Err(format!(
                    "tetrahedron {number}, with a corner at ({x}, {y}, {z}) mm and physical volume(s) \
                     {:?}, belongs to no named region; name that group among the regions, or give its \
                     volume a physical group",
                    tet.groups
                ));
            };
            if found.next().is_some() {
                return Err(format!(
                    "tetrahedron {number}, with a corner at ({x}, {y}, {z}) mm, is in several named \
                     regions (physical volumes {:?}); name one",
                    tet.groups
                ));
            }
            region_of.push(region);
            let [a, b, c, d] = tet.nodes;
            let volume = tet_volume(tet.nodes.map(|node| self.points[node as usize]));
            tets.push(if volume < 0.0 { [b, a, c, d] } else { [a, b, c, d] });
        }

        let volumes = self.tets.iter().map(|tet| (tet.entity, tet.groups.as_slice()));
        let mut mesh = TetMesh {
            grain_of: grains::numbers(volumes),
            nodes: self.points,
            tets,
            region_of,
            regions: regions.into_iter().map(|(name, _)| name).collect(),
            ..TetMesh::default()
        };
        let outward: HashMap<[u32; 3], [u32; 3]> =
            mesh.boundary_faces().into_iter().map(|face| (sorted(face), face)).collect();
        for (name, group) in surfaces {
            let triangles = self
                .triangles
                .iter()
                .filter(|triangle| triangle.groups.contains(&group))
                .map(|triangle| match outward.get(&sorted(triangle.nodes)) {
                    Some(&face) if !is_even_turn(face, triangle.nodes) => face,
                    _ => triangle.nodes,
                })
                .collect();
            mesh.surfaces.insert(name, triangles);
        }
        Ok(mesh.without_unused_nodes())
    }

    /// Names with the numbers of their groups, each of which must have elements.
    fn resolve<const N: usize>(
        &self,
        dimension: i32,
        what: &str,
        wanted: &BTreeMap<String, PhysicalGroup>,
        elements: &[Element<N>],
    ) -> Result<Vec<(String, i32)>, String> {
        let present: BTreeSet<i32> =
            elements.iter().flat_map(|element| element.groups.iter().copied()).collect();
        let label = |number: i32| self.names.get(&(dimension, number));
        if wanted.is_empty() {
            let name = |number| label(number).cloned().unwrap_or_else(|| number.to_string());
            return Ok(present.into_iter().map(|number| (name(number), number)).collect());
        }
        let mut resolved = Vec::with_capacity(wanted.len());
        for (name, group) in wanted {
            let number = present.iter().copied().find(|&number| match group {
                PhysicalGroup::Number(wanted) => number == *wanted,
                PhysicalGroup::Name(wanted) => label(number) == Some(wanted),
            });
            let Some(number) = number else {
                let there: Vec<String> = present
                    .iter()
                    .map(|&number| match label(number) {
                        Some(name) => format!("{number} (\"{name}\")"),
                        None => number.to_string(),
                    })
                    .collect();
                return Err(format!(
                    "{what} `{name}` should be physical group {group} of dimension {dimension}, \
                     but the file has {}; correct the number or name",
                    if there.is_empty() { "none".into() } else { there.join(", ") }
                ));
            };
            resolved.push((name.clone(), number));
        }
        Ok(resolved)
    }
}
