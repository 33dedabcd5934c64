//! Material at a point for the tests of laws: deformation, response, and the comparison of a tangent with differences.

use nalgebra::{Matrix3, Rotation3, SMatrix, SVector};

use crate::material::point::PointMaterial;
use crate::material::principal::{Inverted, Principal};
use crate::material::response::Response;
use crate::material::tangent::PointTangent;

/// Deformation and response of a material for a given displacement gradient and degradation g.
#[derive(Clone, Debug)]
pub(in crate::material) struct Deformed {
    pub(in crate::material) principal: Principal<f64>,
    pub(in crate::material) response: Response<f64>,
    pub(in crate::material) state: Vec<f64>,
}

impl Deformed {
    /// Deforms the material in one increment of one second from the state zero.
    pub(in crate::material) fn new(
        material: &PointMaterial,
        gradient: &Matrix3<f64>,
        g: f64,
    ) -> Result<Self, Inverted> {
        let rest = vec![0.0; material.law().state_len()];
        Self::from_state(material, gradient, g, 1.0, &rest)
    }

    /// Deforms the material in one increment of `dt` seconds from the state `old`.
    pub(in crate::material) fn from_state(
        material: &PointMaterial,
        gradient: &Matrix3<f64>,
        g: f64,
        dt: f64,
        old: &[f64],
    ) -> Result<Self, Inverted> {
        let (principal, response, state) = material.increment(&rows(gradient), g, dt, old);
        if principal.sound < 1.0 {
            return Err(Inverted);
        }
        Ok(Self { principal, response, state })
    }

    /// Returns the nominal stress P = ∂ψ/∂F.
    pub(in crate::material) fn piola(&self) -> Matrix3<f64> {
        let Response { stress, oblique, .. } = &self.response;
        let piola = self.principal.piola(stress, Some(&oblique.stress), 1.0);
        Matrix3::from_fn(|i, j| piola[i][j])
    }

    /// Returns A_(ij)(kl) = ∂P_ij/∂F_kl, from the tangent blocks for unit gradients.
    pub(in crate::material) fn moduli(&self) -> SMatrix<f64, 9, 9> {
        let Principal { basis, push, .. } = &self.principal;
        let tangent = PointTangent::new(&self.principal, &self.response, 1.0);
        let mut moduli = SMatrix::zeros();
        for q in 0..9 {
            // δF is the unit matrix with the entry (q / 3, q % 3); h = Qᵀ δF F⁻¹ Q
            let row = |i: usize| std::array::from_fn(|j| basis[q / 3][i] * push[j][q % 3]);
            let d = tangent.increment(&std::array::from_fn(row));
            for p in 0..9 {
                let mut sum = 0.0;
                for i in 0..3 {
                    for j in 0..3 {
                        sum += basis[p / 3][i] * d[i][j] * push[j][p % 3];
                    }
                }
                moduli[(p, q)] = sum;
            }
        }
        moduli
    }
}

fn rows(gradient: &Matrix3<f64>) -> [[f64; 3]; 3] {
    std::array::from_fn(|i| std::array::from_fn(|j| gradient[(i, j)]))
}

/// Start of an increment: degradation, duration in s, and state.
pub(super) struct Increment<'a> {
    pub(super) g: f64,
    pub(super) dt: f64,
    pub(super) old: &'a [f64],
}

/// Step of the displacement gradient in the finite differences that are compared with tangents.
pub(super) const STEP: f64 = 1e-5;
/// With a split of the energy, tangents are compared with finite differences only where the elastic volume change |ln
/// J| exceeds this value.
pub(super) const KINK: f64 = 1e-3;
/// Asserts that the tangent equals central differences of the stress in an increment.
pub(super) fn assert_consistent(
    material: &PointMaterial,
    start: &Increment,
    state: &Matrix3<f64>,
    direction: &Matrix3<f64>,
) {
    let step = STEP;
    let Increment { g, dt, old } = *start;
    let at = |t: f64| {
        Deformed::from_state(material, &(state + t * direction), g, dt, old).expect("det F > 0")
    };
    let difference = (at(step).piola() - at(-step).piola()) / (2.0 * step);
    let flat = SVector::<f64, 9>::from_fn(|p, _| direction[(p / 3, p % 3)]);
    let moduli = at(0.0).moduli();
    let exact = moduli * flat;
    let exact = Matrix3::from_fn(|i, j| exact[3 * i + j]);
    let error = (difference - exact).norm();
    assert!(
        error < 1e-7 * moduli.norm(),
        "the tangent differs from the difference quotient by {error:e} MPa at {state} with g = {g} after the state {old:?}, for \
         {:?}",
        material.law()
    );
}

/// Returns displacement gradients for the tests of a law, each with a direction for directional derivatives.
pub(in crate::material) fn states() -> [(Matrix3<f64>, Matrix3<f64>); 7] {
    // arbitrary numbers in (−1, 1)
    let scatter =
        |seed: f64| Matrix3::from_fn(|i, j| (seed + 5.3 * i as f64 + 2.9 * j as f64 + 0.7).sin());
    let spin = Rotation3::from_euler_angles(0.3, -0.5, 0.8).into_inner();
    let stretch = |a: f64, b: f64, c: f64| {
        spin * Matrix3::from_diagonal(&[a, b, c].into()) * spin.transpose()
    };
    let contraction = |m: Matrix3<f64>| m - Matrix3::identity() * (1.0 + m.trace() / 3.0);
    [
        (0.25 * contraction(scatter(1.0)), scatter(2.0)),
        (-0.25 * contraction(scatter(3.0)), scatter(4.0)),
        (stretch(-0.2, 0.1, -0.3), scatter(5.0)),
        (stretch(-0.2, -0.2, -0.1), scatter(6.0)),
        (stretch(0.3, 0.3, 0.3), scatter(7.0)),
        (stretch(-0.1, -0.1 + 1e-9, -0.1 - 1e-8), scatter(8.0)),
        (1e-9 * contraction(scatter(9.0)), contraction(scatter(10.0))),
    ]
}
