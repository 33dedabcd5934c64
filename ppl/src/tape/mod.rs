//! Reverse mode: an arena of operations, swept backwards once.
//!
//! An operation costs one node, an adjoint, and one edge to each of its arguments. A term of the
//! density costs none: its adjoint is known to be 1, and its partials go to their parents at once
//! ([`Settled`](crate::accumulator::Settled)). Nodes that nothing refers to any more, those of one
//! iteration of a plate, are swept early by `unwind`, so that the tape of a plate is as long as
//! one iteration.

mod var;

use std::cell::Cell;

use crate::scalar::Scalar;
pub use var::Var;

/// The operations of one evaluation, in order; cleared and used again for the next.
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
    /// One a node.
    adjoints: Box<[Cell<f64>]>,
    /// Those of a node stand together, in the order of the nodes.
    edges: Box<[Cell<Edge>]>,
    /// Inputs whose place another number has taken: which, its slope, and what the adjoint was.
    replaced: Box<[Cell<(u32, f64, f64)>]>,
    replacements: Cell<usize>,
    inputs: Cell<usize>,
    /// Number of nodes, and of edges, in use.
    length: Cell<usize>,
    filled: Cell<usize>,
    full: Cell<bool>,
    /// The adjoint of numbers for which there was no room.
    sink: Cell<f64>,
}

/// By how much a parent moves its child.
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
    /// Room for `nodes` operations of four arguments on average.
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

    /// Forgets all operations, keeping the memory; a tape that was full becomes twice as large.
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

    /// Whether operations are missing for want of room: clear the tape and evaluate again.
    pub fn is_full(&self) -> bool {
        self.full.get()
    }

    /// A new independent variable. Inputs come first: their order is that of the gradient.
    pub fn input(&self, value: f64) -> Var<'_> {
        self.push(value, self.filled.get())
    }

    /// `n` independent variables at once, at the start of a cleared tape: their adjoints, or none
    /// if there is no room. They are zero once [`first`](Tape::first) has made numbers of them.
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

    /// The number at a node that exists.
    #[inline(always)]
    pub(crate) fn number<'t>(&'t self, value: f64, adjoint: &'t Cell<f64>) -> Var<'t> {
        Var::new(value, self, adjoint)
    }

    /// The number at a node that nothing has used yet.
    #[inline(always)]
    pub(crate) fn first<'t>(&'t self, value: f64, adjoint: &'t Cell<f64>) -> Var<'t> {
        adjoint.set(0.0);
        self.number(value, adjoint)
    }

    /// A number that is none of constants and yet on no node.
    #[inline(always)]
    pub(crate) fn nowhere(&self, value: f64) -> Var<'_> {
        self.number(value, &self.sink)
    }

    /// The present length, for `unwind`.
    #[inline(always)]
    pub(crate) fn mark(&self) -> usize {
        self.length.get()
    }

    /// Adds `term` to the sum that [`sweep`](Tape::sweep) differentiates.
    #[inline(always)]
    pub fn seed(&self, term: Var<'_>) {
        term.deposit(1.0);
    }

    /// The gradient of the sum of all seeded terms with respect to the first inputs.
    ///
    /// # Panics
    /// If the tape [is full](Tape::is_full), or has less room than `gradient`.
    // inlined: for ten unknowns a call that copies ten numbers is half of what a sweep costs
    #[inline(always)]
    pub fn sweep(&self, gradient: &mut [f64]) {
        assert!(!self.is_full(), "operations are missing: clear the tape and evaluate again");
        self.unwind(gradient.len());
        let adjoints = &self.adjoints[..gradient.len()];
        for (g, adjoint) in gradient.iter_mut().zip(adjoints) {
            *g = adjoint.get();
        }
        for replaced in &self.replaced[..self.replacements.get()] {
            // from the adjoint: what was copied as a block can be read only once all of it is there
            let (index, slope, own) = replaced.get();
            gradient[index as usize] = own + slope * adjoints[index as usize].get();
        }
    }

    /// Sweeps back over the nodes past `mark` and forgets them.
    #[inline(always)]
    pub(crate) fn unwind(&self, mark: usize) {
        if self.length.get() > mark {
            self.sweep_back(mark);
        }
    }

    // inlined: a call in a plate would keep what it sums up out of registers
    #[inline(always)]
    fn sweep_back(&self, mark: usize) {
        self.length.set(mark);
        // what is missing cannot be swept: the evaluation will be repeated
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
            // what nothing depends on may have an infinite partial, and 0 · ∞ is no number
            if adjoint != 0.0 {
                let parent = &adjoints[parent as usize];
                parent.set(parent.get() + adjoint * partial);
            }
            edges = before;
        }
        self.filled.set(edges.len());
    }

    /// Nodes with these values, each a function of all parents: there is one question for room.
    #[inline(always)]
    fn push_all<const D: usize, const M: usize>(
        &self,
        values: [f64; M],
        parents: [u32; D],
        jacobian: [[f64; D]; M],
    ) -> [Var<'_>; M] {
        let mut numbers = values.map(|value| self.nowhere(value));
        let (length, filled) = (self.length.get(), self.filled.get());
        let adjoints = self.adjoints.get(length..length + M);
        let (Some(adjoints), Some(edges)) = (adjoints, self.edges.get(filled..filled + M * D))
        else {
            self.full.set(true);
            return numbers;
        };
        for m in 0..M {
            let child = (length + m) as u32;
            for d in 0..D {
                let (parent, partial) = (parents[d], jacobian[m][d]);
                edges[m * D + d].set(Edge { child, parent, partial });
            }
            adjoints[m].set(0.0);
            numbers[m] = self.number(values[m], &adjoints[m]);
        }
        self.length.set(length + M);
        self.filled.set(filled + M * D);
        numbers
    }

    /// A node whose edges are those up to `end`.
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
#[path = "../../tests/unit/tape.rs"]
mod tests;
