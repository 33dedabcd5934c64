//! Values, gradients, the check of the box, and the file of an expansion.

use std::ops::{Add, Mul};

use approx::assert_relative_eq;
use ppl::{Differentiable, Dual, DynDifferentiable, Scalar};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;
use surrogate::{BoxPosition, DynPce, Input, Pce, SurrogateError};

#[derive(Clone, Copy)]
struct Complex(f64, f64);

impl Add for Complex {
    type Output = Self;
    fn add(self, o: Self) -> Self {
        Self(self.0 + o.0, self.1 + o.1)
    }
}

impl Mul for Complex {
    type Output = Self;
    fn mul(self, o: Self) -> Self {
        Self(self.0 * o.0 - self.1 * o.1, self.0 * o.1 + self.1 * o.0)
    }
}

fn legendre(k: u8, t: Complex) -> Complex {
    let (mut before, mut now) = (Complex(0.0, 0.0), Complex(1.0, 0.0));
    for i in 0..k {
        let i = f64::from(i);
        let next = Complex((2.0 * i + 1.0) / (i + 1.0), 0.0) * t * now
            + Complex(-i / (i + 1.0), 0.0) * before;
        (before, now) = (now, next);
    }
    now
}

/// Evaluates the expansion term by term, with an imaginary step of 1e-100 in input `d`.
fn complex_step<const D: usize, const M: usize>(
    pce: &Pce<D, M>,
    x: &[f64; D],
    d: usize,
) -> [Complex; M] {
    let mut sum = [Complex(0.0, 0.0); M];
    for (index, c) in pce.terms() {
        let mut term = Complex(1.0, 0.0);
        for e in 0..D {
            let Input { lower, upper, .. } = pce.inputs()[e];
            let scale = 2.0 / (upper - lower);
            let step = if d == e { 1e-100 * scale } else { 0.0 };
            let t = Complex((x[e] - lower) * scale - 1.0, step);
            term = term
                * legendre(index[e], t)
                * Complex((f64::from(index[e]) * 2.0 + 1.0).sqrt(), 0.0);
        }
        for m in 0..M {
            sum[m] = sum[m] + term * Complex(c[m], 0.0);
        }
    }
    sum
}

fn inputs<const D: usize>() -> [Input; D] {
    std::array::from_fn(|d| Input::new(format!("x{d}"), -1.0 - d as f64, 2.0).unwrap())
}

/// Returns an expansion with random coefficients on random multi-indices, which are sparse.
fn random<const D: usize, const M: usize>(degree: u8, terms: usize, seed: u64) -> Pce<D, M> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(seed);
    let mut list = std::collections::BTreeMap::new();
    for _ in 0..terms {
        let index: [u8; D] = std::array::from_fn(|_| rng.random_range(0..=degree));
        let c: [f64; M] = std::array::from_fn(|_| rng.random_range(-1.0..1.0));
        list.insert(index, c);
    }
    Pce::from_terms(inputs(), std::array::from_fn(|m| format!("f{m}")), list).unwrap()
}

fn check<const D: usize, const M: usize>(pce: &Pce<D, M>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    for i in 0..50 {
        // includes corners, where formulas that divide by 1 − t² fail
        let x: [f64; D] = std::array::from_fn(|d| match i {
            0 => pce.inputs()[d].lower,
            1 => pce.inputs()[d].upper,
            _ => rng.random_range(pce.inputs()[d].lower..pce.inputs()[d].upper),
        });
        let (value, jacobian) = pce.value_and_jacobian(&x).unwrap();
        let alone = pce.value(&x).unwrap();
        // the same expansion with sizes known at run time, evaluated directly and in a model
        let run_time: &DynPce = pce;
        let (by_run_time, slopes) = run_time.value_and_jacobian(&x).unwrap();
        let value_by_run_time = run_time.value(&x).unwrap();
        let in_model = run_time.at(&Dual::<D>::variables(x));
        for m in 0..M {
            assert_relative_eq!(by_run_time[m], value[m], epsilon = 1e-11, max_relative = 1e-13);
            assert_relative_eq!(
                value_by_run_time[m],
                value[m],
                epsilon = 1e-11,
                max_relative = 1e-13
            );
            assert_eq!(in_model[m].value(), by_run_time[m]);
            assert_eq!(in_model[m].gradient().as_slice(), slopes[m]);
            for (slope, expected) in slopes[m].iter().zip(jacobian[m]) {
                assert_relative_eq!(*slope, expected, epsilon = 1e-9, max_relative = 1e-11);
            }
        }
        for d in 0..D {
            let expected = complex_step(pce, &x, d);
            for m in 0..M {
                // sums of terms cancel, so that the tolerance is relative to the largest terms
                assert_relative_eq!(value[m], expected[m].0, epsilon = 1e-11, max_relative = 1e-12);
                assert_relative_eq!(alone[m], value[m], epsilon = 1e-11, max_relative = 1e-13);
                let slope = expected[m].1 / 1e-100;
                assert_relative_eq!(jacobian[m][d], slope, epsilon = 1e-9, max_relative = 1e-11);
            }
        }
    }
}

#[test]
fn values_and_gradients_agree_with_the_complex_step() {
    check(&random::<3, 3>(3, 40, 1));
    check(&random::<1, 1>(8, 9, 2));
    check(&random::<2, 4>(16, 60, 3));
    check(&random::<5, 2>(4, 80, 4));
    check(&random::<3, 1>(0, 1, 5));
}

/// Checks d/du of f(x(u)) through the trait that models use, for nonlinear x(u).
#[test]
fn a_model_sees_the_chain_rule() {
    let pce = random::<3, 2>(4, 30, 6);
    let u = ppl::Dual::variables([0.4, -0.3]);
    let y = pce.at([u[0] * u[1], u[0].exp(), u[1]]);
    let x = [0.4 * -0.3, 0.4f64.exp(), -0.3];
    let (value, jacobian) = pce.value_and_jacobian(&x).unwrap();
    for m in 0..2 {
        assert_eq!(y[m].value(), value[m]);
        let [a, b, c] = jacobian[m];
        let expected = [a * -0.3 + b * x[1], a * 0.4 + c];
        for (found, expected) in y[m].gradient().into_iter().zip(expected) {
            assert_relative_eq!(found, expected, max_relative = 1e-13);
        }
    }
    assert!(pce.at([9.0, 0.0, 0.0]).iter().all(|f| f.is_nan()));
    let error = pce.try_at([9.0, 0.0, 0.0]).unwrap_err().to_string();
    assert!(error.contains("`x0` = 9 lies outside the training box"), "{error}");
}

#[test]
fn outside_the_box_a_value_is_flagged_and_then_refused() {
    let pce = random::<2, 1>(3, 10, 7);
    let width = 3.0;
    assert_eq!(pce.position(&[2.0, -2.0]).unwrap(), BoxPosition::Inside);
    let near = [2.0 + 0.009 * width, 0.0];
    assert_eq!(pce.position(&near).unwrap(), BoxPosition::Near);
    assert_relative_eq!(
        pce.value(&near).unwrap()[0],
        complex_step(&pce, &near, 0)[0].0,
        epsilon = 1e-11
    );
    let far = [2.0 + 0.011 * width, 0.0];
    for result in [
        pce.value(&far).err(),
        pce.value_and_jacobian(&far).err(),
        pce.value(&[f64::NAN, 0.0]).err(),
    ] {
        assert!(matches!(result, Some(SurrogateError::OutsideBox { .. })));
    }
    let message = pce.value(&far).unwrap_err().to_string();
    assert!(message.contains("`x0` = 2.03") && message.contains("[-1, 2]"), "{message}");
    let strict = pce.clone().with_tolerance(0.0).unwrap();
    assert!(strict.value(&near).is_err() && strict.value(&[2.0, 2.0]).is_ok());
    assert!(pce.with_tolerance(f64::NAN).is_err());
}

#[test]
fn the_file_keeps_every_bit_whatever_the_order_of_its_terms() {
    let pce = random::<3, 2>(6, 50, 8).with_tolerance(0.05).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("surrogate.json");
    pce.write(&path).unwrap();
    let same = Pce::<3, 2>::read(&path).unwrap();

    let mut json: serde_json::Value =
        serde_json::from_str(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let terms = json["terms"].as_array_mut().unwrap();
    terms.reverse();
    terms.swap(3, 20);
    std::fs::write(&path, json.to_string()).unwrap();
    let permuted = Pce::<3, 2>::read(&path).unwrap();

    for other in [same, permuted] {
        assert_eq!(other.terms(), pce.terms());
        assert_eq!(
            (other.inputs(), other.outputs(), other.tolerance()),
            (pce.inputs(), pce.outputs(), 0.05)
        );
        let x = [0.1, -0.7, 1.3];
        assert_eq!(other.value_and_jacobian(&x).unwrap(), pce.value_and_jacobian(&x).unwrap());
    }
}

#[test]
fn a_wrong_file_is_refused_with_its_name_and_reason() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("surrogate.json");
    random::<3, 2>(2, 5, 9).write(&path).unwrap();
    let refused = |text: &str| {
        std::fs::write(&path, text).unwrap();
        let message = Pce::<3, 2>::read(&path).unwrap_err().to_string();
        assert!(message.contains("surrogate.json"), "{message}");
        message
    };
    let good = std::fs::read_to_string(&path).unwrap();
    assert!(refused("{").contains("line 1"));
    assert!(
        refused(&good.replace("orthonormal Legendre", "Hermite")).contains("orthonormal Legendre")
    );
    assert!(
        refused(&good.replace("\"lower\": -1.0", "\"lower\": 9.0")).contains("lower one first")
    );
    std::fs::write(&path, &good).unwrap();
    assert!(Pce::<2, 2>::read(&path).unwrap_err().to_string().contains("expected 2 inputs"));
    let mut json: serde_json::Value = serde_json::from_str(&good).unwrap();
    json["terms"][1] = json["terms"][0].clone();
    assert!(refused(&json.to_string()).contains("occurs twice"));
    json["terms"][1]["index"] = serde_json::json!([0, 99, 0]);
    assert!(refused(&json.to_string()).contains("exceeds 16"));
    assert!(
        Pce::<3, 2>::read(folder.path().join("absent.json"))
            .unwrap_err()
            .to_string()
            .contains("absent.json")
    );
}
