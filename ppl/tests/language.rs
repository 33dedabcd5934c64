//! The language of `model!` against the same models by hand, and three ways to differentiate
//! every kind of statement.

use std::collections::BTreeMap;

use ppl::prelude::*;
use ppl::{Bound, Context, Differentiable, DomainError, Model, Rejection, Role, Site, Workspace};
use rand::SeedableRng;
use rand_xoshiro::Xoshiro256PlusPlus;

/// Tape, duals and central differences agree at several prior draws.
fn assert_gradient(name: &str, model: &Bound<impl Model>) {
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

fn names(model: &Bound<impl Model>) -> Vec<(String, Vec<usize>, Role)> {
    let variables = &model.layout().unwrap().variables;
    variables.iter().map(|v| (v.name.clone(), v.shape.clone(), v.role)).collect()
}

fn named(expected: &[(&str, &[usize], Role)]) -> Vec<(String, Vec<usize>, Role)> {
    expected.iter().map(|(name, shape, role)| (name.to_string(), shape.to_vec(), *role)).collect()
}

/// Three quantities of three parameters; defined for a > 1.
struct Curve;

impl Differentiable<3, 3> for Curve {
    fn value_and_jacobian(
        &self,
        &[a, b, c]: &[f64; 3],
    ) -> Result<([f64; 3], [[f64; 3]; 3]), DomainError> {
        if a <= 1.0 {
            return Err(DomainError::new(format!("a must be above 1, got {a}")));
        }
        let value = [a * b, a.ln() + c, b * c * c];
        let jacobian = [[b, a, 0.0], [1.0 / a, 0.0, 1.0], [0.0, c * c, 2.0 * b * c]];
        Ok((value, jacobian))
    }
}

const EFFECTS: [f64; 8] = [28.0, 8.0, -3.0, 7.0, -1.0, 1.0, 18.0, 12.0];
const ERRORS: [f64; 8] = [15.0, 10.0, 16.0, 11.0, 9.0, 11.0, 10.0, 18.0];

ppl::model! {
    /// The shape of the paper's calibration.
    pub fn calibration(forward: &Curve, qois: &[[f64; 3]]) {
        let young     ~ Uniform(2.5, 3.0);
        let toughness ~ Uniform(0.1, 0.5);
        let viscosity ~ Uniform(0.5, 1.5);

        let sd   ~ Normal(0.15, 0.25).truncate(0.0..).array::<3>();
        let corr ~ LkjCholesky::<3>(3.0);
        let chol = corr.scale_rows(sd);

        #[track] let mean = forward.at([young, toughness, viscosity]);
        for y in qois {
            y ~ MvNormalCholesky(mean, chol);
        }
        #[predict] let new_specimen ~ MvNormalCholesky(mean, chol);
    }

    fn schools_centred(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let theta ~ Normal(mu, tau).array::<8>();
        for j in 0..8 {
            effects[j] ~ Normal(theta[j], errors[j]);
        }
    }

    fn schools(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        let z ~ Normal(0.0, 1.0).array::<8>();
        #[track] let theta = z.map(|z| mu + tau * z);
        for ((y, sd), theta) in effects.iter().zip(errors).zip(theta) {
            y ~ Normal(theta, sd);
        }
    }

    /// Unknowns declared in a plate.
    fn schools_in_a_plate(effects: &[f64; 8], errors: &[f64; 8]) {
        let mu ~ Normal(0.0, 5.0);
        let tau ~ HalfCauchy(5.0);
        for (y, sd) in effects.iter().zip(errors) {
            let theta ~ Normal(mu, tau);
            y ~ Normal(theta, sd);
        }
    }

    fn regression<const D: usize>(x: &[[f64; D]], y: &[f64]) {
        let intercept ~ Normal(0.0, 10.0);
        let slope ~ StudentT(4.0, 0.0, 2.5).array::<D>();
        let sd ~ Exponential(1.0);
        for (row, y) in x.iter().zip(y) {
            let mut mean = intercept;
            for d in 0..D {
                mean += slope[d] * row[d];
            }
            y ~ Normal(mean, sd);
        }
        #[predict] for row in x {
            let mut mean = intercept;
            for d in 0..D {
                mean += slope[d] * row[d];
            }
            #[track] let fitted = mean;
            let y_new ~ Normal(fitted, sd);
        }
    }

    /// Groups by index, sizes at run time, owned data.
    fn hierarchy(groups: usize, group: Vec<usize>, count: Vec<u64>) {
        let level ~ Normal(0.0, 1.0);
        let spread ~ HalfNormal(1.0);
        let offset ~ Normal(level, spread).iid(groups);
        for (g, k) in group.iter().zip(count) {
            let rate = offset[*g].exp();
            k ~ Poisson(rate);
        }
    }

    /// Branches on data, with and without a value.
    fn branches(robust: bool, prior: Option<f64>, kind: u8, ys: &[f64]) {
        let mean ~ Normal(0.0, 2.0);
        let sd = if let Some(scale) = prior {
            let free ~ Normal(0.0, scale).truncate(0.0..);
            free
        } else {
            Real::from(1.0)
        };
        let shift = match kind {
            0 => Real::from(0.0),
            1 | 2 if robust => {
                let heavy ~ StudentT(3.0, 0.0, 1.0);
                heavy
            }
            _ => {
                let light ~ Normal(0.0, 1.0);
                light
            }
        };
        for (i, y) in ys.iter().enumerate() {
            if y.is_nan() {
                continue;
            }
            if robust && i > 0 {
                y ~ StudentT(5.0, mean + shift, sd);
            } else {
                y ~ Normal(mean + shift, sd);
            }
        }
    }

    /// A mixture summed out, with weights of both kinds.
    fn mixture(ys: &[f64], weight: f64) {
        let share ~ Beta(2.0, 2.0);
        let centre ~ Normal(0.0, 1.0).array::<2>();
        factor(weight);
        factor(-0.5 * (centre[0] + centre[1]).square());
        for y in ys {
            let first = Normal(centre[0], 1.0).ln_density(&Real::from(*y)) + share.ln();
            let second = Normal(centre[1], 2.0).ln_density(&Real::from(*y)) + (1.0 - share).ln();
            factor(first + (second - first).softplus());
        }
    }

    /// Fields, tuples and dereferences as places; blocks.
    fn places(pair: &(f64, f64), specimens: &[Specimen], flag: &bool) {
        let a ~ Gamma(2.0, 3.0);
        let p ~ Uniform(0.0, 1.0);
        pair.0 ~ LogNormal(0.0, a);
        {
            let b = 2.0 * a;
            pair.1 ~ Normal(b, 1.0);
        }
        for s in specimens {
            s.slope ~ Normal(a, 0.5);
            s.peak[1] ~ Normal(a * a, 0.5);
        }
        *flag ~ Bernoulli(p);
    }

    fn generic<'a, F>(f: &'a F, y: [f64; 3])
    where
        F: Differentiable<3, 3> + 'a,
    {
        let x ~ Uniform(1.5, 2.5).array::<3>();
        let value = f.try_at(x)?;
        y ~ Normal(0.0, 1.0).array::<3>();
        factor(-value[0].square());
    }

    fn limited(f: &Curve, limit: f64) {
        let x ~ Normal(1.0, 1.0);
        if x > limit {
            reject!("{x} is above {limit}");
        }
        let value = f.try_at([x, x, x])?[1];
        factor(-value.square());
    }

    /// A sequence carried through a loop.
    fn walk(ys: &[f64]) {
        let phi ~ Uniform(-1.0, 1.0);
        let sd ~ HalfNormal(1.0);
        let mut state = Real::from(0.0);
        for y in ys {
            let step ~ Normal(0.0, sd);
            state = phi * state + step;
            y ~ Normal(state, 0.5);
        }
        #[track] let last = state;
        #[predict] let next ~ Normal(phi * last, sd);
        #[predict] let change = next - last;
    }
}

struct Specimen {
    slope: f64,
    peak: [f64; 2],
}

const SPECIMENS: [Specimen; 2] =
    [Specimen { slope: 0.4, peak: [9.0, 1.0] }, Specimen { slope: 0.7, peak: [8.0, 1.2] }];
const QOIS: [[f64; 3]; 2] = [[1.0, 2.0, 0.5], [1.1, 1.9, 0.4]];
const ROWS: [[f64; 2]; 3] = [[0.0, 1.0], [1.0, -0.5], [2.0, 0.3]];

#[test]
fn three_derivatives_agree() {
    assert_gradient("calibration", &calibration(&Curve, &QOIS));
    assert_gradient("schools_centred", &schools_centred(&EFFECTS, &ERRORS));
    assert_gradient("schools", &schools(&EFFECTS, &ERRORS));
    assert_gradient("schools_in_a_plate", &schools_in_a_plate(&EFFECTS, &ERRORS));
    assert_gradient("regression", &regression(&ROWS, &[0.3, 1.2, 1.9]));
    assert_gradient("hierarchy", &hierarchy(2, vec![0, 1, 1], vec![2, 0, 5]));
    let ys = [0.3, f64::NAN, -1.0];
    assert_gradient("branches", &branches(true, Some(2.0), 1, &ys));
    assert_gradient("branches", &branches(false, None, 7, &ys));
    assert_gradient("mixture", &mixture(&[-1.0, 0.5, 2.0], -0.7));
    assert_gradient("places", &places(&(0.7, 1.1), &SPECIMENS, &true));
    assert_gradient("generic", &generic(&Curve, [0.1, 0.2, 0.3]));
    assert_gradient("walk", &walk(&[0.1, 0.4, 0.2]));
}

/// The non-centred eight schools as `model!` would have to write it.
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
    assert_eq!(written.log_density(&y, &mut w).unwrap(), by_hand.log_density(&y, &mut w).unwrap());
    let (mut a, mut b) = ([0.0; 10], [0.0; 10]);
    written.gradient(&y, &mut a, &mut w).unwrap();
    by_hand.gradient(&y, &mut b, &mut w).unwrap();
    assert_eq!(a, b);
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

/// `factor` adds, with data and with unknowns; the sum over components is a mixture.
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

/// The arm that runs counts, the others do not; `continue` leaves an iteration out.
#[test]
fn branches_in_closed_form() {
    let ys = [0.3, f64::NAN, -1.0];
    // kind 0 without a prior for the scale: one unknown, plain normal observations
    let plain = branches(false, None, 0, &ys);
    let found = plain.log_density(&[0.4], &mut Workspace::default()).unwrap();
    let observed = ln_normal(0.3, 0.4, 1.0) + ln_normal(-1.0, 0.4, 1.0);
    approx::assert_relative_eq!(found, ln_normal(0.4, 0.0, 2.0) + observed, max_relative = 1e-13);
    // kind 5 with a prior: a scale of 0.5, and a shift
    let [mean, sd, light]: [f64; 3] = [0.4, 0.5, 0.2];
    let full = branches(false, Some(2.0), 5, &ys);
    let mut w = Workspace::default();
    let found = full.log_density_without_jacobian(&[mean, sd.ln(), light], &mut w).unwrap();
    let mut expected = ln_normal(mean, 0.0, 2.0) + ln_normal(sd, 0.0, 2.0) + 2.0f64.ln();
    expected += ln_normal(light, 0.0, 1.0);
    expected += ln_normal(0.3, mean + light, sd) + ln_normal(-1.0, mean + light, sd);
    approx::assert_relative_eq!(found, expected, max_relative = 1e-13);
}

#[test]
fn names_and_shapes() {
    use Role::{Observed, Parameter, Predicted, Tracked};
    assert_eq!(
        names(&calibration(&Curve, &QOIS)),
        named(&[
            ("young", &[], Parameter),
            ("toughness", &[], Parameter),
            ("viscosity", &[], Parameter),
            ("sd", &[3], Parameter),
            ("corr", &[3, 3], Parameter),
            ("mean", &[3], Tracked),
            ("y", &[2, 3], Observed),
            ("new_specimen", &[3], Predicted),
        ])
    );
    assert_eq!(
        names(&schools_in_a_plate(&EFFECTS, &ERRORS))[2..],
        named(&[("theta", &[8], Parameter), ("y", &[8], Observed)])
    );
    assert_eq!(
        names(&regression(&ROWS, &[0.3, 1.2, 1.9])),
        named(&[
            ("intercept", &[], Parameter),
            ("slope", &[2], Parameter),
            ("sd", &[], Parameter),
            ("y", &[3], Observed),
            ("fitted", &[3], Predicted),
            ("y_new", &[3], Predicted),
        ])
    );
    assert_eq!(
        names(&places(&(0.7, 1.1), &SPECIMENS, &true))[2..],
        named(&[
            ("pair.0", &[], Observed),
            ("pair.1", &[], Observed),
            ("s.slope", &[2], Observed),
            ("s.peak", &[2], Observed),
            ("flag", &[], Observed),
        ])
    );
    // arms of a branch share a name, and only the arm that runs declares
    let both = branches(true, Some(1.0), 2, &[0.1, f64::NAN, 0.3]);
    assert_eq!(
        names(&both),
        named(&[
            ("mean", &[], Parameter),
            ("free", &[], Parameter),
            ("heavy", &[], Parameter),
            ("y", &[2], Observed),
        ])
    );
    assert_eq!(branches(false, None, 0, &[0.1]).layout().unwrap().dim, 1);
    assert_eq!(hierarchy(5, vec![0], vec![1]).layout().unwrap().dim, 7);
}

#[test]
fn values_at_a_point() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(1);
    let model = walk(&[0.1, 0.4]);
    let (phi, sd) = (0.5, 2.0f64);
    let y = [(1.5f64 / 0.5).ln(), sd.ln(), 0.3, -0.2];
    let record = model.constrain(&y, &mut rng).unwrap();
    let value = |name: &str| record.values(name).unwrap();
    approx::assert_relative_eq!(value("phi")[0], phi, max_relative = 1e-14);
    assert_eq!(value("step"), [0.3, -0.2]);
    approx::assert_relative_eq!(value("last")[0], phi * 0.3 - 0.2, max_relative = 1e-13);
    let change = value("next")[0] - value("last")[0];
    assert_eq!(value("change")[0], change);
    let observed = record.get("y").unwrap();
    assert_eq!(observed.values, [0.1, 0.4]);
    assert_eq!((observed.replicate.len(), observed.log_likelihood.len()), (2, 2));
    let ln_density: f64 = Normal(0.3, 0.5).ln_density(&0.1);
    approx::assert_relative_eq!(observed.log_likelihood[0], ln_density, max_relative = 1e-13);
}

/// Prior draws and predictions follow their distributions: means within 4 standard errors.
#[test]
fn prior_draws() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let model = walk(&[0.1, 0.4]);
    let n = 4000;
    let mut columns: BTreeMap<&str, Vec<f64>> = BTreeMap::new();
    for _ in 0..n {
        let record = model.draw_prior(&mut rng).unwrap();
        let scale = record.values("sd").unwrap()[0];
        for name in ["phi", "sd"] {
            columns.entry(name).or_default().push(record.values(name).unwrap()[0]);
        }
        // standardised by what they are drawn from
        let next = record.values("next").unwrap()[0];
        let centre = record.values("phi").unwrap()[0] * record.values("last").unwrap()[0];
        columns.entry("next").or_default().push((next - centre) / scale);
        let replicate = &record.get("y").unwrap().replicate;
        let state = record.values("step").unwrap()[0];
        columns.entry("y").or_default().push((replicate[0] - state) / 0.5);
    }
    let half_normal = (2.0 / std::f64::consts::PI).sqrt();
    let expected = [
        ("phi", 0.0, 1.0 / 3.0),
        ("sd", half_normal, 1.0 - half_normal * half_normal),
        ("next", 0.0, 1.0),
        ("y", 0.0, 1.0),
    ];
    for (name, mean, variance) in expected {
        let found = columns[name].iter().sum::<f64>() / f64::from(n);
        let error = (variance / f64::from(n)).sqrt();
        assert!((found - mean).abs() < 4.0 * error, "{name}: {found} against {mean} ± {error}");
    }
}

#[test]
fn rejections_know_their_place() {
    let model = limited(&Curve, 3.0);
    let mut w = Workspace::default();
    let at = |x: f64, w: &mut Workspace| model.log_density(&[x], w).unwrap_err();

    let above = at(4.0, &mut w);
    assert_eq!(above.to_string().lines().count(), 1);
    let Rejection::Reject { place, message } = above else { panic!("not a rejection: {above}") };
    assert_eq!(message, "4 is above 3");
    assert!(place.file.ends_with("language.rs") && place.line > 1, "{place}");
    assert_eq!(place.statement, r#"reject!("{x} is above {limit}")"#);

    let Rejection::Domain { place, error } = at(0.5, &mut w) else { panic!("in the domain") };
    assert_eq!(place.statement, "let value = f.try_at([x, x, x])?[1]");
    assert_eq!(error.to_string(), "a must be above 1, got 0.5");

    let source = std::fs::read_to_string(concat!(env!("CARGO_MANIFEST_DIR"), "/tests/language.rs"));
    let source = source.unwrap();
    let line = source.lines().nth(place.line as usize - 1).unwrap();
    assert_eq!(line.trim(), format!("{};", place.statement));
}

/// A coordinate that nothing reads would have a flat density: the run stops instead.
#[test]
fn the_number_of_unknowns_is_fixed() {
    ppl::model! {
        fn changing(limit: f64) {
            let x ~ Normal(0.0, 1.0);
            if x > limit {
                let extra ~ Normal(x, 1.0);
                factor(-extra.square());
            }
        }
    }
    let model = changing(-10.0);
    assert_eq!(model.dim(), 2);
    let (mut w, mut gradient) = (Workspace::default(), [0.0; 2]);
    assert!(model.log_density(&[0.3, 0.1], &mut w).is_ok());
    let outcomes = [
        model.log_density(&[-11.0, 0.1], &mut w),
        model.gradient(&[-11.0, 0.1], &mut gradient, &mut w),
        model.forward_gradient(&[-11.0, 0.1], &mut gradient),
        model.log_density(&[0.3], &mut w),
    ];
    for outcome in outcomes {
        assert!(matches!(outcome, Err(Rejection::Fatal { .. })), "{outcome:?}");
    }
}

/// `#[predict]` does not run while a density is evaluated.
#[test]
fn predictions_wait_for_finished_draws() {
    use std::sync::atomic::{AtomicUsize, Ordering};

    ppl::model! {
        fn counted(calls: &AtomicUsize) {
            let x ~ Normal(0.0, 1.0);
            #[predict] let calls = calls.fetch_add(1, Ordering::Relaxed) as f64 + 0.0 * x;
        }
    }
    let calls = AtomicUsize::new(0);
    let model = counted(&calls);
    let at_binding = calls.load(Ordering::Relaxed);
    let (mut w, mut gradient) = (Workspace::default(), [0.0]);
    for _ in 0..10 {
        model.log_density(&[0.1], &mut w).unwrap();
        model.gradient(&[0.1], &mut gradient, &mut w).unwrap();
    }
    assert_eq!(calls.load(Ordering::Relaxed), at_binding);
    model.constrain(&[0.1], &mut Xoshiro256PlusPlus::seed_from_u64(0)).unwrap();
    assert_eq!(calls.load(Ordering::Relaxed), at_binding + 1);
}
