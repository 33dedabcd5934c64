//! Scalars on a tape.

use std::cell::Cell;

use crate::number::partials::Partials;
use crate::number::scalar::{Scalar, each, impl_arithmetic};
use crate::number::tape::{Edge, Tape};

/// A scalar on a [`Tape`], or a constant without a node.
#[derive(Clone, Copy)]
pub struct Var<'t> {
    value: f64,
    node: Option<OnTape<'t>>,
}

impl<'t> Var<'t> {
    #[inline(always)]
    pub(super) fn new(value: f64, tape: &'t Tape, adjoint: &'t Cell<f64>) -> Self {
        Self { value, node: Some(OnTape { tape, adjoint }) }
    }
}

#[derive(Clone, Copy)]
struct OnTape<'t> {
    tape: &'t Tape,
    adjoint: &'t Cell<f64>,
}

impl OnTape<'_> {
    #[inline(always)]
    fn add(self, weight: f64) {
        self.adjoint.set(self.adjoint.get() + weight);
    }

    /// Index of the node, computed from the address of its adjoint; meaningless on a full tape.
    #[inline(always)]
    fn index(self) -> u32 {
        let address = |adjoint: *const Cell<f64>| adjoint as usize;
        let bytes = address(self.adjoint).wrapping_sub(address(self.tape.adjoints.as_ptr()));
        (bytes / size_of::<Cell<f64>>()) as u32
    }
}

/// Writes the edges of one operation with at most `most` arguments.
struct EdgeWriter<'t> {
    tape: Option<&'t Tape>,
    most: usize,
    child: u32,
    free: &'t [Cell<Edge>],
    start: usize,
    written: usize,
}

impl<'t> EdgeWriter<'t> {
    #[inline(always)]
    fn new<P: Partials<Var<'t>>>(_: &P) -> Self {
        Self { tape: None, most: P::MOST, child: 0, free: &[], start: 0, written: 0 }
    }

    #[inline(always)]
    fn add(&mut self, argument: Var<'t>, partial: f64) {
        let Some(node) = argument.node else { return };
        if self.tape.is_none() {
            self.begin(node.tape);
        }
        match self.free.get(self.written) {
            Some(edge) => edge.set(Edge { child: self.child, parent: node.index(), partial }),
            None => node.tape.full.set(true),
        }
        self.written += 1;
    }

    /// Reserves space for the edges of an operation. If the largest number of arguments is known, the space is
    /// checked only once.
    #[inline(always)]
    fn begin(&mut self, tape: &'t Tape) {
        self.tape = Some(tape);
        self.child = tape.length.get() as u32;
        self.start = tape.filled.get();
        self.free = match self.most {
            usize::MAX => tape.edges.get(self.start..),
            most => tape.edges.get(self.start..self.start + most),
        }
        .unwrap_or_default();
    }
}

impl std::fmt::Debug for Var<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let index = self.node.map(OnTape::index);
        f.debug_struct("Var").field("value", &self.value).field("index", &index).finish()
    }
}

impl From<f64> for Var<'_> {
    #[inline(always)]
    fn from(value: f64) -> Self {
        Self { value, node: None }
    }
}

impl_arithmetic!(['t] Var<'t>);

impl<'t> Scalar for Var<'t> {
    const DIFFERENTIABLE: bool = true;

    #[inline(always)]
    fn value(self) -> f64 {
        self.value
    }

    #[inline(always)]
    fn is_constant(self) -> bool {
        self.node.is_none()
    }

    #[inline(always)]
    fn deposit(self, adjoint: f64) {
        if let Some(node) = self.node {
            node.add(adjoint);
        }
    }

    #[inline(always)]
    fn replaced(self, value: f64, derivative: f64) -> Self {
        let Some(node) = self.node else { return Self::from(value) };
        let count = node.tape.replacements.get();
        if node.index() as usize >= node.tape.inputs.get() {
            return self.unary(value, derivative);
        }
        let Some(slot) = node.tape.replaced.get(count) else {
            node.tape.full.set(true);
            return node.tape.nowhere(value);
        };
        slot.set((node.index(), derivative, node.adjoint.replace(0.0)));
        node.tape.replacements.set(count + 1);
        Self { value, ..self }
    }

    #[inline(always)]
    fn fuse_all<const D: usize, const M: usize>(
        values: [f64; M],
        arguments: [Self; D],
        jacobian: [[f64; D]; M],
    ) -> [Self; M] {
        let (mut parents, mut tape) = ([0; D], None);
        for d in 0..D {
            let Some(node) = arguments[d].node else { return each(values, arguments, jacobian) };
            (parents[d], tape) = (node.index(), Some(node.tape));
        }
        match tape {
            Some(tape) => tape.push_all(values, parents, jacobian),
            None => values.map(Self::from),
        }
    }

    #[inline(always)]
    fn gather(value: f64, partials: impl Partials<Self>) -> Self {
        let mut writer = EdgeWriter::new(&partials);
        partials.spread(&mut |argument, partial| writer.add(argument, partial));
        match writer.tape {
            Some(tape) => {
                // if the iterator of arguments records another operation on the tape, that operation overwrites the
                // edges that are already written
                let is_whole = writer.most != usize::MAX || writer.child as usize == tape.mark();
                assert!(is_whole, "the arguments of an operation must be computed before it");
                tape.push(value, writer.start + writer.written)
            }
            None => Self::from(value),
        }
    }
}

crate::quantity::datum::impl_number_record! {
    ['t] Var<'t>: self => Scalar::value(*self);
}
