//! A user-defined law with a state: a Maxwell body with one term in small strain, compared with closed forms.

use fem::material::{LaneLaw, PointLaw};
use fem::{
    Axis, Block, CompressionTest, Conditions, ConstitutiveLaw, ElasticResponse, FemError, Material,
    MaterialParameter, Order, Principal, Problem, Response, Scalar, Schedule, SolverOptions,
    assert_material,
};

/// τ = K tr ε I + 2 μ (e − f α) with the viscous strain α, dα/dt = (e − α)/t₀, for e = dev ε.
///
/// The state is α in the principal axes of the strain, which must not rotate. The strain is assumed constant in an
/// increment, so that relaxation at constant strain is exact.
#[derive(Clone, Copy, Debug)]
struct Maxwell {
    bulk_mpa: f64,
    shear_mpa: f64,
    /// Fraction f of the shear modulus that relaxes.
    fraction: f64,
    /// Relaxation time t₀, s.
    time_s: f64,
}

/// Indices of D_00, D_10, D_11, D_20, D_21, D_22.
const ENTRIES: [(usize, usize); 6] = [(0, 0), (1, 0), (1, 1), (2, 0), (2, 1), (2, 2)];

impl ConstitutiveLaw for Maxwell {
    fn young_and_poisson(&self) -> [f64; 2] {
        let (k, g) = (self.bulk_mpa, self.shear_mpa);
        [9.0 * k * g / (3.0 * k + g), (3.0 * k - 2.0 * g) / (6.0 * k + 2.0 * g)]
    }

    fn state_len(&self) -> usize {
        3
    }

    #[inline(always)]
    fn respond<T: Scalar>(
        &self,
        trial: &Principal<T>,
        g: T,
        dt: T,
        old: &[T],
        new: &mut [T],
    ) -> Response<T> {
        let trace = trial.strains.trace();
        let remaining = (-dt / self.time_s).exp();
        let bulk = g.constant(self.bulk_mpa);
        let volume = [bulk * trace * trace * 0.5, bulk * trace, bulk];
        let mut out = ElasticResponse::volumetric(volume);
        // algorithmic stiffness of the increment: the derivative d(e − f α)/de
        let active = remaining * self.fraction + (1.0 - self.fraction);
        for k in 0..3 {
            let e = trial.strains.log[k] - trace / 3.0;
            let spring = (e - old[k]) * remaining;
            new[k] = e - spring;
            let elastic = e * (1.0 - self.fraction);
            out.stress[k] += (elastic + spring * self.fraction) * (2.0 * self.shear_mpa);
            out.energy += (elastic * e + spring * spring * self.fraction) * self.shear_mpa;
        }
        let shear = active * self.shear_mpa;
        for (entry, (i, j)) in ENTRIES.into_iter().enumerate() {
            out.normal[entry] += shear * if i == j { 4.0 / 3.0 } else { -2.0 / 3.0 };
        }
        for k in 0..3 {
            out.shear[k] = shear * trial.strains.coth[k];
        }
        out.degraded(g)
    }
}

const BODY: Maxwell = Maxwell { bulk_mpa: 180.0, shear_mpa: 110.0, fraction: 0.4, time_s: 0.2 };

/// Returns the diagonal of τ, MPa, after each increment. The increments have the duration `dt` and these axial logarithmic
/// strains; the lateral strains are zero.
fn stresses(material: &Material, strains: impl Iterator<Item = f64>, dt: f64) -> Vec<[f64; 3]> {
    let point = material.at_point(None);
    let laws = [point.law()];
    let law = LaneLaw::new(&laws, 0.0, [point.moduli.bulk, point.moduli.shear], None);
    assert_eq!(law.state_len(), 3);
    let (mut old, mut new) = ([0.0; 3], [0.0; 3]);
    strains
        .map(|strain| {
            let mut h = [[0.0; 3]; 3];
            h[2][2] = strain.exp_m1();
            let trial = Principal::new(&h);
            let response = law.respond::<true>(&trial, 1.0, dt, &old, &mut new);
            old = new;
            // the principal axes of a diagonal deformation gradient are the coordinate axes, in the same order
            response.stress
        })
        .collect()
}

#[test]
fn the_law_passes_the_conformance_test_and_is_equal_in_simd_lanes() {
    assert_material(&Material::with_law(BODY).expect("a law"), None);
}

#[test]
fn a_held_strain_relaxes_exponentially() {
    let material = Material::with_law(BODY).expect("a law");
    let (strain, dt) = (-0.02, 0.05);
    let stress = stresses(&material, (0..20).map(|_| strain), dt);
    for (step, stress) in stress.into_iter().enumerate() {
        let time = dt * (step + 1) as f64;
        let relaxed = 1.0 - BODY.fraction * (1.0 - (-time / BODY.time_s).exp());
        for (axis, tau) in stress.into_iter().enumerate() {
            let deviator = strain * if axis == 2 { 2.0 / 3.0 } else { -1.0 / 3.0 };
            let exact = BODY.bulk_mpa * strain + 2.0 * BODY.shear_mpa * relaxed * deviator;
            assert!((tau - exact).abs() < 1e-12 * BODY.bulk_mpa, "{tau} instead of {exact} MPa");
        }
    }
}

/// At a constant strain rate r (axial strain ε = r t), the axial component of e − α is r t₀ (1 − e^(−t/t₀)) 2/3.
#[test]
fn the_stress_at_a_constant_strain_rate_converges_with_first_order() {
    let material = Material::with_law(BODY).expect("a law");
    let (rate, duration) = (-0.1, 0.3);
    let viscous = 1.0 - (-duration / BODY.time_s).exp();
    let end = 2.0 / 3.0 * rate * duration;
    let spring = 2.0 / 3.0 * rate * BODY.time_s * viscous;
    let deviator = (1.0 - BODY.fraction) * end + BODY.fraction * spring;
    let exact = BODY.bulk_mpa * rate * duration + 2.0 * BODY.shear_mpa * deviator;
    let errors = [50, 100].map(|steps| {
        let dt = duration / f64::from(steps);
        let strains = (1..=steps).map(|step| rate * dt * f64::from(step));
        let stress = stresses(&material, strains, dt);
        (stress.last().expect("a step")[2] - exact).abs() / exact.abs()
    });
    let order = (errors[0] / errors[1]).log2();
    assert!(errors[1] < 2e-3 && (0.9..1.1).contains(&order), "{errors:?}, order {order}");
}

/// Problem on a block without lateral strain. The height of the block changes by `travel`, a function of time, in ten
/// increments of 0.1 s.
fn confined(
    order: Order,
    law: Maxwell,
    travel: impl Fn(f64) -> f64 + Send + Sync + 'static,
) -> Problem {
    let conditions = Conditions::new()
        .fix("left", [Axis::X])
        .fix("right", [Axis::X])
        .fix("front", [Axis::Y])
        .fix("back", [Axis::Y])
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, travel(time_s)])
        .measure("top", [0.0, 0.0, 1.0]);
    Problem::builder(Block::new([1.0; 3], [2; 3]).build().expect("a mesh"))
        .order(order)
        .materials([Material::with_law(law).expect("a law")])
        .conditions(conditions)
        .options(SolverOptions { tolerance: 1e-10, ..SolverOptions::default() })
        .schedule(Schedule::fixed(1.0, STEPS as u32))
        .build()
        .expect("valid input")
}

const STEPS: usize = 10;
/// Logarithmic strain of the block that is held.
const HELD: f64 = -0.02;

/// Problem in which the block is compressed in the first increment and then held at this strain.
fn held(order: Order) -> Problem {
    confined(order, BODY, |time_s| if time_s > 0.0 { HELD.exp_m1() } else { 0.0 })
}

/// Axial Kirchhoff stress of the held block, MPa.
fn relaxed_stress(time_s: f64) -> f64 {
    let relaxed = 1.0 - BODY.fraction * (1.0 - (-time_s / BODY.time_s).exp());
    (BODY.bulk_mpa + 4.0 / 3.0 * BODY.shear_mpa * relaxed) * HELD
}

/// Each increment starts from the state at the end of the previous increment. The nominal stress is τ/λ, the Cauchy
/// stress τ/J.
#[test]
fn a_held_block_relaxes_exponentially() {
    for order in [Order::Linear, Order::Quadratic] {
        let problem = held(order);
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), STEPS, "{:?}", outcome.end);
        for point in &outcome.curve {
            let exact = relaxed_stress(point.time_s) / HELD.exp();
            assert!((point.force_n / exact - 1.0).abs() < 1e-8, "{point:?} instead of {exact} N");
        }
        let exact = relaxed_stress(1.0) / HELD.exp();
        let state = problem.evaluate(&outcome.fields).expect("the fields of the problem");
        for element in state.elements().expect("no element is inverted") {
            let stress = element.stress_mpa[2];
            assert!((stress / exact - 1.0).abs() < 1e-8, "{stress} instead of {exact} MPa");
        }
        let force = state.force_n("top").expect("a surface")[2];
        assert!((force / exact - 1.0).abs() < 1e-8, "{force} instead of {exact} N");
    }
}

#[test]
fn fields_with_the_state_of_another_problem_are_refused() {
    let fields = held(Order::Linear).run(&mut ()).fields;
    let block = Block::new([1.0; 3], [2; 3]).build().expect("a mesh");
    let elastic = CompressionTest::new(0.01, Schedule::fixed(1.0, 1))
        .builder(block)
        .and_then(|test| test.materials([Material::hencky(100.0, 0.3)]).build())
        .expect("valid input");
    let error = elastic.evaluate(&fields).expect_err("refused");
    assert!(matches!(error, FemError::OtherState { expected: 0, .. }), "{error}");
}

/// Name and value of a parameter, and the law as a function of the parameter's value.
type Parameter = (&'static str, f64, fn(f64) -> Maxwell);

const PARAMETERS: [Parameter; 4] = [
    ("bulk", BODY.bulk_mpa, |bulk_mpa| Maxwell { bulk_mpa, ..BODY }),
    ("shear", BODY.shear_mpa, |shear_mpa| Maxwell { shear_mpa, ..BODY }),
    ("fraction", BODY.fraction, |fraction| Maxwell { fraction, ..BODY }),
    ("time", BODY.time_s, |time_s| Maxwell { time_s, ..BODY }),
];

/// Times and derivatives of the force with respect to the parameters.
fn derivatives(problem: &Problem) -> Vec<(f64, Vec<f64>)> {
    let parameters = PARAMETERS.map(|(name, value, law)| {
        let materials = |x| vec![Material::with_law(law(x)).expect("a law")];
        MaterialParameter::new(name, value, materials)
    });
    let outcome = problem.with_sensitivities(parameters.into()).expect("valid").run(&mut ());
    let rows = outcome.sensitivities.force_n;
    assert_eq!(rows.len(), STEPS, "{:?}, {:?}", outcome.end, outcome.sensitivities.lost);
    outcome.curve.iter().map(|point| point.time_s).zip(rows).collect()
}

/// F = (K + 4/3 μ r) ε e^(−ε) with r = 1 − f (1 − e^(−t/t₀)).
#[test]
fn the_force_of_a_held_block_has_the_derivatives_of_the_closed_form() {
    for order in [Order::Linear, Order::Quadratic] {
        for (time_s, row) in derivatives(&held(order)) {
            let decay = (-time_s / BODY.time_s).exp();
            let of_relaxed = 4.0 / 3.0 * BODY.shear_mpa;
            let exact = [
                1.0,
                4.0 / 3.0 * (1.0 - BODY.fraction * (1.0 - decay)),
                -of_relaxed * (1.0 - decay),
                of_relaxed * BODY.fraction * decay * time_s / BODY.time_s.powi(2),
            ];
            for ((found, exact), (name, value, _)) in row.iter().zip(exact).zip(PARAMETERS) {
                let exact = exact * HELD / HELD.exp();
                let error = (found - exact).abs() * value;
                assert!(error < 1e-6 * relaxed_stress(0.0).abs(), "{name}: {found} and {exact}");
            }
        }
    }
}

/// The block is compressed, unloaded and compressed again.
#[test]
fn derivatives_with_a_state_agree_with_differences_of_runs() {
    let travel = |time_s: f64| -0.05 * (4.0 * time_s).sin() - 0.02 * time_s;
    for order in [Order::Linear, Order::Quadratic] {
        let rows = derivatives(&confined(order, BODY, travel));
        for (k, (name, value, law)) in PARAMETERS.into_iter().enumerate() {
            let reach = 1e-4 * value;
            let [above, below] = [value + reach, value - reach]
                .map(|x| confined(order, law(x), travel).run(&mut ()).curve);
            let exact = above.iter().zip(&below);
            let exact: Vec<f64> =
                exact.map(|(a, b)| (a.force_n - b.force_n) / (2.0 * reach)).collect();
            let size = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            assert!(size > 0.0, "{name}");
            for ((_, row), exact) in rows.iter().zip(&exact) {
                let error = (row[k] - exact).abs();
                assert!(error < 1e-5 * size, "{order:?}, {name}: {} and {exact}", row[k]);
            }
        }
    }
}

#[test]
fn too_many_state_values_are_rejected() {
    #[derive(Debug)]
    struct Long;
    impl ConstitutiveLaw for Long {
        fn young_and_poisson(&self) -> [f64; 2] {
            BODY.young_and_poisson()
        }

        fn state_len(&self) -> usize {
            33
        }

        fn respond<T: Scalar>(
            &self,
            trial: &Principal<T>,
            g: T,
            dt: T,
            old: &[T],
            new: &mut [T],
        ) -> Response<T> {
            BODY.respond(trial, g, dt, old, new)
        }
    }
    let error = Material::with_law(Long).expect_err("refused").to_string();
    assert!(error.contains("33 state values"), "{error}");
}
