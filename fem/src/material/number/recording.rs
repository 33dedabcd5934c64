//! A number type that records the operations on it, so that the C source of a kernel is generated from the
//! code of the processor.
//!
//! The recorded code is the product with a tangent, and the equations of residual and tangent. Operations with the
//! constants zero and one are simplified, and repeated subexpressions are recorded once. Nothing else is changed, so
//! that the C code rounds as the processor's code does.

use std::cell::RefCell;
use std::collections::HashMap;
use std::fmt::Write;
use std::ops::{Add, AddAssign, Div, Mul, Neg, Sub};

use super::scalar::{Number, Round, Scalar};

/// Operation or operand of the recorded code.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
enum Node {
    /// Constant. The field contains the bits of its value.
    Constant(u64),
    /// Input of the kernel. The field is the index of the input.
    Given(u32),
    Add(Term, Term),
    Subtract(Term, Term),
    Multiply(Term, Term),
    Divide(Term, Term),
    Negate(Term),
    /// Fused multiply-add a b + c, with a single rounding.
    MultiplyAdd(Term, Term, Term),
    /// Calls of functions of the C library with one and with two arguments.
    Call(&'static str, Term),
    Call2(&'static str, Term, Term),
    /// Comparison with the given operator: 1 if the comparison is true, else 0.
    Compare(&'static str, Term, Term),
    /// The second term if the first term is not 0, else the third term.
    Select(Term, Term, Term),
    /// Entry of the final state of a loop: index of the loop, index of the entry.
    LoopResult(u32, u32),
}

/// Recorded loop: name of its C function, and initial state.
#[derive(Clone, Debug, PartialEq)]
struct Loop {
    name: &'static str,
    state: Vec<Term>,
}

/// Recorded number: the index of its node in the record of this thread. Node 0 is the constant zero.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub struct Term(u32);

const ZERO: Term = Term(0);

/// Recorded operations of one kernel.
#[derive(Debug)]
struct Record {
    /// Operations in the order of their execution.
    nodes: Vec<Node>,
    /// Term of each recorded node, by which repeated subexpressions are detected.
    term_of_node: HashMap<Node, Term>,
    loops: Vec<Loop>,
    /// C functions of the loops, by name.
    functions: Vec<(&'static str, String)>,
}

impl Record {
    fn new() -> Self {
        let zero = Node::Constant(0);
        let term_of_node = HashMap::from([(zero, ZERO)]);
        Self { nodes: vec![zero], term_of_node, loops: Vec::new(), functions: Vec::new() }
    }
}

thread_local! {
    // a `Term` is `Copy` and cannot hold a reference to the record
    static RECORD: RefCell<Record> = RefCell::new(Record::new());
}

/// Records a node and returns its term; the existing term if the same node has been recorded before.
#[inline(never)]
fn put(node: Node) -> Term {
    RECORD.with_borrow_mut(|record| {
        let next = Term(record.nodes.len() as u32);
        let term = *record.term_of_node.entry(node).or_insert(next);
        if term == next {
            record.nodes.push(node);
        }
        term
    })
}

impl Term {
    /// Records input number `index` of the kernel.
    pub fn given(index: usize) -> Self {
        put(Node::Given(index as u32))
    }

    #[inline(never)]
    fn fixed(x: f64) -> Self {
        // store −0.0 as 0.0
        put(Node::Constant(if x == 0.0 { 0 } else { x.to_bits() }))
    }

    fn is_one(self) -> bool {
        RECORD
            .with_borrow(|record| record.nodes[self.0 as usize] == Node::Constant(1.0f64.to_bits()))
    }
}

// Operators are not inlined: inlining would make the recorded kernels the largest functions of the crate to
// compile, and the speed of recording does not matter.

impl Add for Term {
    type Output = Self;

    #[inline(never)]
    fn add(self, other: Self) -> Self {
        match (self, other) {
            (ZERO, x) | (x, ZERO) => x,
            _ => put(Node::Add(self, other)),
        }
    }
}

impl Sub for Term {
    type Output = Self;

    #[inline(never)]
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

    #[inline(never)]
    fn mul(self, other: Self) -> Self {
        match (self, other) {
            (ZERO, _) | (_, ZERO) => ZERO,
            (one, x) | (x, one) if one.is_one() => x,
            _ => put(Node::Multiply(self, other)),
        }
    }
}

impl Div for Term {
    type Output = Self;

    #[inline(never)]
    fn div(self, other: Self) -> Self {
        match (self, other) {
            (ZERO, _) => ZERO,
            (x, one) if one.is_one() => x,
            _ => put(Node::Divide(self, other)),
        }
    }
}

impl Neg for Term {
    type Output = Self;

    #[inline(never)]
    fn neg(self) -> Self {
        if self == ZERO { ZERO } else { put(Node::Negate(self)) }
    }
}

macro_rules! with_constant {
    ($trait:ident, $name:ident) => {
        impl $trait<f64> for Term {
            type Output = Self;

            fn $name(self, x: f64) -> Self {
                $trait::$name(self, Self::fixed(x))
            }
        }
    };
}

with_constant!(Add, add);
with_constant!(Sub, sub);
with_constant!(Mul, mul);
with_constant!(Div, div);

impl AddAssign for Term {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl Number for Term {
    fn constant(self, x: f64) -> Self {
        Self::fixed(x)
    }

    #[inline(never)]
    fn mul_add(self, b: Self, c: Self) -> Self {
        match (self, b, c) {
            (ZERO, _, x) | (_, ZERO, x) => x,
            (a, b, ZERO) => a * b,
            (a, b, c) => put(Node::MultiplyAdd(a, b, c)),
        }
    }
}

impl Scalar for Term {
    /// Result of a comparison, recorded as a term with the value 1 or 0.
    type Mask = Self;

    const RECORDS: bool = true;

    fn record_loop(name: &'static str, most: usize, state: &mut [Self], round: Round<Self>) {
        let has_function =
            RECORD.with_borrow(|record| record.functions.iter().any(|f| f.0 == name));
        if !has_function {
            let function = function(name, most, state.len(), round);
            RECORD.with_borrow_mut(|record| record.functions.push((name, function)));
        }
        let index = RECORD.with_borrow_mut(|record| {
            let recorded = Loop { name, state: state.to_vec() };
            let same = record.loops.iter().position(|other| *other == recorded);
            same.unwrap_or_else(|| {
                record.loops.push(recorded);
                record.loops.len() - 1
            })
        });
        for (k, number) in state.iter_mut().enumerate() {
            *number = put(Node::LoopResult(index as u32, k as u32));
        }
    }

    fn sqrt(self) -> Self {
        put(Node::Call("sqrt", self))
    }

    fn abs(self) -> Self {
        put(Node::Call("fabs", self))
    }

    fn max(self, other: Self) -> Self {
        put(Node::Call2("fmax", self, other))
    }

    fn min(self, other: Self) -> Self {
        put(Node::Call2("fmin", self, other))
    }

    fn ln(self) -> Self {
        put(Node::Call("log", self))
    }

    fn ln_1p(self) -> Self {
        put(Node::Call("log1p", self))
    }

    fn exp(self) -> Self {
        put(Node::Call("exp", self))
    }

    fn exp_m1(self) -> Self {
        put(Node::Call("expm1", self))
    }

    fn less_than(self, other: Self) -> Self {
        put(Node::Compare("<", self, other))
    }

    fn equals(self, other: Self) -> Self {
        put(Node::Compare("==", self, other))
    }

    #[inline(never)]
    fn select(mask: Self, yes: Self, no: Self) -> Self {
        if yes == no { yes } else { put(Node::Select(mask, yes, no)) }
    }

    /// Returns false: the recorded code must be valid for all values, and so it cannot end an iteration early.
    fn settled(_: Self) -> bool {
        false
    }
}

/// Returns the C source of a loop as a function that updates the state `s` in place.
fn function(name: &str, most: usize, len: usize, round: Round<Term>) -> String {
    let outer = RECORD.replace(Record::new());
    let mut state: Vec<Term> = (0..len).map(Term::given).collect();
    let settled = round(&mut state);
    let (test, holds) = statements(&[settled], &|k| format!("s[{k}]"));
    let (lines, results) = statements(&state, &|k| format!("s[{k}]"));
    RECORD.replace(outer);
    let mut out = format!(
        "ITEM {name}(double *s) {{\n    for (int round = 0; round < {most}; round++) {{\n    {{\n{test}    \
         if ({} != 0.0) break;\n    }}\n{lines}",
        holds[0]
    );
    for (k, result) in results.iter().enumerate() {
        writeln!(out, "    s[{k}] = {result};").expect("writing to a string cannot fail");
    }
    out + "    }\n}\n"
}

/// Returns the C functions that the statements of the current record call.
pub fn functions() -> Vec<String> {
    RECORD.with_borrow(|record| record.functions.iter().map(|f| f.1.clone()).collect())
}

/// Returns the C statements that compute `results`, and the C expression of each result. `given` returns the C
/// expression of an input, by its index; the statements read an input just before its first use.
pub fn statements(results: &[Term], given: &dyn Fn(usize) -> String) -> (String, Vec<String>) {
    RECORD.with_borrow(|record| {
        let nodes = &record.nodes;
        let mut needed = vec![false; nodes.len()];
        results.iter().for_each(|term| needed[term.0 as usize] = true);
        for i in (0..nodes.len()).rev() {
            if needed[i] {
                operands(nodes[i]).iter().flatten().for_each(|term| needed[term.0 as usize] = true);
                if let Node::LoopResult(index, _) = nodes[i] {
                    let state = &record.loops[index as usize].state;
                    state.iter().for_each(|term| needed[term.0 as usize] = true);
                }
            }
        }
        let mut run = vec![false; record.loops.len()];
        let name = |term: Term| match nodes[term.0 as usize] {
            Node::Constant(bits) if f64::from_bits(bits) == f64::INFINITY => "(1.0 / 0.0)".into(),
            Node::Constant(bits) => format!("{:?}", f64::from_bits(bits)),
            _ => format!("t{}", term.0),
        };
        let out = RefCell::new(String::new());
        let mut read = vec![false; nodes.len()];
        let write = |text: String| {
            writeln!(out.borrow_mut(), "{text}").expect("writing to a string cannot fail")
        };
        let mut line = |i: usize, value: String| write(format!("    double t{i} = {value};"));
        let mut read_given = |term: Term, line: &mut dyn FnMut(usize, String)| {
            if let Node::Given(index) = nodes[term.0 as usize]
                && !std::mem::replace(&mut read[term.0 as usize], true)
            {
                line(term.0 as usize, given(index as usize));
            }
        };
        for i in (0..nodes.len()).filter(|&i| needed[i]) {
            operands(nodes[i]).iter().flatten().for_each(|&term| read_given(term, &mut line));
            match nodes[i] {
                Node::Constant(_) | Node::Given(_) => {}
                Node::LoopResult(index, k) => {
                    if !std::mem::replace(&mut run[index as usize], true) {
                        let Loop { name: called, state } = &record.loops[index as usize];
                        state.iter().for_each(|&term| read_given(term, &mut line));
                        let given: Vec<String> = state.iter().map(|&term| name(term)).collect();
                        let given = given.join(", ");
                        write(format!(
                            "    double l{index}[] = {{{given}}};\n    {called}(l{index});"
                        ));
                    }
                    line(i, format!("l{index}[{k}]"));
                }
                Node::Add(a, b) => line(i, format!("{} + {}", name(a), name(b))),
                Node::Subtract(a, b) => line(i, format!("{} - {}", name(a), name(b))),
                Node::Multiply(a, b) => line(i, format!("{} * {}", name(a), name(b))),
                Node::Divide(a, b) => line(i, format!("{} / {}", name(a), name(b))),
                Node::Negate(a) => line(i, format!("-{}", name(a))),
                Node::Call(f, a) => line(i, format!("{f}({})", name(a))),
                Node::Call2(f, a, b) => line(i, format!("{f}({}, {})", name(a), name(b))),
                Node::Compare(sign, a, b) => line(i, format!("{} {sign} {}", name(a), name(b))),
                Node::Select(mask, yes, no) => {
                    line(i, format!("{} != 0.0 ? {} : {}", name(mask), name(yes), name(no)));
                }
                Node::MultiplyAdd(a, b, c) => {
                    line(i, format!("fma({}, {}, {})", name(a), name(b), name(c)));
                }
            }
        }
        results.iter().for_each(|&term| read_given(term, &mut line));
        (out.into_inner(), results.iter().map(|&term| name(term)).collect())
    })
}

fn operands(node: Node) -> [Option<Term>; 3] {
    match node {
        Node::Constant(_) | Node::Given(_) | Node::LoopResult(..) => [None; 3],
        Node::Negate(a) | Node::Call(_, a) => [Some(a), None, None],
        Node::Add(a, b)
        | Node::Subtract(a, b)
        | Node::Multiply(a, b)
        | Node::Divide(a, b)
        | Node::Call2(_, a, b)
        | Node::Compare(_, a, b) => [Some(a), Some(b), None],
        Node::MultiplyAdd(a, b, c) | Node::Select(a, b, c) => [Some(a), Some(b), Some(c)],
    }
}

/// Starts a new, empty record on this thread.
pub fn begin() {
    RECORD.replace(Record::new());
}
