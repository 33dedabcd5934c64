//! Every law through one conformance test, against formulas written anew.

use nalgebra::{Matrix3, SMatrix, SVector};
use num_dual::{DualNum, hessian};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::kinematics::Principal;
use super::law::{Moduli, Part};
use super::*;

pub(super) const YOUNG: f64 = 275.0;
pub(super) const POISSON: f64 = 0.25;

/// The laws as printed (definitions 3.1 and 3.6).
#[derive(Clone, Copy, Debug)]
pub(super) enum Printed {
    Hencky,
    NeoHookean,
}

impl Printed {
    fn fused(self) -> Elasticity {
        match self {
            Printed::Hencky => Elasticity::Hencky { young_mpa: YOUNG, poisson: POISSON },
            Printed::NeoHookean => Elasticity::NeoHookean { young_mpa: YOUNG, poisson: POISSON },
        }
    }

    /// ψ⁺ and ψ⁻ over any scalar.
    pub(super) fn energies<T: DualNum<f64> + Copy>(self, split: Split, e: [T; 3]) -> [T; 2] {
        let shear = YOUNG / (2.0 * (1.0 + POISSON));
        let bulk = YOUNG / (3.0 * (1.0 - 2.0 * POISSON));
        let lame = YOUNG * POISSON / ((1.0 + POISSON) * (1.0 - 2.0 * POISSON));
        let trace = e[0] + e[1] + e[2];
        let squares = |e: [T; 3]| e.iter().fold(T::zero(), |sum, &x| sum + x * x);
        let deviatoric = (squares(e) - trace * trace / 3.0) * shear;
        let volumetric = trace * trace * (bulk / 2.0);
        let positive = |x: T| if x.re() > 0.0 { x } else { T::zero() };
        match (self, split) {
            (Printed::Hencky, Split::None) => [deviatoric + volumetric, T::zero()],
            (Printed::Hencky, Split::VolumetricDeviatoric) if trace.re() < 0.0 => {
                [deviatoric, volumetric]
            }
            (Printed::Hencky, Split::VolumetricDeviatoric) => [deviatoric + volumetric, T::zero()],
            (Printed::Hencky, Split::Spectral) => [1.0, -1.0].map(|sign| {
                let trace = positive(trace * sign);
                trace * trace * (lame / 2.0) + squares(e.map(|x| positive(x * sign))) * shear
            }),
            (Printed::NeoHookean, _) => {
                let first = e.iter().fold(T::zero(), |sum, &x| sum + (x * 2.0).exp());
                let whole =
                    (first - 3.0 - trace * 2.0) * (shear / 2.0) + trace * trace * (lame / 2.0);
                let of_volume = ((trace * (2.0 / 3.0)).exp() - 1.0 - trace * (2.0 / 3.0))
                    * (1.5 * shear)
                    + trace * trace * (lame / 2.0);
                let spared = split == Split::VolumetricDeviatoric && trace.re() < 0.0;
                if spared { [whole - of_volume, of_volume] } else { [whole, T::zero()] }
            }
        }
    }
}

impl HyperelasticLaw for Printed {
    fn energy<T: DualNum<f64> + Copy>(&self, strain: &PrincipalStrain<T>) -> T {
        self.energies(Split::None, strain.log())[0]
    }
}

pub(super) fn damaged(material: Material, split: Split) -> PointMaterial {
    material
        .with_fracture(Fracture::new(1.0))
        .at_point(Some(&PhaseField { split, ..PhaseField::new(1.0) }))
}

pub(super) fn point_material(elasticity: Elasticity, split: Split) -> PointMaterial {
    damaged(Material { elasticity, fracture: None }, split)
}

fn random(rng: &mut impl Rng) -> Matrix3<f64> {
    Matrix3::from_fn(|_, _| rng.random_range(-1.0..1.0))
}

/// Displacement gradients at which a law must hold: in general position, in compression and in
/// tension, with two and with three equal stretches, at the origin and next to it.
pub(super) fn states(rng: &mut impl Rng) -> Vec<(Matrix3<f64>, Matrix3<f64>)> {
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

/// Energy, stress and tangent belong together: Taylor slopes 2 and 3 in F, symmetry of the tangent.
///
/// The spectral split is tested away from its kinks, which the steps must not cross.
fn assert_material(material: &PointMaterial) {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(11);
    let mut states = states(&mut rng);
    if material.damage.is_some_and(|d| d.split == Split::Spectral) {
        states.retain(|(state, _)| {
            let e = Principal::new(state).expect("det F > 0").strain;
            e.into_iter().chain([e.iter().sum()]).all(|x| x.abs() > 0.03)
        });
        assert!(states.len() >= 4);
    }
    for (state, direction) in states {
        for g in [1.0, 0.3] {
            assert_taylor(material, &state, &direction, g);
            assert_symmetric(material, &state, g);
        }
    }
}

/// A fused kernel against the printed energy, differentiated by dual numbers.
fn assert_fused(printed: Printed, split: Split) {
    assert_material(&point_material(printed.fused(), split));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(12);
    for _ in 0..20 {
        let strain: [f64; 3] = std::array::from_fn(|_| rng.random_range(-0.4..0.3));
        assert_derivatives(printed, split, strain);
    }
}

fn assert_derivatives(printed: Printed, split: Split, strain: [f64; 3]) {
    let parts = printed.fused().respond(split, &Moduli::new(YOUNG, POISSON), strain);
    for (k, part) in [parts.plus, parts.minus].iter().enumerate() {
        let (value, gradient, second): (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>) =
            hessian(|e| printed.energies(split, [e[0], e[1], e[2]])[k], &SVector::from(strain));
        let derived = Part {
            energy: value,
            stress: gradient.into(),
            tangent: std::array::from_fn(|i| std::array::from_fn(|j| second[(i, j)])),
            shear: std::array::from_fn(|i| {
                let (a, b) = ((i + 1) % 3, (i + 2) % 3);
                0.5 * (gradient[a] - gradient[b]) / (strain[a] - strain[b]).tanh()
            }),
        };
        assert_same(part, &derived, 1e-11, &strain);
    }
}

/// `shear` is the tolerance of the shear terms, which lose digits when they are formed by division.
fn assert_same(a: &Part, b: &Part, shear: f64, strain: &[f64; 3]) {
    let close = |x: f64, y: f64, tolerance: f64| {
        assert!((x - y).abs() < tolerance * YOUNG, "{x} and {y} at {strain:?}")
    };
    close(a.energy, b.energy, 1e-12);
    for i in 0..3 {
        close(a.stress[i], b.stress[i], 1e-12);
        close(a.shear[i], b.shear[i], shear);
        for j in 0..3 {
            close(a.tangent[i][j], b.tangent[i][j], 1e-12);
        }
    }
}

#[test]
fn laws_given_by_their_energy_equal_the_fused_kernels_at_any_distance_of_strains() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(13);
    let moduli = Moduli::new(YOUNG, POISSON);
    for (printed, split) in [Printed::Hencky, Printed::NeoHookean]
        .into_iter()
        .flat_map(|p| [Split::None, Split::VolumetricDeviatoric].map(|split| (p, split)))
    {
        let law = Elasticity::User(UserLaw::new(printed).expect("a law"));
        for gap in [0.0, 1e-12, 1e-7, 1e-3, 0.03, 0.0999, 0.1001, 0.4] {
            let middle = rng.random_range(-0.3..0.3);
            let strain = [middle + gap, middle, rng.random_range(-0.3..0.3)];
            let own = law.respond(split, &moduli, strain);
            let fused = printed.fused().respond(split, &moduli, strain);
            assert_same(&own.plus, &fused.plus, 1e-12, &strain);
            assert_same(&own.minus, &fused.minus, 1e-12, &strain);
        }
    }
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
    assert_fused(Printed::Hencky, Split::None);
}

#[test]
fn hencky_volumetric_deviatoric() {
    assert_fused(Printed::Hencky, Split::VolumetricDeviatoric);
}

#[test]
fn hencky_spectral() {
    assert_fused(Printed::Hencky, Split::Spectral);
}

#[test]
fn neo_hookean() {
    assert_fused(Printed::NeoHookean, Split::None);
}

#[test]
fn neo_hookean_volumetric_deviatoric() {
    assert_fused(Printed::NeoHookean, Split::VolumetricDeviatoric);
}

#[test]
fn laws_given_by_their_energy() {
    for law in examples() {
        for split in [Split::None, Split::VolumetricDeviatoric] {
            assert_material(&damaged(law.clone(), split));
        }
    }
}

/// Laws with a volumetric term of their own: under pressure damage spares that term and no other.
#[test]
fn the_volumetric_term_of_a_law_is_what_pressure_keeps() {
    let [mooney, ogden, _] = examples();
    for (law, bulk) in [(mooney, 200.0), (ogden, 150.0)] {
        let material = damaged(law, Split::VolumetricDeviatoric);
        for stretches in [[0.8, 1.1, 0.9], [0.7, 0.7, 0.7], [1.2, 1.1, 0.9], [1.0; 3]] {
            let j: f64 = stretches.iter().product();
            let state = Matrix3::from_diagonal(&stretches.map(|s| s - 1.0).into());
            let response = material.respond(&state).expect("det F > 0");
            let term = bulk / 4.0 * (j * j - 1.0 - 2.0 * j.ln());
            let kept = if j < 1.0 { term } else { 0.0 };
            assert!((response.energy(0.0) - kept).abs() < 1e-12 * bulk, "at {stretches:?}");
            let pressure = if j < 1.0 { 0.5 * bulk * (j * j - 1.0) } else { 0.0 };
            for i in 0..3 {
                let exact = pressure / stretches[i];
                assert!((response.piola(0.0)[(i, i)] - exact).abs() < 1e-12 * bulk);
            }
        }
    }
}

/// One of each of the laws that come as examples.
fn examples() -> [Material; 3] {
    let made = |law: Result<Material, _>| law.expect("a law");
    [
        made(Material::hyperelastic(MooneyRivlin {
            c10_mpa: 40.0,
            c01_mpa: 15.0,
            bulk_mpa: 200.0,
        })),
        made(Material::hyperelastic(Ogden {
            terms: vec![(63.0, 1.3), (0.12, 5.0), (-10.0, -2.0)],
            bulk_mpa: 150.0,
        })),
        made(Material::hyperelastic(SaintVenantKirchhoff { lame_mpa: 110.0, shear_mpa: 110.0 })),
    ]
}

#[test]
fn the_parts_of_every_split_add_up_and_are_continuous_at_equal_and_at_zero_strains() {
    let moduli = Moduli::new(YOUNG, POISSON);
    let respond = |split, strain| Printed::Hencky.fused().respond(split, &moduli, strain);
    let strains = [
        [0.1, -0.2, 0.05],
        [-0.1, -0.1, 0.3],
        [0.1, 0.1, 0.1],
        [-0.2, -0.2, -0.2],
        [1e-9, -1e-9, 0.0],
        [0.0; 3],
    ];
    for strain in strains {
        let whole = respond(Split::None, strain).plus;
        for split in [Split::VolumetricDeviatoric, Split::Spectral] {
            assert_same(&respond(split, strain).merged().plus, &whole, 1e-13, &strain);
        }
    }
    // both strains through zero, hardly apart: the shear term stays between its two limits
    for tiny in [1e-3, 1e-9, 1e-15, 1e-300] {
        let part = respond(Split::Spectral, [tiny, -0.5 * tiny, 0.0]).plus;
        let share = part.shear[2] / moduli.shear;
        assert!((share - 2.0 / 3.0).abs() < 1e-6, "{share} of μ at {tiny}");
    }
}

#[test]
fn a_hybrid_material_degrades_all_and_is_driven_by_the_part() {
    let field = PhaseField { split: Split::Spectral, hybrid: true, ..PhaseField::new(1.0) };
    let steel = Material::hencky(YOUNG, POISSON).with_fracture(Fracture::new(1.0));
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(14);
    for (state, _) in states(&mut rng) {
        let of = |field| steel.at_point(Some(&field)).respond(&state).expect("det F > 0");
        let hybrid = of(field);
        let split = of(PhaseField { hybrid: false, ..field });
        let whole = of(PhaseField { split: Split::None, ..field });
        assert_eq!(hybrid.driving_energy(), split.driving_energy());
        let difference = (hybrid.piola(0.3) - whole.piola(0.3)).norm();
        assert!(difference <= 1e-13 * whole.piola(0.3).norm());
    }
}

/// The Kirchhoff stress of the Hencky law against log b by the series
/// log b = 2 (Z + Z³/3 + Z⁵/5 + …), Z = (b − I)(b + I)⁻¹, which needs no eigenvalues.
#[test]
fn spectral_stress_equals_the_series_logarithm() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(3);
    let material = point_material(Printed::Hencky.fused(), Split::None);
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
    let material = point_material(Printed::Hencky.fused(), Split::None);
    let mirrored = Matrix3::from_diagonal(&[-2.0, 0.0, 0.0].into());
    assert!(material.respond(&mirrored).is_err());
    assert!(material.respond(&Matrix3::from_element(f64::NAN)).is_err());
}
