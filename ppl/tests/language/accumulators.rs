//! Distributions whose terms the accumulator evaluates early have the values and gradients of their formulas: mixtures,
//! whose components receive their partial derivatives by weight, and normal scales, of whose product one logarithm is
//! taken.

use ppl::prelude::*;
use ppl::{Bound, Model, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// The value of a number without its derivative.
fn plain<S: Scalar>(x: S) -> f64 {
    x.value()
}

ppl::model! {
    fn two(y: &[f64], share: f64) {
        let mean ~ Normal(0.0, 2.0).array::<2>();
        let sd ~ HalfNormal(2.0).array::<2>();
        let w ~ Beta(2.0, 2.0);
        for y in y {
            y ~ Mixture([w, 1.0 - w], [Normal(mean[0], sd[0]), Normal(mean[1], sd[1])]);
        }
        // a mixture in which one component has weight 0 if `share` is 0 or 1
        for again in y {
            again ~ Mixture([share, 1.0 - share], [Normal(mean[0], 1.0), Normal(mean[1], 2.0)]);
        }
    }

    /// More components than fit in the array on the stack, and mixtures of mixtures.
    fn many(y: &[f64], k: &[u64]) {
        let mean ~ Normal(0.0, 2.0).array::<9>();
        let share ~ Beta(2.0, 2.0).array::<9>();
        let w = share.map(|s| s / share.iter().sum::<Real<_>>());
        for y in y {
            let inner = Mixture([0.25, 0.75], [StudentT(1.0, mean[0], 1.0), StudentT(1.0, mean[1], 2.0)]);
            let other = Mixture([0.5, 0.5], [StudentT(1.0, mean[2], 1.0), StudentT(1.0, mean[1], 0.5)]);
            y ~ Mixture([0.5, 0.5], [inner, other]);
            let again = y;
            again ~ Mixture(w, mean.map(|m| Normal(m, 0.7).truncate(-9.0..9.0)));
        }
        for k in k {
            k ~ Mixture([w[0], 1.0 - w[0]], [Poisson(mean[0].exp()), Poisson(mean[1].exp())]);
        }
    }

    /// A mixture whose first or second component has the parameter NaN for mean > 0.
    fn broken(y: &[f64], second: bool) {
        let mean ~ Normal(0.0, 2.0);
        let root = (-mean).sqrt();
        for y in y {
            if second {
                y ~ Mixture([0.5, 0.5], [Normal(mean, 1.0), Normal(root, 1.0)]);
            } else {
                y ~ Mixture([0.5, 0.5], [Normal(root, 1.0), Normal(mean, 1.0)]);
            }
        }
    }

    /// Products of scales that overflow and underflow repeatedly.
    fn scales(x: &[f64], y: &[f64]) {
        let mean ~ Normal(0.0, 1.0);
        let sd ~ HalfNormal(1.0);
        for (x, y) in x.iter().zip(y) {
            y ~ Normal(mean * x, sd * x);
        }
        let mut level = sd;
        for (x, again) in x.iter().zip(y) {
            level = 0.5 * level + 0.5 * x;
            again ~ Normal(mean, level);
        }
    }

    /// Factorials and binomial coefficients that are constant over all points.
    fn counts(k: &[u64], x: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        let b ~ Normal(0.0, 1.0);
        let p ~ Beta(2.0, 2.0);
        for (count, x) in k.iter().zip(x) {
            count ~ PoissonLog(a + b * x);
        }
        for again in k {
            again ~ PoissonLog(a);
        }
        for (successes, x) in k.iter().zip(x) {
            successes ~ BinomialLogit(40u64, a + 9.0 * b * x);
        }
        for heads in k {
            heads ~ Binomial(40u64, p);
        }
    }

    /// Data at the ends of a support, where the density is positive if the shape is 1.
    fn ends(low: &[f64], high: &[f64]) {
        let a ~ Gamma(2.0, 1.0);
        for (i, x) in low.iter().enumerate() {
            match i {
                0 => { x ~ Gamma(1.0, a); }
                1 => { x ~ Weibull(1.0, a); }
                _ => { x ~ Beta(1.0, a); }
            }
        }
        for x in high {
            let other = *x;
            other ~ Beta(a, 1.0);
        }
    }

    /// Branches on data inside expressions; the statements are the same at every point.
    fn by_data(t: &[f64], k: &[u64]) {
        let early ~ Exponential(1.0);
        let late ~ Exponential(1.0);
        for i in 0..k.len() {
            let rate = if t[i] < 0.0 { early } else { late };
            k[i] ~ Poisson(rate);
        }
        for (t, again) in t.iter().zip(k) {
            let rate = match *t {
                t if t < -1.0 => early,
                t if t < 1.0 => late * 2.0,
                _ => late,
            };
            again ~ Poisson(rate);
        }
    }

    /// Branches on unknowns inside expressions; the statements differ between points.
    fn by_unknown(t: &[f64], k: &[u64]) {
        let early ~ Exponential(1.0);
        let late ~ Exponential(1.0);
        for (t, k) in t.iter().zip(k) {
            let rate = match *t {
                t if late > t => early,
                _ => late,
            };
            k ~ Poisson(rate);
        }
    }

    fn by_value(k: &[u64]) {
        let early ~ Exponential(1.0);
        let rate = if k.len() > 1 { Real::from(plain(early)) } else { early };
        for k in k {
            k ~ Poisson(rate + 0.5);
        }
    }

    /// Branches on unknowns that leave the statements of the density unchanged.
    fn by_rejection(y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        if a > 5.0 {
            reject!("{a} is too large");
        }
        #[track] let positive = a > 0.0;
        #[track] let size = if a > 0.0 { a } else { -a };
        for y in y {
            y ~ Normal(a, 1.0);
        }
        #[predict] let sign = if a.value() > 0.0 { 1.0 } else { -1.0 };
    }

    /// A scale that is a number without derivative, whose value depends on an unknown.
    fn by_track(y: &[f64]) {
        let a ~ Normal(0.0, 1.0);
        #[track] let scale = if a > 0.0 { 1.0 } else { 2.0 };
        for y in y {
            y ~ Normal(a, scale);
        }
    }

    fn trials(n: u64, k: &[u64]) {
        let p ~ Beta(2.0, 2.0);
        let logit ~ Normal(0.0, 1.0);
        for k in k {
            k ~ Binomial(n, p);
        }
        for again in k {
            again ~ BinomialLogit(n, logit);
        }
    }
}

/// Asserts that four evaluations agree: compiled, on a complete tape, by dual numbers, and the value without gradient.
fn assert_agrees(model: &Bound<impl Model>) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut workspace = Workspace::default();
    for _ in 0..5 {
        let y = model.draw_prior(&mut rng).expect("a proper prior").unconstrained;
        let [mut compiled, mut tape, mut forward] = [(); 3].map(|()| vec![0.0; y.len()]);
        let values = [
            model.gradient(&y, &mut compiled, &mut workspace).expect("finite"),
            model.tape_gradient(&y, &mut tape, &mut workspace).expect("finite"),
            model.forward_gradient(&y, &mut forward).expect("finite"),
            model.log_density(&y, &mut workspace).expect("finite"),
        ];
        for value in values {
            approx::assert_relative_eq!(value, values[0], max_relative = 1e-11);
        }
        let size = forward.iter().fold(1.0f64, |size, g| size.max(g.abs()));
        for ((c, t), f) in compiled.iter().zip(&tape).zip(&forward) {
            approx::assert_relative_eq!(c, f, epsilon = 1e-11 * size, max_relative = 1e-10);
            approx::assert_relative_eq!(t, f, epsilon = 1e-11 * size, max_relative = 1e-10);
        }
    }
}

#[test]
fn mixtures_take_partials_by_weight() {
    let y = [-3.0, -0.1, 0.4, 2.0, 8.5];
    for share in [0.3, 0.0, 1.0] {
        assert_agrees(&two(&y, share));
        // far from the means, one density or both underflow relative to the other
        assert_agrees(&two(&[-300.0, 60.0, 4000.0], share));
    }
    assert_agrees(&many(&y, &[0, 3, 40]));
}

#[test]
fn logarithms_of_products_are_those_of_the_factors() {
    for scale in [1e-6, 1.0, 1e6] {
        let x: Vec<f64> = (0..3000).map(|i| scale * (2.0 + f64::from(i).sin())).collect();
        let y: Vec<f64> = x.iter().map(|x| x.cos()).collect();
        assert_agrees(&scales(&x, &y));
    }
}

#[test]
fn a_component_that_is_no_number_spoils_the_mixture() {
    for second in [false, true] {
        let (model, mut gradient) = (broken(&[0.3, -0.4], second), [0.0]);
        let mut workspace = Workspace::default();
        for (y, defined) in [(-0.5, true), (0.5, false)] {
            let value = model.log_density(&[y], &mut workspace);
            assert_eq!(value.is_ok(), defined);
            assert_eq!(model.gradient(&[y], &mut gradient, &mut workspace).is_ok(), defined);
        }
    }
}

#[test]
fn counts_leave_out_what_is_the_same_at_every_point() {
    assert_agrees(&counts(&[0, 3, 40, 17, 1], &[0.4, -2.0, 1.5, 3.0, -0.1]));
    assert_agrees(&trials(7, &[0, 7, 3]));
    let (more, mut workspace) = (trials(7, &[8]), Workspace::default());
    assert!(more.log_density(&[0.3, 0.1], &mut workspace).is_err());
}

#[test]
fn densities_at_the_ends_have_derivatives() {
    let model = ends(&[0.0; 3], &[1.0; 2]);
    assert_agrees(&model);
    ppl::check::gradient(&model, 5);
}

fn is_static<M: Model>(_: &Bound<M>) -> bool {
    M::STATIC
}

#[test]
fn only_branches_on_unknowns_change_what_a_point_runs() {
    let (t, k) = ([-2.0, -0.5, 0.5, 2.0], [0, 3, 1, 7]);
    let (data, unknown) = (by_data(&t, &k), by_unknown(&t, &k));
    assert!(is_static(&data));
    assert_agrees(&data);
    assert!(!is_static(&unknown));
    assert_agrees(&unknown);
    assert!(!is_static(&by_value(&k)));
    let (rejecting, tracking) = (by_rejection(&t), by_track(&t));
    assert!(is_static(&rejecting));
    assert_agrees(&rejecting);
    assert!(!is_static(&tracking));
    assert_agrees(&tracking);
}
