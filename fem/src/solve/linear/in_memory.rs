//! Vectors in the memory of this process, which may be one of several ranks. Sums are the same for any number of
//! threads.

use std::marker::PhantomData;
use std::ops::Range;
use std::sync::Arc;

use bytemuck::Pod;
use nalgebra::{RealField, convert};
use rayon::prelude::*;

use super::vectors::{KrylovVectors, LanczosVectors, Precision, Vectors};
use crate::parallel::Halo;

/// Floating-point type of vector entries: `f32` or `f64`.
pub(crate) trait Real: RealField + Pod + Into<f64> {}

impl Real for f32 {}
impl Real for f64 {}

/// Operations on vectors with `R` values per local node.
#[derive(Clone, Debug, Default)]
pub(crate) struct InMemory<T, const R: usize> {
    halo: Arc<Halo>,
    number: PhantomData<T>,
}

/// Operations on vectors of the values u_x, u_y, u_z, φ at each node.
pub(crate) type NodalVectors = InMemory<f64, 4>;

impl<T, const R: usize> InMemory<T, R> {
    pub(crate) fn new(halo: &Arc<Halo>) -> Self {
        Self { halo: Arc::clone(halo), number: PhantomData }
    }

    /// Returns the sum over the nodes of all ranks. `part` returns the sum over a range of local nodes; each rank
    /// contributes the nodes that it owns.
    fn sum(&self, nodes: usize, part: impl Fn(Range<usize>) -> f64) -> f64 {
        if self.halo.ranks().is_alone() {
            return part(0..nodes);
        }
        let mut sum = [self.halo.owned_ranges(nodes).into_iter().map(part).sum()];
        self.halo.ranks().sum(&mut sum);
        sum[0]
    }
}

impl<T: Real, const R: usize> Vectors for InMemory<T, R> {
    type Vector = [[T; R]];
    type Owned = Vec<[T; R]>;

    fn zero(&self, like: &[[T; R]]) -> Vec<[T; R]> {
        vec![[T::zero(); R]; like.len()]
    }

    fn clear(&self, x: &mut [[T; R]]) {
        x.par_chunks_mut(CHUNK).for_each(|x| x.fill([T::zero(); R]));
    }

    fn copy(&self, x: &[[T; R]], y: &mut [[T; R]]) {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| y.copy_from_slice(x));
    }
}

impl<T: Real, const R: usize> LanczosVectors for InMemory<T, R> {
    fn fill(&self, x: &mut [[T; R]], value: impl Fn(usize) -> f64 + Sync) {
        x.par_iter_mut().with_min_len(CHUNK).enumerate().for_each(|(node, x)| {
            *x = std::array::from_fn(|k| convert(value(node * R + k)));
        });
        self.halo.forward(x);
    }

    fn scale(&self, x: &mut [[T; R]], a: f64) {
        let a: T = convert(a);
        x.par_iter_mut().with_min_len(CHUNK).for_each(|x| *x = x.map(|x| a * x));
    }

    fn dot(&self, a: &[[T; R]], b: &[[T; R]]) -> f64 {
        self.sum(a.len(), |nodes| dot(&a[nodes.clone()], &b[nodes]))
    }

    fn recur(&self, y: &mut [[T; R]], w: &[[T; R]], a: f64, d: &[[T; R]], b: f64) {
        let (a, b): (T, T) = (convert(a), convert(b));
        y.par_iter_mut().with_min_len(CHUNK).zip(w).zip(d).for_each(|((y, w), d)| {
            (0..R).for_each(|k| y[k] = -w[k] - a * d[k] - b * y[k]);
        });
    }
}

/// Vector that is stored in double or in single precision.
#[derive(Debug)]
pub(crate) enum Stored {
    Double(Vec<Nodal>),
    Single(Vec<[f32; 4]>),
}

impl KrylovVectors for NodalVectors {
    type Stored = Stored;

    fn weighted_dot(&self, w: &[Nodal], a: &[Nodal], b: &[Nodal]) -> f64 {
        self.sum(a.len(), |nodes| weighted_dot(&w[nodes.clone()], &a[nodes.clone()], &b[nodes]))
    }

    fn add_scaled(&self, y: &mut [Nodal], a: f64, x: &[Nodal]) {
        add_scaled(y, a, x);
    }

    fn scale_and_add(&self, y: &mut [Nodal], a: f64, x: &[Nodal]) {
        y.par_chunks_mut(CHUNK).zip(x.par_chunks(CHUNK)).for_each(|(y, x)| {
            for (y, x) in y.iter_mut().zip(x) {
                for k in 0..4 {
                    y[k] = x[k] + a * y[k];
                }
            }
        });
    }

    fn store(&self, x: &[Nodal], precision: Precision) -> Stored {
        match precision {
            Precision::Single => Stored::Single(by_node(x, |x| x.map(|v| v as f32))),
            Precision::Double => Stored::Double(by_node(x, |x| *x)),
        }
    }

    fn weighted_dot_stored(&self, w: &[Nodal], a: &Stored, b: &[Nodal]) -> f64 {
        match a {
            Stored::Double(a) => self.weighted_dot(w, a, b),
            Stored::Single(a) => self.sum(b.len(), |nodes| {
                weighted_dot(&w[nodes.clone()], &a[nodes.clone()], &b[nodes])
            }),
        }
    }

    fn add_stored(&self, y: &mut [Nodal], a: f64, x: &Stored) {
        match x {
            Stored::Double(x) => add_scaled(y, a, x),
            Stored::Single(x) => add_scaled(y, a, x),
        }
    }
}

/// Values u_x, u_y, u_z, φ of a node.
pub(crate) type Nodal = [f64; 4];

/// Number of nodes per parallel task. The partial sums of the tasks are added in the order of the nodes.
pub(in crate::solve) const CHUNK: usize = 4096;

/// Applies `of_node` to every node in parallel.
pub(crate) fn by_node<A: Sync, B: Send>(
    x: &[A],
    of_node: impl Fn(&A) -> B + Sync + Send,
) -> Vec<B> {
    x.par_iter().with_min_len(CHUNK).map(of_node).collect()
}

/// Returns Σ w a b, the inner product with a diagonal weight.
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
    let chunk_sums: Vec<f64> =
        w.par_chunks(CHUNK).zip(a.par_chunks(CHUNK)).zip(b.par_chunks(CHUNK)).map(part).collect();
    chunk_sums.iter().sum()
}

/// Returns the inner product Σ a b, computed in double precision.
fn dot<T: Real, const R: usize>(a: &[[T; R]], b: &[[T; R]]) -> f64 {
    let part = |(a, b): (&[[T; R]], &[[T; R]])| {
        let mut sum = [0.0; R];
        for (a, b) in a.iter().zip(b) {
            for k in 0..R {
                sum[k] += a[k].into() * b[k].into();
            }
        }
        sum.iter().sum::<f64>()
    };
    let chunk_sums: Vec<f64> = a.par_chunks(CHUNK).zip(b.par_chunks(CHUNK)).map(part).collect();
    chunk_sums.iter().sum()
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

/// Sets the values of x that are not `free` to zero.
pub(in crate::solve) fn mask(free: &[[bool; 4]], x: &mut [Nodal]) {
    x.par_chunks_mut(CHUNK).zip(free.par_chunks(CHUNK)).for_each(|(x, free)| {
        for (x, free) in x.iter_mut().zip(free) {
            for k in 0..4 {
                x[k] = if free[k] { x[k] } else { 0.0 };
            }
        }
    });
}

/// Returns the largest value that `of_node` returns for a local node. `of_node` must not return negative values.
pub(crate) fn largest(x: &[Nodal], of_node: impl Fn(&Nodal) -> f64 + Sync) -> f64 {
    let part = |x: &[Nodal]| x.iter().map(&of_node).fold(0.0, f64::max);
    x.par_chunks(CHUNK).map(part).reduce(|| 0.0, f64::max)
}

/// Returns the weight 1/|A_ii| for each free value and zero for all other values, from the diagonal entries A_ii of the
/// tangent. |A_ii| is raised to at least 1e-8 times the largest diagonal entry of the same component.
pub(crate) fn weights(diagonal: &[Nodal], free: &[[bool; 4]], halo: &Halo) -> Vec<Nodal> {
    const LEAST: f64 = 1e-8;
    let mut most = [0, 1, 2, 3].map(|k| largest(diagonal, |d| d[k].abs()));
    halo.ranks().max(&mut most);
    let least = most.map(|m| if m > 0.0 { LEAST * m } else { 1.0 });
    let weight = |(d, free): (&Nodal, &[bool; 4])| {
        std::array::from_fn(|k| if free[k] { 1.0 / d[k].abs().max(least[k]) } else { 0.0 })
    };
    diagonal.par_iter().zip(free).with_min_len(CHUNK).map(weight).collect()
}
