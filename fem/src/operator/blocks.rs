//! Node blocks of an element's tangent, computed from its point data.

use super::point_data::{PointData, SOFTENING, SOURCE};
use crate::element::Rule;
use crate::material::{PointTangent, Scalar, packed};

/// The 4 × 4 blocks of node pairs (a, b): rows u_x, u_y, u_z, φ of a, columns u_x, u_y, u_z, φ of b.
pub type Blocks<T, const N: usize> = [[[[T; 4]; 4]; N]; N];

/// The tangent at an elastic point, with the gradients of the shape functions.
struct AtPoint<T, const N: usize> {
    tangent: PointTangent<T>,
    /// F⁻ᵀ ∇N_a in the principal axes, by node.
    spatial: [[T; 3]; N],
}

impl<T: Scalar, const N: usize> AtPoint<T, N> {
    #[inline(always)]
    fn new(tangent: PointTangent<T>, push: &[[T; 3]; 3], slopes: &[[f64; 3]; N]) -> Self {
        let zero = push[0][0].constant(0.0);
        let mut spatial = [[zero; 3]; N];
        for a in 0..N {
            for k in 0..3 {
                if N == 4 {
                    for i in 0..3 {
                        if a == k + 1 {
                            spatial[a][i] = push[k][i];
                        } else if a == 0 {
                            spatial[a][i] = spatial[a][i] - push[k][i];
                        }
                    }
                    continue;
                }
                let slope = zero.constant(slopes[a][k]);
                for i in 0..3 {
                    spatial[a][i] = slope.mul_add(push[k][i], spatial[a][i]);
                }
            }
        }
        Self { tangent, spatial }
    }

    /// 2 Gc ℓ₀/c₀ V ∇N_a · ∇λ_k, by k.
    #[inline(always)]
    fn damage_flux(gradient: &[T], slope: &[f64; 3]) -> [T; 3] {
        let zero = gradient[0].constant(0.0);
        let mut flux = [zero; 3];
        for k in 0..3 {
            for l in 0..3 {
                let (r, s) = if k > l { (k, l) } else { (l, k) };
                flux[k] = zero.constant(slope[l]).mul_add(gradient[packed(r, s)], flux[k]);
            }
        }
        flux
    }
}

/// Derivatives of g at elastic point q with respect to φ of each node: Σ_p C_qp g′_p N_a(p).
#[inline(always)]
fn softening_of_nodes<T: Scalar, const N: usize>(rule: &Rule, q: usize, numbers: &[T]) -> [T; N] {
    let zero = numbers[0].constant(0.0);
    let mut soft = [zero; N];
    for (p, &c) in rule.mixing[q].iter().enumerate() {
        let slope = zero.constant(c) * numbers[p];
        let shape = rule.damage[p].shape.first_chunk::<N>().expect("a value of each node");
        for a in 0..N {
            soft[a] = slope.mul_add(zero.constant(shape[a]), soft[a]);
        }
    }
    soft
}

/// Computes the blocks (a, b ≤ a) of the symmetric matrix of an element from its point data. `blocks` must be
/// zero on entry. `AXES` and `plain` must be the values with which the point data were written.
#[inline(always)]
pub fn write_blocks<T: Scalar, const AXES: bool, const N: usize>(
    rule: &Rule,
    plain: bool,
    numbers: &[T],
    blocks: &mut Blocks<T, N>,
) {
    let zero = numbers[0].constant(0.0);
    let data = PointData::of(rule, plain);
    for (q, point) in rule.points.iter().enumerate() {
        let slopes = point.slopes.first_chunk::<N>().expect("a slope of each node");
        let (tangent, push) = data.read_point::<T, AXES>(q, numbers);
        let at = AtPoint::new(tangent, &push, slopes);
        // shape functions sum to one, so the blocks of node 0 follow from the other blocks
        for a in 1..N {
            for b in 1..=a {
                let block = at.tangent.block(&at.spatial[a], &at.spatial[b]);
                for i in 0..3 {
                    for j in 0..3 {
                        blocks[a][b][i][j] += block[i][j];
                    }
                }
            }
        }
        if rule.damage.is_empty() {
            continue;
        }
        let gradient = &numbers[data.gradient(q)..];
        let weight = zero.constant(if plain { point.weight } else { 1.0 });
        let soft = softening_of_nodes::<T, N>(rule, q, numbers);
        let mut forces = [[zero; 3]; N];
        for a in 0..N {
            let mut force = at.spatial[a];
            for i in 0..3 {
                force[i] = force[i] * numbers[data.point(q) + SOURCE + i];
            }
            forces[a] = at.tangent.turn(&force);
        }
        for a in 1..N {
            let flux = AtPoint::<T, N>::damage_flux(gradient, &slopes[a]);
            for b in 1..=a {
                let mut product = zero;
                for k in 0..3 {
                    product = zero.constant(slopes[b][k]).mul_add(flux[k], product);
                }
                if N == 4 {
                    product = gradient[packed(a - 1, b - 1)];
                }
                blocks[a][b][3][3] = weight.mul_add(product, blocks[a][b][3][3]);
            }
        }
        for a in 0..N {
            for b in 0..=a {
                let block = &mut blocks[a][b];
                for i in 0..3 {
                    block[i][3] = forces[a][i].mul_add(soft[b], block[i][3]);
                    block[3][i] = forces[b][i].mul_add(soft[a], block[3][i]);
                }
            }
        }
    }
    complete_first(blocks);
    if !plain && !rule.damage.is_empty() {
        for q in 0..rule.points.len() {
            let soft = softening_of_nodes::<T, N>(rule, q, numbers);
            let curvature = numbers[data.point(q) + SOFTENING];
            for a in 0..N {
                for b in 0..=a {
                    let block = &mut blocks[a][b][3][3];
                    *block = (curvature * soft[a]).mul_add(soft[b], *block);
                }
            }
        }
    }
    for (p, point) in rule.damage.iter().enumerate() {
        let local = numbers[data.local(p)];
        for a in 0..N {
            for b in 0..=a {
                let product = point.shape[a] * point.shape[b];
                if product != 0.0 {
                    let block = &mut blocks[a][b][3][3];
                    *block = zero.constant(product).mul_add(local, *block);
                }
            }
        }
    }
}

/// Computes the blocks of node 0 from the other blocks: the shape functions sum to one. Applies to the terms
/// with gradients; terms without gradients and coupling terms are added separately.
#[inline(always)]
fn complete_first<T: Scalar, const N: usize>(blocks: &mut Blocks<T, N>) {
    for i in 0..4 {
        for j in 0..4 {
            if (i == 3) != (j == 3) {
                continue;
            }
            for a in 1..N {
                for b in 1..N {
                    let entry = if b <= a { blocks[a][b][i][j] } else { blocks[b][a][j][i] };
                    blocks[a][0][i][j] = blocks[a][0][i][j] - entry;
                }
            }
            for a in 1..N {
                blocks[0][0][i][j] = blocks[0][0][i][j] - blocks[a][0][i][j];
            }
        }
    }
}

/// The diagonal of the element's matrix.
#[inline(always)]
pub(super) fn diagonal<T: Scalar, const N: usize>(
    rule: &Rule,
    plain: bool,
    numbers: &[T],
) -> [[T; 4]; N] {
    let zero = numbers[0].constant(0.0);
    let data = PointData::of(rule, plain);
    let mut out = [[zero; 4]; N];
    for (q, point) in rule.points.iter().enumerate() {
        let slopes = point.slopes.first_chunk::<N>().expect("a slope of each node");
        let (tangent, push) = data.read_point::<T, false>(q, numbers);
        let at = AtPoint::new(tangent, &push, slopes);
        for a in 0..N {
            let block = at.tangent.block(&at.spatial[a], &at.spatial[a]);
            for i in 0..3 {
                out[a][i] += block[i][i];
            }
            if rule.damage.is_empty() {
                continue;
            }
            let flux = AtPoint::<T, N>::damage_flux(&numbers[data.gradient(q)..], &slopes[a]);
            let weight = if plain { point.weight } else { 1.0 };
            for k in 0..3 {
                let share = zero.constant(weight * slopes[a][k]);
                out[a][3] = share.mul_add(flux[k], out[a][3]);
            }
        }
        if !plain && !rule.damage.is_empty() {
            let soft = softening_of_nodes::<T, N>(rule, q, numbers);
            let curvature = numbers[data.point(q) + SOFTENING];
            for a in 0..N {
                out[a][3] = (curvature * soft[a]).mul_add(soft[a], out[a][3]);
            }
        }
    }
    for (p, point) in rule.damage.iter().enumerate() {
        let local = numbers[data.local(p)];
        for a in 0..N {
            let square = zero.constant(point.shape[a] * point.shape[a]);
            out[a][3] = square.mul_add(local, out[a][3]);
        }
    }
    out
}
