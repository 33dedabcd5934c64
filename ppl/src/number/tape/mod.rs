//! Reverse-mode differentiation with a tape of operations that is swept backwards once.
//!
//! Each operation adds a node with an adjoint to the tape, and one edge per argument. A term of the log density adds
//! no node: its adjoint is known to be 1, and its partial derivatives are added to the adjoints of its arguments
//! immediately ([`Settled`](crate::term::accumulator::Settled)). At the end of each iteration of a plate (a `for` loop of
//! the model), `unwind` sweeps the nodes of the iteration and removes them, so that the tape never contains more than
//! one iteration of a plate.

mod var;

use std::cell::Cell;

use crate::number::scalar::Scalar;
pub use var::Var;

/// Operations of one evaluation, in order. The tape is cleared and reused for the next evaluation.
///
/// # Example
/// ```
/// use ppl::{Scalar, tape::Tape};
///
/// let tape = Tape::default();
/// let x = tape.input(3.0);
/// let y = tape.input(0.5);
/// let f = x * y.exp() + 2.0;
/// tape.seed(f);
/// let mut gradient = [0.0; 2];
/// tape.sweep(&mut gradient);
/// assert_eq!(gradient, [0.5f64.exp(), 3.0 * 0.5f64.exp()]);
/// ```
#[derive(Debug)]
pub struct Tape {
    /// Adjoint of every node.
    adjoints: Box<[Cell<f64>]>,
    /// Edges to the arguments of each node, contiguous per node, in the order of the nodes.
    edges: Box<[Cell<Edge>]>,
    /// Inputs whose node was reused for a function of the input. Each entry contains the index of the input, the
    /// derivative of the function, and the adjoint of the input before the replacement.
    replaced: Box<[Cell<(u32, f64, f64)>]>,
    replacements: Cell<usize>,
    inputs: Cell<usize>,
    /// Number of nodes in use. The field `filled` is the number of edges in use.
    length: Cell<usize>,
    filled: Cell<usize>,
    full: Cell<bool>,
    /// Receives the adjoints of scalars for which the tape had no space; the value is not used.
    sink: Cell<f64>,
}

/// Partial derivative of a node (the child) with respect to one of its arguments (the parent).
#[derive(Clone, Copy, Debug, Default)]
struct Edge {
    child: u32,
    parent: u32,
    partial: f64,
}

impl Default for Tape {
    fn default() -> Self {
        Self::with_capacity(1 << 10)
    }
}

impl Tape {
    /// Creates a tape with space for `nodes` operations with four arguments on average.
    pub fn with_capacity(nodes: usize) -> Self {
        Self {
            adjoints: vec![Cell::default(); nodes].into(),
            edges: vec![Cell::default(); 4 * nodes].into(),
            replaced: vec![Cell::default(); nodes].into(),
            replacements: Cell::new(0),
            inputs: Cell::new(0),
            length: Cell::new(0),
            filled: Cell::new(0),
            full: Cell::new(false),
            sink: Cell::new(0.0),
        }
    }

    /// Removes all operations and keeps the memory. If the tape was full, its size is doubled.
    #[inline]
    pub fn clear(&mut self) {
        if self.full.get() {
            self.grow();
        }
        self.length.set(0);
        self.filled.set(0);
        self.replacements.set(0);
        self.inputs.set(0);
    }

    #[cold]
    fn grow(&mut self) {
        *self = Self::with_capacity(2 * self.adjoints.len().max(1));
    }

    /// Whether the tape was too short for all operations. If so, clear the tape and repeat the evaluation.
    pub fn is_full(&self) -> bool {
        self.full.get()
    }

    /// Adds an independent variable. Inputs must come first; their order is the order of the gradient.
    pub fn input(&self, value: f64) -> Var<'_> {
        self.push(value, self.filled.get())
    }

    /// Adds `n` independent variables at the start of a cleared tape. Returns the adjoints of the variables; an empty
    /// slice if the tape is too short. The adjoints are not set to zero: [`first`](Tape::first) does this for each
    /// variable.
    #[inline]
    pub(crate) fn inputs(&self, n: usize) -> &[Cell<f64>] {
        let Some(adjoints) = self.adjoints.get(..n) else {
            self.full.set(true);
            return &[];
        };
        self.length.set(n);
        self.inputs.set(n);
        adjoints
    }

    /// Creates a scalar for the existing node with the given adjoint.
    #[inline(always)]
    pub(crate) fn number<'t>(&'t self, value: f64, adjoint: &'t Cell<f64>) -> Var<'t> {
        Var::new(value, self, adjoint)
    }

    /// Creates a scalar for a node that has not been used yet, and sets the adjoint of the node to zero.
    #[inline(always)]
    pub(crate) fn first<'t>(&'t self, value: f64, adjoint: &'t Cell<f64>) -> Var<'t> {
        adjoint.set(0.0);
        self.number(value, adjoint)
    }

    /// Creates a scalar without a node, as a placeholder on a full tape. Its adjoint is added to `sink`.
    #[inline(always)]
    pub(crate) fn nowhere(&self, value: f64) -> Var<'_> {
        self.number(value, &self.sink)
    }

    /// Returns the current number of nodes, as an argument of `unwind`.
    #[inline(always)]
    pub(crate) fn mark(&self) -> usize {
        self.length.get()
    }

    /// Adds `term` to the sum that [`sweep`](Tape::sweep) differentiates.
    #[inline(always)]
    pub fn seed(&self, term: Var<'_>) {
        term.deposit(1.0);
    }

    /// Computes the gradient of the sum of all seeded terms with respect to the first `gradient.len()` inputs.
    ///
    /// # Panics
    /// If the tape [is full](Tape::is_full), or if it is shorter than `gradient`.
    // inlined, because for ten unknowns the function call would double the cost of a sweep
    #[inline(always)]
    pub fn sweep(&self, gradient: &mut [f64]) {
        assert!(!self.is_full(), "operations are missing: clear the tape and evaluate again");
        self.unwind(gradient.len());
        let adjoints = &self.adjoints[..gradient.len()];
        for (g, adjoint) in gradient.iter_mut().zip(adjoints) {
            *g = adjoint.get();
        }
        for replaced in &self.replaced[..self.replacements.get()] {
            // the loop above is compiled to a block copy into `gradient`; a read from `gradient` would wait until the
            // copy is complete, and a read from `adjoints` does not wait
            let (index, slope, adjoint) = replaced.get();
            gradient[index as usize] = adjoint + slope * adjoints[index as usize].get();
        }
    }

    /// Sweeps backwards over the nodes after `mark`, that is, adds their adjoints to the adjoints of their arguments,
    /// and removes these nodes.
    #[inline(always)]
    pub(crate) fn unwind(&self, mark: usize) {
        if self.length.get() > mark {
            self.sweep_back(mark);
        }
    }

    // inlined, because a function call in a loop of the model would move the sums of the loop out of the registers
    #[inline(always)]
    fn sweep_back(&self, mark: usize) {
        self.length.set(mark);
        // a full tape lacks operations, so it is not swept: the caller repeats the evaluation
        if self.full.get() {
            return;
        }
        let adjoints = &*self.adjoints;
        let mut edges = &self.edges[..self.filled.get()];
        while let Some((edge, before)) = edges.split_last() {
            let Edge { child, parent, partial } = edge.get();
            if (child as usize) < mark {
                break;
            }
            let adjoint = adjoints[child as usize].get();
            // skip nodes without effect: their partial derivatives can be infinite, and 0 · ∞ is NaN
            if adjoint != 0.0 {
                let parent = &adjoints[parent as usize];
                parent.set(parent.get() + adjoint * partial);
            }
            edges = before;
        }
        self.filled.set(edges.len());
    }

    /// Adds one node per value, each a function of all arguments `parents`. The remaining space is checked only once.
    #[inline(always)]
    fn push_all<const D: usize, const M: usize>(
        &self,
        values: [f64; M],
        parents: [u32; D],
        jacobian: [[f64; D]; M],
    ) -> [Var<'_>; M] {
        let mut results = values.map(|value| self.nowhere(value));
        let (length, filled) = (self.length.get(), self.filled.get());
        let adjoints = self.adjoints.get(length..length + M);
        let (Some(adjoints), Some(edges)) = (adjoints, self.edges.get(filled..filled + M * D))
        else {
            self.full.set(true);
            return results;
        };
        for m in 0..M {
            let child = (length + m) as u32;
            for d in 0..D {
                let (parent, partial) = (parents[d], jacobian[m][d]);
                edges[m * D + d].set(Edge { child, parent, partial });
            }
            adjoints[m].set(0.0);
            results[m] = self.number(values[m], &adjoints[m]);
        }
        self.length.set(length + M);
        self.filled.set(filled + M * D);
        results
    }

    /// Adds a node whose edges have already been written to `edges`. `end` is the number of edges in use, including
    /// the edges of the node.
    #[inline(always)]
    fn push(&self, value: f64, end: usize) -> Var<'_> {
        let index = self.length.get();
        let Some(adjoint) = self.adjoints.get(index) else {
            self.full.set(true);
            return self.nowhere(value);
        };
        adjoint.set(0.0);
        self.filled.set(end);
        self.length.set(index + 1);
        self.number(value, adjoint)
    }
}

#[cfg(test)]
#[path = "../../../tests/unit/tape.rs"]
mod tests;
