//! Logarithms and exponentials in SIMD lanes, compared with the standard library.

use faer::traits::pulp::{Simd, WithSimd};
use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::*;

/// Computes ln(1 + x), ln x, e^x and e^x − 1 in SIMD lanes.
struct Functions<'a>(&'a [f64; POINTS]);

impl WithSimd for Functions<'_> {
    /// The values, and the number of lanes.
    type Output = ([[f64; POINTS]; 4], usize);

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) -> Self::Output {
        let x = SimdF64::load(simd, self.0);
        let mut out = [[0.0; POINTS]; 4];
        for (values, out) in [x.ln_1p(), x.ln(), x.exp(), x.exp_m1()].iter().zip(&mut out) {
            values.store(out);
        }
        (out, SimdF64::<S>::COUNT)
    }
}

/// ln(1 + x) and ln x, compared with the standard library, from the smallest to the largest numbers.
#[test]
fn logarithms_agree_with_the_standard_library() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(22);
    for k in 0..4000 {
        let size = 10f64.powi(k % 40 - 30);
        let mut x: [f64; POINTS] = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
        x.iter_mut().filter(|x| **x <= -1.0).for_each(|x| *x = -1.0 - 1.0 / *x);
        x[1] =
            [0.0, -0.999_999_999, -0.292_893_218_813_452_4, 0.414_213_562_373_095][k as usize % 4];
        let ([near_one, ..], lanes) = crate::operator::dispatch(Functions(&x));
        let absolute = x.map(|x| x.abs().max(1e-300));
        let ([_, plain, ..], _) = crate::operator::dispatch(Functions(&absolute));
        for lane in 0..lanes {
            let exact = x[lane].ln_1p();
            let error = (near_one[lane] - exact).abs();
            assert!(error <= 8e-16 * exact.abs(), "ln(1 + {:e}) is off by {error:e}", x[lane]);
            let exact = absolute[lane].ln();
            let error = (plain[lane] - exact).abs();
            let bound = 8e-16 * exact.abs().max(0.5);
            assert!(error <= bound, "ln {:e} is off by {error:e}", absolute[lane]);
        }
    }
}

/// e^x and e^x − 1, compared with the standard library, up to overflow, and for NaN.
#[test]
fn exponentials_agree_with_the_standard_library() {
    let mut rng = Xoshiro256PlusPlus::seed_from_u64(23);
    for k in 0..4000 {
        let size = 10f64.powi(k % 32 - 29);
        let mut x: [f64; POINTS] = std::array::from_fn(|_| size * rng.random_range(-1.0..1.0));
        x.iter_mut().for_each(|x| *x = x.clamp(-700.0, 700.0));
        let ln_2 = std::f64::consts::LN_2;
        x[0] = [0.0, 0.5 * ln_2, -0.5 * ln_2, 1.5 * ln_2, -1.0, 700.0, -700.0][k as usize % 7];
        let ([.., exp, exp_m1], lanes) = crate::operator::dispatch(Functions(&x));
        for lane in 0..lanes {
            for (y, exact) in [(exp[lane], x[lane].exp()), (exp_m1[lane], x[lane].exp_m1())] {
                let error = (y - exact).abs();
                assert!(error <= 9e-16 * exact.abs(), "{:e}: {y:e} and {exact:e}", x[lane]);
            }
        }
    }
    for (x, exp) in [(800.0, f64::INFINITY), (-800.0, 0.0), (f64::INFINITY, f64::INFINITY)] {
        let ([.., exponential, less_one], _) = crate::operator::dispatch(Functions(&[x; POINTS]));
        assert_eq!((exponential[0], less_one[0]), (exp, exp - 1.0), "{x}");
    }
    let ([.., exp, exp_m1], _) = crate::operator::dispatch(Functions(&[f64::NAN; POINTS]));
    assert!(exp[0].is_nan() && exp_m1[0].is_nan());
}
