//! The law at several points against dual numbers, and its kinematics against the single point.

use faer::traits::pulp::{self, WithSimd};
use nalgebra::{Matrix3, SMatrix, SVector};
use num_dual::hessian;
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;
use crate::material::tests::{POISSON, Printed, YOUNG, damaged, states};
use crate::material::{Fracture, Inverted, Material, POINTS, PhaseField};
use crate::operator::dispatch;

/// What one point gives, in the global axes or, as `strain` and below, in the principal basis.
#[derive(Clone, Debug)]
struct Point {
    piola: [[f64; 3]; 3],
    piola_plus: [[f64; 3]; 3],
    energies: [f64; 2],
    /// The block of the reference gradients (1, −2, 0.5) and (0.3, 0.7, −1.1).
    block: [[f64; 3]; 3],
    strain: [f64; 3],
    stress: [f64; 3],
    normal: [[f64; 3]; 3],
    coth: [f64; 3],
}

const GRADIENTS: [[f64; 3]; 2] = [[1.0, -2.0, 0.5], [0.3, 0.7, -1.1]];

/// The response of one material at displacement gradients, as many at once as there are lanes.
struct Responses<'a> {
    material: &'a PointMaterial,
    g: f64,
    states: &'a [Matrix3<f64>],
}

impl WithSimd for Responses<'_> {
    type Output = Result<Vec<Point>, Inverted>;

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let form = HenckyForm::of(std::slice::from_ref(self.material)).expect("a Hencky solid");
        let mut points = Vec::new();
        for states in self.states.chunks(Many::<S>::COUNT) {
            let mut h = [[Many::splat(simd, 0.0); 3]; 3];
            for i in 0..3 {
                for j in 0..3 {
                    let mut column = [0.0; POINTS];
                    for (x, state) in column.iter_mut().zip(states) {
                        *x = state[(i, j)];
                    }
                    h[i][j] = Many::load(simd, &column);
                }
            }
            let principal = PrincipalMany::new(&h)?;
            let [volumetric, shear] = form.moduli(self.material);
            let moduli = [Many::splat(simd, volumetric), Many::splat(simd, shear)];
            let response = form.respond(moduli, Many::splat(simd, self.g), &principal);
            let one = Many::splat(simd, 1.0);
            let tangent = response.tangent(one);
            let mut spatial = [principal.strain; 2];
            for (spatial, gradient) in spatial.iter_mut().zip(&GRADIENTS) {
                for i in 0..3 {
                    spatial[i] = dot(&principal.push[i], &gradient.map(|x| one.constant(x)));
                }
            }
            let piola = principal.piola(&response.stress, one);
            let plus = principal.piola(&response.stress_plus, one);
            let block = tangent.block(&principal.basis, &spatial[0], &spatial[1]);
            for lane in 0..states.len() {
                let at = |x: Many<S>| {
                    let mut column = [0.0; POINTS];
                    x.store(&mut column);
                    column[lane]
                };
                let matrix = |m: &[[Many<S>; 3]; 3]| m.map(|row| row.map(at));
                points.push(Point {
                    piola: matrix(&piola),
                    piola_plus: matrix(&plus),
                    energies: [at(response.energy), at(response.driving)],
                    block: matrix(&block),
                    strain: principal.strain.map(at),
                    stress: response.stress.map(at),
                    normal: std::array::from_fn(|i| {
                        std::array::from_fn(|j| match i == j {
                            true => at(tangent.diagonal[i][i]) + at(response.stress[i]),
                            false => at(tangent.normal[3 - i - j]),
                        })
                    }),
                    coth: response.coth.map(at),
                });
            }
        }
        Ok(points)
    }
}

/// The same with the widest registers of this machine, and one by one.
fn respond(
    material: &PointMaterial,
    g: f64,
    states: &[Matrix3<f64>],
) -> [Result<Vec<Point>, Inverted>; 2] {
    let all = || Responses { material, g, states };
    [dispatch(all()), pulp::Scalar::new().vectorize(all())]
}

fn forms() -> Vec<(Split, PointMaterial)> {
    let steel = Material::hencky(YOUNG, POISSON);
    let mut forms = Vec::new();
    for split in [Split::None, Split::VolumetricDeviatoric, Split::Spectral] {
        forms.push((split, damaged(steel.clone(), split)));
        let field = PhaseField { split, hybrid: true, ..PhaseField::new(1.0) };
        let material = steel.clone().with_fracture(Fracture::new(1.0));
        forms.push((split, material.at_point(Some(&field))));
    }
    forms
}

/// Displacement gradients near and far from each other's principal axes and stretches.
fn gradients() -> Vec<Matrix3<f64>> {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(21);
    let mut all: Vec<Matrix3<f64>> = states(&mut rng).into_iter().map(|s| s.0).collect();
    let spin = nalgebra::Rotation3::from_euler_angles(0.9, -0.4, 1.7).into_inner();
    let stretched = |d: [f64; 3]| Matrix3::from_diagonal(&d.into());
    all.push(Matrix3::zeros());
    all.push(spin - Matrix3::identity());
    all.push(stretched([0.0, 0.0, -0.3]));
    all.push(stretched([-0.2, 0.4, -0.2]));
    all.push(spin * (Matrix3::identity() + stretched([0.5, -0.4, 0.1])) - Matrix3::identity());
    for k in 0..60 {
        let size = 0.3 * 10f64.powi(-(k % 12));
        let shear = Matrix3::from_fn(|_, _| size * rng.random_range(-1.0..1.0));
        all.push(shear);
        all.push(shear + Matrix3::identity() * rng.random_range(-0.3..0.3));
    }
    all
}

#[test]
fn several_points_give_what_each_gives_alone() {
    let all = gradients();
    let [a, b] = GRADIENTS;
    for (split, material) in forms() {
        for g in [1.0, 0.3] {
            for many in respond(&material, g, &all) {
                let many = many.expect("no state is inverted");
                assert_eq!(many.len(), all.len());
                for (point, state) in many.iter().zip(&all) {
                    let single = material.respond(state).expect("det F > 0");
                    // what a rotation leaves of strain
                    let rest = 2e-15 * state.norm();
                    let whole = single.piola(1.0).norm();
                    let near = |x: &[[f64; 3]; 3], y: Matrix3<f64>, tolerance: f64| {
                        let error = (Matrix3::from_fn(|i, j| x[i][j]) - y).norm();
                        assert!(error <= tolerance, "{error:e} {split:?} {g} {state}");
                    };
                    near(&point.piola, single.piola(g), 1e-12 * whole + rest * YOUNG);
                    near(&point.piola_plus, single.piola_plus(), 1e-12 * whole + rest * YOUNG);
                    let energies = [single.energy(g), single.driving_energy()];
                    for (x, y) in point.energies.into_iter().zip(energies) {
                        let tolerance = 1e-12 * single.energy(1.0) + rest * rest * YOUNG;
                        assert!((x - y).abs() <= tolerance, "{x} {y} {split:?} {g} {state}");
                    }
                    let [e, f, g_] = point.strain;
                    let kink = [e, f, g_, e + f + g_].into_iter().any(|x| x.abs() <= rest);
                    if split == Split::None || !kink {
                        let tangent = single.tangent(g);
                        let block = tangent.block(&single.spatial(&a), &single.spatial(&b));
                        near(&point.block, block, 1e-12 * block.norm());
                    }
                }
            }
        }
    }
}

/// Stress and tangent against the printed energy, differentiated by dual numbers.
#[test]
fn the_law_is_the_derivative_of_its_energy() {
    let close = |x: f64, y: f64, tolerance: f64, strain: &[f64; 3]| {
        assert!((x - y).abs() <= tolerance * YOUNG, "{x} and {y} at {strain:?}")
    };
    let all = gradients();
    for (split, material) in forms() {
        let hybrid = material.damage.is_some_and(|d| d.hybrid);
        for many in respond(&material, 0.3, &all) {
            for point in many.expect("no state is inverted") {
                let e = point.strain;
                let factor = [0.3, if hybrid { 0.3 } else { 1.0 }];
                let (energy, stress, tangent): (f64, SVector<f64, 3>, SMatrix<f64, 3, 3>) = hessian(
                    |e| {
                        let [plus, minus] = Printed::Hencky.energies(split, [e[0], e[1], e[2]]);
                        plus * factor[0] + minus * factor[1]
                    },
                    &SVector::from(e),
                );
                close(point.energies[0], energy, 1e-12, &e);
                // rest is on either side of the kinks of a split
                let rest = e.into_iter().chain([e.iter().sum()]).any(|x| x.abs() < 1e-15);
                for i in 0..3 {
                    close(point.stress[i], stress[i], 1e-12, &e);
                    for j in 0..3 {
                        if split == Split::None || !rest {
                            close(point.normal[i][j], tangent[(i, j)], 1e-12, &e);
                        }
                    }
                    let x = e[(i + 1) % 3] - e[(i + 2) % 3];
                    if x.abs() > 1e-2 {
                        let difference = stress[(i + 1) % 3] - stress[(i + 2) % 3];
                        close(point.coth[i], 0.5 * difference / x.tanh(), 1e-11, &e);
                    }
                }
            }
        }
    }
}

#[test]
fn one_inverted_point_is_reported() {
    let (_, material) = forms().swap_remove(0);
    for bad in [Matrix3::from_diagonal(&[-2.0, 0.0, 0.0].into()), Matrix3::from_element(f64::NAN)] {
        for place in 0..POINTS {
            let mut states = vec![Matrix3::zeros(); POINTS];
            states[place] = bad;
            assert!(respond(&material, 1.0, &states).iter().all(Result::is_err));
        }
    }
}

/// ln(1 + x) against the library's, from the least numbers to the largest.
#[test]
fn logarithms_are_those_of_the_library() {
    struct Logarithms<'a>(&'a [f64; POINTS]);
    impl WithSimd for Logarithms<'_> {
        type Output = [f64; POINTS];

        #[inline(always)]
        fn with_simd<S: Simd>(self, simd: S) -> [f64; POINTS] {
            let mut out = [0.0; POINTS];
            Many::load(simd, self.0).ln_1p().store(&mut out);
            out
        }
    }
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(22);
    for k in 0..4000 {
        let size = 10f64.powi(k % 40 - 30);
        let mut x: [f64; POINTS] = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
        x.iter_mut().filter(|x| **x <= -1.0).for_each(|x| *x = -1.0 - 1.0 / *x);
        x[1] =
            [0.0, -0.999_999_999, -0.292_893_218_813_452_4, 0.414_213_562_373_095][k as usize % 4];
        for (x, y) in x.into_iter().zip(dispatch(Logarithms(&x))) {
            let exact = x.ln_1p();
            assert!(
                (y - exact).abs() <= 8e-16 * exact.abs(),
                "ln(1 + {x:e}) = {y:e}, not {exact:e}"
            );
        }
    }
}
