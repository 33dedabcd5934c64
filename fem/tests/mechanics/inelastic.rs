//! Viscoelastic and plastic bodies: closed forms, convergence of Newton's method with damage, derivatives, mixtures.

use fem::{
    Axis, Block, Conditions, End, EnergySet, Fracture, Hardening, Irreversibility, LinearScheme,
    Material, MaterialParameter, Order, Outcome, PhaseField, PlasticRate, Plasticity, Problem,
    PronyTerm, Schedule, SolverOptions, Split, Viscoelasticity, YieldCriterion,
};

use super::support::{grain, phase_field};

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;
/// Bulk and shear modulus, MPa.
const BULK: f64 = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
const SHEAR: f64 = YOUNG / (2.0 * (1.0 + POISSON));

fn series() -> Viscoelasticity {
    Viscoelasticity::shear([
        PronyTerm { fraction: 0.3, time_s: 0.1 },
        PronyTerm { fraction: 0.2, time_s: 1.0 },
    ])
}

fn binder() -> Material {
    Material::hencky(YOUNG, POISSON).with_viscoelasticity(series())
}

fn fracture() -> Fracture {
    Fracture { toughness_n_per_mm: 0.0025, viscosity_mpa_s: 0.3, residual_stiffness: 0.01 }
}

/// A unit block on planes of symmetry whose top has the displacement `travel` (mm) as a function of time. `confined`
/// is true if the lateral strains are zero.
fn pressed(
    order: Order,
    material: &Material,
    field: Option<PhaseField>,
    confined: bool,
    steps: u32,
    travel: impl Fn(f64) -> f64 + Send + Sync + 'static,
) -> Problem {
    let mut conditions = Conditions::new()
        .fix("left", [Axis::X])
        .fix("front", [Axis::Y])
        .fix("bottom", [Axis::Z])
        .prescribe("top", [Axis::Z], move |_, time_s| [0.0, 0.0, travel(time_s)])
        .measure("top", [0.0, 0.0, 1.0]);
    if confined {
        conditions = conditions.fix("right", [Axis::X]).fix("back", [Axis::Y]);
    }
    let options =
        SolverOptions { tolerance: 1e-10, linear_tolerance: 1e-10, ..SolverOptions::default() };
    let mut builder = Problem::builder(Block::new([1.0; 3], [2; 3]).build().expect("a mesh"))
        .order(order)
        .materials([material.clone()])
        .conditions(conditions)
        .options(options)
        .schedule(Schedule::fixed(1.0, steps));
    if let Some(field) = field {
        builder = builder.phase_field(field);
    }
    builder.build().expect("valid input")
}

fn run(problem: &Problem) -> Outcome {
    let outcome = problem.run(&mut ());
    assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
    outcome
}

/// A confined block is compressed in the first, short increment and held: τ = (K + 4/3 G(t)) ε.
#[test]
fn a_held_block_relaxes_by_the_prony_series() {
    let strain = -1e-5f64;
    for order in [Order::Linear, Order::Quadratic] {
        let held = move |time_s: f64| if time_s > 0.0 { strain.exp_m1() } else { 0.0 };
        let outcome = run(&pressed(order, &binder(), None, true, 500, held));
        for point in outcome.curve.iter().skip(1) {
            // the first increment of 0.002 s loads the body at a constant rate
            let relaxed = [0.0, 0.002].map(|d| series().relaxed_shear(point.time_s - d));
            let moduli = relaxed.map(|g| BULK + 4.0 / 3.0 * SHEAR * g);
            let stress = point.force_n * strain.exp() / strain;
            assert!(
                moduli[0] * (1.0 - 1e-4) <= stress && stress <= moduli[1] * (1.0 + 1e-4),
                "{stress} is not in {moduli:?} MPa at {} s",
                point.time_s
            );
        }
    }
}

/// Uniaxial tension of a J2 material without rate dependence: τ = σ_y(α) with ln λ = τ/E + α.
#[test]
fn a_plastic_bar_follows_its_hardening() {
    let hardening = Hardening::Linear { modulus_mpa: 40.0 };
    let law = Plasticity { hardening, ..Plasticity::new(5.0) };
    let material = Material::hencky(YOUNG, POISSON).with_plasticity(law);
    for order in [Order::Linear, Order::Quadratic] {
        let outcome = run(&pressed(order, &material, None, false, 10, |t| 0.3 * t));
        for point in &outcome.curve {
            let axial = (0.3 * point.time_s).ln_1p();
            // τ = 5 + 40 α, ln λ = τ/E + α
            let alpha = (axial - 5.0 / YOUNG) / (1.0 + 40.0 / YOUNG);
            let tau = if alpha > 0.0 { 5.0 + 40.0 * alpha } else { YOUNG * axial };
            // P A₀ = τ / λ
            let exact = tau / axial.exp();
            assert!((point.force_n / exact - 1.0).abs() < 1e-7, "{} and {exact} N", point.force_n);
        }
    }
}

/// Newton's method converges quadratically with linear systems that are solved accurately: few iterations in each step,
/// with damage, and with tangents that are not symmetric.
#[test]
fn newton_takes_few_iterations_with_every_law() {
    let cone = |dilatancy_deg| YieldCriterion::DruckerPrager { friction_deg: 30.0, dilatancy_deg };
    let hardening = Hardening::Linear { modulus_mpa: 30.0 };
    let j2 = Plasticity { hardening, ..Plasticity::new(3.0) };
    let plastic = |law: Plasticity| Material::hencky(YOUNG, POISSON).with_plasticity(law);
    let laws = [
        ("viscoelastic", binder()),
        ("j2", plastic(j2.clone())),
        ("associated cone", plastic(Plasticity { criterion: cone(30.0), ..j2.clone() })),
        ("non-associated cone", plastic(Plasticity { criterion: cone(10.0), ..j2 })),
    ];
    for (name, law) in laws {
        for split in [Split::None, Split::VolumetricDeviatoric] {
            for order in [Order::Linear, Order::Quadratic] {
                let material = law.clone().with_fracture(fracture());
                let field = Some(phase_field(split));
                let outcome = run(&pressed(order, &material, field, false, 8, |t| -0.05 * t));
                let most = outcome.curve.iter().map(|point| point.newton).max();
                assert!(
                    most.is_some_and(|most| most <= 9),
                    "{name}, {split:?}, {order:?}: {most:?} iterations"
                );
            }
        }
    }
}

/// Derivatives of the force with respect to constants of the laws agree with differences of runs.
#[test]
fn derivatives_with_respect_to_constants_agree_with_differences_of_runs() {
    type Law = fn(f64) -> Material;
    let fraction: Law = |x| {
        let mut series = series();
        series.shear[0].fraction = x;
        Material::hencky(YOUNG, POISSON).with_viscoelasticity(series)
    };
    let time: Law = |x| {
        let mut series = series();
        series.shear[1].time_s = x;
        Material::hencky(YOUNG, POISSON).with_viscoelasticity(series)
    };
    fn plastic(yield_mpa: f64, saturation_mpa: f64) -> Material {
        let hardening = Hardening::Voce { saturation_mpa, rate: 5.0 };
        let rate = Some(PlasticRate::JohnsonCook { c: 0.05, reference_per_s: 1e-3 });
        let law = Plasticity { hardening, rate, ..Plasticity::new(yield_mpa) };
        Material::hencky(YOUNG, POISSON).with_plasticity(law)
    }
    let yields: Law = |x| plastic(x, 20.0);
    let saturation: Law = |x| plastic(3.0, x);
    let parameters = [
        ("fraction", 0.3, fraction),
        ("time", 1.0, time),
        ("yield", 3.0, yields),
        ("A", 20.0, saturation),
    ];
    let travel = |t: f64| -0.06 * (3.0 * t).sin();
    for (name, value, law) in parameters {
        for damaged in [false, true] {
            let made = move |x: f64| {
                let material = law(x);
                if damaged { material.with_fracture(fracture()) } else { material }
            };
            let field = damaged.then(|| phase_field(Split::None));
            let at = |x: f64| pressed(Order::Linear, &made(x), field, false, 8, travel);
            let parameter = MaterialParameter::new(name, value, move |x| vec![made(x)]);
            let outcome = run(&at(value).with_sensitivities(vec![parameter]).expect("valid"));
            let reach = 1e-4 * value;
            let [above, below] = [value + reach, value - reach].map(|x| run(&at(x)).curve);
            let exact = above.iter().zip(&below);
            let exact: Vec<f64> =
                exact.map(|(a, b)| (a.force_n - b.force_n) / (2.0 * reach)).collect();
            let size = exact.iter().fold(0.0f64, |most, x| most.max(x.abs()));
            assert!(size > 0.0, "{name}");
            for (row, exact) in outcome.sensitivities.force_n.iter().zip(&exact) {
                let error = (row[0] - exact).abs();
                assert!(error < 1e-5 * size, "{name}, {damaged}: {} and {exact}", row[0]);
            }
        }
    }
}

/// A mixture of a relaxing matrix and grains is the elastic mixture for the modulus at time zero and, at the end, for
/// the modulus after infinite time.
#[test]
fn a_mixture_relaxes_between_two_elastic_mixtures() {
    let strain = -1e-5f64;
    let force = |matrix: Material, steps: u32, duration_s: f64| {
        let mut mesh = Block::new([1.0; 3], [1; 3]).build().expect("a mesh");
        mesh.regions = vec!["matrix".into(), "grain".into()];
        let mixture = fem::Mixture { fraction: 0.4, region: 1, ..fem::Mixture::default() };
        mesh.mixture = Some(vec![mixture; mesh.tets.len()]);
        let elastic = Material { fracture: None, ..grain() };
        let conditions = Conditions::new()
            .fix("left", [Axis::X])
            .fix("front", [Axis::Y])
            .fix("bottom", [Axis::Z])
            .prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, if t > 0.0 { strain } else { 0.0 }])
            .measure("top", [0.0, 0.0, 1.0]);
        let problem = Problem::builder(mesh)
            .materials([matrix, elastic])
            .conditions(conditions)
            .schedule(Schedule::fixed(duration_s, steps))
            .build()
            .expect("valid input");
        run(&problem).curve.last().expect("a point").force_n
    };
    let poisson = |relaxed: f64| {
        let shear = relaxed * SHEAR;
        (3.0 * BULK - 2.0 * shear) / (6.0 * BULK + 2.0 * shear)
    };
    let elastic = |relaxed: f64| {
        let young = 2.0 * relaxed * SHEAR * (1.0 + poisson(relaxed));
        force(Material::hencky(young, poisson(relaxed)), 1, 1.0)
    };
    let [start, end] = [1.0, 0.5].map(elastic);
    let quick = force(binder(), 1, 1e-9);
    assert!((quick / start - 1.0).abs() < 1e-6, "{quick} and {start} N");
    // one long increment, and many increments of the length of the relaxation times
    for (steps, duration_s) in [(1, 1e6), (400, 40.0)] {
        let relaxed = force(binder(), steps, duration_s);
        assert!((relaxed / end - 1.0).abs() < 0.02, "{relaxed} and {end} N in {steps} increments");
    }
}

/// The matrix-free tangent of multigrid gives the same curve as the sparse factor: with and without damage, with and
/// without elements that are partly grain.
#[test]
fn multigrid_and_the_sparse_factor_give_the_same_curve() {
    let law =
        Plasticity { hardening: Hardening::Linear { modulus_mpa: 30.0 }, ..Plasticity::new(3.0) };
    let plastic = Material::hencky(YOUNG, POISSON).with_plasticity(law);
    for (material, mixed) in [(binder(), false), (binder(), true), (plastic, false)] {
        for damaged in [false, true] {
            for order in [Order::Linear, Order::Quadratic] {
                let curve = |linear| {
                    let mut mesh = Block::new([1.0; 3], [3; 3]).build().expect("a mesh");
                    if mixed {
                        mesh.regions = vec!["matrix".into(), "grain".into()];
                        let mixture =
                            fem::Mixture { fraction: 0.4, region: 1, ..fem::Mixture::default() };
                        let of_tet = |tet: usize| {
                            if tet.is_multiple_of(3) { mixture } else { fem::Mixture::default() }
                        };
                        mesh.mixture = Some((0..mesh.tets.len()).map(of_tet).collect());
                    }
                    let mut matrix = material.clone();
                    let elastic = Material { fracture: None, ..grain() };
                    if damaged {
                        matrix = matrix.with_fracture(fracture());
                    }
                    let conditions = Conditions::new()
                        .fix("bottom", [Axis::X, Axis::Y, Axis::Z])
                        .prescribe("top", [Axis::Z], |_, t| [0.0, 0.0, -0.06 * t])
                        .measure("top", [0.0, 0.0, 1.0]);
                    let options =
                        SolverOptions { linear, tolerance: 1e-8, ..SolverOptions::default() };
                    let mut builder = Problem::builder(mesh)
                        .order(order)
                        .conditions(conditions)
                        .options(options)
                        .schedule(Schedule::fixed(1.0, 4));
                    builder = match mixed {
                        true => builder.materials([matrix, elastic]),
                        false => builder.materials([matrix]),
                    };
                    if damaged {
                        builder = builder.phase_field(phase_field(Split::None));
                    }
                    run(&builder.build().expect("valid input")).curve
                };
                let [direct, multigrid] =
                    [LinearScheme::Direct, LinearScheme::Multigrid].map(curve);
                for (a, b) in direct.iter().zip(&multigrid) {
                    let error = (a.force_n / b.force_n - 1.0).abs();
                    assert!(
                        error < 1e-6,
                        "{order:?}, {damaged}: {} and {} N",
                        a.force_n,
                        b.force_n
                    );
                }
            }
        }
    }
}

/// Damage that is also driven by the viscous or the plastic energy, and that degrades this energy.
#[test]
fn energies_that_drive_and_degrade_can_be_chosen() {
    let all = EnergySet { viscous: true, plastic: true };
    let law = Plasticity { hardening: Hardening::None, ..Plasticity::new(3.0) };
    let plastic = Material::hencky(YOUNG, POISSON).with_plasticity(law);
    for material in [binder(), plastic] {
        let material = material.with_fracture(fracture());
        let mean = |drive, degrade| {
            let field = PhaseField { drive, degrade, ..phase_field(Split::None) };
            let field = PhaseField { irreversibility: Irreversibility::None, ..field };
            let outcome =
                run(&pressed(Order::Linear, &material, Some(field), false, 8, |t| -0.05 * t));
            outcome.fields.damage.iter().sum::<f64>() / outcome.fields.damage.len() as f64
        };
        let degrade = EnergySet { viscous: true, plastic: false };
        let elastic = mean(EnergySet::default(), degrade);
        let more = mean(all, degrade);
        assert!(more > 1.02 * elastic, "{more} and {elastic}");
    }
}
