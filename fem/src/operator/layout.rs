//! Memory layout of the elements: batches of SIMD lanes, grouped into chunks with copies of their nodal
//! values.
//!
//! A product computes each chunk with copies of the values of the chunk's nodes, and sums the copies of each node in
//! a fixed order afterwards. Results therefore do not depend on the number of threads, and the values of a chunk stay
//! in the cache.

use fem_mesh::Groups;
use rayon::prelude::*;

use crate::element::{Domain, Rule};
use crate::material::POINTS;

/// Number of elements in a batch.
pub const LANES: usize = POINTS;
/// Largest number of elements in a chunk, for linear and for quadratic elements. The nodal values of a chunk should
/// fit into the second-level cache.
const PER_CHUNK: [usize; 2] = [4096, 512];

/// Nodes of a quadratic tetrahedron by vertex pair (k, j): the node on the edge between both vertices, or vertex k if k
/// = j.
pub(super) const MIDDLE: [[usize; 4]; 4] = [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3]];

/// Memory layout and integration rule of a mesh; both do not depend on the fields.
#[derive(Debug)]
pub struct Layout {
    pub(super) batches: Batches,
    pub(super) rule: Rule,
    /// For each elastic point: the smallest barycentric coordinate λ, and (vertex, difference from the smallest) for
    /// each vertex with a larger λ.
    pub(super) excess: Vec<(f64, Vec<(usize, f64)>)>,
    /// Whether the damage points are at the nodes.
    pub(super) nodal: bool,
}

impl Layout {
    pub fn new(domain: &dyn Domain) -> Self {
        let rule = domain.rule().clone();
        let per_chunk = PER_CHUNK[usize::from(rule.nodes == 10)];
        let batches = Batches::new(domain, per_chunk);
        let excess = rule
            .elastic_points
            .iter()
            .map(|point| {
                let least = point.at.iter().copied().fold(1.0, f64::min);
                let above = point.at.iter().map(|x| x - least).enumerate();
                (least, above.filter(|(_, d)| *d > 1e-14).collect())
            })
            .collect();
        let nodal = rule.damage.iter().enumerate().all(|(p, point)| point.shape[p] == 1.0);
        Self { batches, rule, excess, nodal }
    }
}

/// Elements of a mesh, grouped into chunks. A chunk consists of batches of [`LANES`] elements.
#[derive(Debug)]
pub(super) struct Batches {
    pub chunks: Vec<Chunk>,
    /// Copies of each node, one per chunk that contains the node, by their indices in the array of all copies.
    copies: Groups,
}

/// Chunk: neighbouring elements that one task processes.
#[derive(Debug)]
pub(super) struct Chunk {
    /// Element of each lane; the length is a multiple of [`LANES`], and [`VACANT`] fills the last batch.
    pub tets: Vec<u32>,
    /// Mesh nodes of the chunk's elements.
    pub global: Vec<u32>,
    /// Indices of the elements' nodes into `global`. `local[batch · n + a][lane]` belongs to node a of an element
    /// with n nodes.
    pub local: Vec<[u16; LANES]>,
    /// Whether the elements are plain: straight, and no mixtures.
    pub plain: bool,
}

/// Values of one node of a chunk, aligned so that they do not cross a cache line.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))]
pub(super) struct Aligned(pub [f64; 4]);

/// Element number of a lane without an element, in the last batch of a chunk.
pub(super) const VACANT: u32 = u32::MAX;

impl Batches {
    /// Builds chunks of at most `per_chunk` elements. Plain elements (straight, no mixtures) and other elements are
    /// in separate chunks. Within both groups, the elements are ordered along a space-filling curve.
    pub(super) fn new(domain: &dyn Domain, per_chunk: usize) -> Self {
        let (tets, positions) = (domain.tets(), domain.nodes());
        let curve = Curve::new(positions);
        let mut order: Vec<(bool, u64, u32)> = (0..tets)
            .map(|tet| {
                let corners = &domain.nodes_of(tet)[..4];
                let centre = std::array::from_fn(|k| {
                    corners.iter().map(|&n| 0.25 * positions[n as usize][k]).sum()
                });
                (!domain.is_plain(tet), curve.position(centre), tet as u32)
            })
            .collect();
        order.sort_unstable();
        let nodes = domain.rule().nodes;
        let nodes_of_tet = |part: &(bool, u64, u32)| domain.nodes_of(part.2 as usize);
        let mut local_of = vec![u32::MAX; positions.len()];
        let mut chunks = Vec::new();
        let kinds = order.chunk_by(|a, b| a.0 == b.0);
        for part in kinds.flat_map(|kind| kind.chunks(per_chunk)) {
            let mut tets: Vec<u32> = part.iter().map(|p| p.2).collect();
            tets.resize(part.len().next_multiple_of(LANES), VACANT);
            let mut global: Vec<u32> = part.iter().flat_map(nodes_of_tet).copied().collect();
            global.sort_unstable();
            global.dedup();
            global.iter().enumerate().for_each(|(i, &n)| local_of[n as usize] = i as u32);
            let mut local = Vec::with_capacity(tets.len() / LANES * nodes);
            for batch in tets.chunks(LANES) {
                for a in 0..nodes {
                    local.push(std::array::from_fn(|lane| {
                        // a vacant lane reads the nodes of the batch's first element and adds zeros to them
                        let tet = if batch[lane] == VACANT { batch[0] } else { batch[lane] };
                        local_of[domain.nodes_of(tet as usize)[a] as usize] as u16
                    }));
                }
            }
            chunks.push(Chunk { tets, global, local, plain: !part[0].0 });
        }
        let nodes = chunks.iter().flat_map(|chunk| &chunk.global).copied();
        let copies = Groups::new(positions.len(), nodes.zip(0..));
        Self { chunks, copies }
    }

    /// Returns the number of nodes of the mesh.
    pub(super) fn node_count(&self) -> usize {
        self.copies.start.len() - 1
    }

    /// Computes y_n as the sum of the copies of node n, in the order of the chunks.
    ///
    /// `work` computes the copies of a chunk. The arguments of `work` are the index of the chunk, a buffer, and the
    /// copies, which are zero on entry.
    pub(super) fn gather(
        &self,
        copies: &mut Vec<Aligned>,
        y: &mut [[f64; 4]],
        work: impl Fn(usize, &mut Vec<Aligned>, &mut [Aligned]) + Sync,
    ) {
        copies.resize(self.copies.members.len(), Aligned([0.0; 4]));
        let mut chunk_copies = Vec::with_capacity(self.chunks.len());
        let mut rest = copies.as_mut_slice();
        for chunk in &self.chunks {
            let (part, next) = rest.split_at_mut(chunk.global.len());
            chunk_copies.push(part);
            rest = next;
        }
        chunk_copies.into_par_iter().enumerate().for_each_init(
            Vec::new,
            |buffer, (chunk, part)| {
                part.fill(Aligned([0.0; 4]));
                work(chunk, buffer, part);
            },
        );
        const NODES: usize = 2048;
        y.par_chunks_mut(NODES).enumerate().for_each(|(block, y)| {
            for (i, y) in y.iter_mut().enumerate() {
                let node = block * NODES + i;
                let mut sum = [0.0; 4];
                for &copy in self.copies.of(node) {
                    for k in 0..4 {
                        sum[k] += copies[copy as usize].0[k];
                    }
                }
                *y = sum;
            }
        });
    }
}

/// Space-filling curve through a box, in Morton order (Morton, IBM 1966).
struct Curve {
    corner: [f64; 3],
    scale: f64,
}

impl Curve {
    /// Number of bits per coordinate: the curve visits 2^BITS cells along the longest side of the box.
    const BITS: u32 = 20;

    fn new(positions: &[[f64; 3]]) -> Self {
        let bound = |k: usize, pick: fn(f64, f64) -> f64| {
            positions.iter().map(|p| p[k]).reduce(pick).unwrap_or(0.0)
        };
        let corner = [0, 1, 2].map(|k| bound(k, f64::min));
        let size = [0, 1, 2].map(|k| bound(k, f64::max) - corner[k]);
        let longest = size.into_iter().fold(f64::MIN_POSITIVE, f64::max);
        Self { corner, scale: f64::from((1 << Self::BITS) - 1) / longest }
    }

    /// Returns the position of a point along the curve.
    fn position(&self, point: [f64; 3]) -> u64 {
        (0..3)
            .map(|k| {
                let cell = ((point[k] - self.corner[k]) * self.scale) as u64;
                (0..Self::BITS).map(|bit| (cell >> bit & 1) << (3 * bit)).sum::<u64>() << k
            })
            .sum()
    }
}
