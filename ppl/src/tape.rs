//! Reverse mode: an arena of operations, swept backwards once.

use std::cell::RefCell;

use crate::scalar::{Scalar, impl_arithmetic};

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
#[derive(Debug, Default)]
pub struct Tape {
    nodes: RefCell<Nodes>,
}

/// Compressed rows: node `i` has parents `parents[ends[i-1]..ends[i]]`.
#[derive(Debug, Default)]
struct Nodes {
    ends: Vec<u32>,
    parents: Vec<u32>,
    partials: Vec<f64>,
    roots: Vec<u32>,
    adjoints: Vec<f64>,
}

impl Tape {
    /// Forgets all operations, keeping the memory.
    pub fn clear(&self) {
        let mut nodes = self.nodes.borrow_mut();
        nodes.ends.clear();
        nodes.parents.clear();
        nodes.partials.clear();
        nodes.roots.clear();
    }

    /// A new independent variable. Inputs come first: their order is that of the gradient.
    pub fn input(&self, value: f64) -> Var<'_> {
        self.push(value, std::iter::empty())
    }

    /// `n` independent variables at once, at the start of a cleared tape.
    pub(crate) fn inputs(&self, n: usize) {
        self.nodes.borrow_mut().ends.resize(n, 0);
    }

    /// The number at a node that exists.
    pub(crate) fn at(&self, index: u32, value: f64) -> Var<'_> {
        Var { value, node: Some((self, index)) }
    }

    /// Adds `term` to the sum that [`sweep`](Tape::sweep) differentiates.
    pub fn seed(&self, term: Var<'_>) {
        if let Some(index) = term.index() {
            self.nodes.borrow_mut().roots.push(index);
        }
    }

    /// The gradient of the sum of all seeded terms with respect to the first inputs.
    pub fn sweep(&self, gradient: &mut [f64]) {
        let nodes = &mut *self.nodes.borrow_mut();
        nodes.adjoints.clear();
        nodes.adjoints.resize(nodes.ends.len(), 0.0);
        for &root in &nodes.roots {
            nodes.adjoints[root as usize] += 1.0;
        }
        for i in (gradient.len()..nodes.ends.len()).rev() {
            let adjoint = nodes.adjoints[i];
            if adjoint == 0.0 {
                continue;
            }
            let start = if i == 0 { 0 } else { nodes.ends[i - 1] };
            let range = start as usize..nodes.ends[i] as usize;
            for (&parent, &partial) in
                nodes.parents[range.clone()].iter().zip(&nodes.partials[range])
            {
                nodes.adjoints[parent as usize] += adjoint * partial;
            }
        }
        gradient.copy_from_slice(&nodes.adjoints[..gradient.len()]);
    }

    fn push(&self, value: f64, arguments: impl Iterator<Item = (u32, f64)>) -> Var<'_> {
        let nodes = &mut *self.nodes.borrow_mut();
        for (parent, partial) in arguments {
            nodes.parents.push(parent);
            nodes.partials.push(partial);
        }
        let index = nodes.ends.len() as u32;
        nodes.ends.push(nodes.parents.len() as u32);
        Var { value, node: Some((self, index)) }
    }
}

/// A number on a [`Tape`], or a constant that is on none.
#[derive(Clone, Copy)]
pub struct Var<'t> {
    value: f64,
    node: Option<(&'t Tape, u32)>,
}

impl Var<'_> {
    fn index(self) -> Option<u32> {
        self.node.map(|(_, index)| index)
    }
}

impl std::fmt::Debug for Var<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Var").field("value", &self.value).field("index", &self.index()).finish()
    }
}

impl From<f64> for Var<'_> {
    #[inline]
    fn from(value: f64) -> Self {
        Self { value, node: None }
    }
}

impl_arithmetic!(['t] Var<'t>);

impl<'t> Scalar for Var<'t> {
    const DIFFERENTIABLE: bool = true;

    #[inline]
    fn value(self) -> f64 {
        self.value
    }

    #[inline]
    fn is_constant(self) -> bool {
        self.node.is_none()
    }

    #[inline]
    fn fuse_iter(value: f64, arguments: impl IntoIterator<Item = (Self, f64)>) -> Self {
        let mut arguments = arguments
            .into_iter()
            .filter_map(|(argument, partial)| argument.node.map(|node| (node, partial)));
        let Some(((tape, first), partial)) = arguments.next() else {
            return Self::from(value);
        };
        let rest = arguments.map(|((_, index), partial)| (index, partial));
        tape.push(value, std::iter::once((first, partial)).chain(rest))
    }

    // the two commonest shapes without the iterator's bookkeeping
    #[inline]
    fn unary(self, value: f64, derivative: f64) -> Self {
        match self.node {
            Some((tape, index)) => tape.push(value, std::iter::once((index, derivative))),
            None => Self::from(value),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::dual::Dual;

    fn expression<S: Scalar>([x, y, z]: [S; 3]) -> S {
        let mut total = S::from(0.0);
        for k in 1..4 {
            total += (x * f64::from(k) - y).square() / (z.exp() + 1.0);
        }
        total.ln() + x.pow(z) - (y * z).tanh()
    }

    #[test]
    fn tape_equals_dual() {
        let point = [0.8, 1.7, -0.4];
        let tape = Tape::default();
        let mut gradient = [0.0; 3];
        for _ in 0..2 {
            tape.clear();
            let f = expression(point.map(|x| tape.input(x)));
            tape.seed(f);
            tape.sweep(&mut gradient);
            let dual = expression(Dual::variables(point));
            assert_eq!(f.value(), dual.value());
            for (t, d) in gradient.iter().zip(dual.gradient()) {
                approx::assert_relative_eq!(*t, d, max_relative = 1e-13);
            }
        }
    }

    #[test]
    fn constants_take_no_node() {
        let tape = Tape::default();
        let x = tape.input(2.0);
        let c = Var::from(3.0) * 2.0 + Var::from(1.0);
        assert!(c.is_constant());
        tape.seed(c);
        tape.seed(x * c);
        let mut gradient = [0.0];
        tape.sweep(&mut gradient);
        assert_eq!(gradient, [7.0]);
    }
}
