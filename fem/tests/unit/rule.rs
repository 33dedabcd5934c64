//! Sums of the weights of damage points and elastic points.

use super::*;

fn check<const N: usize, T: Tetrahedron<N>>(kind: DamageRule) {
    let rule = Rule::new::<N, T>(kind);
    for row in &rule.mixing {
        assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-14);
        assert!(row.iter().all(|&c| c >= 0.0));
    }
    for (p, point) in rule.damage.iter().enumerate() {
        let seen: f64 =
            rule.elastic_points.iter().zip(&rule.mixing).map(|(q, row)| q.weight * row[p]).sum();
        assert!((seen - point.weight).abs() < 1e-15, "{kind:?} point {p}");
    }
    assert!((rule.damage.iter().map(|p| p.weight).sum::<f64>() - 1.0).abs() < 1e-14);
}

#[test]
fn uniform_states_are_integrated_exactly() {
    for kind in [DamageRule::Vertex, DamageRule::Consistent, DamageRule::Eleven] {
        check::<4, Linear>(kind);
        check::<10, Quadratic>(kind);
    }
}
