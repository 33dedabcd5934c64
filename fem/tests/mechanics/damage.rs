//! Damage models on uniform specimens compared with closed forms, and the snap-back of a bar.

use std::ops::ControlFlow;

use crate::support::column::{layers, snap_back};
use crate::support::{
    HEIGHT, RADIUS, grain, loading, matrix, phase_field, prism, test, with_options,
};
use fem::{
    Axis, Conditions, CrackDensity, CurvePoint, DamageQuadrature, End, Fields, Fracture,
    Irreversibility, Material, Order, PhaseField, Problem, SaintVenantKirchhoff, Schedule, Scheme,
    SolverOptions, Split,
};

const LENGTH: f64 = 0.06;

fn brittle() -> Material {
    matrix().with_fracture(Fracture::new(0.0025))
}

fn area() -> f64 {
    std::f64::consts::PI * RADIUS * RADIUS
}

#[test]
fn at1_is_elastic_up_to_its_threshold_and_then_follows_its_closed_form() {
    // 1 − φ = (ε_c/ε)², σ = E ε (1 − φ)² with ε_c = √(3 Gc/(8 ℓ₀ E))
    let (young, toughness) = (275.0, 0.0025);
    let critical = f64::sqrt(3.0 * toughness / (8.0 * LENGTH * young));
    assert!((critical - 7.5378e-3).abs() < 5e-8 && (young * critical - 2.07289).abs() < 5e-6);
    for irreversibility in [Irreversibility::None, Irreversibility::ActiveSet] {
        let field =
            PhaseField { model: CrackDensity::At1, irreversibility, ..PhaseField::new(LENGTH) };
        let total = HEIGHT * (1.0 - f64::exp(-1.2 * critical));
        let outcome = test(
            prism(1, false),
            Order::Linear,
            vec![brittle()],
            Some(field),
            loading(total, 1.0, 24),
            1e-11,
        )
        .run(&mut ());
        assert_eq!(outcome.curve.len(), 24, "{:?}", outcome.end);
        let (mut sound, mut broken) = (0, 0);
        for point in &outcome.curve {
            let stretch = 1.0 - point.displacement_mm / HEIGHT;
            let strain = -stretch.ln();
            let intact = if strain > critical { (critical / strain).powi(2) } else { 1.0 };
            let stress = point.force_n * stretch / area();
            let exact = young * strain * intact * intact;
            assert!((stress - exact).abs() < 1e-8 * exact, "{stress} instead of {exact} MPa");
            if strain < critical {
                assert_eq!(point.phi_max, 0.0);
                sound += 1;
            } else {
                assert!((point.phi_mean - (1.0 - intact)).abs() < 1e-8);
                broken += 1;
            }
        }
        assert!(sound > 15 && broken > 2);
    }
}

#[test]
fn at1_does_not_damage_quadratic_elements_below_its_threshold() {
    // ∫ N_a dV < 0 at the vertices: with Gauss points, damage at a vertex would decrease the crack energy
    let make = |quadrature| {
        let field = PhaseField { model: CrackDensity::At1, quadrature, ..PhaseField::new(10.0) };
        let (materials, options) = (vec![brittle()], SolverOptions::default());
        let way = loading(0.001, 1.0, 1);
        with_options(prism(2, false), Order::Quadratic, materials, Some(field), way, options)
    };
    let outcome = make(DamageQuadrature::Auto).expect("valid input").run(&mut ());
    let point = outcome.curve[0];
    assert_eq!((point.phi_max, point.fracture_n_mm), (0.0, 0.0), "{point:?}");
    let error = make(DamageQuadrature::Eleven).expect_err("refused").to_string();
    assert!(error.contains("AT1") && error.contains("quadrature = \"vertex\""), "{error}");
}

#[test]
fn all_irreversibility_rules_agree_under_a_growing_load() {
    let run = |irreversibility| {
        let field = PhaseField { irreversibility, ..phase_field(Split::VolumetricDeviatoric) };
        test(
            prism(2, true),
            Order::Linear,
            vec![matrix(), grain()],
            Some(field),
            loading(0.08, 1.0, 8),
            1e-9,
        )
        .run(&mut ())
    };
    let free = run(Irreversibility::None);
    assert!(free.curve.len() == 8 && free.curve[7].phi_max > 0.05, "{:?}", free.end);
    for rule in [Irreversibility::History, Irreversibility::ActiveSet] {
        let irreversible = run(rule);
        for (a, b) in free.curve.iter().zip(&irreversible.curve) {
            assert!((a.force_n - b.force_n).abs() < 1e-6 * a.force_n, "{rule:?}\n{a:?}\n{b:?}");
        }
    }
}

#[test]
fn a_law_given_by_its_energy_completes_a_compression_test() {
    // uniaxial Saint-Venant–Kirchhoff: F = A λ E (1 − λ²)/2
    let law = SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa: 110.0 };
    let material = Material::hyperelastic(law).expect("a law");
    for order in [Order::Linear, Order::Quadratic] {
        let test =
            test(prism(2, false), order, vec![material.clone()], None, loading(0.5, 1.0, 2), 1e-11);
        let outcome = test.run(&mut ());
        let stretch = 1.0 - 0.5 / HEIGHT;
        let exact = area() * stretch * 275.0 * 0.5 * (1.0 - stretch * stretch);
        let force = outcome.curve[1].force_n;
        assert!((force - exact).abs() < 1e-9 * exact, "{order:?}: {force} instead of {exact} N");
    }
}

/// Closed form of the column: displacement (mm), force (N) and crack energy (N mm) for a strain ε of the weak layer.
fn column_state(model: CrackDensity, strain: f64) -> [f64; 3] {
    let (young, resistance) = (100.0, 0.1 / 1.0);
    let drive = young * strain * strain;
    let (phi, crack) = match model {
        CrackDensity::At2 => {
            let phi = drive / (drive + resistance);
            (phi, 0.5 * resistance * phi * phi)
        }
        CrackDensity::At1 => {
            let phi = f64::max(0.0, 1.0 - 0.375 * resistance / drive);
            (phi, 0.375 * resistance * phi)
        }
    };
    // the nominal stress E g ε e^ε is equal in both layers
    let force = young * (1.0 - phi).powi(2) * strain * strain.exp();
    let (mut low, mut high) = (0.0, 1.0);
    for _ in 0..100 {
        let middle: f64 = 0.5 * (low + high);
        if young * middle * middle.exp() < force { low = middle } else { high = middle }
    }
    let displacement = 0.5 * (1.0 - (-strain).exp()) + 10.0 * (1.0 - (-low).exp());
    [displacement, force, 0.5 * crack]
}

#[test]
fn the_arc_length_follows_the_snap_back_of_a_bar_with_a_weak_layer() {
    for model in [CrackDensity::At2, CrackDensity::At1] {
        let outcome = snap_back(model).run(&mut ());
        assert!(matches!(outcome.end, End::BelowPeak), "{model:?}: {:?}", outcome.end);
        let largest = |value: &dyn Fn(&CurvePoint) -> f64| {
            outcome.curve.iter().map(value).fold(0.0, f64::max)
        };
        let last = *outcome.curve.last().expect("points");
        let back = last.displacement_mm / largest(&|p| p.displacement_mm);
        assert!(
            back < 0.7,
            "{model:?}: the platen moved back to {back} of its largest displacement"
        );
        let mut damaged = 0;
        for point in outcome.curve.iter().filter(|p| p.phi_max > 1e-3) {
            // compute the strain of the weak layer from its crack energy, by bisection
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..100 {
                let middle = 0.5 * (low + high);
                let crack = column_state(model, middle)[2];
                if crack < point.fracture_n_mm { low = middle } else { high = middle }
            }
            let [displacement, force, _] = column_state(model, low);
            assert!(
                (point.displacement_mm - displacement).abs() < 1e-6 * displacement
                    && (point.force_n - force).abs() < 1e-6 * force,
                "{model:?}: {point:?} instead of {force} N at {displacement} mm"
            );
            damaged += 1;
        }
        assert!(damaged > 10, "{damaged} points on the softening branch");
        // the work minus the elastic energy must equal the crack energy
        let released = last.work_n_mm - last.elastic_n_mm;
        assert!((released - last.fracture_n_mm).abs() < 0.02 * last.fracture_n_mm, "{last:?}");
    }
}

/// A uniform specimen is loaded, unloaded, and loaded further; AT2 without viscosity.
#[test]
fn damage_under_unloading_follows_the_irreversibility_rule() {
    // φ = E ε²/(E ε² + Gc/ℓ₀) with the current strain (reversible), or with the largest strain so far (irreversible)
    let critical = f64::sqrt(0.0025 / (3.0 * LENGTH * 275.0));
    let shortening = move |fraction: f64| HEIGHT * (1.0 - f64::exp(-fraction * critical));
    // thirty equal time steps: load to 1.2 ε_c, unload to 0.2 ε_c, load to 1.4 ε_c
    let path = move |t: f64| match t {
        t if t < 10.0 => shortening(0.12 * t),
        t if t < 20.0 => shortening(1.2 - 0.1 * (t - 10.0)),
        t => shortening(0.2 + 0.12 * (t - 20.0)),
    };
    for rule in [Irreversibility::None, Irreversibility::History, Irreversibility::ActiveSet] {
        let conditions = Conditions::new()
            .fix("bottom", [Axis::Z])
            .prescribe("top", [Axis::Z], move |_, t| [0.0, 0.0, -path(t)])
            .remove_rigid_motions()
            .measure("top", [0.0, 0.0, -1.0]);
        let schedule = Schedule::fixed(30.0, 30);
        let field = PhaseField { irreversibility: rule, ..PhaseField::new(LENGTH) };
        let options = SolverOptions { tolerance: 1e-11, ..SolverOptions::default() };
        let mesh = prism(1, false);
        let problem = Problem::builder(mesh)
            .materials([brittle()])
            .phase_field(field)
            .conditions(conditions)
            .schedule(schedule)
            .options(options)
            .build()
            .expect("valid input");
        let outcome = problem.run(&mut ());
        assert_eq!(outcome.curve.len(), 30, "{rule:?}: {:?}", outcome.end);
        let mut largest = 0.0f64;
        for point in &outcome.curve {
            let stretch = 1.0 - path(point.time_s) / HEIGHT;
            let strain = -stretch.ln();
            largest = largest.max(strain);
            let drive =
                if rule == Irreversibility::None { strain } else { largest }.powi(2) * 275.0;
            let phi = drive / (drive + 0.0025 / LENGTH);
            let force = area() * (1.0 - phi).powi(2) * 275.0 * strain / stretch;
            assert!((point.phi_mean - phi).abs() < 1e-8, "{rule:?}: {point:?} with φ = {phi}");
            assert!((point.force_n - force).abs() < 1e-7 * force, "{rule:?}: {point:?}, {force} N");
        }
    }
}

/// Damage and crack energy in an unloaded bar that is broken at its lower end. By symmetry, the crack energy of the bar
/// is half the energy of a crack.
///
/// AT1: φ = (1 − z/2ℓ₀)² up to z = 2ℓ₀, and 0 beyond; the active set must converge to this free boundary. AT2 on a bar of
/// length L: φ = cosh((L − z)/ℓ₀)/cosh(L/ℓ₀), with the energy Gc/2 tanh(L/ℓ₀).
#[test]
fn the_damage_around_a_crack_has_its_closed_form() {
    let (length, toughness, bar) = (0.5, 0.1, 2.0);
    let profile = |model, z: f64| match model {
        CrackDensity::At1 => f64::max(0.0, 1.0 - 0.5 * z / length).powi(2),
        CrackDensity::At2 => ((bar - z) / length).cosh() / (bar / length).cosh(),
    };
    for (model, cells) in [
        (CrackDensity::At1, 32),
        (CrackDensity::At1, 64),
        (CrackDensity::At2, 32),
        (CrackDensity::At2, 64),
    ] {
        let size = bar / f64::from(cells);
        let levels: Vec<f64> = (0..=cells).map(|k| size * f64::from(k)).collect();
        let mesh = layers(&levels);
        let nodes = mesh.nodes.clone();
        let material = Material::hencky(100.0, 0.2).with_fracture(Fracture::new(toughness));
        let field = PhaseField { model, ..PhaseField::new(length) };
        let conditions = Conditions::new()
            .fix("bottom", [Axis::X, Axis::Y, Axis::Z])
            .prescribe_damage("bottom", |_, _| 1.0);
        let schedule = Schedule::fixed(1.0, 1);
        let outcome = Problem::builder(mesh)
            .materials([material])
            .phase_field(field)
            .conditions(conditions)
            .schedule(schedule)
            .build()
            .expect("valid input")
            .run(&mut ());
        assert!(matches!(outcome.end, End::Displacement), "{model:?} {cells}: {:?}", outcome.end);
        let fraction = size / length;
        for (x, phi) in nodes.iter().zip(&outcome.fields.damage) {
            let exact = profile(model, x[2]);
            assert!(
                (phi - exact).abs() < 0.15 * fraction * fraction,
                "{model:?} at {x:?}: {phi}, {exact}"
            );
            if model == CrackDensity::At1 && x[2] > 2.0 * length + size {
                assert_eq!(*phi, 0.0, "the damage extends to {x:?}");
            }
        }
        let exact = match model {
            CrackDensity::At1 => 0.5 * toughness,
            CrackDensity::At2 => 0.5 * toughness * (bar / length).tanh(),
        };
        let energy = outcome.curve[0].fracture_n_mm;
        assert!(
            energy > exact && energy - exact < 0.2 * fraction * fraction * exact,
            "{energy}, {exact}"
        );
    }
}

/// The work of prescribed damage equals the crack energy. For AT2 the energy is quadratic in the prescribed value s, so
/// that the trapezoid rule is exact; for AT1 the energy is proportional to s^(3/2).
#[test]
fn the_work_of_prescribed_damage_is_the_crack_energy() {
    let levels: Vec<f64> = (0..=32).map(|k| f64::from(k) / 16.0).collect();
    for (model, steps, tolerance) in
        [(CrackDensity::At2, 1, 1e-7), (CrackDensity::At2, 5, 1e-7), (CrackDensity::At1, 40, 2e-3)]
    {
        let material = Material::hencky(100.0, 0.2).with_fracture(Fracture::new(0.1));
        let conditions = Conditions::new()
            .fix("bottom", [Axis::X, Axis::Y, Axis::Z])
            .prescribe_damage("bottom", |_, t| t);
        let outcome = Problem::builder(layers(&levels))
            .materials([material])
            .phase_field(PhaseField { model, ..PhaseField::new(0.5) })
            .conditions(conditions)
            .schedule(Schedule::fixed(1.0, steps))
            .build()
            .expect("valid input")
            .run(&mut ());
        let point = outcome.curve.last().expect("points");
        let error = point.balance_n_mm() / point.fracture_n_mm;
        assert!(error.abs() < tolerance, "{model:?} {steps}: {error} of {point:?}");
    }
}

/// Beyond the peak of a composite, damage never decreases and never exceeds 1, and alternate minimisation gives the same
/// force as Newton's method.
#[test]
fn bounds_of_damage_hold_in_a_composite_beyond_its_peak() {
    let run = |scheme| {
        let field = PhaseField {
            model: CrackDensity::At1,
            irreversibility: Irreversibility::ActiveSet,
            ..PhaseField::new(0.5)
        };
        let options = SolverOptions { scheme, ..SolverOptions::default() };
        let mut loading = loading(0.25, 1.0, 25);
        loading.schedule.stop_below_peak = Some(0.3);
        let test = with_options(
            prism(3, true),
            Order::Linear,
            vec![matrix(), grain()],
            Some(field),
            loading,
            options,
        )
        .expect("valid input");
        let mut before: Vec<f64> = Vec::new();
        let outcome = test.run(&mut |_: &CurvePoint, fields: &Fields| {
            let healed = fields.damage.iter().zip(&before).any(|(now, then)| now < then);
            assert!(!healed && fields.damage.iter().all(|phi| (0.0..=1.0).contains(phi)));
            before.clone_from(&fields.damage);
            ControlFlow::Continue(())
        });
        assert!(!matches!(outcome.end, End::Failed(_)), "{:?}", outcome.end);
        outcome
    };
    let newton = run(Scheme::Monolithic);
    let alternate = run(Scheme::Alternate);
    assert_eq!(newton.effort.cuts, 0, "{:?}", newton.effort);
    assert_eq!(newton.curve.len(), alternate.curve.len());
    for (a, b) in newton.curve.iter().zip(&alternate.curve) {
        assert!((a.force_n - b.force_n).abs() < 1e-5 * a.force_n, "{a:?}\n{b:?}");
    }
}
