//! Lagrange shape functions on a tetrahedron, in barycentric coordinates λ₀ … λ₃.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Polynomial order of displacement and damage; written as 1 or 2 in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
#[serde(try_from = "u8", into = "u8")]
#[schemars(extend("enum" = [1, 2]))]
pub enum Order {
    /// P1: linear element with four nodes.
    Linear,
    /// P2: quadratic element with ten nodes, the vertices followed by the midpoints of the edges 01, 12, 20, 03, 13,
    /// 23.
    Quadratic,
}

impl Order {
    /// Returns the distance of neighbouring nodes on an edge, relative to the length of the edge.
    pub(crate) fn node_spacing(self) -> f64 {
        match self {
            Order::Linear => 1.0,
            Order::Quadratic => 0.5,
        }
    }
}

impl From<Order> for u8 {
    fn from(order: Order) -> u8 {
        match order {
            Order::Linear => 1,
            Order::Quadratic => 2,
        }
    }
}

impl TryFrom<u8> for Order {
    type Error = &'static str;

    /// Converts the polynomial order 1 or 2.
    ///
    /// # Errors
    /// Returns the number if the number is neither 1 nor 2.
    fn try_from(order: u8) -> Result<Self, Self::Error> {
        match order {
            1 => Ok(Self::Linear),
            2 => Ok(Self::Quadratic),
            _ => Err("elements are linear or quadratic: write order = 1 or order = 2"),
        }
    }
}

/// Lagrange tetrahedron with `N` nodes: the vertices, then the midpoints of [`EDGES`](Self::EDGES).
pub trait Tetrahedron<const N: usize> {
    /// Edges that have a node at their midpoint, as pairs of vertices.
    const EDGES: &'static [[usize; 2]];

    /// Returns the values N_a(λ) of the shape functions.
    fn values(l: [f64; 4]) -> [f64; N];

    /// Returns the derivatives ∂N_a/∂λ_k of the shape functions; row a, column k.
    fn slopes(l: [f64; 4]) -> [[f64; 4]; N];
}

/// Linear tetrahedron (P1).
pub struct Linear;

/// Quadratic tetrahedron (P2).
pub struct Quadratic;

impl Tetrahedron<4> for Linear {
    const EDGES: &'static [[usize; 2]] = &[];

    fn values(l: [f64; 4]) -> [f64; 4] {
        l
    }

    fn slopes(_: [f64; 4]) -> [[f64; 4]; 4] {
        std::array::from_fn(|a| std::array::from_fn(|k| f64::from(a == k)))
    }
}

impl Tetrahedron<10> for Quadratic {
    const EDGES: &'static [[usize; 2]] = &[[0, 1], [1, 2], [2, 0], [0, 3], [1, 3], [2, 3]];

    fn values(l: [f64; 4]) -> [f64; 10] {
        std::array::from_fn(|a| match a.checked_sub(4) {
            None => l[a] * (2.0 * l[a] - 1.0),
            Some(edge) => {
                let [i, j] = Self::EDGES[edge];
                4.0 * l[i] * l[j]
            }
        })
    }

    fn slopes(l: [f64; 4]) -> [[f64; 4]; 10] {
        std::array::from_fn(|a| {
            let mut slope = [0.0; 4];
            match a.checked_sub(4) {
                None => slope[a] = 4.0 * l[a] - 1.0,
                Some(edge) => {
                    let [i, j] = Self::EDGES[edge];
                    slope[i] = 4.0 * l[j];
                    slope[j] = 4.0 * l[i];
                }
            }
            slope
        })
    }
}

#[cfg(test)]
#[path = "../../tests/unit/tetrahedron.rs"]
mod tests;
