//! Block preconditioner of displacement and damage: multigrid for the displacement, Chebyshev steps for the damage,
//! whose block is dominated by its mass matrix. Positive definite if both blocks are.

use std::sync::Arc;

use rayon::prelude::*;

use super::amg::Amg;
use super::block_csr::BlockCsr;
use super::chebyshev::Chebyshev;
use super::vector::{CHUNK, Nodal, by_node, largest};
use crate::operator::Tangent;
use crate::parallel::{Halo, Ranks};

/// Degree of the Chebyshev polynomial for the damage block.
pub(super) const DEGREE: usize = 4;

#[derive(Debug)]
pub(super) struct FieldSplit {
    pub(super) displacement: Amg,
    pub(super) damage: Option<Chebyshev<1>>,
    halo: Arc<Halo>,
}

impl FieldSplit {
    /// Creates the preconditioner from this rank's part of the tangent on its vertices.
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
        z.par_iter_mut().with_min_len(CHUNK).zip(&x).for_each(|(z, x)| {
            *z = [0, 1, 2, 0].map(|k| scale * f64::from(x[k]));
            z[3] = 0.0;
        });
        if let Some(damage) = &self.damage {
            let (scale, mut residual) = narrow::<1>(r, 3, ranks);
            let mut x = vec![[0.0]; r.len()];
            damage.smooth(DEGREE, &mut residual, &mut x);
            let z = z.par_iter_mut().with_min_len(CHUNK);
            z.zip(&x).for_each(|(z, x)| z[3] = scale * f64::from(x[0]));
        }
    }
}

/// Returns the components from `first` to `first + R − 1` in single precision, divided by their largest absolute
/// value, and this value.
fn narrow<const R: usize>(r: &[Nodal], first: usize, ranks: &Ranks) -> (f64, Vec<[f32; R]>) {
    let of_node = |r: &Nodal| r[first..first + R].iter().fold(0.0f64, |m, v| m.max(v.abs()));
    let mut most = [largest(r, of_node)];
    ranks.max(&mut most);
    let scale = if most[0] > 0.0 { most[0] } else { 1.0 };
    let part = |r: &Nodal| std::array::from_fn(|k| (r[first + k] / scale) as f32);
    (scale, by_node(r, part))
}

/// Returns the block of the components from `first` to `first + R − 1`. Constrained values get a unit row and column
/// on the rank that owns them.
fn fields<const R: usize>(
    tangent: &Tangent,
    free: &[[bool; 4]],
    first: usize,
    halo: &Halo,
) -> BlockCsr<f64, R, R> {
    let graph = &tangent.pattern.graph;
    let entry = |row: usize, column: u32, entries: &[[f64; 4]; 4]| -> [[f64; R]; R] {
        let (of_row, of_column) = (&free[row], &free[column as usize]);
        let unit = row == column as usize && halo.owns(column);
        std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                if of_row[first + i] && of_column[first + j] {
                    entries[first + i][first + j]
                } else {
                    f64::from(unit && i == j)
                }
            })
        })
    };
    let mut block = vec![[[0.0; R]; R]; tangent.blocks.len()];
    let mut rows = Vec::with_capacity(free.len());
    let mut rest = block.as_mut_slice();
    for row in 0..free.len() {
        let (of_row, next) = rest.split_at_mut(graph.of(row).len());
        rows.push(of_row);
        rest = next;
    }
    rows.into_par_iter().with_min_len(CHUNK).enumerate().for_each(|(row, blocks)| {
        let entries = &tangent.blocks[graph.start[row] as usize..];
        for ((block, entries), &column) in blocks.iter_mut().zip(entries).zip(graph.of(row)) {
            *block = entry(row, column, entries);
        }
    });
    BlockCsr {
        columns: graph.nodes(),
        start: graph.start.clone(),
        column: graph.near.clone(),
        block,
    }
}
