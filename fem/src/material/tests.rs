//! Every law through one conformance test, against formulas written anew.

use nalgebra::{Matrix3, SMatrix, SVector};
use num_dual::{DualNum, hessian};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::law::Moduli;
use super::*;

const YOUNG: f64 = 275.0;
const POISSON: f64 = 0.25;

/// ψ⁺ and ψ⁻ as printed (definitions 3.1 and 3.6), over any scalar.
fn printed_energy<T: DualNum<f64> + Copy>(law: ElasticLaw, split: Split, e: [T; 3]) -> [T; 2] {
    let shear = YOUNG / (2.0 * (1.0 + POISSON));
    let bulk = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
    let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
    let trace = e[0] + e[1] + e[2];
    let squares = e.iter().fold(T::zero(), |sum, &x| sum + x * x);
    let deviatoric = (squares - trace * trace / 3.0) * shear;
    let volumetric = trace * trace * (bulk / 2.0);
    match (law, split) {
        (ElasticLaw::Hencky, Split::VolumetricDeviatoric) if trace.re() < 0.0 => {
            [deviatoric, volumetric]
        }
        (ElasticLaw::Hencky, _) => [deviatoric + volumetric, T::zero()],
        (ElasticLaw::NeoHookean, _) => {
            let first_invariant = e.iter().fold(T::zero(), |sum, &x| sum + (x * 2.0).exp());
            let plus = (first_invariant - 3.0 - trace * 2.0) * (shear / 2.0)
                + trace * trace * (lame / 2.0);
            [plus, T::zero()]
        }
    }
}

fn point_material(law: ElasticLaw, split: Split) -> PointMaterial {
    let material = Material {
        law,
        young_mpa: YOUNG,
        poisson: POISSON,
        toughness_n_per_mm: Some(1.0),
        viscosity_mpa_s: 0.0,
        residual_stiffness: 0.0,
    };
    let field = PhaseField {
        model: CrackDensity::At2,
        split,
        length_mm: 1.0,
        quadrature: DamageQuadrature::Auto,
    };
    material.at_point(Some(&field))
}

fn random(rng: &mut impl Rng) -> Matrix3<f64> {
    Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// Displacement gradients at which a law must hold: in general position, in compression and in
/// tension, with two and with three equal stretches, at the origin and next to it.
fn states(rng: &mut impl Rng) -> Vec<(Matrix3<f64>, Matrix3<f64>)> {
    let spin = nalgebra::Rotation3::from_euler_angles(0.3, -0.5, 0.8).into_inner();
    let stretch = |a: f64, b: f64, c: f64| {
        spin * Matrix3::from_diagonal(&[a, b, c].into()) * spin.transpose()
    };
    let contraction = |m: Matrix3<f64>| m - Matrix3::identity() * (1.0 + m.trace() / 3.0);
    let tilt = contraction(random(rng));
    vec![
        (0.25 * contraction(random(rng)), random(rng)),
        (-0.25 * contraction(random(rng)), random(rng)),
        (stretch(-0.2, 0.1, -0.3), random(rng)),
        (stretch(-0.2, -0.2, -0.1), random(rng)),
        (stretch(0.3, 0.3, 0.3), random(rng)),
        (stretch(-0.1, -0.1 + 1e-9, -0.1 - 1e-8), random(rng)),
        (1e-9 * tilt, contraction(random(rng))),
    ]
}

/// Energy, stress and tangent of one law belong together: derivatives in principal strains against
/// dual numbers, Taylor slopes 2 and 3 in F, symmetry of the tangent.
fn assert_material(law: ElasticLaw, split: Split) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let material = point_material(law, split);
    for (state, direction) in states(&mut rng) {
        for g in [1.0, 0.3] {
            assert_taylor(&material, &state, &direction, g);
            assert_symmetric(&material, &state, g);
        }
    }
    for _ in 0..20 {
        let strain: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.4..0.3));
        assert_derivatives(law, split, strain);
    }
}

fn assert_derivatives(law: ElasticLaw, split: Split, strain: [f64; 3]) {
    let parts = law.respond(split, &Moduli::new(YOUNG, POISSON), strain);
    for (k, part) in [parts.plus, parts.minus].iter().enumerate() {
        let (value, gradient, second): (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>) =
            hessian(|e| printed_energy(law, split, [e[0], e[1], e[2]])[k], &SVector::from(strain));
        assert!((part.energy - value).abs() < 1e-12 * YOUNG);
        for i in 0..3 {
            assert!((part.stress[i] - gradient[i]).abs() < 1e-12 * YOUNG, "τ_{i} at {strain:?}");
            for j in 0..3 {
                assert!(
                    (part.tangent[i][j] - second[(i, j)]).abs() < 1e-12 * YOUNG,
                    "D_{i}{j} at {strain:?}"
                );
            }
            let (a, b) = ((i + 1) % 3, (i + 2) % 3);
            let shear = 0.5 * (gradient[a] - gradient[b]) / (strain[a] - strain[b]).tanh();
            assert!((part.shear[i] - shear).abs() < 1e-11 * YOUNG, "G_{a}{b} at {strain:?}");
        }
    }
    // equal stretches: the limit is ½ (D_ii − D_ij)
    let equal = law.respond(split, &Moduli::new(YOUNG, POISSON), [strain[0]; 3]).plus;
    let limit = 0.5 * (equal.tangent[0][0] - equal.tangent[0][1]);
    assert!(equal.shear.iter().all(|s| (s - limit).abs() < 1e-13 * YOUNG));
}

fn energy(material: &PointMaterial, state: &Matrix3<f64>, g: f64) -> f64 {
    material.respond(state).expect("det F > 0").energy(g)
}

/// A_(ij)(kl) = ∂P_ij/∂F_kl from the blocks of unit gradients.
fn moduli(material: &PointMaterial, state: &Matrix3<f64>, g: f64) -> SMatrix<f64, 9, 9> {
    let response = material.respond(state).expect("det F > 0");
    let tangent = response.tangent(g);
    let axes: [[f64; 3]; 3] =
        std::array::from_fn(|j| response.spatial(&std::array::from_fn(|k| f64::from(j == k))));
    SMatrix::from_fn(|p, q| tangent.block(&axes[p % 3], &axes[q % 3])[(p / 3, q / 3)])
}

fn assert_taylor(material: &PointMaterial, state: &Matrix3<f64>, direction: &Matrix3<f64>, g: f64) {
    let response = material.respond(state).expect("det F > 0");
    let work = response.piola(g).dot(direction);
    let flat = SVector::<f64, 9>::from_fn(|p, _| direction[(p / 3, p % 3)]);
    let curvature = flat.dot(&(moduli(material, state, g) * flat));
    let start = energy(material, state, g);
    let remainders = |t: f64| {
        let first = energy(material, &(state + t * direction), g) - start - t * work;
        [first.abs(), (first - 0.5 * t * t * curvature).abs()]
    };
    let (coarse, fine) = (remainders(4e-3), remainders(1e-3));
    for (k, least) in [1.9, 2.9].into_iter().enumerate() {
        let slope = (coarse[k] / fine[k]).log2() / 2.0;
        // the third-order term may vanish by chance, which makes the slope larger, not smaller
        assert!(slope > least, "remainder {} falls with slope {slope} at {state}", k + 1);
    }
}

fn assert_symmetric(material: &PointMaterial, state: &Matrix3<f64>, g: f64) {
    let tangent = moduli(material, state, g);
    assert!((tangent - tangent.transpose()).abs().max() < 1e-14 * tangent.abs().max());
}

#[test]
fn hencky() {
    assert_material(ElasticLaw::Hencky, Split::None);
}

#[test]
fn hencky_volumetric_deviatoric() {
    assert_material(ElasticLaw::Hencky, Split::VolumetricDeviatoric);
}

#[test]
fn neo_hookean() {
    assert_material(ElasticLaw::NeoHookean, Split::None);
}

/// The Kirchhoff stress of the Hencky law against log b by the series
/// log b = 2 (Z + Z³/3 + Z⁵/5 + …), Z = (b − I)(b + I)⁻¹, which needs no eigenvalues.
#[test]
fn spectral_stress_equals_the_series_logarithm() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let material = point_material(ElasticLaw::Hencky, Split::None);
    let m = Moduli::new(YOUNG, POISSON);
    for (state, _) in states(&mut rng) {
        let f = Matrix3::identity() + state;
        let excess = state + state.transpose() + state * state.transpose();
        let z = excess
            * (excess + 2.0 * Matrix3::<f64>::identity())
                .try_inverse()
                .expect("b + I is positive definite");
        let (mut power, mut strain) = (z, Matrix3::zeros());
        for k in 0..400 {
            strain += power / f64::from(2 * k + 1);
            power *= z * z;
        }
        let trace = strain.trace();
        let series =
            2.0 * m.shear * strain + (m.bulk - 2.0 / 3.0 * m.shear) * trace * Matrix3::identity();
        let spectral = material.respond(&state).expect("det F > 0").piola(1.0) * f.transpose();
        assert!(
            (spectral - series).norm() < 1e-13 * series.norm(),
            "{} at {state}",
            (spectral - series).norm()
        );
    }
}

#[test]
fn an_element_turned_inside_out_is_reported() {
    let material = point_material(ElasticLaw::Hencky, Split::None);
    let mirrored = Matrix3::from_diagonal(&[-2.0, 0.0, 0.0].into());
    assert!(material.respond(&mirrored).is_err());
    assert!(material.respond(&Matrix3::from_element(f64::NAN)).is_err());
}
