//! Geometry of an element at a point: derivatives of the map between barycentric coordinates and space.

use nalgebra::Vector3;

/// Gradients of the barycentric coordinates λ_k at a point of an element, and the volume factor at this point.
#[derive(Clone, Copy, Debug)]
pub struct Geometry<T> {
    /// ∇λ_k for k = 1 … 3, 1/mm.
    pub barycentric: [[T; 3]; 3],
    /// Determinant of the derivative of the map, divided by 6, mm³. For a straight element, this value is the volume of
    /// the element.
    pub volume: T,
}

impl Geometry<f64> {
    /// Computes the geometry of a straight element; its vertices are the first four entries of `x`.
    pub fn straight(x: &[[f64; 3]]) -> Self {
        let edge = |k: usize| Vector3::from(x[k]) - Vector3::from(x[0]);
        Self::along([edge(1), edge(2), edge(3)])
    }

    /// Computes the geometry at a point where the shape functions have the derivatives `slopes`, ∂N_a/∂λ_k. The
    /// columns of the map x = Σ N_a x_a are ∂x/∂λ_k − ∂x/∂λ₀.
    pub fn of<const N: usize>(x: &[[f64; 3]; N], slopes: &[[f64; 4]; N]) -> Self {
        Self::along([1, 2, 3].map(|k| {
            let columns = x.iter().zip(slopes).map(|(x, s)| Vector3::from(*x) * (s[k] - s[0]));
            columns.sum()
        }))
    }

    fn along([a, b, c]: [Vector3<f64>; 3]) -> Self {
        let six_volumes = a.dot(&b.cross(&c));
        let rows = [b.cross(&c), c.cross(&a), a.cross(&b)];
        Self { barycentric: rows.map(|r| (r / six_volumes).into()), volume: six_volumes / 6.0 }
    }
}
