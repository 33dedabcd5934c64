//! Sums and updates of nodal vectors. The results do not depend on the number of threads.

use std::borrow::BorrowMut;
use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;

use crate::parallel::Halo;

/// Vector operations that Krylov methods need, for vectors in any memory.
pub(super) trait Vectors {
    /// Borrowed vector.
    type Vector: ?Sized;
    /// Owned vector.
    type Owned: BorrowMut<Self::Vector>;

    /// Returns a vector of zeros with the length of `like`.
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

    /// Stored vector for later sums; may have less precision than [`Self::Vector`].
    type Kept;

    /// Stores a x. `coarse`: single precision (seven digits) is sufficient.
    fn keep(&self, x: &Self::Vector, a: f64, coarse: bool) -> Self::Kept;

    /// Σ w a b with a stored vector a.
    fn weighted_dot_kept(&self, w: &Self::Vector, a: &Self::Kept, b: &Self::Vector) -> f64;

    /// y ← y + a x with a stored vector x.
    fn add_kept(&self, y: &mut Self::Vector, a: f64, x: &Self::Kept);
}

/// Vectors in the memory of this process, which may be one of several ranks.
#[derive(Clone, Debug, Default)]
pub(super) struct InMemory {
    pub(super) halo: Arc<Halo>,
}

impl InMemory {
    /// Sums `part` over all nodes; each node is counted on the rank that owns it.
    fn sum(&self, nodes: usize, part: impl Fn(Range<usize>) -> f64) -> f64 {
        if self.halo.ranks().is_alone() {
            return part(0..nodes);
        }
        let mut sum = [self.halo.own(nodes).into_iter().map(part).sum()];
        self.halo.ranks().sum(&mut sum);
        sum[0]
    }
}

/// Stored vector, in double or in single precision.
#[derive(Debug)]
pub(super) enum Kept {
    Whole(Vec<Nodal>),
    Short(Vec<[f32; 4]>),
}

impl Vectors for InMemory {
    type Vector = [Nodal];
    type Owned = Vec<Nodal>;
    type Kept = Kept;

    fn zero(&self, like: &[Nodal]) -> Vec<Nodal> {
        vec![[0.0; 4]; like.len()]
    }

    fn clear(&self, x: &mut [Nodal]) {
        x.par_chunks_mut(CHUNK).for_each(|x| x.fill([0.0; 4]));
    }

    fn scaled(&self, x: &[Nodal], a: f64) -> Vec<Nodal> {
        by_node(x, |x| x.map(|v| a * v))
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

    fn keep(&self, x: &[Nodal], a: f64, coarse: bool) -> Kept {
        match coarse {
            true => Kept::Short(by_node(x, |x| x.map(|v| (a * v) as f32))),
            false => Kept::Whole(self.scaled(x, a)),
        }
    }

    fn weighted_dot_kept(&self, w: &[Nodal], a: &Kept, b: &[Nodal]) -> f64 {
        match a {
            Kept::Whole(a) => self.weighted_dot(w, a, b),
            Kept::Short(a) => {
                self.sum(b.len(), |own| weighted_dot(&w[own.clone()], &a[own.clone()], &b[own]))
            }
        }
    }

    fn add_kept(&self, y: &mut [Nodal], a: f64, x: &Kept) {
        match x {
            Kept::Whole(x) => add_scaled(y, a, x),
            Kept::Short(x) => add_scaled(y, a, x),
        }
    }
}

/// Values u_x, u_y, u_z, φ of a node.
pub(crate) type Nodal = [f64; 4];

/// Number of nodes per task. Partial sums over these nodes are added in order.
pub(in crate::solve) const CHUNK: usize = 4096;

/// Applies `of` to every node.
pub(super) fn by_node<A: Sync, B: Send>(x: &[A], of: impl Fn(&A) -> B + Sync + Send) -> Vec<B> {
    x.par_iter().with_min_len(CHUNK).map(of).collect()
}

/// Σ w a b, the inner product with a diagonal weight.
pub(in crate::solve) fn weighted_dot<T: Copy + Into<f64> + Sync>(
    w: &[Nodal],
    a: &[[T; 4]],
    b: &[Nodal],
) -> f64 {
    type Nodes<'a, T> = &'a [[T; 4]];
    let part = |((w, a), b): ((Nodes<f64>, Nodes<T>), Nodes<f64>)| {
        let mut sum = [0.0; 4];
        for ((w, a), b) in w.iter().zip(a).zip(b) {
            for k in 0..4 {
                sum[k] += w[k] * a[k].into() * b[k];
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
pub(in crate::solve) fn add_scaled<T: Copy + Into<f64> + Sync>(
    y: &mut [Nodal],
    a: f64,
    x: &[[T; 4]],
) {
    y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
        for (y, x) in y.iter_mut().zip(x) {
            for k in 0..4 {
                y[k] += a * x[k].into();
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
    x.par_chunks_mut(CHUNK).zip(free.par_chunks(CHUNK)).for_each(|(x, free)| {
        for (x, free) in x.iter_mut().zip(free) {
            for k in 0..4 {
                x[k] = if free[k] { x[k] } else { 0.0 };
            }
        }
    });
}

/// Returns the largest value of `of` over all nodes; `of` must not be negative.
pub(super) fn largest(x: &[Nodal], of: impl Fn(&Nodal) -> f64 + Sync) -> f64 {
    let part = |x: &[Nodal]| x.iter().map(&of).fold(0.0, f64::max);
    x.par_chunks(CHUNK).map(part).reduce(|| 0.0, f64::max)
}

/// Returns 1/|A_ii| for the free values, zero for all others. Diagonal entries have a lower limit, relative to the
/// largest of their field.
pub(super) fn weights(diagonal: &[Nodal], free: &[[bool; 4]], halo: &Halo) -> Vec<Nodal> {
    const LEAST: f64 = 1e-8;
    let mut most = [0, 1, 2, 3].map(|k| largest(diagonal, |d| d[k].abs()));
    halo.ranks().max(&mut most);
    let least = most.map(|m| if m > 0.0 { LEAST * m } else { 1.0 });
    let weight = |(d, free): (&Nodal, &[bool; 4])| {
        std::array::from_fn(|k| if free[k] { 1.0 / d[k].abs().max(least[k]) } else { 0.0 })
    };
    diagonal.par_iter().zip(free).with_min_len(CHUNK).map(weight).collect()
}
