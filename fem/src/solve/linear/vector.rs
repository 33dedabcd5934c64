//! Sums and updates of nodal vectors, whose results do not depend on the number of threads.

use std::borrow::BorrowMut;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::parallel::Halo;

/// What Krylov methods ask of vectors, wherever they are.
pub(super) trait Vectors {
    /// A vector, in the hands of somebody.
    type Vector: ?Sized;
    /// One of our own.
    type Owned: BorrowMut<Self::Vector>;

    /// A vector of zeros, as long as the given one.
    fn zero(&self, like: &Self::Vector) -> Self::Owned;

    /// x ← 0.
    fn clear(&self, x: &mut Self::Vector);

    /// a x.
    fn scaled(&self, x: &Self::Vector, a: f64) -> Self::Owned;

    /// Σ a b.
    fn dot(&self, a: &Self::Vector, b: &Self::Vector) -> f64;

    /// Σ w a b, the inner product with a diagonal weight.
    fn weighted_dot(&self, w: &Self::Vector, a: &Self::Vector, b: &Self::Vector) -> f64;

    /// y ← y + a x.
    fn add_scaled(&self, y: &mut Self::Vector, a: f64, x: &Self::Vector);

    /// y ← x + a y.
    fn scale_and_add(&self, y: &mut Self::Vector, a: f64, x: &Self::Vector);
}

/// Vectors in the memory of this process, which may be one of several.
#[derive(Clone, Debug, Default)]
pub(super) struct InMemory {
    pub(super) halo: Arc<Halo>,
}

impl InMemory {
    /// A sum over nodes, of each of which one rank counts.
    fn sum(&self, nodes: usize, part: impl Fn(Range<usize>) -> f64) -> f64 {
        if self.halo.ranks().is_alone() {
            return part(0..nodes);
        }
        let mut sum = [self.halo.own(nodes).into_iter().map(part).sum()];
        self.halo.ranks().sum(&mut sum);
        sum[0]
    }
}

impl Vectors for InMemory {
    type Vector = [Nodal];
    type Owned = Vec<Nodal>;

    fn zero(&self, like: &[Nodal]) -> Vec<Nodal> {
        vec![[0.0; 4]; like.len()]
    }

    fn clear(&self, x: &mut [Nodal]) {
        x.fill([0.0; 4]);
    }

    fn scaled(&self, x: &[Nodal], a: f64) -> Vec<Nodal> {
        x.iter().map(|x| x.map(|v| a * v)).collect()
    }

    fn dot(&self, a: &[Nodal], b: &[Nodal]) -> f64 {
        self.sum(a.len(), |own| dot(&a[own.clone()], &b[own]))
    }

    fn weighted_dot(&self, w: &[Nodal], a: &[Nodal], b: &[Nodal]) -> f64 {
        self.sum(a.len(), |own| weighted_dot(&w[own.clone()], &a[own.clone()], &b[own]))
    }

    fn add_scaled(&self, y: &mut [Nodal], a: f64, x: &[Nodal]) {
        add_scaled(y, a, x);
    }

    fn scale_and_add(&self, y: &mut [Nodal], a: f64, x: &[Nodal]) {
        scale_and_add(y, a, x);
    }
}

/// u_x, u_y, u_z, φ of a node.
pub(crate) type Nodal = [f64; 4];

/// Nodes a task works on: partial sums are taken over these, then added in order.
pub(super) const CHUNK: usize = 4096;

/// Σ w a b, the inner product with a diagonal weight.
pub(in crate::solve) fn weighted_dot(w: &[Nodal], a: &[Nodal], b: &[Nodal]) -> f64 {
    let part = |((w, a), b): ((&[Nodal], &[Nodal]), &[Nodal])| {
        let mut sum = [0.0; 4];
        for ((w, a), b) in w.iter().zip(a).zip(b) {
            for k in 0..4 {
                sum[k] += w[k] * a[k] * b[k];
            }
        }
        sum.iter().sum::<f64>()
    };
    let parts: Vec<f64> =
        w.par_chunks(CHUNK).zip(a.par_chunks(CHUNK)).zip(b.par_chunks(CHUNK)).map(part).collect();
    parts.iter().sum()
}

/// Σ a b.
pub(super) fn dot(a: &[Nodal], b: &[Nodal]) -> f64 {
    let part = |(a, b): (&[Nodal], &[Nodal])| {
        let mut sum = [0.0; 4];
        for (a, b) in a.iter().zip(b) {
            for k in 0..4 {
                sum[k] += a[k] * b[k];
            }
        }
        sum.iter().sum::<f64>()
    };
    let parts: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(part).collect();
    parts.iter().sum()
}

/// y ← y + a x.
pub(in crate::solve) fn add_scaled(y: &mut [Nodal], a: f64, x: &[Nodal]) {
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            for k in 0..4 {
                y[k] += a * x[k];
            }
        }
    });
}

/// y ← x + a y.
pub(super) fn scale_and_add(y: &mut [Nodal], a: f64, x: &[Nodal]) {
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            for k in 0..4 {
                y[k] = x[k] + a * y[k];
            }
        }
    });
}

/// Sets the constrained values to zero.
pub(in crate::solve) fn mask(free: &[[bool; 4]], x: &mut [Nodal]) {
    for (x, free) in x.iter_mut().zip(free) {
        for k in 0..4 {
            x[k] = if free[k] { x[k] } else { 0.0 };
        }
    }
}

/// 1/|A_ii| of the free values, zero in the others; vanishing pivots count as small ones.
pub(super) fn weights(diagonal: &[Nodal], free: &[[bool; 4]], halo: &Halo) -> Vec<Nodal> {
    const LEAST: f64 = 1e-8;
    let mut most = [0.0f64; 4];
    for d in diagonal {
        for k in 0..4 {
            most[k] = most[k].max(d[k].abs());
        }
    }
    halo.ranks().max(&mut most);
    let least = most.map(|m| if m > 0.0 { LEAST * m } else { 1.0 });
    let weight = |(d, free): (&Nodal, &[bool; 4])| {
        std::array::from_fn(|k| if free[k] { 1.0 / d[k].abs().max(least[k]) } else { 0.0 })
    };
    diagonal.iter().zip(free).map(weight).collect()
}
