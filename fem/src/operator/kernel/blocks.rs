//! Node blocks and diagonal of an element's tangent, computed from the stored data.
//!
//! At each elastic point the tangent is applied to unit vectors for the differences U_k = ∂u/∂λ_k − ∂u/∂λ₀. The
//! slopes of the shape functions then distribute the result to pairs of nodes.

use super::contract::{Contraction, Loaded};
use super::point_data::DataLayout;
use crate::element::Rule;
use crate::material::{Computation, Scalar, packed};

/// 4 × 4 blocks of node pairs (a, b): rows u_x, u_y, u_z, φ of a, columns u_x, u_y, u_z, φ of b.
pub type Blocks<T, const N: usize> = [[[[T; 4]; 4]; N]; N];

/// Tangent of an element in the form of its stored data.
struct Stored<'a, T, const N: usize> {
    rule: &'a Rule,
    layout: DataLayout,
    plain: bool,
    data: &'a [T],
}

impl<'a, T: Scalar, const N: usize> Stored<'a, T, N> {
    #[inline(always)]
    fn new(rule: &'a Rule, plain: bool, data: &'a [T]) -> Self {
        Self { rule, layout: DataLayout::new(rule, plain), plain, data }
    }

    #[inline(always)]
    fn constant(&self, x: f64) -> T {
        self.data[0].constant(x)
    }

    #[inline(always)]
    fn tangent<const AXES: bool>(&self, q: usize) -> Contraction<'a, T, Loaded<T>> {
        let (stored, loader) = (self.layout.point(q, self.data), Loaded(self.data[0]));
        if AXES {
            Contraction::with_axes(stored, loader, self.layout.axes(q, self.data))
        } else {
            Contraction::new(stored, loader)
        }
    }

    /// Returns the tangent at elastic point q for unit differences, see [`Contraction::unit_blocks`].
    #[inline(always)]
    fn unit_blocks<const AXES: bool>(&self, q: usize) -> UnitBlocks<T> {
        if self.rule.extra.stored {
            return self.constant(0.0).vectorize(WithExtra::<T, AXES, N> { stored: self, q }).0;
        }
        self.tangent::<AXES>(q).unit_blocks()
    }

    /// Returns the coupling of displacement and damage at elastic point q:
    /// [`Contraction::unit_source`] and [`Contraction::unit_driving`].
    #[inline(always)]
    fn unit_coupling<const AXES: bool>(&self, q: usize) -> [[[T; 3]; 3]; 2] {
        if self.rule.extra.stored {
            return self.constant(0.0).vectorize(WithExtra::<T, AXES, N> { stored: self, q }).1;
        }
        [self.tangent::<AXES>(q).unit_source(); 2]
    }

    /// Returns the largest index b of the blocks (a, b) that are computed for node a: the last node if the
    /// tangent is not symmetric, else a.
    #[inline(always)]
    fn last(&self, a: usize) -> usize {
        if self.rule.extra.unsymmetric { N - 1 } else { a }
    }

    #[inline(always)]
    fn slopes(&self, q: usize) -> &'a [[f64; 3]; N] {
        self.rule.elastic_points[q].slopes.first_chunk().expect("a slope of each node")
    }

    #[inline(always)]
    fn has_damage(&self) -> bool {
        !self.rule.damage.is_empty()
    }

    /// Returns the gradient term 2 Gc ℓ₀/c₀ ∇λ_k·∇λ_l at elastic point q, times the weight of the point, packed.
    #[inline(always)]
    fn gradient_term(&self, q: usize) -> [T; 6] {
        let mut term = [self.constant(0.0); 6];
        if self.plain {
            let weight = self.constant(self.rule.elastic_points[q].weight);
            let shared = self.layout.shared_gradient(self.data);
            for entry in 0..6 {
                term[entry] = weight * shared[entry];
            }
        } else if let Some(gradient) = self.layout.point(q, self.data).gradient {
            term = *gradient;
        }
        term
    }

    /// Returns the derivatives of g at elastic point q with respect to φ of each node a: Σ_p C_qp g′_p N_a(p).
    #[inline(always)]
    fn degradation_of_nodes(&self, q: usize) -> [T; N] {
        let slopes = self.layout.degradation_slopes(self.data);
        let mut of_nodes = [self.constant(0.0); N];
        for (p, &c) in self.rule.mixing[q].iter().enumerate() {
            let slope = self.constant(c) * slopes[p];
            let shape = self.rule.damage[p].shape.first_chunk::<N>().expect("a value of each node");
            for a in 0..N {
                of_nodes[a] = slope.mul_add(self.constant(shape[a]), of_nodes[a]);
            }
        }
        of_nodes
    }
}

/// Tangent for unit differences: entry (k, l) maps U_l to the flux conjugate to U_k.
type UnitBlocks<T> = [[[[T; 3]; 3]; 3]; 3];

/// Unit blocks and coupling of a point with the tangent terms of viscoelastic and plastic laws. This computation is
/// a separate function, so that the computations for elastic laws do not contain its code.
struct WithExtra<'a, 'b, T, const AXES: bool, const N: usize> {
    stored: &'b Stored<'a, T, N>,
    q: usize,
}

impl<T: Scalar, const AXES: bool, const N: usize> Computation for WithExtra<'_, '_, T, AXES, N> {
    type Output = (UnitBlocks<T>, [[[T; 3]; 3]; 2]);

    #[inline(always)]
    fn run(self) -> Self::Output {
        let Self { stored, q } = self;
        let extra = stored.layout.extra(q, stored.data);
        let tangent = stored.tangent::<AXES>(q).with_extra(extra);
        let coupling = match stored.has_damage() {
            true => [tangent.unit_source(), tangent.unit_driving()],
            false => [[[stored.constant(0.0); 3]; 3]; 2],
        };
        (tangent.unit_blocks(), coupling)
    }
}

/// Returns Σ_k `slopes[k]` `values[k]`.
#[inline(always)]
fn combine<T: Scalar>(slopes: &[f64; 3], values: &[[T; 3]; 3]) -> [T; 3] {
    let mut sum = [values[0][0].constant(0.0); 3];
    for k in 0..3 {
        let slope = sum[0].constant(slopes[k]);
        for i in 0..3 {
            sum[i] = slope.mul_add(values[k][i], sum[i]);
        }
    }
    sum
}

/// Computes the blocks of the element matrix from the stored tangent data of the element: the blocks (a, b ≤ a) if
/// the quadrature rule states that the matrix is symmetric, else all blocks. `blocks` must be zero on entry. `AXES`
/// and `plain` must be the values with which the data were written.
#[inline(always)]
pub fn write_blocks<T: Scalar, const AXES: bool, const N: usize>(
    rule: &Rule,
    plain: bool,
    data: &[T],
    blocks: &mut Blocks<T, N>,
) {
    let stored = Stored::<T, N>::new(rule, plain, data);
    for q in 0..rule.elastic_points.len() {
        add_stiffness(&stored, stored.slopes(q), &stored.unit_blocks::<AXES>(q), blocks);
        if stored.has_damage() {
            add_gradient(&stored, stored.slopes(q), &stored.gradient_term(q), blocks);
        }
    }
    complete_first(&stored, blocks);
    if !stored.has_damage() {
        return;
    }
    for q in 0..rule.elastic_points.len() {
        let (tangent, slopes) = (stored.tangent::<AXES>(q), stored.slopes(q));
        let [source, unit] = stored.unit_coupling::<AXES>(q);
        let degradation = stored.degradation_of_nodes(q);
        let mut forces = [[stored.constant(0.0); 3]; N];
        for a in 0..N {
            forces[a] = combine(&slopes[a], &source);
        }
        let mut driving = forces;
        if rule.extra.stored {
            for a in 0..N {
                driving[a] = combine(&slopes[a], &unit);
            }
        }
        for a in 0..N {
            for b in 0..=stored.last(a) {
                let block = &mut blocks[a][b];
                for i in 0..3 {
                    block[i][3] = forces[a][i].mul_add(degradation[b], block[i][3]);
                    block[3][i] = driving[b][i].mul_add(degradation[a], block[3][i]);
                }
                if let Some(driving_slope) = tangent.driving_slope() {
                    block[3][3] =
                        (driving_slope * degradation[a]).mul_add(degradation[b], block[3][3]);
                }
            }
        }
    }
    for (p, point) in rule.damage.iter().enumerate() {
        let local = *stored.layout.local(p, data);
        for a in 0..N {
            for b in 0..=stored.last(a) {
                let product = point.shape[a] * point.shape[b];
                if product != 0.0 {
                    let block = &mut blocks[a][b][3][3];
                    *block = stored.constant(product).mul_add(local, *block);
                }
            }
        }
    }
}

/// Adds the contribution of one elastic point to the displacement blocks of nodes 1, 2, …, N − 1.
#[inline(always)]
fn add_stiffness<T: Scalar, const N: usize>(
    stored: &Stored<'_, T, N>,
    slopes: &[[f64; 3]; N],
    unit: &[[[[T; 3]; 3]; 3]; 3],
    blocks: &mut Blocks<T, N>,
) {
    let zero = unit[0][0][0][0].constant(0.0);
    let unsymmetric = stored.rule.extra.unsymmetric;
    for b in 1..N {
        if N == 4 {
            // in a linear element, the displacement of node b changes only the difference with index b − 1
            for a in 1..N {
                if b <= stored.last(a) {
                    add_block(&mut blocks[a][b], zero.constant(1.0), &unit[a - 1][b - 1]);
                }
            }
            continue;
        }
        // flux that is conjugate to U_k for a displacement of node b
        let mut of_node = [[[zero; 3]; 3]; 3];
        for k in 0..3 {
            for l in 0..3 {
                let slope = zero.constant(slopes[b][l]);
                for i in 0..3 {
                    for j in 0..3 {
                        let computed = l <= k || unsymmetric;
                        let entry = if computed { unit[k][l][i][j] } else { unit[l][k][j][i] };
                        of_node[k][i][j] = slope.mul_add(entry, of_node[k][i][j]);
                    }
                }
            }
        }
        for a in if unsymmetric { 1 } else { b }..N {
            for k in 0..3 {
                add_block(&mut blocks[a][b], zero.constant(slopes[a][k]), &of_node[k]);
            }
        }
    }
}

/// Adds `factor` · `term` to the displacement part of a block.
#[inline(always)]
fn add_block<T: Scalar>(block: &mut [[T; 4]; 4], factor: T, term: &[[T; 3]; 3]) {
    for i in 0..3 {
        for j in 0..3 {
            block[i][j] = factor.mul_add(term[i][j], block[i][j]);
        }
    }
}

/// Adds the gradient term of one elastic point to the damage blocks of nodes 1, 2, …, N − 1.
#[inline(always)]
fn add_gradient<T: Scalar, const N: usize>(
    stored: &Stored<'_, T, N>,
    slopes: &[[f64; 3]; N],
    term: &[T; 6],
    blocks: &mut Blocks<T, N>,
) {
    for a in 1..N {
        for b in 1..=stored.last(a) {
            let block = &mut blocks[a][b][3][3];
            if N == 4 {
                let (k, l) = (a - 1, b - 1);
                *block += term[packed(k.max(l), k.min(l))];
                continue;
            }
            for k in 0..3 {
                for l in 0..3 {
                    let product = block.constant(slopes[a][k] * slopes[b][l]);
                    *block = product.mul_add(term[packed(k.max(l), k.min(l))], *block);
                }
            }
        }
    }
}

/// Computes the blocks of node 0 from the other blocks. This applies only to terms with gradients, because the
/// gradients of all shape functions sum to zero.
#[inline(always)]
fn complete_first<T: Scalar, const N: usize>(stored: &Stored<'_, T, N>, blocks: &mut Blocks<T, N>) {
    let unsymmetric = stored.rule.extra.unsymmetric;
    for i in 0..4 {
        for j in 0..4 {
            if (i == 3) != (j == 3) {
                continue;
            }
            for a in 1..N {
                for b in 1..N {
                    let computed = b <= a || unsymmetric;
                    let entry = if computed { blocks[a][b][i][j] } else { blocks[b][a][j][i] };
                    blocks[a][0][i][j] = blocks[a][0][i][j] - entry;
                    if unsymmetric {
                        blocks[0][b][i][j] = blocks[0][b][i][j] - entry;
                    }
                }
            }
            for a in 1..N {
                blocks[0][0][i][j] = blocks[0][0][i][j] - blocks[a][0][i][j];
            }
        }
    }
}

/// Computes the diagonal of the element matrix, four values per node.
#[inline(always)]
pub(crate) fn diagonal<T: Scalar, const N: usize>(
    rule: &Rule,
    plain: bool,
    data: &[T],
) -> [[T; 4]; N] {
    let stored = Stored::<T, N>::new(rule, plain, data);
    let mut out = [[stored.constant(0.0); 4]; N];
    for q in 0..rule.elastic_points.len() {
        let tangent = stored.tangent::<false>(q);
        let (unit, slopes) = (stored.unit_blocks::<false>(q), stored.slopes(q));
        for a in 0..N {
            for k in 0..3 {
                for l in 0..=k {
                    let half = if l < k { 1.0 } else { 0.5 };
                    let product = stored.constant(half * slopes[a][k] * slopes[a][l]);
                    for i in 0..3 {
                        let computed = l == k || rule.extra.unsymmetric;
                        let other = if computed { unit[l][k][i][i] } else { unit[k][l][i][i] };
                        out[a][i] = product.mul_add(unit[k][l][i][i] + other, out[a][i]);
                    }
                }
            }
        }
        if !stored.has_damage() {
            continue;
        }
        let term = stored.gradient_term(q);
        for a in 0..N {
            for k in 0..3 {
                for l in 0..=k {
                    let twice = if l < k { 2.0 } else { 1.0 };
                    let product = stored.constant(twice * slopes[a][k] * slopes[a][l]);
                    out[a][3] = product.mul_add(term[packed(k, l)], out[a][3]);
                }
            }
        }
        if let Some(driving_slope) = tangent.driving_slope() {
            let degradation = stored.degradation_of_nodes(q);
            for a in 0..N {
                out[a][3] = (driving_slope * degradation[a]).mul_add(degradation[a], out[a][3]);
            }
        }
    }
    for (p, point) in rule.damage.iter().enumerate() {
        let local = *stored.layout.local(p, data);
        for a in 0..N {
            let square = stored.constant(point.shape[a] * point.shape[a]);
            out[a][3] = square.mul_add(local, out[a][3]);
        }
    }
    out
}
