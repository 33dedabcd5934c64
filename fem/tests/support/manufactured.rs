//! Manufactured solutions: smooth fields, and the loads for which they are exact, computed by dual numbers.
#![allow(dead_code)] // each test or benchmark uses only some of the functions

use fem::{
    Axis, Conditions, DamageQuadrature, Fracture, Material, Order, PhaseField, Problem, Schedule,
    SolverOptions, TetMesh,
};
use num_dual::{Dual, Dual64, DualNum};

use super::block::{block, even};

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;
const TOUGHNESS: f64 = 20.0;
const LENGTH: f64 = 0.4;
const VISCOSITY: f64 = 3.0;
const RESIDUAL: f64 = 0.01;

/// A real or dual number.
trait Number: DualNum<f64> + Copy {}
impl<T: DualNum<f64> + Copy> Number for T {}

/// Manufactured u(x, t), mm, and φ(x, t) on the unit cube; ∂φ/∂n is zero on the faces of the cube.
fn fields<T: Number>(x: [T; 3], t: T, damaged: bool) -> [T; 4] {
    let wave = |a: f64, b: f64, c: f64, phase: f64| {
        (x[0] * a + x[1] * b + x[2] * c + phase).sin() * t * 0.08
    };
    let cosines = x.map(|x| (x * std::f64::consts::PI).cos());
    let damage = (cosines[0] * cosines[1] * cosines[2] * 0.15 + 0.3) * t;
    [
        wave(2.0, 1.0, -1.0, 0.3),
        wave(-1.0, 2.0, 1.5, 0.7),
        wave(1.0, -1.5, 2.0, -0.4),
        if damaged { damage } else { damage * 0.0 },
    ]
}

/// Gradients ∂(u, φ)_i/∂X_j of the manufactured fields.
fn gradients<T: Number>(x: [T; 3], t: T, damaged: bool) -> [[T; 3]; 4] {
    let mut out = [[T::zero(); 3]; 4];
    for j in 0..3 {
        let y = std::array::from_fn(|k| {
            let y = Dual::<T, f64>::from_re(x[k]);
            if k == j { y.derivative() } else { y }
        });
        let values = fields(y, Dual::from_re(t), damaged);
        (0..4).for_each(|i| out[i][j] = values[i].eps);
    }
    out
}

/// Nominal stress g(φ) ∂ψ/∂F and energy density ψ = μ/2 (I₁ − 3 − 2 ln J) + λ/2 (ln J)², MPa.
fn stress<T: Number>(x: [T; 3], t: T, damaged: bool) -> ([[T; 3]; 3], T) {
    let (mu, lambda) = (
        YOUNG / (2.0 * (1.0 + POISSON)),
        YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON)),
    );
    let h = gradients(x, t, damaged);
    let f: [[T; 3]; 3] =
        std::array::from_fn(|i| std::array::from_fn(|j| h[i][j] + f64::from(i == j)));
    let minor = |i: usize, j: usize| {
        let (a, b, c, d) = ((i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3);
        f[a][c] * f[b][d] - f[a][d] * f[b][c]
    };
    let volume = f[0][0] * minor(0, 0) + f[0][1] * minor(0, 1) + f[0][2] * minor(0, 2);
    let log = volume.ln();
    let square = (0..9).fold(T::zero(), |sum, k| sum + f[k / 3][k % 3] * f[k / 3][k % 3]);
    let energy = (square - 3.0 - log * 2.0) * (0.5 * mu) + log * log * (0.5 * lambda);
    let phi = fields(x, t, damaged)[3];
    let g = (phi - 1.0) * (phi - 1.0) * (1.0 - RESIDUAL) + RESIDUAL;
    let g = if damaged { g } else { T::one() };
    let piola = std::array::from_fn(|i| {
        std::array::from_fn(|j| {
            // F⁻ᵀ = cof F / J
            let inverse = minor(i, j) / volume;
            (f[i][j] * mu + inverse * (log * lambda - mu)) * g
        })
    });
    (piola, energy)
}

/// Body force −Div P, N/mm³, and source of the damage equation, MPa.
fn loads(x: [f64; 3], t: f64, damaged: bool) -> ([f64; 3], f64) {
    let mut force = [0.0; 3];
    let mut laplacian = 0.0;
    for j in 0..3 {
        let y = std::array::from_fn(|k| {
            let y = Dual64::from_re(x[k]);
            if k == j { y.derivative() } else { y }
        });
        let (piola, _) = stress(y, Dual64::from_re(t), damaged);
        (0..3).for_each(|i| force[i] -= piola[i][j].eps);
        laplacian += gradients(y, Dual64::from_re(t), damaged)[3][j].eps;
    }
    let phi = fields(x, t, damaged)[3];
    let rate = fields(x.map(Dual64::from_re), Dual64::from_re(t).derivative(), damaged)[3].eps;
    let (_, energy) = stress(x, t, damaged);
    let drive = -2.0 * (1.0 - RESIDUAL) * (1.0 - phi) * energy;
    let crack = TOUGHNESS / (2.0 * LENGTH) * (2.0 * phi - 2.0 * LENGTH * LENGTH * laplacian);
    (force, drive + crack + VISCOSITY * rate)
}

/// Errors in L² and in the H¹ seminorm.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Errors {
    pub(crate) displacement: [f64; 2],
    pub(crate) damage: [f64; 2],
}

/// Returns the errors on the unit cube with n³ cells.
pub(crate) fn errors(n: usize, order: Order, damaged: bool) -> Errors {
    let cells = even(0.0, 1.0, n);
    errors_on(block([&cells, &cells, &cells]), order, damaged)
}

/// Solves for the manufactured fields at t = 1 on a mesh of the unit cube, and returns the errors. The displacement is
/// prescribed on five faces, a traction acts on the sixth face, body force and damage source act inside.
pub(crate) fn errors_on(mesh: TetMesh, order: Order, damaged: bool) -> Errors {
    let material = Material::neo_hookean(YOUNG, POISSON).with_fracture(Fracture {
        toughness_n_per_mm: TOUGHNESS,
        viscosity_mpa_s: VISCOSITY,
        residual_stiffness: RESIDUAL,
    });
    let field = PhaseField { quadrature: DamageQuadrature::Consistent, ..PhaseField::new(LENGTH) };
    let exact = move |x, t| {
        let [a, b, c, _] = fields(x, t, damaged);
        [a, b, c]
    };
    let mut conditions = Conditions::new()
        .body_force(move |x, t| loads(x, t, damaged).0)
        .traction("top", move |x, t| stress(x, t, damaged).0.map(|row| row[2]))
        .first_guess(exact);
    for face in ["left", "right", "front", "back", "bottom"] {
        conditions = conditions.prescribe(face, Axis::ALL, exact);
    }
    if damaged {
        conditions = conditions.damage_source(|x, t| loads(x, t, true).1);
    }
    let problem = Problem::builder(mesh)
        .order(order)
        .materials([material])
        .phase_field(damaged.then_some(field))
        .conditions(conditions)
        .schedule(Schedule::fixed(1.0, 1))
        .options(SolverOptions { tolerance: 1e-9, ..SolverOptions::default() })
        .build()
        .expect("valid input");
    let outcome = problem.run(&mut ());
    assert!(outcome.curve.len() == 1, "{:?}", outcome.end);
    let norm = |f: &dyn Fn(&fem::PointValues) -> f64| {
        problem.integrate(&outcome.fields, f).expect("the fields of the problem").sqrt()
    };
    let value = |p: &fem::PointValues, i: usize| fields(p.position_mm, 1.0, damaged)[i];
    let slope = |p: &fem::PointValues| gradients(p.position_mm, 1.0, damaged);
    Errors {
        displacement: [
            norm(&|p| (0..3).map(|i| (p.displacement_mm[i] - value(p, i)).powi(2)).sum()),
            norm(&|p| {
                let exact = slope(p);
                (0..9)
                    .map(|k| (p.displacement_gradient[k / 3][k % 3] - exact[k / 3][k % 3]).powi(2))
                    .sum()
            }),
        ],
        damage: [
            norm(&|p| (p.damage - value(p, 3)).powi(2)),
            norm(&|p| {
                let exact = slope(p)[3];
                (0..3).map(|j| (p.damage_gradient_per_mm[j] - exact[j]).powi(2)).sum()
            }),
        ],
    }
}

/// Order of convergence from the errors of a coarse and a fine mesh; `ratio` is the ratio of their element sizes.
pub(crate) fn order(coarse: f64, fine: f64, ratio: f64) -> f64 {
    (coarse / fine).ln() / ratio.ln()
}
