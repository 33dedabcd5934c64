//! Which points carry the elastic terms, which the damage terms, and how the two meet.

use super::quadrature::{QuadraturePoint, eleven, four, fourteen, one};
use super::tetrahedron::Tetrahedron;

/// The choice of damage points, after the automatic one has been settled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DamageRule {
    /// No damage anywhere.
    Absent,
    /// At the nodes.
    Vertex,
    /// At Gauss points.
    Consistent,
    /// At eleven of them in quadratic elements.
    Eleven,
}

/// The integration rule of one element type.
///
/// Elastic point q sees g_q = Σ_p C_qp g(φ_p) over the damage points p, and damage point p is
/// driven by Σ_q w_q C_qp ψ⁺_q, so that both are derivatives of one energy. Σ_p C_qp = 1 and
/// Σ_q w_q C_qp = w_p: a uniform state is integrated exactly.
#[derive(Clone, Debug)]
pub(crate) struct Rule<const N: usize> {
    /// Elastic points.
    pub(crate) points: Vec<QuadraturePoint>,
    /// Damage points.
    pub(crate) damage: Vec<DamagePoint<N>>,
    /// C, by elastic point.
    pub(crate) mixing: Vec<Vec<f64>>,
}

/// Where the local damage terms are evaluated.
#[derive(Clone, Copy, Debug)]
pub(crate) struct DamagePoint<const N: usize> {
    /// N_a there.
    pub(crate) shape: [f64; N],
    /// Share of the volume.
    pub(crate) weight: f64,
}

impl<const N: usize> Rule<N> {
    /// The rule of element type `T`.
    pub(crate) fn new<T: Tetrahedron<N>>(rule: DamageRule) -> Self {
        let quadratic = !T::EDGES.is_empty();
        let elastic = if quadratic { four() } else { one() };
        match (rule, quadratic) {
            (DamageRule::Absent, _) => {
                let mixing = vec![Vec::new(); elastic.len()];
                Self { points: elastic, damage: Vec::new(), mixing }
            }
            (DamageRule::Vertex, false) => {
                Self { points: elastic, damage: nodal(|_| 0.25), mixing: vec![vec![0.25; N]] }
            }
            (DamageRule::Vertex, true) => Self {
                points: elastic,
                // sub-tetrahedra: 4 corners and an octahedron cut along a diagonal (mean of the three)
                damage: nodal(|a| if a < 4 { 1.0 / 32.0 } else { 7.0 / 48.0 }),
                mixing: (0..4)
                    .map(|q| (0..N).map(|a| corner_mean::<N, T>(q, a)).collect())
                    .collect(),
            },
            (DamageRule::Consistent | DamageRule::Eleven, false) => {
                let damage = at_points::<N, T>(&four());
                let mixing = vec![damage.iter().map(|p| p.weight).collect()];
                Self { points: elastic, damage, mixing }
            }
            (DamageRule::Consistent | DamageRule::Eleven, true) => {
                let points = if rule == DamageRule::Eleven { eleven() } else { fourteen() };
                let damage = at_points::<N, T>(&points);
                let mixing = (0..points.len())
                    .map(|q| (0..points.len()).map(|p| f64::from(p == q)).collect())
                    .collect();
                Self { points, damage, mixing }
            }
        }
    }
}

/// ∫ N_a dV / V.
pub(crate) fn mean_values<const N: usize, T: Tetrahedron<N>>() -> [f64; N] {
    let mut mean = [0.0; N];
    for q in four() {
        let values = T::values(q.at);
        (0..N).for_each(|a| mean[a] += q.weight * values[a]);
    }
    mean
}

fn nodal<const N: usize>(weight: impl Fn(usize) -> f64) -> Vec<DamagePoint<N>> {
    (0..N)
        .map(|a| DamagePoint {
            shape: std::array::from_fn(|b| f64::from(a == b)),
            weight: weight(a),
        })
        .collect()
}

fn at_points<const N: usize, T: Tetrahedron<N>>(points: &[QuadraturePoint]) -> Vec<DamagePoint<N>> {
    points.iter().map(|q| DamagePoint { shape: T::values(q.at), weight: q.weight }).collect()
}

/// The weight of node `a` in the mean that Gauss point `q` sees: it stands for the sub-tetrahedron
/// at vertex q and for a quarter of the octahedron, which have the same volume.
fn corner_mean<const N: usize, T: Tetrahedron<N>>(q: usize, a: usize) -> f64 {
    match a.checked_sub(4) {
        None => f64::from(a == q) / 8.0,
        Some(edge) => f64::from(T::EDGES[edge].contains(&q)) / 8.0 + 1.0 / 12.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::element::{Linear, Quadratic};

    fn check<const N: usize, T: Tetrahedron<N>>(kind: DamageRule) {
        let rule = Rule::<N>::new::<T>(kind);
        for row in &rule.mixing {
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!(row.iter().all(|&c| c >= 0.0));
        }
        for (p, point) in rule.damage.iter().enumerate() {
            let seen: f64 =
                rule.points.iter().zip(&rule.mixing).map(|(q, row)| q.weight * row[p]).sum();
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
}
