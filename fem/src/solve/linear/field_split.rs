//! Block preconditioner of the four fields: multigrid for the displacement, Chebyshev steps for
//! the damage, whose block is mostly mass. Positive definite where both blocks are.

use std::sync::Arc;

use super::amg::Amg;
use super::block_csr::BlockCsr;
use super::chebyshev::Chebyshev;
use super::vector::Nodal;
use crate::operator::Tangent;
use crate::parallel::{Halo, Ranks};

/// Degree of the polynomial in the damage block.
pub(super) const DEGREE: usize = 4;

#[derive(Debug)]
pub(super) struct FieldSplit {
    pub(super) displacement: Amg,
    pub(super) damage: Option<Chebyshev<1>>,
    halo: Arc<Halo>,
}

impl FieldSplit {
    /// Of this rank's part of the tangent, on its vertices.
    pub(super) fn new(
        tangent: &Tangent,
        points: &[[f64; 3]],
        free: &[[bool; 4]],
        halo: &Arc<Halo>,
    ) -> Self {
        let displacement = Amg::new(&fields::<3>(tangent, free, 0, halo), points, free, halo);
        let has_damage = halo.ranks().any(free.iter().any(|f| f[3]));
        let damage = has_damage.then(|| Chebyshev::new(&fields::<1>(tangent, free, 3, halo), halo));
        Self { displacement, damage, halo: Arc::clone(halo) }
    }

    /// z ≈ A⁻¹ r.
    pub(super) fn apply(&self, r: &[Nodal], z: &mut [Nodal]) {
        let ranks = self.halo.ranks();
        let (scale, right) = narrow::<3>(r, 0, ranks);
        let mut x = vec![[0.0; 3]; r.len()];
        self.displacement.cycle(&right, &mut x);
        for (z, x) in z.iter_mut().zip(&x) {
            *z = [0, 1, 2, 0].map(|k| scale * f64::from(x[k]));
            z[3] = 0.0;
        }
        if let Some(damage) = &self.damage {
            let (scale, mut residual) = narrow::<1>(r, 3, ranks);
            let mut x = vec![[0.0]; r.len()];
            damage.smooth(DEGREE, &mut residual, &mut x);
            z.iter_mut().zip(&x).for_each(|(z, x)| z[3] = scale * f64::from(x[0]));
        }
    }
}

/// The fields from `first` on in single precision, and their scale.
fn narrow<const R: usize>(r: &[Nodal], first: usize, ranks: &Ranks) -> (f64, Vec<[f32; R]>) {
    let largest = r.iter().flat_map(|r| &r[first..first + R]).fold(0.0f64, |m, v| m.max(v.abs()));
    let mut largest = [largest];
    ranks.max(&mut largest);
    let scale = if largest[0] > 0.0 { largest[0] } else { 1.0 };
    let part = |r: &Nodal| std::array::from_fn(|k| (r[first + k] / scale) as f32);
    (scale, r.iter().map(part).collect())
}

/// The block of the fields from `first` on; constrained values get a unit row and column from the rank that
/// they belong to.
fn fields<const R: usize>(
    tangent: &Tangent,
    free: &[[bool; 4]],
    first: usize,
    halo: &Halo,
) -> BlockCsr<f64, R, R> {
    let graph = &tangent.pattern.graph;
    let mut block = Vec::with_capacity(tangent.blocks.len());
    for (row, of_row) in free.iter().enumerate() {
        let unit = halo.owns(row as u32);
        for (place, &column) in (graph.start[row] as usize..).zip(graph.of(row)) {
            let of_column = &free[column as usize];
            let entries = &tangent.blocks[place];
            block.push(std::array::from_fn(|i| {
                std::array::from_fn(|j| {
                    if of_row[first + i] && of_column[first + j] {
                        entries[first + i][first + j]
                    } else {
                        f64::from(unit && row == column as usize && i == j)
                    }
                })
            }));
        }
    }
    BlockCsr {
        columns: graph.nodes(),
        start: graph.start.clone(),
        column: graph.near.clone(),
        block,
    }
}
