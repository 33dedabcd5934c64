//! Values and derivatives of the densities.

use ppl::prelude::*;
use ppl::{Accumulator, Bound, Context, DomainError, Model, Rejection, Site, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

use crate::models::*;

/// Asserts that tape, dual numbers and central differences agree at several prior draws.
pub(crate) fn assert_gradient(name: &str, model: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let dim = model.layout().unwrap_or_else(|error| panic!("{name}: {error}")).dim;
    let mut w = Workspace::default();
    let (mut reverse, mut forward) = (vec![0.0; dim], vec![0.0; dim]);
    for _ in 0..5 {
        let y = model.draw_prior(&mut rng).unwrap().unconstrained;
        let value = model.log_density(&y, &mut w).unwrap();
        let by_tape = model.gradient(&y, &mut reverse, &mut w).unwrap();
        let by_dual = model.forward_gradient(&y, &mut forward).unwrap();
        approx::assert_relative_eq!(by_tape, value, max_relative = 1e-13);
        approx::assert_relative_eq!(by_dual, value, max_relative = 1e-13);
        for i in 0..dim {
            let at = |h: f64, w: &mut Workspace| {
                let mut shifted = y.clone();
                shifted[i] += h;
                model.log_density(&shifted, w).unwrap()
            };
            // fourth-order central difference
            let h = 1e-3;
            let inner = at(h, &mut w) - at(-h, &mut w);
            let outer = at(2.0 * h, &mut w) - at(-2.0 * h, &mut w);
            let difference = (8.0 * inner - outer) / (12.0 * h);
            let scale = reverse[i].abs().max(1.0);
            assert!(
                (reverse[i] - forward[i]).abs() < 1e-11 * scale
                    && (reverse[i] - difference).abs() < 1e-7 * value.abs().max(scale),
                "{name}, coordinate {i}: tape {}, dual {}, difference {difference}",
                reverse[i],
                forward[i]
            );
        }
    }
}

/// Asserts that two models have the same density and gradient.
pub(crate) fn assert_same(one: &Bound<impl Model>, other: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(5);
    let mut w = Workspace::default();
    let dim = one.layout().unwrap().dim;
    assert_eq!(other.layout().unwrap().dim, dim);
    let (mut ours, mut theirs) = (vec![0.0; dim], vec![0.0; dim]);
    for _ in 0..5 {
        let y = one.draw_prior(&mut rng).unwrap().unconstrained;
        let value = one.gradient(&y, &mut ours, &mut w).unwrap();
        let same = other.gradient(&y, &mut theirs, &mut w).unwrap();
        approx::assert_relative_eq!(value, same, max_relative = 1e-12);
        for (a, b) in ours.iter().zip(&theirs) {
            approx::assert_relative_eq!(*a, *b, max_relative = 1e-11, epsilon = 1e-11);
        }
    }
}

#[test]
fn three_derivatives_agree() {
    assert_gradient("calibration", &calibration(&Curve, &QOIS));
    assert_gradient("schools_centred", &schools_centred(&EFFECTS, &ERRORS));
    assert_gradient("schools", &schools(&EFFECTS, &ERRORS));
    assert_gradient("schools_in_a_plate", &schools_in_a_plate(&EFFECTS, &ERRORS));
    assert_gradient("bent", &bent(&[0.3, -1.0, 2.5, 0.1]));
    assert_gradient("regression", &regression(&ROWS, &[0.3, 1.2, 1.9]));
    assert_gradient("hierarchy", &hierarchy(2, vec![0, 1, 1], vec![2, 0, 5]));
    let ys = [0.3, f64::NAN, -1.0];
    assert_gradient("branches", &branches(true, Some(2.0), 1, &ys));
    assert_gradient("branches", &branches(false, None, 7, &ys));
    assert_gradient("mixture", &mixture(&[-1.0, 0.5, 2.0], -0.7));
    assert_gradient("places", &places(&(0.7, 1.1), &SPECIMENS, &true));
    assert_gradient("generic", &generic(&Curve, [0.1, 0.2, 0.3]));
    assert_gradient("jumps", &jumps(&[[0.3, 2.4, 1.0], [0.8, -0.2, 3.1], [1.2, 0.1, 0.4]]));
    assert_gradient("walk", &walk(&[0.1, 0.4, 0.2]));
}

/// The non-centred eight schools, with the statements that `model!` should generate.
struct SchoolsByHand;

impl Model for SchoolsByHand {
    fn run<C: Context>(&self, cx: &mut C) -> Result<(), Rejection> {
        static MU: Site = Site::new("mu");
        static TAU: Site = Site::new("tau");
        static Z: Site = Site::new("z");
        static THETA: Site = Site::new("theta");
        static Y: Site = Site::new("y").in_loop();
        let mu = cx.unknown(&MU, Normal(0.0, 5.0))?;
        let tau = cx.unknown(&TAU, HalfCauchy(5.0))?;
        let z = cx.unknown(&Z, Normal(0.0, 1.0).array::<8>())?;
        let theta = z.map(|z| mu + tau * z);
        cx.track(&THETA, &theta)?;
        for j in 0..8 {
            cx.condition(&Y, Normal(theta[j], ERRORS[j]), &EFFECTS[j])?;
        }
        Ok(())
    }
}

#[test]
fn the_macro_writes_what_a_hand_would() {
    let (written, by_hand) = (schools(&EFFECTS, &ERRORS), Bound::new(SchoolsByHand));
    assert_eq!(written.layout().unwrap(), by_hand.layout().unwrap());
    let mut w = Workspace::default();
    let y: Vec<f64> = (0..10).map(|i| 0.3 * f64::from(i) - 1.0).collect();
    let (mut a, mut b) = ([0.0; 10], [0.0; 10]);
    let value = written.gradient(&y, &mut a, &mut w).unwrap();
    let expected = by_hand.gradient(&y, &mut b, &mut w).unwrap();
    // the macro adds the terms of a loop in another order
    approx::assert_relative_eq!(value, expected, max_relative = 1e-14);
    for (a, b) in a.iter().zip(b) {
        approx::assert_relative_eq!(*a, b, max_relative = 1e-13);
    }
}

#[test]
fn density_in_closed_form() {
    let (x, y) = ([[1.0], [2.0]], [0.5, 1.5]);
    let model = regression(&x, &y);
    let [a, b, sd]: [f64; 3] = [0.2, 0.4, 0.8];
    // Student t with 4 degrees of freedom: density 3/8 (1 + z²/4)^(-5/2)
    let z = b / 2.5;
    let mut expected = ln_normal(a, 0.0, 10.0) - sd;
    expected += (0.375 / 2.5f64).ln() - 2.5 * (1.0 + z * z / 4.0f64).ln();
    for (x, y) in x.iter().zip(y) {
        expected += ln_normal(y, a + b * x[0], sd);
    }
    let mut w = Workspace::default();
    let point = [a, b, sd.ln()];
    let found = model.log_density_without_jacobian(&point, &mut w).unwrap();
    approx::assert_relative_eq!(found, expected, max_relative = 1e-13);
    let found = model.log_density(&point, &mut w).unwrap();
    approx::assert_relative_eq!(found, expected + sd.ln(), max_relative = 1e-13);
}

fn ln_normal(x: f64, mean: f64, sd: f64) -> f64 {
    -0.5 * ((x - mean) / sd).powi(2) - sd.ln() - 0.5 * std::f64::consts::TAU.ln()
}

/// A `factor` statement adds to the log-density, with and without unknowns; a sum over components
/// is a mixture.
#[test]
fn factors_in_closed_form() {
    let ys = [-1.0, 0.5, 2.0];
    let [share, a, b]: [f64; 3] = [0.25, -0.4, 0.9];
    let mut expected = (6.0 * share * (1.0 - share)).ln() + ln_normal(a, 0.0, 1.0);
    expected += ln_normal(b, 0.0, 1.0) - 0.7 - 0.5 * (a + b).powi(2);
    for y in ys {
        let first = share * ln_normal(y, a, 1.0).exp();
        expected += (first + (1.0 - share) * ln_normal(y, b, 2.0).exp()).ln();
    }
    let point = [(share / (1.0 - share)).ln(), a, b];
    let model = mixture(&ys, -0.7);
    let found = model.log_density_without_jacobian(&point, &mut Workspace::default()).unwrap();
    approx::assert_relative_eq!(found, expected, max_relative = 1e-12);
}

/// Only the arm of a branch that runs adds terms; `continue` skips the rest of an iteration.
#[test]
fn branches_in_closed_form() {
    let ys = [0.3, f64::NAN, -1.0];
    // the branches of kind 0 without a prior of the scale: one unknown, and normal observations with scale 1
    let plain = branches(false, None, 0, &ys);
    let found = plain.log_density(&[0.4], &mut Workspace::default()).unwrap();
    let observed = ln_normal(0.3, 0.4, 1.0) + ln_normal(-1.0, 0.4, 1.0);
    approx::assert_relative_eq!(found, ln_normal(0.4, 0.0, 2.0) + observed, max_relative = 1e-13);
    // the branches of kind 5 with a prior of the scale: an unknown scale, and a shift of the mean by an unknown
    let [mean, sd, light]: [f64; 3] = [0.4, 0.5, 0.2];
    let full = branches(false, Some(2.0), 5, &ys);
    let mut w = Workspace::default();
    let found = full.log_density_without_jacobian(&[mean, sd.ln(), light], &mut w).unwrap();
    let mut expected = ln_normal(mean, 0.0, 2.0) + ln_normal(sd, 0.0, 2.0) + 2.0f64.ln();
    expected += ln_normal(light, 0.0, 1.0);
    expected += ln_normal(0.3, mean + light, sd) + ln_normal(-1.0, mean + light, sd);
    approx::assert_relative_eq!(found, expected, max_relative = 1e-13);
}

ppl::model! {
    /// A mixture of a narrow and a wide normal by hand; far from the data only the wide component matters.
    fn spike_and_slab(y: &[f64]) {
        let mean ~ Normal(0.0, 1e3);
        for y in y {
            let y = Real::from(*y);
            factor(ln_sum_exp(&[
                Normal(mean, 0.1).ln_density(&y) + 0.5f64.ln(),
                wide(mean, y) + 0.5f64.ln(),
            ]));
        }
    }

    /// An array length that the data do not determine, and predictors that are numbers without a formula.
    fn classes<const K: usize>(rows: &[[f64; 2]], class: &[u64]) {
        let slope ~ Normal(0.0, 1.0).array::<2>().array::<K>();
        for (row, class) in rows.iter().zip(class) {
            let mut logits = [Real::from(0.0), dot(row, &slope[0])].to_vec();
            for slope in &slope[1..] {
                logits.push(dot(row, slope));
            }
            let each = logits.iter().map(BernoulliLogit).collect::<Vec<_>>();
            factor(each[*class as usize].ln_density(&true));
        }
    }
}

/// A density inside a user's function.
fn wide<S: Scalar>(mean: S, y: S) -> S {
    Normal(mean, 10.0).ln_density(&y)
}

/// A function of the user that computes Φ instead of calling the method of the crate.
fn ndtr<S: Scalar>(x: S) -> S {
    x.normal_cdf()
}

ppl::model! {
    /// A predictor that is used once, as the argument of a function.
    fn probit(x: &[f64], y: &[bool]) {
        let intercept ~ Normal(0.0, 0.5);
        let slope ~ Normal(0.0, 0.5).array::<1>();
        for (i, (x, y)) in x.iter().zip(y).enumerate() {
            let mut eta = intercept;
            for k in 0..1 {
                eta += slope[k] * x;
            }
            if i % 2 == 0 {
                let shifted = intercept + slope[0] * x;
                y ~ Bernoulli(ndtr(shifted));
            } else {
                y ~ Bernoulli(eta.normal_cdf());
            }
        }
    }
}

#[test]
fn formulas_are_numbers_in_functions() {
    let model = probit(&[0.5, -1.0], &[true, false]);
    let [a, b] = [0.3, 0.8];
    let mut expected = ln_normal(a, 0.0, 0.5) + ln_normal(b, 0.0, 0.5);
    expected += ppl::special::normal_cdf(a + 0.5 * b).ln();
    expected += ppl::special::normal_cdf(b - a).ln();
    let found = model.log_density(&[a, b], &mut Workspace::default()).unwrap();
    approx::assert_relative_eq!(found, expected, max_relative = 1e-13);
    assert_gradient("probit", &model);
}

/// A density with which a model computes includes the constants that a statement may omit.
#[test]
fn densities_by_hand_are_complete() {
    let ys = [0.3, -0.2];
    let model = spike_and_slab(&ys);
    let mean = 0.1;
    let mut expected = ln_normal(mean, 0.0, 1e3);
    for y in ys {
        let densities = [0.1, 10.0].map(|sd| 0.5 * ln_normal(y, mean, sd).exp());
        expected += (densities[0] + densities[1]).ln();
    }
    let (mut w, mut gradient) = (Workspace::default(), [0.0]);
    approx::assert_relative_eq!(model.log_density(&[mean], &mut w).unwrap(), expected);
    approx::assert_relative_eq!(model.gradient(&[mean], &mut gradient, &mut w).unwrap(), expected);
    assert_gradient("spike_and_slab", &model);
}

#[test]
fn predictors_are_numbers() {
    let model = classes::<2>(&[[1.0, 0.5], [-0.3, 2.0]], &[2, 0]);
    let point = [0.4, -1.0, 0.7, 0.2];
    let mut expected: f64 = point.iter().map(|x| ln_normal(*x, 0.0, 1.0)).sum();
    for (row, class) in [([1.0, 0.5], 2), ([-0.3, 2.0], 0)] {
        let eta = |k: usize| row[0] * point[2 * k] + row[1] * point[2 * k + 1];
        let logits = [0.0, eta(0), eta(1)];
        expected -= (-logits[class]).exp().ln_1p();
    }
    let found = model.log_density(&point, &mut Workspace::default()).unwrap();
    approx::assert_relative_eq!(found, expected, max_relative = 1e-14);
    assert_gradient("classes", &model);
}

/// A distribution that claims `dim` coordinates and reads one.
#[derive(Clone, Copy)]
struct Miscounted {
    dim: usize,
}

impl Family for Miscounted {}

impl<R: Scalar> Distribution<R> for Miscounted {
    type Value = R;

    fn add_terms(&self, x: &R, terms: &mut impl Accumulator<R>) {
        Normal(0.0, 1.0).add_terms(x, terms);
    }

    fn validate(&self) -> Result<(), DomainError> {
        Ok(())
    }

    fn draw<G: rand::Rng + ?Sized>(&self, rng: &mut G) -> R {
        Normal(0.0, 1.0).draw(rng)
    }
}

impl<R: Scalar> Unknown<R> for Miscounted {
    fn dim(&self) -> usize {
        self.dim
    }

    fn constrain(
        &self,
        next: &mut impl FnMut() -> R,
        _: bool,
        terms: &mut impl Accumulator<R>,
    ) -> R {
        let x = next();
        terms.add_number(self.ln_density(&x));
        x
    }

    fn unconstrain(&self, x: &R, out: &mut Vec<f64>) {
        out.push(x.value());
    }
}

ppl::model! {
    fn miscounted(dim: usize) {
        let x ~ Miscounted { dim };
        let y ~ Normal(x, 1.0);
    }
}

#[test]
fn an_unknown_that_miscounts_its_coordinates_is_named() {
    let at = |dim: usize, y: &[f64]| miscounted(dim).log_density(y, &mut Workspace::default());
    let expected = Normal(0.0, 1.0).ln_density(&0.3) + Normal(0.3, 1.0).ln_density(&1.2);
    approx::assert_relative_eq!(at(1, &[0.3, 1.2]).unwrap(), expected, max_relative = 1e-14);
    for (dim, y) in [(0, vec![0.3, 1.2]), (2, vec![0.3, 0.7, 1.2])] {
        let error = at(dim, &y).unwrap_err().to_string();
        let wanted = format!("reads a number of coordinates that differs from its `dim()`, {dim}");
        assert!(error.contains(&wanted) && error.contains("let x ~"), "{error}");
    }
}
