//! Complete compression tests: energy balance, similarity, element orders, quadrature rules, output of fields.

use crate::support::{grain, loading, matrix, phase_field, prism, test};
use fem::{DamageQuadrature, End, Fields, Fracture, Material, Order, Outcome, PhaseField, Split};

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
fn the_error_of_the_energy_balance_is_proportional_to_the_step() {
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
    // similarity: if E of both phases, Gc and ξ are multiplied by s, the force is multiplied by s
    let s = 1.7;
    let scale = |m: Material| {
        let f = m.fracture.expect("the baseline breaks");
        Material::hencky(s * m.elasticity.young_mpa(), m.elasticity.poisson()).with_fracture(
            Fracture {
                toughness_n_per_mm: s * f.toughness_n_per_mm,
                viscosity_mpa_s: s * f.viscosity_mpa_s,
                ..f
            },
        )
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
fn quadratic_elements_are_softer_than_linear_elements_and_agree_with_a_finer_mesh() {
    // a larger function space has less energy; linear elements on 6³ cells have the same nodes as quadratic elements on
    // 3³ cells
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
    let hard = Material { fracture: None, ..grain() };
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
fn small_lengths_select_the_vertex_rule_for_both_orders() {
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
fn fields_of_both_orders_are_written_for_paraview() {
    let dir = tempfile::tempdir().expect("a directory");
    for (order, cells) in [(Order::Linear, "damage"), (Order::Quadratic, "displacement_mm")] {
        let test = test(prism(1, false), order, vec![matrix()], None, loading(0.2, 1.0, 1), 1e-8);
        let path = dir.path().join("fields.vtu");
        let outcome = test.run(&mut ());
        test.write_vtu(&path, &outcome.fields).expect("written");
        let text = std::fs::read_to_string(&path).expect("a file");
        assert!(text.contains(&format!("NumberOfPoints=\"{}\"", test.nodes().len())), "{order:?}");
        assert!(text.contains(cells));
        let (displacement, damage) = (vec![[0.0; 3]], vec![0.0]);
        let alien = Fields { displacement, damage, ..Fields::default() };
        assert!(test.write_vtu(&path, &alien).is_err());
    }
}
