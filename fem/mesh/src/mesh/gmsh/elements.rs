//! Contents of a file, which are the same for both versions of the format, and the conversion of these contents to a
//! mesh.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use fem_image::listed;

use super::data::ElementData;
use super::names::{GmshNames, PhysicalGroup, PhysicalGroups};
use super::source::{Fault, Source};
use super::straighten::straighten;
use super::{grains, second_order};
use crate::mesh::TetMesh;
use crate::mesh::topology::{is_even_turn, sorted};
use crate::mesh::vector::Point;

/// Nodes and elements of a file, with their physical groups.
#[derive(Default)]
pub(super) struct Contents {
    /// Names of the physical groups by (dimension, number).
    pub(super) names: BTreeMap<(i32, i32), String>,
    /// Physical groups of each geometric entity, by (dimension, entity). Only version 4 has this list.
    pub(super) groups: HashMap<(i32, i32), GroupSet>,
    sets: GroupSets,
    /// Coordinates of all nodes (mm), mid-edge nodes included.
    pub(super) positions: Vec<Point>,
    /// For each node tag, the index of the node in `positions`.
    pub(super) position: HashMap<u64, u32>,
    pub(super) triangles: Vec<Simplex<3>>,
    pub(super) tets: Vec<Simplex<4>>,
    /// Mid-edge nodes (indices into `positions`) of each second-order tetrahedron, with the number of the tetrahedron.
    middles: Vec<(u32, [u32; 6])>,
    pub(super) data: ElementData,
}

/// Header of an element: its type and tag, its geometric entity and its physical groups.
#[derive(Clone, Copy)]
pub(super) struct Header {
    pub(super) kind: i32,
    pub(super) tag: u64,
    pub(super) entity: i32,
    pub(super) groups: GroupSet,
}

/// Corner nodes (indices into `positions`) and header of an element.
pub(super) struct Simplex<const N: usize> {
    nodes: [u32; N],
    header: Header,
}

/// Index of a set of physical groups. Elements with equal sets share one stored set.
#[derive(Clone, Copy, Default)]
pub(super) struct GroupSet(u32);

/// The distinct sets of physical groups of a file; the first set is empty.
struct GroupSets {
    all: Vec<Vec<i32>>,
    number: HashMap<Vec<i32>, u32>,
}

impl Default for GroupSets {
    fn default() -> Self {
        Self { all: vec![Vec::new()], number: HashMap::from([(Vec::new(), 0)]) }
    }
}

/// Reads `$PhysicalNames`, which is text in both ASCII and binary files.
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

/// Returns dimension and number of nodes of a Gmsh element type, or `None` if the type is not supported.
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
        let position = u32::try_from(self.positions.len())
            .map_err(|_| source.fault("more than 2³² nodes".into()))?;
        if self.position.insert(tag, position).is_some() {
            return Err(source.fault(format!("node {tag} is defined twice; renumber the mesh")));
        }
        self.positions.push(point);
        Ok(())
    }

    /// Returns the index of a set of physical groups. A set that is not stored yet is added.
    pub(super) fn group_set(&mut self, mut groups: Vec<i32>) -> GroupSet {
        groups.sort_unstable();
        groups.dedup();
        let GroupSets { all, number } = &mut self.sets;
        GroupSet(*number.entry(groups).or_insert_with_key(|groups| {
            all.push(groups.clone());
            all.len() as u32 - 1
        }))
    }

    fn groups_of<const N: usize>(&self, element: &Simplex<N>) -> &[i32] {
        &self.sets.all[element.header.groups.0 as usize]
    }

    /// Reads the nodes of an element and stores the element if it is a triangle or a tetrahedron.
    pub(super) fn element(
        &mut self,
        source: &mut Source,
        header: Header,
        mut tag: impl FnMut(&mut Source) -> Result<u64, Fault>,
    ) -> Result<(), Fault> {
        let kind = header.kind;
        let Some((dimension, count)) = shape(kind) else {
            return Err(source.fault(format!(
                "element type {kind} is not supported; mesh with tetrahedra of order 1 or 2"
            )));
        };
        let is_simplex = matches!(kind, 2 | 9 | 4 | 11);
        let mut nodes = [0; 10];
        for k in 0..count {
            let tag = tag(source)?;
            if is_simplex {
                nodes[k] = *self.position.get(&tag).ok_or_else(|| {
                    source.fault(format!("an element refers to node {tag}, which is not in the file; save the mesh again"))
                })?;
            }
        }
        let [a, b, c, d, middles @ ..] = nodes;
        match (dimension, is_simplex) {
            (2, true) => self.triangles.push(Simplex { nodes: [a, b, c], header }),
            (3, true) => {
                if count == 10 {
                    self.middles.push((self.tets.len() as u32, middles));
                }
                self.tets.push(Simplex { nodes: [a, b, c, d], header });
            }
            (3, false) => {
                return Err(source.fault(format!(
                    "element type {kind} is not a tetrahedron; mesh with tetrahedra only"
                )));
            }
            _ => {}
        }
        Ok(())
    }

    /// Returns the elementary tag (number of the volume of the geometry) of each tetrahedron.
    pub(super) fn entities(&self) -> impl Iterator<Item = i32> {
        self.tets.iter().map(|tet| tet.header.entity)
    }

    /// Returns the grain number of each tetrahedron, or `None` if the file does not encode grain numbers in the way of
    /// [`write`](super::write()).
    pub(super) fn grains(&self) -> Option<Vec<u32>> {
        let tags = self.tets.iter().map(|tet| tet.header.tag);
        let volumes = self.tets.iter().map(|tet| (tet.header.entity, self.groups_of(tet)));
        let announced = self.names.keys().filter(|(dimension, _)| *dimension == 3).count();
        self.data.grains(tags).or_else(|| grains::grain_numbers(volumes, announced))
    }

    /// Sorts the tetrahedra by their element tags.
    pub(super) fn sort(&mut self) {
        if self.tets.is_sorted_by_key(|tet| tet.header.tag) {
            return;
        }
        let mut order: Vec<u32> = (0..self.tets.len() as u32).collect();
        order.sort_by_key(|&tet| self.tets[tet as usize].header.tag);
        let mut new_index = vec![0; order.len()];
        (0..).zip(&order).for_each(|(new, &old)| new_index[old as usize] = new);
        self.middles.iter_mut().for_each(|(tet, _)| *tet = new_index[*tet as usize]);
        self.tets.sort_by_key(|tet| tet.header.tag);
    }

    /// Returns the elementary tags of the volumes of the geometry that have neither a physical group nor elements.
    pub(super) fn unsaved_volumes(&self) -> Vec<i32> {
        let meshed: BTreeSet<i32> = self.entities().collect();
        let without_group = |(entity, groups): (&(i32, i32), &GroupSet)| {
            let unsaved = entity.0 == 3 && groups.0 == 0 && !meshed.contains(&entity.1);
            unsaved.then_some(entity.1)
        };
        let mut volumes: Vec<i32> = self.groups.iter().filter_map(without_group).collect();
        volumes.sort_unstable();
        volumes
    }

    /// Builds the mesh from the physical groups in `names`. Returns the mesh and the numbers of the straightened
    /// tetrahedra, or an error message.
    pub(super) fn into_mesh(
        self,
        names: &GmshNames,
        grains: impl Fn(&Self) -> Option<Vec<u32>>,
    ) -> Result<(TetMesh, Vec<u32>), String> {
        let regions = self.resolve(3, "region", &names.regions, &self.tets)?;
        let surfaces = self.resolve(2, "surface", &names.surfaces, &self.triangles)?;

        let mut number_of: HashMap<i32, Vec<u16>> = HashMap::new();
        for (number, (_, groups)) in regions.iter().enumerate() {
            let number = u16::try_from(number).map_err(|_| {
                format!(
                    "the file has {} physical volumes, more than 65536; merge some volumes",
                    regions.len()
                )
            })?;
            groups.iter().for_each(|group| number_of.entry(*group).or_default().push(number));
        }
        let mut region_of = Vec::with_capacity(self.tets.len());
        // number of tetrahedra that belong to no region, by (volume, physical groups)
        let mut unnamed: BTreeMap<(i32, &[i32]), usize> = BTreeMap::new();
        for (number, tet) in self.tets.iter().enumerate() {
            let groups = self.groups_of(tet);
            let mut matches: Vec<u16> =
                groups.iter().filter_map(|group| number_of.get(group)).flatten().copied().collect();
            matches.dedup();
            match matches[..] {
                [] => *unnamed.entry((tet.header.entity, groups)).or_default() += 1,
                [region] => region_of.push(region),
                [..] => {
                    let [x, y, z] = self.positions[tet.nodes[0] as usize];
                    return Err(format!(
                        "tetrahedron {number}, with a corner at ({x}, {y}, {z}) mm, is in several named \
                         regions (physical volumes {}); list only one of them",
                        numbers(groups)
                    ));
                }
            }
        }
        if !unnamed.is_empty() {
            return Err(without_region(&unnamed));
        }

        let tags = || self.tets.iter().map(|tet| tet.header.tag);
        let grain_of = grains(&self);
        let edge_points = self.edge_points()?;
        let surface_triangles: Vec<(String, Vec<[u32; 3]>)> = surfaces
            .into_iter()
            .map(|(name, groups)| {
                let is_part =
                    |t: &&Simplex<3>| groups.iter().any(|g| self.groups_of(t).contains(g));
                let of_groups = self.triangles.iter().filter(is_part);
                (name, of_groups.map(|triangle| triangle.nodes).collect())
            })
            .collect();
        let mut mesh = TetMesh {
            grain_of,
            edge_points,
            mixture: self.data.mixture(tags(), |group| number_of.get(&group)?.first().copied()),
            tets: self.tets.iter().map(|tet| tet.nodes).collect(),
            nodes: self.positions,
            region_of,
            regions: regions.into_iter().map(|(name, _)| name).collect(),
            ..TetMesh::default()
        };
        let straightened = straighten(&mut mesh);
        let outward: HashMap<[u32; 3], [u32; 3]> =
            mesh.boundary_faces().into_iter().map(|face| (sorted(face), face)).collect();
        for (name, mut triangles) in surface_triangles {
            for triangle in &mut triangles {
                match outward.get(&sorted(*triangle)) {
                    Some(&face) if !is_even_turn(face, *triangle) => *triangle = face,
                    _ => {}
                }
            }
            mesh.surfaces.insert(name, triangles);
        }
        Ok((mesh.without_unused_nodes(), straightened))
    }

    fn edge_points(&self) -> Result<Vec<([u32; 2], Point)>, String> {
        let tets =
            self.middles.iter().map(|(tet, middles)| (&self.tets[*tet as usize].nodes, middles));
        second_order::curved_edges(&self.positions, tets).map_err(|edge| {
            let [p, q] = edge.map(|node| self.positions[node as usize]);
            format!(
                "the edge from {p:?} to {q:?} mm has different mid-edge nodes in two tetrahedra; make the \
                 geometry conforming before meshing (in Gmsh: Coherence or BooleanFragments)"
            )
        })
    }

    /// Returns each name in `wanted` with the numbers of its physical groups. If `wanted` is empty, returns all groups
    /// of the dimension. Returns an error message if a group has no elements.
    fn resolve<const N: usize>(
        &self,
        dimension: i32,
        what: &str,
        wanted: &BTreeMap<String, PhysicalGroups>,
        elements: &[Simplex<N>],
    ) -> Result<Vec<(String, Vec<i32>)>, String> {
        let mut present: BTreeSet<i32> =
            elements.iter().flat_map(|element| self.groups_of(element)).copied().collect();
        if self.data.has_mixture() {
            // a named group may be without elements: a phase may occur in mixtures only
            let announced = self.names.keys().filter(|(d, _)| *d == dimension);
            present.extend(announced.map(|(_, number)| number));
        }
        let label = |number: i32| self.names.get(&(dimension, number));
        if wanted.is_empty() {
            let name = |number| label(number).cloned().unwrap_or_else(|| number.to_string());
            return Ok(present.into_iter().map(|number| (name(number), vec![number])).collect());
        }
        let number_of = |group: &PhysicalGroup| {
            present.iter().copied().find(|&number| match group {
                PhysicalGroup::Number(wanted) => number == *wanted,
                PhysicalGroup::Name(wanted) => label(number) == Some(wanted),
            })
        };
        let mut resolved = Vec::with_capacity(wanted.len());
        for (name, groups) in wanted {
            let mut group_numbers = Vec::new();
            for group in groups.groups() {
                let Some(number) = number_of(group) else {
                    let available: Vec<String> = present
                        .iter()
                        .map(|&number| match label(number) {
                            Some(name) => format!("{number} (\"{name}\")"),
                            None => number.to_string(),
                        })
                        .collect();
                    let available = match available[..] {
                        [] => "none".into(),
                        _ => listed(&available, ", "),
                    };
                    let remedy = match self.announces_lost_groups(dimension, elements) {
                        true => LOST_GROUPS,
                        false => "correct the number or name",
                    };
                    return Err(format!(
                        "{what} `{name}` should be physical group {group} of dimension {dimension}, \
                         but the file has {available}; {remedy}"
                    ));
                };
                group_numbers.push(number);
            }
            resolved.push((name.clone(), group_numbers));
        }
        Ok(resolved)
    }

    /// Returns whether the file names physical groups of this dimension, but no element belongs to such a group.
    fn announces_lost_groups<const N: usize>(
        &self,
        dimension: i32,
        elements: &[Simplex<N>],
    ) -> bool {
        let is_named = self.names.keys().any(|(d, _)| *d == dimension);
        is_named && !elements.is_empty() && elements.iter().all(|e| self.groups_of(e).is_empty())
    }
}

/// Advice for a file in which MSH 2.2 has dropped the physical groups of the elements.
const LOST_GROUPS: &str = "MSH 2.2 with Mesh.SaveAll drops the groups of all elements: save without \
                           Mesh.SaveAll, or as MSH 4.1 (gmsh -format msh41)";

/// Returns the error message for tetrahedra without a region; the message lists the first five of their volumes.
fn without_region(unnamed: &BTreeMap<(i32, &[i32]), usize>) -> String {
    let count: usize = unnamed.values().sum();
    let volume = |((entity, groups), count): (&(i32, &[i32]), &usize)| match groups {
        [] => format!("{count} of volume {entity} (no physical volume)"),
        [group] => format!("{count} of volume {entity} (physical volume {group})"),
        _ => format!("{count} of volume {entity} (physical volumes {})", numbers(groups)),
    };
    let volumes = listed(unnamed.iter().map(volume), ", ");
    let who = match count {
        1 => "1 tetrahedron belongs".to_owned(),
        _ => format!("{count} tetrahedra belong"),
    };
    format!(
        "{who} to no named region: {volumes}; list their physical group among the regions, or give their \
         volume a physical group"
    )
}

/// Lists the numbers of physical groups.
fn numbers(groups: &[i32]) -> String {
    listed(groups.iter().map(i32::to_string), ", ")
}
