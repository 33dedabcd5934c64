//! Quadrature rule of an element: elastic points, damage points, and the coupling between them.

use super::quadrature::{QuadraturePoint, eleven, four, fourteen, one};
use super::tetrahedron::{Linear, Quadratic, Tetrahedron};

/// Placement of the quadrature points of the damage terms. The variants are the variants of
/// [`DamageQuadrature`](crate::DamageQuadrature), but `Auto` is replaced by the variant that it selects.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DamageRule {
    /// The problem has no damage.
    Absent,
    /// The damage points are the nodes.
    Vertex,
    /// The damage points are Gauss points with positive weights: four in linear elements, fourteen in quadratic
    /// elements.
    Consistent,
    /// The damage points are four Gauss points in linear elements, and eleven Gauss points in quadratic elements.
    Eleven,
}

/// Terms that viscoelastic and plastic laws add to the tangent of elastic laws.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExtraTerms {
    /// Whether the terms are stored: stresses outside the principal axes, driving stress, antisymmetric moduli.
    pub stored: bool,
    /// Whether the tangent is not symmetric.
    pub unsymmetric: bool,
}

/// Integration rule of one element type.
///
/// Elastic point q has the degradation g_q = Σ_p C_qp g(φ_p), a sum over the damage points p. Damage point p is
/// driven by Σ_q w_q C_qp ψ⁺_q. Both expressions are derivatives of the same energy. Σ_p C_qp = 1 and Σ_q w_q C_qp =
/// w_p, so that a uniform state is integrated exactly.
#[derive(Clone, Debug)]
pub struct Rule {
    /// Number of nodes of the element.
    pub nodes: usize,
    /// Elastic points q with weights w_q.
    pub elastic_points: Vec<ElasticPoint>,
    /// Damage points p with weights w_p.
    pub damage: Vec<DamagePoint>,
    /// Coefficients C_qp of the coupling between elastic points and damage points: one row per elastic point q, one
    /// column per damage point p.
    pub mixing: Vec<Vec<f64>>,
    /// Whether all damage points p have the same weight w_p and the same coefficients C_qp for each elastic point q.
    pub alike: bool,
    /// Terms that the laws of the mesh add to the tangent of elastic laws.
    pub extra: ExtraTerms,
}

/// Quadrature point of the elastic terms.
#[derive(Clone, Debug)]
pub struct ElasticPoint {
    /// Barycentric coordinates λ.
    pub at: [f64; 4],
    /// Weight as a fraction of the element's volume.
    pub weight: f64,
    /// Derivatives ∂N_a/∂λ_k − ∂N_a/∂λ₀ of the shape functions for k = 1 … 3, one entry per node a.
    pub slopes: Vec<[f64; 3]>,
}

/// Quadrature point of the local damage terms.
#[derive(Clone, Debug)]
pub struct DamagePoint {
    /// Values N_a of the shape functions at the point.
    pub shape: Vec<f64>,
    /// Weight as a fraction of the element's volume.
    pub weight: f64,
}

impl Rule {
    /// Creates the quadrature rule of element type `T`.
    pub fn new<const N: usize, T: Tetrahedron<N>>(rule: DamageRule) -> Self {
        let quadratic = !T::EDGES.is_empty();
        let mut elastic = if quadratic { four() } else { one() };
        let (damage, mixing) = match (rule, quadratic) {
            (DamageRule::Absent, _) => (Vec::new(), vec![Vec::new(); elastic.len()]),
            (DamageRule::Vertex, false) => (nodal::<N>(|_| 0.25), vec![vec![0.25; N]]),
            (DamageRule::Vertex, true) => (
                // each weight is the share of a node in eight sub-tetrahedra: four at the vertices, and four into which
                // a diagonal divides the inner octahedron (mean over the three diagonals)
                nodal::<N>(|a| if a < 4 { 1.0 / 32.0 } else { 7.0 / 48.0 }),
                (0..4).map(|q| (0..N).map(|a| corner_mean::<N, T>(q, a)).collect()).collect(),
            ),
            (DamageRule::Consistent | DamageRule::Eleven, false) => {
                let damage = at_points::<N, T>(&four());
                let mixing = vec![damage.iter().map(|p| p.weight).collect()];
                (damage, mixing)
            }
            (DamageRule::Consistent | DamageRule::Eleven, true) => {
                elastic = if rule == DamageRule::Eleven { eleven() } else { fourteen() };
                let unit_row = |q| (0..elastic.len()).map(|p| f64::from(p == q)).collect();
                (at_points::<N, T>(&elastic), (0..elastic.len()).map(unit_row).collect())
            }
        };
        let elastic_points = elastic
            .into_iter()
            .map(|QuadraturePoint { at, weight }| {
                let slopes = T::slopes(at).map(|d| [d[1] - d[0], d[2] - d[0], d[3] - d[0]]);
                ElasticPoint { at, weight, slopes: slopes.to_vec() }
            })
            .collect();
        let alike = damage.windows(2).all(|p| p[0].weight == p[1].weight)
            && mixing.iter().all(|row: &Vec<f64>| row.windows(2).all(|c| c[0] == c[1]));
        let extra = ExtraTerms::default();
        Self { nodes: N, elastic_points, damage, mixing, alike, extra }
    }

    /// Returns the quadrature rule for linear elements with the same quadrature points, i.e. with the linear shape
    /// functions of the vertices.
    pub fn linear(&self) -> Self {
        let slopes = Linear::slopes([0.25; 4]).map(|d| [d[1] - d[0], d[2] - d[0], d[3] - d[0]]);
        let mut rule = self.clone();
        rule.nodes = 4;
        rule.elastic_points.iter_mut().for_each(|point| point.slopes = slopes.to_vec());
        for point in &mut rule.damage {
            // the linear shape function of a vertex equals its quadratic shape function plus half of the quadratic
            // shape functions of the nodes on the edges at this vertex
            for (edge, ends) in Quadratic::EDGES.iter().enumerate().take(self.nodes - 4) {
                ends.iter().for_each(|&end| point.shape[end] += 0.5 * point.shape[4 + edge]);
            }
            point.shape.truncate(4);
        }
        rule
    }
}

/// Returns the mean values ∫ N_a dV / V of the shape functions.
pub(super) fn mean_values<const N: usize, T: Tetrahedron<N>>() -> [f64; N] {
    let mut mean = [0.0; N];
    for q in four() {
        let values = T::values(q.at);
        (0..N).for_each(|a| mean[a] += q.weight * values[a]);
    }
    mean
}

/// Returns one damage point at each node.
fn nodal<const N: usize>(weight: impl Fn(usize) -> f64) -> Vec<DamagePoint> {
    let unit = |a| (0..N).map(|b| f64::from(a == b)).collect();
    (0..N).map(|a| DamagePoint { shape: unit(a), weight: weight(a) }).collect()
}

/// Returns one damage point at each quadrature point.
fn at_points<const N: usize, T: Tetrahedron<N>>(points: &[QuadraturePoint]) -> Vec<DamagePoint> {
    let point =
        |q: &QuadraturePoint| DamagePoint { shape: T::values(q.at).to_vec(), weight: q.weight };
    points.iter().map(point).collect()
}

/// Returns the weight of node `a` in the mean value at Gauss point `q`. The Gauss point represents the sub-tetrahedron
/// at vertex q and a quarter of the inner octahedron, which have the same volume.
fn corner_mean<const N: usize, T: Tetrahedron<N>>(q: usize, a: usize) -> f64 {
    match a.checked_sub(4) {
        None => f64::from(a == q) / 8.0,
        Some(edge) => f64::from(T::EDGES[edge].contains(&q)) / 8.0 + 1.0 / 12.0,
    }
}

#[cfg(test)]
#[path = "../../tests/unit/rule.rs"]
mod tests;
