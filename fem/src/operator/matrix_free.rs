//! The tangent applied element by element from stored point data, without a matrix.
//!
//! The data of [`LANES`] elements stand side by side, so that one instruction works on several;
//! which instructions, the processor decides when the program runs.

use std::sync::Arc;

use rayon::prelude::*;

use super::assembly::{Coupling, Operator};
use super::batches::{Aligned, Batches, Chunk, VACANT};
use super::element::Block;
use super::lanes::{LANES, Real, dispatch, places};
use super::pattern::Tangent;
use super::product::ChunkProduct;
use super::reduced::{NORMAL, PUSH, ReferenceRule, SHEAR, SOURCE, STRESS, axes, packed};
use super::residual::Increment;
use crate::material::Inverted;

/// Elements of a chunk: their nodal values should fit into the second-level cache.
const PER_CHUNK: [usize; 2] = [4096, 512];
/// Chunks of quadratic elements whose linear tangents are computed before they are added: 16 MB.
const AT_ONCE: usize = 16;

/// The edge between two vertices of a quadratic tetrahedron, as a node; vertices on the diagonal.
pub(super) const MIDDLE: [[usize; 4]; 4] = [[0, 4, 6, 7], [4, 1, 5, 8], [6, 5, 2, 9], [7, 8, 9, 3]];

/// What does not change with the fields.
#[derive(Debug)]
pub(crate) struct Layout {
    pub(super) batches: Batches,
    pub(super) rule: ReferenceRule,
    /// For each elastic point the least λ, and what the vertices have above it.
    pub(super) excess: Vec<(f64, Vec<(usize, f64)>)>,
    /// Whether the damage points are the nodes.
    pub(super) nodal: bool,
}

impl Layout {
    pub(crate) fn new(operator: &dyn Operator, points: &[[f64; 3]]) -> Self {
        let rule = operator.reference_rule();
        let per_chunk = PER_CHUNK[usize::from(rule.nodes == 10)];
        let batches =
            Batches::new(operator.tets(), points, per_chunk, |tet| operator.nodes_of(tet));
        let excess = rule
            .at
            .iter()
            .map(|l| {
                let least = l.iter().copied().fold(1.0, f64::min);
                let above = l.iter().map(|x| x - least).enumerate().filter(|(_, d)| *d > 1e-14);
                (least, above.collect())
            })
            .collect();
        let nodal = rule.damage.iter().enumerate().all(|(p, shape)| shape[p] == 1.0);
        Self { batches, rule, excess, nodal }
    }
}

/// The tangent at some fields.
#[derive(Debug)]
pub(crate) struct MatrixFree<T: Real> {
    layout: Arc<Layout>,
    /// Chunk after chunk; batch, then part of the batch that a pack holds, then number of the
    /// element's tangent.
    data: Vec<Vec<T::Pack>>,
    /// The place of each element of a batch in its packs.
    places: [usize; LANES],
    copies: Vec<Aligned>,
}

impl<T: Real> MatrixFree<T> {
    pub(crate) fn new(layout: Arc<Layout>) -> Self {
        let width = layout.rule.width();
        let zeros = |chunk: &Chunk| vec![T::ZERO; chunk.tets.len() / T::WIDTH * width];
        let data = layout.batches.chunks.iter().map(zeros).collect();
        Self { layout, data, places: places::<T>(), copies: Vec::new() }
    }

    /// Takes over the tangent at an increment.
    pub(crate) fn linearise(
        &mut self,
        operator: &dyn Operator,
        increment: &Increment,
        coupling: Coupling,
    ) -> Result<(), Inverted> {
        let Self { layout, data, places, .. } = self;
        let rule = &layout.rule;
        let width = rule.width();
        data.par_iter_mut().zip(&layout.batches.chunks).try_for_each(|(data, chunk)| {
            let mut write = |batch: usize, numbers: &[[f64; LANES]]| {
                let data = &mut data[batch * (LANES / T::WIDTH) * width..];
                let tets = &chunk.tets[batch * LANES..];
                for (lane, (&place, &tet)) in places.iter().zip(tets).enumerate() {
                    if tet == VACANT {
                        continue;
                    }
                    let packs = &mut data[place / T::WIDTH * width..][..width];
                    for (pack, lanes) in packs.iter_mut().zip(numbers) {
                        pack.as_mut()[place % T::WIDTH] = T::of(lanes[lane]);
                    }
                }
            };
            operator.reduced_tangents(increment, coupling, &chunk.tets, rule, &mut write)
        })
    }

    /// What the point data take in memory.
    #[cfg(feature = "bench-internals")]
    pub(crate) fn bytes(&self) -> usize {
        self.data.iter().map(|data| std::mem::size_of_val(data.as_slice())).sum()
    }

    /// y = A x.
    pub(crate) fn multiply(&mut self, x: &[[f64; 4]], y: &mut [[f64; 4]]) {
        let Self { layout, data, copies, .. } = self;
        layout.batches.gather(copies, y, |index, values, part| {
            let chunk = &layout.batches.chunks[index];
            values.clear();
            values.extend(chunk.global.iter().map(|&n| Aligned(x[n as usize])));
            dispatch(ChunkProduct::<T> { layout, chunk, data: &data[index], x: values, y: part });
        });
    }

    /// The diagonal, by node.
    pub(crate) fn diagonal(&mut self) -> Vec<[f64; 4]> {
        let Self { layout, data, places, copies } = self;
        let nodes = layout.batches.node_count();
        let slopes = slopes(&layout.rule);
        let mut out = vec![[0.0; 4]; nodes];
        layout.batches.gather(copies, &mut out, |index, _, part| {
            let chunk = &layout.batches.chunks[index];
            for_each_element::<T>(&layout.rule, chunk, &data[index], places, |local, element| {
                let mut diagonal = [[0.0; 4]; 10];
                add_diagonal(&layout.rule, &slopes, element, &mut diagonal[..local.len()]);
                for (&node, diagonal) in local.iter().zip(&diagonal) {
                    (0..4).for_each(|k| part[node].0[k] += diagonal[k]);
                }
            });
        });
        out
    }

    /// Adds the tangent of the linear functions on the same elements, whose nodes are the first
    /// four of each element: the level below quadratic elements.
    pub(crate) fn add_linear(&self, out: &mut Tangent) {
        let rule = &self.layout.rule;
        let linear = ReferenceRule {
            nodes: 4,
            damage: rule.damage.iter().map(|shape| linear_part(shape).to_vec()).collect(),
            ..rule.clone()
        };
        let slopes = slopes(&linear);
        let of_chunk = |(chunk, data): (&Chunk, &Vec<T::Pack>)| {
            let mut tets = chunk.tets.iter().filter(|t| **t != VACANT);
            let mut elements: Vec<(u32, [[Block; 4]; 4])> = Vec::with_capacity(chunk.tets.len());
            for_each_element::<T>(&linear, chunk, data, &self.places, |_, element| {
                let mut blocks = [[[[0.0; 4]; 4]; 4]; 4];
                for a in 0..4 {
                    for b in 0..=a {
                        blocks[a][b] = node_block(&linear, &slopes, element, a, b);
                    }
                }
                elements.push((*tets.next().expect("as many elements as places"), blocks));
            });
            elements
        };
        let chunks = &self.layout.batches.chunks;
        for (chunks, data) in chunks.chunks(AT_ONCE).zip(self.data.chunks(AT_ONCE)) {
            let elements: Vec<_> = chunks.par_iter().zip(data).map(of_chunk).collect();
            for (tet, blocks) in elements.iter().flatten() {
                out.add_elements(*tet as usize, std::slice::from_ref(blocks));
            }
        }
    }
}

/// λ at a point of which the shape functions are given.
fn linear_part(shape: &[f64]) -> [f64; 4] {
    let mut l = [0.0; 4];
    l.copy_from_slice(&shape[..4]);
    if shape.len() == 10 {
        // N_e of an edge is one half at either end of it for the linear functions
        for i in 0..4 {
            for j in 0..i {
                l[i] += 0.5 * shape[MIDDLE[i][j]];
                l[j] += 0.5 * shape[MIDDLE[i][j]];
            }
        }
    }
    l
}

/// ∂U_k/∂u_a at each elastic point.
fn slopes(rule: &ReferenceRule) -> Vec<Vec<[f64; 3]>> {
    let by_vertex = |l: &[f64; 4], a: usize| -> [f64; 4] {
        std::array::from_fn(|k| match (rule.nodes, a) {
            (4, _) => f64::from(a == k),
            (_, 0..4) => f64::from(a == k) * (4.0 * l[k] - 1.0),
            _ => (0..4).filter(|&j| j != k && MIDDLE[k][j] == a).map(|j| 4.0 * l[j]).sum(),
        })
    };
    let at = |l: &[f64; 4]| {
        (0..rule.nodes)
            .map(|a| {
                let d = by_vertex(l, a);
                [d[1] - d[0], d[2] - d[0], d[3] - d[0]]
            })
            .collect()
    };
    rule.at.iter().map(at).collect()
}

/// Calls `work` with the chunk nodes and the data of each element.
fn for_each_element<T: Real>(
    rule: &ReferenceRule,
    chunk: &Chunk,
    data: &[T::Pack],
    places: &[usize; LANES],
    mut work: impl FnMut(&[usize], &[f64]),
) {
    let width = rule.width();
    let nodes = chunk.local.len() / (chunk.tets.len() / LANES);
    let (mut local, mut element) = (vec![0; nodes], vec![0.0; width]);
    for (batch, data) in data.chunks_exact(LANES / T::WIDTH * width).enumerate() {
        for (row, &place) in places.iter().enumerate() {
            if chunk.tets[batch * LANES + row] == VACANT {
                continue;
            }
            for (a, local) in local.iter_mut().enumerate() {
                *local = usize::from(chunk.local[batch * nodes + a][row]);
            }
            for (x, pack) in element.iter_mut().zip(&data[place / T::WIDTH * width..]) {
                *x = pack.as_ref()[place % T::WIDTH].wide();
            }
            work(&local, &element);
        }
    }
}

/// Adds the diagonal of one element, by node.
fn add_diagonal(
    rule: &ReferenceRule,
    slopes: &[Vec<[f64; 3]>],
    element: &[f64],
    out: &mut [[f64; 4]],
) {
    let [before, gradient, points, _] = rule.lengths();
    let (gradient, rest) = element[before..].split_at(gradient);
    let (points, local) = rest.split_at(points);
    for (q, point) in points.chunks_exact(rule.point()).enumerate() {
        let axes = axes(point);
        for (d, out) in slopes[q].iter().zip(out.iter_mut()) {
            let mut s = [0.0; 3];
            for k in 0..3 {
                (0..3).for_each(|i| s[i] += d[k] * point[PUSH + 3 * k + i]);
            }
            for i in 0..3 {
                let mut own = point[NORMAL + packed(i, i)] * s[i] * s[i];
                for j in 0..3 {
                    if j == i {
                        continue;
                    }
                    let shear = point[SHEAR + 3 - i - j];
                    own += (shear + point[STRESS + j]) * s[j] * s[j];
                    let normal = point[NORMAL + packed(i.max(j), i.min(j))];
                    let pair = (normal + shear) * s[i] * s[j];
                    (0..3).for_each(|m| out[m] += axes[i][m] * axes[j][m] * pair);
                }
                (0..3).for_each(|m| out[m] += axes[i][m] * axes[i][m] * own);
            }
            if rule.damage.is_empty() {
                continue;
            }
            for k in 0..3 {
                for l in 0..3 {
                    let product = gradient[packed(k.max(l), k.min(l))];
                    out[3] += rule.weight[q] * d[k] * d[l] * product;
                }
            }
        }
    }
    for (p, shape) in rule.damage.iter().enumerate() {
        for (shape, out) in shape.iter().zip(out.iter_mut()) {
            out[3] += shape * shape * local[p.min(local.len() - 1)];
        }
    }
}

/// The block of nodes a and b of one element.
fn node_block(
    rule: &ReferenceRule,
    slopes: &[Vec<[f64; 3]>],
    element: &[f64],
    a: usize,
    b: usize,
) -> Block {
    let mut block = [[0.0; 4]; 4];
    let [damage_points, gradient, points, _] = rule.lengths();
    let (softening, rest) = element.split_at(damage_points);
    let (gradient, rest) = rest.split_at(gradient);
    let (points, local) = rest.split_at(points);
    for (q, point) in points.chunks_exact(rule.point()).enumerate() {
        let spatial = |d: &[f64; 3]| -> [f64; 3] {
            std::array::from_fn(|i| (0..3).map(|k| d[k] * point[PUSH + 3 * k + i]).sum())
        };
        let (sa, sb) = (spatial(&slopes[q][a]), spatial(&slopes[q][b]));
        let axes = axes(point);
        let turn = |v: [f64; 3]| -> [f64; 3] {
            std::array::from_fn(|m| (0..3).map(|i| axes[i][m] * v[i]).sum())
        };
        let principal: [[f64; 3]; 3] = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let normal = point[NORMAL + packed(i.max(j), i.min(j))] * sa[i] * sb[j];
                if i == j {
                    let others = (0..3)
                        .filter(|&l| l != i)
                        .map(|l| (point[SHEAR + 3 - i - l] + point[STRESS + l]) * sa[l] * sb[l]);
                    normal + others.sum::<f64>()
                } else {
                    normal + point[SHEAR + 3 - i - j] * sa[j] * sb[i]
                }
            })
        });
        let rows = principal.map(turn);
        for j in 0..3 {
            let column = turn([rows[0][j], rows[1][j], rows[2][j]]);
            (0..3).for_each(|i| block[i][j] += column[i]);
        }
        if rule.damage.is_empty() {
            continue;
        }
        let (da, db) = (&slopes[q][a], &slopes[q][b]);
        for k in 0..3 {
            for l in 0..3 {
                block[3][3] +=
                    rule.weight[q] * da[k] * db[l] * gradient[packed(k.max(l), k.min(l))];
            }
        }
        let soft = |node: usize| -> f64 {
            let terms = rule.mixing[q].iter().zip(softening).zip(&rule.damage);
            terms.map(|((c, g), shape)| c * g * shape[node]).sum()
        };
        let (soft_a, soft_b) = (soft(a), soft(b));
        let force = |s: [f64; 3]| turn(std::array::from_fn(|i| point[SOURCE + i] * s[i]));
        let (force_a, force_b) = (force(sa), force(sb));
        for i in 0..3 {
            block[i][3] += force_a[i] * soft_b;
            block[3][i] += force_b[i] * soft_a;
        }
    }
    for (p, shape) in rule.damage.iter().enumerate() {
        block[3][3] += shape[a] * shape[b] * local[p.min(local.len() - 1)];
    }
    block
}
