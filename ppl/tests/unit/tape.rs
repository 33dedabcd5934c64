//! The tape, compared with dual numbers, also if the tape is too short.

use super::*;
use crate::number::dual::Dual;
use crate::term::accumulator::{Accumulator, Settled};

fn expression<S: Scalar>([x, y, z]: [S; 3]) -> S {
    let mut total = S::from(0.0);
    for k in 1..4 {
        total += (x * f64::from(k) - y).square() / (z.exp() + 1.0);
    }
    total.ln() + x.pow(z) - (y * z).tanh()
}

fn gradient(tape: &mut Tape, point: [f64; 3]) -> Option<(f64, [f64; 3])> {
    tape.clear();
    let f = expression(point.map(|x| tape.input(x)));
    tape.seed(f);
    let mut gradient = [0.0; 3];
    if tape.is_full() {
        return None;
    }
    tape.sweep(&mut gradient);
    Some((f.value(), gradient))
}

#[test]
fn tape_equals_dual() {
    let point = [0.8, 1.7, -0.4];
    let mut tape = Tape::default();
    for _ in 0..2 {
        let (value, gradient) = gradient(&mut tape, point).expect("room");
        let dual = expression(Dual::variables(point));
        assert_eq!(value, dual.value());
        for (t, d) in gradient.iter().zip(dual.gradient()) {
            approx::assert_relative_eq!(*t, d, max_relative = 1e-13);
        }
    }
}

#[test]
fn a_full_tape_says_so_and_grows() {
    let point = [0.8, 1.7, -0.4];
    let mut tape = Tape::with_capacity(4);
    let grown = (0..10).find_map(|_| gradient(&mut tape, point)).expect("grows");
    assert_eq!(grown, gradient(&mut Tape::default(), point).expect("room"));
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

/// A node √x at 0, whose derivative is infinite and on which no result depends, lies between nodes on which the result
/// depends.
#[test]
fn what_nothing_depends_on_is_passed_over() {
    let tape = Tape::default();
    let x = tape.input(0.0);
    let y = x + 2.0;
    assert!(x.sqrt().recip().value().is_infinite());
    tape.seed(y.square());
    let mut gradient = [0.0];
    tape.sweep(&mut gradient);
    assert_eq!(gradient, [4.0]);
}

/// Evaluates a plate within a plate on short tapes of every size, for edges and for nodes.
#[test]
fn a_tape_that_fills_up_in_a_plate_says_so() {
    let run = |tape: &Tape| {
        let (x, y) = (tape.input(0.7), tape.input(-0.2));
        for outer in 0..3 {
            let mark = tape.mark();
            let z = (x * y + f64::from(outer)).square();
            for inner in 0..3 {
                let mark = tape.mark();
                tape.seed((z - x).exp() * f64::from(inner));
                tape.unwind(mark);
            }
            tape.unwind(mark);
        }
        let mut gradient = [0.0; 2];
        (!tape.is_full()).then(|| {
            tape.sweep(&mut gradient);
            gradient
        })
    };
    let expected = run(&Tape::default()).expect("room");
    let mut refused = 0;
    for nodes in 0..12 {
        match run(&Tape::with_capacity(nodes)) {
            Some(gradient) => assert_eq!(gradient, expected),
            None => refused += 1,
        }
    }
    assert!((1..12).contains(&refused), "{refused}");
}

/// Computes Σₖ ln p(xₖ | x y) in two ways: with one node per iteration, which is swept at the end of the iteration, and
/// with terms without nodes.
#[test]
fn terms_and_unwinding_leave_the_gradient_as_it_is() {
    let data = [0.3, -1.0, 2.5];
    let run = |fast: bool| {
        let tape = Tape::default();
        let (x, y) = (tape.input(0.7), tape.input(-0.2));
        for datum in data {
            let mark = tape.mark();
            let z = datum - x * y;
            let (value, partials) = (-0.5 * z.value() * z.value(), ((z, -z.value()),));
            if fast {
                Accumulator::<Var>::add(&mut Settled::new(), value, partials);
                tape.unwind(mark);
            } else {
                tape.seed(Scalar::gather(value, partials));
            }
        }
        assert_eq!(tape.mark() == 2, fast);
        let mut gradient = [0.0; 2];
        tape.sweep(&mut gradient);
        gradient
    };
    let slope: f64 = data.iter().map(|d| d + 0.14).sum();
    for fast in [false, true] {
        let [a, b] = run(fast);
        approx::assert_relative_eq!(a, -0.2 * slope, max_relative = 1e-14);
        approx::assert_relative_eq!(b, 0.7 * slope, max_relative = 1e-14);
    }
}
