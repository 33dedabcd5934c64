//! Independent writers of the variants of MSH files that Gmsh writes: 2.2 and 4.1, as text and binary.

use fem_mesh::TetMesh;

/// Edges of a tetrahedron in Gmsh's order; a triangle has the first three.
const EDGES: [[usize; 2]; 6] = [[0, 1], [1, 2], [2, 0], [0, 3], [2, 3], [1, 3]];

/// Returns the sorted edges of a mesh with the coordinates of their mid-edge nodes.
pub(crate) fn edges(mesh: &TetMesh) -> Vec<([u32; 2], [f64; 3])> {
    let pairs = |tet: &[u32; 4]| EDGES.map(|ends| sorted(ends.map(|end| tet[end])));
    let mut edges: Vec<[u32; 2]> = mesh.tets.iter().flat_map(pairs).collect();
    edges.sort_unstable();
    edges.dedup();
    let point = |edge: [u32; 2]| match mesh.edge_points.iter().find(|(of, _)| *of == edge) {
        Some(curved) => *curved,
        None => {
            let [p, q] = edge.map(|node| mesh.nodes[node as usize]);
            (edge, std::array::from_fn(|k| 0.5 * (p[k] + q[k])))
        }
    };
    edges.into_iter().map(point).collect()
}

pub(crate) fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

/// Returns the elements as (type, physical group, entity, node tags), triangles first.
pub(crate) fn elements(mesh: &TetMesh, quadratic: bool) -> Vec<(i32, i32, i32, Vec<u64>)> {
    let edges = if quadratic { edges(mesh) } else { Vec::new() };
    let middle = |nodes: &[u32], ends: [usize; 2]| {
        let edge = sorted(ends.map(|end| nodes[end]));
        900_000 + edges.iter().position(|(of, _)| *of == edge).unwrap() as u64
    };
    let tags = |nodes: &[u32], sides: usize| -> Vec<u64> {
        let sides = EDGES[..sides].iter().filter(|_| quadratic);
        let middles = sides.map(|&ends| middle(nodes, ends));
        nodes.iter().map(|&node| tag(node)).chain(middles).collect()
    };
    let mut all = Vec::new();
    for (name, group) in [("bottom", 11), ("top", 12), ("side", 13)] {
        // triangles are oriented inwards, so that the reader has to reverse them
        for &[a, b, c] in &mesh.surfaces[name] {
            all.push((if quadratic { 9 } else { 2 }, group, 30 + group, tags(&[b, a, c], 3)));
        }
    }
    for (&[a, b, c, d], &region) in mesh.tets.iter().zip(&mesh.region_of) {
        let group = region as i32 + 1;
        all.push((if quadratic { 11 } else { 4 }, group, 50 + group, tags(&[a, b, c, d], 6)));
    }
    all
}

/// Returns a node tag; the tags are not consecutive, as may occur in files of Gmsh.
pub(crate) fn tag(node: u32) -> u64 {
    3 * node as u64 + 7
}

pub(crate) fn v2(mesh: &TetMesh, binary: bool) -> Vec<u8> {
    v2_with(mesh, binary, false)
}

/// Writes MSH 2.2; if `parametric`, nodes have entities and parameters.
pub(crate) fn v2_with(mesh: &TetMesh, binary: bool, parametric: bool) -> Vec<u8> {
    let mut out = format!("$MeshFormat\n2.2 {} 8\n", binary as i32).into_bytes();
    if binary {
        out.extend(1_i32.to_le_bytes());
        out.push(b'\n');
    }
    out.extend(b"$EndMeshFormat\n$Comments\nnot to be read $Nodes\n$EndComments\n");
    let section = if parametric { "ParametricNodes" } else { "Nodes" };
    out.extend(format!("${section}\n{}\n", mesh.nodes.len()).bytes());
    for (node, p) in (0..).zip(&mesh.nodes) {
        // nodes on points, curves, surfaces and volumes have 0, 1, 2 and 0 parameters
        let dimension = (node % 4) as i32;
        let parameters = &[0.25, 0.5][..[0, 1, 2, 0][node as usize % 4]];
        if binary {
            out.extend((tag(node) as i32).to_le_bytes());
            p.iter().for_each(|x| out.extend(x.to_le_bytes()));
            if parametric {
                [dimension, 7].iter().for_each(|x| out.extend(x.to_le_bytes()));
                parameters.iter().for_each(|x: &f64| out.extend(x.to_le_bytes()));
            }
        } else {
            out.extend(format!("{} {:?} {:?} {:?}", tag(node), p[0], p[1], p[2]).bytes());
            if parametric {
                out.extend(format!(" {dimension} 7").bytes());
                parameters.iter().for_each(|x| out.extend(format!(" {x}").bytes()));
            }
            out.push(b'\n');
        }
    }
    let elements = elements(mesh, false);
    out.extend(format!("\n$End{section}\n$Elements\n{}\n", elements.len()).bytes());
    for run in elements.chunk_by(|a, b| a.0 == b.0) {
        if binary {
            [run[0].0, run.len() as i32, 2].iter().for_each(|x| out.extend(x.to_le_bytes()));
        }
        for (k, (kind, group, entity, nodes)) in run.iter().enumerate() {
            if binary {
                [k as i32 + 1, *group, *entity].iter().for_each(|x| out.extend(x.to_le_bytes()));
                nodes.iter().for_each(|&n| out.extend((n as i32).to_le_bytes()));
            } else {
                let nodes: Vec<String> = nodes.iter().map(u64::to_string).collect();
                let nodes = nodes.join(" ");
                out.extend(format!("{} {kind} 2 {group} {entity} {nodes}\n", k + 1).bytes());
            }
        }
    }
    out.extend(b"\n$EndElements\n");
    out
}

/// Writer of integers, sizes and reals in the format of MSH 4.1.
struct V4 {
    out: Vec<u8>,
    binary: bool,
    big_endian: bool,
}

impl V4 {
    fn put<const N: usize>(&mut self, text: String, mut little: [u8; N]) {
        if self.binary {
            if self.big_endian {
                little.reverse();
            }
            self.out.extend(little);
        } else {
            self.out.extend(text.bytes());
            self.out.push(b' ');
        }
    }
    fn int(&mut self, x: i32) {
        self.put(x.to_string(), x.to_le_bytes());
    }
    fn size(&mut self, x: u64) {
        self.put(x.to_string(), x.to_le_bytes());
    }
    fn real(&mut self, x: f64) {
        self.put(format!("{x:?}"), x.to_le_bytes());
    }
    fn ints(&mut self, all: &[i32]) {
        all.iter().for_each(|&x| self.int(x));
    }
    fn sizes(&mut self, all: &[u64]) {
        all.iter().for_each(|&x| self.size(x));
    }
    fn reals(&mut self, all: &[f64]) {
        all.iter().for_each(|&x| self.real(x));
    }
    fn line(&mut self, text: &str) {
        self.out.extend(format!("\n{text}\n").bytes());
    }
}

pub(crate) fn v4(mesh: &TetMesh, binary: bool, big_endian: bool, quadratic: bool) -> Vec<u8> {
    let mut w = V4 { out: Vec::new(), binary, big_endian };
    w.out.extend(format!("$MeshFormat\n4.1 {} 8\n", binary as i32).bytes());
    if binary {
        w.int(1);
    }
    w.line("$EndMeshFormat\n$Entities");
    // one point and one curve without a group, which the reader must skip
    w.sizes(&[1, 1, 3, 2]);
    w.int(1);
    w.reals(&[0.0; 3]);
    w.size(0);
    w.int(1);
    w.reals(&[0.0; 6]);
    w.size(0);
    w.size(2);
    w.ints(&[1, -1]);
    for entity in [41, 42, 43, 51, 52] {
        w.int(entity);
        w.reals(&[0.0; 6]);
        w.size(1);
        w.int(if entity < 50 { -(entity - 30) } else { entity - 50 });
        w.size(1);
        w.int(1);
    }
    w.line("$EndEntities\n$Nodes");
    // two blocks, the second with parametric coordinates
    let middles: Vec<[f64; 3]> =
        if quadratic { edges(mesh).into_iter().map(|(_, p)| p).collect() } else { Vec::new() };
    let count = mesh.nodes.len() + middles.len();
    w.sizes(&[2, count as u64, 1, 900_000 + middles.len() as u64]);
    for (block, part) in [(0, &mesh.nodes[..20]), (20, &mesh.nodes[20..])] {
        let parametric = block > 0;
        let middles = if parametric { &middles[..] } else { &[] };
        w.ints(&[if parametric { 2 } else { 3 }, 51, parametric as i32]);
        w.size((part.len() + middles.len()) as u64);
        for k in 0..part.len() as u32 {
            w.size(tag(block + k));
        }
        for k in 0..middles.len() as u64 {
            w.size(900_000 + k);
        }
        for p in part.iter().chain(middles) {
            w.reals(p);
            if parametric {
                w.reals(&[0.25, 0.5]);
            }
        }
    }
    w.line("$EndNodes\n$Elements");
    let elements = elements(mesh, quadratic);
    let blocks: Vec<_> = elements.chunk_by(|a, b| a.2 == b.2).collect();
    w.sizes(&[blocks.len() as u64, elements.len() as u64, 1, elements.len() as u64]);
    for block in blocks {
        let (kind, _, entity, _) = block[0];
        w.ints(&[if entity < 50 { 2 } else { 3 }, entity, kind]);
        w.size(block.len() as u64);
        for (k, (.., nodes)) in block.iter().enumerate() {
            w.size(k as u64 + 1);
            nodes.iter().for_each(|&n| w.size(n));
        }
    }
    w.line("$EndElements");
    w.out
}
