//! A number that writes down what is done with it, so that a kernel tells its own source.
//!
//! Zeros and ones that are known are left out, and what was computed before is not computed again; nothing else is
//! changed, so that the source rounds as the kernel does.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::{Add, AddAssign, Mul, Neg, Sub};

use faer::traits::pulp::Simd;

use super::lanes::{Pack, Precision};
use crate::material::Number;

/// What a number is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Node {
    /// By its bits.
    Constant(u64),
    /// What the kernel is given, by its place.
    Given(u32),
    Add(Term, Term),
    Subtract(Term, Term),
    Multiply(Term, Term),
    Negate(Term),
    /// a b + c with one rounding.
    MultiplyAdd(Term, Term, Term),
}

/// A number by its place in the record; the first is zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub(crate) struct Term(u32);

const ZERO: Term = Term(0);

#[derive(Debug)]
struct Record {
    nodes: Vec<Node>,
    known: HashMap<Node, Term>,
}

impl Record {
    fn new() -> Self {
        let zero = Node::Constant(0);
        Self { nodes: vec![zero], known: HashMap::from([(zero, ZERO)]) }
    }
}

thread_local! {
    // numbers are copied like numbers, and cannot carry the record along
    static RECORD: RefCell<Record> = RefCell::new(Record::new());
}

fn put(node: Node) -> Term {
    RECORD.with_borrow_mut(|record| {
        let next = Term(record.nodes.len() as u32);
        let term = *record.known.entry(node).or_insert(next);
        if term == next {
            record.nodes.push(node);
        }
        term
    })
}

impl Term {
    /// Number `place` of what the kernel is given.
    pub(super) fn given(place: usize) -> Self {
        put(Node::Given(place as u32))
    }

    fn fixed(x: f64) -> Self {
        // −0 is zero
        put(Node::Constant(if x == 0.0 { 0 } else { x.to_bits() }))
    }

    fn is_one(self) -> bool {
        RECORD
            .with_borrow(|record| record.nodes[self.0 as usize] == Node::Constant(1.0f64.to_bits()))
    }
}

impl Add for Term {
    type Output = Self;

    fn add(self, other: Self) -> Self {
        match (self, other) {
            (ZERO, x) | (x, ZERO) => x,
            _ => put(Node::Add(self, other)),
        }
    }
}

impl Sub for Term {
    type Output = Self;

    fn sub(self, other: Self) -> Self {
        match (self, other) {
            (x, ZERO) => x,
            (ZERO, x) => -x,
            _ => put(Node::Subtract(self, other)),
        }
    }
}

impl Mul for Term {
    type Output = Self;

    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (ZERO, _) | (_, ZERO) => ZERO,
            (one, x) | (x, one) if one.is_one() => x,
            _ => put(Node::Multiply(self, other)),
        }
    }
}

impl Neg for Term {
    type Output = Self;

    fn neg(self) -> Self {
        if self == ZERO { ZERO } else { put(Node::Negate(self)) }
    }
}

impl AddAssign for Term {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Number for Term {
    fn constant(self, x: f64) -> Self {
        Self::fixed(x)
    }

    fn mul_add(self, b: Self, c: Self) -> Self {
        match (self, b, c) {
            (ZERO, _, x) | (_, ZERO, x) => x,
            (a, b, ZERO) => a * b,
            (a, b, c) => put(Node::MultiplyAdd(a, b, c)),
        }
    }
}

/// One element at a time, so that a register and a pack are a number.
impl Precision for Term {
    type Pack = Pack<Self, 1>;
    type Register<S: Simd> = Self;

    fn splat<S: Simd>(_: S, x: f64) -> Self {
        Self::fixed(x)
    }

    fn load<S: Simd>(_: S, pack: &Self::Pack, _: usize) -> Self {
        pack.as_ref()[0]
    }
}

/// The statements of C that compute `results`, and the expression of each. `given` is the expression
/// of what the kernel is given at a place; it is read where it is used first.
pub(super) fn statements(
    results: &[Term],
    given: impl Fn(usize) -> String,
) -> (String, Vec<String>) {
    RECORD.with_borrow(|record| {
        let nodes = &record.nodes;
        let mut needed = vec![false; nodes.len()];
        results.iter().for_each(|term| needed[term.0 as usize] = true);
        for i in (0..nodes.len()).rev() {
            if needed[i] {
                parts(nodes[i]).iter().flatten().for_each(|term| needed[term.0 as usize] = true);
            }
        }
        let name = |term: Term| match nodes[term.0 as usize] {
            Node::Constant(bits) => format!("{:?}", f64::from_bits(bits)),
            _ => format!("t{}", term.0),
        };
        let mut out = String::new();
        let mut read = vec![false; nodes.len()];
        let mut line = |i: usize, value: String| {
            writeln!(out, "    double t{i} = {value};").expect("a string takes all");
        };
        let mut read_given = |term: Term, line: &mut dyn FnMut(usize, String)| {
            if let Node::Given(place) = nodes[term.0 as usize]
                && !std::mem::replace(&mut read[term.0 as usize], true)
            {
                line(term.0 as usize, given(place as usize));
            }
        };
        for i in (0..nodes.len()).filter(|&i| needed[i]) {
            parts(nodes[i]).iter().flatten().for_each(|&term| read_given(term, &mut line));
            match nodes[i] {
                Node::Constant(_) | Node::Given(_) => {}
                Node::Add(a, b) => line(i, format!("{} + {}", name(a), name(b))),
                Node::Subtract(a, b) => line(i, format!("{} - {}", name(a), name(b))),
                Node::Multiply(a, b) => line(i, format!("{} * {}", name(a), name(b))),
                Node::Negate(a) => line(i, format!("-{}", name(a))),
                Node::MultiplyAdd(a, b, c) => {
                    line(i, format!("fma({}, {}, {})", name(a), name(b), name(c)));
                }
            }
        }
        results.iter().for_each(|&term| read_given(term, &mut line));
        (out, results.iter().map(|&term| name(term)).collect())
    })
}

fn parts(node: Node) -> [Option<Term>; 3] {
    match node {
        Node::Constant(_) | Node::Given(_) => [None; 3],
        Node::Negate(a) => [Some(a), None, None],
        Node::Add(a, b) | Node::Subtract(a, b) | Node::Multiply(a, b) => [Some(a), Some(b), None],
        Node::MultiplyAdd(a, b, c) => [Some(a), Some(b), Some(c)],
    }
}

/// Begins a new record on this thread.
pub(super) fn begin() {
    RECORD.replace(Record::new());
}
