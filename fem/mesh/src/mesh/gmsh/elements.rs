//! What both versions of the format come down to, and how a mesh is made of it.

use std::collections::{BTreeMap, BTreeSet, HashMap};

use super::data::ElementData;
use super::names::{GmshNames, PhysicalGroup};
use super::source::{Fault, Source};
use super::{grains, second_order};
use crate::mesh::TetMesh;
use crate::mesh::tet_mesh::{is_even_turn, sorted};
use crate::mesh::vector::{Point, tet_volume};

/// Nodes and elements of a file, with their physical groups.
#[derive(Default)]
pub(super) struct Contents {
    /// Names of physical groups by (dimension, number).
    pub(super) names: BTreeMap<(i32, i32), String>,
    /// The set of physical groups of each entity by (dimension, entity), in version 4.
    pub(super) groups: HashMap<(i32, i32), GroupSet>,
    sets: GroupSets,
    pub(super) points: Vec<Point>,
    /// Position in `points` of each node tag.
    pub(super) position: HashMap<u64, u32>,
    pub(super) triangles: Vec<Simplex<3>>,
    pub(super) tets: Vec<Simplex<4>>,
    /// The nodes (positions) on the edges of tetrahedra of second order, by number of the tetrahedron.
    middles: Vec<(u32, [u32; 6])>,
    pub(super) data: ElementData,
}

/// An element as it is announced: its type, tags and physical groups.
#[derive(Clone, Copy)]
pub(super) struct Header {
    pub(super) kind: i32,
    pub(super) tag: u64,
    pub(super) entity: i32,
    pub(super) groups: GroupSet,
}

/// Corner nodes (positions) of an element, and how it was announced.
pub(super) struct Simplex<const N: usize> {
    nodes: [u32; N],
    header: Header,
}

/// A set of physical groups, by its number: each is kept once, however many elements it has.
#[derive(Clone, Copy, Default)]
pub(super) struct GroupSet(u32);

/// The sets of a file; the first is empty.
struct GroupSets {
    all: Vec<Vec<i32>>,
    number: HashMap<Vec<i32>, u32>,
}

impl Default for GroupSets {
    fn default() -> Self {
        Self { all: vec![Vec::new()], number: HashMap::from([(Vec::new(), 0)]) }
    }
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

    /// The number of a set of physical groups.
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

    /// Reads the nodes of an element and keeps it if it is a triangle or a tetrahedron.
    pub(super) fn element(
        &mut self,
        source: &mut Source,
        header: Header,
        mut tag: impl FnMut(&mut Source) -> Result<u64, Fault>,
    ) -> Result<(), Fault> {
        let kind = header.kind;
        let Some((dimension, count)) = shape(kind) else {
            return Err(source.fault(format!(
                "element type {kind} is not read; mesh with tetrahedra of order 1 or 2"
            )));
        };
        let is_simplex = matches!(kind, 2 | 9 | 4 | 11);
        let mut nodes = [0; 10];
        for k in 0..count {
            let tag = tag(source)?;
            if is_simplex {
                nodes[k] = *self.position.get(&tag).ok_or_else(|| {
                    source.fault(format!("an element refers to node {tag}, which is not there"))
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
                    "element type {kind} is no tetrahedron; mesh with tetrahedra only"
                )));
            }
            _ => {}
        }
        Ok(())
    }

    /// The elementary tag of each tetrahedron.
    pub(super) fn entities(&self) -> impl Iterator<Item = i32> {
        self.tets.iter().map(|tet| tet.header.entity)
    }

    /// The grain number of each tetrahedron as [`write`](super::write()) leaves it.
    pub(super) fn grains(&self) -> Option<Vec<u32>> {
        let tags = self.tets.iter().map(|tet| tet.header.tag);
        let volumes = self.tets.iter().map(|tet| (tet.header.entity, self.groups_of(tet)));
        let announced = self.names.keys().filter(|(dimension, _)| *dimension == 3).count();
        self.data.grains(tags).or_else(|| grains::numbers(volumes, announced))
    }

    /// The mesh of the named groups; the error is a message.
    pub(super) fn into_mesh(
        self,
        names: &GmshNames,
        grains: impl Fn(&Self) -> Option<Vec<u32>>,
    ) -> Result<TetMesh, String> {
        let regions = self.resolve(3, "region", &names.regions, &self.tets)?;
        let surfaces = self.resolve(2, "surface", &names.surfaces, &self.triangles)?;

        let mut number_of: HashMap<i32, Vec<u16>> = HashMap::new();
        for (number, (_, group)) in regions.iter().enumerate() {
            let number = u16::try_from(number).map_err(|_| {
                format!("{} physical volumes are more than 65536; merge some", regions.len())
            })?;
            number_of.entry(*group).or_default().push(number);
        }
        let mut region_of = Vec::with_capacity(self.tets.len());
        let mut tets = Vec::with_capacity(self.tets.len());
        for (number, tet) in self.tets.iter().enumerate() {
            let [x, y, z] = self.points[tet.nodes[0] as usize];
            let groups = self.groups_of(tet);
            let mut found = groups.iter().filter_map(|group| number_of.get(group)).flatten();
            let Some(&region) = found.next() else {
                return Err(format!(
                    "tetrahedron {number}, with a corner at ({x}, {y}, {z}) mm and physical volume(s) \
                     {groups:?}, belongs to no named region; name that group among the regions, or give \
                     its volume a physical group"
                ));
            };
            if found.next().is_some() {
                return Err(format!(
                    "tetrahedron {number}, with a corner at ({x}, {y}, {z}) mm, is in several named \
                     regions (physical volumes {groups:?}); name one"
                ));
            }
            region_of.push(region);
            let [a, b, c, d] = tet.nodes;
            let volume = tet_volume(tet.nodes.map(|node| self.points[node as usize]));
            tets.push(if volume < 0.0 { [b, a, c, d] } else { [a, b, c, d] });
        }

        let tags = || self.tets.iter().map(|tet| tet.header.tag);
        let grain_of = grains(&self);
        let edge_points = self.edge_points()?;
        let surface_triangles: Vec<(String, Vec<[u32; 3]>)> = surfaces
            .into_iter()
            .map(|(name, group)| {
                let of_group = self.triangles.iter().filter(|t| self.groups_of(t).contains(&group));
                (name, of_group.map(|triangle| triangle.nodes).collect())
            })
            .collect();
        let mut mesh = TetMesh {
            grain_of,
            edge_points,
            mixture: self.data.mixture(tags(), |group| number_of.get(&group)?.first().copied()),
            nodes: self.points,
            tets,
            region_of,
            regions: regions.into_iter().map(|(name, _)| name).collect(),
            ..TetMesh::default()
        };
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
        Ok(mesh.without_unused_nodes())
    }

    fn edge_points(&self) -> Result<Vec<([u32; 2], Point)>, String> {
        let tets =
            self.middles.iter().map(|(tet, middles)| (&self.tets[*tet as usize].nodes, middles));
        second_order::curved_edges(&self.points, tets).map_err(|edge| {
            let [p, q] = edge.map(|node| self.points[node as usize]);
            format!(
                "the edge from {p:?} to {q:?} mm has different middle nodes in two tetrahedra; make the \
                 geometry conforming before meshing (in Gmsh: Coherence or BooleanFragments)"
            )
        })
    }

    /// Names with the numbers of their groups, each of which must have elements.
    fn resolve<const N: usize>(
        &self,
        dimension: i32,
        what: &str,
        wanted: &BTreeMap<String, PhysicalGroup>,
        elements: &[Simplex<N>],
    ) -> Result<Vec<(String, i32)>, String> {
        let mut present: BTreeSet<i32> =
            elements.iter().flat_map(|element| self.groups_of(element)).copied().collect();
        if self.data.has_mixture() {
            // a phase may be there in mixtures alone
            let announced = self.names.keys().filter(|(of, _)| *of == dimension);
            present.extend(announced.map(|(_, number)| number));
        }
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
