//! Runs as a whole: balance of energy, similarity, ends, rescues, and what is refused.

mod support;

use std::ops::ControlFlow;

use fem::{
    CompressionTest, CurvePoint, DamageQuadrature, ElasticLaw, End, Fields, LinearScheme, Loading,
    Material, Order, Outcome, PhaseField, Scheme, SolverOptions, Split, Stepping, TetMesh,
};
use support::{grain, loading, matrix, peak, phase_field, prism, test};

fn composite(displacement: f64, steps: u32, materials: Vec<Material>) -> Outcome {
    test(
        prism(3, true),
        Order::Linear,
        materials,
        Some(phase_field(Split::None)),
        loading(displacement, 1.0, steps),
        1e-9,
    )
    .run(&mut ())
}

#[test]
fn the_defect_of_the_energy_balance_halves_with_the_step() {
    let defects = [160, 320, 640].map(|steps| {
        let outcome = composite(0.1, steps, vec![matrix(), grain()]);
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let last = outcome.curve.last().expect("points");
        assert!(
            last.fracture_n_mm + last.viscous_n_mm > 0.1 * last.work_n_mm,
            "damage matters in this test: {last:?}"
        );
        assert!(last.balance_n_mm().abs() < 0.1 * last.work_n_mm, "{last:?}");
        last.balance_n_mm()
    });
    for pair in defects.windows(2) {
        let ratio = pair[0] / pair[1];
        assert!((1.8..2.2).contains(&ratio), "defects {defects:?} N mm");
    }
}

#[test]
fn forces_scale_with_the_parameters() {
    // definitions 3.3: E of both phases, Gc and ξ times s give s times the force
    let s = 1.7;
    let scale = |m: Material| Material {
        young_mpa: s * m.young_mpa,
        toughness_n_per_mm: m.toughness_n_per_mm.map(|gc| s * gc),
        viscosity_mpa_s: s * m.viscosity_mpa_s,
        ..m
    };
    let base = composite(0.2, 20, vec![matrix(), grain()]);
    let scaled = composite(0.2, 20, vec![scale(matrix()), scale(grain())]);
    assert_eq!(base.curve.len(), 20);
    for (a, b) in base.curve.iter().zip(&scaled.curve) {
        assert!(
            (s * a.force_n - b.force_n).abs() < 1e-10 * b.force_n,
            "{} and {}",
            s * a.force_n,
            b.force_n
        );
        assert!((a.phi_mean - b.phi_mean).abs() < 1e-10);
    }
}

#[test]
fn quadratic_elements_are_softer_than_linear_ones_and_agree_with_a_finer_mesh() {
    // a richer space has less energy; P1 on 6³ cells has the nodes of P2 on 3³
    let force = |n: usize, order: Order| {
        let outcome =
            test(prism(n, false), order, vec![matrix()], None, loading(0.2, 1.0, 1), 1e-10)
                .run(&mut ());
        outcome.curve[0].force_n
    };
    let exact = force(1, Order::Linear);
    assert!(
        (force(3, Order::Quadratic) - exact).abs() < 1e-8 * exact,
        "a uniform state needs no refinement"
    );
    let composite = |order: Order| {
        test(prism(3, true), order, vec![matrix(), grain()], None, loading(0.2, 1.0, 1), 1e-10)
            .run(&mut ())
            .curve[0]
    };
    let (linear, quadratic) = (composite(Order::Linear), composite(Order::Quadratic));
    assert!(quadratic.elastic_n_mm < 0.98 * linear.elastic_n_mm, "{quadratic:?} {linear:?}");
    assert!(quadratic.force_n > exact, "stiff grains stiffen");
}

#[test]
fn a_region_without_toughness_carries_no_damage() {
    let mesh = prism(3, true);
    let hard = Material { toughness_n_per_mm: None, ..grain() };
    let field = phase_field(Split::None);
    let run = |order, quadrature| {
        let field = PhaseField { quadrature, length_mm: 0.5, ..field };
        let test = test(
            mesh.clone(),
            order,
            vec![matrix(), hard.clone()],
            Some(field),
            loading(0.1, 1.0, 5),
            1e-8,
        );
        (test.run(&mut ()), test)
    };
    for (order, quadrature) in
        [(Order::Linear, DamageQuadrature::Auto), (Order::Quadratic, DamageQuadrature::Vertex)]
    {
        let (outcome, test) = run(order, quadrature);
        assert!(matches!(outcome.end, End::Displacement), "{:?}", outcome.end);
        let mut near_matrix = vec![false; mesh.nodes.len()];
        for (tet, &region) in mesh.tets.iter().zip(&mesh.region_of) {
            if region == 0 {
                tet.iter().for_each(|&n| near_matrix[n as usize] = true);
            }
        }
        for (n, &near) in near_matrix.iter().enumerate() {
            assert_eq!(outcome.fields.damage[n] > 0.0, near, "node {n}");
        }
        assert_eq!(outcome.fields.damage.len(), test.nodes().len());
    }
}

#[test]
fn short_lengths_take_the_vertex_rule_of_either_order() {
    let mesh = prism(2, true);
    let edge = mesh.mean_edge();
    let last = |order, quadrature, length_mm| {
        let field = PhaseField { quadrature, length_mm, ..phase_field(Split::None) };
        let test = test(
            mesh.clone(),
            order,
            vec![matrix(), grain()],
            Some(field),
            loading(0.1, 1.0, 2),
            1e-8,
        );
        test.run(&mut ()).fields.damage
    };
    use DamageQuadrature::{Auto, Consistent, Vertex};
    for (order, limit) in [(Order::Linear, 2.0 * edge), (Order::Quadratic, edge)] {
        assert_eq!(last(order, Auto, 0.9 * limit), last(order, Vertex, 0.9 * limit));
        assert_ne!(last(order, Vertex, 0.9 * limit), last(order, Consistent, 0.9 * limit));
        assert_eq!(last(order, Auto, 1.1 * limit), last(order, Consistent, 1.1 * limit));
    }
}

#[test]
fn alternate_minimisation_reaches_the_same_equilibrium() {
    let mesh = prism(2, true);
    let run = |scheme: Scheme, iterations: u32| {
        let options = SolverOptions { scheme, iterations, ..SolverOptions::default() };
        let field = phase_field(Split::None);
        let materials = vec![matrix(), grain()];
        CompressionTest::new(
            mesh.clone(),
            Order::Linear,
            materials,
            Some(field),
            loading(0.2, 1.0, 20),
            options,
        )
        .expect("valid input")
        .run(&mut ())
    };
    let newton = run(Scheme::Monolithic, 30);
    let alternate = run(Scheme::Alternate, 30);
    // with three iterations Newton fails in places: alternate minimisation or shorter steps must help
    let rescued = run(Scheme::Monolithic, 3);
    assert!(rescued.effort.rescues > 0, "{:?}", rescued.effort);
    assert_eq!((newton.effort.rescues, newton.effort.cuts), (0, 0));
    for outcome in [&alternate, &rescued] {
        assert_eq!(outcome.curve.len(), 20, "{:?}", outcome.end);
        for (a, b) in newton.curve.iter().zip(&outcome.curve) {
            // where steps were cut, the time rule differs a little
            let tolerance = if outcome.effort.cuts > 0 { 2e-2 } else { 1e-6 };
            assert!(
                (a.force_n - b.force_n).abs() < tolerance * a.force_n,
                "{a:?}\n{b:?}\n{:?}",
                outcome.effort
            );
        }
    }
}

#[test]
fn steps_that_fail_are_cut_and_land_on_the_points_asked_for() {
    // one alternation is never enough to rescue, few iterations often fail: only shorter steps help
    let options = SolverOptions { iterations: 4, alternations: 1, ..SolverOptions::default() };
    let test = CompressionTest::new(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.12, 1.0, 2),
        options,
    )
    .expect("valid input");
    let outcome = test.run(&mut ());
    assert!(outcome.effort.cuts > 0, "{:?}", outcome.effort);
    let displacements: Vec<f64> = outcome.curve.iter().map(|p| p.displacement_mm).collect();
    assert_eq!(displacements, [0.06, 0.12], "{:?}", outcome.end);
}

#[test]
fn adaptive_steps_find_the_peak_and_stop_below_it() {
    let adaptive = Loading {
        stepping: Stepping::adaptive(),
        stop_below_peak: Some(0.1),
        ..loading(0.3, 1.5, 1)
    };
    let make = |loading| {
        test(
            prism(2, true),
            Order::Linear,
            vec![matrix(), grain()],
            Some(phase_field(Split::None)),
            loading,
            1e-8,
        )
    };
    let outcome = make(adaptive).run(&mut ());
    assert!(matches!(outcome.end, End::BelowPeak), "{:?}", outcome.end);
    let last = outcome.curve.last().expect("points");
    let highest = outcome.curve.iter().map(|p| p.force_n).fold(0.0, f64::max);
    assert!(
        last.force_n < 0.9 * highest
            && outcome.curve[outcome.curve.len() - 2].force_n >= 0.9 * highest
    );
    assert!(
        outcome.curve[1].displacement_mm - outcome.curve[0].displacement_mm
            > outcome.curve[0].displacement_mm,
        "steps grow"
    );
    let fixed = make(loading(0.3, 1.5, 400)).run(&mut ());
    let (fine, coarse) = (peak(&fixed), highest);
    assert!((coarse - fine.1).abs() < 0.02 * fine.1, "{coarse} and {fine:?}");
}

#[test]
fn multigrid_follows_the_factor_past_the_peak() {
    for order in [Order::Linear, Order::Quadratic] {
        let [direct, multigrid] = [LinearScheme::Direct, LinearScheme::Multigrid].map(|linear| {
            let options = SolverOptions { linear, ..SolverOptions::default() };
            let test = CompressionTest::new(
                prism(3, true),
                order,
                vec![matrix(), grain()],
                Some(phase_field(Split::None)),
                loading(0.3, 1.0, 30),
                options,
            );
            let outcome = test.expect("valid input").run(&mut ());
            assert!(matches!(outcome.end, End::Displacement), "{linear:?}: {:?}", outcome.end);
            outcome
        });
        let (_, highest) = peak(&direct);
        assert!(direct.curve.last().expect("a point").force_n < 0.8 * highest, "past the peak");
        for (a, b) in direct.curve.iter().zip(&multigrid.curve) {
            assert!((a.force_n - b.force_n).abs() < 1e-6 * highest, "{order:?}: {a:?} {b:?}");
        }
    }
}

#[test]
fn a_run_that_cannot_go_on_keeps_its_curve_and_says_why() {
    let options = SolverOptions {
        iterations: 1,
        alternations: 1,
        tolerance: 1e-13,
        ..SolverOptions::default()
    };
    let test = CompressionTest::new(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 4),
        options,
    )
    .expect("valid input");
    let outcome = test.run(&mut ());
    let End::Failed(error) = &outcome.end else { panic!("{:?}", outcome.end) };
    assert!(error.to_string().contains("no equilibrium"), "{error}");
    assert!(outcome.curve.len() < 4);
}

#[test]
fn an_observer_sees_every_point_and_can_interrupt() {
    let test =
        test(prism(1, false), Order::Linear, vec![matrix()], None, loading(0.2, 1.0, 10), 1e-8);
    let mut seen = Vec::new();
    let outcome = test.run(&mut |point: &CurvePoint, fields: &Fields| {
        assert_eq!(fields.displacement.len(), 8);
        seen.push(*point);
        if seen.len() == 3 { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
    });
    assert!(matches!(outcome.end, End::Interrupted));
    assert_eq!(outcome.curve, seen);
}

#[test]
fn other_materials_share_the_discretisation_and_threads_change_nothing() {
    let base = test(
        prism(2, true),
        Order::Linear,
        vec![matrix(), grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 10),
        1e-8,
    );
    let stiffer = Material { young_mpa: 290.0, ..matrix() };
    let other = base.with_materials(vec![stiffer.clone(), grain()]).expect("valid materials");
    let fresh = test(
        prism(2, true),
        Order::Linear,
        vec![stiffer, grain()],
        Some(phase_field(Split::None)),
        loading(0.2, 1.0, 10),
        1e-8,
    );
    let [a, b, c] = std::thread::scope(|scope| {
        let runs = [&other, &other, &fresh].map(|test| scope.spawn(|| test.run(&mut ())));
        runs.map(|run| run.join().expect("a run"))
    });
    assert_eq!(a.curve, b.curve);
    assert_eq!(a.curve, c.curve);
    assert_eq!(a.fields, c.fields);
    let elastic = base
        .with_materials(vec![matrix(), Material { toughness_n_per_mm: None, ..grain() }])
        .expect("valid materials");
    assert!(elastic.unknowns() < base.unknowns(), "the grains' inner nodes lose their damage");
}

/// What a test is made of, to be spoilt.
struct Input {
    mesh: TetMesh,
    materials: Vec<Material>,
    field: PhaseField,
    loading: Loading,
    options: SolverOptions,
}

#[test]
fn fields_go_to_paraview_for_both_orders() {
    let dir = tempfile::tempdir().expect("a directory");
    for (order, cells) in [(Order::Linear, "damage"), (Order::Quadratic, "displacement_mm")] {
        let test = test(prism(1, false), order, vec![matrix()], None, loading(0.2, 1.0, 1), 1e-8);
        let path = dir.path().join("fields.vtu");
        let outcome = test.run(&mut ());
        test.write_vtu(&path, &outcome.fields).expect("written");
        let text = std::fs::read_to_string(&path).expect("a file");
        assert!(text.contains(&format!("NumberOfPoints=\"{}\"", test.nodes().len())), "{order:?}");
        assert!(text.contains(cells));
        let alien = Fields { displacement: vec![[0.0; 3]], damage: vec![0.0] };
        assert!(test.write_vtu(&path, &alien).is_err());
    }
}

fn refusal(spoil: impl FnOnce(&mut Input)) -> String {
    let mut input = Input {
        mesh: prism(2, true),
        materials: vec![matrix(), grain()],
        field: phase_field(Split::None),
        loading: loading(0.2, 1.0, 10),
        options: SolverOptions::default(),
    };
    spoil(&mut input);
    let Input { mesh, materials, field, loading, options } = input;
    CompressionTest::new(mesh, Order::Linear, materials, Some(field), loading, options)
        .expect_err("refused")
        .to_string()
}

#[test]
fn bad_input_is_refused_with_the_entity_and_the_mend() {
    let check = |message: String, parts: &[&str]| {
        for part in parts {
            assert!(message.contains(part), "'{part}' is not in: {message}");
        }
    };
    check(refusal(|i| i.mesh.tets[5].swap(0, 1)), &["tetrahedron 5", "swap"]);
    check(refusal(|i| drop(i.mesh.surfaces.remove("top"))), &["'top'", "it has 'bottom'"]);
    let upside_down = |i: &mut Input| {
        let (top, bottom) = (i.mesh.surfaces["top"].clone(), i.mesh.surfaces["bottom"].clone());
        i.mesh.surfaces = [("top".into(), bottom), ("bottom".into(), top)].into();
    };
    check(refusal(upside_down), &["'top' does not lie above 'bottom'"]);
    let overlapping = |i: &mut Input| {
        let bottom = &i.mesh.surfaces["bottom"];
        let foot: Vec<u32> = bottom.iter().flatten().copied().collect();
        let mut side = i.mesh.boundary_faces();
        side.retain(|face| {
            let on_foot = face.iter().filter(|&n| foot.contains(n)).count();
            (1..3).contains(&on_foot)
        });
        i.mesh.surfaces.insert("top".into(), side);
    };
    check(refusal(overlapping), &["'bottom' and 'top' have nodes in common", "surface names"]);
    check(refusal(|i| i.materials.truncate(1)), &["1 materials for 2 regions", "matrix, grain"]);
    check(
        refusal(|i| i.materials[0].young_mpa = -275.0),
        &["material.matrix", "young_mpa = -275", "positive"],
    );
    check(refusal(|i| i.materials[1].poisson = 0.5), &["material.grain", "poisson = 0.5", "0.49"]);
    check(
        refusal(|i| i.materials[1].toughness_n_per_mm = Some(0.0)),
        &["toughness_n_per_mm = 0", "leave it out"],
    );
    check(refusal(|i| i.materials[0].viscosity_mpa_s = f64::NAN), &["viscosity_mpa_s = NaN"]);
    check(
        refusal(|i| i.materials[0].residual_stiffness = 1.0),
        &["residual_stiffness = 1", "[0, 1)"],
    );
    let unsplittable = |i: &mut Input| {
        i.materials[0].law = ElasticLaw::NeoHookean;
        i.field.split = Split::Spectral;
    };
    check(refusal(unsplittable), &["material.matrix", "no spectral split", "hencky"]);
    check(refusal(|i| i.field.length_mm = 0.0), &["phase_field", "length_mm = 0"]);
    check(
        refusal(|i| i.loading.displacement_mm = -0.2),
        &["test: displacement_mm = -0.2", "positive"],
    );
    check(refusal(|i| i.loading.displacement_mm = 5.0), &["displacement_mm = 5", "height"]);
    check(refusal(|i| i.loading.duration_s = 0.0), &["duration_s = 0"]);
    check(refusal(|i| i.loading.stepping = Stepping::Fixed(0)), &["steps = 0", "adaptive"]);
    check(
        refusal(|i| i.loading.stop_below_peak = Some(1.0)),
        &["stop_below_peak = 1", "0.1 for 10 %"],
    );
    check(refusal(|i| i.options.tolerance = 0.0), &["solver: tolerance = 0"]);
    check(refusal(|i| i.options.iterations = 0), &["solver: iterations = 0"]);
}
